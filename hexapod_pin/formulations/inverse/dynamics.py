"""Inverse dynamics (S2 eqs. 1-4) give the torques of a motion, and of a gait followed exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.formulations.inverse.force_split import ForceSplit, MinimumNorm
from hexapod_pin.formulations.inverse.stance import stance_load
from hexapod_pin.formulations.rigid.derivative import (
    ContactSet,
    StickingCheck,
    check_sticking,
    prescribed_derivative,
    solve_kkt,
)
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.robot.state import State

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait


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


# Torques of a gait whose joints follow the plan exactly: S2 eqs. 1-4, torques by a split.
#
# This is how S2 takes torques from a motion: nothing is integrated and no servo has an error. The
# planned footholds stand still, so the feet determine the base and nothing strikes the ground.


@dataclass(frozen=True)
class PrescribedGait:
    """Torques and forces along a prescribed gait; T times, n joints, F feet.

    Attributes:
        time: [s]. Shape (T,).
        torque: [N m]. Shape (T, n).
        force: on the feet, world axes [N]. Shape (T, F, 3).
        residual: largest acceleration left at a grounded foot [m/s^2]. Shape (T,).
        pulling_share: share of the samples in which the split pulls some foot [-].
        sliding_share: share of those in which it needs more friction than some foot has [-].
        split: how the feet share the load.
    """

    time: Array
    torque: Array
    force: Array
    residual: Array
    pulling_share: float
    sliding_share: float
    split: str


def prescribed_gait(
    model: RigidModel, gait: Gait, time: ArrayLike, split: ForceSplit | None = None
) -> PrescribedGait:
    """Return torques and forces of a walk that follows its plan, at the given times.

    Feet pivot about their contact points, as the plan has it: spherical feet roll without slip.

    Args:
        model: a robot with six legs, on level ground.
        gait: the gait.
        time: [s]. Shape (T,).
        split: how feet share the load; default `MinimumNorm`.

    Raises:
        GaitError: the robot cannot walk the gait.
        InfeasibleError: `LeastTorque` found no forces inside cones and limits.
    """
    times = np.asarray(time, dtype=float)
    rule, height = split or MinimumNorm(), float(model.robot.stand().q[2])
    plan = SetPoints(KinematicControl(gait).plan(model.robot, float(times.max()) + 0.1))
    path, order = _foot_path(model, gait)
    solutions, found = [], []
    for t, down, pose in zip(times, path.stance(times), path.body_pose(times), strict=True):
        feet = sorted(order[k] for k in np.flatnonzero(down))
        state, joint_acceleration = _state(model, plan, float(t), height, pose, feet)
        solution = prescribed_derivative(model, state, joint_acceleration, feet)
        solutions.append(solution)
        found.append(inverse_dynamics(model, state.q, state.v, solution.acceleration, feet, rule))
    verdicts = [{check.verdict for check in one.checks} for one in found]
    return PrescribedGait(
        time=times,
        torque=np.array([one.torque for one in found]),
        force=np.array([one.force for one in found]),
        residual=np.array([float(np.abs(s.residual).max(initial=0.0)) for s in solutions]),
        pulling_share=float(np.mean(["pulls" in one for one in verdicts])),
        sliding_share=float(np.mean(["slides" in one for one in verdicts])),
        split=rule.label,
    )


def _foot_path(model: RigidModel, gait: Gait) -> tuple[FootPath, list[int]]:
    """Return the gait's path and, in its leg order, the indices of the robot's feet."""
    legs = leg_group(model.robot)
    names = [model.robot.leg(leg.name).foot for leg in legs.legs]
    return FootPath(gait, legs.neutral_feet), [model.foot_names.index(name) for name in names]


def _state(
    model: RigidModel, plan: SetPoints, time: float, height: float, pose: Array, feet: list[int]
) -> tuple[State, Array]:
    """Return state and joint accelerations; the base has the velocity that the feet allow.

    Args:
        model: the robot.
        plan: set-points of the joints.
        time: [s].
        height: of the base [m].
        pose: planned x, y [m] and heading [rad] of the base.
        feet: indices of the grounded feet.
    """
    angles, rates, joint_acceleration = plan(time)
    half = 0.5 * float(pose[2])
    q = np.concatenate([pose[:2], [height, 0.0, 0.0, np.sin(half), np.cos(half)], angles])
    rows = model.positions(q)[1][feet].reshape(-1, model.model.nv)
    base = solve_kkt(np.eye(6), np.zeros(6), rows[:, :6], -rows[:, 6:] @ rates).x
    return State(q, np.concatenate([base, rates])), joint_acceleration
