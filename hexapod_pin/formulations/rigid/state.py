"""State of the rigid formulation: q = [base pose, joint angles], v = [base twist, joint rates].

S2's appendix writes the equations for these coordinates; they are those of `hexapod_pin.State`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.rigid.model import RigidModel
    from hexapod_pin.robot.robot import State


def initial_state(model: RigidModel, q: ArrayLike, v: ArrayLike) -> State:
    """Return the checked state of a base pose, joint angles and velocities.

    Args:
        model: robot and ground.
        q: base origin in the world [m], quaternion x, y, z, w, joint angles [rad]. Shape (nq,).
        v: base velocity in base axes [m/s, rad/s], joint rates [rad/s]. Shape (nv,).

    Raises:
        StateError: wrong shape, a value that is not finite, or a quaternion off unit length.
    """
    return model.robot.check_state(q, v)


def standing_state(model: RigidModel, angles: Array | None = None) -> State:
    """Return the robot at rest, standing with these joint angles (n,) [rad] or its posture.

    Raises:
        ParameterError: the ground is not level at z = 0.
    """
    ground = model.ground
    if ground.normal != (0.0, 0.0, 1.0) or ground.point[2] != 0.0:
        raise ParameterError("initial", None, "given where the ground is not level at z = 0")
    return model.robot.stand(angles)


def configuration_rate(q: Array, v: Array) -> Array:
    """Return q' (nq,) of a base twist in body axes and joint rates v (nv,)."""
    axis, w, spin = q[3:6], q[6], v[3:6]
    turn = np.append(0.5 * (w * spin + np.cross(axis, spin)), -0.5 * (axis @ spin))
    across = 2.0 * np.cross(axis, v[:3])
    move = v[:3] + w * across + np.cross(axis, across)
    return np.concatenate([move, turn, v[6:]])


def with_unit_quaternion(q: Array) -> Array:
    """Return q (nq,) with its quaternion scaled to unit length."""
    unit = q.copy()
    unit[3:7] /= np.linalg.norm(q[3:7])
    return unit
