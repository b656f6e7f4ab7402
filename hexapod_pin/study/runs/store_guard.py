"""The names of a store's files: a file there is the store's own, or it is refused and not changed.

SQLite overwrites and removes whatever has the name of its log, and follows a link to a file that it
then writes into. All of these names are therefore looked at before SQLite sees them.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from hexapod_pin.errors import StoreFullError, SweepStoreError
from hexapod_pin.user_file import kind_of

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What the system answers where a file cannot grow."""

READ_FLAGS = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY

HEAD = b"SQLite format 3\0"
"""By which a database begins."""


class _Side(NamedTuple):
    """How SQLite begins a file beside the database."""

    marks: tuple[bytes, ...]
    zeros: int  # length of what it leaves empty until the rest is on the disk


_VERSION = 3007000
_WAL = tuple(struct.pack(">II", mark, _VERSION) for mark in (0x377F0682, 0x377F0683))
SIDES = {
    "-wal": _Side(_WAL, 32),
    "-shm": _Side((struct.pack("=I", _VERSION),), 32),
    "-journal": _Side((bytes.fromhex("d9d505f920a163d7"),), 12),
}
"""The files that SQLite puts beside a database, by the ending of their names."""


def create(path: Path) -> os.stat_result | None:
    """Create the empty file of a store; None where something has its name already.

    Raises:
        StoreFullError: there is no room for a file.
        SweepStoreError: the system refuses it.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        file = os.open(path, flags, 0o644)
    except FileExistsError:
        return None
    except (OSError, ValueError) as error:
        raise refused(path, error) from error
    try:
        return os.fstat(file)
    finally:
        os.close(file)


def remove(path: Path, created: os.stat_result) -> None:
    """Remove the file of a store that `create` has made, and what SQLite has left beside it."""
    with contextlib.suppress(OSError, SweepStoreError), pinned(path, created) as file:
        if os.pread(file, len(HEAD), 0) in (b"", HEAD):
            path.unlink()
            for ending in SIDES:
                with contextlib.suppress(OSError, SweepStoreError):
                    _require_side(path, ending, write=True)
                    _beside(path, ending).unlink()


def require_own_file(path: Path, *, write: bool) -> os.stat_result:
    """Return what the file of a store is: a regular file, to be written under this name alone.

    A link is followed where the store is only read.

    Raises:
        SweepStoreError: it is missing, or something else.
    """
    try:
        found = os.lstat(path) if write else os.stat(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise SweepStoreError(str(path), "no such file.") from error
    except (OSError, ValueError) as error:
        raise SweepStoreError(str(path), f"cannot be opened ({_reason(error)}).") from error
    if not stat.S_ISREG(found.st_mode):
        raise SweepStoreError(
            str(path), f"is {kind_of(found.st_mode)}, not a file of its own; name another store."
        )
    if write and found.st_nlink > 1:
        raise SweepStoreError(
            str(path), f"has {found.st_nlink} names (hard links), and is written under one alone: "
            "copy it, or name another store.",
        )  # fmt: skip
    return found


@contextlib.contextmanager
def pinned(path: Path, found: os.stat_result) -> Iterator[int]:
    """Hold a file open that was found at a path, so that no new one can be taken for it.

    The number of an inode is given to the next file as soon as it is free. As for
    `require_own_sides`, this process must not have the store open.

    Raises:
        SweepStoreError: it cannot be opened, or something else is there now.
    """
    try:
        file = os.open(path, READ_FLAGS)
    except OSError as error:
        raise SweepStoreError(str(path), f"cannot be opened ({_reason(error)}).") from error
    try:
        now = os.fstat(file)
        same = os.path.samestat(now, found) and now.st_nlink == found.st_nlink
        if not same or not stat.S_ISREG(now.st_mode):
            raise replaced(path)
        yield file
    finally:
        os.close(file)


def replaced(path: Path) -> SweepStoreError:
    """Return the error of a store whose name another file has taken."""
    return SweepStoreError(str(path), "was replaced while it was opened; try again.")


def require_own_sides(path: Path, *, write: bool) -> None:
    """Refuse files beside a store that have the names of SQLite's and are not.

    It must not be called while this process has the store open: the locks of SQLite end where any
    file descriptor of the file is closed.

    Raises:
        SweepStoreError: there is one.
    """
    for ending in SIDES:
        _require_side(path, ending, write)


def _require_side(path: Path, ending: str, write: bool) -> None:
    beside = _beside(path, ending)
    try:
        mode = os.lstat(beside).st_mode
        what = kind_of(mode) if not stat.S_ISREG(mode) else _other_content(beside, ending, write)
    except FileNotFoundError:
        return
    except OSError as error:
        what = f"something that cannot be read ({_reason(error)})"
    if what:
        raise SweepStoreError(
            str(path), f"SQLite would write to {beside}, which is {what} and no file of its own: "
            "remove or rename that, or name another store.",
        )  # fmt: skip


def _other_content(beside: Path, ending: str, write: bool) -> str:
    """Return what a file beside a store is; empty of one of SQLite's."""
    file = os.open(beside, READ_FLAGS)
    try:
        found = os.fstat(file)
        if not stat.S_ISREG(found.st_mode):
            return kind_of(found.st_mode)
        if write and found.st_nlink > 1:
            return f"a file with {found.st_nlink} names (hard links)"
        marks, zeros = SIDES[ending]
        head = os.pread(file, zeros, 0)
    finally:
        os.close(file)
    if not head.strip(b"\0"):
        return ""
    # SQLite cuts its shared memory to three bytes before it writes it again
    begun = any(head.startswith(mark) or head == mark[:3] for mark in marks)
    return "" if begun else "a file of something else"


def _beside(path: Path, ending: str) -> Path:
    return path.with_name(path.name + ending)


def is_same(path: Path, found: os.stat_result) -> bool:
    """Tell whether a path still names a file itself, and not a link to it."""
    try:
        now = os.lstat(path)
    except OSError:
        return False
    return stat.S_ISREG(now.st_mode) and os.path.samestat(now, found)


def refused(path: Path, error: Exception) -> SweepStoreError:
    """Return the error of a store whose file or lock the system refuses to make or to look at."""
    reason = _reason(error)
    if getattr(error, "errno", None) in NO_ROOM:
        return StoreFullError(
            str(path), f"there is no room for it ({reason}); make room, or name another store.", 0
        )
    return SweepStoreError(
        str(path), f"cannot be written in {path.parent} ({reason}); name a file in a folder that "
        "exists and can be written to.",
    )  # fmt: skip


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
