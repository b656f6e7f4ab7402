"""Batches: results in order, failures that stay alone, summaries, Ctrl-C."""

from __future__ import annotations

import signal
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, GaitError, ParameterError, SimulationInterrupted

SCENE = hp.Scene(hp.load_robot("kharagpur"))


def walk(stroke: float, **settings: Any) -> hp.Case:
    gait = hp.Gait.tripod(stroke=stroke, cycle_time=0.3)
    settings = {"duration": 0.9, "method": "implicit-euler", "step": 3e-3, **settings}
    return hp.Case(SCENE, hp.KinematicControl(gait), **settings)


def standing(k: int) -> hp.Case:
    scene = hp.Scene(SCENE.robot, gravity=(0.0, 0.0, -9.0 - 0.01 * k))
    return hp.Case(scene, hp.HoldPosture(), duration=0.3, method="implicit-euler", step=3e-3)


def diverging() -> hp.Case:
    stiff = hp.Scene(SCENE.robot, contact=hp.Contact.s2())
    return hp.Case(stiff, hp.HoldPosture(), duration=0.2, method="rk4", step=2e-3)


def test_50_cases_of_which_3_diverge() -> None:
    bad = {3, 30, 49}
    walks = {7: walk(0.02), 27: walk(0.02), 40: walk(0.03)}
    cases = [diverging() if k in bad else walks.get(k, standing(k)) for k in range(50)]
    seen: list[float] = []
    results = hp.simulate_batch(cases, threads=2, keep="summary", progress=seen.append)
    assert {k for k, r in enumerate(results) if isinstance(r, DivergenceError)} == bad
    assert all(isinstance(r, hp.Summary) for k, r in enumerate(results) if k not in bad)
    assert seen == [(k + 1) / 50 for k in range(50)]
    assert "fastest joint" in str(results[3]) and results[3].trace is None
    assert results[3].__traceback__ is None  # its frames would keep the run in memory
    (whole,) = hp.simulate_batch([diverging()])
    assert isinstance(whole, DivergenceError) and whole.trace is not None
    with pytest.raises(DivergenceError):
        hp.simulate_batch([diverging()], errors="raise")
    alone = cases[7].run()
    assert results[7].data == results[27].data == alone.summary.data != results[40].data
    torque = [abs(results[k].torque_peak[1]) for k in (0, 20, 48)]
    assert torque == sorted(torque)  # heavier and heavier, in the order of the cases


def test_threads_and_summaries_change_no_bit() -> None:
    cases = [walk(0.02), walk(0.03, duration=1.2), walk(0.04, method="x3", step=None)]
    one = hp.simulate_batch(cases, threads=1)
    two = hp.simulate_batch(iter(cases), threads=1000)
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
    odd = replace(open_case, sample=3e-4)  # its samples do not fit
    error, good = hp.simulate_batch([odd, own], duration=0.1, method="rk4", step=1e-3)
    assert isinstance(error, ParameterError) and isinstance(good, hp.Trace)
    with refused(ParameterError, "accuracy", -1.0):
        hp.simulate_batch([open_case], duration=0.1, accuracy=-1.0)
    (error,) = hp.simulate_batch([open_case])
    assert isinstance(error, ParameterError) and error.name == "Case.duration"


def test_what_cannot_be_planned_is_a_result_too() -> None:
    """No call looks into a generator; one that gives no cases, or no motors, is named."""
    fast = hp.Case(SCENE, hp.KinematicControl(hp.Gait.tetrapod(cycle_time=0.3)), duration=0.1)
    results = hp.simulate_batch([fast, walk(0.02), fast])
    assert [type(r) for r in results] == [GaitError, hp.Trace, GaitError]
    for name, value in (("threads", 0), ("keep", "all"), ("errors", "ignore")):
        with refused(ParameterError, name, value):
            hp.simulate_batch([], **{name: value})
    assert hp.simulate_batch([], duration=0.1, threads=4) == []
    with refused(ParameterError, "cases", 3):
        list(hp.simulation.iterate_batch(one for one in [3]))  # type: ignore[misc]
    with refused(ParameterError, "motor_ranking.records", "AX-12A"):
        hp.sizing.motor_ranking(results[1], (one for one in ["AX-12A"]))  # type: ignore[misc]


def test_results_come_as_they_finish_and_may_be_left() -> None:
    cases = [walk(0.02, duration=240.0), *(walk(0.02 + 1e-3 * k) for k in range(4))]
    done = hp.simulation.iterate_batch(cases, threads=2)
    first, _ = next(done)
    assert first != 0  # the long one does not hold up the others
    done.close()


def test_ctrl_c_in_a_case_with_feedback_is_no_result_of_it() -> None:
    """It was an error of the case where no samples are recorded, and the batch continued."""
    control = hp.FootControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))
    case = hp.Case(SCENE, control, duration=600.0, accuracy=1e-4, estimate=True)
    timer = threading.Timer(0.1, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    try:
        with refused(SimulationInterrupted, about=("0", "1"), results=[None]):
            hp.simulate_batch([case], keep="summary")
    finally:
        timer.join()


def test_ctrl_c_keeps_what_is_done() -> None:
    """A real signal, after the third result; the rest is None, and the threads end."""
    cases = [walk(0.02), walk(0.02), walk(0.02), walk(0.02, duration=240.0)]

    def after_third(fraction: float) -> None:
        if fraction == 0.75:
            threading.Timer(0.05, signal.raise_signal, (signal.SIGINT,)).start()

    with refused(SimulationInterrupted, about=("3", "4")) as caught:
        hp.simulate_batch(cases, threads=2, keep="summary", progress=after_third)
    assert [type(r) for r in caught.value.results] == [hp.Summary] * 3 + [type(None)]
