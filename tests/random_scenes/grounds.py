"""Grounds drawn at random, their edges where the feet are or come to within the scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from hexapod_pin.ground.terrain import (
    AnyTerrain,
    Flat,
    Groove,
    HeightField,
    Ledge,
    Patch,
    PatchedGround,
    Ramp,
    ShakingGround,
    Slope,
    Stairs,
)
from random_scenes.draws import Draws

REACH = 0.3
"""Edges lie within this distance of the world's origin [m]."""

FLAT_SHARE = 0.35


def _heading(rng: Draws) -> float:
    return rng.between(-math.pi, math.pi)


def _slope(rng: Draws) -> Slope:
    return Slope(angle=rng.between(0.02, 0.5), heading=_heading(rng))


def _stairs(rng: Draws) -> Stairs:
    return Stairs(
        rise=rng.between(0.002, 0.02), run=rng.between(0.08, 0.3), count=rng.integer(1, 5),
        start=rng.between(-REACH, REACH), heading=_heading(rng),
    )  # fmt: skip


def _ramp(rng: Draws) -> Ramp:
    return Ramp(
        angle=rng.between(-0.3, 0.3), run=rng.between(0.1, 0.4),
        start=rng.between(-REACH, 0.5 * REACH), heading=_heading(rng),
    )  # fmt: skip


def _ledge(rng: Draws) -> Ledge:
    edge = rng.between(-REACH, REACH)
    return Ledge(height=rng.between(0.002, 0.02), edge=edge, heading=_heading(rng))


def _groove(rng: Draws) -> Groove:
    return Groove(
        angle_left=rng.between(0.1, 0.6), angle_right=rng.between(0.1, 0.6),
        depth=rng.between(0.005, 0.03), bottom=rng.between(-REACH, REACH), heading=_heading(rng),
    )  # fmt: skip


def _height_field(rng: Draws) -> HeightField:
    return HeightField.random(
        rng.integer(0, 2**31), amplitude=rng.between(0.002, 0.015),
        wavelength=rng.between(0.15, 0.5), size=2.0,
    )  # fmt: skip


def _patch(rng: Draws) -> Patch:
    x, y = rng.vector(REACH, 2)
    stiffness = rng.log_between(0.1, 1.0) if rng.chance(0.4) else 1.0
    wide = (rng.between(0.1, 0.4), rng.between(0.1, 0.4))
    return Patch(
        low=(x, y), high=(x + wide[0], y + wide[1]), friction=rng.between(0.2, 1.5),
        stiffness=stiffness,
    )  # fmt: skip


def _patched(rng: Draws) -> PatchedGround:
    patches = tuple(_patch(rng) for _ in range(rng.integer(1, 6)))
    return PatchedGround(ground=Flat() if rng.chance(0.6) else _slope(rng), patches=patches)


def _shaken(rng: Draws) -> ShakingGround:
    draw = rng.pick((None, _slope, _patched, _stairs))
    return ShakingGround(
        ground=Flat() if draw is None else draw(rng),
        amplitude=rng.log_between(1e-4, 3e-3), frequency=rng.log_between(2.0, 40.0),
    )  # fmt: skip


TERRAINS: Mapping[str, Callable[[Draws], AnyTerrain]] = {
    "slope": _slope,
    "stairs": _stairs,
    "ramp": _ramp,
    "ledge": _ledge,
    "groove": _groove,
    "height-field": _height_field,
    "patched": _patched,
    "shaken": _shaken,
}


def draw_terrain(rng: Draws) -> tuple[AnyTerrain, str]:
    """Return a ground and its label."""
    if rng.chance(FLAT_SHARE):
        return Flat(), "flat"
    name = rng.pick(tuple(TERRAINS))
    return TERRAINS[name](rng), name
