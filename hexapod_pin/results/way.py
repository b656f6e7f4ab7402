"""How far a walk comes along its heading."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array


def distance_per_cycle(place: Array, turn: Array, along: Array) -> float:
    """Return the mean way per cycle along the heading [m].

    The heading is the direction of travel at the start, turned with the trunk's yaw; the way of
    each cycle is projected on the heading at its middle, so that turning gaits count too.

    Args:
        place: centre of mass at the edges and middles of the cycles [m]. Shape (2 cycles + 1, 2).
        turn: yaw of the trunk there, less that at the start [rad]. Shape (2 cycles + 1,).
        along: unit vector of travel at the start. Shape (2,).
    """
    ways, middle = np.diff(place[::2], axis=0), turn[1::2]
    cos, sin = np.cos(middle), np.sin(middle)
    heading = np.stack([cos * along[0] - sin * along[1], sin * along[0] + cos * along[1]], axis=1)
    return float(np.mean(np.sum(ways * heading, axis=1)))
