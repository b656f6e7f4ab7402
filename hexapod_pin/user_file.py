"""The files that a user names: how their paths are read, and how their content is.

One rule for every input: it is a regular file of at most a stated size, and it is read once. A file
that a command is going to write is none of its inputs.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from hexapod_pin.errors import FileConflictError, ParameterError

TEXT_BYTES = 16_000_000
"""Largest text that is read: a case, a study, hints, a catalogue [bytes]."""

PIECE = 1 << 20
"""Read at a time of what a file does not say that it has [bytes]."""

_KINDS = (
    (stat.S_ISLNK, "a symbolic link"),
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def user_path(path: str | Path) -> Path:
    """Return a path with its `~` or `~user` expanded; as it is where no such user is known.

    `Path.expanduser` ends in a RuntimeError there.
    """
    try:
        return Path(os.path.expanduser(path))
    except ValueError:  # no name of a user can be looked up that has a NUL in it
        return Path(path)


def reason_of(error: Exception) -> str:
    """Return what the system, or a decoder, says of a file, for the middle of a sentence."""
    text = getattr(error, "strerror", None) or str(error)
    return text[:1].lower() + text[1:]


def kind_of(mode: int) -> str:
    """Return what something is that is no regular file, by the mode that `os.stat` gives."""
    return next((name for test, name in _KINDS if test(mode)), "no file")


def read_bytes(path: str | Path, most: int) -> bytes:
    """Return the content of a regular file.

    Links are followed. A pipe or a device is not waited for: it is refused.

    Args:
        path: the file.
        most: largest size that is read [bytes].

    Raises:
        OSError: there is no such file, it is no regular file, it is larger than `most`, or the
            system refuses it; `reason_of` says which.
        ValueError: there is a NUL in the path.
        FileConflictError: the command that reads it is going to write it.
    """
    file = os.open(user_path(path), os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    try:
        found = os.fstat(file)
        if not stat.S_ISREG(found.st_mode):
            kind = kind_of(found.st_mode)
            number = errno.EISDIR if kind == "a folder" else errno.EINVAL
            raise OSError(number, f"is {kind}, not a regular file", str(path))
        _refuse_output(path, found)
        if found.st_size > most:
            raise _too_large(path, found.st_size, most)
        return _content(file, found.st_size, path, most)
    finally:
        os.close(file)


def _content(file: int, size: int, path: str | Path, most: int) -> bytes:
    """Return what an open file holds; it may grow, and one of /proc says that it is empty."""
    pieces: list[bytes] = []
    length = 0
    while piece := os.read(file, size + 1 if not pieces else PIECE):
        pieces.append(piece)
        length += len(piece)
        if length > most:
            raise _too_large(path, length, most)
    return b"".join(pieces)


def _too_large(path: str | Path, size: int, most: int) -> OSError:
    text = f"has {size} bytes; no more than {most} bytes are read"
    return OSError(errno.EFBIG, text, str(path))


def read_text(path: str | Path, name: str, most: int = TEXT_BYTES) -> str:
    """Return the text of a regular file, UTF-8.

    Args:
        path: the file.
        name: of the parameter that the path was given for, such as "case file".
        most: largest size that is read [bytes].

    Raises:
        ParameterError: the file cannot be read, as of `read_bytes`, or is no text in UTF-8.
        FileConflictError: the command that reads it is going to write it.
    """
    try:
        return read_bytes(path, most).decode("utf-8")
    except (OSError, ValueError) as error:
        allowed = f"a readable text file ({reason_of(error)})"
        raise ParameterError(name, str(path), allowed) from error


_outputs: ContextVar[dict[Path, str] | None] = ContextVar("outputs", default=None)
"""The files that the command of now is going to write, with the option that names each."""


@contextmanager
def outputs_of_command() -> Iterator[None]:
    """Keep in mind, until the block ends, which files a command is going to write."""
    token = _outputs.set({})
    try:
        yield
    finally:
        _outputs.reset(token)


def declare_output(option: str, path: Path) -> None:
    """Say that the command of now is going to write a file: reading it is refused from now on.

    Raises:
        FileConflictError: another option of the command names the same file.
    """
    outputs = _outputs.get()
    if outputs is None:  # a program that uses the library: what it overwrites is its own affair
        return
    for other, name in outputs.items():
        if _same(path, other):
            text = f"{name} and {option} name the same file; name two."
            raise FileConflictError(option, str(path), text)
    outputs[path] = option


def _same(first: Path, second: Path) -> bool:
    if os.path.realpath(first) == os.path.realpath(second):
        return True
    try:
        return os.path.samefile(first, second)
    except OSError:
        return False


def _refuse_output(path: str | Path, found: os.stat_result) -> None:
    """Refuse to read a file that the command is going to write.

    Raises:
        FileConflictError: it is one.
    """
    for output, option in (_outputs.get() or {}).items():
        try:
            there = os.stat(output)
        except OSError:
            continue
        if os.path.samestat(there, found):
            text = f"the command reads it ({path}); name another file to write."
            raise FileConflictError(option, str(output), text)
