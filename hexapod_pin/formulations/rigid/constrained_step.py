"""One step of a robot on servos while its grounded feet stay where they are.

Linearly implicit Euler in the servos (stiff: kd/I is 1e4 1/s on a light leg), S2 eqs. 1-4 for the
feet, extrapolated once from h and h/2 to order 2; then the feet are put back on the ground in
position and velocity, along M^-1 J^T, so that nothing drifts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid.contact_set import Grip
from hexapod_pin.formulations.rigid.kkt import solve_ranked
from hexapod_pin.formulations.rigid.model import RigidModel, Terms
from hexapod_pin.formulations.rigid.motion import RigidMotion, motion_under
from hexapod_pin.formulations.rigid.set_points import SetPoints

if TYPE_CHECKING:
    from hexapod_pin.drive.servo import Servo

CLIPS = 4
"""Times a step is solved again because another servo reached its limit."""


@dataclass(frozen=True)
class Moment:
    """A state with everything rigid contact makes of it.

    Attributes:
        time: [s].
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        terms: of the equations of motion.
        motion: accelerations, forces, torques.
    """

    time: float
    q: Array
    v: Array
    terms: Terms
    motion: RigidMotion


@dataclass(frozen=True)
class Drive:
    """A rigid robot whose joints follow set-points through their servos.

    Attributes:
        model: robot and ground.
        servo: gains and whether torques are limited.
        points: the set-points.
    """

    model: RigidModel
    servo: Servo
    points: SetPoints

    @property
    def limit(self) -> Array:
        """Largest torques [N m]. Shape (n,)."""
        effort = np.asarray(self.model.robot.effort, dtype=float)
        return effort if self.servo.limited else np.full(len(effort), np.inf)

    def torque(self, time: float, q: Array, v: Array) -> Array:
        """Return the servos' torques (n,) [N m]."""
        wanted, rate, _ = self.points(time)
        free = self.servo.kp * (wanted - q[7:]) + self.servo.kd * (rate - v[6:])
        return np.clip(free, -self.limit, self.limit)

    def moment(self, time: float, q: Array, v: Array, grip: Grip) -> Moment:
        """Return forces and accelerations at a state, with these feet held."""
        terms = self.model.terms(q, v)
        motion = motion_under(self.model, terms, self.torque(time, q, v), grip)
        return Moment(time, q, v, terms, motion)

    def step(self, start: Moment, h: float, grip: Grip) -> Moment:
        """Return the moment a step h [s] later, these feet held all along."""
        import pinocchio as pin

        model, half = self.model.model, 0.5 * h
        once, speed = self._euler(start.time, start.q, start.v, start.terms, h, grip)
        middle, rate = self._euler(start.time, start.q, start.v, start.terms, half, grip)
        terms = self.model.terms(middle, rate)
        twice, end = self._euler(start.time + half, middle, rate, terms, half, grip)
        q = pin.integrate(model, twice, pin.difference(model, once, twice))
        return self._on_ground(start.time + h, q, 2.0 * end - speed, grip)

    def _euler(
        self, time: float, q: Array, v: Array, terms: Terms, h: float, grip: Grip
    ) -> tuple[Array, Array]:
        """Return q and v after one linearly implicit Euler step."""
        import pinocchio as pin

        wanted, rate, _ = self.points(time + h)
        error, rate_error = wanted - q[7:] - h * v[6:], rate - v[6:]
        rows, drift = terms.held(grip, self.model.normal)
        push, damping = np.zeros(len(error)), np.asarray(self.model.robot.damping)
        for _ in range(CLIPS):
            free = push == 0.0
            stiff = np.where(free, h * self.servo.kd + h * h * self.servo.kp, 0.0)
            mass = terms.mass + np.diag(np.concatenate([np.zeros(6), stiff + h * damping]))
            right = -h * terms.bias
            drive = self.servo.kp * error + self.servo.kd * rate_error
            right[6:] += h * np.where(free, drive, push)
            change = solve_ranked(mass, right, rows, -h * drift - rows @ v).x
            torque = drive - (self.servo.kd + h * self.servo.kp) * change[6:]
            over = free & (np.abs(torque) > self.limit)
            if not over.any():
                break
            push = np.where(over, np.sign(torque) * self.limit, push)
        after = v + change
        return pin.integrate(self.model.model, q, h * after), after

    def _on_ground(self, time: float, q: Array, v: Array, grip: Grip) -> Moment:
        """Return the moment with the feet's gaps and velocities taken out."""
        import pinocchio as pin

        normal, zero = self.model.normal, np.zeros(len(v))
        mass, rows, gap, _ = self.model.positions(q)
        if grip.feet:
            along = Grip((), grip.feet).rows(rows, normal)
            lift = solve_ranked(mass, zero, along, -gap[list(grip.feet)]).x
            q = pin.integrate(self.model.model, q, lift)
            mass, rows, gap, _ = self.model.positions(q)
            flat = grip.rows(rows, normal)
            v = v + solve_ranked(mass, zero, flat, -flat @ v).x
        return self.moment(time, q, v, grip)
