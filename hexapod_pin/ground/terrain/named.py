"""Controllers are compared on named grounds. Any ground can be read back from its TOML form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.contact import Contact
from hexapod_pin.ground.terrain.height_field import HeightField
from hexapod_pin.ground.terrain.overlay import Patch, PatchedGround, ShakingGround
from hexapod_pin.ground.terrain.profile import Flat, Groove, Ledge, Ramp, Slope, Stairs
from hexapod_pin.plugins import TERRAINS, plugin_names, plugin_result

LEVEL_RADIUS = 0.5
"""All grounds are level, and firm, up to this distance from the world's origin [m]."""

SLOPE_ANGLE = math.radians(15.0)
BUMP_WAVELENGTH = 0.3  # m
HALF_WIDTH = 1.0  # of fields and patches to either side of the path [m]
SLIPPERY_FRICTION = 0.15  # factor on friction
SLIPPERY_LENGTH = 1.0  # m
SOFT_STIFFNESS = 0.02  # factor on normal force
SOFT_LENGTH = 0.3  # of a yielding patch [m]


@checked
def study_grounds(
    lift: float, *, seed: int, length: float
) -> dict[str, tuple[AnyTerrain, Contact | None]]:
    """Return grounds by name, each with the contact it needs; None: whatever the study uses.

    All are level around the world's origin (LEVEL_RADIUS), where the robot starts, and are meant
    for a walk along +x. Their sizes are *assumed* but for the flat rigid ground of [S1].

    - flat: [S1]'s.
    - slope: from x = 0.5 m up by 15 degrees, to x = 0.5 m + `length`.
    - bumps: smooth random hills, largest |z| half the lift, waves of about 0.3 m, 1 m to the sides.
    - step: one riser as high as the lift at x = 0.5 m.
    - slippery: 1 m from x = 0.5 m on with 0.15 of the friction.
    - soft: from x = 0.5 m on patches of 0.3 m, left and right in turn, with 0.02 of the normal
      force at equal depth.
    - soil: flat sand, `Contact.soil`.

    Args:
        lift: height of the robot's swing foot [m].
        seed: of the bumps.
        length: how far the robot walks [m].

    Raises:
        ParameterError: lift or length is not positive and finite, or the bumps are too steep.

    Example:
        >>> for name, (ground, contact) in study_grounds(0.02, seed=1, length=3.0).items():
        ...     scene = hp.Scene(robot, terrain=ground, contact=contact or hp.Contact.accurate())
    """
    for name, value in (("lift", lift), ("length", length)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "positive and finite [m]")
    ramp = Ramp(angle=SLOPE_ANGLE, run=length, start=LEVEL_RADIUS)
    return {
        "flat": (Flat(), None),
        "slope": (ramp, None),
        "bumps": (_bumps(lift, seed, length), None),
        "step": (Stairs(rise=lift, run=length, count=1, start=LEVEL_RADIUS), None),
        "slippery": (PatchedGround(ground=Flat(), patches=(_slippery(),)), None),
        "soft": (PatchedGround(ground=Flat(), patches=_soft(length)), None),
        "soil": (Flat(), Contact.soil()),
    }


def _bumps(lift: float, seed: int, length: float) -> HeightField:
    """Return hills from a metre behind the start to a metre beyond the end."""
    return HeightField.random(
        seed,
        amplitude=0.5 * lift,
        wavelength=BUMP_WAVELENGTH,
        size=(length + 2.0 * HALF_WIDTH, 2.0 * HALF_WIDTH),
        centre=(0.5 * length, 0.0),
        flat_radius=LEVEL_RADIUS,
    )


def _slippery() -> Patch:
    return Patch(
        low=(LEVEL_RADIUS, -HALF_WIDTH),
        high=(LEVEL_RADIUS + SLIPPERY_LENGTH, HALF_WIDTH),
        friction=SLIPPERY_FRICTION,
    )


def _soft(length: float) -> tuple[Patch, ...]:
    """Return patches, left and right in turn, as far as the robot's front feet go."""
    patches = []
    for k in range(max(1, math.ceil(length / SOFT_LENGTH))):
        begin = LEVEL_RADIUS + k * SOFT_LENGTH
        low, high = (0.0, HALF_WIDTH) if k % 2 == 0 else (-HALF_WIDTH, 0.0)
        patches.append(
            Patch(low=(begin, low), high=(begin + SOFT_LENGTH, high), stiffness=SOFT_STIFFNESS)
        )
    return tuple(patches)


# Any of the grounds, from its TOML form.

AnyTerrain = (
    Flat | Slope | Stairs | Ramp | Ledge | Groove | HeightField | PatchedGround | ShakingGround
)

KINDS: dict[str, type[AnyTerrain]] = {
    str(cls.model_fields["kind"].default): cls
    for cls in (
        Flat,
        Slope,
        Stairs,
        Ramp,
        Ledge,
        Groove,
        HeightField,
        PatchedGround,
        ShakingGround,
    )
}


@checked
def read_terrain(data: Mapping[str, Any]) -> AnyTerrain:
    """Return the ground that `model_dump` turned into plain data, or one of an installed package.

    Raises:
        ParameterError: `kind` is missing or unknown, or a value is out of range.
        UserCodeError: the package that has the ground cannot be loaded, or does not take the data.
    """
    kind = data.get("kind")
    if isinstance(kind, str) and kind in KINDS:
        return KINDS[kind](**data)
    if isinstance(kind, str):
        given = {name: value for name, value in data.items() if name != "kind"}
        found = plugin_result(TERRAINS, kind, tuple(KINDS.values()), **given)
        if found is not None:
            return cast("AnyTerrain", found)
    known = [*KINDS, *plugin_names(TERRAINS)]
    hint = "" if kind is not None else f"Given without a kind: {', '.join(data) or 'nothing'}."
    raise ParameterError("terrain.kind", kind, f"one of {', '.join(known)}", hint)
