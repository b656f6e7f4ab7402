"""Batches: results in order, failures that stay alone, summaries, Ctrl-C, controllers mixed."""

from __future__ import annotations

import signal
import threading
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control.feedback import Command
from hexapod_pin.errors import (
    DivergenceError,
    GaitError,
    ParameterError,
    SimulationInterrupted,
    UserCodeError,
)

SCENE = hp.Scene(hp.load_robot("kharagpur"))
STIFF = hp.Scene(SCENE.robot, contact=hp.Contact.s2())


def walk(stroke: float, **settings: Any) -> hp.Case:
    """A tripod walk of 1.2 s; its first cycle is whole after 0.9 s."""
    gait = hp.Gait.tripod(stroke=stroke, cycle_time=0.3)
    settings = {"duration": 0.9, "method": "implicit-euler", "step": 3e-3, **settings}
    return hp.Case(SCENE, hp.KinematicControl(gait), **settings)


def standing(k: int) -> hp.Case:
    """A robot that stands, the heavier the larger k."""
    scene = hp.Scene(SCENE.robot, gravity=(0.0, 0.0, -9.0 - 0.01 * k))
    return hp.Case(scene, hp.HoldPosture(), duration=0.3, method="implicit-euler", step=3e-3)


def diverging() -> hp.Case:
    """Explicit steps far beyond the stability limit of S2's stiff contact."""
    return hp.Case(STIFF, hp.HoldPosture(), duration=0.2, method="rk4", step=2e-3)


@dataclass(frozen=True)
class Nudge:
    """A feedback controller: the measured angles, pulled to the standing posture."""

    share: float
    period: float = 0.01

    def start(self, scene: hp.Scene, batch: int) -> Any:
        """Remember the posture."""
        return np.tile(scene.robot.posture, (batch, 1))

    def update(self, time: float, measurement: Any, state: Any) -> tuple[Command, Any]:
        """Go a share of the way; a share below 0 is refused at the third tick."""
        if self.share < 0.0 and time > 0.02:
            raise ValueError("no share")
        return Command(measurement.q + self.share * (state - measurement.q)), state

    def to_dict(self) -> dict[str, Any]:
        """Return the settings."""
        return {"kind": "nudge", "share": self.share, "period": self.period}


def test_200_cases_of_which_5_diverge() -> None:
    """Each failed case is an entry with its reason; the others are what they are alone."""
    bad = {3, 50, 51, 120, 199}
    walks = {7: walk(0.02), 27: walk(0.02), 160: walk(0.03)}
    cases = [diverging() if k in bad else walks.get(k, standing(k)) for k in range(200)]
    seen: list[float] = []
    results = hp.simulate_batch(cases, threads=2, keep="summary", progress=seen.append)
    assert {k for k, r in enumerate(results) if isinstance(r, DivergenceError)} == bad
    assert all(isinstance(r, hp.Summary) for k, r in enumerate(results) if k not in bad)
    assert seen == [(k + 1) / 200 for k in range(200)]
    assert "fastest joint" in str(results[3]) and results[3].trace is None
    assert results[3].__traceback__ is None  # its frames would keep the run in memory
    (whole,) = hp.simulate_batch([diverging()])
    assert isinstance(whole, DivergenceError) and whole.trace is not None
    with pytest.raises(DivergenceError):
        hp.simulate_batch([diverging()], errors="raise")
    alone = hp.simulate(
        SCENE, cases[7].controller, duration=0.9, method="implicit-euler", step=3e-3
    )
    assert results[7].data == results[27].data == alone.summary.data != results[160].data
    torque = [abs(results[k].torque_peak[1]) for k in (0, 100, 198)]
    assert torque == sorted(torque)  # heavier and heavier, in the order of the cases
    assert hp.torque_budget(results[7]).joints == hp.torque_budget(alone).joints


def test_threads_and_summaries_change_no_bit() -> None:
    cases = [walk(0.02), walk(0.03, duration=1.2), walk(0.04, method="x3", step=None)]
    one = hp.simulate_batch(cases, threads=1)
    two = hp.simulate_batch(iter(cases), threads=2)
    kept = hp.simulate_batch(cases, threads=2, keep="summary")
    for a, b, c, case in zip(one, two, kept, cases, strict=True):
        assert np.array_equal(a.q, b.q) and np.array_equal(a.torque, b.torque)
        assert a.summary.data == b.summary.data == c.data
        assert hp.load_case(a) == case and hp.Case.from_toml(c.case_toml) == case


def test_settings_of_the_batch_are_for_cases_that_have_none() -> None:
    open_case = hp.Case(SCENE, hp.HoldPosture())
    own = replace(open_case, duration=0.2, method="robust", step=1e-3)
    first, second = hp.simulate_batch([open_case, own], duration=0.1, accuracy=1e-3)
    assert (first.time[-1], first.run.numerics.accuracy) == (0.1, 1e-3)
    assert (second.time[-1], second.run.numerics.method) == (0.2, "robust")
    odd = replace(open_case, sample=3e-4)
    error, good = hp.simulate_batch([odd, own], duration=0.1, method="rk4", step=1e-3)
    assert isinstance(error, ParameterError) and isinstance(
        good, hp.Trace
    )  # its samples do not fit
    with refused(ParameterError, "accuracy", -1.0):
        hp.simulate_batch([open_case], duration=0.1, accuracy=-1.0)
    (error,) = hp.simulate_batch([open_case])
    assert isinstance(error, ParameterError) and error.name == "Case.duration"


def test_what_cannot_be_planned_is_a_result_too() -> None:
    """No call looks into a generator; one that gives no cases, or no motors, is named."""
    fast = hp.Case(SCENE, hp.KinematicControl(hp.Gait.tetrapod(cycle_time=0.3)), duration=0.1)
    results = hp.simulate_batch([fast, walk(0.02), fast])
    assert [type(r) for r in results] == [GaitError, hp.Trace, GaitError]
    with pytest.raises(GaitError):
        hp.simulate_batch([walk(0.02), fast], errors="raise")
    for name, value in (("threads", 0), ("keep", "all"), ("errors", "ignore")):
        with refused(ParameterError, name, value):
            hp.simulate_batch([], **{name: value})
    with refused(ParameterError, "simulate_batch.threads", 1.5):
        hp.simulate_batch([], threads=1.5)
    with refused(ParameterError, "cases", 3):
        list(hp.simulation.iterate_batch(one for one in [3]))  # type: ignore[misc]
    trace = hp.simulate(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.1)
    with refused(ParameterError, "motor_ranking.records", "AX-12A"):
        hp.sizing.motor_ranking(trace, (one for one in ["AX-12A"]))  # type: ignore[misc]


def test_results_come_as_they_finish_and_may_be_left() -> None:
    cases = [walk(0.02, duration=240.0), *(walk(0.02 + 1e-3 * k) for k in range(4))]
    done = hp.simulation.iterate_batch(cases, threads=2)
    first, _ = next(done)
    assert first != 0  # the long one does not hold up the others
    done.close()


def test_feedback_controllers_run_beside_open_loop_ones() -> None:
    """In lock-step: the bits of each are those of its own run. A failure is its own, too."""
    live = [hp.Case(SCENE, Nudge(share), duration=0.1) for share in (0.5, 0.5, -1.0, 0.25)]
    heavy = hp.Scene(SCENE.robot, gravity=(0.0, 0.0, -12.0))
    cases = [walk(0.02), *live, hp.Case(heavy, Nudge(0.5), duration=0.1)]
    results = hp.simulate_batch(cases, threads=2)
    assert [type(r) for r in results] == [
        hp.Trace, hp.Trace, hp.Trace, UserCodeError, *[hp.Trace] * 2,
    ]  # fmt: skip
    for index in (1, 2, 4, 5):
        case = cases[index]
        alone = hp.simulate(case.scene, case.controller, duration=0.1)
        assert np.array_equal(alone.q, results[index].q), index
    summaries = hp.simulate_batch(cases, keep="summary")
    assert summaries[5].data == results[5].summary.data


@pytest.mark.parametrize(("keep", "estimate"), [("summary", True), ("trace", False)])
def test_ctrl_c_in_a_case_with_feedback_is_no_result_of_it(keep: str, estimate: bool) -> None:
    """It was an error of the case where no samples are recorded, and the batch continued."""
    gait = hp.Gait.tripod(stroke=0.04, cycle_time=0.3)
    control = hp.FootControl(hp.KinematicControl(gait))
    scene = hp.Scene(hp.load_robot("kharagpur"))
    case = hp.Case(scene, control, duration=600.0, accuracy=1e-4, estimate=estimate)
    timer = threading.Timer(0.1, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    try:
        with refused(SimulationInterrupted, about=("0", "1"), results=[None]):
            hp.simulate_batch([case], keep=keep)
    finally:
        timer.join()


def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    """A real signal, after the third result; the rest is None, and the threads end."""
    cases = [walk(0.02), walk(0.02), walk(0.02), walk(0.02, duration=240.0)]

    def after_third(fraction: float) -> None:
        if fraction == 0.75:
            threading.Timer(0.05, signal.raise_signal, (signal.SIGINT,)).start()

    with refused(SimulationInterrupted, about=("3", "4")) as caught:
        hp.simulate_batch(cases, threads=2, keep="summary", progress=after_third)
    assert [type(r) for r in caught.value.results] == [hp.Summary] * 3 + [type(None)]
