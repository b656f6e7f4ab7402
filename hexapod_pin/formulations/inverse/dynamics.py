"""S2 appendix eqs. 1-2 solved for the torques: what joints must deliver for a given motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.inverse.force_split import ForceSplit, MinimumNorm
from hexapod_pin.formulations.inverse.stance import stance_load
from hexapod_pin.formulations.rigid.constraints import ContactSet
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.sticking import StickingCheck, check_sticking


@dataclass(frozen=True)
class InverseDynamics:
    """Torques and foot forces of a motion; F feet, n joints.

    Attributes:
        torque: of the servos [N m]. Shape (n,).
        force: of the ground on all feet, world axes [N]. Shape (F, 3).
        split: how the feet share the load.
        unique: which force components the motion alone determines. Shape (F, 3).
        imbalance: what no foot force can give the base, body axes [N, N m]. Shape (6,).
        checks: whether each foot could stick.
    """

    torque: Array
    force: Array
    split: str
    unique: NDArray[np.bool_]
    imbalance: Array
    checks: tuple[StickingCheck, ...]


def inverse_dynamics(
    model: RigidModel,
    q: Array,
    v: Array,
    acceleration: Array,
    feet: Sequence[int],
    split: ForceSplit | None = None,
) -> InverseDynamics:
    """Return the torques of a motion, the feet sharing the load by a split.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        acceleration: of base (body axes) and joints [m/s^2, rad/s^2]. Shape (nv,).
        feet: indices of the grounded feet.
        split: picks the forces where six equations leave a choice; default `MinimumNorm`.

    Raises:
        InfeasibleError: `LeastTorque` found no forces inside cones and limits.
        NoRestError: `ContactSprings` found no rest.
    """
    rule = split or MinimumNorm()
    load = stance_load(model, q, v, acceleration, feet)
    share = rule.share(load)
    contacts, count = ContactSet(tuple(feet)), len(model.robot.feet)
    force = contacts.forces(share, model.normal, count)
    unique = contacts.force_flags(load.unique, count)
    return InverseDynamics(
        torque=load.torque(share), force=force, split=rule.label, unique=unique,
        imbalance=load.imbalance(share), checks=check_sticking(model, feet, force, unique),
    )  # fmt: skip


def torque_under_forces(
    model: RigidModel, q: Array, v: Array, acceleration: Array, force: ArrayLike
) -> Array:
    """Return generalised forces of a motion under given foot forces: RNEA with external forces.

    Args:
        model: robot and ground.
        q: configuration. Shape (nq,).
        v: velocity. Shape (nv,).
        acceleration: shape (nv,).
        force: on every foot at its contact point, world axes [N]. Shape (F, 3).

    Returns:
        Shape (nv,): first what the base lacks (0 for a motion the forces allow), then torques.
    """
    import pinocchio as pin

    points = model.positions(q)[3]
    external = pin.StdVec_Force([pin.Force.Zero() for _ in range(model.model.njoints)])
    for foot, point, one in zip(model.robot.feet, points, np.asarray(force), strict=True):
        joint = model.model.getJointId(foot.joint)
        about_origin = pin.Force(one, np.cross(point, one))
        external[joint] += model.data.oMi[joint].actInv(about_origin)
    return model.inverse_dynamics(q, v, acceleration, external)
