"""The colour of a binary STL file: two dialects keep one in the bytes behind each triangle.

VisCAM and SolidView: bit 15 set, then red, green, blue of 5 bits each, blue in the lowest.
Materialise Magics: "COLOR=" and RGBA in the header is the body's; a triangle with bit 15 clear has
its own, red in the lowest bits.
"""

from __future__ import annotations

import numpy as np

from hexapod_pin.robot.reading.mesh_color import Rgba

_TRIANGLE = np.dtype([("corners", "<f4", (4, 3)), ("color", "<u2")])
_HEADER = 84


def stl_color(data: bytes) -> Rgba | None:
    """Return the mean colour over the triangles' area; None without colours (as in text files)."""
    if len(data) <= _HEADER or (len(data) - _HEADER) % _TRIANGLE.itemsize:
        return None
    triangles = np.frombuffer(data, _TRIANGLE, offset=_HEADER)
    if len(triangles) != int.from_bytes(data[80:84], "little"):
        return None
    bits = triangles["color"]
    channels = np.stack([bits & 31, (bits >> 5) & 31, (bits >> 10) & 31], axis=1) / 31.0
    marked = (bits & 0x8000) != 0
    start = data.find(b"COLOR=", 0, 80)
    if start >= 0 and start + 10 <= 80:
        body = np.frombuffer(data, np.uint8, 4, start + 6) / 255.0
        colors = np.where(marked[:, None], body[:3], channels)
        alpha = float(body[3])
    elif marked.any():
        colors, alpha = channels[:, ::-1][marked], 1.0
        triangles = triangles[marked]
    else:
        return None
    corners = triangles["corners"][:, 1:].astype(np.float64)
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(crossed, axis=1)
    weights = areas if 0.0 < areas.sum() < np.inf else np.ones(len(areas))
    red, green, blue = (float(value) for value in weights @ colors / weights.sum())
    return red, green, blue, alpha
