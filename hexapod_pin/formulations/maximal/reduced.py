"""What bodies do, said in base pose and joint angles again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.motion import BodyState


def configuration(bodies: Bodies, state: BodyState, angles: Array) -> Array:
    """Return (7 + nj,): root link's origin [m], quaternion x, y, z, w, joint angles [rad]."""
    turn = rotations(state.quaternion[:1])[0]
    origin = state.position[0] + turn @ bodies.root_origin
    return np.concatenate([origin, state.quaternion[0], angles])


def velocity(bodies: Bodies, state: BodyState) -> Array:
    """Return (6 + nj,): root link's velocity in its own axes [m/s], [rad/s]; joint rates."""
    turn = rotations(state.quaternion[:1])[0]
    linear, spin = state.velocity[0, :3], state.velocity[0, 3:]
    at_origin = linear + np.cross(spin, turn @ bodies.root_origin)
    return np.concatenate(
        [turn.T @ at_origin, turn.T @ spin, _along_axes(bodies, state, state.velocity)]
    )


def acceleration(bodies: Bodies, state: BodyState, rates: Array) -> Array:
    """Return (6 + nj,): the time derivative of `velocity` for body accelerations (nb, 6).

    The root link's part is the derivative of its components in its own, turning axes.
    """
    turn = rotations(state.quaternion[:1])[0]
    arm, spin = turn @ bodies.root_origin, state.velocity[0, 3:]
    at_origin = rates[0, :3] + np.cross(rates[0, 3:], arm) + np.cross(spin, np.cross(spin, arm))
    at_origin -= np.cross(spin, state.velocity[0, :3] + np.cross(spin, arm))
    return np.concatenate(
        [turn.T @ at_origin, turn.T @ rates[0, 3:], _along_axes(bodies, state, rates)]
    )


def _along_axes(bodies: Bodies, state: BodyState, six: Array) -> Array:
    """Return the difference of the angular parts across each joint, along its axis (nj,)."""
    if not len(bodies.parent):
        return np.empty(0)
    axis = np.einsum("nij,nj->ni", rotations(state.quaternion[1:]), bodies.axis)
    across = six[1:, 3:] - six[bodies.parent, 3:]
    return np.asarray(np.einsum("ni,ni->n", axis, across))
