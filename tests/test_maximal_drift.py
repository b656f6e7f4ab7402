"""Joints in maximal coordinates that drift apart, and what brings them back."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from test_maximal_runs import flight, largest

import hexapod_pin as hp
from hexapod_pin.formulations import maximal
from hexapod_pin.formulations.maximal.run import configuration
from hexapod_pin.robot.rotations import rotations


def drifting(
    baumgarte: maximal.Baumgarte, projected: bool, step: float = 2e-3
) -> maximal.MaximalRun:
    """HC14b for 0.2 s by RK4."""
    model, q, v, _ = flight()
    model.baumgarte = baumgarte
    return maximal.integrate(
        model, maximal.initial_state(model, q, v), 0.2, step=step, projected=projected
    )


def test_joints_stay_closed_by_baumgarte_and_by_projection() -> None:
    """Constant terms hold the drift down; projection ends it.

    Terms of size 1/h do not go with RK4: its inner stages leave the joints open by O(h^2), which
    1/h^2 turns into accelerations of O(1). They are of order 2 then.
    """
    preset = maximal.Baumgarte
    off = drifting(preset.off(), False)
    assert drifting(preset.constant(), False).drift < 0.9 * off.drift
    assert drifting(preset.by_step(2e-3), False).drift > 100.0 * off.drift
    projected = drifting(preset.off(), True)
    assert projected.drift < 1e-12 and projected.drift_rate < 1e-12


def test_drift_falls_with_the_fourth_power_of_the_step() -> None:
    off = maximal.Baumgarte.off()
    coarse, fine = (drifting(off, False, step).drift for step in (4e-3, 2e-3))
    assert np.log2(coarse / fine) == pytest.approx(4.0, abs=0.5)


def test_violated_baumgarte_limit_blows_up() -> None:
    """Alpha = beta = 4/h is beyond RK4's 2.78/h."""
    with refused(hp.errors.DivergenceError, about=("finite",)):
        with np.errstate(all="ignore"):
            drifting(maximal.Baumgarte.critical(4.0 / 2e-3), False)


def test_projection_keeps_momentum_and_returns_to_the_joints() -> None:
    """A state opened by 1 mm: closed to 1e-13; momentum moves by rounding alone."""
    model, q, v, _ = flight()
    state, rng = maximal.initial_state(model, q, v), np.random.default_rng(4)
    opened = type(state)(
        state.position + 1e-3 * rng.normal(size=state.position.shape),
        state.quaternion,
        state.velocity + 0.1 * rng.normal(size=state.velocity.shape),
    )
    closed = maximal.project(model, opened)
    joints = model.constraints(closed, model.kinematics(closed))
    assert largest(joints.violation) < 1e-13 and largest(joints.rate) < 1e-12
    before, after = (maximal.energy(model, s) for s in (opened, closed))
    assert np.abs(after.momentum - before.momentum).max() < 1e-12
    assert np.abs(after.center_of_mass - before.center_of_mass).max() < 1e-9  # Newton's second step
    again = maximal.project(model, closed)
    assert largest(again.position - closed.position) < 1e-13


def test_times_that_do_not_fit_are_refused() -> None:
    model, q, v, _ = flight()
    start = maximal.initial_state(model, q, v)
    with refused(hp.errors.ParameterError, "sample or step", 0.3):
        maximal.integrate(model, start, 1.0, step=0.3)
    with refused(hp.errors.ParameterError, "duration", -1.0):
        maximal.integrate(model, start, -1.0)


def test_state_goes_round() -> None:
    """Base pose and joint angles to bodies and back, one joint beyond half a turn."""
    model, q, v, _ = flight()
    q[9] = 4.0
    state = maximal.initial_state(model, q, v)
    angles = state.memory.unwrapped(model.kinematics(state).angle)
    back = configuration(model.bodies, state, angles)
    assert back == pytest.approx(q, abs=1e-14)
    turn = rotations(state.quaternion[:1])[0]
    assert state.velocity[0, 3:] == pytest.approx(turn @ v[3:6], abs=1e-14)
