"""Binary STL: triangles, and the colour that two dialects keep in the bytes behind each.

VisCAM and SolidView: bit 15 set, then red, green, blue of 5 bits each, blue in the lowest.
Materialise Magics: "COLOR=" with red, green, blue and opacity in the header is the body's; a
triangle with bit 15 clear has its own, red in the lowest bits. Programs that write such a header
and nothing but zeros behind the triangles mean the body's colour, and often put a space where the
opacity stands: it is not read.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.robot.reading.mesh_color import Rgba
from hexapod_pin.robot.reading.mesh_part import MeshPart, triangle_areas

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("bits", "<u2")])
_HEADER = 84


def binary_stl(data: bytes) -> MeshPart | None:
    """Return the triangles of a binary STL; None where the length says that it is none."""
    if len(data) < _HEADER:
        return None
    count = int.from_bytes(data[80:_HEADER], "little")
    if len(data) != _HEADER + count * _TRIANGLE.itemsize:
        return None
    triangles = np.frombuffer(data, _TRIANGLE, offset=_HEADER)
    vertices = triangles["corners"].reshape(-1, 3).astype(np.float64)
    faces = np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)
    color = _color(data[:80], triangles["bits"], triangle_areas(vertices, faces))
    return MeshPart(vertices, faces, color)


def _color(header: bytes, bits: NDArray[np.uint16], areas: Array) -> Rgba | None:
    """Return the mean colour over the area; None where the file gives none."""
    channels = np.stack([bits & 31, (bits >> 5) & 31, (bits >> 10) & 31], axis=1) / 31.0
    marked = (bits & 0x8000) != 0
    start = header.find(b"COLOR=")
    if 0 <= start <= len(header) - 10:
        body = np.frombuffer(header, np.uint8, 3, start + 6) / 255.0
        colors = np.where((marked | (not bits.any()))[:, None], body, channels)
    elif marked.any():
        colors, areas = channels[:, ::-1][marked], areas[marked]
    else:
        return None
    weights = areas if 0.0 < areas.sum() < np.inf else np.ones(len(areas))
    red, green, blue = (float(value) for value in weights @ colors / weights.sum())
    return red, green, blue, 1.0
