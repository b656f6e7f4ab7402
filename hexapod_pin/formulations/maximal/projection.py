"""Projection of positions and velocities onto the joints: the alternative to Baumgarte's terms.

Positions: the step delta of least kinetic energy norm with D delta = -Phi, repeated (Newton).
Velocities: the impulse D' mu that ends Phi' = 0. Both are the system of S1 eq. 1 with other right
sides, and cost one elimination each; both leave the momentum of a free system as it is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.rotation import turned

if TYPE_CHECKING:
    from hexapod_pin.formulations.maximal.model import MaximalModel
    from hexapod_pin.formulations.maximal.state import MaximalState

CLOSED_JOINT_M_RAD = 1e-13
"""Largest |Phi| of a closed joint [m, rad]."""

MAX_NEWTON_STEPS = 8
"""Newton steps on the positions."""


def project(model: MaximalModel, state: MaximalState) -> MaximalState:
    """Return the nearest state whose joints are closed and do not open."""
    return project_velocities(model, project_positions(model, state))


def project_positions(model: MaximalModel, state: MaximalState) -> MaximalState:
    """Return the state with positions and attitudes moved until its joints are closed."""
    state = state.with_unit_quaternions()
    for _ in range(MAX_NEWTON_STEPS):
        at = model.kinematics(state)
        d = model.constraints(state, at)
        if d.largest_violation <= CLOSED_JOINT_M_RAD:
            break
        none = np.zeros_like(state.velocity)
        step, _, _ = model.solve_kkt(at.mass, none, d, -d.violation, -d.root.violation)
        state = replace(
            state,
            position=state.position + step[:, :3],
            quaternion=turned(state.quaternion, step[:, 3:]),
        )
    return state


def project_velocities(model: MaximalModel, state: MaximalState) -> MaximalState:
    """Return the state with velocities that keep Phi."""
    at = model.kinematics(state)
    d = model.constraints(state, at)
    none = np.zeros_like(state.velocity)
    change, _, _ = model.solve_kkt(at.mass, none, d, -d.rate, -d.root.rate)
    return replace(state, velocity=state.velocity + change)
