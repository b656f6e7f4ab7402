"""Plans: one table of knots for walks of any length, long ones part by part, checked once."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from conftest import Run
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.commands.progress import ProgressBar
from hexapod_pin.control import KinematicControl, gait_refusal
from hexapod_pin.control import kinematic as walk_knots
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import trajectory_curve
from hexapod_pin.control.knot_table import knot_times, sample_knots
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.control.walk_plan import WalkPlan
from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.robot.robot import Robot, load_robot
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


GAITS = {
    "turning": Gait.ripple(stroke=0.05, turn_rate=0.1, heading=0.5),
    "no event at whole cycles": Gait.custom((0.1, 0.4, 0.7, 0.6, 0.9, 0.2), 0.71, stroke=0.06),
}


def directly(robot: Robot, gait: Gait, end: float, stop_at: float | None) -> list[Array]:
    """Return times, angles and rates of a plan without any table: one evaluation of all knots."""
    legs = leg_group(robot)
    path = FootPath.of(legs, gait, stop_at=stop_at)
    for spacing in (0.01, 0.005, 0.0025):
        time, _ = knot_times(np.array([0.0, *path.events(end), end]), spacing)
        knots = sample_knots(legs, path, time)
        if knots.error.max() <= 0.5e-6:
            break
    return [knots.time, knots.q, knots.v]


@pytest.mark.parametrize(
    ("name", "gait", "stop"),
    [
        ("kharagpur", "turning", None),
        ("kharagpur", "no event at whole cycles", 3.25),
        ("athena", "turning", 9.3),
    ],
)
def test_plan_from_the_table_equals_one_without(name: str, gait: str, stop: float | None) -> None:
    """It ends a cycle late at most; a shorter one is the first of a longer one to the bit."""
    robot, walk = load_robot(name), GAITS[gait]
    cycle, last = walk.cycle_time, np.inf if stop is None else stop * walk.cycle_time
    control = KinematicControl(walk, stop_at=None if stop is None else last)
    longest = control.plan(robot, 11.35 * cycle)
    for cycles in (11.35, 5.3, 3.05, 3.0, 1.0, 0.003):
        plan = control.plan(robot, cycles * cycle)
        assert plan.time[-1] >= min(cycles * cycle, last) - 1e-6 * cycle
        assert plan.time[-1] < ((cycles + 1.0) * cycle if stop is None else last + 1e-12)
        for part in ("time", "q", "v"):
            whole = getattr(longest, part)
            np.testing.assert_array_equal(getattr(plan, part), whole[: len(plan.time)])
    expected = directly(robot, walk, float(longest.time[-1]), None if stop is None else last)
    for found, wanted in zip((longest.time, longest.q, longest.v), expected, strict=True):
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=2e-11)  # d'' of the roll: 1e-12


def test_a_gait_is_checked_once_for_equal_robots(monkeypatch: pytest.MonkeyPatch) -> None:
    """A refusal too, which is raised each time; other limits of joints are another robot."""
    checked: list[str] = []
    check = gait_refusal.violation
    gait_refusal._find_refusal.cache_clear()

    def violation(legs: LegGroup, gait: Gait, motion: object) -> object:
        checked.append(gait.name)
        return check(legs, gait, motion)

    monkeypatch.setattr(gait_refusal, "violation", violation)
    robot = load_robot("kharagpur")
    first = Gait.tripod(name="first", stroke=0.1)
    for duration in (1.0, 30.0):
        KinematicControl(first).plan(robot, duration)
    KinematicControl(first, stop_at=20.0).plan(robot, 2.0)
    assert checked == ["first"]
    KinematicControl(first).plan(load_robot("kharagpur"), 1.0)
    assert checked == ["first"]
    wider = dataclasses.replace(robot, velocity_limit=1.5 * robot.velocity_limit)
    KinematicControl(first).plan(wider, 1.0)
    assert checked == ["first", "first"]
    refusals, counts = [], []
    for duration in (1.0, 3.0):
        with pytest.raises(GaitError) as caught:
            KinematicControl(Gait.tripod(cycle_time=0.3)).plan(robot, duration)
        refusals.append(caught.value)
        counts.append(len(checked))
    assert counts[0] == counts[1] > 3
    one, other = refusals
    assert one is not other and str(one) == str(other)
    assert (one.quantity, one.limit) == (other.quantity, other.limit)


def test_an_interrupted_plan_of_a_command_leaves_nothing(run: Run, monkeypatch) -> None:
    """A walk that does not repeat, planned in blocks of 0.1 s; its share is reported."""
    monkeypatch.setattr(walk_knots, "BLOCK_KNOTS", 10)
    body = hp.motion.BodyMotion(lateral=hp.motion.Sine(amplitude=0.002, period=3.1))
    control = KinematicControl(Gait.tetrapod(stroke=0.05, cycle_time=2.4), body=body)
    case = hp.Case(hp.Scene(load_robot("kharagpur")), control, duration=6.0, accuracy=1e-3)
    case.save("case.toml")
    shares = []

    def stop(share: float) -> None:
        shares.append(share)
        if share > 0.3:
            raise KeyboardInterrupt

    monkeypatch.setattr(ProgressBar, "stage", lambda bar, title: stop)
    done = run("run", "case.toml", "--out", "run.nc", "--no-html")
    assert done.status == 130 and "nothing was simulated" in done.err
    assert done.left == ["case.toml"]
    assert len(shares) > 2 and shares == sorted(shares) and shares[-1] < 0.5


def test_a_walk_plan_is_that_of_the_controller_at_any_time() -> None:
    """Angles to the error of the knots' cubics, 1e-5 rad; rates by difference quotients; feet."""
    robot, gait = hp.load_robot("athena"), hp.Gait.tripod(stroke=0.06, cycle_time=1.2)
    plan, time = WalkPlan(robot, gait), np.linspace(0.0, 4.0, 57)
    found = plan.at(time)
    curve = trajectory_curve(hp.KinematicControl(gait).plan(robot, 4.5))
    np.testing.assert_allclose(found.q, curve(time), atol=1e-5)
    step = 1e-6
    difference = (plan.at(time + step).q - found.q) / step
    smooth = np.abs(found.v - curve(time, 1)).max(axis=1) < 1e-2  # no lift-off in between
    assert smooth.mean() > 0.8
    np.testing.assert_allclose(difference[smooth], found.v[smooth], atol=1e-3)
    np.testing.assert_allclose(plan.feet(found.q), found.feet, atol=1e-12)
    np.testing.assert_allclose(plan.joint_angles(found.feet, found.q), found.q, atol=1e-12)
    np.testing.assert_allclose(plan.at(float(time[20])).q, found.q[20], atol=1e-12)
    assert found.stance.sum(axis=1).min() >= 3 and found.feet.shape == (57, 6, 3)
    with refused(ParameterError, "time"):
        plan.at([1.0, 0.5])
