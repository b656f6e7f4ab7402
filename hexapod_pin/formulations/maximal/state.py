"""State of the maximal formulation (S1), its contacts at one state, and what a run remembers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.robot.rotations import unit_quaternions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array

    Flags = NDArray[np.bool_]

NO_CONTACT_GAP_M = 1e9
"""Gap of a contact that is nowhere near the ground [m]."""


# Contacts at one state, and what a run remembers of them between accepted states.
#
# The contact laws themselves are pure: what they need of the past is stored here.


@dataclass(frozen=True, eq=False)
class ContactEvaluation:
    """All C contacts at one state, those of each foot after another; world axes.

    Attributes:
        gap: [m], negative inside the ground. Shape (C,).
        approach: -n . u [m/s]. Shape (C,).
        force: on the feet [N]. Shape (C, 3).
        bristle_rate: of the stretch [m/s]; zeros for laws without bristles. Shape (C, 3).
        on_cone: whether a bristle is at its friction limit. Shape (C,).
    """

    gap: Array
    approach: Array
    force: Array
    bristle_rate: Array
    on_cone: Flags

    def released(self, bristles: Array) -> Array:
        """Return the stretches (C, 3) [m] with those of open contacts reset."""
        return np.asarray(np.where((self.gap < 0.0)[:, None], bristles, 0.0))


@dataclass(frozen=True, eq=False)
class RunMemory:
    """Memory of nj joints and C contacts at the last accepted state.

    Attributes:
        angles: joint angles, turns counted [rad]. Shape (nj,).
        touching: whether the contact was closed. Shape (C,).
        touch_speed: approach speed before first touch [m/s]. Shape (C,).
        sliding: whether a bristle was on its cone. Shape (C,).
    """

    angles: Array
    touching: Flags
    touch_speed: Array
    sliding: Flags

    @classmethod
    def fresh(cls, angles: Array, contacts: int) -> RunMemory:
        """Return the memory of contacts that were never closed."""
        none = np.zeros(contacts, dtype=bool)
        return cls(angles, none, np.zeros(contacts), none)

    def unwrapped(self, angles: Array) -> Array:
        """Return angles known to a turn (nj,) as those nearest to the remembered ones."""
        turns = np.round((self.angles - angles) / (2.0 * np.pi))
        return np.asarray(angles + 2.0 * np.pi * turns)

    @property
    def unseen(self) -> Flags:
        """Contacts (C,) of which no open state is known: their touch speed is that of now."""
        return np.asarray(~self.touching & (self.touch_speed <= 0.0))

    def impact_speed(self, approach: Array) -> Array:
        """Return the approach speeds (C,) [m/s] at first touch."""
        return np.where(self.unseen, np.maximum(approach, 0.0), self.touch_speed)

    def after_step(self, now: ContactEvaluation) -> RunMemory:
        """Return the memory after an accepted state: contacts that began or ended change it."""
        closed = now.gap < 0.0
        open_above_ground = ~closed & (now.gap < NO_CONTACT_GAP_M)
        renew = open_above_ground | (closed & self.unseen)
        speed = np.where(renew, np.maximum(now.approach, 0.0), self.touch_speed)
        return replace(self, touching=closed, touch_speed=speed, sliding=now.on_cone & closed)

    def after_touch_down(self, which: int, now: ContactEvaluation) -> RunMemory:
        """Return the memory at the moment when one contact closes."""
        touching, speed = self.touching.copy(), self.touch_speed.copy()
        touching[which], speed[which] = True, max(0.0, float(now.approach[which]))
        return replace(self, touching=touching, touch_speed=speed)


# State of the maximal formulation (S1): position, quaternion and velocity of every body.


@dataclass(frozen=True, eq=False)
class MaximalState:
    """State of nb bodies and their C contacts.

    Attributes:
        position: centres of mass, world [m]. Shape (nb, 3).
        quaternion: x, y, z, w, body to world. Shape (nb, 4).
        velocity: of the centre of mass [m/s], then angular [rad/s], world axes. Shape (nb, 6).
        bristles: stretch of the stick-slip bristles [m], world axes; None without. Shape (C, 3).
        memory: updated at accepted states only; None: contacts that were never closed.
    """

    position: Array
    quaternion: Array
    velocity: Array
    bristles: Array | None = None
    memory: RunMemory | None = None

    def flat(self) -> Array:
        """Return the integrated numbers in one vector, 13 nb + 3 C with bristles."""
        parts = [self.position, self.quaternion, self.velocity]
        if self.bristles is not None:
            parts.append(self.bristles)
        return np.concatenate([part.ravel() for part in parts])

    def with_flat(self, y: Array) -> MaximalState:
        """Return the state with the numbers of a flat vector, as views of it, and this memory."""
        n = len(self.position)
        return MaximalState(
            y[: 3 * n].reshape(n, 3),
            y[3 * n : 7 * n].reshape(n, 4),
            y[7 * n : 13 * n].reshape(n, 6),
            None if self.bristles is None else y[13 * n :].reshape(-1, 3),
            self.memory,
        )

    def with_unit_quaternions(self) -> MaximalState:
        """Return the state with quaternions of unit length."""
        return replace(self, quaternion=unit_quaternions(self.quaternion))
