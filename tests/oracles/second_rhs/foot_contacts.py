"""Force of the ground on a sphere, piece by piece of its laws, and what a contact remembers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.friction import StickSlip
from oracles.second_rhs.friction_share import FrictionShare
from oracles.second_rhs.normal_force import NormalForce
from oracles.second_rhs.surface import Surface
from oracles.second_rhs.vectors import length

if TYPE_CHECKING:
    from hexapod_pin.ground.contact import Contact

NONE = np.zeros(3)

NEVER = 1e300
"""A switching function that does not switch."""

UNKNOWN = -2
"""The patch that a foot has come from where it has crossed no edge."""

EDGE_WIDTH = 1e-5
"""How far behind the edge of a patch a foot that has crossed it counts as back [m] (*assumed*)."""

SWITCHES = 5
"""Switching functions of a contact: touching, pushing, normal piece, friction, patch."""


@dataclass(frozen=True)
class ContactMode:
    """The piece of its laws that a contact is on, and its memory.

    Attributes:
        touching: whether the sphere is in the ground.
        pushes: whether the normal law's clamp does not act.
        deep: whether the normal law is beyond `NormalForce.full_depth`.
        piece: of the friction law between its breaks.
        sliding: whether a bristle slides at the dynamic coefficient.
        patch: number of the patch, -1 for none.
        left: number of the patch that it has come from since it touches, else `UNKNOWN`.
        touch_speed: approach speed at first touch [m/s].
    """

    touching: bool = False
    pushes: bool = True
    deep: bool = False
    piece: int = 0
    sliding: bool = False
    patch: int = -1
    left: int = UNKNOWN
    touch_speed: float = 0.0


class ContactState(NamedTuple):
    """A contact at one state.

    Attributes:
        gap: [m].
        rate: of approach [m/s].
        slip: of the contact point against the ground (3,) [m/s].
        normal: force without its clamp [N].
        push: positive where the clamp does not act.
        force: on the sphere, world axes (3,) [N].
        trial: k z + c u of a bristle (3,) [N].
        stretch_rate: z' (3,) [m/s].
        insides: how far within each patch [m].
    """

    gap: float
    rate: float
    slip: Array
    normal: float
    push: float
    force: Array
    trial: Array
    stretch_rate: Array
    insides: tuple[float, ...]


class FootContacts:
    """The laws of all contacts of a scene."""

    def __init__(self, contact: Contact, surface: Surface) -> None:
        """Read the laws.

        Raises:
            ParameterError: a law that is not written here, or a bristle without damping.
        """
        self.surface, self.normal = surface, NormalForce(contact.normal)
        law = contact.friction
        self.bristle = law if isinstance(law, StickSlip) else None
        self.share = None if isinstance(law, StickSlip) else FrictionShare(law)
        if self.bristle is not None and not self.bristle.damping > 0.0:
            raise ParameterError("StickSlip.damping", self.bristle.damping, "above 0 N s/m")

    def state(
        self, mode: ContactMode, time: float, sphere: tuple[Array, float], velocity: Array,
        stretch: Array,
    ) -> ContactState:  # fmt: skip
        """Return the contact in a mode.

        Args:
            mode: the pieces of the laws.
            time: [s].
            sphere: centre, world axes (3,) [m], and radius [m].
            velocity: of the material point of contact (3,) [m/s].
            stretch: of the bristle (3,) [m].
        """
        surface, n = self.surface, self.surface.normal
        gap = surface.gap(time, *sphere)
        against = velocity - surface.velocity(time)
        rate = -float(n @ against)
        slip = against + rate * n
        insides = surface.insides(sphere[0])
        if not mode.touching:
            return ContactState(gap, rate, slip, 0.0, 1.0, NONE, NONE, NONE, insides)
        grip, hardness = surface.factors(mode.patch)
        normal, push = self.normal(-gap, rate, mode.touch_speed, deep=mode.deep)
        normal *= hardness
        load = normal if mode.pushes else 0.0
        if self.bristle is None:
            force = load * n - self._share_force(mode, grip * load, slip)
            return ContactState(gap, rate, slip, normal, push, force, NONE, NONE, insides)
        through, trial, moved = self._bristle_force(mode, grip * load, slip, stretch)
        force = load * n - through
        return ContactState(gap, rate, slip, normal, push, force, trial, moved, insides)

    def _share_force(self, mode: ContactMode, load: float, slip: Array) -> Array:
        assert self.share is not None
        speed = length(slip)
        if speed == 0.0:
            return NONE
        return (load * self.share(speed, mode.piece) / speed) * slip

    def _bristle_force(
        self, mode: ContactMode, load: float, slip: Array, stretch: Array
    ) -> tuple[Array, Array, Array]:
        """Return force through the bristle, trial force (3,) [N] and z' (3,) [m/s]."""
        law = self.bristle
        assert law is not None
        trial = law.stiffness * stretch + law.damping * slip
        if not mode.sliding:
            return trial, trial, slip
        size = length(trial)
        along = trial / size if size > 0.0 else trial
        through = law.mu_dynamic * load * along
        return through, trial, (through - law.stiffness * stretch) / law.damping

    def switches(self, mode: ContactMode, at: ContactState) -> list[float]:
        """Return the switching functions, positive inside the mode."""
        if not mode.touching:
            return [at.gap, NEVER, NEVER, NEVER, NEVER]
        full = self.normal.full_depth
        depth = NEVER if full is None else (-at.gap - full if mode.deep else full + at.gap)
        push = at.push if mode.pushes else -at.push
        return [-at.gap, push, depth, self._friction_switch(mode, at), self._edge(mode, at)]

    def _edge(self, mode: ContactMode, at: ContactState) -> float:
        """Return how far it is to the nearest edge that ends the patch of a mode [m]."""
        here, count = mode.patch, len(at.insides)
        ways = {k: -at.insides[k] for k in range(count if here < 0 else here)}
        if here >= 0:
            later = (k for k in range(here + 1, count) if at.insides[k] >= 0.0)
            ways[next(later, -1)] = at.insides[here]
        return min((way + EDGE_WIDTH * (k == mode.left) for k, way in ways.items()), default=NEVER)

    def _friction_switch(self, mode: ContactMode, at: ContactState) -> float:
        if not mode.pushes:
            return NEVER
        if self.bristle is not None:
            law = self.bristle
            load = self.surface.factors(mode.patch)[0] * at.normal
            size = length(at.trial)
            return size - law.mu_dynamic * load if mode.sliding else law.mu * load - size
        assert self.share is not None
        ends = (-NEVER, *self.share.breaks, NEVER)
        speed = length(at.slip)
        return min(speed - ends[mode.piece], ends[mode.piece + 1] - speed)

    def next_mode(
        self, mode: ContactMode, at: ContactState, behind: ContactState, switches: list[float]
    ) -> ContactMode:
        """Return the mode behind a switch; what has not switched stays.

        Args:
            mode: the mode before.
            at: the contact at the switch, in the mode before.
            behind: the contact just behind it, in the mode before.
            switches: of `switches` there.
        """
        ends = [value < 0.0 for value in switches]
        if not any(ends):
            return mode
        if not mode.touching:
            found = ContactMode(touching=True, touch_speed=max(0.0, at.rate))
            return replace(found, patch=self._patch(behind), piece=self._piece(behind))
        if ends[0]:
            return ContactMode()
        if ends[1]:
            mode = replace(mode, pushes=not mode.pushes, piece=self._piece(behind))
        if ends[2]:
            mode = replace(mode, deep=not mode.deep)
        if ends[3] and self.bristle is not None:
            mode = replace(mode, sliding=not mode.sliding)
        elif ends[3]:
            mode = replace(mode, piece=self._piece(behind))
        if not ends[4]:
            return mode
        patch = self._patch(behind)
        if patch == mode.left and self._edge(mode, behind) >= 0.0:
            return mode
        return replace(mode, patch=patch, left=mode.patch)

    def _piece(self, at: ContactState) -> int:
        breaks = () if self.share is None else self.share.breaks
        return int(np.searchsorted(np.array(breaks), length(at.slip), side="right"))

    def _patch(self, at: ContactState) -> int:
        return next((k for k, inside in enumerate(at.insides) if inside >= 0.0), -1)
