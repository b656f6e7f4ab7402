"""A model in motion: its state as one vector, with what is remembered from step to step."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.memory import Memory
from hexapod_pin.formulations.maximal.motion import BodyState
from hexapod_pin.formulations.maximal.projection import project
from hexapod_pin.formulations.maximal.rotation import normalised, quaternion_rate
from hexapod_pin.formulations.maximal.touch import begun, released, settled

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.constraints import Constraints
    from hexapod_pin.formulations.maximal.evaluation import Evaluation
    from hexapod_pin.formulations.maximal.model import MaximalModel

SetPoints = Callable[[float], "tuple[Array, Array]"]
"""Wanted joint angles [rad] and rates [rad/s], (nj,) each, at a time [s]."""


class Flow:
    """y' = f(t, y), y = [positions, quaternions, velocities, bristles].

    Attributes:
        memory: of joints and contacts at the last accepted state.
        evaluations: of the model so far.
        drift: largest |Phi| [m, rad] and |Phi'| [m/s, rad/s] at accepted states.
    """

    def __init__(
        self, model: MaximalModel, set_points: SetPoints, memory: Memory, *, projected: bool
    ) -> None:
        """Follow a model from a memory; `projected`: close the joints after every step."""
        self.model, self.memory = model, memory
        self.evaluations, self.drift = 0, (0.0, 0.0)
        self._set_points, self._projected = set_points, projected
        self._bodies = 13 * len(model.bodies.mass)

    def joined(self, state: BodyState, stretch: Array | None = None) -> Array:
        """Return y of a state, its bristles (C, 3) [m] at rest if not given."""
        feet = self.model.feet
        if feet is None or not feet.bristles:
            return state.flat()
        rest = np.zeros(feet.bristles) if stretch is None else stretch.ravel()
        return np.concatenate([state.flat(), rest])

    def split(self, y: Array) -> tuple[BodyState, Array | None]:
        """Return the bodies' state and the bristles (C, 3), None without."""
        bristles = y[self._bodies :]
        state = BodyState.from_flat(y[: self._bodies])
        return state, bristles.reshape(-1, 3) if len(bristles) else None

    def evaluate(self, time: float, y: Array) -> Evaluation:
        """Return the solution at a time."""
        self.evaluations += 1
        wanted, wanted_rate = self._set_points(time)
        state, stretch = self.split(y)
        servo = self.model.drives.servo
        return self.model.evaluate(
            time, state, lambda q, v: servo(q, v, wanted, wanted_rate), self.memory, stretch
        )

    def rate(self, y: Array, found: Evaluation) -> Array:
        """Return y' at an evaluated state."""
        state, stretch = self.split(y)
        turning = quaternion_rate(state.quaternion, state.velocity[:, 3:])
        parts = [state.velocity[:, :3].ravel(), turning.ravel(), found.acceleration.ravel()]
        if stretch is not None and found.touch is not None:
            parts.append(found.touch.stretch_rate.ravel())
        return np.concatenate(parts)

    def __call__(self, time: float, y: Array) -> Array:
        """Return y'."""
        return self.rate(y, self.evaluate(time, y))

    def accept(self, time: float, y: Array, closing: int | None = None) -> tuple[Array, Array]:
        """Take y as the state reached: close joints, update the memory.

        Args:
            time: [s].
            y: the end of a step.
            closing: contact that closes at just this moment.

        Returns:
            y as it goes on, and y' there.
        """
        state, stretch = self.split(y)
        if self._projected:
            state = project(self.model, state)
        else:
            state = BodyState(state.position, normalised(state.quaternion), state.velocity)
        y = self.joined(state, stretch)
        found = self.evaluate(time, y)
        self.drift = _larger(self.drift, found.constraints)
        self.memory = self.memory.with_angles(self.memory.unwrapped(found.placement.angle))
        feet, touch = self.model.feet, found.touch
        if feet is None or touch is None:
            return y, self.rate(y, found)
        self.memory = settled(touch, self.memory)
        if closing is not None:
            self.memory = begun(closing, touch, self.memory)
        if not feet.remembers:
            return y, self.rate(y, found)
        if stretch is not None:
            y = self.joined(state, released(touch, stretch))
        return y, self(time, y)

    def newly_closed(self, time: float, y: Array) -> Array:
        """Return the gaps (C,) [m] of contacts not yet touching; infinite for the others."""
        gaps = self.model.gaps(time, self.split(y)[0])
        return np.where(self.memory.touching, np.inf, gaps)


def _larger(old: tuple[float, float], joints: Constraints) -> tuple[float, float]:
    size, rate = np.abs(joints.violation), np.abs(joints.rate)
    return max(old[0], float(size.max(initial=0.0))), max(old[1], float(rate.max(initial=0.0)))
