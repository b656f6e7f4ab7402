"""Finding the files that a URDF names: meshes, and what a xacro file includes.

Robots are downloaded without the workspace that they were written in, so each name is looked for
where ROS, Gazebo and PyBullet would, and then near the URDF by the end of its path.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from itertools import islice
from pathlib import Path
from urllib.parse import unquote

from hexapod_pin.robot.reading.folder_index import FolderIndex, FolderListing
from hexapod_pin.robot.reading.packages import FOLDER_VARIABLES, PackageFolders, folders_of
from hexapod_pin.robot.reading.resource_uri import ResourceUri, parse_resource_uri
from hexapod_pin.robot.reading.tail_search import TailSearch, other_names
from hexapod_pin.user_file import user_path

NEAR_ASCENT = 3
"""Folders above the URDF in which the end of a foreign path is looked for."""
MAX_TAIL = 12
"""Most parts of the end of a path that is looked for."""
MAX_TOLD = 8
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
        """Return a sentence on how a name was found, or what was tried and the way out."""
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
        """Return why a name was not found, what was tried, and the way out."""
        texts = [f"{_short(uri)}: not found"]
        if parsed.scheme == "remote":
            texts = [f"{_short(uri)}: nothing is fetched from a network, and no copy lies here"]
        elif parsed.package and not self._packages.folders(parsed.package):
            texts[0] += f", nor a package {parsed.package!r}"
        told = [str(path) for path in islice(dict.fromkeys(tried), MAX_TOLD)]
        if told:
            texts.append("tried " + ", ".join(told) + (", ..." if len(tried) > len(told) else ""))
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
