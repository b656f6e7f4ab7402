"""The standing posture of least holding torque: how far in the feet stand, and how high the trunk.

A posture is judged over a steady cycle of a gait by the torques that hold the robot still at each
instant, with the forces of `robot.force_distribution`: least torque inside the friction cone. Under
a vertical load f the joints of a leg hold f x_f (femur) and f (x_f - x_k) (tibia), x_f and x_k the
horizontal distances of foot and knee from the femur's axis. The sum of their squares is least at
x_f = x_k / 2, which many sprawled robots' feet are far beyond.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.body_path import TRANSIENT_CYCLES
from hexapod_pin.control.feasibility import checked_path, violation
from hexapod_pin.control.gait_refusal import collision, refuse_impossible, with_base
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.errors import GaitError, ParameterError, ReachError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.force_distribution import (
    force_ratio,
    held_torque,
    holding_forces,
    least_torque_split,
    load_weights,
)
from hexapod_pin.robot.holding_torque import STANDARD_GRAVITY
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.leg_kinematics import LegKinematics
from hexapod_pin.robot.leg_set import LegSet
from hexapod_pin.robot.robot import scratch_data
from hexapod_pin.robot.rotations import crosses
from hexapod_pin.robot.static_margins import static_margin

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.robot.robot import Robot


FRICTION = 0.35
"""Largest tangential over normal force that a target asks of a foot [-] (*assumed*)."""

TRANSFER = 0.07
"""Time in which a foot takes up or gives back its load [s] (*assumed*)."""

GRID = math.radians(10.0)
"""Spacing of the joint angles that are tried [rad] (*assumed*)."""

LEAST_MARGIN = 0.965
"""Static margin over that of the standing posture, at least [-] (*assumed*)."""

HEIGHT_CHANGE = 0.1
"""Change of the trunk's height over that of the standing posture, at most [-] (*assumed*)."""

JOINT_ROOM = math.radians(2.0)
"""Between joint angles and their limits during the walk, at least [rad] (*assumed*)."""

INSTANTS = 120
"""Of the cycle, in the middle of equal parts: with more of them the RMS torque of the packaged
robots changes by 3e-4 of itself, the static margin by 0.3 mm."""

LOADED = 0.05
"""Weight above which a foot's ratio of forces counts [-] (*assumed*)."""

SAME_ANGLE = 1e-6
"""Difference of angles that is taken for rounding [rad]."""


# What a posture costs.


@dataclass(frozen=True)
class PostureCost(Immutable):
    """A posture over a steady cycle of a gait, statically, with the forces of least torque.

    Attributes:
        torque_rms: holding torque, RMS over time and the legs' joints [N m].
        force_ratio: largest tangential over normal force of a foot that carries load, before the
            friction cone limits it [-].
        foot_radius: distance of the feet from the axes of their legs' first joints, mean [m].
        height: of the trunk's origin above the ground [m].
        static_margin: least distance of the centre of mass from the edges of the support [m].
        tip_angle: slope at which the centre of mass is above the edge, atan(margin / height of the
            centre of mass) [rad].
    """

    torque_rms: float
    force_ratio: float
    foot_radius: float
    height: float
    static_margin: float
    tip_angle: float


@checked
def posture_cost(
    robot: Robot, gait: Gait, *, mu: float = FRICTION, transfer: float = TRANSFER
) -> PostureCost:
    """Return what the standing posture of a robot costs in a gait.

    Args:
        robot: with four to eight legs of three joints.
        gait: which it walks.
        mu: limit of the friction cone [-].
        transfer: time in which a foot takes up its load [s].

    Raises:
        GaitError: the legs have two joints, or the robot cannot walk the gait.
        ParameterError: `mu` or `transfer` out of range.
    """
    six = three_joint_legs(robot)
    refuse_impossible(robot, gait)
    return _Cycle.of(robot, six, gait).cost(mu, transfer)


def three_joint_legs(robot: Robot) -> LegGroup:
    """Return the legs, or refuse legs of two joints, whose height determines where feet stand."""
    six = leg_group(robot)
    if six.joint_index.shape[1] != 3:
        raise GaitError(
            f"robot {robot.name}: the posture of least torque needs legs of three joints; these "
            f"have {six.joint_index.shape[1]}, with which the height determines the feet's places.",
            "posture",
            None,
        )
    return six


@dataclass(frozen=True, eq=False)
class _Cycle:
    """A steady cycle at K instants; L legs of 3 joints.

    Attributes:
        six: the legs in the posture.
        age: time since each foot's planned touch-down over the cycle time [-]. Shape (K, L).
        gait: the gait, with a phase for each leg.
        angles: of the legs' joints [rad]. Shape (L, K, 3).
        jacobian: of the contact points, trunk axes [m/rad]. Shape (K, L, 3, 3).
        contact: points, trunk axes [m]. Shape (K, L, 3).
        centre: of mass, trunk axes [m]. Shape (K, 3).
        own_torque: of the legs' joints, for the legs' own weight [N m]. Shape (K, L, 3).
        joint_height: lowest of the legs' joints above the ground, over the cycle [m].
        weight: of the robot [N].
        effort: largest torque of the legs' joints [N m]. Shape (L, 3).
    """

    six: LegGroup
    age: Array
    gait: Gait
    angles: Array
    jacobian: Array
    contact: Array
    centre: Array
    own_torque: Array
    joint_height: float
    weight: float
    effort: Array

    @classmethod
    def of(cls, robot: Robot, six: LegGroup, gait: Gait, instants: int = INSTANTS) -> _Cycle:
        """Plan a cycle, at the middles of equal parts.

        Raises:
            ReachError: a leg cannot follow.
        """
        gait = six.fitted(gait)
        cycles = TRANSIENT_CYCLES + (np.arange(instants) + 0.5) / instants
        path = checked_path(six, gait, None)
        p_BF, _ = six.foot_motion(path, cycles * gait.cycle_time)
        q = six.kinematics.inverse(p_BF)
        axes = np.swapaxes(six.kinematics.chain.axes(q), -1, -2)
        sole = np.array([0.0, 0.0, -1.0]) * six.radius[:, None, None]
        below = np.broadcast_to(sole[:, :, None], axes.shape)
        jacobian = six.kinematics.jacobian(q) + np.swapaxes(crosses(axes, below), -1, -2)
        centre, own, lowest = _statics(robot, six, q)
        effort = robot.effort_limit[six.joint_index]
        known = np.isfinite(effort) & (effort > 0.0)
        return cls(
            six=six,
            age=(cycles[:, None] - np.array(gait.phases)) % 1.0,
            gait=gait,
            angles=q,
            jacobian=np.swapaxes(jacobian, 0, 1),
            contact=np.swapaxes(p_BF + sole, 0, 1),
            centre=centre,
            own_torque=own,
            joint_height=lowest - float(six.soles.mean()),
            weight=robot.total_mass * STANDARD_GRAVITY,
            effort=np.where(known, effort, effort[known].mean() if known.any() else 1.0),
        )

    def cost(self, mu: float, transfer: float) -> PostureCost:
        """Return what the posture costs."""
        gait, load = self.gait, np.array([0.0, 0.0, self.weight])
        weights = load_weights(self.age, gait.duty, gait.cycle_time, transfer)
        legs = (self.jacobian, self.contact - self.centre[:, None], self.own_torque)
        cost = self.effort**-2.0
        force = holding_forces(*legs, weights, load, cost, mu).force
        torque = held_torque(self.jacobian, self.own_torque, force)
        free = least_torque_split(*legs, weights, load, cost)
        margin = self.margin
        height = float(self.centre[:, 2].mean() - self.six.soles.mean())
        return PostureCost(
            torque_rms=float(np.sqrt(np.mean(torque**2))),
            force_ratio=float(force_ratio(free, load)[weights > LOADED].max()),
            foot_radius=float(_radii(self.six).mean()),
            height=-float(self.six.soles.mean()),
            static_margin=margin,
            tip_angle=math.atan2(margin, height),
        )

    @property
    def margin(self) -> float:
        """Least static margin on the feet that are planned to stand [m]."""
        stands = self.age < self.gait.duty
        return float(static_margin(self.contact[..., :2], self.centre[:, :2], stands).min())


def _statics(robot: Robot, six: LegGroup, q: Array) -> tuple[Array, Array, float]:
    """Return centre of mass (K, 3) [m], own torques (K, L, 3) [N m] and the lowest joint [m]."""
    import pinocchio as pin

    model, data = robot.model, scratch_data(robot)
    rows = with_base(six, q)
    scale = STANDARD_GRAVITY / float(np.linalg.norm(model.gravity.linear))
    centre, own, lowest = np.empty((len(rows), 3)), np.empty((len(rows), len(six.posture))), np.inf
    joints = [model.getJointId(name) for leg in six.legs for name in leg.joints]
    for k, row in enumerate(rows):
        own[k] = scale * np.asarray(pin.computeGeneralizedGravity(model, data, row))[6:]
        centre[k] = pin.centerOfMass(model, data, row)
        lowest = min(lowest, *(float(data.oMi[joint].translation[2]) for joint in joints))
    return centre, own[:, six.joint_index], lowest


def _radii(six: LegGroup) -> Array:
    """Return the distances of the standing feet from their legs' first joints, level. (L,) [m]."""
    return np.asarray(np.linalg.norm(feet_from_hips(six)[:, :2], axis=-1))


def feet_from_hips(six: LegGroup) -> Array:
    """Return the standing feet relative to the axes of their legs' first joints. (L, 3) [m]."""
    return np.asarray(six.neutral_feet - np.stack([leg.origins[0] for leg in six.legs]))


# The posture that costs least.


@dataclass(frozen=True)
class LeastTorquePosture(Immutable):
    """The posture of least holding torque that was found, beside the robot's standing posture.

    Attributes:
        posture: joint name -> angle [rad], of all joints: `posture=` of `load_robot`.
        found: what it costs.
        standing: what the standing posture of the robot costs.
        tried: how many postures were judged.
        first_leg: names of the joints of the first leg, which `lines` reports.
    """

    posture: Mapping[str, float] = field(repr=False)
    found: PostureCost
    standing: PostureCost
    tried: int
    first_leg: tuple[str, ...] = field(repr=False)

    @property
    def changed(self) -> bool:
        """Whether another posture than the standing one was found."""
        return self.found != self.standing

    def lines(self) -> list[str]:
        """Return what to print: numbers of the posture, and of the standing one in brackets."""
        if not self.changed:
            return [f"the standing posture costs least of {self.tried} postures"]
        new, old = self.found, self.standing
        degrees, mm = math.degrees, 1e3
        angle = {name: round(degrees(self.posture[name]), 1) + 0.0 for name in self.first_leg}
        angles = [f"{name} {value:g}" for name, value in angle.items()]  # no -0
        return [
            f"{', '.join(angles)} degrees, other legs alike",
            f"feet {mm * new.foot_radius:.0f} mm ({mm * old.foot_radius:.0f} mm) from the axes of "
            f"the first joints, trunk {mm * new.height:.0f} mm ({mm * old.height:.0f} mm) high; "
            "in brackets: the robot's own standing posture",
            f"holding torque {new.torque_rms:.3g} N m ({old.torque_rms:.3g} N m) RMS, tangential "
            f"over normal force at most {new.force_ratio:.2f} ({old.force_ratio:.2f})",
            f"static margin {mm * new.static_margin:.0f} mm ({mm * old.static_margin:.0f} mm), tip "
            f"angle {degrees(new.tip_angle):.1f} degrees ({degrees(old.tip_angle):.1f} degrees)",
        ]


@checked
def least_torque_posture(
    robot: Robot,
    gait: Gait,
    *,
    mu: float = FRICTION,
    transfer: float = TRANSFER,
    spacing: float = GRID,
) -> LeastTorquePosture:
    """Return the posture in which a gait needs the least holding torque.

    The first joint of each leg keeps its standing angle. The other two of the first leg go through
    a grid of angles; the feet of all other legs move out or in by the same factor, and up or down
    by as much. A posture qualifies if

    - the trunk's height is within 10 % of that of the standing posture, and the static margin at
      least 0.965 times that posture's, over the cycle;
    - joints stay 2 degrees away from their limits, and as high above the ground as feet are lifted
      (or as low as in the standing posture);
    - the robot can walk the gait there, start to stop: reach, singular postures, joint rates, and
      legs clear of each other and of the trunk, as before every walk.

    These limits are *assumed*. The torque is nearly the same over a wide range of postures; height
    is bounded because a higher trunk always needs less torque and tips over sooner.

    Args:
        robot: with four to eight legs of three joints.
        gait: which it walks, in its standing posture too.
        mu: limit of the friction cone [-].
        transfer: time in which a foot takes up its load [s].
        spacing: of the grid of joint angles [rad], 0.005 to 0.5.

    Raises:
        GaitError: the legs have two joints, or the robot cannot walk the gait as it stands.
        ParameterError: `mu`, `transfer` or `spacing` out of range.

    Example:
        >>> gait = hp.Gait.tripod(stroke=0.08, cycle_time=1.6, lift=0.04)
        >>> found = hp.motion.least_torque_posture(hp.load_robot("athena"), gait)
        >>> robot = hp.load_robot("athena", posture=found.posture)
    """
    if not 0.005 <= spacing <= 0.5:
        raise ParameterError("spacing", spacing, "from 0.005 to 0.5 rad")
    six = three_joint_legs(robot)
    refuse_impossible(robot, gait)
    here = _Cycle.of(robot, six, gait)
    standing = here.cost(mu, transfer)
    judged = [
        (cycle.cost(mu, transfer), cycle.six)
        for cycle in _cycles(robot, six, gait, spacing)
        if _qualifies(cycle, here)
    ]
    best, posture = standing, six.posture
    for cost, legs in sorted(judged, key=lambda one: one[0].torque_rms):
        if cost.torque_rms >= standing.torque_rms:
            break
        if violation(legs, gait) is None and collision(legs, leg_bodies(robot), gait) is None:
            best, posture = cost, legs.posture
            break
    angles = zip(robot.joint_names, (posture + 0.0).tolist(), strict=True)  # no -0.0
    return LeastTorquePosture(
        MappingProxyType(dict(angles)), best, standing, 1 + len(judged), six.legs[0].joints
    )


def _cycles(robot: Robot, six: LegGroup, gait: Gait, spacing: float) -> Iterator[_Cycle]:
    """Yield a cycle in each posture of the grid that has about the standing posture's height."""
    level = -float(six.soles.mean())
    for legs in _postures(six, spacing):
        if abs(-float(legs.soles.mean()) - level) <= HEIGHT_CHANGE * level:
            try:
                yield _Cycle.of(robot, legs, gait)
            except ReachError:
                continue


def _postures(six: LegGroup, spacing: float) -> Iterator[LegGroup]:
    """Yield the legs in each posture of the grid that all of them reach."""
    first, out = six.legs[0], feet_from_hips(six)
    radius = float(np.linalg.norm(out[0, :2]))
    for second, third in itertools.product(*(_angles(first, k, spacing) for k in (1, 2))):
        own = np.array([first.posture[0], second, third])
        there = first.forward(own) - first.origins[0]
        moved = out * [*(2 * [float(np.linalg.norm(there[:2])) / radius]), 1.0]
        moved[:, 2] += there[2] - out[0, 2]
        try:
            q = six.kinematics.inverse((six.neutral_feet - out + moved)[:, None])[:, 0]
        except ReachError:
            continue
        if np.abs(q[0] - own).max() <= SAME_ANGLE:  # else another branch of the leg
            yield standing_at(six, q)


def _angles(leg: LegKinematics, joint: int, spacing: float) -> Array:
    """Return the multiples of the spacing inside a joint's limits and a turn [rad]."""
    low = max(float(leg.lower[joint]) + JOINT_ROOM, -math.pi)
    high = min(float(leg.upper[joint]) - JOINT_ROOM, math.pi)
    steps = np.arange(math.ceil(low / spacing), math.floor(high / spacing) + 1)
    return np.asarray(spacing * steps)


def standing_at(six: LegGroup, q: Array) -> LegGroup:
    """Return the legs with another standing posture, angles (L, 3) [rad]."""
    legs = [
        replace(leg, posture=read_only(angles)) for leg, angles in zip(six.legs, q, strict=True)
    ]
    kinematics = LegSet.of(legs)
    posture = six.posture.copy()
    posture[six.joint_index] = q
    return replace(
        six,
        kinematics=kinematics,
        soles=read_only(kinematics.neutral_feet[:, 2] - six.radius),
        posture=read_only(posture),
    )


def _qualifies(cycle: _Cycle, here: _Cycle) -> bool:
    """Return whether a posture has the room, the height of joints and the margin it needs."""
    lower, upper = (
        np.stack([getattr(leg, name) for leg in cycle.six.legs])[:, None]
        for name in ("lower", "upper")
    )
    room: NDArray[np.float64] = np.minimum(cycle.angles - lower, upper - cycle.angles)
    return bool(
        room.min() >= JOINT_ROOM
        and cycle.joint_height >= min(cycle.gait.lift, here.joint_height)
        and cycle.margin >= LEAST_MARGIN * here.margin
    )
