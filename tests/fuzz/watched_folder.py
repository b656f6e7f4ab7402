"""A folder tree with files of others in it, which are looked at before and after an input.

An input works in `work`. Around it lie files that it has no business with, and some names in the
working folder lead to them: links, hard links, a pipe, devices.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

PAST = 1_000_000_000
"""Time of the last change of every file of others [s]: one that is written again has another."""

LARGEST_READ = 1_000_000
"""Of a larger file the size counts, not the content [bytes]."""

TEXTS: Mapping[str, str] = {
    "foreign/keys.txt": "secret keys\n", "foreign/precious": "a thesis\n",
    "foreign/precious.csv": "a,b\n1,2\n", "foreign/precious.nc": "measured for a year\n",
    "foreign/below/deep.txt": "deep\n", "home/.profile": "export A=1\n",
    "home/.config/other/settings": "b = 2\n", "tmp/of_another_program": "in use\n",
    "work/notes.txt": "notes\n", "work/.hidden": "hidden too\n",
    "work/walk.nc.backup": "kept\n", "work/data/measured.csv": "t,x\n0,0\n",
}  # fmt: skip
"""Files of others: path and content."""

LINKS: Mapping[str, str] = {
    "linked.nc": "../foreign/precious.nc", "linked.csv": "../foreign/precious.csv",
    "linked.html": "../foreign/keys.txt", "linked.db": "../foreign/precious",
    "linked.png": "../foreign/new.png", "linked_folder": "../foreign/below", "loop.nc": "loop.nc",
}  # fmt: skip
"""Links in the working folder: name and target; one leads to no file, one to itself."""

HARD_LINKS: Mapping[str, str] = {"hard.nc": "foreign/precious.nc", "hard.csv": "foreign/keys.txt"}
"""Further names, in the working folder, of files of others."""

PIPES = ("pipe.nc", "pipe.csv")
FOLDERS = ("folder.nc", "folder.html")
DEVICES: Mapping[str, tuple[int, int]] = {
    "null.nc": (1, 3), "zero.toml": (1, 5), "full.csv": (1, 7),
}  # fmt: skip
"""Nodes in the working folder, where the system lets them be made."""

HAZARDS = (*LINKS, *HARD_LINKS, *PIPES, *FOLDERS, *DEVICES)
"""All names in the working folder that lead to what no input may change."""

TEMPORARY = re.compile(r"\.hexapod-.*\.tmp$|-lock$|\.lock$|-journal$|-wal$|-shm$|\.part$|\.tmp$")
"""How names of files end that must be gone when a command has ended."""

SHARED_DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/tty", "/dev/random")


class Mark(NamedTuple):
    """What is looked at of a file; of a folder not its size and links, which change with use."""

    kind: int
    mode: int
    node: int
    links: int
    size: int
    modified: int
    content: str


def mark_of(path: Path | str) -> Mark:
    found = os.lstat(path)
    kind, content = stat.S_IFMT(found.st_mode), ""
    if kind == stat.S_IFREG and found.st_size <= LARGEST_READ:
        with open(path, "rb") as stream:
            content = hashlib.sha256(stream.read()).hexdigest()
    elif kind == stat.S_IFLNK:
        content = os.readlink(path)
    elif kind in (stat.S_IFCHR, stat.S_IFBLK):
        content = str(found.st_rdev)
    folder, used = kind == stat.S_IFDIR, kind not in (stat.S_IFREG, stat.S_IFLNK)
    return Mark(
        kind, stat.S_IMODE(found.st_mode), found.st_ino, 0 if folder else found.st_nlink,
        0 if folder else found.st_size, 0 if used else found.st_mtime_ns, content,
    )  # fmt: skip


class WatchedFolder:
    """The tree, with all that `TEXTS`, `LINKS` and the others list."""

    def __init__(self, root: Path) -> None:
        """Make the tree below an empty folder."""
        self.root = root
        self.work, self.home = root / "work", root / "home"
        self.temporary, self.foreign = root / "tmp", root / "foreign"
        for name, text in TEXTS.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        for name, target in LINKS.items():
            (self.work / name).symlink_to(target)
        for name, target in HARD_LINKS.items():
            (self.work / name).hardlink_to(root / target)
        for name in PIPES:
            os.mkfifo(self.work / name)
        for name in FOLDERS:
            (self.work / name).mkdir()
        for name, number in DEVICES.items():
            with contextlib.suppress(OSError):  # not everybody may
                os.mknod(self.work / name, stat.S_IFCHR | 0o666, os.makedev(*number))
        for name in TEXTS:
            os.utime(root / name, (PAST, PAST))
        self.hard_links = frozenset(self.work / name for name in HARD_LINKS)
        self.watch()

    def watch(self) -> None:
        """Look at all there is now: from now on it is of others, and must not change."""
        self.before = {path: mark_of(path) for path in self._all()}

    def accept(self) -> None:
        """Take what has changed for what is right from now on, hard links made anew."""
        for name, target in HARD_LINKS.items():
            (self.work / name).unlink(missing_ok=True)
            (self.work / name).hardlink_to(self.root / target)
        self.before = {path: mark_of(path) for path in self.before if os.path.lexists(path)}

    def clear(self) -> None:
        """Remove what is new in the tree, folders apart."""
        for path in set(self._all()) - self.before.keys():
            if path.is_relative_to(self.root) and (path.is_symlink() or not path.is_dir()):
                path.unlink()

    def changes(self, named: frozenset[Path] = frozenset()) -> list[str]:
        """Return what has changed in the files of others, one line each.

        A regular file that the input was to write may be replaced; another name of it then counts
        one name fewer.
        """
        found = list[str]()
        freed = {self.before[path].node for path in named if path in self.before}
        for path, before in self.before.items():
            if path in named and before.kind == stat.S_IFREG:
                continue
            try:
                pairs = zip(Mark._fields, before, mark_of(path), strict=True)
                differing = [name for name, one, other in pairs if one != other]
            except OSError:
                differing = ["is gone"]
            if before.node in freed and differing == ["links"]:
                continue
            if differing:
                found.append(f"{self._shown(path)} ({', '.join(differing)})")
        return found

    def new_files(self, named: frozenset[Path] = frozenset()) -> list[str]:
        """Return what is new, folders apart, but for what the input was to write."""
        new = [path for path in self._all() if path not in self.before and path not in named]
        return sorted(self._shown(path) for path in new if not path.is_dir() or path.is_symlink())

    def left_over(self, named: frozenset[Path] = frozenset()) -> list[str]:
        """Return new files whose names tell that they should be gone."""
        new = self.new_files(named)
        return [name for name in new if TEMPORARY.search(name) or name.startswith("tmp/")]

    def _all(self) -> Iterator[Path]:
        for folder, folders, files in os.walk(self.root):
            for name in (*folders, *files):
                yield Path(folder, name)
        yield from (Path(name) for name in SHARED_DEVICES if os.path.lexists(name))

    def _shown(self, path: Path) -> str:
        text = os.path.relpath(path, self.root) if path.is_relative_to(self.root) else str(path)
        return text.encode("unicode_escape", "surrogatepass").decode("ascii")
