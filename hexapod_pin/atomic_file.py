"""Write a file wholly or not at all."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import itertools
import os
import shutil
import stat
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from hexapod_pin.errors import TraceFileError
from hexapod_pin.stop_signals import unbroken
from hexapod_pin.user_file import user_path

MARK, ENDING = ".hexapod-", ".tmp"
"""How the name of a temporary file begins and ends."""

LONGEST_STEM = 100
"""Bytes of a file's name that the name of its temporary file repeats."""

TRIES = 100
"""Names tried for a temporary file."""

SHARED_ERRORS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS)
"""What a file system without locks answers."""

_number = itertools.count()


def write_atomically(
    path: str | Path, content: bytes | memoryview | str, *, replace: bool = True
) -> Path:
    """Put `content` at `path`; whatever goes wrong, the old file stays as it was.

    The bytes go to a temporary file in the same directory, reach the disk (fsync), and take the
    name in one step. The temporary file is removed on every failure, Ctrl-C included; one whose
    writer was killed, by the next that writes the same file. Writers hold a lock (`flock`) on their
    temporary file: what is not locked has no writer any more.

    Args:
        path: the file to write, which is no symbolic link: what a link leads to is somebody's.
            Links among the folders above it are followed. Its directory must exist.
        content: the whole content of the file; text as UTF-8.
        replace: whether a file of that name may be there.

    Returns:
        The path written to.

    Raises:
        FileExistsError: there is such a file, and it is not to be replaced.
        TraceFileError: the system refused (no such directory, no permission, disk full, ...); the
            message gives the bytes needed and, where known, the bytes free.
    """
    data = memoryview(_encoded(path, content)).cast("B")
    try:
        target = _target(path)
        sweep(target)
        with unbroken(), _temporary(target) as (temporary, stream):
            _write(stream, data)
            os.fsync(stream)
            (os.replace if replace else os.link)(temporary, target)
    except FileExistsError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise TraceFileError(_refusal(path, data.nbytes, error)) from error
    return target


def _encoded(path: str | Path, content: bytes | memoryview | str) -> bytes | memoryview:
    try:
        return content.encode() if isinstance(content, str) else content
    except UnicodeEncodeError as error:
        raise TraceFileError(f"{path}: cannot be written as UTF-8 ({error}).") from error


def _target(path: str | Path) -> Path:
    """Return the file that a path names, links among its folders followed.

    Raises:
        OSError: what is there is no regular file.
    """
    given = user_path(path)
    if given.name in ("", ".."):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    target = Path(os.path.realpath(given.parent)) / given.name
    with contextlib.suppress(FileNotFoundError):
        require_own_name(target)
    return target


def require_own_name(target: Path) -> None:
    """Refuse a name that is there and is not that of a regular file itself.

    What comes there afterwards is not written through either: a finished file takes the name.

    Raises:
        FileNotFoundError: nothing is there.
        OSError: it is a symbolic link, a folder, a pipe, a device or a socket.
    """
    mode = target.lstat().st_mode
    if stat.S_ISLNK(mode):
        raise OSError(errno.ELOOP, f"is a symbolic link to {os.readlink(target)}")
    if stat.S_ISDIR(mode):
        raise OSError(errno.EISDIR, "is a folder")
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is no regular file")


def _write(stream: int, content: memoryview) -> None:
    while content:
        content = content[os.write(stream, content[: 1 << 30]) :]


@contextlib.contextmanager
def _temporary(target: Path) -> Iterator[tuple[Path, int]]:
    """Give a temporary file beside `target`, locked while it is open; remove what is left of it."""
    temporary, stream = _created(target)
    try:
        with contextlib.suppress(OSError):  # a new file: as the umask says
            os.fchmod(stream, stat.S_IMODE(target.stat().st_mode))
        yield temporary, stream
    finally:
        with contextlib.suppress(OSError):
            if os.fstat(stream).st_ino == os.lstat(temporary).st_ino:
                temporary.unlink()
        os.close(stream)


def _created(target: Path) -> tuple[Path, int]:
    """Return a new temporary file, open and locked."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC | os.O_NOFOLLOW
    for _ in range(TRIES):
        name = f"{_prefix(target)}{os.getpid()}-{next(_number)}{ENDING}"
        temporary = target.with_name(name)
        try:
            stream = os.open(temporary, flags, 0o666)
        except FileExistsError:
            continue
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(stream).st_nlink:
                return temporary, stream
        except OSError as error:
            if error.errno in SHARED_ERRORS:  # nobody can prove such a file dead: it is never swept
                return temporary, stream
        os.close(stream)  # another writer, sweeping, came between creation and lock
    raise OSError(errno.EEXIST, "no name for a temporary file is free")


def _prefix(target: Path) -> str:
    stem = os.fsencode(target.name)[:LONGEST_STEM]
    return f".{os.fsdecode(stem)}{MARK}{_system()}-"


@lru_cache(maxsize=1)
def _system() -> str:
    """Return a name for this boot of this machine, its containers included."""
    try:
        text = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    except OSError:
        text = os.uname().nodename
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def sweep(target: Path) -> list[Path]:
    """Remove the temporary files of a target whose writers are dead; return them.

    A lock that can be taken proves it: the system gives it back when its holder ends, however that
    ends. Files of other machines stay, whose locks may not be seen here, and of earlier boots,
    which cannot be told from them; so do all where locks are not known.
    """
    found = []
    with contextlib.suppress(OSError):
        prefix = _prefix(target)
        for entry in os.scandir(target.parent):
            if entry.name.startswith(prefix) and entry.name.endswith(ENDING):
                found += [Path(entry.path)] if _removed(entry.path) else []
    return found


def _removed(path: str) -> bool:
    """Remove a temporary file without a writer; tell whether there was one."""
    try:
        stream = os.open(path, os.O_WRONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        found = os.fstat(stream)
        if not stat.S_ISREG(found.st_mode) or found.st_uid != os.geteuid():
            return False
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.unlink(path)
    except OSError:
        return False
    finally:
        os.close(stream)
    return True


def _refusal(path: str | Path, needed: int, error: Exception) -> str:
    """Say what the system refused, and how many bytes the file needs."""
    if not isinstance(error, OSError):
        return f"{str(path)!r}: cannot be written ({error}); name a file without NUL characters."
    target = Path(os.path.abspath(user_path(path)))
    message = f"{target}: cannot be written ({error.strerror or error}); it needs {needed} bytes"
    folder = target.parent
    try:
        message += f", {shutil.disk_usage(folder).free} are free"
    except OSError:
        return f"{message}; {folder} is not a directory that can be written to."
    return f"{message}{_way_out(error.errno)}."


def _way_out(number: int | None) -> str:
    """Return what to do about some refusals."""
    ways = {
        errno.ENAMETOOLONG: "; give it a shorter name",
        errno.ENOSPC: "; make room, or write elsewhere",
        errno.EDQUOT: "; make room, or write elsewhere",
        errno.EFBIG: "; raise the limit on file sizes (ulimit -f), or write elsewhere",
        errno.EROFS: "; write to a folder that can be written to",
        errno.EACCES: "; write to a folder that can be written to",
        errno.ELOOP: "; name a file that is no link, and no circle of links",
        errno.EISDIR: "; name a file in it",
    }
    return ways.get(number or 0, "")
