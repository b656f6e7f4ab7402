"""A run carries its own error along: one run bounds it, and says where it cannot."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from random_scenes import draw_scene

import hexapod_pin as hp
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.simulation.accuracy_control import AccuracyControl
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.open_loop import open_loop_run
from hexapod_pin.simulation.resolution import CARRIED_SHARE
from hexapod_pin.simulation.run_settings import RunSettings

ROBOT = hp.load_robot("kharagpur")
ATHENA = hp.load_robot("athena")
TRIPOD = hp.Gait.tripod(stroke=0.07, cycle_time=1.0)
DURATION = 1.0
DRY = hp.Motor(stall_torque=10.0, no_load_speed=10.0, dry_friction=0.02)


def errors_of(trace: hp.Trace, truth: hp.Trace) -> dict[str, float]:
    """Return the largest errors of a trace, by the names of an estimate."""
    apart = ErrorEstimate.between(
        {name: getattr(trace, name) for name in ("q", "torque", "foot_force")},
        {name: getattr(truth, name) for name in ("q", "torque", "foot_force")},
        1.0,
    )
    return {name: float(error[-1]) for name, error in apart.arrays.items()}


@pytest.mark.parametrize(
    "scene",
    [
        hp.Scene(ROBOT),
        hp.Scene(ROBOT, contact=hp.Contact.s2()),
        hp.Scene(ATHENA, contact=hp.Contact.s1()),
    ],
    ids=["accurate", "s2", "athena s1"],
)
def test_one_run_bounds_its_error_closely(scene: hp.Scene):
    """By methods that share neither linearisation nor history: bounds of 1 to 30 times the error.

    Positions of walks are bounded to a factor of 3; forces in samples within a step vary more.
    """
    control = hp.KinematicControl(TRIPOD)
    method = "extrapolated-euler" if scene.robot is ATHENA else "dop853"  # stiff for dop853
    truth = hp.simulate(
        scene, control, duration=DURATION, method=method, accuracy=1e-8, estimate=False
    )
    trace = hp.simulate(scene, control, duration=DURATION)
    assert trace.run.numerics.method == "ndf" and trace.counters["runs"] == 1
    assert trace.accuracy_kept
    found = errors_of(trace, truth)
    for name, bound in trace.error.arrays.items():
        assert found[name] <= bound[-1] <= 30.0 * found[name], name
    assert trace.error.torque[-1] <= 0.01 * np.abs(trace.torque).max()


@pytest.mark.parametrize("scene", [hp.Scene(ROBOT), hp.Scene(ATHENA, contact=hp.Contact.s1())])
def test_a_run_of_extrapolated_euler_bounds_its_error(scene: hp.Scene):
    """Under set-points that are held and jump, where steps restart; the truth is another method's.

    Its steps know the error of their best result but one, which is far larger where steps begin
    anew: bounds of positions are 8 to 76 times their errors.
    """
    time = np.arange(0.0, DURATION, 0.01)
    walk = hp.motion.WalkPlan(scene.robot, TRIPOD)
    held = hp.control.SampledTrajectory(time, np.array([walk.at(t).q for t in time]), limited=False)
    truth = hp.simulate(scene, held, duration=DURATION, method="ndf", accuracy=1e-8, estimate=False)
    for accuracy in (1e-2, 1e-3, 1e-4):
        trace = hp.simulate(scene, held, duration=DURATION, accuracy=accuracy)
        assert trace.run.numerics.method == "extrapolated-euler" and trace.accuracy_kept
        found = errors_of(trace, truth)
        for name, bound in trace.error.arrays.items():
            assert found[name] <= bound[-1], (accuracy, name)
            if name in ("place", "turn", "joint"):
                assert bound[-1] <= 100.0 * found[name], (accuracy, name)
        assert trace.error_estimate <= accuracy


def test_the_numbers_of_the_summary_have_errors_that_hold():
    """Against a run at 1e-9: peaks, which lie between states, and means over the cycle."""
    scene, control = hp.Scene(ROBOT), hp.KinematicControl(TRIPOD)
    summary = hp.simulate(scene, control, duration=3.0).summary
    truth = hp.simulate(
        scene, control, duration=3.0, method="ndf", accuracy=1e-9, estimate=False
    ).summary
    for name in ("torque_peak", "torque_rms", "torque_p99", "speed_peak", "positive_energy"):
        error = np.abs(np.abs(getattr(summary, name)) - np.abs(getattr(truth, name)))
        assert error.max() <= summary.error_of(name).max(), name
        assert summary.error_of(name).max() <= 0.02 * np.abs(getattr(truth, name)).max(), name


def test_the_run_is_the_same_with_and_without_its_error():
    """To the bit, the summary included."""
    scene, control = hp.Scene(ROBOT), hp.KinematicControl(TRIPOD)
    known = hp.simulate(scene, control, duration=0.6)
    alone = hp.simulate(scene, control, duration=0.6, estimate=False)
    assert np.array_equal(known.q, alone.q) and np.array_equal(known.torque, alone.torque)
    assert np.array_equal(known.summary.outside_torque, alone.summary.outside_torque)
    assert alone.error is None and np.isnan(alone.error_estimate)
    settings = Case(scene, control, duration=0.6, method="x3").settings.at_first_level()
    runs = [
        open_loop_run(Case(scene, control, duration=0.6), replace(settings, estimate=estimate))
        for estimate in (True, False)
    ]
    for run in runs:
        run.advance()
    assert [run.carries_error for run in runs] == [True, False]
    knowing, plain = (run.samples() for run in runs)
    assert all(np.array_equal(knowing[name], plain[name]) for name in ("q", "torque"))


@pytest.mark.parametrize("method", ["ndf", "extrapolated-euler"])
def test_a_run_under_feedback_does_not_know_its_error(method: str):
    """What a controller makes of an error of what it measures is not in the linearised motion."""
    case = Case(hp.Scene(ROBOT), hp.FootControl(TRIPOD), duration=1.0, method=method, estimate=True)
    assert not case.settings.method_settings.carries_error


def test_a_tighter_accuracy_is_met_by_one_run():
    """At 1e-8 the first run's tolerance is a third of the accuracy, and its own error is enough."""
    control = hp.KinematicControl(TRIPOD)
    trace = hp.simulate(hp.Scene(ROBOT), control, duration=0.5, accuracy=1e-8)
    assert trace.counters["runs"] == 1 and trace.accuracy_kept and trace.error_estimate <= 1e-8


def test_a_joint_at_its_limit_takes_a_second_run():
    """Its error is that of two runs that are compared: the linearised motion is another there."""
    weak = hp.Motor(stall_torque=1.0, no_load_speed=20.0)
    scene = hp.Scene(ROBOT, servo=hp.Servo(kp=40.0, kd=0.8, motor=weak))
    trace = hp.simulate(scene, hp.KinematicControl(TRIPOD), duration=0.5)
    assert any(one.limit_count for one in trace.limits) and trace.counters["runs"] >= 2
    assert trace.run.numerics.method == "ndf" and trace.accuracy_kept


@pytest.mark.parametrize(
    ("scene", "controller"),
    [
        (hp.Scene(ROBOT, prescribed=True), hp.KinematicControl(TRIPOD)),
        (hp.Scene(ROBOT), hp.FootControl(TRIPOD)),
        (hp.Scene(ROBOT, servo=hp.Servo(kp=40.0, kd=0.8, motor=DRY)), hp.KinematicControl(TRIPOD)),
    ],
    ids=["given motion", "feedback", "dry friction"],
)
def test_the_usual_method_follows_the_scene(scene: hp.Scene, controller: Any):
    """Where a run cannot know its error, extrapolated Euler is the usual method, at 1e-4 alone."""
    chosen = Case(scene, controller, duration=1.0).settings.method_settings
    assert (chosen.method.name, chosen.accuracy) == ("extrapolated-euler", 1e-4)
    assert not chosen.torque_request and not chosen.carries_error


def test_the_usual_accuracies_are_of_positions_and_torques():
    """Unless one is given, or torques are not recorded."""
    control = hp.KinematicControl(TRIPOD)
    usual = Case(hp.Scene(ROBOT), control, duration=1.0).settings.method_settings
    assert (usual.accuracy, usual.torque_share, usual.positions) == (1e-4, 0.01, True)
    for given in ({"accuracy": 1e-4}, {"record": ("contacts",)}):
        other = Case(hp.Scene(ROBOT), control, duration=1.0, **given).settings.method_settings
        assert (other.method.name, other.torque_share) == ("ndf", 0.0)


def test_the_speed_of_a_touch_down_has_an_error_too() -> None:
    """A foot that comes down slowly meets the ground much faster where that is a little lower.

    It gains speed at a, so that a gap of d changes its speed v by a d / v, and with it the damping
    that a law of restitution keeps for as long as the foot stands: in this walk over a ledge the
    larger part of the errors. Without it what was carried was less than a twentieth of them. The
    share of what is carried that bounds them is the limit; a bound of 16 times them is no use.
    """
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


class KnowingRun:
    """A run whose trunk is off, and what it knows of that."""

    follows_error, good, wall_time, omitted = True, True, 0.0, ()
    settings = RunSettings.of(1.0, "ndf", 1e-4, None, None, None)

    def __init__(self, error: float, known: float) -> None:
        """Take the error and what the run has carried along [m]."""
        self.rollout = SimpleNamespace(
            counters=lambda: {"evaluations": 10, "events": 0}, ended_by="", summary=dict,
            half_summaries=lambda: ({}, {}),
        )  # fmt: skip
        self._error, self._known = error, known

    def samples(self) -> dict[str, Any]:
        """Return two samples."""
        q = np.zeros((2, 7))
        q[:, 6], q[1, 0] = 1.0, self._error
        return {"q": q}

    def carried_error(self) -> dict[str, Any]:
        """Return what is known at the two."""
        return {name: np.array([0.0, self._known]) for name in ("place", "turn", "joint")}


def control_of(*runs: tuple[float, float]) -> tuple[AccuracyControl, list[int | None]]:
    """Return a control that has taken runs with errors and what they know, and their levels."""
    settings = RunSettings.of(1.0, "ndf", 1e-4, None, None, None)
    chosen = settings.method_settings.for_scene(hp.Scene(ROBOT))
    control, levels = AccuracyControl(replace(settings, method_settings=chosen)), [0]
    for error, known in runs:
        control.take(levels[-1], KnowingRun(error, known))  # type: ignore[arg-type]
        levels.append(control.next_level())
    return control, levels


def test_a_run_that_knows_enough_is_the_last():
    """Four times what was carried along is within the accuracy at 2.4e-5, not at 2.6e-5."""
    assert control_of((1e-5, 2.4e-5))[1] == [0, None]
    assert control_of((1e-5, 2.6e-5))[1] == [0, 4]


def test_runs_that_contradict_what_they_know_are_compared():
    """Two that differ by more than both know are not believed: their difference is the bound."""
    control, levels = control_of((1e-3, 4e-5), (0.0, 1e-6))
    assert levels == [0, 4, 8]
    assert control.comparisons[-1].difference == pytest.approx(10.0)
    agreed, levels = control_of((5e-5, 4e-5), (0.0, 1e-6))
    assert levels == [0, 4, None]
