"""Joint servos: what turns a set-point into a torque."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import NonNegativeFloat, field_validator, model_serializer

from hexapod_pin.drive.assumed_gains import EFFORT_TIME, FULL_EFFORT_ERROR, assumed_gains
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.per_joint import numbers_by_joint, values_by_joint
from hexapod_pin.spec import Spec, require_factor

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler

    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.robot import Robot

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
        if any(isinstance(part, Motor | Mapping) for part in value.values()):
            return {k: Motor(**m) if isinstance(m, Mapping) else m for k, m in value.items()}
        return Motor(**value)

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}

    def describe(self) -> str:
        """Return the gains with their units, in words; of sliding joints they are N/m, N s/m."""
        return f"kp {_text(self.kp)} N m/rad, kd {_text(self.kd)} N m s/rad"

    def gains(self, robot: Robot) -> tuple[Array, Array]:
        """Return kp (n,) [N m/rad] and kd (n,) [N m s/rad], in the order of the robot's joints.

        Raises:
            ParameterError: a joint has no gain, a key names no joint, or the count is wrong.
        """
        return numbers_by_joint(robot, "Servo.kp", self.kp), numbers_by_joint(
            robot, "Servo.kd", self.kd
        )

    def motors(self, robot: Robot) -> tuple[Motor | None, ...]:
        """Return the motor of each joint, None where there is none.

        Raises:
            ParameterError: a key names no joint.
        """
        if not isinstance(self.motor, Mapping):
            return tuple(self.motor if turns else None for turns in robot.turning)
        found = values_by_joint(robot, "Servo.motor", self.motor)
        return tuple(found.get(name) for name in robot.joint_names)

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
        weight and leg length where it is not; `rule` says so. See `assumed_gains`.

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
        efforts = robot.effort[robot.turning]
        effort = float(efforts.max()) if efforts.size else 0.0
        stiffness = effort / error
        return cls(
            kp=stiffness if kp is None else kp,
            kd=stiffness * time if kd is None else kd,
            assumed=kp is None or kd is None,
        )


MOST_NAMED = 6
"""Most gains of a mapping that are told one by one."""


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
