"""Whole runs: every robot, gait and contact set walks; momentum, symmetry, threads, restarts."""

from __future__ import annotations

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


def walk(robot: str, gait: str, contact: str, **kwargs) -> hp.Trace:
    """Ten seconds of walking at the paper's cycle time, 1 ms."""
    scene = hp.Scene(hp.load_robot(robot), contact=hp.Contact.preset(contact))
    plan = GAITS[gait](stroke=STROKE[robot], cycle_time=2.4)
    return hp.simulate(
        scene, hp.KinematicControl(plan), **{"duration": 10.0, "step": 1e-3, **kwargs}
    )


def steady(trace: hp.Trace) -> np.ndarray:
    """Mask of the whole cycles after the start-up transient."""
    time = trace.time
    return (time >= trace.run.walk.steady_from - 1e-9) & (
        time <= trace.run.walk.steady_until + 1e-9
    )


@pytest.mark.parametrize("gait", GAITS)
@pytest.mark.parametrize("robot", STROKE)
def test_every_robot_gait_and_contact_set_walks(robot: str, gait: str) -> None:
    """10 s at 1 ms: upright, at height, forward at the gait's speed, carrying its weight.

    Contact sets alternate: each meets every gait and both robots.
    """
    number = list(GAITS).index(gait) + list(STROKE).index(robot)
    trace = walk(robot, gait, ("s1", "s2")[number % 2])
    height = trace.q[0, 2]
    assert np.abs(trace.q[:, 2] - height).max() < 0.05 * height
    tilt = 2.0 * np.hypot(trace.q[:, 3], trace.q[:, 4])
    assert tilt.max() < np.radians(2.0)
    window = steady(trace)
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


def test_impulse_of_the_feet_is_the_change_of_momentum() -> None:
    """Newton's second law over a whole walk, all three axes, to the order of the step."""
    trace = walk("kharagpur", "tetrapod", "s1")
    robot = hp.load_robot("kharagpur")
    data = robot.model.createData()

    def momentum(k: int) -> np.ndarray:
        pin.centerOfMass(robot.model, data, trace.q[k], trace.v[k])
        return robot.total_mass * data.vcom[0]

    impulse = trace.foot_impulse.sum(axis=(0, 1))
    gravity = np.array([0.0, 0.0, -9.81]) * robot.total_mass * trace.time[-1]
    change = momentum(-1) - momentum(0)
    assert impulse + gravity == pytest.approx(change, abs=2e-3)  # of 303 N s


def test_refinement_shows_first_order() -> None:
    """A quarter of the step leaves at most 0.4 of the position error, against a 1/64 ms run."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4))

    def path(step: float) -> np.ndarray:
        return hp.simulate(scene, control, duration=1.0, step=step, sample=0.01).q[:, :3]

    truth = path(1e-3 / 64)
    errors = [np.abs(path(step) - truth).max() for step in (1e-3, 2.5e-4, 6.25e-5)]
    assert errors[0] < 5e-4
    assert errors[0] > 2.5 * errors[1] > 6.25 * errors[2]


def test_standing_still_stays_still() -> None:
    trace = hp.simulate(hp.Scene(hp.load_robot("athena")), hp.HoldPosture(), duration=3.0)
    assert trace.normal_force[-1].sum() == pytest.approx(8.25 * 9.81, rel=1e-5)
    assert np.abs(trace.v[-1]).max() < 1e-4  # 8e-6 is left of the settling after 3 s


def test_servo_torque_never_passes_the_effort_limit() -> None:
    """A robot too heavy for its servos sags; torques stay at the limit, and the run survives."""
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, gravity=(0.0, 0.0, -250.0))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=1.0, step=1e-3)
    assert np.abs(trace.torque).max() <= robot.effort_limit.max()
    assert np.abs(trace.torque).max() == pytest.approx(robot.effort_limit.max())
    assert trace.counters["solved_again"] > 0


@pytest.mark.parametrize("name", ["solo12", "anymal"])
def test_any_floating_base_with_named_feet_stands(name: str) -> None:
    """Quadrupeds of example-robot-data drop onto their feet and carry their weight."""
    robot = quadruped(name)
    effort = float(np.median(robot.effort_limit))
    scene = hp.Scene(robot, servo=hp.Servo(kp=20 * effort, kd=0.4 * effort, limited=False))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=2.0, sample=1e-3)
    weight = robot.total_mass * 9.81
    # what is left of the bounce after 1.5 s, averaged over 0.5 s
    assert trace.mean_foot_force[1500:, :, 2].sum(axis=1).mean() == pytest.approx(weight, rel=2e-3)
    assert trace.q[-1, 2] > 0.9 * trace.q[0, 2]


def quadruped(name: str) -> hp.Robot:
    """A four-legged robot from the data package's folder, standing with bent knees."""
    from pathlib import Path

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


def test_zero_duration_returns_the_initial_sample() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.0)
    assert trace.time.tolist() == [0.0]


def test_time_stamps_are_exact_multiples() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=1.0, sample=0.01)
    assert np.array_equal(trace.time, np.arange(101) * 10 * 1e-3)


def test_trace_carries_its_scene() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.01)
    assert trace.run.scene.contact == scene.contact
    assert any("servo gains" in line for line in trace.run.assumed)


@pytest.mark.parametrize(
    ("change", "name", "value", "allowed", "about"),
    [
        ({"step": 0.0}, "step", 0.0, (), ()),
        ({"step": float("nan")}, "simulate.step", float("nan"), (), ()),
        ({"duration": -1.0}, "duration", -1.0, (), ()),
        ({"step": 3e-4}, "duration/step", pytest.approx(1 / 3e-4), (1.0, 3e-4), ()),
        ({"step": 1e-3, "sample": 1.5e-3}, "sample/step", pytest.approx(1.5), (1.5e-3, 1e-3), ()),
        ({"sample": 1e-17}, "duration/sample", pytest.approx(1e17), (9.0072e15,), ()),
        ({"method": "euler"}, "method", "euler", (), ("extrapolated-euler", "robust")),
        ({"accuracy": 0.0}, "accuracy", 0.0, (1e-12, 0.1), ("'ndf'",)),
        ({"accuracy": float("nan")}, "simulate.accuracy", float("nan"), (), ()),
        ({"accuracy": 1e-4, "step": 1e-3}, "accuracy", 1e-4, (), ("'implicit-euler'",)),
        ({"accuracy": 1e-4, "method": "robust"}, "accuracy", 1e-4, (), ("'robust'",)),
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


@pytest.mark.parametrize("method", ["ndf", "extrapolated-euler", "dop853"])
def test_a_run_ends_at_its_duration_with_a_shorter_last_sample(method: str) -> None:
    """12.4444 s need no other sample: planned, by a controller at ticks, in a batch, continued."""
    scene, gait = hp.Scene(hp.load_robot("kharagpur")), hp.Gait.tripod(stroke=0.06)
    end, sample = 0.0744, 0.02
    settings = {"duration": end, "sample": sample, "method": method, "accuracy": 1e-6}
    case = hp.Case(scene, hp.KinematicControl(gait), **settings)
    trace = case.run()
    np.testing.assert_allclose(trace.time, [0.0, 0.02, 0.04, 0.06, end], rtol=1e-15)
    walk = hp.KinematicControl(gait)
    whole = hp.simulate(scene, walk, **{**settings, "sample": end / 4})
    np.testing.assert_allclose(trace.q[-1], whole.q[-1], atol=1e-6)
    np.testing.assert_array_equal(hp.simulate_batch([case, case])[1].q, trace.q)
    impulse = trace.foot_impulse[1:].sum(axis=(0, 1))
    np.testing.assert_allclose(impulse, whole.foot_impulse[1:].sum(axis=(0, 1)), atol=1e-4)
    feedback = hp.simulate(scene, hp.FootControl(walk), estimate=False, **settings)
    np.testing.assert_array_equal(feedback.time, trace.time)
    assert len(hp.simulate(scene, walk, **{**settings, "sample": 1.0}).time) == 2


def test_initial_state_must_fit() -> None:
    robot = hp.load_robot("kharagpur")
    state = vehicles.state(vehicles.hexa_ref(), 0.2)
    bad = hp.State(np.r_[state.q[:3], 0, 0, 0, 2.0, state.q[7:]], state.v)
    with refused(StateError, about=("q[3:7]", "2")):
        hp.simulate(hp.Scene(robot), hp.HoldPosture(), duration=0.1, initial=bad)


def test_divergence_keeps_the_good_samples_and_names_the_culprits() -> None:
    """Explicit steps far beyond the contact's time scale blow up; the trace up to then stays."""
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
    assert TimeGrid.fixed(10.0, 1e-3, None) == TimeGrid(1e-3, 10000, 1e-3, 1)
    assert TimeGrid.fixed(1.0, 1e-5, 0.01) == TimeGrid(0.01, 100, 1e-5, 1000)
