"""Types of the compiled module."""

from collections.abc import Sequence
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

class NormalKind(Enum):
    hunt_crossley = 0
    restitution = 1
    kelvin_voigt = 2
    adams_impact = 3

class NormalLaw:
    kind: NormalKind
    stiffness: float
    exponent: float
    dissipation: float
    eta: float
    speed_floor: float
    damping: float
    damping_depth: float
    def energy(self, depth: float) -> float: ...
    def __call__(
        self, depth: float, rate: float, touch_speed: float = 0.0
    ) -> tuple[float, float, float, float]: ...

class FrictionKind(Enum):
    none = 0
    tanh_coulomb = 1
    adams_coulomb = 2
    smooth_step = 3
    brown_mcphee = 4
    bristle = 5

class FrictionLaw:
    kind: FrictionKind
    mu: float
    slip_slope: float
    mu_dynamic: float
    stiction_speed: float
    transition_speed: float
    bristle_stiffness: float
    bristle_damping: float
    def __call__(self, speed: float) -> tuple[float, float]: ...

class Terrain:
    def contacts(self, center: Array, radius: float) -> list[tuple[float, Array]]: ...
    def patch(self, x: float, y: float) -> tuple[float, float]: ...

def plane(point: Array, normal: Array) -> Terrain: ...
def profile(heading: float, x: Sequence[float], z: Sequence[float]) -> Terrain: ...
def height_field(x0: float, y0: float, dx: float, dy: float, z: Array) -> Terrain: ...
def with_patches(
    terrain: Terrain, patches: Sequence[tuple[float, float, float, float, float, float]]
) -> Terrain: ...
def with_shaking(terrain: Terrain, amplitude: float, frequency: float) -> Terrain: ...

class TreeModel: ...

def tree_model(
    parent: Sequence[int], motion: Array, placement: Array, inertia: Array, armature: Array
) -> TreeModel: ...

class PlantSettings:
    @property
    def arrow(self) -> bool: ...
    @property
    def dynamics(self) -> str: ...

class Checkpoint:
    @property
    def first(self) -> int: ...
    @property
    def q(self) -> Array: ...
    @property
    def v(self) -> Array: ...
    @property
    def contacts(self) -> Array: ...
    @property
    def controller(self) -> list[float]: ...

class Rollout:
    def advance(self, samples: int) -> bool: ...
    def record(self) -> dict[str, Array]: ...
    def counters(self) -> dict[str, float]: ...
    def checkpoint(self) -> Checkpoint: ...

def plant_settings(
    model: TreeModel,
    gravity: Array,
    feet: Sequence[tuple[int, Array, float]],
    normal: NormalLaw,
    friction: FrictionLaw,
    terrain: Terrain,
    kp: Array,
    kd: Array,
    limit: Array,
    damping: Array,
    lower: Array,
    upper: Array,
    stop_stiffness: float,
    stop_dissipation: float,
    dense: bool = False,
    fused: bool = True,
    baseline: bool = False,
) -> PlantSettings: ...
def evaluate(plant: PlantSettings, q: Array, v: Array, torque: Array) -> dict[str, Any]: ...
def repeat_compute(plant: PlantSettings, q: Array, v: Array, count: int) -> float: ...
def chart_rates(
    plant: PlantSettings, q0: Array, y: Array, q_ref: Array, s: float, b: Array
) -> tuple[Array, Array]: ...
def repeat_dynamics(plant: PlantSettings, q: Array, v: Array, count: int) -> float: ...
def checkpoint(
    first: int, q: Array, v: Array, contacts: Array, controller: Sequence[float]
) -> Checkpoint: ...
def start(
    plant: PlantSettings,
    time: Sequence[float],
    position: Array,
    rate: Array,
    held: bool,
    start: Checkpoint,
    method: str,
    step: float,
    stride: int,
    sample: float,
    accuracy: float,
) -> Rollout: ...
def advance_all(
    rollouts: Sequence[Rollout], samples: Sequence[int], threads: int
) -> Sequence[bool]: ...
