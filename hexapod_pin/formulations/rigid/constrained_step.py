"""One step of a robot on servos while its grounded feet stay in place (S2 eqs. 1-4).

Linearly implicit Euler in the servos (stiff: kd/I is 1e4 1/s on a light leg), eqs. 1-4 for the
feet, extrapolated once from h and h/2 to order 2; then gaps and velocities of the grounded feet
are projected out along M^-1 J^T, so that nothing drifts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid.derivative import (
    ContactSet,
    RigidDerivative,
    constrained_derivative,
    solve_kkt,
)
from hexapod_pin.formulations.rigid.model import EquationTerms, RigidModel
from hexapod_pin.formulations.servo import servo_torque
from hexapod_pin.formulations.set_points import SetPoints

if TYPE_CHECKING:
    from hexapod_pin.drive.servo import Servo

MAX_SATURATION_PASSES = 4
"""Times a step is solved because another servo reached its torque limit."""


@dataclass(frozen=True)
class Snapshot:
    """A state with the solution of eqs. 1-4 there.

    Attributes:
        time: [s].
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        terms: of the equations of motion.
        solution: accelerations, forces, torques.
    """

    time: float
    q: Array
    v: Array
    terms: EquationTerms
    solution: RigidDerivative


@dataclass(frozen=True)
class ConstrainedStepper:
    """A rigid robot whose joints follow set-points through their servos.

    Attributes:
        model: robot and ground.
        servo: gains and whether torques are limited.
        set_points: wanted angles and rates of time.
    """

    model: RigidModel
    servo: Servo
    set_points: SetPoints

    @cached_property
    def gains(self) -> tuple[Array, Array]:
        """Stiffness [N m/rad] and damping [N m s/rad] of the servos. Shapes (n,)."""
        return self.servo.gains(self.model.robot)

    @property
    def torque_limit(self) -> Array:
        """Largest torques [N m]. Shape (n,)."""
        effort = np.asarray(self.model.robot.effort_limit, dtype=float)
        return effort if self.servo.limited else np.full(len(effort), np.inf)

    def torque(self, time: float, q: Array, v: Array) -> Array:
        """Return the servos' torques (n,) [N m]."""
        wanted, rate, _ = self.set_points(time)
        kp, kd = self.gains
        return servo_torque(wanted - q[7:], rate - v[6:], kp=kp, kd=kd, limit=self.torque_limit)

    def snapshot(self, time: float, q: Array, v: Array, contacts: ContactSet) -> Snapshot:
        """Return forces and accelerations at a state, with these feet in contact."""
        terms = self.model.terms(q, v)
        torque = self.torque(time, q, v)
        solution = constrained_derivative(self.model, terms, torque, contacts)
        return Snapshot(time, q, v, terms, solution)

    def step(self, start: Snapshot, h: float, contacts: ContactSet) -> Snapshot:
        """Return the snapshot a step h [s] later, these feet in contact all along."""
        import pinocchio as pin

        model, half = self.model.model, 0.5 * h
        q_one, v_one = self._euler(start.time, start.q, start.v, start.terms, h, contacts)
        q_mid, v_mid = self._euler(start.time, start.q, start.v, start.terms, half, contacts)
        terms = self.model.terms(q_mid, v_mid)
        q_two, v_two = self._euler(start.time + half, q_mid, v_mid, terms, half, contacts)
        q = pin.integrate(model, q_two, pin.difference(model, q_one, q_two))
        q, v = self._projected(q, 2.0 * v_two - v_one, contacts)
        return self.snapshot(start.time + h, q, v, contacts)

    def _euler(
        self, time: float, q: Array, v: Array, terms: EquationTerms, h: float, contacts: ContactSet
    ) -> tuple[Array, Array]:
        """Return q and v after one linearly implicit Euler step.

        Servos that reach their limit in the step are held at it and the step is solved again.
        """
        import pinocchio as pin

        wanted, rate, _ = self.set_points(time + h)
        (kp, kd), limit = self.gains, self.torque_limit
        explicit = kp * (wanted - q[7:] - h * v[6:]) + kd * (rate - v[6:])
        rows, drift = contacts.equations(terms, self.model.normal)
        saturated = np.zeros(len(explicit))  # the limit with its sign, 0 below it
        for _ in range(MAX_SATURATION_PASSES):
            linear = saturated == 0.0
            implicit = np.where(linear, h * kd + h * h * kp, 0.0) + h * self.model.robot.damping
            mass = terms.mass + np.diag(np.concatenate([np.zeros(6), implicit]))
            right = -h * terms.bias
            right[6:] += h * np.where(linear, explicit, saturated)
            change = solve_kkt(mass, right, rows, -h * drift - rows @ v).x
            torque = explicit - (kd + h * kp) * change[6:]
            over = linear & (np.abs(torque) > limit)
            if not over.any():
                break
            saturated = np.where(over, np.sign(torque) * limit, saturated)
        after = v + change
        return pin.integrate(self.model.model, q, h * after), after

    def _projected(self, q: Array, v: Array, contacts: ContactSet) -> tuple[Array, Array]:
        """Return q and v with gaps and velocities of the feet in contact taken out."""
        import pinocchio as pin

        if not contacts.feet:
            return q, v
        normal, zero = self.model.normal, np.zeros(len(v))
        mass, all_rows, gap, _ = self.model.positions(q)
        along = ContactSet((), contacts.feet).rows(all_rows, normal)
        shift = solve_kkt(mass, zero, along, -gap[list(contacts.feet)]).x
        q = pin.integrate(self.model.model, q, shift)
        mass, all_rows, _, _ = self.model.positions(q)
        rows = contacts.rows(all_rows, normal)
        return q, v + solve_kkt(mass, zero, rows, -rows @ v).x
