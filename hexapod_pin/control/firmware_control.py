"""An open-loop motion through the firmware of bus servos: their position loops as ticks."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hexapod_pin.arguments import checked, every_step
from hexapod_pin.arrays import Array, digest
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import CURVED, planned_motion, trajectory_curve
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.drive.firmware import Firmware
from hexapod_pin.errors import ParameterError

FIRST_PLAN = 8.0
"""Length of the first plan of a motion [s]; a run that goes on takes one of twice the length."""

KEPT_ROBOTS = 8
"""How many robots' motions a controller keeps."""


class PlannedMotion:
    """The angles of a motion at any time, planned as far as they are asked for."""

    def __init__(self, walk: Any, robot: Any) -> None:
        """Take a controller with a plan, and who follows it."""
        self._walk, self._robot = walk, robot
        pairs = [(robot.joint_index(x), robot.joint_index(y)) for x, y in robot.gaps.items()]
        self._gaps, self._rotors = np.array(pairs, dtype=int).reshape(-1, 2).T
        self._plan_until(FIRST_PLAN)

    def _plan_until(self, end: float) -> None:
        """Plan the motion to a time [s]."""
        self._end, self._plan = end, self._walk.plan(self._robot, end)
        self._curve = trajectory_curve(self._plan) if self._plan.kind in CURVED else None

    def angles(self, time: float) -> Array:
        """Return the joint angles at a time [s], `Robot.joint_names` order [rad]. Shape (n,)."""
        if time > self._end:
            self._plan_until(2.0 * time)
        if self._curve is not None:
            return np.asarray(self._curve(min(time, self._plan.time[-1])))
        found: Array = planned_motion(self._plan, np.array([time]))[0][0]
        return found

    def of_links(self, q: Array) -> Array:
        """Return joint angles (..., n) with those of their gaps added to the rotors' [rad]."""
        found = q.copy()
        found[..., self._rotors] += q[..., self._gaps]
        return found


@checked
@dataclass(frozen=True, eq=False)
class FirmwareControl:
    """Follow a motion by the position loops of bus servos instead of continuous PD servos.

    The host sends a motion's angles once in `command_period`; each joint's firmware reads its
    encoder, passes its PID and sets the duty cycle until its next pass. The scene's drives must be
    `firmware.driven(motor)`, which have the motors' back-EMF and limits and no gains.

    Every pass is an event of the run: a step ends there. Where an encoder is about to change its
    count, the smallest error decides on which pass it does, so that two runs differ by about a
    count; the estimated error does not contain that.

    Attributes:
        walk: a `Gait`, or an open-loop motion such as `KinematicControl` or `HoldPosture`.
        firmware: of all joints that have a motor.
        command_period: time between two set-points of the host [s]; None: at every pass.
        encoder: what the servo's encoder reads where gears have backlash: "motor", the rotor's
            side of the gap, or "link", the joint itself.

    Raises:
        ParameterError: a motion that has no plan, a period that is not positive, or another side.
    """

    walk: Any
    firmware: Firmware
    command_period: float | None = None
    encoder: Literal["motor", "link"] = "motor"
    _motions: OrderedDict[str, PlannedMotion] = field(
        default_factory=OrderedDict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Check; a gait alone is walked by `KinematicControl`."""
        if isinstance(self.walk, Gait):
            object.__setattr__(self, "walk", KinematicControl(self.walk))
        if not hasattr(self.walk, "plan"):
            allowed = "a Gait, or an open-loop motion with plan(robot, duration)"
            raise ParameterError("FirmwareControl.walk", type(self.walk).__name__, allowed)
        given = self.command_period
        if given is not None and not (math.isfinite(given) and given > 0.0):
            raise ParameterError("FirmwareControl.command_period", given, "finite and above 0 s")
        if self.encoder not in ("motor", "link"):
            raise ParameterError("FirmwareControl.encoder", self.encoder, '"motor" or "link"')

    @property
    def period(self) -> float:
        """Time between two passes of the firmware [s]."""
        return self.firmware.period

    @property
    def delay(self) -> float:
        """Time from a reading of the encoder until its duty cycle acts [s]."""
        return self.firmware.delay

    @property
    def gait(self) -> Gait | None:
        """The gait of the motion, if it has one."""
        found = getattr(self.walk, "gait", None)
        return found if isinstance(found, Gait) else None

    def posture(self, scene: Any) -> Array:
        """Return the joint angles of the motion's beginning, in which a run starts [rad]."""
        return self._motion(_robot("posture", scene)).angles(0.0)

    def start_key(self, scene: Any) -> str:
        """Return a key of all that the firmware depends on: scenes of equal keys run together."""
        key = _robot_key(_robot("start_key", scene))
        return digest(f"{key} {scene.servos.model_dump_json()}")

    def start(self, scene: Any, batch: int) -> dict[str, Any]:
        """Return the memory before the first pass of `batch` runs in lock-step.

        Raises:
            ParameterError: drives with gains of their own or without a motor, or no runs.
        """
        robot = _robot("start", scene)
        if batch < 1:
            raise ParameterError("FirmwareControl.start.batch", batch, "at least 1")
        motors, (kp, _) = scene.servos.motors(robot), scene.servos.gains(robot)
        driven = np.array([motor is not None for motor in motors])
        if not driven.any():
            hint = "Make the drives by Firmware.driven(motor)."
            raise ParameterError("Scene.servo.motor", None, "given", hint)
        if (kp[driven] > 0.0).any():
            worst = float(kp[driven].max())
            hint = "The firmware is the loop: make the drives by Firmware.driven(motor)."
            raise ParameterError("Scene.servo.kp", worst, "0 N m/rad where a motor is", hint)
        stall = [m.stall_torque * m.voltage_ratio / self.firmware.duty_limit if m else 0.0
                 for m in motors]  # fmt: skip
        rows = np.zeros((batch, len(motors)))
        self._motion(robot)
        return {
            "robot": _robot_key(robot), "stall": np.array(stall), "error": rows,
            "total": rows.copy(), "passes": 0,
        }  # fmt: skip

    @every_step
    def update(
        self, time: float, measurement: Measurement, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the torques of the duty cycles of one pass, and the memory after it."""
        law, motion = self.firmware, self._motions[state["robot"]]
        angle = measurement.q if self.encoder == "motor" else motion.of_links(measurement.q)
        error = law.rounded(motion.angles(self._sent(time))) - law.rounded(angle)
        before = state["error"] if state["passes"] else error
        duty, total = law.duty(error, before, state["total"])
        rest = np.broadcast_to(motion.angles(0.0), measurement.q.shape)  # of no effect: kp is 0
        memory = {**state, "error": error, "total": total, "passes": state["passes"] + 1}
        return Command(rest, torque=duty * state["stall"]), memory

    def _sent(self, time: float) -> float:
        """Return when the host has sent the set-points that hold at a time [s]."""
        step = self.command_period
        return time if step is None else math.floor(time / step + 1e-9) * step

    def _motion(self, robot: Any) -> PlannedMotion:
        """Return the motion of a robot's joints; the same one for the same robot."""
        key = _robot_key(robot)
        if key not in self._motions:
            self._motions[key] = PlannedMotion(self.walk, robot)
        self._motions.move_to_end(key)
        while len(self._motions) > KEPT_ROBOTS:
            self._motions.popitem(last=False)
        return self._motions[key]

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        data: dict[str, Any] = {
            "kind": "firmware", "walk": dict(self.walk.to_dict()),
            "firmware": self.firmware.model_dump(exclude_none=True),
        }  # fmt: skip
        if self.command_period is not None:
            data["command_period"] = self.command_period
        return data if self.encoder == "motor" else {**data, "encoder": self.encoder}


def _robot_key(robot: Any) -> str:
    """Return a key of all that a motion depends on."""
    return digest(f"{robot.digest} {robot.posture} {robot.feet}")


def _robot(call: str, scene: Any) -> Any:
    """Return the robot of a scene; this layer does not import the type.

    Raises:
        ParameterError: it is no scene.
    """
    if not all(hasattr(scene, name) for name in ("robot", "servos")):
        allowed = "a Scene"
        raise ParameterError(f"FirmwareControl.{call}.scene", type(scene).__name__, allowed)
    return scene.robot
