"""Pinocchio's own constrained dynamics and impulse dynamics, to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid import RigidModel


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
