"""What switches in a run of the second right-hand side, in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from oracles.second_rhs.right_hand_side import Modes


class Switch(NamedTuple):
    """A piece of a law that ends.

    Attributes:
        time: [s].
        what: name of the mode or memory that changes, as in `ContactMode` and `JointModes`.
        number: of the contact or joint.
        before: its value before.
        after: its value after.
    """

    time: float
    what: str
    number: int
    before: float
    after: float


class SecondRun(NamedTuple):
    """A run of the second right-hand side.

    Attributes:
        q: configurations at the samples (T, nq) [m, -, rad].
        switches: in their order.
    """

    q: Array
    switches: tuple[Switch, ...]

    def count(self, what: str) -> int:
        """Return how often a mode has changed."""
        return sum(switch.what == what for switch in self.switches)


def changes(time: float, old: Modes, new: Modes) -> Iterator[Switch]:
    """Yield what differs between two modes."""
    for k, (one, two) in enumerate(zip(old.contacts, new.contacts, strict=True)):
        for field in fields(one):
            before, after = float(getattr(one, field.name)), float(getattr(two, field.name))
            if before != after:
                yield Switch(time, field.name, k, before, after)
    for field in fields(old.joints):
        left, right = getattr(old.joints, field.name), getattr(new.joints, field.name)
        for j in np.flatnonzero(left != right).tolist():
            yield Switch(time, field.name, j, float(left[j]), float(right[j]))
