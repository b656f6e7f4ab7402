"""A servo turns a set-point into a torque.

Its values are given per joint or per kind of joint; missing gains are assumed from effort or
weight.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeFloat, field_validator, model_serializer

from hexapod_pin.arrays import Array
from hexapod_pin.drive.motor import Motor
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.holding_torque import STANDARD_GRAVITY, SUPPORT, standing_torque
from hexapod_pin.robot.robot import leg_length, once_per_robot
from hexapod_pin.spec import Spec, require_factor

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler

    from hexapod_pin.robot.robot import Robot


# Values given for all joints, by kind of joint, by name or one by one, as one per joint.

JOINT_KINDS = ("coxa", "femur", "tibia")
"""Kinds of the joints of a leg, from the trunk outwards; a leg of two joints has the first two."""

HELD, SLIDE = "held", "slide"
"""Kinds of joints that no leg walks with: those that turn, and those that slide."""

GAP = "gap"
"""Kind of the free play of a gear with backlash: a joint without a drive."""

Value = TypeVar("Value")


def joint_kinds(robot: Robot) -> dict[str, str]:
    """Return the kind of every joint of a leg, and of every held joint, by the joint's name."""
    pairs = (zip(leg.joints, JOINT_KINDS, strict=False) for leg in robot.legs)
    kinds = {joint: kind for leg in pairs for joint, kind in leg}
    turning = dict(zip(robot.joint_names, robot.turning.tolist(), strict=True))
    held = {name: HELD if turning[name] else SLIDE for name in robot.held}
    return kinds | held | dict.fromkeys(robot.gaps, GAP)


def values_by_joint(robot: Robot, what: str, given: Mapping[str, Value]) -> dict[str, Value]:
    """Return joint name -> value, a joint's own name before its kind; joints may be left out.

    Raises:
        ParameterError: a key that is neither a joint nor a kind of joint of this robot.
    """
    kinds = joint_kinds(robot)
    known = {*robot.joint_names, *kinds.values(), *((HELD, SLIDE) if robot.legs else ())} - {GAP}
    for key in given:
        if key not in known:
            allowed = f"a joint of {robot.name} or one of {', '.join(_kinds_text(kinds))}"
            raise ParameterError(f"{what}[{key}]", key, allowed)
    keys = {name: (name if name in given else kinds.get(name, "")) for name in robot.joint_names}
    return {name: given[key] for name, key in keys.items() if key in given}


def _kinds_text(kinds: Mapping[str, str]) -> tuple[str, ...]:
    """Return the kinds of a robot's joints; those of three-joint legs where it has no legs."""
    return tuple(kind for kind in dict.fromkeys(kinds.values()) if kind != GAP) or JOINT_KINDS


def numbers_by_joint(
    robot: Robot, what: str, given: float | Mapping[str, float] | Sequence[float]
) -> Array:
    """Return one number per joint (n,) in the robot's order; of gaps that are given none 0.

    Raises:
        ParameterError: a wrong count, an unknown key, or a joint that is given no number.
    """
    names = robot.joint_names
    if isinstance(given, Mapping):
        found = dict.fromkeys(robot.gaps, 0.0) | values_by_joint(robot, what, given)
        for name in names:
            if name not in found:
                kinds = ", ".join(_kinds_text(joint_kinds(robot)))
                hint = f"Add its name or its kind ({kinds})."
                raise ParameterError(f"{what}[{name}]", None, "given", hint)
        return np.array([found[name] for name in names], dtype=float)
    if isinstance(given, Sequence):
        if len(given) != len(names):
            last = names[min(len(given), len(names) - 1)] if names else "none"
            allowed = f"{len(names)} numbers, one per joint of {robot.name} (up to joint {last})"
            raise ParameterError(what, tuple(given), allowed)
        return np.array(given, dtype=float)
    return np.full(len(names), float(given))


# Servo gains where none are given: from the effort where that is plausible, else from weight.

FULL_EFFORT_ERROR = 0.025
"""Joint error of full effort [rad] (*assumed*): a hobby servo's 1.4 degrees."""

EFFORT_TIME = 0.02
"""kd / kp of gains from the effort [s] (*assumed*)."""

PLAUSIBLE = (1.0, 20.0)
"""Effort over what standing takes, from which to which it is believed (*assumed*). Below, standing
saturates the drives; above, gains from it are more than a twentieth of a degree can show."""

SAG = 0.01
"""By how much a joint gives way under the load of standing [rad]; sliding joints by this times the
length of a leg (*assumed*)."""

LEAST_ARM = 0.25
"""Lever arm of a third of the weight over the length of a leg, at least: legs that stand upright
carry no torque, but do as soon as they walk (*assumed*)."""

LARGEST_SHARE = 0.5
"""Part of the weight on the middle leg of a standing tripod [-]."""


@dataclass(frozen=True)
class AssumedGains:
    """Gains with the rule that they follow.

    Attributes:
        kp: stiffness [N m/rad]; by joint name where some joints slide [N/m].
        kd: damping [N m s/rad, N s/m].
        effort: what the joints are taken to be able to give [N m].
        rule: where gains do not follow the effort, what they follow and why; else None.
    """

    kp: float | dict[str, float]
    kd: float | dict[str, float]
    effort: float
    rule: str | None


@once_per_robot
def assumed_gains(robot: Robot) -> AssumedGains:
    """Return *assumed* gains for the joints of a robot.

    Turning joints: stiffness is the largest effort over 0.025 rad, damping that times 0.02 s, where
    the effort is 1 to 20 times the load of standing. That load is the largest static torque on the
    fewest feet (`standing_torque`), and no less than a third of the weight at a quarter of a leg's
    length. Otherwise stiffness is such that the load turns a joint by 0.01 rad, and damping is
    critical for half of the mass at the arm where its weight makes the load: 2 sqrt(kp I), with
    I = m r^2, so that kd / kp = 2 sqrt(0.01 r / g).

    Sliding joints: the same with 0.01 of a leg's length for 0.01 rad, r being that length, and
    their static force, no less than a third of the weight.
    """
    slides = ~robot.turning
    effort = float(robot.effort_limit[~slides].max()) if (~slides).any() else 0.0
    arm, weight = leg_length(robot), STANDARD_GRAVITY * robot.total_mass
    load = _load(robot, ~slides, LEAST_ARM * arm * weight / SUPPORT)
    kp: float = effort / FULL_EFFORT_ERROR
    kd, rule = kp * EFFORT_TIME, None
    if load > 0.0 and not PLAUSIBLE[0] * load <= effort <= PLAUSIBLE[1] * load:
        kp = load / SAG
        kd = kp * settling_time(load / (LARGEST_SHARE * weight))
        rule = (
            f"from weight and leg length: the load of standing, {load:.3g} N m, turns a joint by "
            f"{SAG:g} rad; critically damped. Not from the effort of {effort:g} N m, which is "
            f"{effort / load:.2g} times that load"
        )
        effort = kp * FULL_EFFORT_ERROR
    if not slides.any():
        return AssumedGains(kp, kd, effort, rule)
    force = _load(robot, slides, weight / SUPPORT)
    spring = force / (SAG * arm)
    stiffness = np.where(slides, spring, kp).tolist()
    damping = np.where(slides, spring * settling_time(arm), kd).tolist()
    text = f"sliding joints give way by {1e3 * SAG * arm:.2g} mm under {force:.3g} N"
    names, whole = robot.joint_names, text if rule is None else f"{rule}; {text}"
    by_name = dict(zip(names, stiffness, strict=True)), dict(zip(names, damping, strict=True))
    return AssumedGains(*by_name, effort=effort, rule=whole)


def settling_time(arm: float) -> float:
    """Return kd / kp of a critically damped joint whose load at an arm [m] sags by SAG [s]."""
    return 2.0 * math.sqrt(SAG * arm / STANDARD_GRAVITY)


def _load(robot: Robot, joints: NDArray[np.bool_], least: float) -> float:
    """Return the largest static load of some joints, at least `least`; 0 where none is known."""
    torque: Array = standing_torque(robot)[joints]
    if len(robot.feet) < SUPPORT or not torque.size:
        return 0.0
    return max(float(torque.max()), least)


# Joint servos: what turns a set-point into a torque.

Gain = NonNegativeFloat | dict[str, NonNegativeFloat] | tuple[NonNegativeFloat, ...]


class Servo(Spec):
    """PD servo at every joint: tau = kp (q_ref - q) + kd (v_ref - v) + torque_ref, limited.

    A gain is one number for all joints, a mapping by kind of joint ("coxa", "femur", "tibia"; of
    joints that no leg walks with "held", and "slide" where they slide) or by joint name (a name
    goes before its kind), or a sequence with one number per joint.

    Attributes:
        kp: stiffness [N m/rad; N/m of joints that slide].
        kd: damping [N m s/rad; N s/m of joints that slide].
        limited: whether |tau| is limited to the joint's URDF effort.
        motor: what gives the torque: one for all joints that turn, or a mapping as for the gains,
            where joints left out have none; None: the torque follows without a limit in speed.
        assumed: whether the gains are this package's guess rather than the user's numbers.
        rule: what assumed gains follow where that is not the effort; None: the effort.
    """

    kind: Literal["pd"] = "pd"
    kp: Gain
    kd: Gain
    limited: bool = True
    motor: Motor | dict[str, Motor] | None = None
    assumed: bool = False
    rule: str | None = None

    @field_validator("kp", "kd", mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.tolist()
        return dict(value) if isinstance(value, Mapping) else value

    @field_validator("motor", mode="before")
    @classmethod
    def _motor(cls, value: Any) -> Any:
        """Read a motor or a mapping of motors; a mapping's values are motors or tables."""
        if not isinstance(value, Mapping):
            return value
        joints = [part for name, part in value.items() if name not in Motor.model_fields]
        if any(isinstance(part, Motor | Mapping) for part in joints):
            return {k: Motor(**m) if isinstance(m, Mapping) else m for k, m in value.items()}
        return Motor(**value)

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}

    def describe(self) -> str:
        """Return a text of the gains with their units; of sliding joints they are N/m, N s/m."""
        return f"kp {_text(self.kp)} N m/rad, kd {_text(self.kd)} N m s/rad"

    def gains(self, robot: Robot) -> tuple[Array, Array]:
        """Return kp (n,) [N m/rad] and kd (n,) [N m s/rad], in the order of the robot's joints.

        Those of the gaps of gears with backlash are 0.

        Raises:
            ParameterError: a joint has no gain, a key names no joint, or the count is wrong.
        """
        driven = _driven(robot)
        kp, kd = (
            numbers_by_joint(robot, f"Servo.{name}", gain)
            for name, gain in (("kp", self.kp), ("kd", self.kd))
        )
        return np.where(driven, kp, 0.0), np.where(driven, kd, 0.0)

    def motors(self, robot: Robot) -> tuple[Motor | None, ...]:
        """Return the motor of each joint, None where there is none.

        Raises:
            ParameterError: a key names no joint.
        """
        if self.motor is None:
            return (None,) * len(robot.joint_names)
        if not isinstance(self.motor, Mapping):
            turning = robot.turning & _driven(robot)
            return tuple(self.motor if turns else None for turns in turning)
        found = values_by_joint(robot, "Servo.motor", self.motor)
        return tuple(None if x in robot.gaps else found.get(x) for x in robot.joint_names)

    def stiffer(self, factor: float) -> Servo:
        """Return servos that answer any error of a joint with `factor` times the torque.

        kd / kp stays, the time by which assumed gains are built (`from_effort`). Keeping the
        damping ratio instead (kd times the root of the factor) would hide how far a touch-down's
        torque depends on the gains: where servos are overdamped, most of it is kd times a rate.

        Args:
            factor: on kp and kd [-]. Limits and motors stay.

        Raises:
            ParameterError: the factor is not positive and finite.
        """
        scale = require_factor(factor)
        gains = {"kp": _scaled(self.kp, scale), "kd": _scaled(self.kd, scale)}
        return self.model_copy(update=gains)

    @classmethod
    def for_robot(cls, robot: Robot, *, kp: float | None = None, kd: float | None = None) -> Servo:
        """Return the default servos of a robot: *assumed* gains where none are given.

        They follow the effort (`from_effort`) where that is 1 to 20 times what standing takes, and
        weight and leg length where it is not; `rule` reports it. See `assumed_gains`.

        Args:
            robot: whose joints they drive.
            kp: stiffness of all joints [N m/rad].
            kd: damping of all joints [N m s/rad].

        Raises:
            ParameterError: a gain is negative or not finite.
        """
        found = assumed_gains(robot)
        return cls(
            kp=found.kp if kp is None else kp,
            kd=found.kd if kd is None else kd,
            assumed=kp is None or kd is None,
            rule=found.rule if kp is None or kd is None else None,
        )

    @classmethod
    def from_effort(
        cls,
        robot: Robot,
        *,
        kp: float | None = None,
        kd: float | None = None,
        error: float = FULL_EFFORT_ERROR,
        time: float = EFFORT_TIME,
    ) -> Servo:
        """Return servos with *assumed* gains from the largest effort, however plausible that is.

        Neither paper gives gains. A hobby servo reaches its full torque within a few degrees of
        error; 0.025 rad is 1.4 degrees.

        Args:
            robot: whose joints they drive.
            kp: stiffness [N m/rad]; None: the largest effort at `error`.
            kd: damping [N m s/rad]; None: the assumed stiffness times `time`.
            error: joint error of full effort [rad].
            time: kd / kp of the assumed gains [s].

        Raises:
            ParameterError: a gain is negative or not finite, the error or the time not positive.
        """
        error, time = require_factor(error, "error"), require_factor(time, "time")
        efforts = robot.effort_limit[robot.turning]
        effort = float(efforts.max()) if efforts.size else 0.0
        stiffness = effort / error
        return cls(
            kp=stiffness if kp is None else kp,
            kd=stiffness * time if kd is None else kd,
            assumed=kp is None or kd is None,
        )


def _driven(robot: Robot) -> NDArray[np.bool_]:
    """Return which joints have a drive: all but the gaps of gears with backlash. Shape (n,)."""
    return np.array([name not in robot.gaps for name in robot.joint_names], dtype=bool)


MOST_NAMED = 6
"""Most gains of a mapping that a text lists one by one."""


def _scaled(gain: Gain, factor: float) -> Gain:
    if isinstance(gain, dict):
        return {key: factor * value for key, value in gain.items()}
    if isinstance(gain, tuple):
        return tuple(factor * value for value in gain)
    return factor * gain


def _text(gain: float | Mapping[str, float] | tuple[float, ...]) -> str:
    if isinstance(gain, Mapping) and len(gain) > MOST_NAMED:
        counts = Counter(gain.values()).items()
        return ", ".join(f"{value:g} ({count} joints)" for value, count in counts)
    if isinstance(gain, Mapping):
        return ", ".join(f"{key} {value:g}" for key, value in gain.items())
    if isinstance(gain, tuple):
        return " ".join(f"{value:g}" for value in gain)
    return f"{gain:g}"


# Drives without motors and dry friction, which is all that some equations have.


def check_plain_drives(robot: Robot, servo: Servo, where: str) -> None:
    """Refuse motors and dry friction, for equations that do not have them.

    Raises:
        ParameterError: a joint has a motor or dry friction.
    """
    for name, motor, friction in zip(
        robot.joint_names, servo.motors(robot), robot.friction, strict=True
    ):
        if motor is not None:
            raise ParameterError(f"Servo.motor[{name}]", motor, f"absent in {where}")
        if friction > 0.0:
            raise ParameterError(f"Robot.friction[{name}]", friction, f"0 N m in {where}")
