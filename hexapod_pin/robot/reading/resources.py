"""A URDF names meshes and packages, and a xacro file names includes; their files are found here.

Robots are downloaded without the workspace that they were written in, so each name is looked for
where ROS, Gazebo and PyBullet would, and then near the URDF by the end of its path.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Literal
from urllib.parse import unquote

from hexapod_pin.robot.reading.folder_index import (
    FolderIndex,
    FolderListing,
    TailSearch,
    folder_entries,
    other_names,
)
from hexapod_pin.user_file import read_bytes, user_path

NEAR_ASCENT = 3
"""Folders above the URDF in which the end of a foreign path is looked for."""
MAX_TAIL = 12
"""Most parts of the end of a path that is looked for."""
MAX_SHOWN = 8
"""Places that `why` lists."""


class ResourceFinder:
    """Files by the names that a URDF gives them.

    A name is looked for, in this order: in its package (a folder of `package_path`; a folder above
    the URDF, beside or below those; the folders of ROS's and Gazebo's variables) or at its path
    (relative to the URDF, to its package, to folders above); the longest end of the path that
    exists near the URDF; a search below the URDF's folder, its package and `package_path` for the
    longest end; and last the same with another extension of a mesh. Letter case need not agree.
    Links of folders are not followed by the search, which reads a limited number of entries;
    nothing is fetched from a network.
    """

    def __init__(self, urdf_path: str | Path, package_path: Sequence[str | Path] = ()) -> None:
        """Take the URDF's path and folders that hold packages, or are packages.

        Args:
            urdf_path: the file that names the resources; it need not exist.
            package_path: looked into before anything else.
        """
        self.urdf_path = Path(os.path.abspath(user_path(urdf_path)))
        self.package_path = tuple(
            Path(os.path.abspath(user_path(folder))) for folder in package_path
        )
        self._packages = PackageFolders(self.urdf_path.parent, self.package_path)
        self._listing = FolderListing()
        self._found: dict[str, tuple[Path | None, str]] = {}

    def find(self, uri: str) -> Path | None:
        """Return the file of a name; None where there is none. Raises nothing for odd names."""
        return self._lookup(uri)[0]

    def note(self, uri: str) -> str:
        """Return what was assumed to find a file: another place or extension; else empty."""
        path, text = self._lookup(uri)
        return text if path is not None else ""

    def why(self, uri: str) -> str:
        """Return a sentence on how a name was found, or what was tried and a remedy."""
        path, text = self._lookup(uri)
        return text if path is None else f"{_short(uri)}: {path}{f' ({text})' if text else ''}"

    def package(self, name: str) -> Path | None:
        """Return the folder of a package; None where it is not found."""
        if not name or "\0" in name or "/" in name or name in (".", ".."):
            return None
        return next(iter(self._packages.folders(name)), None)

    def _lookup(self, uri: str) -> tuple[Path | None, str]:
        """Return the file and what was assumed, or None and the reason; once for each name."""
        if uri not in self._found:
            found = self._search(uri, uri)
            if found[0] is None and "%" in uri and (decoded := unquote(uri)) != uri:
                again = self._search(uri, decoded)
                found = again if again[0] is not None else found
            self._found[uri] = found
        return self._found[uri]

    def _search(self, uri: str, text: str) -> tuple[Path | None, str]:
        """Return the same of `text`, which stands for the name `uri`."""
        if (parsed := parse_resource_uri(text)) is None:
            return None, f"{_short(uri)}: not the name of a file"
        if any(
            one is not None and one.leaves for one in (parsed, parse_resource_uri(unquote(text)))
        ):
            return None, f"{_short(uri)}: leads out of its package. Give a path inside of it"
        places = [*self._places(parsed)]
        if (found := self._first(places)) is not None:
            return found, ""
        if (found := self._first((f, t) for t in _tails(parsed) for f in self._near)) is not None:
            return found, "by the end of its path"
        if (found := self._tail_search.same_name(parsed.tail)) is not None:
            return found, "by the end of its path"
        note = f"in place of {parsed.parts[-1]}"
        renamed = ((folder, name) for folder, parts in places for name in other_names(parts))
        if (found := self._first(renamed)) is not None:
            return found, note
        if (found := self._tail_search.other_extension(parsed.tail)) is not None:
            return found, f"{note}, by the end of its path"
        return None, self._reason(uri, parsed, [f.joinpath(*parts) for f, parts in places])

    def _first(self, places: Iterable[tuple[Path, tuple[str, ...]]]) -> Path | None:
        """Return the first file that exists of folders and paths below them."""
        files = (self._listing.file(folder, parts) for folder, parts in places)
        return next((file for file in files if file is not None), None)

    @cached_property
    def _tail_search(self) -> TailSearch:
        own = self._packages.own
        folders = (self.urdf_path.parent, *((own,) if own else ()), *self.package_path)
        return TailSearch(self.urdf_path, [FolderIndex(f) for f in dict.fromkeys(folders)])

    @cached_property
    def _near(self) -> tuple[Path, ...]:
        """The URDF's folder, the next above it, its package, and folders given."""
        own = self._packages.own
        above = self._packages.above[: NEAR_ASCENT + 1]
        return tuple(dict.fromkeys((*above, *((own,) if own else ()), *self.package_path)))

    def _places(self, uri: ResourceUri) -> Iterator[tuple[Path, tuple[str, ...]]]:
        """Yield folder and path below it, of every place where the name could stand."""
        if uri.scheme == "package":
            for folder in self._packages.folders(uri.package):
                yield folder, uri.parts
            for folder in self._packages.above:
                yield folder, uri.parts
        elif uri.scheme == "absolute":
            yield Path(self.urdf_path.anchor), uri.parts
        elif uri.scheme == "relative":
            for folder in (*self._near, *_variable_folders()):
                yield folder, uri.parts

    def _reason(self, uri: str, parsed: ResourceUri, tried: Sequence[Path]) -> str:
        """Return why a name was not found, what was tried, and a remedy."""
        texts = [f"{_short(uri)}: not found"]
        if parsed.scheme == "remote":
            texts = [f"{_short(uri)}: nothing is fetched from a network, and no copy lies here"]
        elif parsed.package and not self._packages.folders(parsed.package):
            texts[0] += f", nor a package {parsed.package!r}"
        shown = [str(path) for path in islice(dict.fromkeys(tried), MAX_SHOWN)]
        if shown:
            texts.append("tried " + ", ".join(shown) + (", ..." if len(tried) > len(shown) else ""))
        texts.append(f"and any path below {self.urdf_path.parent} that ends alike")
        return "; ".join(texts) + ". Give the folder that holds it by package_path=[...]."


def _tails(uri: ResourceUri) -> Iterator[tuple[str, ...]]:
    """Yield the ends of a path, longest first, down to a folder and a name."""
    tail = uri.tail[-MAX_TAIL:]
    shortest = 1 if uri.scheme == "absolute" else 2
    for start in range(max(0, len(tail) - shortest + 1)):
        yield tail[start:]


def _variable_folders() -> list[Path]:
    """Return the folders of ROS 1's and Gazebo's variables."""
    return [folder for variable in FOLDER_VARIABLES for folder in folders_of(variable)]


def _short(uri: str) -> str:
    """Return a name for a message, cut where it is very long."""
    return repr(uri if len(uri) <= 200 else uri[:200] + "...")


# Where packages lie: around the URDF, in given folders, and where ROS's variables point.
#
# ROS_PACKAGE_PATH is ROS 1's, AMENT_PREFIX_PATH (share/<package>) ROS 2's; the others are Gazebo's.

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


# The parts of a file name in a URDF or an include: scheme, package and path.

MAX_URI_LENGTH = 4096
"""Longest name that is looked for [characters]."""

Scheme = Literal["package", "absolute", "relative", "remote"]

_SCHEME = re.compile(r"([a-z][a-z0-9+.-]+):/*", re.IGNORECASE)
_FIND = re.compile(r"(?:file:/*)?\$\(\s*(?:find|find-pkg-share)\s+([^)]+?)\s*\)/*(.*)", re.DOTALL)
_DRIVE = re.compile(r"/*[a-z]:/", re.IGNORECASE)


@dataclass(frozen=True)
class ResourceUri:
    """A name, taken apart.

    Attributes:
        scheme: package, absolute, relative; remote is what only a network could give.
        package: name of the package; empty without one.
        parts: the path below the package, the root or the URDF's folder.
    """

    scheme: Scheme
    package: str
    parts: tuple[str, ...]

    @property
    def leaves(self) -> bool:
        """Whether the path leads out of its package."""
        depth = 0
        for part in self.parts:
            depth += -1 if part == ".." else 1
            if depth < 0:
                return self.scheme == "package"
        return False

    @property
    def tail(self) -> tuple[str, ...]:
        """The path with its package in front and without "..": what a copy elsewhere ends with."""
        parts = tuple(part for part in self.parts if part != "..")
        return (self.package, *parts) if self.package else parts


def parse_resource_uri(uri: str) -> ResourceUri | None:
    r"""Take a name apart; None where it can name no file.

    Args:
        uri: package://pkg/path, model://pkg/path, file:///path, $(find pkg)/path, C:\path, /path or
            a relative path; backslashes count as slashes.
    """
    text = uri.strip().replace("\\", "/")
    if not text or len(text) > MAX_URI_LENGTH or "\0" in text:
        return None
    if found := _FIND.fullmatch(text):
        return _made("package", found[1], found[2])
    if _DRIVE.match(text):
        return _made("absolute", "", text.lstrip("/")[2:])
    if found := _SCHEME.match(text):
        return _with_scheme(found[1].lower(), text[found.end() :])
    return _made("absolute" if text.startswith("/") else "relative", "", text)


def _with_scheme(scheme: str, rest: str) -> ResourceUri | None:
    """Return the parts of a name behind its scheme and slashes."""
    if scheme in ("package", "model"):
        package, _, path = rest.partition("/")
        return _made("package", package, path)
    if scheme == "file":
        rest = unquote(rest).removeprefix("localhost/")
        if "\0" in rest:
            return None
        near = rest.startswith(("./", "../"))
        return _made("relative" if near else "absolute", "", re.sub(r"^[A-Za-z]:/", "", rest))
    return _made("remote", "", unquote(rest)) if "\0" not in unquote(rest) else None


def _made(scheme: Scheme, package: str, path: str) -> ResourceUri | None:
    """Return the parts of a path; None where nothing is left."""
    parts = tuple(part for part in path.split("/") if part not in ("", "."))
    if not parts or parts[-1] == ".." or package in (".", ".."):
        return None
    return ResourceUri(scheme, package, parts)
