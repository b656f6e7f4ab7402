"""Any of the grounds, from its TOML form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain.height_field import HeightField
from hexapod_pin.ground.terrain.overlay import PatchedGround, ShakingGround
from hexapod_pin.ground.terrain.plane import Flat, Slope
from hexapod_pin.ground.terrain.profile import Groove, Ledge, Ramp, Stairs

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


def read_terrain(data: Mapping[str, Any]) -> AnyTerrain:
    """Return the ground that `model_dump` turned into plain data.

    Raises:
        ParameterError: `kind` is missing or unknown, or a value is out of range.
    """
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ParameterError("terrain.kind", kind, f"one of {', '.join(KINDS)}")
    return KINDS[kind](**data)
