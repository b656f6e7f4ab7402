"""The set-points of a firmware's passes: of a planned motion, or of a controller on the host."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.check_controller import (
    at_time,
    checked_answer,
    checked_rows,
    method_name,
)
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.joint_trajectory import CURVED, planned_motion, trajectory_curve
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.drive.firmware import Firmware

FIRST_PLAN = 8.0
"""Length of the first plan of a motion [s]; a run that goes on takes one of twice the length."""

ROUNDING = 1e-9
"""How far a set-point may be beyond its range for rounding [rad]; of ticks, in periods."""

Memory = dict[str, Any]


class SetPoints(Protocol):
    """The angles that a firmware follows, pass by pass. What changes is in a memory of arrays."""

    def first(self, batch: int) -> Memory:
        """Return the memory before the first pass of `batch` runs."""
        ...

    def at(self, time: float, measurement: Measurement, memory: Memory) -> tuple[Array, Memory]:
        """Return the angles (n,) or (B, n) that hold at a pass [rad], and the memory after it."""
        ...


class PlannedMotion:
    """The angles of a motion at any time, planned as far as they are asked for."""

    def __init__(self, walk: Any, robot: Any) -> None:
        """Take a controller with a plan, and who follows it."""
        self._walk, self._robot = walk, robot
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

    def first(self, batch: int) -> Memory:
        """Return nothing: a plan does not change."""
        return {}

    def at(self, time: float, measurement: Measurement, memory: Memory) -> tuple[Array, Memory]:
        """Return the angles (n,) of a time [s], and the memory as it was."""
        return self.angles(time), memory


class HostLoop:
    """A feedback controller on the host, which sends the set-points of a firmware.

    It ticks once in several passes. What it commands acts `delay` after its tick. A ramp is the
    cubic of `Command.ramp`, which the host evaluates for every pass, or its end, sent at once.
    """

    def __init__(self, controller: Any, scene: Any, period: float, goals: bool) -> None:
        """Take a controller, and the robot whose joints it moves.

        Args:
            controller: a `FeedbackController`.
            scene: in which it starts: with the continuous equivalents of the servos.
            period: between two passes of the firmware [s].
            goals: whether one angle per tick is sent, the end of a ramp.

        Raises:
            ParameterError: its ticks or the age of its readings are no multiples of the passes.
        """
        self._controller, self._robot, self._scene = controller, scene.robot, scene
        self._sensors: Sensors = getattr(controller, "sensors", None) or Sensors()
        self._period, self._goals = period, goals
        self._passes = _multiple("period", controller.period, period, least=1)
        self._age = _multiple("sensors.delay", self._sensors.delay, period, least=0)
        self._delay = float(getattr(controller, "delay", 0.0))
        self._call = method_name(controller, "update")

    @property
    def _step(self) -> float:
        """Time between two ticks of the host [s]."""
        return self._passes * self._period

    def first(self, batch: int) -> Memory:
        """Return the memory of `batch` runs that stand in the posture in which they start."""
        with UserCode(method_name(self._controller, "start")):
            state = self._controller.start(self._scene, batch)
        rest = np.broadcast_to(first_angles(self._controller, self._scene), (batch, self._joints))
        still = {"begin": 0.0, "end": 0.0, "from": rest.copy(), "leaves": np.zeros(rest.shape),
                 "to": rest.copy(), "arrives": np.zeros(rest.shape)}  # fmt: skip
        return {"state": state, "readings": [], "segment": still, "coming": [], "begun": False}

    @property
    def _joints(self) -> int:
        return len(self._robot.joint_names)

    def at(self, time: float, measurement: Measurement, memory: Memory) -> tuple[Array, Memory]:
        """Return the angles (B, n) at a pass [rad], and the memory after it.

        Raises:
            ParameterError, UserCodeError: what the controller returns is no command of angles, or
                it raises.
        """
        count, first = round(time / self._period), not memory["begun"]
        memory = {**memory, "readings": [*memory["readings"]], "coming": [*memory["coming"]]}
        memory["begun"] = True
        ahead = count + self._age
        due = 1 if ahead % self._passes == 0 else 0
        if first:  # also of the ticks whose reading would lie before the run
            due = ahead // self._passes + 1 - -(-count // self._passes)
        memory["readings"] += [dict(vars(measurement))] * due
        if count % self._passes == 0:
            self._tick(time, count // self._passes, memory)
        while memory["coming"] and memory["coming"][0]["begin"] <= time + ROUNDING * self._period:
            memory["segment"] = self._begun(memory["segment"], memory["coming"].pop(0))
        return _along(memory["segment"], time)[0], memory

    def _tick(self, time: float, tick: int, memory: Memory) -> None:
        """Ask the controller for a command, which then is one of those to come."""
        measured = Measurement(**memory["readings"].pop(0))
        reader = self._sensors.start([0] * len(measured.q))
        with UserCode(self._call, time):
            answer = self._controller.update(time, reader.read(tick, measured), memory["state"])
        command, memory["state"] = checked_answer(self._call, time, answer)
        memory["coming"].append(self._coming(command, time, len(measured.q)))

    def _coming(self, command: Command, time: float, batch: int) -> Memory:
        """Return a checked command of a tick [s], when it begins and ends.

        Raises:
            ParameterError: it is of torques, of another shape, not finite or beyond the ranges.
        """
        shape, begin = (batch, self._joints), time + self._delay
        rate, torque = (
            None if given is None else checked_rows(self._call, name, given, shape, time)
            for name, given in (("v", command.v), ("torque", command.torque))
        )
        if torque is not None and torque.any():
            hint = "The firmware of a position servo takes angles alone."
            worst = float(np.abs(torque).max())
            raise ParameterError(f"{self._call}.torque", worst, f"None{at_time(time)}", hint)
        if rate is not None and not np.isfinite(rate).all():
            odd = float(rate[~np.isfinite(rate)][0])
            raise ParameterError(f"{self._call}.v", odd, f"finite [rad/s]{at_time(time)}")
        q = checked_rows(self._call, "q", command.q, shape, time)
        robot = self._robot
        good = (q >= robot.lower - ROUNDING) & (q <= robot.upper + ROUNDING)  # false for NaN
        if not good.all():
            row, joint = np.argwhere(~good)[0]
            where = f"{self._call}.q[{robot.joint_names[joint]}]"
            span = f"{robot.lower[joint]:.4g} to {robot.upper[joint]:.4g} rad"
            raise ParameterError(where, float(q[row, joint]), f"from {span}{at_time(time)}")
        end = begin + self._step if command.ramp and not self._goals else begin
        return {"begin": begin, "end": end, "to": q, "arrives": rate}

    def _begun(self, segment: Memory, command: Memory) -> Memory:
        """Return the segment of the set-points that a command begins."""
        start, leaves = _along(segment, command["begin"])
        rate = command["arrives"]
        if command["end"] == command["begin"]:
            rate = np.zeros(start.shape) if rate is None or self._goals else rate
        elif rate is None:
            rate = (command["to"] - start) / self._step
        return {**command, "from": start, "leaves": leaves, "arrives": rate}


def _multiple(name: str, value: float, period: float, least: int) -> int:
    """Return how many passes a time of the host lasts.

    Raises:
        ParameterError: no whole number of them.
    """
    count = round(value / period)
    if count < least or abs(count * period - value) > ROUNDING * period:
        allowed = f"a multiple of the firmware's period, {period:g} s"
        raise ParameterError(f"FirmwareControl.walk.{name}", value, allowed)
    return count


def _along(segment: Memory, time: float) -> tuple[Array, Array]:
    """Return angles and rates (B, n) of a cubic at a time; behind its end they rest there."""
    span = segment["end"] - segment["begin"]
    s = 1.0 if span <= 0.0 else min(max((time - segment["begin"]) / span, 0.0), 1.0)
    start, end = segment["from"], segment["to"]
    leaves, arrives = span * segment["leaves"], span * segment["arrives"]
    rest = end - start
    second, third = 3.0 * rest - 2.0 * leaves - arrives, leaves + arrives - 2.0 * rest
    if s >= 1.0:
        return end, segment["arrives"]
    angles = start + s * (leaves + s * (second + s * third))
    return angles, (leaves + s * (2.0 * second + 3.0 * s * third)) / span


def first_angles(controller: Any, scene: Any) -> Array:
    """Return the angles (n,) in which a run by a feedback controller starts [rad]."""
    posture = getattr(controller, "posture", None)
    if posture is None:
        return np.asarray(scene.robot.posture, dtype=float)
    with UserCode(method_name(controller, "posture")):
        return np.asarray(posture(scene), dtype=float)


def equivalent_scene(scene: Any, firmware: Firmware) -> Any:
    """Return a scene whose drives have the gains of a loop: what a controller counts on.

    Args:
        scene: with drives of `Firmware.driven`, which have no gains.
        firmware: the loop.
    """
    servo, robot = scene.servos, scene.robot
    kp, kd = (np.array(gain, dtype=float) for gain in servo.gains(robot))
    for joint, motor in enumerate(servo.motors(robot)):
        if motor is not None:
            stall = motor.stall_torque * motor.voltage_ratio / firmware.duty_limit
            kp[joint], kd[joint] = (
                stall * firmware.proportional,
                kd[joint] + stall * firmware.derivative,
            )
    gains = {"kp": tuple(map(float, kp)), "kd": tuple(map(float, kd))}
    return replace(scene, servo=servo.model_copy(update=gains))
