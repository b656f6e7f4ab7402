"""An open-loop motion through the firmware of bus servos: their position loops as ticks."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

import numpy as np

from hexapod_pin.arguments import checked, every_step
from hexapod_pin.arrays import Array, digest
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import CURVED, planned_motion, trajectory_curve
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.drive.battery import Battery
from hexapod_pin.drive.drive_law import torque_cap
from hexapod_pin.drive.firmware import Firmware
from hexapod_pin.drive.supplied_drives import SuppliedDrives, SupplyCourse
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.robot.robot import Robot

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


class _Drives(NamedTuple):
    """What moves the joints of a robot: the motion that they follow, and what drives them."""

    motion: PlannedMotion
    supply: SuppliedDrives


Kept = TypeVar("Kept")


def _kept(store: OrderedDict[str, Kept], key: str, make: Callable[[], Kept]) -> Kept:
    """Return what a store has under a key, made where it is not there yet."""
    if key not in store:
        store[key] = make()
    store.move_to_end(key)
    while len(store) > KEPT_ROBOTS:
        store.popitem(last=False)
    return store[key]


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
        battery: that all motors are on; the scene's motors are then those at `battery.voltage`.
            None: a supply that keeps its voltage.
        heat: whether the motors warm up, which weakens them; `course` gives their temperatures.

    Raises:
        ParameterError: a motion that has no plan, a period that is not positive, another side, or
            a limit of temperature without `heat`.
    """

    walk: Any
    firmware: Firmware
    command_period: float | None = None
    encoder: Literal["motor", "link"] = "motor"
    battery: Battery | None = None
    heat: bool = False
    _motions: OrderedDict[str, PlannedMotion] = field(
        default_factory=OrderedDict, init=False, repr=False, compare=False
    )
    _drives: OrderedDict[str, _Drives] = field(
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
        if self.firmware.temperature_limit is not None and not self.heat:
            hint = "It is a limit of what a motor warms to."
            raise ParameterError("FirmwareControl.heat", self.heat, "True with a "
                                 "Firmware.temperature_limit", hint)  # fmt: skip

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
        return _drives_key(_robot("start_key", scene), scene.servos)

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
        rows = np.zeros((batch, len(motors)))
        key = self._prepared(robot, scene.servos)
        return {
            "drives": key, "error": rows, "total": rows.copy(), "time": -math.inf,
            "supply": self._drives[key].supply.start(batch),
        }  # fmt: skip

    @every_step
    def update(
        self, time: float, measurement: Measurement, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the torques of the duty cycles of one pass, and the memory after it."""
        return self._passed(time, measurement.q, measurement.v, state)

    def _passed(
        self, time: float, q: Array, v: Array, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the same, of joint angles and rates (B, n) [rad, rad/s]."""
        law, drives = self.firmware, self._drives[state["drives"]]
        motion, first = drives.motion, state["time"] == -math.inf
        angle = q if self.encoder == "motor" else motion.of_links(q)
        error = law.rounded(motion.angles(self._sent(time))) - law.rounded(angle)
        duty, total = law.duty(error, error if first else state["error"], state["total"])
        step = 0.0 if first else time - state["time"]
        torque, rate, supply = drives.supply.command(duty, v, state["supply"], step)
        rest = np.broadcast_to(motion.angles(0.0), q.shape)  # of no effect: kp is 0
        memory = {**state, "error": error, "total": total, "time": time, "supply": supply}
        return Command(rest, rate, torque), memory

    @checked
    def course(self, scene: Any, trace: Any) -> SupplyCourse:
        """Return battery, currents and temperatures at every pass of a run by this controller.

        They are found again from the joints' angles and rates, which at the passes are what the
        firmware has measured.

        Args:
            scene: of the run.
            trace: of a run with `sample` equal to the firmware's period.

        Raises:
            ParameterError: a trace of other samples.
        """
        if not all(hasattr(trace, name) for name in ("time", "q", "v")):
            raise ParameterError("FirmwareControl.course.trace", type(trace).__name__, "a Trace")
        steps = np.arange(len(trace.time)) * self.period
        if trace.time.shape != steps.shape or np.abs(trace.time - steps).max() > 1e-9:
            sample = float(trace.time[1] - trace.time[0]) if len(trace.time) > 1 else None
            allowed = f"{self.period:g} s, the firmware's period: simulate(..., sample=...)"
            raise ParameterError("FirmwareControl.course.trace.sample", sample, allowed)
        state = self.start(scene, 1)
        supply, names = self._drives[state["drives"]].supply, scene.robot.joint_names
        rows: list[tuple[Array, ...]] = []
        for time, q, v in zip(trace.time, trace.q[:, 7:], trace.v[:, 6:], strict=True):
            _, state = self._passed(float(time), q[None], v[None], state)
            rows.append(supply.at(state["supply"]))
        columns = [np.concatenate(column) for column in zip(*rows, strict=True)]
        return SupplyCourse(names, np.array(trace.time), *columns)

    def _sent(self, time: float) -> float:
        """Return when the host has sent the set-points that hold at a time [s]."""
        step = self.command_period
        return time if step is None else math.floor(time / step + 1e-9) * step

    def _motion(self, robot: Robot) -> PlannedMotion:
        """Return the motion of a robot's joints; the same one for the same robot."""
        return _kept(self._motions, _robot_key(robot), lambda: PlannedMotion(self.walk, robot))

    def _prepared(self, robot: Robot, servo: Servo) -> str:
        """Return the key of what drives a robot's joints, which is then at hand."""
        key = _drives_key(robot, servo)
        _kept(self._drives, key, lambda: self._make(robot, servo))
        return key

    def _make(self, robot: Robot, servo: Servo) -> _Drives:
        """Return motion and supply of a robot's joints."""
        motors, firmware = servo.motors(robot), self.firmware
        stall = [m.stall_torque * m.voltage_ratio / firmware.duty_limit if m else 0.0
                 for m in motors]  # fmt: skip
        supply = SuppliedDrives(
            robot.joint_names, motors, np.array(stall), torque_cap(robot, servo), self.battery,
            self.heat, firmware.temperature_limit,
        )  # fmt: skip
        return _Drives(self._motion(robot), supply)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        data: dict[str, Any] = {
            "kind": "firmware", "walk": dict(self.walk.to_dict()),
            "firmware": self.firmware.model_dump(exclude_none=True),
        }  # fmt: skip
        if self.command_period is not None:
            data["command_period"] = self.command_period
        if self.encoder != "motor":
            data["encoder"] = self.encoder
        if self.battery is not None:
            data["battery"] = self.battery.model_dump(exclude_none=True)
        return {**data, "heat": True} if self.heat else data


def _robot_key(robot: Any) -> str:
    """Return a key of all that a motion depends on."""
    return digest(f"{robot.digest} {robot.posture} {robot.feet}")


def _drives_key(robot: Any, servo: Servo) -> str:
    """Return a key of all that motion and drives depend on."""
    return digest(f"{_robot_key(robot)} {servo.model_dump_json()}")


def _robot(call: str, scene: Any) -> Any:
    """Return the robot of a scene; this layer does not import the type.

    Raises:
        ParameterError: it is no scene.
    """
    if not all(hasattr(scene, name) for name in ("robot", "servos")):
        allowed = "a Scene"
        raise ParameterError(f"FirmwareControl.{call}.scene", type(scene).__name__, allowed)
    return scene.robot
