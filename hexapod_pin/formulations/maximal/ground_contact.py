"""Forces between feet and ground on bodies in maximal coordinates (S1 eqs 4-5)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.maximal.contact_laws import (
    bristle_friction,
    friction_over_speed,
    normal_force,
)
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
            factors = self._ground.factors(centers)
            found = self._with_forces(found, factors, normal, slip, state.bristles, memory)
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

    def _with_forces(
        self,
        at: ContactEvaluation,
        factors: Array,
        normal: Array,
        slip: Array,
        bristles: Array | None,
        memory: RunMemory,
    ) -> ContactEvaluation:
        """Return the contacts with normal forces (S1 eq. 4) and friction (S1 eq. 5 or bristles).

        Args:
            at: gaps and approach speeds.
            factors: on friction and stiffness [-]. Shape (C, 2).
            normal: of the ground. Shape (C, 3).
            slip: velocity along the ground [m/s]. Shape (C, 3).
            bristles: stretch [m]; None: zero. Shape (C, 3).
            memory: of the contacts.
        """
        depth, touch_speed = np.maximum(-at.gap, 0.0), memory.impact_speed(at.approach)
        force = normal_force(self.contact.normal, depth, at.approach, touch_speed)
        load = np.where(depth > 0.0, force * factors[:, 1], 0.0)[:, None]
        law, factor = self._bristle, factors[:, :1]
        if law is None:
            speed = np.sqrt(np.einsum("ij,ij->i", slip, slip))[:, None]
            over_speed = factor * friction_over_speed(self.contact.friction, speed)
            return replace(at, force=load * (normal - over_speed * slip))
        limit = factor * np.where(memory.sliding, law.mu_dynamic, law.mu)[:, None] * load
        stretch = np.zeros_like(slip) if bristles is None else bristles
        friction, rate, on_cone = bristle_friction(law, limit, stretch, slip, normal)
        closed = load > 0.0  # open contacts relax, and are reset at the next accepted state
        return replace(
            at,
            force=np.where(closed, load * normal - friction, 0.0),
            bristle_rate=rate,
            on_cone=closed[:, 0] & on_cone,
        )
