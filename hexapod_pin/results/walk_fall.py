"""Whether, when and how a robot fell, from the samples of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.results.trace import Trace

TIPPED = math.radians(45.0)
"""Angle between the trunk's and the ground's upward direction that is a fall [rad] (*assumed*)."""

SUNK = 0.5
"""Height of the centre of mass over the lowest sole, of that at the start, that is a fall
(*assumed*)."""

OFF_GROUND = 0.1
"""Time without any loaded foot that is a fall [s] (*assumed*): a walk always stands on some."""


@dataclass(frozen=True)
class Fall:
    """A fall.

    Attributes:
        time: when it was first seen [s].
        how: in words: "sank to half of its standing height", "tipped over by 45 degrees" or "all
            feet left the ground".
    """

    time: float
    how: str


def find_fall(trace: Trace) -> Fall | None:
    """Return the first fall of a run; None of a robot that stays on its feet.

    Up is the mean normal of the ground under the feet, so that slopes count as level.
    """
    if not trace.foot_names:
        return None
    up = trace.foot_normal.mean(axis=1)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    height = _height(trace, up)
    found = {
        f"sank to {SUNK:.0%} of its standing height": height < SUNK * height[0],
        f"tipped over by {math.degrees(TIPPED):.0f} degrees": _tilt(trace.q, up) > TIPPED,
        "all feet left the ground": _long_enough(
            np.logical_not(trace.contact.any(axis=1)), trace.time
        ),
    }
    falls = [Fall(float(trace.time[np.argmax(rows)]), how) for how, rows in found.items()
             if rows.any()]  # fmt: skip
    return min(falls, key=lambda fall: fall.time, default=None)


def _height(trace: Trace, up: Array) -> Array:
    """Return the height of the centre of mass over the lowest foot centre (T,) [m]."""
    below = trace.com[:, None, :] - trace.foot_position
    height: Array = np.einsum("tfi,ti->tf", below, up).max(axis=1)
    return height


def _tilt(q: Array, up: Array) -> Array:
    """Return the angle between the trunk's z axis and `up` (T,) [rad]."""
    x, y, z, w = q[:, 3:7].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    tilt: Array = np.arccos(np.clip(np.sum(axis * up, axis=1), -1.0, 1.0))
    return tilt


def _long_enough(rows: NDArray[np.bool_], time: Array) -> NDArray[np.bool_]:
    """Return where rows begin that stay true for longer than OFF_GROUND (T,)."""
    edges = np.diff(np.concatenate([[False], rows, [False]]).astype(int))
    begin, end = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    found = np.zeros(len(rows), dtype=bool)
    found[begin[time[end] - time[begin] > OFF_GROUND]] = True
    return found
