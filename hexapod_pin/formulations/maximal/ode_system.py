"""S1 eq. 1 as y' = f(t, y), with what is remembered from one accepted state to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.contact_memory import RunMemory
from hexapod_pin.formulations.maximal.derivative import derivative
from hexapod_pin.formulations.maximal.projection import project
from hexapod_pin.formulations.maximal.rotation import quaternion_rate

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.constraints import ConstraintEquations
    from hexapod_pin.formulations.maximal.derivative import MaximalDerivative
    from hexapod_pin.formulations.maximal.model import MaximalModel
    from hexapod_pin.formulations.maximal.state import MaximalState

JointReference = Callable[[float], "tuple[Array, Array]"]
"""Wanted joint angles [rad] and rates [rad/s], (nj,) each, at a time [s]."""


class OdeSystem:
    """y' = f(t, y), y = [positions, quaternions, velocities, bristles].

    Attributes:
        model: the model.
        state: the last accepted one.
        memory: of joints and contacts at that state.
        evaluations: of the model so far.
        drift: largest |Phi| [m, rad] and |Phi'| [m/s, rad/s] at accepted states.
    """

    def __init__(
        self, model: MaximalModel, set_points: JointReference, start: MaximalState, *,
        projected: bool,
    ) -> None:  # fmt: skip
        """Begin at a state; `projected`: close the joints after every step."""
        self.model = model
        none = np.zeros(len(model.bodies.joint_names))
        self.memory = start.memory or RunMemory.fresh(none, model.contact_count)
        self.state = replace(start, memory=self.memory)
        if model.has_bristles and start.bristles is None:
            self.state = replace(self.state, bristles=np.zeros((model.contact_count, 3)))
        self.evaluations, self.drift = 0, (0.0, 0.0)
        self._set_points, self._projected = set_points, projected

    def __call__(self, time: float, y: Array) -> Array:
        """Return y'."""
        return self._rate(time, self.state.with_flat(y))[0]

    def _rate(self, time: float, state: MaximalState) -> tuple[Array, MaximalDerivative]:
        """Return y' at a state, and the solution it is made of."""
        self.evaluations += 1
        wanted, wanted_rate = self._set_points(time)
        servo = self.model.actuators.servo_torque
        found = derivative(self.model, state, lambda q, v: servo(q, v, wanted, wanted_rate), time)
        turning = quaternion_rate(state.quaternion, state.velocity[:, 3:])
        parts = [state.velocity[:, :3].ravel(), turning.ravel(), found.acceleration.ravel()]
        if state.bristles is not None and found.contacts is not None:
            parts.append(found.contacts.bristle_rate.ravel())
        return np.concatenate(parts), found

    def accept(self, time: float, y: Array, closing: int | None = None) -> tuple[Array, Array]:
        """Take y as the state reached: close joints, update the memory.

        Args:
            time: [s].
            y: the end of a step.
            closing: contact that closes at just this moment.

        Returns:
            y as it goes on, and y' there.
        """
        state = self.state.with_flat(y)
        state = project(self.model, state) if self._projected else state.with_unit_quaternions()
        rate, found = self._rate(time, state)
        self.drift = _larger(self.drift, found.constraints)
        memory = replace(self.memory, angles=self.memory.unwrapped(found.kinematics.angle))
        if found.contacts is not None:
            memory = memory.after_step(found.contacts)
            if closing is not None:
                memory = memory.after_touch_down(closing, found.contacts)
            if state.bristles is not None:
                state = replace(state, bristles=found.contacts.released(state.bristles))
        self.memory, self.state = memory, replace(state, memory=memory)
        if self.model.contact is not None and self.model.contact.has_memory:
            rate, _ = self._rate(time, self.state)
        return self.state.flat(), rate

    def opening_gaps(self, time: float, y: Array) -> Array:
        """Return the gaps (C,) [m] of contacts not yet touching; infinite for the others."""
        gaps = self.model.gaps(time, self.state.with_flat(y))
        return np.where(self.memory.touching, np.inf, gaps)


def _larger(old: tuple[float, float], d: ConstraintEquations) -> tuple[float, float]:
    size, rate = np.abs(d.violation), np.abs(d.rate)
    return max(old[0], float(size.max(initial=0.0))), max(old[1], float(rate.max(initial=0.0)))
