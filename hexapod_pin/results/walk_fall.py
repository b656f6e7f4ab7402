"""Whether, when and how a robot fell, from the samples of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
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

TIPPED_WORDS = f"tipped over by {math.degrees(TIPPED):.0f} degrees"
SUNK_WORDS = f"sank to {SUNK:.0%} of its standing height"


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

    Up is the mean normal of the ground under the feet, so that slopes count as level. Where
    contacts were not recorded, it is against gravity, and only tipping over is seen.
    """
    if not trace.foot_names:
        return None
    if "contacts" not in trace.recorded:
        gravity = np.asarray(trace.meta.get("gravity", (0.0, 0.0, -9.81)), dtype=float)
        up = np.broadcast_to(-gravity / np.linalg.norm(gravity), (len(trace.time), 3))
        return _first(trace.time, {TIPPED_WORDS: _tilt(trace.q, up) > TIPPED})
    up = trace.foot_normal.mean(axis=1)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    height = _height(trace, up)
    return _first(
        trace.time,
        {
            SUNK_WORDS: height < SUNK * height[0],
            TIPPED_WORDS: _tilt(trace.q, up) > TIPPED,
            "all feet left the ground": _long_enough(trace.contact, trace.time),
        },
    )


def _first(time: Array, found: Mapping[str, NDArray[np.bool_]]) -> Fall | None:
    """Return the first of falls, each by the samples that show it (T,)."""
    falls = [Fall(float(time[np.argmax(rows)]), how) for how, rows in found.items() if rows.any()]
    return min(falls, key=lambda fall: fall.time, default=None)


def _height(trace: Trace, up: Array) -> Array:
    """Return the height of the mass, or of the trunk, over the lowest foot centre (T,) [m]."""
    place = trace.com if "com" in trace.recorded else trace.q[:, :3]
    below = place[:, None, :] - trace.foot_position
    height: Array = np.einsum("tfi,ti->tf", below, up).max(axis=1)
    return height


def _tilt(q: Array, up: Array) -> Array:
    """Return the angle between the trunk's z axis and `up` (T,) [rad]."""
    x, y, z, w = q[:, 3:7].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    tilt: Array = np.arccos(np.clip(np.sum(axis * up, axis=1), -1.0, 1.0))
    return tilt


def _long_enough(contact: NDArray[np.bool_], time: Array) -> NDArray[np.bool_]:
    """Return where times begin in which no foot (T, F) is loaded for longer than OFF_GROUND."""
    rows = np.logical_not(contact.any(axis=1))
    edges = np.diff(np.concatenate([[False], rows, [False]]).astype(int))
    begin, end = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    found = np.zeros(len(rows), dtype=bool)
    found[begin[time[end] - time[begin] > OFF_GROUND]] = True
    return found
