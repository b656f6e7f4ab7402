"""Summaries of runs: against the samples of the same run, the budget, files, and short runs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.results.schema import schema

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
    assert summary.height_max == trace.q[inside, 2].max()
    for name, column in (("roll_rate_rms", 3), ("pitch_rate_rms", 4)):
        value = rms(time, trace.v[inside, column])
        assert getattr(summary, name) == pytest.approx(value, rel=1e-9), name


def rms(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the square root of the time average of the squares."""
    return np.sqrt(np.trapezoid(values**2, time, axis=0) / (time[-1] - time[0]))


def test_feet_and_way(trace: hp.Trace) -> None:
    """Forces carry the weight; each foot is down half of the cycle; distance as of samples."""
    summary = trace.summary
    weight = 9.81 * SCENE.robot.total_mass
    assert summary.impulse[:, 2].sum() == pytest.approx(weight * CYCLE, rel=2e-2)
    assert summary.normal_impulse == pytest.approx(summary.impulse[:, 2], rel=1e-9)  # level ground
    assert summary.loaded_time == pytest.approx(np.full(6, CYCLE / 2), rel=0.25)
    assert (summary.force_peak > 1.5 * weight / 6).all()
    slip = np.linalg.norm(np.diff(trace.foot_position[..., :2], axis=0), axis=-1)
    assert (summary.slip_distance < slip[trace.contact[1:]].sum()).all()
    sampled = hp.torque_budget(replace(trace, gathered=None))
    assert summary.distance == pytest.approx(sampled.distance, rel=1e-6)
    assert summary.measured_speed == pytest.approx(sampled.measured_speed, rel=1e-6)
    assert summary.measured_turn_rate == pytest.approx(0.1, rel=0.1)


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


def test_a_run_without_a_whole_cycle_says_how_long_it_must_be(tmp_path: Path) -> None:
    summary = hp.simulate(SCENE, WALK, duration=1.0).summary
    assert summary.cycles == 0 and np.isnan(summary.torque_peak).all()
    assert np.isfinite(summary.outside_torque).all() and summary.distance is None
    with refused(ParameterError, "duration", 1.0, allowed=(2.4,)):
        hp.torque_budget(summary)
    assert hp.load_summary(summary.save(tmp_path / "short.json")) == summary


def test_a_posture_has_no_cycles_but_a_window() -> None:
    summary = hp.simulate(SCENE, hp.HoldPosture(), duration=1.0).summary
    assert summary.cycles is None and summary.measured_speed is None
    assert (summary.start, summary.end) == (0.5, 1.0)
    assert summary.height_min <= summary.height_mean <= summary.height_max
    assert hp.torque_budget(summary).window.cycles is None
    assert (summary.torque_margin <= SCENE.robot.effort_limit).all()
