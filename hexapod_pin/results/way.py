"""How far a walk comes along its heading."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array


def trunk_yaw(q: Array) -> Array:
    """Return the trunk's yaw [rad] of (k, nq) positions."""
    x, y, z, w = q[:, 3:7].T
    yaw: Array = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw


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
    return float(np.mean(np.sum(ways * heading_at(middle, along), axis=1)))


def heading_at(turn: Array, along: Array) -> Array:
    """Return unit vectors `along` (2,) or (k, 2), turned with the trunk by (k,) [rad]. (k, 2)."""
    cos, sin = np.cos(turn), np.sin(turn)
    x, y = along[..., 0], along[..., 1]
    heading: Array = np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
    return heading


def path_error(
    edges: Array, along: Array, *, first_yaw: float, speed: float, turn_rate: float
) -> tuple[float, float]:
    """Return how far a walk strays from its plan: RMS lateral distance [m], yaw error [rad].

    The planned path starts at the first edge. A straight one keeps the heading of the run's start;
    an arc, of radius speed / turn rate, starts with the heading that the trunk has there, because
    the yaw of a walk's first, slower cycles is not known here. The yaw error is of the last edge.

    Args:
        edges: time [s], x and y of the centre of mass [m], yaw [rad] at the edges of the cycles.
            Shape (cycles + 1, 4).
        along: unit vector of travel at the start of the run, with the trunk at `first_yaw`. (2,).
        first_yaw: yaw at the start of the run [rad].
        speed: planned [m/s].
        turn_rate: planned yaw rate [rad/s], left > 0.
    """
    time, yaw = edges[:, 0] - edges[0, 0], np.unwrap(edges[:, 3])
    begin = first_yaw if turn_rate == 0.0 else yaw[0]
    cos, sin = np.cos(begin - first_yaw), np.sin(begin - first_yaw)
    heading = np.array([cos * along[0] - sin * along[1], sin * along[0] + cos * along[1]])
    left, place = np.array([-heading[1], heading[0]]), edges[:, 1:3] - edges[0, 1:3]
    if turn_rate == 0.0:
        aside = place @ left
    else:
        radius = speed / turn_rate  # > 0: the centre lies to the left
        away = np.linalg.norm(place - radius * left, axis=1)
        aside = np.sign(radius) * (abs(radius) - away) if radius else -away
    error = yaw[-1] - begin - turn_rate * time[-1]
    turned = float(np.arctan2(np.sin(error), np.cos(error)))
    return float(np.sqrt(np.mean(aside**2))), turned
