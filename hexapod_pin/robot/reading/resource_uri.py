"""What the file name of a URDF's mesh or of an include says: scheme, package and path."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal
from urllib.parse import unquote

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
