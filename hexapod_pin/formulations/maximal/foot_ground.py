"""Forces between feet and ground on bodies in maximal coordinates (S1 eqs 4-5)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.maximal.contact_laws import friction_over_speed, normal_force
from hexapod_pin.formulations.maximal.ground_points import GroundPoints
from hexapod_pin.formulations.maximal.rotation import cross
from hexapod_pin.formulations.maximal.touch import Touch
from hexapod_pin.ground.contact import Restitution, StickSlip

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.memory import Memory
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.ground.terrain import Ground

ON_CONE = 1.0 - 1e-9


class FootGround:
    """The feet of some bodies on a ground.

    Attributes:
        contacts: C, one or two for each foot.
        remembers: whether a law looks at what was before.
        bristles: 3 C numbers of state with `StickSlip`, else 0.
    """

    def __init__(self, bodies: Bodies, contact: Contact, terrain: Ground) -> None:
        """Check that this solver can do the pair of laws on this ground.

        Raises:
            ParameterError: a bristle without damper (its rate (F - k z)/c needs c > 0), or a law
                with memory on ground that can touch a sphere twice.
        """
        self.contact, self._ground = contact, GroundPoints(terrain)
        self._bristle = contact.friction if isinstance(contact.friction, StickSlip) else None
        self.remembers = self._bristle is not None or isinstance(contact.normal, Restitution)
        if self.remembers and self._ground.each > 1:
            raise ParameterError(
                "contact", type(terrain).__name__, "laws without memory on stairs, ledges, grooves"
            )
        if self._bristle is not None and not self._bristle.damping > 0.0:
            raise ParameterError("StickSlip.damping", self._bristle.damping, "above 0 N s/m")
        feet = [foot for foot in bodies.feet for _ in range(self._ground.each)]
        self.contacts = len(feet)
        self.bristles = 3 * self.contacts if self._bristle is not None else 0
        self._body = np.array([foot.body for foot in feet], dtype=np.intp)
        self._offset = np.array([foot.offset for foot in feet]).reshape(-1, 3)
        self._radius = np.array([foot.radius for foot in feet])
        self._sum = np.eye(len(bodies.mass))[:, self._body]  # adds contacts up on their bodies

    def __call__(
        self, time: float, position: Array, turn: Array, velocity: Array, stretch: Array,
        memory: Memory,
    ) -> tuple[Array, Touch]:  # fmt: skip
        """Return the wrenches on all bodies about their centres of mass (nb, 6) [N], [N m].

        Args:
            time: [s].
            position: (nb, 3) of the bodies [m].
            turn: (nb, 3, 3) body to world.
            velocity: (nb, 6) [m/s], [rad/s], world axes.
            stretch: (C, 3) of the bristles [m].
            memory: of the contacts.
        """
        lever = self._levers(turn)
        centers = position[self._body] + lever
        gap, normal = self._under(time, centers)
        lever = lever - self._radius[:, None] * normal
        six = velocity[self._body]
        u = six[:, :3] + cross(six[:, 3:], lever) - self._ground.velocity(time)
        approach = -np.einsum("ij,ij->i", normal, u)
        slip = u + approach[:, None] * normal
        idle = np.zeros_like(u)
        touch = Touch(gap, approach, idle, idle, np.zeros(len(gap), dtype=bool))
        if (gap < 0.0).any():
            push = self._push(touch, self._ground.factors(centers), memory)
            touch = self._rubbed(touch, push, normal, slip, stretch, memory)
        on_feet = np.concatenate([touch.force, cross(lever, touch.force)], axis=1)
        return self._sum @ on_feet, touch

    def gaps(self, time: float, position: Array, turn: Array) -> Array:
        """Return the gaps (C,) [m]; arguments as for a call."""
        return self._under(time, position[self._body] + self._levers(turn))[0]

    def _levers(self, turn: Array) -> Array:
        """Return the spheres' centres from their bodies' centres of mass (C, 3), world axes."""
        return np.asarray(np.matmul(turn[self._body], self._offset[:, :, None])[:, :, 0])

    def _under(self, time: float, centers: Array) -> tuple[Array, Array]:
        """Return gaps (C,) and normals (C, 3)."""
        once = slice(None, None, self._ground.each)
        return self._ground.under(time, centers[once], self._radius[once])

    def _push(self, touch: Touch, factors: Array, memory: Memory) -> Array:
        """Return normal forces and factors on friction (C, 2), zero where the contact is open."""
        unseen = ~memory.touching & (memory.touch_speed <= 0.0)
        speed = np.where(unseen, np.maximum(touch.approach, 0.0), memory.touch_speed)
        depth = np.maximum(-touch.gap, 0.0)
        force = normal_force(self.contact.normal, depth, touch.approach, speed)
        return np.column_stack([np.where(depth > 0.0, force * factors[:, 1], 0.0), factors[:, 0]])

    def _rubbed(
        self, touch: Touch, push: Array, normal: Array, slip: Array, stretch: Array, memory: Memory
    ) -> Touch:
        """Return the contacts with forces and bristle rates filled in."""
        force, factor = push[:, :1], push[:, 1:]
        if self._bristle is None:
            speed = np.sqrt(np.einsum("ij,ij->i", slip, slip))[:, None]
            over = factor * friction_over_speed(self.contact.friction, speed)
            return replace(touch, force=force * (normal - over * slip))
        law = self._bristle
        mu = np.where(memory.sliding, law.mu_dynamic, law.mu)[:, None]
        trial, cap = law.stiffness * stretch + law.damping * slip, factor * mu * force
        size = np.sqrt(np.einsum("ij,ij->i", trial, trial))[:, None]
        through = np.where(size > cap, cap / np.maximum(size, np.finfo(float).tiny), 1.0) * trial
        flat = stretch - np.einsum("ij,ij->i", normal, stretch)[:, None] * normal
        rate = (through - law.stiffness * flat) / law.damping  # z' = (F - k z)/c
        closed = force > 0.0
        return replace(
            touch,
            force=np.where(closed, force * normal - through, 0.0),
            stretch_rate=rate,  # in the air it runs out, and the next accepted state lets it go
            on_cone=(closed & (size >= cap * ON_CONE))[:, 0],
        )
