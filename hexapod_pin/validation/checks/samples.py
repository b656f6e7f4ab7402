"""Checks share sampled states, six feet on the ground, and Pinocchio's contact solutions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid import RigidModel
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.validation.cases.bodies import SIX_FEET, Vector, six_feet_body
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


# The body of HC15, HC17 and HC18 on rigid ground.


def six_feet(com: Vector, depth: float, inertia: Vector) -> RigidModel:
    """Return the body with its feet `depth` below its origin [m]."""
    return RigidModel(six_feet_body(com, depth, inertia))


def feet_named(names: str) -> list[int]:
    """Return the indices of feet named like "L1,L3,R2"."""
    return [list(SIX_FEET).index(name) for name in names.split(",")]


# Pinocchio's own constrained dynamics and impulse dynamics, to compare with.


def constrained_motion(
    model: RigidModel, q: Array, v: Array, torque: Array, feet: Sequence[int]
) -> tuple[Array, Array]:
    """Return acceleration (nv,) and forces (k, 3) of point feet by `pin.constraintDynamics`."""
    import pinocchio as pin

    data, models, datas = _contacts(model, feet)
    tau = np.concatenate([np.zeros(6), torque - model.robot.damping * v[6:]])
    found = pin.constraintDynamics(model.model, data, q, v, tau, models, datas, _exact())
    return np.array(found), np.array(data.lambda_c).reshape(-1, 3)


def impulsive_motion(
    model: RigidModel, q: Array, v: Array, feet: Sequence[int]
) -> tuple[Array, Array]:
    """Return v+ (nv,) and impulses (k, 3) of point feet by `pin.impulseDynamics`."""
    import pinocchio as pin

    data, models, datas = _contacts(model, feet)
    found = pin.impulseDynamics(model.model, data, q, v, models, datas, 0.0, _exact())
    return np.array(found), np.array(data.impulse_c).reshape(-1, 3)


def _exact() -> Any:
    import pinocchio as pin

    return pin.ProximalSettings(1e-14, 1e-14, 0.0, 20)


def _contacts(model: RigidModel, feet: Sequence[int]) -> tuple[Any, Any, Any]:
    import pinocchio as pin

    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for k in feet:
        foot = model.robot.feet[k]
        joint = model.model.getJointId(foot.joint)
        place = pin.SE3(np.eye(3), foot.offset)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        models.append(
            pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model.model, joint, place, frame)
        )
    for contact in models:
        datas.append(contact.createData())
    data = model.model.createData()
    pin.initConstraintDynamics(model.model, data, models, datas)
    return data, models, datas
