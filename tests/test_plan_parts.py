"""Long walks are planned part by part: the same knots, and no more of them in memory."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation import open_loop
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.open_loop import PlanParts, open_loop_run, plan_of

ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
GAIT = hp.Gait.tripod(stroke=0.1, cycle_time=1.3)


@pytest.mark.parametrize(
    ("method", "stop_at"), [("extrapolated-euler", 9.0), ("ndf", None), ("robust", 9.0)]
)
def test_a_walk_in_parts_has_the_bits_of_one_that_is_planned_at_once(
    method: str, stop_at: float | None, monkeypatch: pytest.MonkeyPatch
):
    settings = {"step": 2e-3} if method == "robust" else {"accuracy": 1e-5, "estimate": False}
    run = dict(duration=12.0, method=method, sample=0.1, **settings)
    control = hp.KinematicControl(GAIT, stop_at=stop_at)
    monkeypatch.setattr(open_loop, "PART", 120.0)
    whole = hp.simulate(SCENE, control, **run)
    for length in (3.0, 5.0):  # of 5 s: samples end where the knots do, and ndf steps beyond them
        monkeypatch.setattr(open_loop, "PART", length)
        part = hp.simulate(SCENE, control, **run)
        assert np.array_equal(part.q, whole.q)
        assert np.array_equal(part.torque, whole.torque)
        assert np.array_equal(part.q_ref, whole.q_ref)
        assert part.counters == whole.counters


@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf"])
def test_a_run_of_a_longer_plan_is_given_the_knots_that_it_comes_by(method: str):
    """Not those of the rest, which change no bit, also where it begins amid the plan."""
    control = hp.KinematicControl(GAIT)
    longer = control.plan(ROBOT, 10.0)
    start = hp.simulate(SCENE, control, duration=3.0, accuracy=1e-4, estimate=False).checkpoint
    for initial, begin in ((None, 0.0), (start, 3.0)):
        case = hp.Case(
            SCENE, control, duration=0.4, accuracy=1e-4, method=method, estimate=False,
            initial=initial,
        )  # fmt: skip
        run = open_loop_run(case, case.settings)
        same = NativeRun(SCENE, run.settings, run.start, longer)
        run.advance()
        same.advance()
        assert same.rollout.plan_end < begin + 0.5 < longer.time[-1]
        ours, others = same.rollout.record(), run.rollout.record()
        assert all(np.array_equal(ours[name], others[name]) for name in others)


def test_no_more_is_planned_than_a_run_needs():
    """A part and its margin; a run after a day was planned from 0 on: 8 GB for a cycle."""
    case = hp.Case(SCENE, hp.KinematicControl(GAIT), duration=39000.0, sample=1.3)
    run = open_loop_run(case, case.settings, in_parts=True)
    assert open_loop.PART <= run.rollout.plan_end <= open_loop.PART + 4 * GAIT.cycle_time
    begin, end = 500_000.0, 500_003.0
    plan, parts = plan_of(hp.KinematicControl(GAIT), ROBOT, begin, end, 1e9, in_parts=True)
    assert isinstance(parts, PlanParts)
    assert begin - GAIT.cycle_time <= plan.time[0] <= begin
    assert end <= plan.time[-1] < end + 4.0 * GAIT.cycle_time
    early = hp.KinematicControl(GAIT).plan(ROBOT, 20.0)
    phase = plan.time % GAIT.cycle_time
    k = int(np.argmin(np.abs(early.time[early.time > 6.5] % GAIT.cycle_time - phase[0])))
    assert plan.q[0] == pytest.approx(early.q[early.time > 6.5][k], abs=1e-9)


def test_plans_that_are_too_large_are_refused():
    """One of 1e9 s took 1.5 TB, or ended in an IndexError, where `plan` was called directly."""
    with refused(ParameterError, "duration", 1e300, allowed=(5e5,)):
        hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3)).plan(ROBOT, 1e300)
    body = hp.motion.BodyMotion(height=hp.motion.Sine(amplitude=0.005, period=3.1))
    control = hp.KinematicControl(GAIT, body=body)
    with refused(ParameterError, "duration", 1e5, allowed=(4, 8.88), about=("allow=True",)):
        hp.simulate(SCENE, control, duration=1e5, sample=10.0)
    limits = hp.simulation.WorkLimits(steps=1e12)
    with refused(ParameterError, "sample", 1e6, allowed=(4, 88.8)):  # all to be held at once
        hp.simulate(SCENE, hp.KinematicControl(GAIT), duration=1e9, limits=limits, sample=1e6)
