"""Files are searched for in and below a folder, within bounds, by name or by the end of a path."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path

MAX_INDEX_ENTRIES = 20_000
"""Most entries of folders that one index reads; the nearest come first."""
MAX_INDEX_DEPTH = 8
"""Levels of folders that an index reads below its first."""
SKIPPED_FOLDERS = frozenset({"node_modules", "__pycache__", "build", "log"})
"""Folders that an index does not enter, beside those whose name begins with a dot."""


class FolderListing:
    """Files by name whatever its case; each folder is read once."""

    def __init__(self) -> None:
        """Know no folder yet."""
        self._names: dict[Path, dict[str, str]] = {}

    def file(self, folder: Path, parts: Sequence[str]) -> Path | None:
        """Return the file `folder`/`parts`, else the one spelled alike but for its case."""
        path = folder.joinpath(*parts)
        if os.path.isfile(path):
            return path
        below: Path | None = folder
        for part in parts[:-1]:
            below = self._below(below, part, os.path.isdir) if below is not None else None
        return self._below(below, parts[-1], os.path.isfile) if below is not None else None

    def names(self, folder: Path) -> dict[str, str]:
        """Return the names in a folder by their lower case; empty where it cannot be read."""
        if folder not in self._names:
            entries = islice(folder_entries(folder), MAX_INDEX_ENTRIES)
            self._names[folder] = {entry.name.casefold(): entry.name for entry in entries}
        return self._names[folder]

    def _below(self, folder: Path, name: str, fits: Callable[[Path], bool]) -> Path | None:
        """Return the entry of a folder by its name, exactly spelled or not."""
        exact = folder / name
        if fits(exact):
            return exact
        spelled = self.names(folder).get(name.casefold())
        found = folder / spelled if spelled is not None else None
        return found if found is not None and fits(found) else None


@dataclass(frozen=True)
class FolderIndex:
    """The files below a folder, nearest first, read at the first use."""

    folder: Path

    def ending(self, name: str) -> list[tuple[str, ...]]:
        """Return the paths (their parts below the folder) of files of this name and any case."""
        return self._by_name.get(name.casefold(), [])

    def alike(self, stem: str) -> list[tuple[str, ...]]:
        """Return the paths of files of this name before its extension, in any case."""
        return self._by_stem.get(stem.casefold(), [])

    @cached_property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """The parts of every file's path below the folder, at most `MAX_INDEX_ENTRIES`."""
        return tuple(islice(_files_below(self.folder), MAX_INDEX_ENTRIES))

    @cached_property
    def _by_name(self) -> dict[str, list[tuple[str, ...]]]:
        return _grouped(self.paths, str.casefold)

    @cached_property
    def _by_stem(self) -> dict[str, list[tuple[str, ...]]]:
        return _grouped(self.paths, lambda name: os.path.splitext(name)[0].casefold())


def folder_entries(folder: Path) -> Iterator[os.DirEntry[str]]:
    """Yield the entries of a folder; none where it is no folder or cannot be read."""
    try:
        with os.scandir(folder) as entries:
            yield from entries
    except (OSError, ValueError):
        return


def _files_below(folder: Path) -> Iterator[tuple[str, ...]]:
    """Yield the parts of the files below a folder, level by level, in order of names."""
    waiting: deque[tuple[str, ...]] = deque([()])
    left = MAX_INDEX_ENTRIES
    while waiting and left > 0:
        parts = waiting.popleft()
        entries = list(islice(folder_entries(folder.joinpath(*parts)), left))
        left -= len(entries)
        for entry in sorted(entries, key=lambda entry: entry.name):
            path = (*parts, entry.name)
            if not _is_folder(entry):
                if os.path.isfile(entry.path):
                    yield path
            elif len(path) <= MAX_INDEX_DEPTH and not _is_skipped(entry.name):
                waiting.append(path)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir(follow_symlinks=False)
    except OSError:
        return False


def _is_skipped(name: str) -> bool:
    return name.startswith(".") or name in SKIPPED_FOLDERS


def _grouped(
    paths: Sequence[tuple[str, ...]], key: Callable[[str], str]
) -> dict[str, list[tuple[str, ...]]]:
    """Group paths by a key of their last part."""
    groups: dict[str, list[tuple[str, ...]]] = {}
    for path in paths:
        groups.setdefault(key(path[-1]), []).append(path)
    return groups


# The last resort: files below a folder whose path ends as the one that was named.

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
        """Return whether a path leads through the folder of another robot."""
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
