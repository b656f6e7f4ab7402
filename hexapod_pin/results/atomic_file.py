"""Write a file wholly or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

from hexapod_pin.errors import TraceFileError


def write_atomically(path: str | Path, content: bytes | memoryview) -> Path:
    """Put `content` at `path`; whatever goes wrong, the old file stays as it was.

    The bytes go to a temporary file in the same directory, reach the disk (fsync), and take the
    name in one step. The temporary file is removed on every failure, Ctrl-C included.

    Args:
        path: the file to write; a symbolic link is followed. Its directory must exist.
        content: the whole content of the file.

    Returns:
        The path written to.

    Raises:
        TraceFileError: the system refused (no such directory, no permission, disk full, ...); the
            message gives the bytes needed and, where known, the bytes free.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        with open(temporary, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, target)
    except OSError as error:
        raise TraceFileError(_refusal(target, len(content), error)) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()
    return target


def _refusal(target: Path, needed: int, error: OSError) -> str:
    """Say what the system refused, and how many bytes the file needs."""
    reason = error.strerror or str(error)
    message = f"{target}: cannot be written ({reason}); it needs {needed} bytes"
    try:
        message += f", {shutil.disk_usage(target.parent).free} are free"
    except OSError:
        message += f"; {target.parent} is not a directory that can be written to"
    return message + "."
