"""Torques at the joints by docs/drive.md, written apart from the native core.

All pieces of the law are frozen (`JointModes`) and continued beyond their ends, so that what an
integrator sees between two switches is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.drive.gear_friction import GearFriction
    from hexapod_pin.scene.scene import Scene

NO_LIMIT = 1e300
"""Stands for an infinite torque or angle: 0 times it is 0."""

REST_RATE = 1e-15
"""A joint that turns back faster has come to rest [rad/s]; one that breaks loose begins at 0."""

WITHIN, LINE, CAP = 0, 1, 2
FREE, PRESSED, RELEASED = 0, 1, 2


@dataclass(frozen=True, eq=False)
class JointModes:
    """The piece of each joint's law, (n,) whole numbers each; signs are the side.

    Attributes:
        limit: WITHIN, +-LINE or +-CAP.
        stop: FREE, +-PRESSED or +-RELEASED.
        dry: 0 without dry friction or stuck, +-1 opposing a rate of that sign.
    """

    limit: Array
    stop: Array
    dry: Array

    def same(self, other: JointModes) -> bool:
        """Whether all modes are equal."""
        pairs = ((self.limit, other.limit), (self.stop, other.stop), (self.dry, other.dry))
        return all(np.array_equal(one, two) for one, two in pairs)


class JointDrives:
    """The drives of all joints; arrays of shape (n,), SI."""

    def __init__(self, scene: Scene) -> None:
        """Read servos, motors, stops and the joints' own friction."""
        robot, servo, stops = scene.robot, scene.servos, scene.joint_stops
        n = len(robot.joint_names)
        self.kp, self.kd = (np.array(gain, dtype=float) for gain in servo.gains(robot))
        self.cap = np.array(robot.effort_limit) if servo.limited else np.full(n, NO_LIMIT)
        self.stall, self.slope = np.full(n, NO_LIMIT), np.zeros(n)
        self.viscous, self.level = np.array(robot.damping), np.array(robot.friction)
        self.gears: dict[int, GearFriction] = {}
        for j, motor in enumerate(servo.motors(robot)):
            if motor is None:
                continue
            self.stall[j] = motor.voltage_ratio * motor.stall_torque
            self.slope[j] = motor.stall_torque / motor.no_load_speed
            self.viscous[j] += motor.viscous_friction
            self.level[j] += motor.dry_friction
            if motor.gear_friction is not None:
                self.gears[j] = _with_external_load(motor.gear_friction)
            if motor.peak_torque is not None:
                self.cap[j] = min(self.cap[j], motor.peak_torque)
        self.dry = self.level > 0.0
        self.dry[list(self.gears)] = True
        self.cap = np.minimum(self.cap, NO_LIMIT)
        self.lower = np.maximum(robot.lower, -NO_LIMIT)
        self.upper = np.minimum(robot.upper, NO_LIMIT)
        sliding = stops.sliding_stiffness or 0.0
        self.stop_stiffness = np.where(robot.turning, stops.stiffness, sliding)
        self.stop_gain = 1.5 * stops.dissipation

    def lose(self, joints: list[int]) -> None:
        """Let the drives of joints give no torque from now on; friction and stops stay."""
        for values in (self.kp, self.kd, self.slope):
            values[joints] = 0.0
        self.cap[joints] = self.stall[joints] = NO_LIMIT

    def demand(self, angle: Array, rate: Array, to: tuple[Array, ...]) -> Array:
        """Return the torque asked of the motors [N m]."""
        return self.kp * (to[0] - angle) + self.kd * (to[1] - rate)

    def torque(
        self, modes: JointModes, angle: Array, rate: Array, demand: Array, outer: Array
    ) -> Array:
        """Return all torque at the joints but what holds the stuck ones [N m].

        Args:
            modes: the pieces of the laws.
            angle: of the joints [rad].
            rate: of the joints [rad/s].
            demand: torque asked of the motors [N m].
            outer: what acts on the joints but drives, stops and inertial forces [N m].
        """
        motor, stop = self._motor(modes, rate, demand), self._stop(modes, angle, rate)
        friction = self._friction(modes.dry, motor, rate, outer + stop)
        return motor - self.viscous * rate - modes.dry * friction + stop

    def _motor(self, modes: JointModes, rate: Array, demand: Array) -> Array:
        side = np.sign(modes.limit)
        edge = side * self.stall - self.slope * rate
        beyond = np.where(abs(modes.limit) == CAP, side * self.cap, edge)
        return np.where(modes.limit == WITHIN, demand, beyond)

    def _friction(self, sign: Array, motor: Array, rate: Array, external: Array) -> Array:
        """Return the level of friction of joints that move along a sign, or are about to [N m]."""
        level = self.level.copy()
        for j, gear in self.gears.items():
            level[j] += _by_bam(gear, sign[j] * motor[j], sign[j] * external[j], sign[j] * rate[j])
        return level

    def _stop(self, modes: JointModes, angle: Array, rate: Array) -> Array:
        side = np.sign(modes.stop)
        beyond = side * (angle - np.where(side > 0, self.upper, self.lower))
        push = self.stop_stiffness * beyond * (1.0 + self.stop_gain * side * rate)
        return np.where(abs(modes.stop) == PRESSED, -side * push, 0.0)

    def modes(self, angle: Array, rate: Array, demand: Array) -> JointModes:
        """Return the modes of a state; joints at rest with dry friction are stuck."""
        high, low = self.stall - self.slope * rate, -self.stall - self.slope * rate
        on_line = np.clip(demand, low, high)
        limit = np.where(demand > high, LINE, np.where(demand < low, -LINE, WITHIN))
        limit = np.where(on_line > self.cap, CAP, np.where(on_line < -self.cap, -CAP, limit))
        side = np.where(angle > self.upper, 1, np.where(angle < self.lower, -1, 0))
        side = np.where(self.stop_stiffness > 0.0, side, 0)
        pushes = 1.0 + self.stop_gain * side * rate > 0.0
        stop = side * np.where(pushes, PRESSED, RELEASED)
        dry = np.where(self.dry, np.sign(rate), 0.0)
        return JointModes(limit, stop, dry)

    def stuck(self, modes: JointModes) -> Array:
        """Return which joints dry friction holds at rest."""
        stuck: Array = self.dry & (modes.dry == 0)
        return stuck

    def switches(
        self, modes: JointModes, angle: Array, rate: Array, demand: Array, outer: Array,
        holding: Array,
    ) -> Array:  # fmt: skip
        """Return numbers that are positive inside the modes: limits, stops, dry friction (3 n,)."""
        high, low = self.stall - self.slope * rate, -self.stall - self.slope * rate
        within = np.minimum(self.cap - abs(demand), np.minimum(high - demand, demand - low))
        side = np.sign(modes.limit)
        edge = side * self.stall - self.slope * rate
        line = np.minimum(side * (demand - edge), self.cap - abs(edge))
        cap = side * np.clip(demand, low, high) - self.cap
        kind = abs(modes.limit)
        limit = np.where(kind == WITHIN, within, np.where(kind == LINE, line, cap))
        moving = modes.dry * rate + REST_RATE
        motor, external = self._motor(modes, rate, demand), outer + self._stop(modes, angle, rate)
        most = self._friction(-np.sign(holding), motor, np.zeros_like(rate), external)
        dry = np.where(modes.dry == 0, most - abs(holding), moving)
        dry = np.where(self.dry, dry, NO_LIMIT)
        return np.concatenate([limit, self._stop_switch(modes, angle, rate), dry])

    def _stop_switch(self, modes: JointModes, angle: Array, rate: Array) -> Array:
        side, kind = np.sign(modes.stop), abs(modes.stop)
        inside = np.minimum(self.upper - angle, angle - self.lower)
        beyond = side * (angle - np.where(side > 0, self.upper, self.lower))
        push = 1.0 + self.stop_gain * side * rate
        pressed = np.minimum(beyond, np.where(kind == RELEASED, -push, push))
        switch = np.where(kind == FREE, inside, pressed)
        return np.where(self.stop_stiffness > 0.0, switch, NO_LIMIT)

    def next_modes(
        self, old: JointModes, switches: Array, found: JointModes, holding: Array
    ) -> tuple[JointModes, Array]:
        """Return the modes behind a switch, and which joints have come to rest there (n,).

        Args:
            old: the modes before.
            switches: of `switches` just behind it, in the modes before (3 n,).
            found: `modes` just behind it.
            holding: torques that hold stuck joints (n,) [N m].
        """
        limit, stop, dry = np.split(switches < 0.0, 3)
        stops = dry & (old.dry != 0)
        slips = dry & (old.dry == 0)
        moved = np.where(slips, -np.sign(holding), np.where(stops, 0.0, old.dry))
        new = replace(
            old, limit=np.where(limit, found.limit, old.limit),
            stop=np.where(stop, found.stop, old.stop), dry=moved,
        )  # fmt: skip
        return new, stops


def _by_bam(gear: GearFriction, motor: float, load: float, speed: float) -> float:
    """Return BAM's M6 of a motor torque and an external load along the motion [N m]."""
    fade = float(np.exp(-((max(speed, 0.0) / gear.stribeck_speed) ** gear.stribeck_exponent)))
    slow = gear.stribeck + abs(gear.load_stribeck * load - gear.motor_stribeck * motor)
    if motor * load < 0.0:
        passed = min(max(5.0 * (abs(load / motor) - 0.9), 0.0), 1.0)
        share = 3.0 * passed**2 - 2.0 * passed**3
        slow += (1.0 - share) * gear.load_quadratic * load**2
        slow += share * gear.motor_quadratic * motor**2
    return gear.coulomb + abs(gear.load * load - gear.motor * motor) + fade * slow


def _with_external_load(gear: GearFriction) -> GearFriction:
    """Return a gear whose load is external.

    Raises:
        ParameterError: its load is what it passes on, which is not written here.
    """
    if not gear.external_load:
        raise ParameterError("GearFriction.external_load", False, "True in this right-hand side")
    return gear
