"""`simulate`: run one scene under one controller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.control.planning_progress import planning_told_to
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.closed_loop import closed_loop_run, controlled_loop
from hexapod_pin.simulation.controlled_run import ControlledRun
from hexapod_pin.simulation.native_run import NativeRun, open_loop_run
from hexapod_pin.simulation.work_limits import chosen_limits
from hexapod_pin.user_code import user_callback

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.run_settings import RunSettings
    from hexapod_pin.simulation.scene import Scene
    from hexapod_pin.simulation.work_limits import WorkLimits


@checked(but="record")
def simulate(
    scene: Scene,
    controller: Controller | FeedbackController,
    *,
    duration: float,
    accuracy: float | None = None,
    torque_accuracy: float | str | None = None,
    estimate: bool | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    record: Sequence[str] | None = None,
    initial: State | Checkpoint | None = None,
    limits: WorkLimits | None = None,
    allow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene under a controller.

    Args:
        scene: robot, ground, contact, servos.
        controller: gives the joint set-points: all of them before the run (`KinematicControl`,
            `HoldPosture`), or at its ticks from what it measures (a `FeedbackController`).
        duration: simulated time [s]; 0 returns the initial sample.
        accuracy: error in positions to keep at the sampled times [m and rad]; default 1e-4. The
            case is run at two resolutions or more until its estimated error is within it; where
            that cannot be, `trace.accuracy_kept` is False and `trace.predictable_until` says from
            what time on.
        torque_accuracy: instead of it, or beside it: error in torques to keep at the sampled times
            [N m], or as a share of the largest torque, such as "1 %".
        estimate: False: a single run, whose steps keep the accuracy; what their errors grow to is
            not known. None: True, but for a `FeedbackController`. Where True, it is asked anew in
            every run, and must be as pure as it says.
        method: "extrapolated-euler" (adaptive, the default), "ndf" (1e-5 and tighter),
            "dop853" (explicit, for references); or with fixed steps "robust", "implicit-euler"
            (the default where a step is given), "rk4".
        step: integration step of a fixed-step method [s]; default 1 ms.
        sample: time between samples [s]. Adaptive: default 2 ms. Fixed steps: a whole number of
            steps, default 1 ms or one step.
        record: groups of samples to keep, None for all: "torque", "set_points", "contacts" (feet:
            place, force, gap, normal), "com", "energy"; "motion" (time, q, v) always is. Summary
            and torque budget need none of them.
        initial: state at t = 0; default standing at the controller's first set-point. Or a
            `Checkpoint` (`trace.checkpoint`) to go on from, at its own time.
        limits: what the run may use, of memory, steps, evaluations and wall time; None: the usual.
        allow: True, without `limits`: whatever it needs.
        progress: called with the finished fraction (0..1) now and then.

    Returns:
        The trace, with the first sample at the start.

    Raises:
        ParameterError: a setting out of range, or a method that cannot do this scene, or a run
            that would need more than its limits.
        GaitError, ReachError: the controller cannot do this on this robot.
        StateError: `initial` does not fit the robot.
        DivergenceError: the run left the finite world; `.trace` holds what was good.
        WorkLimitError: it has reached a limit, such as steps that shrink for ever; `.trace` too.
        SimulationInterrupted: Ctrl-C; `.trace` holds what was done, None while planning.
        UserCodeError: the controller or `progress` has raised.
        HexapodError: any other ends a run too. After its first step `.trace` holds what was done,
            by the run that was under way.
    """
    case = Case(
        scene, controller, initial,
        duration=duration, accuracy=accuracy, torque_accuracy=torque_accuracy, estimate=estimate,
        method=method, step=step, sample=sample, record=record,
        limits=chosen_limits(limits, allow),
    )  # fmt: skip
    return run_case(case, user_callback("progress", progress))


def run_case(
    case: Case,
    progress: Callable[[float], None] | None = None,
    planning: Callable[[float], None] | None = None,
) -> Trace:
    """Run a case; returns and raises as `simulate`.

    `planning` is called with the finished fraction of what is planned before the run.
    """
    try:
        with planning_told_to(planning):
            if isinstance(case.controller, FeedbackController):
                if case.settings.controlled:
                    return controlled_loop(case, progress).trace()
                return closed_loop_run(case, case.settings, progress).require_good()
            run = open_loop_run(case, case.settings, in_parts=True)
    except KeyboardInterrupt:
        text = "interrupted while the run was being planned; nothing was simulated"
        raise SimulationInterrupted(text, None) from None
    return _open_loop(run, progress)


def _open_loop(run: NativeRun, progress: Callable[[float], None] | None) -> Trace:
    """Run what has been planned."""
    if not run.how.controlled:
        run.advance(progress)
        return run.require_good()

    def runner(how: RunSettings, tell: Callable[[float], None] | None) -> NativeRun:
        other = run.with_settings(how)
        other.advance(tell)
        return other

    return ControlledRun(run.how, runner, progress).outcome().trace()
