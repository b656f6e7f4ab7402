"""Where packages lie: around the URDF, in given folders, and where ROS's variables point.

ROS_PACKAGE_PATH is ROS 1's, AMENT_PREFIX_PATH (share/<package>) ROS 2's; the others are Gazebo's.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import islice
from pathlib import Path

from hexapod_pin.robot.reading.folder_index import FolderIndex, folder_entries
from hexapod_pin.user_file import read_bytes

MAX_ASCENT = 16
"""Folders above the URDF that are looked into."""
MAX_SIBLINGS = 500
"""Entries beside a package whose package.xml is read."""
_MANIFEST_BYTES = 1_000_000
_NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")

SHARE_VARIABLES = ("AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH", "CMAKE_PREFIX_PATH")
FOLDER_VARIABLES = (
    "ROS_PACKAGE_PATH",
    "GAZEBO_MODEL_PATH",
    "GAZEBO_RESOURCE_PATH",
    "IGN_GAZEBO_RESOURCE_PATH",
    "GZ_SIM_RESOURCE_PATH",
)


class PackageFolders:
    """Folders of packages by name, as seen from one URDF."""

    def __init__(self, urdf_folder: Path, package_path: Sequence[Path]) -> None:
        """Take the folder of the URDF and folders that hold packages, or are packages."""
        self.above = (urdf_folder, *urdf_folder.parents)[:MAX_ASCENT]
        self.given = tuple(package_path)
        self._found: dict[str, tuple[Path, ...]] = {}
        self._indices: dict[Path, FolderIndex] = {}

    @cached_property
    def own(self) -> Path | None:
        """The package that the URDF lies in: the nearest folder above with a package.xml."""
        manifests = ("package.xml", "manifest.xml", "model.config")
        held = (f for f in self.above if any(os.path.isfile(f / name) for name in manifests))
        return next(held, None)

    def folders(self, package: str) -> tuple[Path, ...]:
        """Return the folders that may be this package, the likeliest first."""
        if package not in self._found:
            self._found[package] = tuple(dict.fromkeys(self._search(package)))
        return self._found[package]

    def _search(self, package: str) -> Iterator[Path]:
        """Yield the folders at the places agreed on; only without any, those found by searching."""
        agreed = list(self._agreed(package))
        yield from agreed or self._searched(package)

    def _agreed(self, package: str) -> Iterator[Path]:
        for folder in self.given:
            yield from _in_folder(folder, package)
        for folder in self.above:
            if _is_package(folder, package):
                yield folder
        for folder in self.above:
            if os.path.isdir(folder / package):
                yield folder / package
        for variable in SHARE_VARIABLES:
            for folder in folders_of(variable):
                if os.path.isdir(folder / "share" / package):
                    yield folder / "share" / package
        for variable in FOLDER_VARIABLES:
            for folder in folders_of(variable):
                yield from _in_folder(folder, package)

    def _searched(self, package: str) -> Iterator[Path]:
        """Yield packages deep below given folders, or beside the URDF's own package."""
        for folder in (*self.given, *folders_of("ROS_PACKAGE_PATH")):
            for parts in self._index(folder).ending("package.xml"):
                if _is_package(folder.joinpath(*parts[:-1]), package):
                    yield folder.joinpath(*parts[:-1])
        if self.own is not None:
            for entry in islice(folder_entries(self.own.parent), MAX_SIBLINGS):
                if package_name(Path(entry.path)) == package:
                    yield Path(entry.path)

    def _index(self, folder: Path) -> FolderIndex:
        if folder not in self._indices:
            self._indices[folder] = FolderIndex(folder)
        return self._indices[folder]


def package_name(folder: Path) -> str | None:
    """Return the <name> in a folder's package.xml; None without one."""
    try:
        found = _NAME.search(read_bytes(folder / "package.xml", _MANIFEST_BYTES))
    except (OSError, ValueError):
        return None
    return found[1].decode("utf-8", "replace") if found else None


def folders_of(variable: str) -> list[Path]:
    """Return the folders that an environment variable lists."""
    return [Path(text) for text in os.environ.get(variable, "").split(os.pathsep) if text]


def _is_package(folder: Path, package: str) -> bool:
    return folder.name == package or package_name(folder) == package


def _in_folder(folder: Path, package: str) -> Iterator[Path]:
    """Yield a package that is this folder or lies in it."""
    if _is_package(folder, package):
        yield folder
    for below in (folder / package, folder / "share" / package):
        if os.path.isdir(below):
            yield below
