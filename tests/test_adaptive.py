"""Adaptive methods: X3 against DOP853, which shares no Jacobian; held set-points; joint stops."""

from __future__ import annotations

import numpy as np
import pytest
import vehicles
from method_settings import GROUNDS, hc40

import hexapod_pin as hp
from hexapod_pin.arrays import Array


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf"])
def test_implicit_methods_and_dop853_end_alike(method: str) -> None:
    """HC40 mid at 1e-8: every position to 1e-7, every velocity to 1e-6 (its time scale: 0.03 s)."""
    trace = hc40("mid", method=method, accuracy=1e-8)
    truth = hc40("mid", method="dop853", accuracy=1e-10)
    np.testing.assert_allclose(trace.q[-1], truth.q[-1], atol=1e-7, rtol=0.0)
    np.testing.assert_allclose(trace.v[-1], truth.v[-1], atol=1e-6, rtol=0.0)


@pytest.mark.parametrize("kind", GROUNDS)
@pytest.mark.parametrize("accuracy", [1e-3, 1e-4, 1e-5])
def test_x3_meets_its_accuracy(kind: str, accuracy: float) -> None:
    """HC40: the error against 1e-7, and below it the estimate that the trace gives."""
    truth, trace = hc40(kind, accuracy=1e-7), hc40(kind, accuracy=accuracy)
    error = np.abs(trace.q[-1] - truth.q[-1]).max()
    assert error < accuracy
    assert error < trace.error_estimate + 1e-7


@pytest.mark.parametrize("kind", GROUNDS)
def test_looser_never_costs_more(kind: str) -> None:
    """Of single runs; with control of the error from 1e-4 on: looser first runs are equal."""
    single = [
        hc40(kind, accuracy=a, estimate=False).counters["evaluations"]
        for a in (1e-2, 1e-3, 1e-4, 1e-5)
    ]
    kept = [hc40(kind, accuracy=a).counters["evaluations_of_all_runs"] for a in (1e-4, 1e-5, 1e-6)]
    for costs in (single, kept):
        for looser, tighter in zip(costs, costs[1:], strict=False):
            assert looser <= 1.2 * tighter


def test_samples_do_not_change_a_single_run() -> None:
    """Steps pass over samples, which are interpolated: the same bits, works and impulses.

    Sums of ten samples' impulses are rounded: they are of up to 0.4 N s.
    """
    fine, coarse = (
        hc40("mid", method="extrapolated-euler", accuracy=1e-5, estimate=False, sample=sample)
        for sample in (1e-3, 1e-2)
    )
    assert fine.counters["steps"] == coarse.counters["steps"]
    assert np.array_equal(fine.q[::10], coarse.q) and np.array_equal(fine.v[::10], coarse.v)
    assert np.array_equal(fine.foot_force[::10], coarse.foot_force)
    for name, energy in coarse.energy.items():
        np.testing.assert_allclose(fine.energy[name][::10], energy, rtol=0.0, atol=1e-13)
    parts = fine.foot_impulse[1:].reshape(25, 10, 6, 3).sum(axis=1)
    np.testing.assert_allclose(parts, coarse.foot_impulse[1:], rtol=0.0, atol=1e-14)


def swinging_link(accuracy: float) -> hp.Trace:
    """A link of 2e-3 kg m^2 on a servo of 2 N m/rad and 0.01 N m s, in empty space; 1 ms."""
    robot = vehicles.heavy_leg(upper=1.0)
    servo = hp.Servo(kp=2.0, kd=0.01, limited=False)
    scene = hp.Scene(robot, servo=servo, stops=vehicles.FREE, gravity=(0.0, 0.0, 0.0))
    q = robot.stand().q.copy()
    q[2], q[-1] = q[2] + 10.0, 0.3
    start = robot.check_state(q, np.zeros(robot.model.nv))
    return hp.simulate(
        scene, hp.HoldPosture(np.zeros(3)), duration=0.5, sample=1e-3, initial=start,
        method="extrapolated-euler", accuracy=accuracy, estimate=False,
    )  # fmt: skip


def test_samples_between_steps_have_the_order_of_the_method() -> None:
    """A damped oscillation, whose exact solution is known, at samples shorter than the steps.

    The largest error of a sample is at most 1.5 times the accuracy, and falls with the third power
    of the step. That of velocities is the same times the frequency, 32 1/s.
    """
    decay, frequency = 2.5, np.sqrt(1000.0 - 2.5**2)
    errors, steps = [], []
    for accuracy in (1e-5, 1e-6):
        run = swinging_link(accuracy)
        t, damped = run.time, 0.3 * np.exp(-decay * run.time)
        sine, cosine = np.sin(frequency * t), np.cos(frequency * t)
        angle = damped * (cosine + decay / frequency * sine)
        rate = -damped * 1000.0 / frequency * sine
        errors.append(np.abs(run.q[:, -1] - angle).max())
        assert errors[-1] < 1.5 * accuracy
        assert np.abs(run.v[:, -1] - rate).max() < 1.5 * 32.0 * accuracy
        assert np.abs(run.energy_residual).max() < accuracy  # of 0.09 J
        steps.append(run.counters["steps"])
    assert steps[0] < 300  # of 500 samples
    order = np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0])
    assert order == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize("preset", ["accurate", "s1", "s2"])
def test_samples_between_steps_agree_with_steps_that_end_there(preset: str) -> None:
    """A walk through touch-downs and slips on each law, bristles included, at 1e-5.

    The steps of runs whose error is kept end at samples. Servos make a torque of an error of the
    accuracy, and of a velocity that is off by as much in 0.03 s, by which errors of it are weighed;
    works are off by no more than the accuracy at the weight of the robot, 21 N.
    """
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.preset(preset))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=0.4))
    settings = dict(method="extrapolated-euler", duration=0.6, sample=2e-3)
    dense = hp.simulate(scene, control, accuracy=1e-5, estimate=False, **settings)
    ended = hp.simulate(scene, control, accuracy=1e-6, **settings)
    assert dense.counters["steps"] < ended.counters["steps"]
    assert np.abs(dense.q - ended.q).max() < 1e-5
    servo = scene.servos
    assert np.abs(dense.torque - ended.torque).max() < 1e-5 * (servo.kp + servo.kd / 0.03)
    assert np.abs(dense.energy_residual).max() < 1e-5 * 21.0


def test_touch_downs_are_ends_of_steps() -> None:
    """HC40 mid: six feet land one after the other; each landing is located."""
    assert hc40("mid", accuracy=1e-4).counters["events"] >= 6


def pendulum_on_a_stop(rate: float, stops: hp.JointStops, **settings) -> hp.Trace:
    """A light link flies to the upper limit of its joint, in empty space."""
    robot = vehicles.heavy_leg(upper=0.5)
    scene = hp.Scene(robot, servo=vehicles.LIMP, stops=stops, gravity=(0.0, 0.0, 0.0))
    v = np.zeros(robot.model.nv)
    v[-1] = rate
    q = robot.stand().q.copy()
    q[2] += 10.0  # far above the ground
    start = robot.check_state(q, v)
    return hp.simulate(
        scene, hp.HoldPosture(), duration=0.5, sample=0.01, initial=start, **settings
    )


@pytest.mark.parametrize(
    "how",
    [{"accuracy": 1e-7}, {"method": "dop853", "accuracy": 1e-9}, {"method": "rk4", "step": 1e-4}],
)
def test_a_stop_without_dissipation_gives_the_speed_back(how: dict) -> None:
    """It turns the joint round, at the depth where the spring holds the kinetic energy."""
    trace = pendulum_on_a_stop(2.0, hp.JointStops(stiffness=200.0), **how)
    assert trace.v[-1, -1] == pytest.approx(-2.0, rel=1e-5)
    assert np.abs(trace.energy_residual).max() < 1e-6 * trace.energy["kinetic"][0]
    free = pendulum_on_a_stop(2.0, vehicles.FREE, **how)
    assert free.v[-1, -1] == pytest.approx(2.0, rel=1e-9)


def test_a_dissipative_stop_takes_the_restitution_of_hunt_and_crossley() -> None:
    """With eta = 1.5 a v0, e solves ln((1 + eta)/(1 - eta e)) = eta (1 + e), as in any contact."""
    from scipy.optimize import brentq

    eta = 0.9
    stops = hp.JointStops(stiffness=200.0, dissipation=eta / (1.5 * 2.0))
    trace = pendulum_on_a_stop(2.0, stops, method="dop853", accuracy=1e-10)
    e = brentq(lambda e: np.log((1 + eta) / (1 - eta * e)) - eta * (1 + e), 0.1, 0.99)
    assert -trace.v[-1, -1] / 2.0 == pytest.approx(e, rel=1e-5)
    assert trace.energy["joint_damping_loss"][-1] == pytest.approx(
        trace.energy["kinetic"][0] * (1 - e * e), rel=1e-4
    )


def test_held_set_points_jump_at_their_times() -> None:
    """The set-point of a tick holds until the next; the trace shows them, to the sample."""
    robot = hp.load_robot("kharagpur")
    high, low = robot.posture, robot.posture + 0.05
    control = hp.motion.SampledTrajectory([0.0, 0.1], [high, low], limited=False)
    trace = hp.simulate(hp.Scene(robot), control, duration=0.2, sample=0.05)
    expected = [high[0], high[0], low[0], low[0], low[0]]
    assert trace.q_ref[:, 0].tolist() == pytest.approx(expected, abs=0.0)
    assert np.abs(trace.v_ref).max() == 0.0


@pytest.mark.parametrize("preset", ["accurate", "s1", "s2"])
def test_a_walk_agrees_with_the_explicit_method(preset: str) -> None:
    """Kharagpur's tripod over two touch-downs: X3 at 1e-5 against DOP853, which has no Jacobian."""
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.preset(preset))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=0.4))
    found = hp.simulate(scene, control, duration=0.25, accuracy=1e-5, sample=0.01)
    truth = hp.simulate(scene, control, duration=0.25, method="dop853", accuracy=1e-8, sample=0.01)
    error = np.abs(found.q - truth.q).max()
    assert error < 1e-5
    assert error < found.error_estimate


@pytest.mark.parametrize("height", [0.003, 0.005, 0.007])
def test_touch_speed_does_not_depend_on_the_step(height: float) -> None:
    """Restitution takes the speed at the surface, however short the step behind it (six feet)."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    state = scene.robot.stand()
    q = state.q.copy()
    q[2] += height

    def fallen(method: str, accuracy: float) -> Array:
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.08, sample=0.02, method=method, accuracy=accuracy,
            initial=scene.robot.check_state(q, state.v),
        )  # fmt: skip
        return trace.q

    exact = fallen("dop853", 1e-10)
    assert np.abs(fallen("dop853", 1e-12) - exact).max() < 1e-10  # a step too late: 1e-7
    assert np.abs(fallen("ndf", 1e-9) - exact).max() < 1e-9  # 9e-9


def test_a_walk_costs_little() -> None:
    """Set-points jump every 10 ms: a step after a jump is as long as that after the one before.

    Found anew at every jump, 2.4 tries of four steps were given up; 0.13 of a step are now. The
    evaluations of all runs stand over the 8154 of a single run without control of the error.
    """
    from hexapod_pin.benchmark.work_precision import scenes

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
