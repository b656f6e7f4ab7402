"""Forces between feet and ground on bodies in maximal coordinates (S1 eqs 4-5)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.maximal.contact_laws import friction_over_speed, normal_force
from hexapod_pin.formulations.maximal.contact_memory import ContactEvaluation
from hexapod_pin.formulations.maximal.ground_query import GroundQuery
from hexapod_pin.formulations.maximal.rotation import cross
from hexapod_pin.ground.contact import Restitution, StickSlip

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.contact_memory import RunMemory
    from hexapod_pin.formulations.maximal.state import MaximalState
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.ground.terrain import Ground

CONE_LIMIT_SHARE = 1.0 - 1e-9
"""A bristle with this share of its friction limit is on the cone [-]."""


class GroundContact:
    """The feet of some bodies on a ground.

    Attributes:
        contact: the pair of laws.
        count: C, the number of contacts, one or two for each foot.
        has_memory: whether a law depends on the past.
        has_bristles: whether friction is `StickSlip`, with bristles (C, 3) in the state.
    """

    def __init__(self, bodies: Bodies, contact: Contact, terrain: Ground) -> None:
        """Check that this solver can do the pair of laws on this ground.

        Raises:
            ParameterError: a bristle without damper (its rate (F - k z)/c needs c > 0), or a law
                with memory on ground that can touch a sphere twice.
        """
        self.contact, self._ground = contact, GroundQuery(terrain)
        self._bristle = contact.friction if isinstance(contact.friction, StickSlip) else None
        self.has_bristles = self._bristle is not None
        self.has_memory = self.has_bristles or isinstance(contact.normal, Restitution)
        if self.has_memory and self._ground.contacts_per_sphere > 1:
            raise ParameterError(
                "contact", type(terrain).__name__, "laws without memory on stairs, ledges, grooves"
            )
        if self._bristle is not None and not self._bristle.damping > 0.0:
            raise ParameterError("StickSlip.damping", self._bristle.damping, "above 0 N s/m")
        feet = [foot for foot in bodies.feet for _ in range(self._ground.contacts_per_sphere)]
        self.count = len(feet)
        self._body = np.array([foot.body for foot in feet], dtype=np.intp)
        self._offset = np.array([foot.offset for foot in feet]).reshape(-1, 3)
        self._radius = np.array([foot.radius for foot in feet])
        self._contacts_on_body = np.eye(len(bodies.mass))[:, self._body]

    def forces(
        self, time: float, state: MaximalState, rotation: Array, memory: RunMemory
    ) -> tuple[Array, ContactEvaluation]:
        """Return the wrenches on all bodies about their centres of mass (nb, 6) [N], [N m].

        Args:
            time: [s].
            state: of bodies and bristles.
            rotation: body to world. Shape (nb, 3, 3).
            memory: of the contacts.
        """
        lever = self._levers(rotation)
        centers = state.position[self._body] + lever
        gap, normal = self._under(time, centers)
        lever = lever - self._radius[:, None] * normal
        velocity = state.velocity[self._body]
        u = velocity[:, :3] + cross(velocity[:, 3:], lever) - self._ground.velocity(time)
        approach = -np.einsum("ij,ij->i", normal, u)
        slip = u + approach[:, None] * normal
        idle = np.zeros_like(u)
        found = ContactEvaluation(gap, approach, idle, idle, np.zeros(len(gap), dtype=bool))
        if (gap < 0.0).any():
            factors = self._ground.factors(centers)  # on friction and stiffness
            push = self._normal_forces(found, factors[:, 1], memory)[:, None]
            stretch = idle if state.bristles is None else state.bristles
            friction = factors[:, :1]
            if self._bristle is None:
                found = self._smooth_friction(found, push, friction, normal, slip)
            else:
                law = self._bristle
                found = _bristle_friction(law, found, push, friction, normal, slip, stretch, memory)
        on_feet = np.concatenate([found.force, cross(lever, found.force)], axis=1)
        return self._contacts_on_body @ on_feet, found

    def gaps(self, time: float, position: Array, rotation: Array) -> Array:
        """Return the gaps (C,) [m] of bodies at positions (nb, 3), body to world (nb, 3, 3)."""
        return self._under(time, position[self._body] + self._levers(rotation))[0]

    def _levers(self, rotation: Array) -> Array:
        """Return the spheres' centres from their bodies' centres of mass (C, 3), world axes."""
        return np.asarray(np.matmul(rotation[self._body], self._offset[:, :, None])[:, :, 0])

    def _under(self, time: float, centers: Array) -> tuple[Array, Array]:
        """Return gaps (C,) and normals (C, 3)."""
        once = slice(None, None, self._ground.contacts_per_sphere)
        return self._ground.under(time, centers[once], self._radius[once])

    def _normal_forces(self, at: ContactEvaluation, factor: Array, memory: RunMemory) -> Array:
        """Return normal forces (C,) [N], zero where the contact is open (S1 eq. 4)."""
        depth, speed = np.maximum(-at.gap, 0.0), memory.impact_speed(at.approach)
        force = normal_force(self.contact.normal, depth, at.approach, speed)
        return np.where(depth > 0.0, force * factor, 0.0)

    def _smooth_friction(
        self, at: ContactEvaluation, push: Array, factor: Array, normal: Array, slip: Array
    ) -> ContactEvaluation:
        """Return the contacts with forces of a friction law of the slip speed (S1 eq. 5)."""
        speed = np.sqrt(np.einsum("ij,ij->i", slip, slip))[:, None]
        over_speed = factor * friction_over_speed(self.contact.friction, speed)
        return replace(at, force=push * (normal - over_speed * slip))


def _bristle_friction(
    law: StickSlip,
    at: ContactEvaluation,
    push: Array,
    factor: Array,
    normal: Array,
    slip: Array,
    stretch: Array,
    memory: RunMemory,
) -> ContactEvaluation:
    """Return the contacts with forces and rates of bristles: z' = (F - k z)/c, F in the cone."""
    mu = np.where(memory.sliding, law.mu_dynamic, law.mu)[:, None]
    trial, cap = law.stiffness * stretch + law.damping * slip, factor * mu * push
    size = np.sqrt(np.einsum("ij,ij->i", trial, trial))[:, None]
    friction = np.where(size > cap, cap / np.maximum(size, np.finfo(float).tiny), 1.0) * trial
    flat = stretch - np.einsum("ij,ij->i", normal, stretch)[:, None] * normal
    closed = push > 0.0
    return replace(
        at,
        force=np.where(closed, push * normal - friction, 0.0),
        # open contacts relax too, and are reset at the next accepted state
        bristle_rate=(friction - law.stiffness * flat) / law.damping,
        on_cone=(closed & (size >= cap * CONE_LIMIT_SHARE))[:, 0],
    )
