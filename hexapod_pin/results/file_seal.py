"""A checksum behind the last byte of a file, checked before anything else looks at the file.

HDF5 follows what its structures say, for ever where damage made them say so; what stands behind
its end it ignores.
"""

from __future__ import annotations

import re
import zlib

_SEAL = re.compile(rb"\nhexapod_pin crc32 ([0-9a-f]{8})\n")
_LENGTH = len(b"\nhexapod_pin crc32 00000000\n")


def seal_of(data: bytes | memoryview) -> bytes:
    """Return what is to stand behind the data."""
    return b"\nhexapod_pin crc32 %08x\n" % zlib.crc32(data)


def is_broken(data: bytes) -> bool:
    """Whether the content of a file has a seal and is not what was sealed."""
    found = _SEAL.fullmatch(data, max(0, len(data) - _LENGTH))
    if found is None:
        return False
    return b"%08x" % zlib.crc32(memoryview(data)[: len(data) - _LENGTH]) != found[1]
