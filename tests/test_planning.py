"""Fast plans: one table of knots for walks of any length, a gait checked once per robot."""

from __future__ import annotations

import dataclasses
import gc
import tracemalloc
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from leg_robots import offset_robot
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.commands.app import main
from hexapod_pin.commands.progress import ProgressBar
from hexapod_pin.control import KinematicControl, gait_refusal
from hexapod_pin.control import kinematic as walk_knots
from hexapod_pin.control.foot_control.stability import kept_loops
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import trajectory_curve
from hexapod_pin.control.knot_table import knot_times, sample_knots
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.control.walk_plan import WalkPlan
from hexapod_pin.errors import GaitError, ParameterError, SimulationInterrupted
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.robot import Robot, load_robot, robot_content
from hexapod_pin.simulation.case import run_case
from hexapod_pin.simulation.plant import motion_at

GAITS = {
    "tripod": Gait.tripod(stroke=0.08, cycle_time=1.6),
    "tetrapod": Gait.tetrapod(stroke=0.1),
    "turning": Gait.ripple(stroke=0.05, turn_rate=0.1, heading=0.5),
    "no event at whole cycles": Gait.custom((0.1, 0.4, 0.7, 0.6, 0.9, 0.2), 0.71, stroke=0.06),
}


def test_positions_and_velocities_together_are_those_apart() -> None:
    robot = load_robot("athena")
    path = FootPath(GAITS["turning"], leg_group(robot).neutral_feet, stop_at=16.8)
    time = np.linspace(0.0, 20.0, 777)
    p_BF, v_BF = path.positions_and_velocities(time)
    np.testing.assert_array_equal(p_BF, path.positions(time))
    np.testing.assert_array_equal(v_BF, path.velocities(time))
    few = [0, 300, 776]  # footholds far apart are not tabulated
    np.testing.assert_array_equal(path.positions(time[few]), p_BF[few])
    assert path.positions(np.zeros(0)).shape == (0, 6, 3)


def test_knots_part_every_span_as_linspace_does() -> None:
    events = np.array([0.0, 0.4, 0.400001, 1.7, 2.0])
    time, first = knot_times(events, 0.01)
    np.testing.assert_array_equal(time[first], events)
    for index, (begin, end) in enumerate(zip(events[:-1], events[1:], strict=True)):
        count = first[index + 1] - first[index]
        expected = np.linspace(begin, end, count, endpoint=False)
        np.testing.assert_array_equal(time[first[index] : first[index + 1]], expected)
    assert np.diff(time).max() <= 0.01 * (1.0 + 1e-9)


def directly(robot: Robot, gait: Gait, end: float, stop_at: float | None) -> list[Array]:
    """Return times, angles and rates of a plan without any table: one evaluation of all knots."""
    legs = leg_group(robot)
    path = FootPath.of(legs, gait, stop_at=stop_at)
    spacing = 0.01
    while True:
        time, _ = knot_times(np.array([0.0, *path.events(end), end]), spacing)
        knots = sample_knots(legs, path, time)
        if knots.error.max() <= 0.5e-6:
            return [knots.time, knots.q, knots.v]
        spacing *= 0.5


@pytest.mark.parametrize(
    ("name", "gait"), list(zip(("kharagpur", "athena") * 2, GAITS, strict=True))
)
def test_plan_from_the_table_equals_one_without(name: str, gait: str) -> None:
    """Until the first event that is not before the end, a cycle later at most."""
    robot, walk, plans = load_robot(name), GAITS[gait], []
    for cycles in (11.35, 6.6, 3.05, 3.0, 1.0, 0.4, 0.003):
        duration = cycles * walk.cycle_time
        plans.append(KinematicControl(walk).plan(robot, duration))
        last = plans[-1].time[-1]
        assert duration - 1e-6 * walk.cycle_time <= last < duration + walk.cycle_time
    expected = directly(robot, walk, float(plans[0].time[-1]), None)
    for plan in plans:
        for found, wanted in zip((plan.time, plan.q, plan.v), expected, strict=True):
            assert len(found) <= len(wanted)
            first = wanted[: len(found)]
            np.testing.assert_allclose(found, first, rtol=0.0, atol=2e-11)  # d'' of the roll: 1e-12


@pytest.mark.parametrize(
    ("name", "gait", "stop", "cycles"),
    [
        (("kharagpur", "athena")[k], gait, (3.25, 4.0, 9.3)[i % 3], (11.0, 3.1, 0.5)[(i + k) % 3])
        for i, gait in enumerate(GAITS)
        for k in (0, 1)
    ],
)
def test_plan_that_stops_equals_one_without_table(
    name: str, gait: str, stop: float, cycles: float
) -> None:
    """Stops before and after the walk is steady, with durations on either side of them."""
    robot, walk = load_robot(name), GAITS[gait]
    duration, stop_at = cycles * walk.cycle_time, stop * walk.cycle_time
    plan = KinematicControl(walk, stop_at=stop_at).plan(robot, duration)
    assert plan.time[-1] >= min(duration, stop_at) - 1e-6 * walk.cycle_time
    assert plan.time[-1] <= stop_at + 1e-12
    expected = directly(robot, walk, float(plan.time[-1]), stop_at)
    for found, wanted in zip((plan.time, plan.q, plan.v), expected, strict=True):
        assert found.shape == wanted.shape
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=2e-11)


@pytest.mark.parametrize("gait", GAITS.values(), ids=GAITS.keys())
@pytest.mark.parametrize(("name", "stop"), [("kharagpur", None), ("athena", 5.3)])
def test_knots_of_a_shorter_walk_are_the_first_of_a_longer_one(
    name: str, gait: Gait, stop: float | None
) -> None:
    """To the bit, so that a run that is cut and continued is the uncut one."""
    robot = load_robot(name)
    control = KinematicControl(gait, stop_at=None if stop is None else stop * gait.cycle_time)
    longest = control.plan(robot, 9.2 * gait.cycle_time)
    for cycles in (0.01, 0.5, 1.0, 2.7, 3.0, 4.4, 5.0, 5.3, 7.77):
        plan = control.plan(robot, cycles * gait.cycle_time)
        count = len(plan.time)
        for name in ("time", "q", "v"):
            np.testing.assert_array_equal(getattr(plan, name), getattr(longest, name)[:count])


def test_steady_cycles_are_the_same_to_the_bit() -> None:
    robot, gait = load_robot("athena"), GAITS["tetrapod"]
    plan = KinematicControl(gait).plan(robot, 20.0 * gait.cycle_time)
    cycle = int(np.searchsorted(plan.time, 3.0 * gait.cycle_time - 1e-6))
    cycle -= int(np.searchsorted(plan.time, 2.0 * gait.cycle_time - 1e-6))
    steady = plan.q[-1 - 17 * cycle : -1 - cycle]
    np.testing.assert_array_equal(steady[cycle:], steady[:-cycle])


def test_legs_of_another_shape_walk_for_many_cycles(tmp_path: Path) -> None:
    robot = offset_robot(tmp_path)
    gait = Gait.tetrapod(stroke=0.06, cycle_time=1.5)
    plan = KinematicControl(gait).plan(robot, 6.0)
    _, q, v = directly(robot, gait, 6.0, None)
    np.testing.assert_allclose(plan.q, q, atol=1e-8)  # Newton's tolerance of 1e-9 m over 0.1 m
    np.testing.assert_allclose(plan.v, v, atol=1e-7)


def test_twenty_minutes_take_little_more_memory_than_its_knots() -> None:
    robot, control = load_robot("kharagpur"), KinematicControl(GAITS["tetrapod"])
    control.plan(robot, 10.0)
    peaks = []
    for duration in (200.0, 1200.0):
        gc.collect()
        tracemalloc.start()
        plan = control.plan(robot, duration)
        own = plan.time.nbytes + plan.q.nbytes + plan.v.nbytes
        peaks.append(tracemalloc.get_traced_memory()[1] / own)
        tracemalloc.stop()
        assert len(plan.time) == pytest.approx(duration / 0.005, rel=0.02)
    assert max(peaks) < 1.3


def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record the name of every gait that is really checked."""
    checked: list[str] = []
    check = gait_refusal.violation
    gait_refusal._find_refusal.cache_clear()

    def violation(legs: LegGroup, gait: Gait, motion: object) -> object:
        checked.append(gait.name)
        return check(legs, gait, motion)

    monkeypatch.setattr(gait_refusal, "violation", violation)
    return checked


def test_a_gait_is_checked_once_for_equal_robots(monkeypatch: pytest.MonkeyPatch) -> None:
    checked = counted(monkeypatch)
    robot = load_robot("kharagpur")
    for duration in (1.0, 2.0, 30.0):
        KinematicControl(Gait.tripod(name="first", stroke=0.1)).plan(robot, duration)
    KinematicControl(Gait.tripod(name="first", stroke=0.1), stop_at=20.0).plan(robot, 2.0)
    assert checked == ["first"]
    KinematicControl(Gait.tripod(name="second", stroke=0.09)).plan(robot, 1.0)
    assert checked == ["first", "second"]
    again = load_robot("kharagpur")
    KinematicControl(Gait.tripod(name="first", stroke=0.1)).plan(again, 1.0)
    assert checked == ["first", "second"]
    wider = dataclasses.replace(again, velocity_limit=1.5 * again.velocity_limit)
    KinematicControl(Gait.tripod(name="first", stroke=0.1)).plan(wider, 1.0)
    assert checked == ["first", "second", "first"]


def test_a_refusal_is_found_once_and_raised_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    checked = counted(monkeypatch)
    robot, control = load_robot("kharagpur"), KinematicControl(Gait.tripod(cycle_time=0.3))
    refusals = []
    for _ in range(2):
        with pytest.raises(GaitError) as caught:
            control.plan(robot, 1.0)
        refusals.append(caught.value)
    evaluations = len(checked)
    with pytest.raises(GaitError):
        control.plan(robot, 3.0)
    assert len(checked) == evaluations > 1
    first, second = refusals
    assert first is not second
    assert str(first) == str(second)
    assert (first.quantity, first.limit) == (second.quantity, second.limit)


def test_robots_are_equal_to_caches_where_all_that_they_hold_is(tmp_path: Path) -> None:
    first, second = load_robot("kharagpur"), load_robot("kharagpur")
    leg_group(first).joint_angles(leg_group(first).neutral_feet[None])  # makes its solver
    other = dataclasses.replace(second, velocity_limit=2.0 * second.velocity_limit)
    text = second.urdf.replace('radius="0.01"', 'radius="0.016"')
    (tmp_path / "other.urdf").write_text(text)
    wider = load_robot(tmp_path / "other.urdf")
    for key in (leg_group, leg_bodies, robot_content):
        assert key(first) == key(second) and hash(key(first)) == hash(key(second))
        assert key(first) != key(wider)
    assert leg_group(first) != leg_group(other) and robot_content(first) != robot_content(other)
    assert kept_loops(first) is kept_loops(second) is not kept_loops(other)


def test_narrower_limits_are_another_robot() -> None:
    """What was found for a robot does not serve one with other joint limits."""
    robot, gait = load_robot("kharagpur"), Gait.tetrapod()
    KinematicControl(gait).plan(robot, 1.0)
    slow = dataclasses.replace(robot, velocity_limit=np.full(len(robot.joint_names), 0.1))
    with refused(GaitError, quantity="cycle_time"):
        KinematicControl(gait).plan(slow, 1.0)


def test_plans_do_not_keep_a_robot_in_memory() -> None:
    robot = load_robot("athena")
    KinematicControl(GAITS["tripod"]).plan(robot, 2.0)
    alive = weakref.ref(robot)
    del robot
    gc.collect()
    assert alive() is None


@pytest.mark.parametrize("make", [Gait.ripple, Gait.wave, Gait.tetrapod])
def test_of_legs_that_are_equally_fast_the_first_is_named(make: Callable[..., Gait]) -> None:
    """Front left and rear right move equally; rounding does not choose between them."""
    with refused(GaitError, quantity="cycle_time", about=("lf_coxa_joint",)):
        KinematicControl(make(cycle_time=0.3)).plan(load_robot("kharagpur"), 1.0)


# Planning a long walk reports how far it is, and Ctrl-C ends it as it ends a run.

SWAYING = hp.motion.BodyMotion(lateral=hp.motion.Sine(amplitude=0.002, period=3.1))


@pytest.fixture
def case(monkeypatch: pytest.MonkeyPatch) -> hp.Case:
    """A walk that does not repeat, planned in blocks of a tenth of a second."""
    monkeypatch.setattr(walk_knots, "BLOCK_KNOTS", 10)
    gait = hp.Gait.tetrapod(stroke=0.05, cycle_time=2.4)
    control = hp.KinematicControl(gait, body=SWAYING)
    return hp.Case(hp.Scene(hp.load_robot("kharagpur")), control, duration=6.0, accuracy=1e-3)


def test_planning_tells_its_share_before_the_run_begins(case: hp.Case) -> None:
    reports: list[tuple[str, float]] = []
    run_case(
        case,
        lambda share: reports.append(("run", share)),
        lambda share: reports.append(("plan", share)),
    )
    kinds = [kind for kind, _ in reports]
    planned = [share for kind, share in reports if kind == "plan"]
    assert kinds == sorted(kinds)  # "plan" before "run"
    assert len(planned) > 5
    assert planned == sorted(planned)
    assert planned[0] == 0.0
    assert planned[-1] <= 1.0


def test_an_interrupted_plan_is_a_typed_error_without_samples(case: hp.Case) -> None:
    def stop(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    with refused(SimulationInterrupted, trace=None, about=("planned",)):
        run_case(case, planning=stop)


def test_the_command_ends_as_a_run_does_and_leaves_nothing(
    case: hp.Case,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = case.save(tmp_path / "case.toml")

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(ProgressBar, "stage", lambda bar, title: stop)
    with pytest.raises(SystemExit) as caught:
        main(["run", str(path), "--out", str(tmp_path / "run.nc"), "--no-html"])
    assert caught.value.code == 130
    assert "nothing was simulated" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["case.toml"]


def test_a_prescribed_start_is_read_off_the_knots_around_it() -> None:
    """A long plan is not handed over once more for it; the bits are those of the whole plan."""
    from hexapod_pin import native

    gait = hp.Gait.tetrapod(stroke=0.05, cycle_time=2.4)
    plan = hp.KinematicControl(gait).plan(hp.load_robot("kharagpur"), 5.0)
    for time in (0.0, 1e-4, float(plan.time[7]), 1.2345, float(plan.time[-1]), 99.0):
        whole = native.set_points_at(
            time=plan.time.tolist(), position=plan.q, rate=plan.v, kind=plan.kind,
            acceleration=np.zeros((0, 0)), at=time,
        )  # fmt: skip
        angle, rate = motion_at(plan, time)
        assert np.array_equal(angle, whole[0])
        assert np.array_equal(rate, whole[1])


# A plan at one instant, for controllers of one's own.


@pytest.mark.parametrize("name", ["kharagpur", "athena"])
def test_a_walk_plan_is_that_of_the_controller_at_any_time(name: str) -> None:
    """Angles to the error of the knots' cubics, 1e-5 rad; rates by difference quotients; feet."""
    robot, gait = hp.load_robot(name), hp.Gait.tripod(stroke=0.06, cycle_time=1.2)
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
    alone = plan.at(float(time[20]))
    np.testing.assert_allclose(alone.q, found.q[20], atol=1e-12)
    assert alone.stance.tolist() == found.stance[20].tolist()
    assert found.stance.sum(axis=1).min() >= 3 and found.feet.shape == (57, 6, 3)
    assert [robot.feet[k].name for k in plan.foot_index] == [
        robot.leg(leg).foot for leg in plan.legs
    ]
    with refused(ParameterError, "time"):
        plan.at([1.0, 0.5])
    with refused(GaitError, quantity="cycle_time"):
        WalkPlan(robot, hp.Gait.tripod(stroke=0.06, cycle_time=0.1))
