"""Samples of a run are packed as one small block of bytes, which a page unpacks.

Numbers are rounded to a resolution and stored as integers: differences in the first axis, each with
its sign in the lowest bit, the bytes of equal weight together, deflated. Sums of integers do not
drift, so every sample is within half a resolution of its value.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array

WIDTHS = (1, 2, 4)
"""Bytes of an integer."""

LARGEST = 2**53
"""Integers up to it are exact as numbers of a browser."""


class SampleBlock:
    """Arrays, packed one after the other.

    Attributes:
        table: of each array its resolution, length, columns and bytes a number, in their order.
    """

    def __init__(self) -> None:
        """Begin with no array."""
        self.table: list[dict[str, Any]] = []
        self._parts: list[bytes] = []

    def add(self, values: ArrayLike, resolution: float, *, order: int = 2) -> int:
        """Pack an array and return its place in `table`.

        Numbers that are not finite come out as NaN. Where an integer would be too long the
        resolution is made coarser, in steps of ten.

        Args:
            values: shape (N,) or (N, columns), further axes as columns.
            resolution: of the numbers, in their unit.
            order: of the differences: 2 for what moves smoothly, 1 for a list of integers.
        """
        columns = np.asarray(values, dtype=float)
        columns = columns.reshape(len(columns), -1)
        finite = np.isfinite(columns)
        while True:
            whole = np.round(np.where(finite, columns, 0.0) / resolution)
            missing = None
            if not finite.all():
                missing = float(np.max(whole, initial=0.0)) + 1.0
                whole = np.where(finite, whole, missing)
            zigzag = _zigzag(whole, order) if np.abs(whole).max(initial=0.0) < LARGEST / 8 else None
            top = 2**64 if zigzag is None else int(zigzag.max(initial=0))
            if zigzag is not None and top < 2**32:
                break
            resolution *= 10.0
        wide = next(width for width in WIDTHS if top < 2 ** (8 * width))
        planes = zigzag.astype(f"<u{wide}").reshape(-1).view(np.uint8).reshape(-1, wide).T
        self._parts.append(planes.tobytes())
        entry = {"n": len(columns), "columns": columns.shape[1], "wide": wide, "order": order,
                 "resolution": float(f"{resolution:.12g}")}  # fmt: skip
        self.table.append(entry if missing is None else {**entry, "missing": int(missing)})
        return len(self.table) - 1

    def size(self, count: int) -> int:
        """Return the bytes of the first `count` arrays, not yet deflated."""
        return sum(len(part) for part in self._parts[:count])

    @property
    def content(self) -> bytes:
        """All arrays, not yet deflated."""
        return b"".join(self._parts)


def _zigzag(whole: Array, order: int) -> Any:
    """Return differences of integers (N, columns) as unsigned ones (columns, N)."""
    change = whole.astype(np.int64)
    for _ in range(order):
        change = np.diff(change, axis=0, prepend=np.zeros_like(change[:1]))
    return np.ascontiguousarray(((change << 1) ^ (change >> 63)).T.astype(np.uint64))


def unpacked(content: bytes, table: list[dict[str, Any]]) -> list[Array]:
    """Return the arrays (N, columns) of a block, as a page unpacks them."""
    found, at = [], 0
    for entry in table:
        count, wide = entry["n"] * entry["columns"], entry["wide"]
        planes = np.frombuffer(content, dtype=np.uint8, count=count * wide, offset=at)
        at += count * wide
        plain = (
            np.ascontiguousarray(planes.reshape(wide, count).T).view(f"<u{wide}").astype(np.int64)
        )
        whole = ((plain >> 1) ^ -(plain & 1)).reshape(entry["columns"], entry["n"]).T
        for _ in range(entry["order"]):
            whole = np.cumsum(whole, axis=0)
        values = whole * entry["resolution"]
        if "missing" in entry:
            values[whole == entry["missing"]] = np.nan
        found.append(values)
    return found


def deflated(plain: bytes) -> str:
    """Return bytes deflated, as text in base64."""
    squeezed = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return base64.b64encode(squeezed.compress(plain) + squeezed.flush()).decode("ascii")


def inflated(text: str) -> bytes:
    """Return the bytes of `deflated`."""
    return zlib.decompress(base64.b64decode(text), -zlib.MAX_WBITS)
