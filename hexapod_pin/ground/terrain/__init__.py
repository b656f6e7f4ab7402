"""The ground: planes, stairs, ramps, ledges, grooves, height fields; patches and shaking on any."""

from hexapod_pin.ground.terrain.ground import Ground, Surface
from hexapod_pin.ground.terrain.height_field import HeightField, HeightGrid
from hexapod_pin.ground.terrain.named import AnyTerrain, read_terrain, study_grounds
from hexapod_pin.ground.terrain.overlay import Patch, PatchedGround, ShakingGround
from hexapod_pin.ground.terrain.profile import (
    Flat,
    Groove,
    Ledge,
    Plane,
    Polyline,
    Ramp,
    Slope,
    Stairs,
)

__all__ = [
    "AnyTerrain",
    "Flat",
    "Groove",
    "Ground",
    "HeightField",
    "HeightGrid",
    "Ledge",
    "Patch",
    "PatchedGround",
    "Plane",
    "Polyline",
    "Ramp",
    "ShakingGround",
    "Slope",
    "Stairs",
    "Surface",
    "read_terrain",
    "study_grounds",
]
