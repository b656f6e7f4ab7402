"""Feet touch the ground in maximal coordinates (S1 eqs 4-5), and contacts remember their slip."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.maximal.state import (
    NO_CONTACT_GAP_M,
    ContactEvaluation,
    MaximalState,
    RunMemory,
)
from hexapod_pin.ground.contact import (
    AdamsCoulomb,
    AdamsImpact,
    BrownMcPhee,
    HuntCrossley,
    KelvinVoigt,
    Restitution,
    SmoothStep,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.terrain import PatchedGround, Plane, Polyline, ShakingGround
from hexapod_pin.robot.rotations import crosses

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.ground.contact import Contact, FrictionLaw, NormalLaw
    from hexapod_pin.ground.terrain import Ground

    Flags = NDArray[np.bool_]


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
        u = velocity[:, :3] + crosses(velocity[:, 3:], lever) - self._ground.velocity(time)
        approach = -np.einsum("ij,ij->i", normal, u)
        slip = u + approach[:, None] * normal
        idle = np.zeros_like(u)
        found = ContactEvaluation(gap, approach, idle, idle, np.zeros(len(gap), dtype=bool))
        if (gap < 0.0).any():
            factors = self._ground.factors(centers)
            found = self._with_forces(found, factors, normal, slip, state.bristles, memory)
        on_feet = np.concatenate([found.force, crosses(lever, found.force)], axis=1)
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


# The contact laws (S1 eqs 4-5 and the others) in NumPy, for many contacts at once.
#
# Written apart from the native core on purpose: this solver shares the numbers, not the code.

MIN_SLIP_SPEED_M_S = 1e-300
"""Keeps m(s)/s finite at rest [m/s]."""

CONE_LIMIT_SHARE = 1.0 - 1e-9
"""A bristle with this share of its friction limit is on the cone [-]."""


def normal_force(law: NormalLaw, depth: Array, rate: Array, touch_speed: Array) -> Array:
    """Return the normal forces [N], never negative.

    Args:
        law: its parameters.
        depth: penetrations d > 0 [m].
        rate: d' [m/s].
        touch_speed: approach speeds at first touch [m/s]; used by `Restitution` only.

    Raises:
        ParameterError: a law this solver does not know.
    """
    spring = law.stiffness * depth**law.exponent
    if isinstance(law, HuntCrossley):
        force = spring * (1.0 + 1.5 * law.dissipation * rate)
    elif isinstance(law, Restitution):
        force = spring * (1.0 + law.eta * rate / np.maximum(touch_speed, law.speed_floor))
    elif isinstance(law, KelvinVoigt):
        force = spring + law.damping * rate
    elif isinstance(law, AdamsImpact):
        force = spring + law.damping * cubic_step(depth / law.damping_depth) * rate
    else:
        raise ParameterError("contact.normal", type(law).__name__, "a normal law of this package")
    return np.maximum(force, 0.0)


def friction_coefficient(law: FrictionLaw, speed: Array) -> Array:
    """Return m(s) [-] of a law of slip speed s >= 0 [m/s]; S1 eq. 5 for `TanhCoulomb`.

    Raises:
        ParameterError: a law this solver does not know.
    """
    if isinstance(law, TanhCoulomb):
        return np.asarray(law.mu * np.tanh(law.slope * speed))
    if isinstance(law, AdamsCoulomb):
        vs, vd = law.stiction_speed, law.transition_speed
        x = np.minimum(speed / vs, 1.0)
        rise = law.mu_static * 0.5 * x * (3.0 - x * x)  # the STEP from -vs to vs
        fall = (law.mu_dynamic - law.mu_static) * cubic_step((speed - vs) / (vd - vs))
        return np.asarray(rise + fall)
    if isinstance(law, SmoothStep):
        x, drop = speed / law.speed, law.mu_static - law.mu_dynamic
        return np.asarray(law.mu_static * quintic_step(x) - drop * quintic_step((x - 1.0) / 2.0))
    if isinstance(law, BrownMcPhee):
        x, peak = speed / law.speed, law.mu_static - law.mu_dynamic
        return np.asarray(law.mu_dynamic * np.tanh(4.0 * x) + peak * x / (0.25 * x**2 + 0.75) ** 2)
    raise ParameterError("contact.friction", type(law).__name__, "a friction law of this package")


def friction_over_speed(law: FrictionLaw, speed: Array) -> Array:
    """Return m(s)/s [s/m]: friction is this times -N u_t, finite at rest too."""
    s = np.maximum(speed, MIN_SLIP_SPEED_M_S)
    return friction_coefficient(law, s) / s


def bristle_friction(
    law: StickSlip, limit: Array, stretch: Array, slip: Array, normal: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return F = k z + c u_t of a stick-slip spring, cut at the friction limit.

    Args:
        law: its parameters.
        limit: mu N [N]. Shape (C, 1).
        stretch: z [m]. Shape (C, 3).
        slip: u_t [m/s]. Shape (C, 3).
        normal: of the ground. Shape (C, 3).

    Returns:
        Friction against the slip (C, 3) [N], z' = (F - k z)/c (C, 3) [m/s], at the limit (C,).
    """
    trial = law.stiffness * stretch + law.damping * slip
    size = np.sqrt(np.einsum("ij,ij->i", trial, trial))[:, None]
    cut = np.where(size > limit, limit / np.maximum(size, np.finfo(float).tiny), 1.0)
    flat = stretch - np.einsum("ij,ij->i", normal, stretch)[:, None] * normal
    rate = (cut * trial - law.stiffness * flat) / law.damping
    return cut * trial, rate, (size >= limit * CONE_LIMIT_SHARE)[:, 0]


def cubic_step(x: Array) -> Array:
    """ADAMS' STEP from 0 at x = 0 to 1 at x = 1."""
    y = np.clip(x, 0.0, 1.0)
    return np.asarray(y * y * (3.0 - 2.0 * y))


def quintic_step(x: Array) -> Array:
    """Drake's step5 from 0 at x = 0 to 1 at x = 1."""
    y = np.clip(x, 0.0, 1.0)
    return np.asarray(y**3 * (10.0 - y * (15.0 - 6.0 * y)))


# Gaps and normals between spheres and the ground.


class GroundQuery:
    """The ground under a fixed number of spheres.

    Planes are done here; stairs, ledges, grooves and height fields use the terrain's own search.

    Attributes:
        contacts_per_sphere: that a sphere can have at once.
    """

    def __init__(self, terrain: Ground) -> None:
        """Separate shaking and patches from the shape below."""
        shape: Any = terrain
        self._shaking = shape if isinstance(shape, ShakingGround) else None
        shape = shape.ground if isinstance(shape, ShakingGround) else shape
        self._patches = shape if isinstance(shape, PatchedGround) else None
        shape = shape.ground if isinstance(shape, PatchedGround) else shape
        surface = shape.surface()
        self._plane = surface if isinstance(surface, Plane) else None
        self._search = None if self._plane is not None else shape.native()
        self.contacts_per_sphere = 2 if isinstance(surface, Polyline) else 1

    def under(self, time: float, centers: Array, radii: Array) -> tuple[Array, Array]:
        """Return gaps (C,) [m] and unit normals (C, 3) of spheres (F, 3), (F,); C = F or 2 F."""
        if self._shaking is not None:
            centers = centers - (0.0, 0.0, float(self._shaking.lift_at(time)))
        if self._plane is not None:
            normal = np.array(self._plane.normal)
            gaps = (centers - self._plane.point) @ normal - radii
            return gaps, np.broadcast_to(normal, centers.shape)
        return self._searched(centers, radii)

    def velocity(self, time: float) -> Array:
        """Return the velocity of the ground (3,) [m/s], world axes."""
        if self._shaking is None:
            return np.zeros(3)
        rate = 2.0 * np.pi * self._shaking.frequency
        return np.array([0.0, 0.0, self._shaking.amplitude * rate * np.cos(rate * time)])

    def factors(self, centers: Array) -> Array:
        """Return factors on friction and stiffness (C, 2) [-] at places (C, 3)."""
        if self._patches is None:
            return np.ones((len(centers), 2))
        return self._patches.factors_at(centers[:, 0], centers[:, 1])

    def _searched(self, centers: Array, radii: Array) -> tuple[Array, Array]:
        gaps = np.full((len(centers), self.contacts_per_sphere), NO_CONTACT_GAP_M)
        normals = np.zeros((len(centers), self.contacts_per_sphere, 3))
        normals[:, :, 2] = 1.0
        search: Any = self._search
        for f, (center, radius) in enumerate(zip(centers, radii, strict=True)):
            for k, (gap, normal) in enumerate(search.contacts(center, float(radius))):
                gaps[f, k], normals[f, k] = gap, normal
        return gaps.ravel(), normals.reshape(-1, 3)
