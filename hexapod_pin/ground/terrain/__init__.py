"""The ground: planes, stairs, ramps, ledges, grooves, height fields; patches and shaking on any."""

from hexapod_pin.ground.terrain.any_terrain import AnyTerrain, read_terrain
from hexapod_pin.ground.terrain.ground import Ground, Surface
from hexapod_pin.ground.terrain.height_field import HeightField
from hexapod_pin.ground.terrain.height_grid import HeightGrid
from hexapod_pin.ground.terrain.named import study_grounds
from hexapod_pin.ground.terrain.overlay import Patch, PatchedGround, ShakingGround
from hexapod_pin.ground.terrain.plane import Flat, Plane, Slope
from hexapod_pin.ground.terrain.polyline import Polyline
from hexapod_pin.ground.terrain.profile import Groove, Ledge, Ramp, Stairs

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
