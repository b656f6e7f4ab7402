"""A robot that stands still: masses, contact points, static forces, and the stiffness of these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.once_per_robot import once_per_robot

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

NUDGE = 1e-6
"""Of a central difference [m, rad]."""


@dataclass(frozen=True, eq=False)
class Standing:
    """What of a standing robot does not depend on servos and contact.

    Attributes:
        mass: without the motors' rotors. Shape (N, N).
        stiffness: of the weight and of static foot forces alone. Shape (N, N).
        jacobian: of the feet's lowest points, world axes. Shape (F, 3, N).
        load: static normal force of each foot [N]. Shape (F,).
        torque: static torque of each joint [N m]. Shape (n,).
    """

    mass: Array
    stiffness: Array
    jacobian: Array
    load: Array
    torque: Array


@once_per_robot
def _known(robot: Any) -> dict[tuple[float, tuple[str, ...] | None], Standing]:
    return {}


def standing_still(robot: Any, gravity: float, feet: tuple[str, ...] | None) -> Standing:
    """Return a robot that stands in its posture on level ground, computed once.

    Args:
        robot: the robot.
        gravity: [m/s^2].
        feet: names of the feet that bear the weight, split by least squares; None: all.

    Raises:
        ParameterError: feet that cannot carry the weight.
    """
    import pinocchio as pin

    known = _known(robot)
    if (gravity, feet) not in known:
        data, q = robot.model.createData(), robot.stand().q
        stands = np.array([feet is None or foot.name in feet for foot in robot.feet])
        mass = np.triu(pin.crba(robot.model, data, q))
        jacobian, weight = _point_jacobians(robot, data, q), _weight(robot, data, q, gravity)
        load = _split(jacobian, weight, stands)
        known[gravity, feet] = Standing(
            mass=mass + np.triu(mass, 1).T,
            stiffness=_static_stiffness(robot, data, q, gravity, load),
            jacobian=jacobian,
            load=load,
            torque=(weight - np.einsum("fn,f->n", jacobian[:, 2], load))[6:],
        )
    return known[gravity, feet]


def _point_jacobians(robot: Any, data: Any, q: Array) -> Array:
    """Return the Jacobians of the feet's lowest points, world axes. Shape (F, 3, N)."""
    import pinocchio as pin

    model = robot.model
    pin.computeJointJacobians(model, data, q)
    found = np.empty((len(robot.feet), 3, model.nv))
    for k, foot in enumerate(robot.feet):
        joint = model.getJointId(foot.joint)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        own = pin.getJointJacobian(model, data, joint, frame)
        arm = data.oMi[joint].rotation @ np.asarray(foot.offset) - [0.0, 0.0, foot.radius]
        found[k] = own[:3] - pin.skew(arm) @ own[3:]
    return found


def _weight(robot: Any, data: Any, q: Array, gravity: float) -> Array:
    """Return the generalised forces that carry the weight, (N,) [N, N m]."""
    import pinocchio as pin

    per_unit = pin.computeGeneralizedGravity(robot.model, data, q)
    found: Array = np.array(per_unit) * (gravity / -robot.model.gravity.linear[2])
    return found


def _split(jacobian: Array, weight: Array, stands: Array) -> Array:
    """Return the normal forces of least squares that carry the weight [N]. Shape (F,).

    Raises:
        ParameterError: one would have to pull.
    """
    balance = jacobian[:, 2, :6].T * stands  # rows of z, pitch and roll alone are not 0
    load = np.linalg.lstsq(balance, weight[:6], rcond=None)[0]
    missing = np.abs(balance @ load - weight[:6]).max()
    if missing > 1e-6 * weight[2] or load.min() < 0.0:
        raise ParameterError(
            "StanceModel.feet", int(stands.sum()), "feet around the robot's centre of mass"
        )
    return np.asarray(load)


def _static_stiffness(robot: Any, data: Any, q: Array, gravity: float, load: Array) -> Array:
    """Return the stiffness of the weight and of constant foot forces: d/dx (weight - J^T f).

    Moving the trunk along the ground or turning it about the vertical changes neither.

    Returns:
        Shape (N, N).
    """
    import pinocchio as pin

    size = robot.model.nv
    found = np.zeros((size, size))

    def unbalanced(step: Array) -> Array:
        at = pin.integrate(robot.model, q, step)
        forces = np.einsum("fn,f->n", _point_jacobians(robot, data, at)[:, 2], load)
        balance: Array = _weight(robot, data, at, gravity) - forces
        return balance

    for k in (2, 3, 4, *range(6, size)):
        step = np.zeros(size)
        step[k] = NUDGE
        found[:, k] = (unbalanced(step) - unbalanced(-step)) / (2.0 * NUDGE)
    return found
