"""Projection of positions and velocities onto the joints: the alternative to Baumgarte's terms.

Positions: the step delta of least kinetic energy norm with D delta = -Phi, repeated (Newton).
Velocities: the impulse D' mu that ends Phi' = 0. Both are the system of S1 eq. 1 with other right
sides, and cost one elimination each; both leave the momentum of a free system as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.motion import BodyState
from hexapod_pin.formulations.maximal.rotation import normalised, turned

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.model import MaximalModel

CLOSED = 1e-13
"""Largest |Phi| that counts as none [m, rad]."""

MOST = 8  # Newton steps


def project(model: MaximalModel, state: BodyState, *, closed: float = CLOSED) -> BodyState:
    """Return the nearest state whose joints are closed and do not open."""
    return project_velocities(model, project_positions(model, state, closed=closed))


def project_positions(
    model: MaximalModel, state: BodyState, *, closed: float = CLOSED
) -> BodyState:
    """Return the state with positions and attitudes moved until |Phi| <= `closed` [m, rad]."""
    state = BodyState(state.position, normalised(state.quaternion), state.velocity)
    for _ in range(MOST):
        at = model.place(state)
        joints, hold = model.constraints(state, at), model.mount_violation(state, at)
        if max(largest(joints.violation), largest(hold)) <= closed:
            break
        none = np.zeros_like(state.velocity)
        step, _, _ = model.eliminate(
            at.mass, none, model.rows(at, joints), -joints.violation, -hold
        )
        state = BodyState(
            state.position + step[:, :3], turned(state.quaternion, step[:, 3:]), state.velocity
        )
    return state


def project_velocities(model: MaximalModel, state: BodyState) -> BodyState:
    """Return the state with velocities that keep Phi."""
    at = model.place(state)
    joints = model.constraints(state, at)
    rows, none = model.rows(at, joints), np.zeros_like(state.velocity)
    hold = -(rows.mount @ state.velocity[0])
    change, _, _ = model.eliminate(at.mass, none, rows, -joints.rate, hold)
    return BodyState(state.position, state.quaternion, state.velocity + change)


def largest(values: Array) -> float:
    """Return the largest |value|; 0 of none."""
    return float(np.abs(values).max(initial=0.0))
