"""Looking for files in and below a folder: bounded, without following links of folders."""

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
    """The files below a folder, nearest first, read when first asked for."""

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
