"""Whole runs: every robot, gait and contact set walks; settings, refusals, early ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, ParameterError, SimulationInterrupted, StateError
from hexapod_pin.simulation.run_settings import TimeGrid

GAITS = {
    "tripod": hp.Gait.tripod,
    "ripple": hp.Gait.ripple,
    "tetrapod": hp.Gait.tetrapod,
    "wave23": lambda **kw: hp.Gait.wave(2 / 3, **kw),
    "wave34": lambda **kw: hp.Gait.wave(3 / 4, **kw),
    "wave56": lambda **kw: hp.Gait.wave(5 / 6, **kw),
}
STROKE = {"kharagpur": 0.14, "athena": 0.10}


@pytest.mark.parametrize("gait", GAITS)
@pytest.mark.parametrize("robot", STROKE)
def test_every_robot_gait_and_contact_set_walks(robot: str, gait: str) -> None:
    """10 s at 1 ms; contact sets alternate: each meets every gait and both robots."""
    number = list(GAITS).index(gait) + list(STROKE).index(robot)
    contact = hp.Contact.preset(("s1", "s2")[number % 2])
    control = hp.KinematicControl(GAITS[gait](stroke=STROKE[robot], cycle_time=2.4))
    scene = hp.Scene(hp.load_robot(robot), contact=contact)
    trace = hp.simulate(scene, control, duration=10.0, step=1e-3)
    height = trace.q[0, 2]
    assert np.abs(trace.q[:, 2] - height).max() < 0.05 * height
    tilt = 2.0 * np.hypot(trace.q[:, 3], trace.q[:, 4])
    assert tilt.max() < np.radians(2.0)
    window = trace.time >= trace.run.walk.steady_from - 1e-9
    window &= trace.time <= trace.run.walk.steady_until + 1e-9
    time, position = trace.time[window], trace.q[window, :2]
    cycles = (time[-1] - time[0]) / 2.4
    assert cycles == pytest.approx(round(cycles), abs=1e-9) and cycles >= 2.0 - 1e-9
    speed = (position[-1, 0] - position[0, 0]) / (time[-1] - time[0])
    # the servos' compliance takes up to 2.2 % (0.1 % at eight times their stiffness)
    assert speed == pytest.approx(trace.run.walk.nominal_speed, rel=0.03)
    assert abs(position[-1, 1] - position[0, 1]) < 5e-3
    mean = trace.mean_foot_force[window][1:, :, 2].sum(axis=1).mean()
    weight = trace.run.robot.total_mass * 9.81
    assert mean == pytest.approx(weight, rel=1e-3)
    # Newton's second law over the whole walk [N s]
    model, data = scene.robot.model, scene.robot.model.createData()
    start, end = (
        pin.computeCentroidalMomentum(model, data, trace.q[k], trace.v[k]).linear.copy()
        for k in (0, -1)
    )
    impulse = trace.foot_impulse.sum(axis=(0, 1)) - [0.0, 0.0, weight * trace.time[-1]]
    assert impulse == pytest.approx(end - start, abs=2e-3)


def test_standing_still_stays_still() -> None:
    trace = hp.simulate(hp.Scene(hp.load_robot("athena")), hp.HoldPosture(), duration=3.0)
    assert trace.normal_force[-1].sum() == pytest.approx(8.25 * 9.81, rel=1e-5)
    assert np.abs(trace.v[-1]).max() < 1e-4  # 8e-6 is left of the settling after 3 s


def test_servo_torque_never_passes_the_effort_limit() -> None:
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, gravity=(0.0, 0.0, -250.0))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=1.0, step=1e-3)
    assert np.abs(trace.torque).max() <= robot.effort_limit.max()
    assert np.abs(trace.torque).max() == pytest.approx(robot.effort_limit.max())
    assert trace.counters["solved_again"] > 0


@pytest.mark.parametrize("name", ["solo12", "anymal"])
def test_any_floating_base_with_named_feet_stands(name: str) -> None:
    robot = quadruped(name)
    effort = float(np.median(robot.effort_limit))
    scene = hp.Scene(robot, servo=hp.Servo(kp=20 * effort, kd=0.4 * effort, limited=False))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=2.0, sample=1e-3)
    weight = robot.total_mass * 9.81
    # what is left of the bounce after 1.5 s, averaged over 0.5 s
    assert trace.mean_foot_force[1500:, :, 2].sum(axis=1).mean() == pytest.approx(weight, rel=2e-3)
    assert trace.q[-1, 2] > 0.9 * trace.q[0, 2]


def quadruped(name: str) -> hp.Robot:
    robots = Path(pin.__file__).parents[4] / "share" / "example-robot-data" / "robots"
    if name == "solo12":
        feet = ["FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"]
        path = robots / "solo_description" / "robots" / "solo12.urdf"
        bend = (0.0, 0.8, -1.6)
        return hp.load_robot(path, feet=feet, posture=bend * 4, foot_radius=0.016)
    feet = ["LF_FOOT", "LH_FOOT", "RF_FOOT", "RH_FOOT"]
    path = robots / "anymal_b_simple_description" / "robots" / "anymal.urdf"
    bend = [(side, fore * 0.7, -fore * 1.0) for side in (-0.1, 0.1) for fore in (1.0, -1.0)]
    return hp.load_robot(path, feet=feet, posture=np.ravel(bend), foot_radius=0.03)


@pytest.mark.parametrize(
    ("change", "name", "value", "allowed", "about"),
    [
        ({"duration": -1.0}, "duration", -1.0, (), ()),
        ({"step": 3e-4}, "duration/step", pytest.approx(1 / 3e-4), (1.0, 3e-4), ()),
        ({"step": 1e-3, "sample": 1.5e-3}, "sample/step", pytest.approx(1.5), (1.5e-3, 1e-3), ()),
        ({"sample": 1e-17}, "duration/sample", pytest.approx(1e17), (9.0072e15,), ()),
        ({"method": "euler"}, "method", "euler", (), ("extrapolated-euler", "robust")),
        ({"accuracy": 0.0}, "accuracy", 0.0, (1e-12, 0.1), ("'ndf'",)),
        ({"accuracy": 1e-4, "step": 1e-3}, "accuracy", 1e-4, (), ("'implicit-euler'",)),
        ({"method": "extrapolated-euler", "step": 1e-3}, "step", 1e-3, (), ("extrapolated-euler",)),
        ({"method": "x3", "accuracy": 1e-9}, "accuracy", 1e-9, (1e-8,), ("extrapolated-euler",)),
    ],
)
def test_bad_run_settings_are_refused_by_name(
    change: dict, name: str, value: object, allowed: tuple, about: tuple
) -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    with refused(ParameterError, name, value, allowed=allowed, about=about):
        hp.simulate(scene, hp.HoldPosture(), **{"duration": 1.0, **change})


def test_a_run_ends_at_its_duration_with_a_shorter_last_sample() -> None:
    scene, walk = hp.Scene(hp.load_robot("kharagpur")), hp.KinematicControl(hp.Gait.tripod())
    end = 0.0744
    case = hp.Case(scene, walk, duration=end, sample=0.02, accuracy=1e-6)
    trace = case.run()
    np.testing.assert_allclose(trace.time, [0.0, 0.02, 0.04, 0.06, end], rtol=1e-15)
    whole = hp.simulate(scene, walk, duration=end, sample=end / 4, accuracy=1e-6)
    np.testing.assert_allclose(trace.q[-1], whole.q[-1], atol=1e-6)
    np.testing.assert_array_equal(hp.simulate_batch([case, case])[1].q, trace.q)
    impulse = trace.foot_impulse[1:].sum(axis=(0, 1))
    np.testing.assert_allclose(impulse, whole.foot_impulse[1:].sum(axis=(0, 1)), atol=1e-4)
    feedback = hp.simulate(scene, hp.FootControl(walk), duration=end, sample=0.02)
    np.testing.assert_array_equal(feedback.time, trace.time)


def test_initial_state_must_fit() -> None:
    robot = hp.load_robot("kharagpur")
    state = vehicles.state(vehicles.hexa_ref(), 0.2)
    bad = hp.State(np.r_[state.q[:3], 0, 0, 0, 2.0, state.q[7:]], state.v)
    with refused(StateError, about=("q[3:7]", "2")):
        hp.simulate(hp.Scene(robot), hp.HoldPosture(), duration=0.1, initial=bad)


def test_divergence_keeps_the_good_samples_and_names_the_culprits() -> None:
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, contact=hp.Contact.s2())
    with refused(DivergenceError) as caught:
        hp.simulate(scene, hp.HoldPosture(), duration=1.0, method="rk4", step=5e-3)
    trace = caught.value.trace
    joint = robot.joint_names[int(np.abs(trace.v[-1, 6:]).argmax())]
    foot = trace.foot_names[int(np.linalg.norm(trace.foot_force[-1], axis=1).argmax())]
    assert f"joint {joint}" in str(caught.value) and f"foot {foot}" in str(caught.value)
    assert np.isfinite(trace.q).all() and trace.time[-1] < 1.0


def test_interrupt_keeps_what_was_done() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))

    def press(fraction: float) -> None:
        if fraction > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(SimulationInterrupted) as caught:
        hp.simulate(scene, hp.HoldPosture(), duration=10.0, progress=press)
    assert 3.0 < caught.value.trace.time[-1] < 10.0


def test_grid_counts_steps_and_samples() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    for duration, count in ((0.0, 1), (1.0, 101)):
        trace = hp.simulate(scene, hp.HoldPosture(), duration=duration, sample=0.01)
        assert np.array_equal(trace.time, np.arange(count) * 10 * 1e-3)
    assert TimeGrid.fixed(10.0, 1e-3, None) == TimeGrid(1e-3, 10000, 1e-3, 1)
    assert TimeGrid.fixed(1.0, 1e-5, 0.01) == TimeGrid(0.01, 100, 1e-5, 1000)
