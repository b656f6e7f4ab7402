"""Triangles in the data format of three.js."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array


def triangle_geometry(vertices: Array, triangles: npt.NDArray[Any]) -> dict[str, Any]:
    """Return triangles as three.js takes them, numbers in arrays: of 2 bytes an index if they fit.

    Args:
        vertices: (V, 3) [m].
        triangles: (F, 3) rows of `vertices`.
    """
    short = len(vertices) < 1 << 16
    position = {
        "itemSize": 3,
        "type": "Float32Array",
        "array": vertices.astype(np.float32).ravel(),
        "normalized": False,
    }
    index = {
        "itemSize": 1,
        "type": "Uint16Array" if short else "Uint32Array",
        "array": triangles.astype(np.uint16 if short else np.uint32).ravel(),
        "normalized": False,
    }
    data = {"attributes": {"position": position}, "index": index}
    return {"type": "BufferGeometry", "data": data}
