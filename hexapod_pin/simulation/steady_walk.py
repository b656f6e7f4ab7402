"""A periodic walk is run cycle by cycle until a cycle repeats; that cycle alone is reported.

The walk begins in motion, in the posture of its plan. Cycles that only let the transients decay are
run once, at the accuracy of one step; the next is run as any other case, with its error known, and
must end as it began. What is left of the transients is part of its error: a walk that contracts to
the share r per cycle is off by at most 1/(1 - r) times what it misses in one cycle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.check_controller import check_controller, settings_of
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.errors import DivergenceError, ParameterError
from hexapod_pin.ground.terrain import Flat, Slope
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.travelled_path import SUNK, TIPPED
from hexapod_pin.robot.robot import scratch_data
from hexapod_pin.robot.rotations import rotations, trunk_vertical
from hexapod_pin.scene.loads import LostLeg, Push
from hexapod_pin.scene.scene import standing_on
from hexapod_pin.simulation.accuracy_control import AccuracyControl, Runs, controlled_runs
from hexapod_pin.simulation.case_data import STEADY, Kind, run_to_dict
from hexapod_pin.simulation.methods import DEFAULT_ACCURACY
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.plant import motion_at
from hexapod_pin.simulation.run_settings import (
    ADAPTIVE_SAMPLE,
    RunSettings,
    check_work,
    integer_ratio,
)
from hexapod_pin.simulation.transients import (
    Change,
    Transients,
    height_over_ground,
)

if TYPE_CHECKING:
    from hexapod_pin.simulation.case_data import CaseData

SETTLING_METHOD, SETTLING_ACCURACIES = "extrapolated-euler", (1e-6, 1e-3)
"""How cycles are run that only let transients decay, and between which accuracies [m and rad]."""

SUMMARY_SAMPLE = 0.02
"""Time between samples where none is stored [s]: errors are looked at there, and at steps."""

SETTLING_GROUPS = ("torque", "contacts")
"""Of samples: what a cycle's ends are compared in."""

SETTLING_SHARES = (10.0, 0.3)
"""Accuracy of the first of them, and of those that follow, over that requested [-]: what one leaves
in error is another transient, which the next reduces."""

MOST_CYCLES = 10
"""Cycles after which none is expected to repeat [-]."""

SETTLED_SHARE = 0.2
"""Of the accuracy requested, that transients may take in any case [-]; they may take more where the
run's own error leaves it."""

EXPECTED_SHARE = 1.5
"""Of the accuracy requested, what the last contraction may leave of the transients in a cycle that
is run to be reported [-]. Where that leaves too much, another follows."""


def why_not_steady(case: CaseData) -> str | None:
    """Return why the cycles of a case cannot repeat; None where they can.

    Raises:
        GaitError: the robot has no legs for the case's gait.
    """
    controller, scene = case.controller, case.scene
    if not isinstance(controller, KinematicControl | ArcWalk):
        return "the controller is neither KinematicControl nor ArcWalk"
    if controller.stop_at is not None:
        return "the walk stops"
    if case.initial is not None:
        return "the run begins in a given state"
    if not isinstance(scene.terrain, Flat | Slope):
        return f"the ground is no plane but {scene.terrain.kind!r}"
    if any(isinstance(load, Push | LostLeg) for load in scene.loads):
        return "a load does not always act"
    level = isinstance(scene.terrain, Flat) and not any(scene.gravity[:2])
    if controller.gait.turn_rate and not level:
        return "the walk turns on inclined ground"
    if isinstance(controller, ArcWalk) or controller.repeats(scene.robot):
        return None
    return "the trunk or the velocity is commanded"


def until_steady(case: Kind) -> Kind:
    """Return the case run until a cycle repeats, where one can; else as it is.

    Raises:
        GaitError: the robot has no legs for the case's gait.
    """
    return case if why_not_steady(case) is not None else replace(case, until=STEADY)


def steady_runs(case: CaseData, *, record: bool = True) -> Runs[AccuracyControl | None]:
    """Yield the runs of a case until a cycle repeats.

    Each is to be advanced to its end before the next is asked for. Returns the last cycle's runs;
    None where the walk does not become periodic.

    Args:
        case: with `until`.
        record: whether the samples that the case requests are recorded.

    Raises:
        ParameterError: the cycles cannot repeat, or are no whole number of samples and steps.
        HexapodError: as `simulate`.
    """
    if (reason := why_not_steady(case)) is not None:
        raise ParameterError("until", case.until, f"None where {reason}")
    groups = case.record if record else ("torque",)
    measured = _one_cycle(
        replace(case, record=groups), ADAPTIVE_SAMPLE if record else SUMMARY_SAMPLE
    )
    run = _first_cycle(case, _settling(measured, 1))
    run.case_settings = run_to_dict(case)
    run.standing_height = height_over_ground(run, run.start.q)
    control = last = None
    settled = False
    for count in range(1, MOST_CYCLES + 1):
        try:
            control = yield from controlled_runs(run, control, 1.0 - SETTLED_SHARE)
        except DivergenceError:
            return None
        if control.run is None:
            return None
        end = control.run.checkpoint()
        if _fallen(control.run, end.q):
            return None
        now = Change.of(control.run), control.numbers
        if last is not None:
            left = Transients.of(count, (last[0], now[0]), (last[1], now[1]) if settled else None)
            share = left.share(measured.method_settings, _largest_torque(now[1]))
            if settled:
                control.transients = left
                if share <= max(SETTLED_SHARE, 1.0 - control.error_ratio):
                    return control
            settled = settled or share * now[0].contraction(last[0]) <= EXPECTED_SHARE
        last = now
        run = (
            run.continued(measured.at_first_level(), end, groups)
            if settled
            else run.continued(_settling(measured, count + 1), end, SETTLING_GROUPS)
        )
    return None


def _largest_torque(numbers: Mapping[str, Any]) -> float:
    return float(np.abs(numbers["torque_peak"]).max(initial=0.0))


def _one_cycle(case: CaseData, sample: float) -> RunSettings:
    """Return how one cycle of a case is run, sampled so often [s] where that is left open.

    Raises:
        ParameterError: it is no whole number of samples and steps.
    """
    cycle = case.controller.gait.cycle_time  # type: ignore[union-attr]  # of a walk
    own = case.sample is None and case.settings.method_settings.method.adaptive
    try:
        if case.sample is not None:
            integer_ratio("cycle/sample", cycle, case.sample)
        return replace(
            case, until=None, duration=cycle,
            sample=cycle / math.ceil(cycle / sample) if own else case.sample,
        ).settings  # fmt: skip
    except ParameterError as error:
        allowed = f"such that the gait's cycle of {cycle:g} s is a whole number of them"
        name = "sample" if case.sample is not None else "step"
        raise ParameterError(name, getattr(case, name), allowed, str(error)) from None


def _settling(measured: RunSettings, count: int) -> RunSettings:
    """Return how the first, second ... cycle is run, which only lets transients decay."""
    accuracy = measured.method_settings.accuracy or DEFAULT_ACCURACY
    accuracy *= SETTLING_SHARES[min(count, len(SETTLING_SHARES)) - 1]
    least, most = SETTLING_ACCURACIES
    accuracy = min(most, max(least, accuracy))
    return RunSettings.of(
        measured.duration, SETTLING_METHOD, accuracy, None, None, measured.duration,
        estimate=False, limits=measured.limits,
    )  # fmt: skip


def _first_cycle(case: CaseData, settings: RunSettings) -> NativeRun:
    """Return the run of the first cycle: it begins in the plan's posture, moving as planned."""
    check_controller(case.controller)
    scene, controller = case.scene, case.controller
    assert isinstance(controller, KinematicControl | ArcWalk)
    begin = controller.path(scene.robot).steady_from
    check_work(settings, scene, SETTLING_GROUPS)
    plan = controller.plan(scene.robot, begin + MOST_CYCLES * settings.duration)
    angle, rate = motion_at(plan, begin)
    state = standing_on(scene, angle, plan.start_pose)
    turned = rotations(state.q[None, 3:7])[0]
    normal = scene.terrain.surface().normal_at(0.0, 0.0)
    ahead = np.array([*plan.travel_direction, 0.0])
    ahead -= ahead @ normal * normal
    speed = plan.speed * ahead / np.linalg.norm(ahead)
    trunk = [turned.T @ speed, turned.T @ (controller.gait.turn_rate * normal)]
    start = Checkpoint(begin, state.q, np.concatenate([*trunk, rate]), np.zeros((0, 6)))
    return NativeRun(
        scene, settings, start, plan, controller=settings_of(controller), groups=SETTLING_GROUPS
    )


def _fallen(run: NativeRun, end: Array) -> bool:
    """Whether a robot has sunk or tipped over in a run to `end`, or its trunk has touched down."""
    tipped = trunk_vertical(end) @ trunk_vertical(run.start.q) < math.cos(TIPPED)
    sunk = _mass_height(run, end) < SUNK * _mass_height(run, run.start.q)
    return bool(tipped) or sunk or bool(run.rollout.trunk_touches())


def _mass_height(run: NativeRun, q: Array) -> float:
    """Return the height of the centre of mass over the ground [m]."""
    import pinocchio as pin

    robot = run.scene.robot
    x, y, z = pin.centerOfMass(robot.model, scratch_data(robot), q)
    return float(z - run.scene.terrain.surface().height_at(x, y))
