"""Adaptive methods: the accuracy they keep, samples between steps, joint stops, costs."""

from __future__ import annotations

import numpy as np
import pytest
import vehicles
from method_settings import GROUNDS, hc40
from scipy.optimize import brentq

import hexapod_pin as hp
from hexapod_pin.benchmark.work_precision import scenes


@pytest.mark.parametrize("kind", GROUNDS)
@pytest.mark.parametrize("accuracy", [1e-3, 1e-5])
def test_x3_meets_its_accuracy(kind: str, accuracy: float) -> None:
    truth, trace = hc40(kind, accuracy=1e-7), hc40(kind, accuracy=accuracy)
    error = np.abs(trace.q[-1] - truth.q[-1]).max()
    assert error < accuracy
    assert error < trace.error_estimate + 1e-7


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf"])
def test_samples_do_not_change_a_single_run(method: str) -> None:
    fine, coarse = (
        hc40("mid", method=method, accuracy=1e-5, estimate=False, sample=sample)
        for sample in (1e-3, 1e-2)
    )
    assert fine.counters["steps"] == coarse.counters["steps"]
    assert np.array_equal(fine.q[::10], coarse.q) and np.array_equal(fine.v[::10], coarse.v)
    assert np.array_equal(fine.foot_force[::10], coarse.foot_force)
    for name, energy in coarse.energy.items():
        np.testing.assert_allclose(fine.energy[name][::10], energy, rtol=0.0, atol=1e-13)
    parts = fine.foot_impulse[1:].reshape(25, 10, 6, 3).sum(axis=1)
    np.testing.assert_allclose(parts, coarse.foot_impulse[1:], rtol=0.0, atol=1e-14)


def swinging_link(**settings: float | str) -> hp.Trace:
    """A link of 2e-3 kg m^2 on a servo of 2 N m/rad and 0.01 N m s, in empty space; 1 ms."""
    robot = vehicles.heavy_leg(upper=1.0)
    servo = hp.Servo(kp=2.0, kd=0.01, limited=False)
    scene = hp.Scene(robot, servo=servo, stops=vehicles.FREE, gravity=(0.0, 0.0, 0.0))
    q = robot.stand().q.copy()
    q[2], q[-1] = q[2] + 10.0, 0.3
    start = robot.check_state(q, np.zeros(robot.model.nv))
    return hp.simulate(
        scene, hp.HoldPosture(np.zeros(3)), duration=0.5, sample=1e-3, initial=start, **settings
    )


def exact_angle(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angle and rate of the damped oscillation."""
    decay, frequency = 2.5, np.sqrt(1000.0 - 2.5**2)
    damped, phase = 0.3 * np.exp(-decay * t), frequency * t
    angle = damped * (np.cos(phase) + decay / frequency * np.sin(phase))
    return angle, -damped * 1000.0 / frequency * np.sin(phase)


@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("implicit-euler", 1), ("robust", 1)])
def test_a_method_of_fixed_steps_converges_at_its_order(method: str, order: int) -> None:
    errors = []
    for step in (1e-3, 5e-4):
        run = swinging_link(method=method, step=step)
        errors.append(np.abs(run.q[:, -1] - exact_angle(run.time)[0]).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


def test_samples_between_steps_have_the_order_of_the_method() -> None:
    """A damped oscillation, whose exact solution is known, at samples shorter than the steps."""
    errors, steps = [], []
    for accuracy in (1e-5, 1e-6):
        run = swinging_link(method="extrapolated-euler", accuracy=accuracy, estimate=False)
        angle, rate = exact_angle(run.time)
        errors.append(np.abs(run.q[:, -1] - angle).max())
        assert errors[-1] < 1.5 * accuracy
        assert np.abs(run.v[:, -1] - rate).max() < 1.5 * 32.0 * accuracy
        assert np.abs(run.energy_residual).max() < accuracy  # of 0.09 J
        steps.append(run.counters["steps"])
    assert steps[0] < 300  # of 500 samples
    order = np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0])
    assert order == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize("how", [{"accuracy": 1e-7}, {"method": "dop853", "accuracy": 1e-10}])
def test_a_dissipative_stop_takes_the_restitution_of_hunt_and_crossley(how: dict) -> None:
    """With eta = 1.5 a v0, e solves ln((1 + eta)/(1 - eta e)) = eta (1 + e), as in any contact."""
    eta, robot = 0.9, vehicles.heavy_leg(upper=0.5)
    stops = hp.JointStops(stiffness=200.0, dissipation=eta / (1.5 * 2.0))
    scene = hp.Scene(robot, servo=vehicles.LIMP, stops=stops, gravity=(0.0, 0.0, 0.0))
    q, v = robot.stand().q.copy(), np.zeros(robot.model.nv)
    q[2], v[-1] = 10.0, 2.0  # far above the ground
    start = robot.check_state(q, v)
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.5, sample=0.01, initial=start, **how)
    e = brentq(lambda e: np.log((1 + eta) / (1 - eta * e)) - eta * (1 + e), 0.1, 0.99)
    assert -trace.v[-1, -1] / 2.0 == pytest.approx(e, rel=1e-5)
    kinetic = trace.energy["kinetic"][0]
    assert trace.energy["joint_damping_loss"][-1] == pytest.approx(kinetic * (1 - e * e), rel=1e-4)
    assert np.abs(trace.energy_residual).max() < 1e-6 * kinetic


def test_a_walk_costs_little() -> None:
    """Set-points jump every 10 ms: a step after a jump is as long as that after the one before."""

    def run(duration: float, **how) -> hp.Trace:
        walk = scenes.walk(duration)
        return hp.simulate(
            walk.scene, walk.controller, duration=duration, sample=walk.sample,
            initial=walk.initial, accuracy=1e-4, **how,
        )  # fmt: skip

    counters, kept = run(0.5, estimate=False).counters, run(1.0)
    assert counters["steps"] > 300
    assert counters["rejected"] < 0.18 * counters["steps"]
    assert kept.accuracy_kept
    assert kept.counters["evaluations_of_all_runs"] < 1.25 * 8154
