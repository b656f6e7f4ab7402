"""The standing posture that leaves the longest stroke: reach, joint limits and clearance counted.

The standing posture of a file without one is searched by reach and joint limits alone. Where links
then come near each other or the trunk, or a joint ends the stroke early, another posture may leave
more of it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.control.feasibility import violation
from hexapod_pin.control.feasible_gait import UNHURRIED
from hexapod_pin.control.gait_refusal import collision
from hexapod_pin.control.leg_group import LegGroup
from hexapod_pin.control.posture import feet_from_hips, standing_at, three_joint_legs
from hexapod_pin.errors import ReachError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.robot.robot import Robot

RADII = (1.0, 0.8, 1.2, 1.4)
"""Distance of the feet from their legs' first joints over that of the standing posture [-]."""

HEIGHTS = (1.0, 0.8, 1.2)
"""Height of the trunk over that of the standing posture [-]."""

SPLAYS = (0.0, math.radians(15.0), math.radians(30.0))
"""Angles by which legs turn towards front and rear, those at the corners most [rad]."""

SHARES = (1.0, 0.85, 0.7, 0.55, 0.4, 0.25)
"""Of the stroke that is wanted, tried one after the other [-]."""


@dataclass(frozen=True)
class LongestStroke(Immutable):
    """The posture that leaves most of a stroke.

    Attributes:
        posture: joint name -> angle [rad], of all joints: `posture=` of `load_robot`.
        stroke: that the robot can walk in it [m].
        standing: that it can walk in its standing posture, of the same shares [m].
        wanted: stroke that was tried first [m].
        tried: how many postures were judged.
    """

    posture: Mapping[str, float] = field(repr=False)
    stroke: float
    standing: float
    wanted: float
    tried: int

    @property
    def helps(self) -> bool:
        """Whether another posture leaves more than the standing one."""
        return self.stroke > self.standing

    @property
    def line(self) -> str:
        """The result in a few words."""
        wanted = f"{1e3 * self.wanted:.3g} mm"
        if not self.helps:
            return f"no other of {self.tried} postures leaves more of a stroke of {wanted}"
        return f"leaves a stroke of {1e3 * self.stroke:.3g} of {wanted}"


@checked
def longest_stroke_posture(robot: Robot, gait: Gait) -> LongestStroke:
    """Return the posture that leaves most of a gait's stroke, the nearest to the standing one.

    The feet of all legs go out or in by one factor, the trunk up or down by another, and the legs
    turn towards front and rear, `RADII`, `HEIGHTS` and `SPLAYS` (*assumed*). A stroke counts as
    walkable where reach, joint limits, singular postures and the clearance of links allow the
    whole walk at it; joint rates do not count, they make the cycle longer.

    Args:
        robot: with four to eight legs of three joints.
        gait: with the stroke that is wanted.

    Raises:
        GaitError: the legs have two joints, or other phases than the gait.
    """
    six, bodies = three_joint_legs(robot), leg_bodies(robot)
    slow = gait.with_changes(cycle_time=UNHURRIED)
    best, share = six, _share(six, bodies, slow, 0.0)
    standing, legs = share, list(_others(six))
    for other, found in _longer(legs, bodies, slow, share):
        best, share = other, found
    angles = zip(robot.joint_names, (best.posture + 0.0).tolist(), strict=True)  # no -0.0
    stroke, own = (part * gait.stroke for part in (share, standing))
    return LongestStroke(MappingProxyType(dict(angles)), stroke, own, gait.stroke, len(legs))


def _others(six: LegGroup) -> Iterator[LegGroup]:
    """Yield the legs in other postures that they reach, the nearest first."""
    out = feet_from_hips(six)
    hips = six.neutral_feet - out
    along = hips[:, 0] - hips[:, 0].mean()
    side = np.sign(hips[:, 1])
    turn = -side * along / (np.abs(along).max() or 1.0)
    level = -float(six.soles.mean())
    for splay, height, radius in itertools.product(SPLAYS, HEIGHTS, RADII):
        if (splay, height, radius) == (0.0, 1.0, 1.0):
            continue
        c, s = np.cos(splay * turn), np.sin(splay * turn)
        moved = radius * np.stack([c * out[:, 0] - s * out[:, 1], s * out[:, 0] + c * out[:, 1]], 1)
        down = out[:, 2] - (height - 1.0) * level
        try:
            q = six.kinematics.inverse((hips + np.column_stack([moved, down]))[:, None])[:, 0]
        except ReachError:
            continue
        yield standing_at(six, q)


def _longer(
    legs: list[LegGroup], bodies: LegBodies, gait: Gait, share: float
) -> Iterator[tuple[LegGroup, float]]:
    """Yield postures with longer and longer strokes, as shares of the gait's."""
    for other in legs:
        if share >= SHARES[0]:
            return
        found = _share(other, bodies, gait, share)
        if found > share:
            share = found
            yield other, found


def _share(six: LegGroup, bodies: LegBodies, gait: Gait, above: float) -> float:
    """Return the largest of `SHARES` of a stroke that works; 0 where none above one does."""
    most = 0.0
    for share in sorted(part for part in SHARES if part > above):
        if not _works(six, bodies, gait.with_changes(stroke=share * gait.stroke)):
            break
        most = share
    return most


def _works(six: LegGroup, bodies: LegBodies, gait: Gait) -> bool:
    """Return whether legs can walk a gait, joint rates aside."""
    return violation(six, gait) is None and collision(six, bodies, gait) is None
