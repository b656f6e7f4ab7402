"""Types of the compiled module."""

from collections.abc import Sequence
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

class NormalKind(Enum):
    hunt_crossley = 0
    adams_impact = 1

class NormalLaw:
    kind: NormalKind
    stiffness: float
    exponent: float
    dissipation: float
    damping: float
    damping_depth: float
    def energy(self, depth: float) -> float: ...
    def __call__(self, depth: float, rate: float) -> tuple[float, float, float, float]: ...

class FrictionKind(Enum):
    none = 0
    tanh_coulomb = 1
    adams_coulomb = 2

class FrictionLaw:
    kind: FrictionKind
    mu: float
    slip_slope: float
    mu_dynamic: float
    stiction_speed: float
    transition_speed: float
    def __call__(self, speed: float) -> tuple[float, float]: ...

class PlantSettings:
    @property
    def arrow(self) -> bool: ...

class Rollout:
    @property
    def q(self) -> Array: ...
    @property
    def v(self) -> Array: ...
    def advance(self, steps: int) -> bool: ...
    def record(self) -> dict[str, Array]: ...
    def counters(self) -> dict[str, float]: ...

def plant_settings(
    model: str,
    gravity: Array,
    feet: Sequence[tuple[int, Array, float]],
    normal: NormalLaw,
    friction: FrictionLaw,
    height: float,
    kp: Array,
    kd: Array,
    limit: Array,
    damping: Array,
    dense: bool = False,
) -> PlantSettings: ...
def evaluate(plant: PlantSettings, q: Array, v: Array, torque: Array) -> dict[str, Any]: ...
def repeat_dynamics(plant: PlantSettings, q: Array, v: Array, count: int) -> float: ...
def start(
    plant: PlantSettings,
    time: Sequence[float],
    position: Array,
    rate: Array,
    q: Array,
    v: Array,
    t0: float,
    step: float,
    stride: int,
    method: str,
) -> Rollout: ...
def advance_all(
    rollouts: Sequence[Rollout], steps: Sequence[int], threads: int
) -> Sequence[bool]: ...
