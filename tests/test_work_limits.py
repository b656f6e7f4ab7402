"""Limits of a run: refused before it starts, or ended with its samples so far."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, SimulationInterrupted, WorkLimitError
from hexapod_pin.simulation.run_settings import chosen_limits

ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
HOLD = hp.HoldPosture()
DROP = hp.State(np.concatenate([[0, 0, 0.5, 0, 0, 0, 1], ROBOT.posture]), np.zeros(24))


def stiff() -> hp.Scene:
    """Return a scene whose friction changes sign within 1e-18 m/s: no step can follow it."""
    contact = hp.Contact.preset("s1")
    friction = hp.contact.TanhCoulomb(mu=0.7, slope=1e18)
    return hp.Scene(ROBOT, contact=contact.model_copy(update={"friction": friction}))


def test_absurd_runs_are_refused_with_the_number_and_the_remedy():
    few = {"method": "robust", "sample": 1.0, "record": ["motion"]}
    for settings, name, value, number in (
        ({"duration": 1e6}, "duration", 1e6, 5e8),
        ({"duration": 86400.0}, "sample", 2e-3, 43_200_000),
        ({"duration": 1e-3, "step": 1e-9}, "step", 1e-9, 1e-7),
        ({"duration": 1e6, **few}, "duration", 1e6, 1e9),
    ):
        remedy = ("allow=True", "--force")
        with refused(ParameterError, name, value, allowed=(number,), about=remedy):
            hp.simulate(SCENE, HOLD, **settings)
    limits = hp.simulation.WorkLimits
    assert chosen_limits(None, False) == limits() and chosen_limits(None, True) == limits.none()


def test_steps_that_shrink_for_ever_end_with_cause_and_samples():
    """In a batch, where the other case has an end of its own."""
    endless = hp.Case(stiff(), HOLD, DROP, duration=0.5, method="ndf", accuracy=1e-5)
    limits = hp.simulation.WorkLimits(smallest_step=1e-9)
    cases = [endless, hp.Case(SCENE, HOLD, duration=0.1)]
    error, whole = hp.simulate_batch(cases, threads=2, estimate=False, limits=limits)
    assert whole.time[-1] == pytest.approx(0.1)
    assert isinstance(error, WorkLimitError) and error.limit == "smallest_step"
    assert "HuntCrossley + TanhCoulomb" in str(error) and "_joint" in str(error)
    assert 0.25 < error.trace.time[-1] < 0.29  # it has fallen on its feet
    assert np.isfinite(error.trace.q).all()


@pytest.mark.parametrize(
    ("method", "settings"),
    [("dop853", {"accuracy": 1e-6}), ("ndf", {"accuracy": 1e-7}), ("robust", {"step": 1e-4})],
)
def test_evaluations_and_wall_time_end_a_run_at_its_next_look(method: str, settings: dict):
    limits = hp.simulation.WorkLimits(evaluations=2000)
    with pytest.raises(WorkLimitError) as caught:
        hp.simulate(SCENE, HOLD, duration=20.0, method=method, initial=DROP, limits=limits,
                    estimate=False, **settings)  # fmt: skip
    assert caught.value.limit == "evaluations"
    assert 2000 <= caught.value.trace.counters["evaluations"] < 2200
    session = hp.Session(SCENE, method=method, **settings, limits=limits)
    with pytest.raises(WorkLimitError):
        session.advance(20.0)
    limits = hp.simulation.WorkLimits(wall_time=0.05)
    with pytest.raises(WorkLimitError) as caught:
        hp.simulate(SCENE, HOLD, duration=1000.0, step=1e-4, sample=1.0, limits=limits)
    assert caught.value.limit == "wall_time"


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf"])
def test_a_run_goes_on_from_where_its_limit_ended_it(method: str):
    accuracy, evaluations = {"extrapolated-euler": (1e-6, 1500), "ndf": (1e-8, 400)}[method]
    settings = dict(accuracy=accuracy, method=method, estimate=False, sample=1e-3)
    whole = hp.simulate(SCENE, HOLD, duration=0.4, initial=DROP, **settings)
    with pytest.raises(WorkLimitError) as caught:
        hp.simulate(SCENE, HOLD, duration=0.4, initial=DROP, **settings,
                    limits=hp.simulation.WorkLimits(evaluations=evaluations))  # fmt: skip
    part, start = caught.value.trace, caught.value.trace.checkpoint
    assert 10 < len(part.time) and np.array_equal(part.q, whole.q[: len(part.q)])
    assert 0.0 < start.time < 0.4
    left = round((0.4 - start.time) / 1e-3 - 0.5) * 1e-3
    rest = hp.simulate(SCENE, HOLD, duration=left, initial=start, **settings)
    there = np.searchsorted(whole.time, rest.time[-1] - 1e-9)
    assert rest.q[-1] == pytest.approx(whole.q[there], abs=10 * accuracy)


def test_threads_out_of_range():
    for threads, name in ((0, "threads"), (2000, "threads"), (True, "simulate_batch.threads")):
        with refused(ParameterError, name, threads):
            hp.simulate_batch([hp.Case(SCENE, HOLD, duration=0.01)], threads=threads)


@pytest.mark.little_memory
def test_threads_that_cannot_start_are_an_error_not_an_abort():
    """With room for some stacks only: those that have begun end, and a smaller batch runs."""
    code = """
import resource, hexapod_pin as hp
case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.01)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 200 * 2**20,) * 2)
try:
    hp.simulate_batch(iter([case] * 900), threads=900)
except hp.errors.ParameterError as error:
    print(error)
print(hp.simulate_batch([case, case], threads=2)[1].time[-1])
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "threads = 900" in done.stdout and "the system has started" in done.stdout
    assert done.stdout.endswith("\n0.01\n")


def test_ctrl_c_ends_a_batch_with_its_results():
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    long = hp.Case(SCENE, HOLD, duration=2000.0, step=1e-4, sample=1000.0)
    with pytest.raises(SimulationInterrupted) as caught:
        hp.simulate_batch([hp.Case(SCENE, HOLD, duration=0.01), long, long], threads=3)
    kinds = [hp.Trace, type(None), type(None)]
    assert [type(result) for result in caught.value.results] == kinds
