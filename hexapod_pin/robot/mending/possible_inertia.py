"""The nearest inertia that a rigid body can have."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.mending.rules import FLATNESS

SECOND_MOMENTS = np.ones((3, 3)) - np.eye(3)
"""Principal moments are this matrix times the second moments of mass, which no body has negative
(Traversaro, Brossette, Escande, Nori: Identification of fully physical consistent inertial
parameters using optimization on manifolds, IROS 2016)."""


def nearest_possible(inertia: Array) -> Array:
    """Return the possible inertia nearest to a (3, 3) one in the Frobenius norm [kg m^2].

    Its principal axes stay; its moments are the nearest that obey the triangle inequality, every
    second moment being at least `FLATNESS` of their sum.
    """
    from scipy.optimize import nnls

    moments, axes = np.linalg.eigh(inertia)
    scale = float(np.abs(moments).max())
    if scale == 0.0:
        return np.zeros((3, 3))
    second, _ = nnls(SECOND_MOMENTS, moments / scale)
    second = scale * np.maximum(second, FLATNESS * second.sum())
    nearest: Array = axes @ np.diag(SECOND_MOMENTS @ second) @ axes.T
    return nearest
