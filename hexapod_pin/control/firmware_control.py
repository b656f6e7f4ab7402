"""Motions and controllers through the firmware of bus servos: their position loops as ticks."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

import numpy as np

from hexapod_pin.arguments import checked, every_step
from hexapod_pin.arrays import Array, digest
from hexapod_pin.control.check_controller import check_controller, method_name, settings_of
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.set_points import (
    HostLoop,
    PlannedMotion,
    SetPoints,
    equivalent_scene,
    first_angles,
)
from hexapod_pin.drive.battery import Battery
from hexapod_pin.drive.drive_law import torque_cap
from hexapod_pin.drive.firmware import Firmware
from hexapod_pin.drive.supplied_drives import SuppliedDrives, SupplyCourse
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.robot.robot import Robot

KEPT_ROBOTS = 8
"""How many robots' motions a controller keeps."""


class _Drives(NamedTuple):
    """What moves the joints of a robot: the set-points that they follow, and what drives them."""

    points: SetPoints
    supply: SuppliedDrives
    gaps: Array
    rotors: Array

    def of_links(self, q: Array) -> Array:
        """Return joint angles (..., n) with those of their gaps added to the rotors' [rad]."""
        found = q.copy()
        found[..., self.rotors] += q[..., self.gaps]
        return found


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

    The host sends a motion's angles once in `command_period`, or those of a feedback controller,
    which ticks once in several passes and counts on the loop's continuous gains. Each joint's
    firmware reads its encoder, passes its PID and sets the duty cycle until its next pass. The
    scene's drives must be `firmware.driven(motor)`, which have the motors' back-EMF and limits and
    no gains.

    Every pass is an event of the run: a step ends there. Where an encoder is about to change its
    count, the smallest error decides on which pass it does, so that two runs differ by about a
    count; the estimated error does not contain that.

    Attributes:
        walk: a `Gait`, an open-loop motion such as `KinematicControl` or `HoldPosture`, or a
            feedback controller such as `FootControl`, whose period is a multiple of the firmware's.
            It commands angles alone, and reads its own `sensors`.
        firmware: of all joints that have a motor.
        command_period: time between two set-points of the host [s]; None: at every pass. With a
            feedback controller None or its period: then only the ends of its ramps are sent.
        encoder: what the servo's encoder reads where gears have backlash: "motor", the rotor's
            side of the gap, or "link", the joint itself.
        battery: that all motors are on; the scene's motors are then those at `battery.voltage`.
            None: a supply that keeps its voltage.
        heat: whether the motors warm up, which weakens them; `course` gives their temperatures.

    Raises:
        ParameterError: neither a motion nor a controller, a period that is not positive or not
            the controller's, another side, or a limit of temperature without `heat`.
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
        if isinstance(self.walk, FirmwareControl):
            raise ParameterError(
                "FirmwareControl.walk", "a FirmwareControl", "what it is to follow"
            )
        check_controller(self.walk)
        given = self.command_period
        if given is not None and not (math.isfinite(given) and given > 0.0):
            raise ParameterError("FirmwareControl.command_period", given, "finite and above 0 s")
        if given is not None and self._feedback and given != self.walk.period:
            allowed = f"None or {self.walk.period:g} s, the controller's period"
            raise ParameterError("FirmwareControl.command_period", given, allowed)
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
    def _feedback(self) -> bool:
        """Whether a feedback controller sends the set-points."""
        return not hasattr(self.walk, "plan")

    @property
    def gait(self) -> Gait | None:
        """The gait of the motion, if it has one."""
        found = getattr(self.walk, "gait", None)
        return found if isinstance(found, Gait) else None

    def posture(self, scene: Any) -> Array:
        """Return the joint angles of the motion's beginning, in which a run starts [rad]."""
        robot = _robot("posture", scene)
        if self._feedback:
            return first_angles(self.walk, equivalent_scene(scene, self.firmware))
        return self._motion(robot).angles(0.0)

    def start_key(self, scene: Any) -> str:
        """Return a key of all that the firmware depends on: scenes of equal keys run together."""
        key, find = _drives_key(_robot("start_key", scene), scene.servos), None
        if self._feedback:
            find = getattr(self.walk, "start_key", None)
        if find is None:
            return key
        with UserCode(method_name(self.walk, "start_key")):
            return digest(f"{key} {find(equivalent_scene(scene, self.firmware))!r}")

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
        key = self._prepared(scene)
        return {
            "drives": key, "error": rows, "total": rows.copy(), "time": -math.inf,
            "supply": self._drives[key].supply.start(batch),
            "points": self._drives[key].points.first(batch),
        }  # fmt: skip

    @every_step
    def update(
        self, time: float, measurement: Measurement, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the torques of the duty cycles of one pass, and the memory after it."""
        points = self._drives[state["drives"]].points
        angles, memory = points.at(self._sent(time), measurement, state["points"])
        state = {**state, "points": memory}
        return self._passed(time, angles, measurement.q, measurement.v, state)

    def _passed(
        self, time: float, angles: Array, q: Array, v: Array, state: dict[str, Any]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the same, of set-points, joint angles and rates (B, n) [rad, rad/s]."""
        law, drives = self.firmware, self._drives[state["drives"]]
        first = state["time"] == -math.inf
        angle = q if self.encoder == "motor" else drives.of_links(q)
        error = law.rounded(angles) - law.rounded(angle)
        duty, total = law.duty(error, error if first else state["error"], state["total"])
        step = 0.0 if first else time - state["time"]
        torque, rate, supply = drives.supply.command(duty, v, state["supply"], step)
        rest = np.broadcast_to(angles, q.shape)  # of no effect: kp is 0
        memory = {**state, "error": error, "total": total, "time": time, "supply": supply}
        return Command(rest, rate, torque), memory

    @checked
    def course(self, scene: Any, trace: Any) -> SupplyCourse:
        """Return battery, currents and temperatures at every pass of a run by this controller.

        They are found again from the joints' angles and rates, which at the passes are what the
        firmware has measured, and from the set-points: those of a plan, or those recorded of a
        feedback controller, which are known for the passes that have acted.

        Args:
            scene: of the run.
            trace: of a run with `sample` equal to the firmware's period.

        Raises:
            ParameterError: a trace of other samples, or without the set-points of a feedback
                controller.
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
        for k, angles in enumerate(self._sent_points(scene, trace)):
            q, v = trace.q[k : k + 1, 7:], trace.v[k : k + 1, 6:]
            _, state = self._passed(float(trace.time[k]), angles, q, v, state)
            rows.append(supply.at(state["supply"]))
        columns = [np.concatenate(column) for column in zip(*rows, strict=True)]
        return SupplyCourse(names, np.array(trace.time[: len(rows)]), *columns)

    def _sent_points(self, scene: Any, trace: Any) -> list[Array]:
        """Return the set-points of the passes of a run, as far as they are known [rad]. (n,) each.

        Raises:
            ParameterError: those of a feedback controller were not recorded.
        """
        if not self._feedback:
            motion = self._motion(scene.robot)
            return [motion.angles(self._sent(float(time))) for time in trace.time]
        if "set_points" not in trace.recorded:
            allowed = "with set_points: simulate(..., record=...)"
            raise ParameterError("FirmwareControl.course.trace.recorded", trace.recorded, allowed)
        # a sample is taken before what is commanded at its time: so many passes it is behind
        late = math.floor(self.delay / self.period + 1e-9) + 1
        return list(trace.q_ref[late:])

    def _sent(self, time: float) -> float:
        """Return when a planned motion's set-points that hold at a time were sent [s]."""
        step = self.command_period
        if step is None or self._feedback:
            return time
        return math.floor(time / step + 1e-9) * step

    def _motion(self, robot: Robot) -> PlannedMotion:
        """Return the motion of a robot's joints; the same one for the same robot."""
        return _kept(self._motions, _robot_key(robot), lambda: PlannedMotion(self.walk, robot))

    def _prepared(self, scene: Any) -> str:
        """Return the key of what drives the joints of a scene's robot, which is then at hand."""
        key = self.start_key(scene)
        _kept(self._drives, key, lambda: self._make(scene))
        return key

    def _make(self, scene: Any) -> _Drives:
        """Return set-points and supply of the joints of a scene's robot."""
        robot, servo, firmware = scene.robot, scene.servos, self.firmware
        motors = servo.motors(robot)
        stall = [m.stall_torque * m.voltage_ratio / firmware.duty_limit if m else 0.0
                 for m in motors]  # fmt: skip
        supply = SuppliedDrives(
            robot.joint_names, motors, np.array(stall), torque_cap(robot, servo), self.battery,
            self.heat, firmware.temperature_limit,
        )  # fmt: skip
        pairs = [(robot.joint_index(x), robot.joint_index(y)) for x, y in robot.gaps.items()]
        gaps, rotors = np.array(pairs, dtype=int).reshape(-1, 2).T
        points: SetPoints
        if self._feedback:
            goals = self.command_period is not None
            known = equivalent_scene(scene, firmware)
            points = HostLoop(self.walk, known, firmware.period, goals)
        else:
            points = self._motion(robot)
        return _Drives(points, supply, gaps, rotors)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        data: dict[str, Any] = {
            "kind": "firmware", "walk": settings_of(self.walk),
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
