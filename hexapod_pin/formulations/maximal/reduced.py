"""Motion of the bodies in the robot's coordinates again: base pose, joint angles, their rates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.state import MaximalState


def configuration(bodies: Bodies, state: MaximalState, angles: Array) -> Array:
    """Return (7 + nj,): root link's origin [m], quaternion x, y, z, w, joint angles [rad]."""
    rotation = rotations(state.quaternion[:1])[0]
    origin = state.position[0] + rotation @ bodies.root_origin
    return np.concatenate([origin, state.quaternion[0], angles])


def velocity(bodies: Bodies, state: MaximalState) -> Array:
    """Return (6 + nj,): root link's velocity in its own axes [m/s], [rad/s]; joint rates."""
    rotation = rotations(state.quaternion[:1])[0]
    linear, spin = state.velocity[0, :3], state.velocity[0, 3:]
    at_origin = linear + np.cross(spin, rotation @ bodies.root_origin)
    joints = _along_axes(bodies, state, state.velocity)
    return np.concatenate([rotation.T @ at_origin, rotation.T @ spin, joints])


def reduced_acceleration(bodies: Bodies, state: MaximalState, rates: Array) -> Array:
    """Return (6 + nj,): the time derivative of `velocity` for body accelerations (nb, 6).

    The root link's part is the derivative of its components in its own, turning axes.
    """
    rotation = rotations(state.quaternion[:1])[0]
    arm, spin = rotation @ bodies.root_origin, state.velocity[0, 3:]
    at_origin = rates[0, :3] + np.cross(rates[0, 3:], arm) + np.cross(spin, np.cross(spin, arm))
    at_origin -= np.cross(spin, state.velocity[0, :3] + np.cross(spin, arm))
    joints = _along_axes(bodies, state, rates)
    return np.concatenate([rotation.T @ at_origin, rotation.T @ rates[0, 3:], joints])


def _along_axes(bodies: Bodies, state: MaximalState, six: Array) -> Array:
    """Return the difference of the angular parts across each joint, along its axis (nj,)."""
    if not len(bodies.parent):
        return np.empty(0)
    axis = np.einsum("nij,nj->ni", rotations(state.quaternion[1:]), bodies.axis)
    across = six[1:, 3:] - six[bodies.parent, 3:]
    return np.asarray(np.einsum("ni,ni->n", axis, across))
