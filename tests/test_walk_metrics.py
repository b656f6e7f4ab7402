"""Numbers of one walk, what became of a run, and the statistics of a comparison."""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy import stats
from synthetic import with_run

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, GaitError, ParameterError, UnknownNameError
from hexapod_pin.results.run_record import Event
from hexapod_pin.results.summary import path_error
from hexapod_pin.results.walk_metrics import (
    METRICS,
    ComparedRun,
    Outcome,
    mean_estimate,
    relative_change,
)

CYCLE = 0.8
SCENE = hp.Scene(hp.load_robot("kharagpur"))
GAIT = hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE)


def summary_of(gait: hp.Gait, duration: float = 3.3) -> hp.Summary:
    return hp.simulate(SCENE, hp.KinematicControl(gait), duration=duration).summary


@pytest.fixture(scope="module")
def summary() -> hp.Summary:
    return summary_of(GAIT)


def test_numbers_are_those_of_summary_and_budget(summary: hp.Summary) -> None:
    """The robot goes 0.05 m per half cycle: what is per cycle is a tenth of what is per metre."""
    metrics, budget = hp.study.WalkMetrics.of(summary), hp.torque_budget(summary)
    distance = 2 * GAIT.stroke
    assert metrics.measured_speed == pytest.approx(distance / CYCLE, rel=5e-3)
    assert metrics.slip_distance == pytest.approx(summary.slip_distance.sum())
    assert metrics.slip_per_metre == pytest.approx(metrics.slip_distance / distance, rel=5e-3)
    work = summary.friction_work.sum() / distance
    assert metrics.friction_work_per_metre == pytest.approx(work, rel=5e-3)
    assert metrics.energy_per_metre == pytest.approx(budget.absolute_energy / distance, rel=5e-3)
    weight = 9.81 * SCENE.robot.total_mass
    assert metrics.cost_of_transport == pytest.approx(metrics.energy_per_metre / weight, rel=1e-9)
    assert metrics.torque_rms == pytest.approx(math.sqrt(np.mean(summary.torque_rms**2)))
    assert weight * CYCLE / 6 < metrics.normal_impulse < weight * CYCLE / 2
    assert metrics.path_deviation < 1e-3 and metrics.heading_error < 1e-3
    # 0.2 rad/s for 1.6 s turn 0.32 rad: a straight plan would be missed by 3 cm
    turning = hp.study.WalkMetrics.of(summary_of(GAIT.model_copy(update={"turn_rate": 0.2})))
    assert turning.path_deviation < 2e-3 and turning.heading_error < 5e-3
    assert list(METRICS) == [field.name for field in fields(hp.study.WalkMetrics)]


def test_what_a_run_does_not_have_is_none(summary: hp.Summary) -> None:
    """A posture does not move; a summary of a former release has no friction work."""
    still = hp.study.WalkMetrics.of(hp.simulate(SCENE, hp.HoldPosture(), duration=0.4).summary)
    assert still.measured_speed is still.slip_per_metre is still.cost_of_transport is None
    assert still.path_deviation is None and still.torque_peak is not None
    older = hp.study.WalkMetrics.of(replace(summary, friction_work=np.full(6, np.nan)))
    assert older.friction_work_per_metre is None and older.table().count(" - ") == 1
    with refused(ParameterError, "duration", 1.0):
        hp.study.WalkMetrics.of(summary_of(GAIT, duration=1.0))


def edges(x: Any, y: Any, yaw: Any) -> np.ndarray:
    time = 5.0 + np.arange(len(np.atleast_1d(x)))
    return np.column_stack([time, x, y, np.broadcast_to(yaw, time.shape)])


def test_path_error_of_a_line() -> None:
    """A line 3 degrees to the left of its plan; forward and sideways gaits, any starting yaw."""
    s = np.arange(5.0)
    tilt = math.radians(3.0)
    aside = s * math.sin(tilt)
    for travel in (0.0, -2.0):
        angle = travel + tilt
        place = edges(1.0 + s * np.cos(angle), 2.0 + s * np.sin(angle), 0.4 + tilt)
        along = np.array([math.cos(travel), math.sin(travel)])
        deviation, error = path_error(place, along, first_yaw=0.4, speed=1.0, turn_rate=0.0)
        assert deviation == pytest.approx(math.sqrt(np.mean(aside**2)), rel=1e-12)
        assert error == pytest.approx(tilt, abs=1e-12)


@pytest.mark.parametrize("turn_rate", [0.3, -0.3])
def test_path_error_of_an_arc(turn_rate: float) -> None:
    """On the planned circle nothing is off; one of radius R that is d wider is off by up to 2 d."""
    angle = turn_rate * np.arange(12.0)  # more than half a turn
    for wider in (0.0, 0.02):
        radius = 0.5 / turn_rate + math.copysign(wider, turn_rate)
        place = edges(radius * np.sin(angle), radius * (1.0 - np.cos(angle)), 0.9 + angle)
        c, s = math.cos(0.9), math.sin(0.9)
        turned = place.copy()
        turned[:, 1:3] = place[:, 1:3] @ np.array([[c, s], [-s, c]])
        along = np.array([1.0, 0.0])
        deviation, error = path_error(turned, along, first_yaw=0.0, speed=0.5, turn_rate=turn_rate)
        assert error == pytest.approx(0.0, abs=1e-12)
        away = np.hypot(radius * np.sin(angle), radius * (1.0 - np.cos(angle)) - 0.5 / turn_rate)
        expected = math.sqrt(np.mean((away - 0.5 / abs(turn_rate)) ** 2))
        assert deviation == pytest.approx(expected, abs=1e-12)
        assert deviation <= 2 * wider + 1e-12


def test_runs_that_did_not_walk_say_so(summary: hp.Summary) -> None:
    touch = Event(time=1.5, kind="trunk-contact", what="corner", place=(0.0, 0.0, 0.0))
    fallen = with_run(summary, events=(touch,))
    tilted = replace(summary, pitch_peak=-1.5)
    for result, outcome, word in (
        (summary, Outcome.WALKED, ""),
        (fallen, Outcome.FELL, "corner at 1.5 s"),
        (tilted, Outcome.FELL, "pitch of 85.9 degrees"),
        (summary_of(GAIT, duration=1.0), Outcome.TOO_SHORT, "at least 2.4 s"),
        (DivergenceError("left at 0.3 s", None), Outcome.DIVERGED, "left at 0.3 s"),
        (GaitError("too long", "stroke", 0.1), Outcome.REFUSED, "too long"),
        (ValueError("bad"), Outcome.FAILED, "ValueError: bad"),
        (None, Outcome.NOT_RUN, "interrupted"),
    ):
        run = ComparedRun.of("flat", 0, "plain", result)
        assert run.outcome is outcome and word in run.reason
        assert (run.metrics is not None) == (outcome is Outcome.WALKED)
        json.dumps(run.to_dict(), allow_nan=False)


def test_means_have_students_interval_and_changes_are_paired() -> None:
    values = [1.0, 2.0, 4.0, 4.5]
    _, high = stats.t.interval(0.95, 3, np.mean(values), stats.sem(values))
    found = mean_estimate(values)
    assert (found.value, found.value + found.half_width) == pytest.approx((np.mean(values), high))
    assert mean_estimate([2.0]).half_width is None and mean_estimate([]) is None
    # what both runs of a pair share cancels: 10 % more on each terrain has no width
    baseline = np.array([1.0, 5.0, 20.0])
    same = relative_change(list(1.1 * baseline), list(baseline))
    assert same.value == pytest.approx(0.1) and same.half_width == pytest.approx(0.0, abs=1e-12)
    found = relative_change([1.2, 5.0, 24.0], list(baseline))  # residuals 0.038, -0.808, 0.769
    rest = np.array([1.2, 5.0, 24.0]) - baseline * 30.2 / 26.0
    width = stats.t.ppf(0.975, 2) * math.sqrt(np.sum(rest**2) / 6.0) / np.mean(baseline)
    assert (found.value, found.half_width) == pytest.approx((30.2 / 26.0 - 1.0, width))
    assert relative_change([1.0], [0.0]) is None and relative_change([], []) is None


def test_unknown_names_and_doubles_are_refused() -> None:
    run = ComparedRun("flat", 0, "plain", Outcome.FELL, "fell at 1 s")
    found = hp.study.Comparison((run,))
    for place in (("hill", "plain", "measured_speed"), ("flat", "plain", "beauty")):
        with pytest.raises(UnknownNameError):
            found.mean(*place)
    for runs in ((), (run, run)):
        with pytest.raises(ParameterError):
            hp.study.Comparison(runs)
