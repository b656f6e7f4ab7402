"""The error of a whole run: carried along, estimated by a second run, controlled, or reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_scenes import KINDS, draw_scene
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.methods import resolve_method
from hexapod_pin.simulation.open_loop import open_loop_run
from hexapod_pin.simulation.resolution import CARRIED_SHARE, FINER_SHARE, Comparison
from hexapod_pin.validation.position_error import PositionError

ROBOT = hp.load_robot("kharagpur")
ATHENA = hp.load_robot("athena")
TRIPOD = hp.Gait.tripod(stroke=0.07, cycle_time=1.0)


def test_the_estimate_is_the_largest_difference_so_far():
    turn = [0.0, 0.0, np.sin(0.05), np.cos(0.05)]
    one = np.array([[x, 0.0, 0.0, *turn, 2e-4] for x in (0.0, 3e-4, 1e-4)])
    other = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0], (3, 1))
    found = ErrorEstimate.between({"q": one}, {"q": other}, 2.0)
    assert found.place == pytest.approx([0.0, 6e-4, 6e-4], rel=1e-12)
    assert found.joint == pytest.approx([4e-4] * 3, rel=1e-12)
    assert found.turn == pytest.approx([0.2] * 3, rel=1e-12)
    assert found.position == pytest.approx([0.2] * 3, rel=1e-12)
    assert found.torque is None


def test_errors_that_stay_are_within_the_accuracy():
    """In free flight nothing damps an error; steps that keep 1e-4 each had come to 50 times it."""
    robot = hp.load_robot("kharagpur")
    q, v = robot.stand().q.copy(), np.zeros(robot.model.nv)
    q[2], v[2], v[3:6] = 50.0, 3.0, (2.0, 4.0, 1.0)
    how = {"duration": 1.0, "initial": robot.check_state(q, v), "sample": 0.05}
    scene, control = hp.Scene(robot), hp.HoldPosture(q[7:])
    truth = hp.simulate(scene, control, method="dop853", accuracy=1e-11, estimate=False, **how)
    run = hp.simulate(scene, control, accuracy=1e-4, **how)
    error = float(ErrorEstimate.between({"q": run.q}, {"q": truth.q}, 1.0).position.max())
    assert error <= run.error_estimate <= 1e-4 and run.accuracy_kept
    assert run.predictable_until == float("inf") and run.counters["runs"] >= 2


def test_errors_of_a_robot_that_is_pushed_off_are_seen():
    """It slides from then on, and the error of its speed stays: both runs had the same steps."""
    loads = [
        hp.Push(link="base_link", position=place, force=force, start=start, duration=duration)
        for place, force, start, duration in (
            ((-0.045, -0.011, -0.032), (2.7, -13.1, 17.6), 0.0681, 0.1026),
            ((0.036, -0.046, 0.025), (3.3, 6.7, -19.6), 0.0707, 0.0552),
        )
    ]
    contact = hp.Contact(
        normal=hp.contact.Restitution(
            stiffness=2e5, exponent=1.5, restitution=0.19, model="lankarani-nikravesh"
        ),
        friction=hp.contact.StickSlip(mu=0.42, mu_dynamic=0.29, stiffness=12200.0, damping=58.0),
    )
    scene = hp.Scene(
        ROBOT, terrain=hp.Slope(angle=0.252, heading=1.123),
        contact=contact, loads=loads,
    )  # fmt: skip

    how = {"duration": 0.5, "sample": 0.01}
    truth = hp.simulate(
        scene, hp.HoldPosture(), method="dop853", accuracy=1e-9, estimate=False, **how
    )
    for accuracy in (1e-3, 1e-4, 1e-5):
        trace = hp.simulate(scene, hp.HoldPosture(), method="x3", accuracy=accuracy, **how)
        assert np.abs(trace.q - truth.q).max() <= min(accuracy, trace.error_estimate)


def test_the_time_up_to_which_an_accuracy_is_met():
    trace = hp.simulate(hp.Scene(ATHENA), hp.HoldPosture(), duration=0.01, accuracy=1e-4)
    error = ErrorEstimate(*(np.linspace(0.0, 4e-4, len(trace.time)) for _ in range(3)))
    worse = hp.Trace(**{**vars(trace), "error": error})
    expected = trace.time[np.flatnonzero(error.position <= 1e-4)[-1]]
    assert worse.predictable_until == pytest.approx(expected)


def test_a_batch_knows_its_errors_too():
    scene = hp.Scene(ATHENA, prescribed=True)
    case = hp.Case(scene, hp.HoldPosture(), duration=0.1, method="x3")
    trace = case.run()
    (batched,), (summary,) = (hp.simulate_batch([case], keep=keep) for keep in ("trace", "summary"))
    assert batched == trace
    finest = case.settings.at_level(case.settings.method_settings.first_levels[1])
    assert trace.counters["runs"] == 2  # of which the finer one is returned
    assert trace.run.numerics.tolerance == finest.method_settings.tolerance
    assert summary.error_estimate == trace.error_estimate and summary.accuracy_kept
    assert np.all(summary.error_of("torque_rms") < 1e-2 * summary.torque_rms.max() + 1e-9)
    with pytest.raises(hp.errors.UnknownNameError):
        summary.error_of("torque")


def test_a_torque_accuracy_may_be_requested_instead():
    scene = hp.Scene(ATHENA)
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.05, torque_accuracy="1 %")
    assert trace.accuracy_kept and trace.run.numerics.method == "ndf"
    assert trace.error.torque[-1] <= 0.01 * np.abs(trace.torque).max()
    tight = hp.simulate(scene, hp.HoldPosture(), duration=0.05, torque_accuracy=1e-4)
    assert tight.error.torque[-1] <= 1e-4
    for bad in (0.0, "150 %", "much"):
        with refused(hp.errors.ParameterError, "torque_accuracy", bad):
            hp.simulate(scene, hp.HoldPosture(), duration=0.05, torque_accuracy=bad)
    with refused(hp.errors.ParameterError, "torque_accuracy", 0.1):
        hp.simulate(scene, hp.HoldPosture(), duration=0.05, step=1e-3, torque_accuracy=0.1)
    with refused(hp.errors.ParameterError, "record", "without torque"):
        hp.simulate(scene, hp.HoldPosture(), duration=0.05, torque_accuracy=0.1, record=[])


def test_a_closed_loop_meets_its_accuracy_on_request():
    scene = hp.Scene(ATHENA)
    control = hp.FootControl(hp.Gait.tripod(stroke=0.06, cycle_time=2.0))
    asked = hp.simulate(scene, control, duration=0.5, estimate=True)
    truth = hp.simulate(scene, control, duration=0.5, method="ndf", accuracy=1e-10)
    assert truth.error is None and truth.counters.get("runs") is None  # run once: unknown
    assert asked.accuracy_kept and asked.counters["runs"] >= 2
    error = float(np.abs(asked.q - truth.q).max())
    assert error <= asked.error_estimate <= 1e-4
    case = hp.Case(scene, control, duration=0.5, estimate=True)
    (summary,) = hp.simulate_batch([case], keep="summary")
    assert summary.error_estimate == asked.error_estimate
    share = hp.Case(scene, control, duration=0.5, torque_accuracy="2 %", estimate=False)
    for one in (case, share):
        assert hp.Case.from_toml(one.to_toml()) == one


def test_amplification_is_the_distance_of_its_two_runs_over_that_of_their_starts():
    drawn = draw_scene(5, 0, {"thrown": KINDS["thrown"]})
    found = hp.simulation.amplification(
        drawn.scene, drawn.controller, duration=0.2, sample=0.01, initial=drawn.initial
    )
    one, other = (run.q for run in found.runs)
    place = np.linalg.norm(one[:, :3] - other[:, :3], axis=1)
    turn = 2.0 * np.arccos(np.clip(np.abs((one[:, 3:7] * other[:, 3:7]).sum(axis=1)), 0.0, 1.0))
    start = (other[0, :3] - one[0, :3]) / 1e-6
    assert np.abs(start).max() <= 1.0 + 1e-9 and place[0] > 1e-7
    apart = np.maximum.accumulate(np.maximum(place, turn)) / 1e-6
    # arccos near 1 loses half the digits: 1e-8 rad of 1e-6
    assert found.factor == pytest.approx(apart, rel=0.05)
    assert found.factor[-1] > 1.5 * found.factor[0] and found.at(0.2) == found.factor[-1]
    assert np.isnan(found.at(3.0))
    late = found.time >= 0.1
    rate = np.polyfit(found.time[late], np.log(found.factor[late]), 1)[0]
    assert found.rate == pytest.approx(rate) and rate > 0.0
    horizon = 0.2 + np.log(1e-4 / 1e-15 / found.factor[-1]) / rate
    assert found.horizon(1e-4) == pytest.approx(horizon)
    with refused(hp.errors.ParameterError, "duration", 0.0):
        hp.simulation.amplification(
            drawn.scene, drawn.controller, duration=0.0, initial=drawn.initial
        )


@pytest.mark.parametrize(("mu_dynamic", "levels"), [(0.5, (4, 0)), (0.4, (0, 8))])
def test_friction_that_drops_where_a_foot_breaks_away_asks_for_a_finer_second_run(
    mu_dynamic: float, levels: tuple[int, int]
) -> None:
    """Whether a foot that comes to rest sticks is up to any error: a hundredth of tolerance."""
    friction = hp.contact.StickSlip(mu=0.5, mu_dynamic=mu_dynamic, stiffness=2e4, damping=60.0)
    contact = hp.Contact(normal=hp.Contact.accurate().normal, friction=friction)
    scene = hp.Scene(ATHENA, contact=contact)
    assert scene.sensitive == (8 in levels)
    case = hp.Case(scene, hp.HoldPosture(), duration=0.1, method="extrapolated-euler")
    choice = case.settings.method_settings
    assert choice.first_levels == levels and choice.carries_error == (4 in levels)
    coarse, fine = (replace(choice, refinement=level).tolerance for level in sorted(levels))
    assert fine == pytest.approx(coarse * 10.0 ** (-max(levels) / 4), rel=1e-12)


@pytest.mark.parametrize(
    ("seed", "index", "method", "accuracy", "once"),
    [
        (79040025, 47, "ndf", 1e-7, "coarse and fine runs off alike: x2.3"),
        (841333962, 299, "x3", 1e-3, "two loose runs equally wrong about what slides: x6.5"),
        (760322070, 372, "x3", 1e-4, "a foot leaves and is back within a step: x2.2"),
        (123352390, 229, "x3", 1e-4, "a body without joints that barely leaves: x2.6"),
        (352663886, 335, "x3", 1e-4, "a foot comes to rest, sticks or just not: x3.4"),
        (859092696, 61, "x3", 1e-3, "hops of 7 um that carry it on: x3.1"),
    ],
)
def test_scenes_that_were_once_missed_without_a_word(seed, index, method, accuracy, once):
    drawn = draw_scene(seed, index, KINDS)
    truth = drawn.run(method="dop853", accuracy=min(1e-9, 1e-3 * accuracy), estimate=True)
    assert truth.error_estimate < max(1e-9, 1e-3 * accuracy)
    run = drawn.run(method=method, accuracy=accuracy, estimate=True)
    error = PositionError.between(run.q, truth.q).q
    assert error <= run.error_estimate <= accuracy


def test_runs_that_go_the_same_wrong_way_on_a_ramps_edge_are_found_out() -> None:
    """Errors grow 160-fold in 5 ms until a foot takes its neighbours' load: x4.4 without a word."""
    run = draw_scene(2611291241, 121).run(method="ndf", accuracy=1e-3)
    assert not run.accuracy_kept and run.counters["runs"] == 4


def test_runs_that_ticks_or_dry_friction_cut_have_a_wider_bound() -> None:
    """Their difference counts more, at any distance of the levels; of other runs as before."""
    robot, usual = hp.load_robot("kharagpur"), resolve_method("ndf", 1e-4, None, None)
    motor = hp.Motor(stall_torque=5.0, no_load_speed=6.0, dry_friction=0.1)
    plain = hp.Scene(robot)
    dry = hp.Scene(robot, servo=hp.Servo(kp=60.0, kd=1.2, motor=motor))
    assert not usual.for_scene(plain).slow_decay
    assert usual.for_scene(plain, feedback=True).slow_decay
    assert usual.for_scene(dry).slow_decay
    for finer in (4, 8):
        wide, narrow = (Comparison(0, finer, 0.5, slow=slow) for slow in (True, False))
        assert wide.error_ratio == pytest.approx(1.75)
        assert narrow.error_ratio == pytest.approx(0.5 * FINER_SHARE[finer])
        assert narrow.kept and not wide.kept


def errors_of(trace: hp.Trace, truth: hp.Trace) -> dict[str, float]:
    apart = ErrorEstimate.between(
        {name: getattr(trace, name) for name in ("q", "torque", "foot_force")},
        {name: getattr(truth, name) for name in ("q", "torque", "foot_force")},
        1.0,
    )
    return {name: float(error[-1]) for name, error in apart.arrays.items()}


@pytest.mark.parametrize(
    "scene",
    [hp.Scene(ROBOT, contact=hp.Contact.s2()), hp.Scene(ATHENA, contact=hp.Contact.s1())],
)
def test_one_run_bounds_its_error_closely(scene: hp.Scene):
    """By methods that share neither linearisation nor history: bounds of 1 to 30 times it."""
    control = hp.KinematicControl(TRIPOD)
    method = "extrapolated-euler" if scene.robot is ATHENA else "dop853"  # stiff for dop853
    truth = hp.simulate(scene, control, duration=1.0, method=method, accuracy=1e-8, estimate=False)
    trace = hp.simulate(scene, control, duration=1.0)
    assert trace.run.numerics.method == "ndf" and trace.counters["runs"] == 1
    assert trace.accuracy_kept
    found = errors_of(trace, truth)
    for name, bound in trace.error.arrays.items():
        assert found[name] <= bound[-1] <= 30.0 * found[name], name
    assert trace.error.torque[-1] <= 0.01 * np.abs(trace.torque).max()


def test_a_run_of_extrapolated_euler_bounds_its_error():
    """Set-points jump, where steps restart: bounds of positions are 8 to 76 times errors."""
    scene, time = hp.Scene(ATHENA, contact=hp.Contact.s1()), np.arange(0.0, 1.0, 0.01)
    walk = hp.motion.WalkPlan(scene.robot, TRIPOD)
    held = hp.control.SampledTrajectory(time, np.array([walk.at(t).q for t in time]), limited=False)
    truth = hp.simulate(scene, held, duration=1.0, method="ndf", accuracy=1e-8, estimate=False)
    for accuracy in (1e-2, 1e-3, 1e-4):
        trace = hp.simulate(scene, held, duration=1.0, accuracy=accuracy)
        assert trace.run.numerics.method == "extrapolated-euler" and trace.accuracy_kept
        found = errors_of(trace, truth)
        for name, bound in trace.error.arrays.items():
            assert found[name] <= bound[-1], (accuracy, name)
            if name in ("place", "turn", "joint"):
                assert bound[-1] <= 100.0 * found[name], (accuracy, name)
        assert trace.error_estimate <= accuracy


def test_the_run_is_the_same_with_and_without_its_error():
    scene, control = hp.Scene(ROBOT), hp.KinematicControl(TRIPOD)
    known = hp.simulate(scene, control, duration=0.6)
    alone = hp.simulate(scene, control, duration=0.6, estimate=False)
    assert np.array_equal(known.q, alone.q) and np.array_equal(known.torque, alone.torque)
    assert np.array_equal(known.summary.outside_torque, alone.summary.outside_torque)
    assert alone.error is None and np.isnan(alone.error_estimate)


def test_a_joint_at_its_limit_takes_a_second_run():
    weak = hp.Motor(stall_torque=1.0, no_load_speed=20.0)
    scene = hp.Scene(ROBOT, servo=hp.Servo(kp=40.0, kd=0.8, motor=weak))
    trace = hp.simulate(scene, hp.KinematicControl(TRIPOD), duration=0.5)
    assert any(one.limit_count for one in trace.limits) and trace.counters["runs"] >= 2
    assert trace.run.numerics.method == "ndf" and trace.accuracy_kept


def test_the_usual_method_and_accuracies_follow_the_scene():
    """Where a run cannot know its error, extrapolated Euler is the usual method, at 1e-4 alone."""
    dry = hp.Motor(stall_torque=10.0, no_load_speed=10.0, dry_friction=0.02)
    plain, walk = hp.Scene(ROBOT), hp.KinematicControl(TRIPOD)
    for scene, controller in (
        (hp.Scene(ROBOT, prescribed=True), walk),
        (plain, hp.FootControl(TRIPOD)),
        (hp.Scene(ROBOT, servo=hp.Servo(kp=40.0, kd=0.8, motor=dry)), walk),
    ):
        chosen = Case(scene, controller, duration=1.0).settings.method_settings
        assert (chosen.method.name, chosen.accuracy) == ("extrapolated-euler", 1e-4)
        assert not chosen.torque_request and not chosen.carries_error
    usual = Case(plain, walk, duration=1.0).settings.method_settings
    assert (usual.accuracy, usual.torque_share, usual.positions) == (1e-4, 0.01, True)
    for given in ({"accuracy": 1e-4}, {"record": ("contacts",)}):
        other = Case(plain, walk, duration=1.0, **given).settings.method_settings
        assert (other.method.name, other.torque_share) == ("ndf", 0.0)


def test_the_speed_of_a_touch_down_has_an_error_too() -> None:
    """A foot that comes down slowly meets the ground much faster where that is a little lower."""
    drawn = draw_scene(2511291010, 167)
    truth = drawn.run(method="extrapolated-euler", accuracy=1e-8, estimate=False)
    case = Case(
        drawn.scene, drawn.controller, duration=drawn.duration, sample=drawn.sample,
        initial=drawn.initial, method="ndf", accuracy=1e-5,
    )  # fmt: skip
    for level in (0, 6):
        run = open_loop_run(case, case.settings.at_level(level))
        run.advance()
        error = ErrorEstimate.between({"q": run.samples()["q"]}, {"q": truth.q}, 1.0)
        known = run.carried_error()
        carried = np.max([known[name] for name in ("place", "turn", "joint")], axis=0)
        late = error.position > 0.1 * error.position[-1]
        ratio = error.position[late] / carried[late]
        assert np.all((ratio > 0.25) & (ratio < CARRIED_SHARE["ndf"])), (level, ratio)
