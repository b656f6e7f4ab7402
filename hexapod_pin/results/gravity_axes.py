"""Axes across gravity and against it: what points are projected on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

PARALLEL_TOLERANCE = 1e-12
"""Sine of the angle to the x axis below which gravity counts as along it [-]."""


def horizontal_axes(gravity: ArrayLike) -> Array:
    """Return unit axes across gravity and up against it, as rows; world x, y, z for level ground.

    Args:
        gravity: acceleration, world axes [m/s^2]. Shape (3,).

    Raises:
        ParameterError: there is no gravity, or it points along the world's x axis.
    """
    size = float(np.linalg.norm(gravity))
    if not (np.isfinite(size) and size > 0.0):
        raise ParameterError("gravity", gravity, "a finite vector other than zero [m/s^2]")
    up = -np.asarray(gravity, dtype=float) / size
    first = np.array([1.0, 0.0, 0.0]) - up[0] * up
    length = float(np.linalg.norm(first))
    if length < PARALLEL_TOLERANCE:
        raise ParameterError("gravity", gravity, "not along the world's x axis")
    first /= length
    return np.stack([first, np.cross(up, first), up])
