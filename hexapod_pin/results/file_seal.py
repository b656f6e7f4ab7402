"""A checksum behind the last byte of a file, checked before anything else looks at the file.

HDF5 follows what its structures say, for ever where damage made them say so; what stands behind
its end it ignores.
"""

from __future__ import annotations

import re
import zlib
from pathlib import Path

_SEAL = re.compile(rb"\nhexapod_pin crc32 ([0-9a-f]{8})\n")
_LENGTH = len(b"\nhexapod_pin crc32 00000000\n")
_PIECE = 1 << 22
"""Read at a time [bytes]."""


def seal_of(data: bytes | memoryview) -> bytes:
    """Return what is to stand behind the data."""
    return b"\nhexapod_pin crc32 %08x\n" % zlib.crc32(data)


def is_broken(path: str | Path) -> bool:
    """Whether a file has a seal and is not what was sealed; one without a seal is not.

    Raises:
        OSError: it cannot be read.
    """
    with open(path, "rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(max(0, size - _LENGTH))
        found = _SEAL.fullmatch(stream.read())
        if found is None:
            return False
        stream.seek(0)
        left, checksum = size - _LENGTH, 0
        while left > 0 and (piece := stream.read(min(left, _PIECE))):
            checksum, left = zlib.crc32(piece, checksum), left - len(piece)
    return b"%08x" % checksum != found[1]
