"""Draws scenes from a seed and an index, each on its own: any one can be drawn again alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from random_scenes import bodies, drives, robots
from random_scenes.draws import Draws
from random_scenes.scene import PromiseScene


@dataclass(frozen=True)
class Kind:
    """A way to move: how often it is drawn (in proportion) and what draws it."""

    weight: float
    draw: Callable[[Draws], PromiseScene]


KINDS: Mapping[str, Kind] = {
    "dropped": Kind(16.0, robots.dropped),
    "walking 1 s": Kind(14.0, robots.walking),
    "walking 10 s": Kind(3.0, robots.walking_long),
    "pushed": Kind(8.0, robots.pushed),
    "flight 1 s": Kind(5.0, robots.limp_flight),
    "thrown": Kind(14.0, bodies.thrown),
    "bouncing": Kind(10.0, bodies.bouncing),
    "sliding": Kind(9.0, bodies.sliding),
    "spinning 10 s": Kind(3.0, bodies.spinning),
    "saturated": Kind(8.0, drives.saturated),
    "stopped": Kind(6.0, drives.stopped),
    "dry friction": Kind(4.0, drives.dry_friction),
}


def draw_scene(seed: int, index: int, kinds: Mapping[str, Kind] = KINDS) -> PromiseScene:
    """Return scene `index` of a seed; the same numbers give the same scene.

    Args:
        seed: not negative.
        index: not negative; scenes do not depend on each other.
        kinds: what to draw from.
    """
    rng = Draws(seed, index)
    return kinds[rng.weighted({name: kind.weight for name, kind in kinds.items()})].draw(rng)
