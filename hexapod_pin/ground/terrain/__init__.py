"""The ground: planes, stairs, ledges, grooves, height fields; patches and shaking on any."""

from hexapod_pin.ground.terrain.choice import AnyTerrain as AnyTerrain
from hexapod_pin.ground.terrain.choice import read_terrain as read_terrain
from hexapod_pin.ground.terrain.ground import Ground as Ground
from hexapod_pin.ground.terrain.ground import Surface as Surface
from hexapod_pin.ground.terrain.height_field import HeightField as HeightField
from hexapod_pin.ground.terrain.height_grid import HeightGrid as HeightGrid
from hexapod_pin.ground.terrain.overlay import Patch as Patch
from hexapod_pin.ground.terrain.overlay import PatchedGround as PatchedGround
from hexapod_pin.ground.terrain.overlay import ShakingGround as ShakingGround
from hexapod_pin.ground.terrain.plane import Flat as Flat
from hexapod_pin.ground.terrain.plane import Plane as Plane
from hexapod_pin.ground.terrain.plane import Slope as Slope
from hexapod_pin.ground.terrain.polyline import Polyline as Polyline
from hexapod_pin.ground.terrain.profile import Groove as Groove
from hexapod_pin.ground.terrain.profile import Ledge as Ledge
from hexapod_pin.ground.terrain.profile import Stairs as Stairs
