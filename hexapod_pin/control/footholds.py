"""Where the feet of a gait stand in the world, placement by placement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import PlanarMotion
from hexapod_pin.control.gait import Gait
from hexapod_pin.immutable import Immutable

COINCIDENT = 1e-9
"""Footholds [m] and times [cycles] closer than this are the same."""


@dataclass(frozen=True, eq=False)
class Footholds(Immutable):
    """The footholds of a planned walk.

    Attributes:
        gait: the gait.
        neutral_feet: standing foot centres in the base frame, legs in gait order [m]. (L, 3).
        body: the planned motion of the base.
    """

    gait: Gait
    neutral_feet: Array
    body: PlanarMotion

    def at(self, placement: Array) -> Array:
        """Return where each leg stands in the world after its k-th placement [m].

        Args:
            placement: k per time and leg; the foot is placed at (k + phase) cycles. Shape (K, L).

        Returns:
            The neutral foot under the body at mid-stance; under the standing body if the swing
            to that place would have begun before t = 0. Shape (K, L, 3).
        """
        middle = self.middle(placement)
        return self.under(self.body.pose(middle.ravel()).reshape(*middle.shape, 3))

    def under(self, pose: Array) -> Array:
        """Return the standing feet under poses (K, L, 3) of the body in the world, a leg each."""
        feet = np.broadcast_to(self.neutral_feet, pose.shape)
        p_WF = turned(feet, pose[..., 2])
        p_WF[..., :2] += pose[..., :2]
        return p_WF

    def middle(self, placement: Array) -> Array:
        """Return the middle of the stances after the k-th placements, 0 of the first [s].

        Args:
            placement: as of `at`. Shape (K, L).
        """
        duty, period = self.gait.duty, self.gait.cycle_time
        placed = placement + np.array(self.gait.phases)
        walked = placed - (1.0 - duty) >= -COINCIDENT
        return np.where(walked, (placed + duty / 2.0) * period, 0.0)

    def with_travel(self, placement: Array) -> tuple[Array, Array]:
        """Return the footholds after the k-th placements and the travel to the next [m].

        Args:
            placement: k per time and leg. Shape (K, L).

        Returns:
            Shape (K, L, 3) each, in the world.
        """
        first, last = (placement.min(), placement.max()) if placement.size else (0.0, 0.0)
        count = int(last - first) + 2
        if count > len(placement):  # a table would be larger than what is asked for
            here = self.at(placement)
            return here, self.at(placement + 1.0) - here
        table = self.at(np.tile(first + np.arange(count)[:, None], (1, len(self.neutral_feet))))
        row, leg = (placement - first).astype(int), np.arange(len(self.neutral_feet))
        return table[row, leg], np.diff(table, axis=0)[row, leg]


def turned(p: Array, yaw: Array) -> Array:
    """Rotate points (..., 3) about z by angles that broadcast over (...) [rad]."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]
    return np.stack([x, y, p[..., 2]], axis=-1)
