"""Motion within one contact phase to rounding: S2 eqs. 1-4 under DOP853, nothing regularised."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError
from hexapod_pin.formulations.rigid.contact_set import Grip
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.motion import motion_under

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import State
Torque = Callable[[float, Array, Array], Array]


def rigid_flow(
    model: RigidModel,
    start: State,
    duration: float,
    *,
    feet: Sequence[int] = (),
    torque: Torque | None = None,
    accuracy: float = 1e-12,
) -> State:
    """Return the state after a phase in which these feet stick and no other touches.

    Args:
        model: robot and ground.
        start: a state in which the feet are at rest.
        duration: [s].
        feet: indices of the feet that stick, whatever their forces; none is free flight.
        torque: servo torques (n,) of time, q and v; None: none.
        accuracy: relative error asked of DOP853 per step.

    Raises:
        DivergenceError: the integration failed.
    """
    from scipy.integrate import solve_ivp

    nq, none = model.model.nq, np.zeros(model.model.nv - 6)
    grip = Grip(tuple(feet))

    def rate(time: float, y: Array) -> Array:
        """Return the derivative of base position, quaternion, joints and velocities."""
        q, v = _unit(y[:nq]), y[nq:]
        tau = none if torque is None else torque(time, q, v)
        found = motion_under(model, model.terms(q, v), tau, grip).acceleration
        return np.concatenate([_configuration_rate(q, v), found])

    y0 = np.concatenate([start.q, start.v])
    found = solve_ivp(
        rate, (0.0, duration), y0, method="DOP853", rtol=accuracy, atol=1e-2 * accuracy
    )
    if not found.success:
        raise DivergenceError(f"the motion on {len(grip.feet)} feet failed: {found.message}", None)
    y = found.y[:, -1]
    return model.robot.check_state(_unit(y[:nq]), y[nq:])


def _unit(q: Array) -> Array:
    unit = q.copy()
    unit[3:7] /= np.linalg.norm(q[3:7])
    return unit


def _configuration_rate(q: Array, v: Array) -> Array:
    """Return q' (nq,) of a base twist in body axes and joint rates."""
    axis, w, spin = q[3:6], q[6], v[3:6]
    turn = np.append(0.5 * (w * spin + np.cross(axis, spin)), -0.5 * (axis @ spin))
    across = 2.0 * np.cross(axis, v[:3])
    move = v[:3] + w * across + np.cross(axis, across)
    return np.concatenate([move, turn, v[6:]])
