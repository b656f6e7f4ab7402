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
from random_scenes.dice import Dice

REACH = 0.3
"""Edges lie within this distance of the world's origin [m]."""

FLAT_SHARE = 0.35


def _heading(dice: Dice) -> float:
    return dice.between(-math.pi, math.pi)


def _slope(dice: Dice) -> Slope:
    return Slope(angle=dice.between(0.02, 0.5), heading=_heading(dice))


def _stairs(dice: Dice) -> Stairs:
    return Stairs(
        rise=dice.between(0.002, 0.02), run=dice.between(0.08, 0.3), count=dice.integer(1, 5),
        start=dice.between(-REACH, REACH), heading=_heading(dice),
    )  # fmt: skip


def _ramp(dice: Dice) -> Ramp:
    return Ramp(
        angle=dice.between(-0.3, 0.3), run=dice.between(0.1, 0.4),
        start=dice.between(-REACH, 0.5 * REACH), heading=_heading(dice),
    )  # fmt: skip


def _ledge(dice: Dice) -> Ledge:
    edge = dice.between(-REACH, REACH)
    return Ledge(height=dice.between(0.002, 0.02), edge=edge, heading=_heading(dice))


def _groove(dice: Dice) -> Groove:
    return Groove(
        angle_left=dice.between(0.1, 0.6), angle_right=dice.between(0.1, 0.6),
        depth=dice.between(0.005, 0.03), bottom=dice.between(-REACH, REACH), heading=_heading(dice),
    )  # fmt: skip


def _height_field(dice: Dice) -> HeightField:
    return HeightField.random(
        dice.integer(0, 2**31), amplitude=dice.between(0.002, 0.015),
        wavelength=dice.between(0.15, 0.5), size=2.0,
    )  # fmt: skip


def _patch(dice: Dice) -> Patch:
    x, y = dice.vector(REACH, 2)
    stiffness = dice.log_between(0.1, 1.0) if dice.chance(0.4) else 1.0
    wide = (dice.between(0.1, 0.4), dice.between(0.1, 0.4))
    return Patch(
        low=(x, y), high=(x + wide[0], y + wide[1]), friction=dice.between(0.2, 1.5),
        stiffness=stiffness,
    )  # fmt: skip


def _patched(dice: Dice) -> PatchedGround:
    patches = tuple(_patch(dice) for _ in range(dice.integer(1, 6)))
    return PatchedGround(ground=Flat() if dice.chance(0.6) else _slope(dice), patches=patches)


def _shaken(dice: Dice) -> ShakingGround:
    draw = dice.pick((None, _slope, _patched, _stairs))
    return ShakingGround(
        ground=Flat() if draw is None else draw(dice),
        amplitude=dice.log_between(1e-4, 3e-3), frequency=dice.log_between(2.0, 40.0),
    )  # fmt: skip


TERRAINS: Mapping[str, Callable[[Dice], AnyTerrain]] = {
    "slope": _slope,
    "stairs": _stairs,
    "ramp": _ramp,
    "ledge": _ledge,
    "groove": _groove,
    "height-field": _height_field,
    "patched": _patched,
    "shaken": _shaken,
}


def draw_terrain(dice: Dice) -> tuple[AnyTerrain, str]:
    """Return a ground and its label."""
    if dice.chance(FLAT_SHARE):
        return Flat(), "flat"
    name = dice.pick(tuple(TERRAINS))
    return TERRAINS[name](dice), name
