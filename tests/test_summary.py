"""Summaries and sampled channels of runs: against samples, other solvers, the budget, files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.errors import NotRecordedError, ParameterError, TraceFileError
from hexapod_pin.results.schema import schema
from hexapod_pin.simulation.plant import native_acceleration

CYCLE = 0.8
SCENE = hp.Scene(hp.load_robot("kharagpur"))
WALK = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE, turn_rate=0.1))


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    """Fixed steps of 1 ms, all of them sampled: samples are the accepted states."""
    settings = dict(method="implicit-euler", step=1e-3, sample=1e-3)
    return hp.simulate(SCENE, WALK, duration=3.5, **settings)


def test_a_summary_agrees_with_samples_at_every_accepted_step(trace: hp.Trace) -> None:
    """Peaks to the bit; trapezoids to the two ends of the window, which samples hit."""
    summary = trace.summary
    assert summary.cycles == 2 and summary.states == len(trace.time)
    inside = slice(*(int(round(t / 1e-3)) for t in (summary.start, summary.end + 1e-3)))
    time, torque = trace.time[inside], trace.torque[inside]
    rate, power = trace.v[inside, 6:], torque * trace.v[inside, 6:]
    columns = np.arange(18)
    for name, values in (("torque", torque), ("speed", rate), ("power", power)):
        at = np.abs(values).argmax(axis=0)
        assert np.array_equal(getattr(summary, f"{name}_peak"), values[at, columns]), name
        assert np.array_equal(getattr(summary, f"{name}_peak_time"), time[at]), name
    assert summary.torque_rms == pytest.approx(rms(time, torque), rel=1e-9)
    assert summary.speed_rms == pytest.approx(rms(time, rate), rel=1e-9)
    for name, sign in (("positive_energy", 1.0), ("negative_energy", -1.0)):
        work = sign * np.trapezoid(np.maximum(sign * power, 0.0), time, axis=0) / 2
        assert getattr(summary, name) == pytest.approx(work, rel=1e-9, abs=1e-12)
    low, high = np.percentile(np.abs(torque), [98.9, 99.1], axis=0)  # two of 1601 samples apart
    assert (summary.torque_p99 >= 0.99 * low).all() and (summary.torque_p99 <= 1.01 * high).all()
    assert np.array_equal(summary.angle_max, trace.q[inside, 7:].max(axis=0))


def rms(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.trapezoid(values**2, time, axis=0) / (time[-1] - time[0]))


def test_friction_work_is_what_sliding_takes_from_the_robot() -> None:
    """A robot slides to rest on still legs: v = v0 - mu g t, and what is left of m v^2 / 2 is work.

    The window is the second half of the run; trunk and legs sway a little while they slide. Still
    legs do not roll: the velocity of the contact point is that of the foot's centre.
    """
    mu, speed = 0.2, 2.0
    scene = hp.Scene(SCENE.robot, contact=hp.Contact.accurate().with_mu(mu))
    still = hp.simulate(scene, hp.HoldPosture(), duration=0.5)
    state = hp.State(still.q[-1], np.array([speed, *np.zeros(23)]))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=1.2, initial=state, accuracy=1e-5)
    velocity = np.gradient(trace.foot_position[..., :2], trace.time, axis=0)
    power = np.abs(np.sum(trace.foot_force[..., :2] * velocity, axis=-1))
    inside = trace.time >= trace.summary.start - 1e-9
    work = np.trapezoid(power[inside], trace.time[inside], axis=0)
    assert trace.summary.friction_work == pytest.approx(work, rel=0.01)
    left = 0.5 * SCENE.robot.total_mass * (speed - mu * 9.81 * trace.summary.start) ** 2
    assert trace.summary.friction_work.sum() == pytest.approx(left, rel=0.02)


def test_the_core_and_the_record_name_the_same_numbers() -> None:
    """Each number is named twice: beside its sum in C++, and in the class that holds it."""
    run = native.RunSummary(joints=18, feet=6)
    run.set_window(0.0, 1.0, 0.0)
    state = np.zeros(25), np.zeros(24), np.zeros(18), np.zeros((6, 3)), *np.zeros((2, 6))
    state[0][6] = 1.0
    for time in (0.0, 0.5, 1.0):
        run.record(time, *state, np.zeros(3))
    assert run.data().keys() == {"states", "cycles", *schema(hp.Summary)}


def test_a_budget_takes_a_trace_a_summary_or_an_older_trace(trace: hp.Trace) -> None:
    ours, theirs = hp.torque_budget(trace), hp.torque_budget(trace.summary)
    older = hp.torque_budget(replace(trace, gathered=None))
    assert ours.peaks == theirs.peaks == "accepted steps" and older.peaks == "samples"
    assert ours.joints == theirs.joints and ours.table() == theirs.table()
    for mine, other in zip(ours.joints, older.joints, strict=True):
        assert mine.torque_peak == other.torque_peak  # every accepted step is sampled here
        assert mine.torque_rms == pytest.approx(other.torque_rms, rel=1e-9)
        assert mine.at_limit == pytest.approx(other.at_limit, abs=2e-3)
    assert ours.largest_outside == older.largest_outside
    assert ours.distance == pytest.approx(older.distance, rel=1e-6)
    assert trace.summary.measured_turn_rate == pytest.approx(0.1, rel=0.1)
    with refused(ParameterError, "Window.samples", None):
        _ = theirs.window.samples


def test_a_summary_is_kept_in_a_file(trace: hp.Trace, tmp_path: Path) -> None:
    summary = trace.summary
    path = summary.save(tmp_path / "summary.json")
    assert hp.load_summary(path) == summary
    assert hp.load_trace(trace.save(tmp_path / "trace.nc")).summary == summary
    found = json.loads(path.read_text())
    older = {k: v for k, v in found["data"].items() if k != "friction_work"}
    bad = tmp_path / "bad.json"
    for changed, about in (
        ({"schema": "of another program"}, ()), ({"data": older}, ("data.friction_work",)),
        ({"data": {**older, "torque_peak": [1.0]}}, ("data.torque_peak", "[1.0]", "18")),
    ):  # fmt: skip
        bad.write_text(json.dumps({**found, **changed}))
        with refused(TraceFileError, about=(str(bad), *about)):
            hp.load_summary(bad)
    none = tmp_path / "none.json"
    with refused(TraceFileError, about=(str(none),)) as caught:
        hp.load_summary(none)
    assert isinstance(caught.value.__cause__, FileNotFoundError)


# Sliding, currents and temperatures at the samples; the states in which torques are largest.

MOTOR = hp.Motor(
    stall_torque=1e3, no_load_speed=1e3, gear_ratio=100.0, torque_constant=0.02,
    winding_resistance=2.0, thermal_resistance_winding=4.0, thermal_resistance_housing=10.0,
    thermal_time_winding=0.8, thermal_time_housing=60.0, ambient=30.0,
)  # fmt: skip  # too strong to matter; heats up within seconds
BARE = MOTOR.model_copy(update={"winding_resistance": None})
GAIT = hp.Gait.tripod(stroke=0.1, cycle_time=0.6)
EVERYTHING = "torque set_points contacts com energy sliding current temperature".split()


@pytest.fixture(scope="module")
def case() -> hp.Case:
    robot = SCENE.robot
    gains = hp.Servo.for_robot(robot)
    motors = {"coxa": MOTOR, "femur": MOTOR, "tibia": BARE}
    scene = hp.Scene(robot, servo=hp.Servo(kp=gains.kp, kd=gains.kd, motor=motors))
    return hp.Case(scene, hp.KinematicControl(GAIT), duration=3.0, record=EVERYTHING)


@pytest.fixture(scope="module")
def sampled(case: hp.Case) -> hp.Trace:
    return case.run()


def test_the_sliding_of_a_foot_is_that_of_its_lowest_point(case, sampled) -> None:
    """By Pinocchio's Jacobians; 0 in the air, and over a cycle the distance of the summary."""
    robot, model = case.scene.robot, case.scene.robot.model
    data, seen = model.createData(), 0
    loaded = sampled.normal_force > 0.0
    assert np.all(sampled.slip_speed[~loaded] == 0.0)
    for k in range(100, len(sampled.time), 97):
        pin.computeJointJacobians(model, data, sampled.q[k])
        for f, foot in enumerate(robot.feet):
            if not loaded[k, f]:
                continue
            joint = model.getJointId(foot.joint)
            frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            twist = pin.getJointJacobian(model, data, joint, frame) @ sampled.v[k]
            contact = sampled.foot_position[k, f] - [0.0, 0.0, foot.radius + sampled.foot_gap[k, f]]
            arm = contact - data.oMi[joint].translation
            speed = np.linalg.norm((twist[:3] + np.cross(twist[3:], arm))[:2])
            # half of the depth at most separates two notions of the point of contact
            bound = np.linalg.norm(twist[3:]) * abs(sampled.foot_gap[k, f]) + 1e-12
            assert sampled.slip_speed[k, f] == pytest.approx(speed, abs=bound)
            seen += 1
    assert seen > 20
    window = sampled.summary.path[[0, -1], 0]
    inside = (sampled.time >= window[0] - 1e-9) & (sampled.time <= window[1] + 1e-9)
    distance = np.trapezoid(sampled.slip_speed[inside], sampled.time[inside], axis=0)
    # touch-downs last a few samples: their sliding is known to a tenth from samples
    expected = sampled.summary.slip_distance * sampled.summary.cycles
    assert distance == pytest.approx(expected, rel=0.1)


def test_currents_and_temperatures_are_those_of_the_motors(sampled) -> None:
    """I = torque / (N k) of warm magnets; both bodies by another solver on sampled currents."""
    cold = sampled.torque / (100.0 * 0.02)
    names = sampled.joint_names
    bare = np.array(["tibia" in name for name in names])
    assert sampled.current[:, bare] == pytest.approx(cold[:, bare], rel=1e-14)
    assert np.isnan(sampled.temperature[:, bare]).all()
    assert np.all(sampled.temperature[0, ~bare] == 30.0)
    joint = int(np.argmax(np.where(bare, 0.0, sampled.temperature[-1])))
    square = sampled.current[:, joint] ** 2

    def slope(t: float, x: np.ndarray) -> list[float]:
        power = np.interp(t, sampled.time, square) * 2.0 * (1.0 + 0.0039 * (x[0] - 25.0))
        out = (x[0] - x[1]) / 4.0
        return [(power - out) / (0.8 / 4.0), (out - (x[1] - 30.0) / 10.0) / (60.0 / 10.0)]

    settings = dict(max_step=2e-3, rtol=1e-8, t_eval=sampled.time)
    heated = solve_ivp(slope, (0.0, sampled.time[-1]), [30.0, 30.0], **settings).y
    # the housing warms by a tenth of a kelvin, which shifts currents by 1e-4
    flux = 1.0 - 0.0011 * (heated[1] - 25.0)
    assert 30.05 < heated[1, -1] < 30.2
    assert sampled.current[:, joint] == pytest.approx(cold[:, joint] / flux, rel=1e-6)
    found = heated[0, -1]
    # the rise is linear in the current's square, which samples resolve to a hundredth
    assert found > 30.2
    assert sampled.temperature[-1, joint] - 30.0 == pytest.approx(found - 30.0, rel=0.01)


def test_what_is_not_asked_for_is_not_there_and_changes_nothing(case, sampled, tmp_path) -> None:
    usual = hp.Case(case.scene, case.controller, duration=3.0).run()
    assert usual.recorded == ("motion", "torque", "set_points", "contacts", "com", "energy")
    with refused(NotRecordedError, "slip_speed", about=("--record",)):
        _ = usual.slip_speed
    for name in vars(usual).keys() & schema(hp.Trace):
        assert np.array_equal(getattr(usual, name), getattr(sampled, name)), name
    assert usual.summary.data == sampled.summary.data and usual.peaks == sampled.peaks
    again = hp.load_trace(sampled.save(tmp_path / "walk.nc"))
    assert again == sampled and again.recorded == sampled.recorded and again.peaks == sampled.peaks


def test_what_no_motor_has_is_refused(case) -> None:
    for group, motor in (("current", None), ("temperature", BARE)):
        scene = hp.Scene(case.scene.robot, servo=hp.Servo(kp=40.0, kd=0.8, motor=motor))
        with refused(ParameterError, "record", group, about=("torque_constant",)):
            hp.simulate(scene, hp.HoldPosture(), duration=0.01, record=[group])


def test_the_run_keeps_the_states_of_its_peaks(case, sampled: hp.Trace) -> None:
    """The servo's law in that state, with the plan's set-points then, gives the peak."""
    peaks, summary = sampled.peaks, sampled.summary
    assert peaks is not None
    assert np.array_equal(peaks.time, summary.torque_peak_time)
    assert np.array_equal(np.diag(peaks.torque), summary.torque_peak)
    plan = case.controller.plan(case.scene.robot, 3.0)
    kp, kd = case.scene.servos.gains(case.scene.robot)
    for j, time in enumerate(peaks.time):
        points = native.set_points_at(
            plan.time.tolist(), plan.q, plan.v, plan.kind, native_acceleration(plan), time
        )
        torque = kp * (points[0] - peaks.q[j, 7:]) + kd * (points[1] - peaks.v[j, 6:])
        # a torque of 1 N m is a difference of angles of 1e-2 rad, each known to 1e-16
        assert peaks.torque[j] == pytest.approx(torque, abs=1e-10)
        chord = np.array([np.interp(time, sampled.time, column) for column in sampled.q.T])
        # within 2 ms, at 50 rad/s^2 at most, a joint is off the chord by 50 (2e-3)^2 / 8
        assert np.abs(peaks.q[j] - chord).max() < 1e-4
    assert np.abs(peaks.time[:, None] - sampled.time).min(axis=1).max() > 1e-6  # between samples
    assert np.isnan(hp.simulate(case.scene, case.controller, duration=0.1).peaks.q).all()
