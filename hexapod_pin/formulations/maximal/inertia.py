"""Mass and inertia of links that fixed joints hold together, as one rigid body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hexapod_pin.arrays import Array


@dataclass(frozen=True, eq=False)
class RigidInertia:
    """A mass with its inertia, in the axes of the group's first link, from that link's origin.

    Attributes:
        mass: [kg].
        com: (3,) [m].
        inertia: (3, 3) about `com` [kg m^2].
    """

    mass: float
    com: Array
    inertia: Array


def link_inertia(mass: float, frame: Array, inertia: Array) -> RigidInertia:
    """Return the inertia of a link given in a frame (4, 4) of its own."""
    turn = frame[:3, :3]
    return RigidInertia(float(mass), frame[:3, 3], turn @ inertia @ turn.T)


def combined(inertias: Iterable[RigidInertia]) -> RigidInertia:
    """Return all as one: masses add, inertias move to the common centre (Steiner)."""
    parts = list(inertias)
    mass = sum(part.mass for part in parts)
    if mass <= 0.0:
        return RigidInertia(0.0, np.zeros(3), np.zeros((3, 3)))
    com = np.sum([part.mass * part.com for part in parts], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = part.com - com
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return RigidInertia(mass, com, inertia)
