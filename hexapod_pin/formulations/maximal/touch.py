"""Contacts at one state, and what a memory keeps of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.ground_points import FAR

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.memory import Memory

    Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Touch:
    """All C contacts at one state, those of foot f at f * each and after; world axes.

    Attributes:
        gap: (C,) [m], negative inside the ground.
        approach: (C,) -n . u [m/s].
        force: (C, 3) on the feet [N].
        stretch_rate: (C, 3) of the bristles [m/s]; zeros for laws without.
        on_cone: (C,) bristles at their limit.
    """

    gap: Array
    approach: Array
    force: Array
    stretch_rate: Array
    on_cone: Flags


def settled(touch: Touch, memory: Memory) -> Memory:
    """Return the memory after an accepted state: contacts that began or ended change it."""
    closed = touch.gap < 0.0
    seen = ~closed & (touch.gap < FAR)
    new = closed & ~memory.touching & (memory.touch_speed <= 0.0)  # never seen open
    speed = np.where(seen | new, np.maximum(touch.approach, 0.0), memory.touch_speed)
    return replace(memory, touching=closed, touch_speed=speed, sliding=touch.on_cone & closed)


def begun(which: int, touch: Touch, memory: Memory) -> Memory:
    """Return the memory at the moment when one contact closes."""
    touching, speed = memory.touching.copy(), memory.touch_speed.copy()
    touching[which], speed[which] = True, max(0.0, float(touch.approach[which]))
    return replace(memory, touching=touching, touch_speed=speed)


def released(touch: Touch, stretch: Array) -> Array:
    """Return the stretches (C, 3) [m] with those of open contacts let go."""
    return np.asarray(np.where((touch.gap < 0.0)[:, None], stretch, 0.0))
