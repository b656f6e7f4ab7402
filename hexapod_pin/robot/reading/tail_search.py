"""The last resort: files below a folder whose path ends as the one that was named."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

from hexapod_pin.robot.reading.folder_index import FolderIndex, folder_entries

MESH_EXTENSIONS = (".stl", ".dae", ".obj", ".ply", ".glb", ".gltf")
"""Extensions of meshes that can be read, in the order in which they stand in for another."""

Parts = tuple[str, ...]


class TailSearch:
    """Files by the ends of their paths.

    The longest common end wins, then a path through a folder with the URDF's name (before its
    extension), then the nearer, then the first by name. A common end of the file name alone counts
    only if no other file has it. Folders outside the common end with the name of another URDF
    beside this one are that robot's, and are left out.
    """

    def __init__(self, urdf_path: Path, indices: Sequence[FolderIndex]) -> None:
        """Take the URDF and the folders to search, in order."""
        self.urdf_path, self.indices = urdf_path, tuple(indices)

    def same_name(self, tail: Parts) -> Path | None:
        """Return the file whose path ends most like `tail`, its name the same but for case."""
        for index in self.indices:
            if (found := self._best(index.ending(tail[-1]), tail)) is not None:
                return index.folder.joinpath(*found)
        return None

    def other_extension(self, tail: Parts) -> Path | None:
        """Return such a file with another extension of a mesh."""
        stem, extension = os.path.splitext(tail[-1])
        if extension.casefold() not in MESH_EXTENSIONS:
            return None
        for index in self.indices:
            for other in MESH_EXTENSIONS:
                alike = [p for p in index.alike(stem) if p[-1].casefold().endswith(other)]
                if (found := self._best(alike, (*tail[:-1], stem + other))) is not None:
                    return index.folder.joinpath(*found)
        return None

    def _best(self, paths: Sequence[Parts], tail: Parts) -> Parts | None:
        """Return the path with the longest common end."""
        ours = [path for path in paths if not self._is_of_another(path[: -_common(path, tail)])]
        ranked = sorted(ours, key=lambda path: self._rank(path, tail))
        if not ranked or (_common(ranked[0], tail) < min(2, len(tail)) and len(ranked) > 1):
            return None
        return ranked[0]

    def _rank(self, path: Parts, tail: Parts) -> tuple[int, bool, int, Parts]:
        """Return the order of preference of a path: smaller is better."""
        folders = {part.casefold() for part in path[:-1]}
        return -_common(path, tail), self._stem not in folders, len(path), path

    def _is_of_another(self, folders: Parts) -> bool:
        """Tell whether a path leads through the folder of another robot."""
        return any(folder.casefold() in self._others for folder in folders)

    @cached_property
    def _stem(self) -> str:
        return _stem(self.urdf_path.name)

    @cached_property
    def _others(self) -> frozenset[str]:
        """Names of other robots beside the URDF."""
        names = [entry.name for entry in folder_entries(self.urdf_path.parent)]
        robots = (name for name in names if name.casefold().endswith(".urdf"))
        return frozenset(map(_stem, robots)) - {self._stem}


def other_names(parts: Parts) -> Iterator[Parts]:
    """Yield a path with the other extensions of meshes; nothing where it names no mesh."""
    stem, extension = os.path.splitext(parts[-1])
    if extension.casefold() in MESH_EXTENSIONS:
        for other in MESH_EXTENSIONS:
            if other != extension.casefold():
                yield (*parts[:-1], stem + other)


def _common(path: Parts, tail: Parts) -> int:
    """Return how many parts two paths have in common at their ends, whatever their case."""
    count = 0
    for mine, theirs in zip(reversed(path), reversed(tail), strict=False):
        if mine.casefold() != theirs.casefold():
            break
        count += 1
    return count


def _stem(name: str) -> str:
    """Return a file's name without .urdf, .xacro or .urdf.xacro, in lower case."""
    return name.casefold().removesuffix(".xacro").removesuffix(".urdf")
