"""How near the legs come to each other and to the trunk in a planned walk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feasibility import CHECKED_CYCLES, PATH, Violation, checked_times
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.six_legs import SixLegs, six_legs
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.robot.robot import Robot

SAMPLES_PER_CYCLE = 60
"""Postures checked in a cycle; around the nearest one REFINEMENT times as many."""

REFINEMENT = 16

MIN_CLEARANCE = 3e-3
"""Links that come nearer than this are told of [m] (*assumed*)."""

TOUCHING = 1e-6
"""An overlap up to this is rounding [m]: the links just touch."""

EQUAL_DISTANCES = 1e-9
"""Distances that differ by less are taken as equal: the first one in time is named [m]."""

CHECKED_GAITS = 256
"""How many pairs of robot and gait are remembered."""


@dataclass(frozen=True)
class Clearance:
    """Where two links come nearest to each other in a walk: start, one steady cycle, stop.

    Attributes:
        links: names of the two links, of two legs or of a leg and the trunk.
        time: when, from the start of the walk [s].
        distance: between their surfaces [m]; negative is how deep they overlap.
        excluded: pairs of links that overlap in the standing posture and so were not checked.
        assumed: what is assumed of the links' shapes.
    """

    links: tuple[str, str]
    time: float
    distance: float
    excluded: tuple[tuple[str, str], ...] = ()
    assumed: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should hear: links that come very near, and pairs that were not checked."""
        found = []
        if self.distance < MIN_CLEARANCE:
            where = f"at {self.time:.3g} s of the walk"
            found.append(f"links {' and '.join(self.links)} {self.nearness} {where}")
        if self.excluded:
            pairs = ", ".join(" and ".join(pair) for pair in self.excluded)
            found.append(f"not checked, because they overlap where the robot stands: {pairs}")
        return tuple(found)

    @property
    def nearness(self) -> str:
        """How near, in words: "overlap by 0.01 m", "come within 1 mm of each other"."""
        if abs(self.distance) <= TOUCHING:
            return "touch each other"
        if self.distance < 0.0:
            return f"overlap by {-self.distance:.4g} m"
        return f"come within {1e3 * self.distance:.2g} mm of each other"


def leg_clearance(robot: Robot, gait: Gait) -> Clearance:
    """Return where links of different legs, or of a leg and the trunk, come nearest in a walk.

    Computed once for a robot and a gait.

    Raises:
        GaitError: the robot does not have six legs.
        ReachError: the feet cannot follow the gait.
    """
    return clearance(six_legs(robot), leg_bodies(robot), gait)


@lru_cache(maxsize=CHECKED_GAITS)
def clearance(
    six: SixLegs, bodies: LegBodies, gait: Gait, motion: BodyMotion | None = None
) -> Clearance:
    """Return the clearance of a gait, as `leg_clearance`; `motion` is the trunk's, constant."""
    found = _clearance(six, bodies, gait.in_one_second(), motion)
    return replace(found, time=found.time * gait.cycle_time)


@lru_cache(maxsize=CHECKED_GAITS)
def _clearance(six: SixLegs, bodies: LegBodies, gait: Gait, motion: BodyMotion | None) -> Clearance:
    """Return the clearance of a gait in one second; times scale with the cycle."""
    if not bodies.pairs:
        return Clearance(("", ""), 0.0, np.inf, bodies.excluded, bodies.assumed)
    six = six.along(gait)
    path = FootPath.of(six, gait, stop_at=CHECKED_CYCLES * gait.cycle_time, motion=motion)
    time = checked_times(path, SAMPLES_PER_CYCLE)
    q = _postures(six, path, time)
    row = _first_smallest(bodies.distances(q)[0])
    steps = np.linspace(-1.0, 1.0, 2 * REFINEMENT + 1) / SAMPLES_PER_CYCLE
    around = np.clip(time[row] + steps * gait.cycle_time, 0.0, time[-1])
    near = six.leg_rows(q[max(row - 1, 0), 7:])
    distance, nearest = bodies.distances(_postures(six, path, around, near))
    row = _first_smallest(distance)
    pair, at = bodies.pairs[nearest[row]], float(around[row])
    return Clearance(pair, at, float(distance[row]), bodies.excluded, bodies.assumed)


def collision(
    six: SixLegs, bodies: LegBodies, gait: Gait, motion: BodyMotion | None = None
) -> Violation | None:
    """Return why legs are in each other's way, or None if they are not.

    Args:
        six: the legs, whose feet can follow the gait.
        bodies: their shapes.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.
    """
    found = clearance(six, bodies, gait, motion)
    if found.distance >= -TOUCHING:
        return None
    shapes = f" (shapes: {found.assumed})" if found.assumed else ""
    return Violation(
        PATH,
        f"links {' and '.join(found.links)} {found.nearness} at {found.time:.4g} s{shapes}",
    )


def _postures(six: SixLegs, path: FootPath, time: Array, near: Array | None = None) -> Array:
    """Return configurations of the robot at planned times, its base at the origin. (K, 7 + n).

    Args:
        six: the legs.
        path: what their feet follow.
        time: [s]. Shape (K,).
        near: reference for the first angles, the standing posture if None [rad]. Shape (L, J).

    Raises:
        ReachError: the feet cannot follow.
    """
    p_BF, _ = six.foot_motion(path, time)
    angles = six.joint_rows(six.kinematics.inverse(p_BF, near), six.posture)
    base = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (len(time), 1))
    return np.hstack([base, angles])


def _first_smallest(distance: Array) -> int:
    """Return the first of the smallest distances, rounding aside."""
    return int(np.argmax(distance <= distance.min() + EQUAL_DISTANCES))
