"""Cases whose controllers take part in the run: one, or many in lock-step."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, cast

from hexapod_pin.control.check_controller import (
    check_controller,
    checked_posture,
    method_name,
    settings_of,
)
from hexapod_pin.errors import HexapodError, SimulationInterrupted
from hexapod_pin.simulation.accuracy_control import AccuracyControl
from hexapod_pin.simulation.control_loop import ControlLoop, resume
from hexapod_pin.simulation.controlled_run import ControlledRun
from hexapod_pin.simulation.native_run import NativeRun, begin_of, starting_point
from hexapod_pin.simulation.session import live_run
from hexapod_pin.simulation.work_forecast import check_work
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.simulation.run_settings import RunSettings
    from hexapod_pin.simulation.scene import Scene


def closed_loop_run(
    case: Case, how: RunSettings, progress: Callable[[float], None] | None = None
) -> NativeRun:
    """Run a case under its feedback controller; raises as `lock_step_runs`."""
    return lock_step_runs([case], how, progress=progress)[0]


def controlled_loop(
    case: Case, progress: Callable[[float], None] | None = None, *, record: bool = True
) -> AccuracyControl:
    """Run a case under its feedback controller again, finer, until its error is kept.

    The controller is asked anew in every run, from its own start.

    Raises:
        DivergenceError, SimulationInterrupted: as `ControlledRun.outcome`.
        HexapodError: as `lock_step_runs`.
    """

    def runner(how: RunSettings, tell: Callable[[float], None] | None) -> NativeRun:
        return lock_step_runs([case], how, record=record, progress=tell)[0]

    return ControlledRun(case.settings, runner, progress).outcome()


def lock_step_runs(
    cases: Sequence[Case],
    how: RunSettings,
    *,
    record: bool = True,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[NativeRun]:
    """Run cases of one robot, one controller and one start time side by side.

    Args:
        cases: what to run.
        how: method, duration and sampling.
        record: whether samples are kept.
        threads: how many advance at a time, between the ticks; the bits do not depend on it.
        progress: called with the finished fraction now and then.

    Raises:
        SimulationInterrupted: Ctrl-C; the samples of the first run so far are in the error.
        HexapodError: the controller has raised, or returned what cannot be used. The samples so
            far are in the error of a run of its own; of several, each is to be run alone.
    """
    runs = [set_up(case, how, record=record) for case in cases]
    loop = ControlLoop(runs, cases[0].controller, threads)  # type: ignore[arg-type]
    if len(cases) == 1:
        resume(loop, cases[0].initial)
    _run(loop, runs, runs[0].time + how.duration, progress)
    return runs


def set_up(case: Case, how: RunSettings, *, record: bool = True) -> NativeRun:
    """Return the run of a case with a feedback controller, where it starts."""
    check_controller(case.controller)
    scene, controller, initial = (
        case.scene,
        cast("FeedbackController", case.controller),
        case.initial,
    )
    begin = begin_of(initial, how, float(controller.period))
    groups = case.record if record else how.compared_groups or case.record
    check_work(how, scene, groups if record or how.controlled else (), tick=controller.period)
    start = starting_point(scene, _posture(controller, scene), initial)
    run = live_run(
        scene,
        how,
        start,
        controller=settings_of(controller),
        record=record or how.controlled,
        groups=groups,
        gait=getattr(controller, "gait", None),
        end=begin + how.duration,
    )
    run.case = case
    return run


def _posture(controller: FeedbackController, scene: Scene) -> Array:
    """Return the joint angles in which a run starts that is given no state [rad]."""
    posture = getattr(controller, "posture", None)
    if posture is None:
        return scene.robot.posture
    with UserCode(method_name(controller, "posture")):
        found = posture(scene)
    return checked_posture(controller, found, scene.robot)


def _run(
    loop: ControlLoop,
    runs: Sequence[NativeRun],
    until: float,
    progress: Callable[[float], None] | None,
) -> None:
    """Run a loop to its end; every run gets the wall time of all and the loop's memory."""
    begin = time.perf_counter()
    try:
        loop.run_to(until, progress)
    except (KeyboardInterrupt, SimulationInterrupted):  # the latter of a run that `update` makes
        _keep(loop, runs, begin)
        raise runs[0].interrupted() from None
    except HexapodError as error:
        _keep(loop, runs, begin)
        if len(runs) == 1:
            runs[0].attach_trace(error)
        raise
    _keep(loop, runs, begin)


def _keep(loop: ControlLoop, runs: Sequence[NativeRun], begin: float) -> None:
    for run in runs:
        run.wall_time = (time.perf_counter() - begin) / len(runs)
        run.loop = loop.memory() if len(runs) == 1 else {"runs": len(runs)}
