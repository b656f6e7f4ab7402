"""Robots and random states that the checks share; the seed is fixed, so errors repeat."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid import RigidModel
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.validation.cases.robots import ROBOTS, robot_file

SEED = 20130901


@lru_cache(maxsize=8)
def rigid_robot(name: str, radius: float | None = None) -> RigidModel:
    """Return a packaged or a benchmark robot on rigid level ground; radius 0 gives point feet."""
    source = str(robot_file(name)) if name in ROBOTS else name
    return RigidModel(load_robot(source, foot_radius=radius))


def states(model: RigidModel, count: int, *, seed: int = SEED) -> Iterator[tuple[Array, Array]]:
    """Yield random q and v near standing: tilted, bent, turning, 0.05 m into the ground."""
    rng = np.random.default_rng(seed)
    stand = model.robot.stand().q
    for _ in range(count):
        q = stand.copy()
        q[:3] += 0.05 * rng.normal(size=3) - [0.0, 0.0, 0.05]
        turn = np.append(0.1 * rng.normal(size=3), 1.0)
        q[3:7] = turn / np.linalg.norm(turn)
        q[7:] += 0.2 * rng.normal(size=len(q) - 7)
        yield q, rng.normal(size=model.model.nv)


def some_feet(rng: np.random.Generator) -> list[int]:
    """Return one to six of six feet."""
    return sorted(rng.choice(6, int(rng.integers(1, 7)), replace=False).tolist())


def worst(found: Array, wanted: Array) -> float:
    """Return the largest difference over the largest wanted entry."""
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())
