"""A gait whose joints follow the plan exactly: base and forces by S2 eqs. 1-4, torques by a split.

This is how S2 takes torques from a motion: nothing is integrated and no servo has an error. The
planned footholds stand still, so the feet take the base with them and nothing strikes the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.control.feasibility import neutral_feet
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.kinematic import KinematicControl, walking_legs
from hexapod_pin.formulations.inverse import inverse_dynamics
from hexapod_pin.formulations.rigid.force_split import ForceSplit, MinimumNorm
from hexapod_pin.formulations.rigid.kkt import solve_ranked
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.motion import rigid_gait
from hexapod_pin.formulations.rigid.set_points import SetPoints

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait


@dataclass(frozen=True)
class PlannedForces:
    """Torques and forces along a planned gait; T times, n joints, F feet.

    Attributes:
        time: [s]. Shape (T,).
        torque: [N m]. Shape (T, n).
        force: on the feet, world axes [N]. Shape (T, F, 3).
        residual: largest acceleration left at a grounded foot [m/s^2]. Shape (T,).
        pulled: share of the samples in which the split pulls some foot.
        sliding: share of the samples in which it needs more friction than there is on some foot.
        split: how the feet share the load.
    """

    time: Array
    torque: Array
    force: Array
    residual: Array
    pulled: float
    sliding: float
    split: str


def planned_forces(
    model: RigidModel, gait: Gait, time: ArrayLike, split: ForceSplit | None = None
) -> PlannedForces:
    """Return torques and forces of a planned walk at the given times.

    Feet pivot about their contact points: the plan is exact for point feet (`foot_radius=0`); a
    sphere would roll, and its foothold would have to slide.

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
    legs = walking_legs(model.robot)
    rule = split or MinimumNorm()
    stand = model.robot.stand()
    path = FootPath(gait, neutral_feet(legs))
    plan = SetPoints(KinematicControl(gait).plan(model.robot, float(times.max()) + 0.1))
    names = [model.robot.foot(model.robot.leg(leg.name).foot).name for leg in legs]
    order = [model.foot_names.index(name) for name in names]
    down, pose = path.stance(times), path.body_pose(times)
    torque, force, residual, pulled, slides = [], [], [], 0, 0
    for t, standing, place in zip(times, down, pose, strict=True):
        feet = sorted(order[k] for k in np.flatnonzero(standing))
        q, v, joints = _state(model, plan, float(t), stand.q, place, feet)
        motion = rigid_gait(model, q, v, joints, feet)
        found = inverse_dynamics(model, q, v, motion.acceleration, feet, rule)
        torque.append(found.torque)
        force.append(found.force)
        residual.append(float(np.abs(motion.residual).max(initial=0.0)))
        pulled += any(check.verdict == "pulls" for check in found.checks)
        slides += any(check.verdict == "slides" for check in found.checks)
    count = max(len(times), 1)
    return PlannedForces(
        times, np.array(torque), np.array(force), np.array(residual), pulled / count,
        slides / count, rule.label,
    )  # fmt: skip


def _state(
    model: RigidModel, plan: SetPoints, time: float, standing: Array, place: Array, feet: list[int]
) -> tuple[Array, Array, Array]:
    """Return q, v and joint accelerations; the base moves as the grounded feet let it."""
    angles, rates, joints = plan(time)
    half = 0.5 * float(place[2])
    turn = [0.0, 0.0, np.sin(half), np.cos(half)]
    q = np.concatenate([place[:2], standing[2:3], turn, angles])
    rows = model.positions(q)[1][feet].reshape(-1, model.model.nv)
    base = solve_ranked(np.eye(6), np.zeros(6), rows[:, :6], -rows[:, 6:] @ rates).x
    return q, np.concatenate([base, rates]), joints
