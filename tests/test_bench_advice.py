"""Advice: it reaches what was asked for, and says when it is not sure."""

from __future__ import annotations

from dataclasses import replace

import pytest
from refusals import NUMBER, refused

import hexapod_pin as hp
from hexapod_pin.benchmark.advice import SAFETY_FACTOR, Advice, NoAdviceError, advise, advise_on
from hexapod_pin.benchmark.work_precision.measure import cheapest, sweeps
from hexapod_pin.benchmark.work_precision.scenes import built_in
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.errors import ParameterError
from hexapod_pin.validation.position_error import PositionError


@pytest.fixture(scope="module")
def task() -> Task:
    """The walk until the feet have touched down."""
    return replace(built_in("walk"), duration=0.06)


@pytest.fixture(scope="module")
def advice(task: Task) -> Advice:
    """Advice for 1e-3 on it."""
    return advise_on(task, 1e-3)


def test_advised_run_keeps_the_error_it_predicts(task: Task, advice: Advice):
    trace = hp.simulate(
        task.scene, task.controller, duration=task.duration, sample=task.sample,
        initial=task.initial, **advice.settings,
    )  # fmt: skip
    error = PositionError.between(trace.q, advice.reference.outcome.q).q
    assert error == advice.predicted_error  # the same run, bit for bit
    assert error * SAFETY_FACTOR <= 1e-3
    per_second = trace.counters["evaluations"] / task.duration
    assert advice.evaluations == pytest.approx(per_second, rel=1e-12)
    assert advice.milliseconds > 0.0


def test_advice_is_the_cheapest_of_what_was_good_enough(advice: Advice):
    tried = sweeps(advice.tried)
    assert len(tried) > 1
    good = [cheapest(own, 1e-3 / SAFETY_FACTOR) for own in tried.values()]
    times = {row.method: row.wall * 1e3 for row in good if row is not None}
    assert times[advice.method] == advice.milliseconds == min(times.values())
    assert advice.method in advice.table()
    assert str(advice).startswith(f'for an error of 0.001: method="{advice.method}", ')
    assert (advice.accuracy is None) != (advice.step is None)


def test_tighter_advice_costs_more_evaluations(task: Task, advice: Advice):
    assert advise_on(task, 1e-5).evaluations > advice.evaluations


def test_a_piece_without_touch_down_lowers_the_sureness():
    scene = built_in("stand").scene
    robot = scene.robot
    high = robot.stand()
    q = high.q.copy()
    q[2] += 1.0
    found = advise(
        scene, hp.HoldPosture(), 1e-3, piece=0.05, initial=robot.check_state(q, high.v)
    )  # fmt: skip
    assert found.sure in ("fair", "low")
    assert any("no foot touched down" in reason for reason in found.reasons)
    assert found.piece.duration == 0.05


def test_what_nothing_reaches_is_refused_with_what_came_nearest(task: Task, monkeypatch):
    monkeypatch.setattr("hexapod_pin.benchmark.advice.method_names", lambda: ("implicit-euler",))
    wanted = 1e-8 / SAFETY_FACTOR
    with refused(NoAdviceError, about=(f"{wanted:.1e}", f"{task.duration:g}")) as caught:
        advise_on(task, 1e-8)
    _, _, nearest = map(float, NUMBER.findall(str(caught.value)))  # after those two
    assert nearest > wanted


@pytest.mark.parametrize(("accuracy", "piece"), [(0.5, 0.1), (1e-9, 0.1), (1e-3, 0.005)])
def test_numbers_out_of_range_are_refused(accuracy, piece):
    scene = built_in("stand").scene
    with pytest.raises(ParameterError):
        advise(scene, hp.HoldPosture(), accuracy, piece=piece)
