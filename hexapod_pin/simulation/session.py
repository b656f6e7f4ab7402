"""A session is a simulation in the hands of a program. A closed-loop controller runs in one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import TRANSIENT_CYCLES
from hexapod_pin.control.check_controller import (
    check_controller,
    checked_posture,
    method_name,
    settings_of,
)
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import JointTrajectory, whole_cycles
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import (
    HexapodError,
    NotPicklableError,
    ParameterError,
    SimulationInterrupted,
)
from hexapod_pin.results.run_facts import recorded_groups
from hexapod_pin.simulation.accuracy_control import AccuracyControl, ControlledRun
from hexapod_pin.simulation.case_data import run_to_dict
from hexapod_pin.simulation.control_loop import (
    ControlLoop,
    LockStep,
    resume,
    ticks_of,
    without_time,
)
from hexapod_pin.simulation.native_run import NativeRun, begin_of
from hexapod_pin.simulation.plant import refuse_commands, starting_point
from hexapod_pin.simulation.run_settings import RunSettings, WorkLimits, check_work, chosen_limits
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.summary import Summary
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.case_data import CaseData


@checked(but="record")
class Session:
    """A scene under simulation; time passes only in `advance`.

    Until the first command the drives hold the joint angles of the start.

    Example:
        >>> session = Session(Scene(load_robot("kharagpur")), accuracy=1e-4)
        >>> while session.time < 1.0:
        ...     reading = session.measure()
        ...     session.command(q=reading.q)
        ...     session.advance(session.time + 0.005)
    """

    def __init__(
        self,
        scene: Scene,
        *,
        initial: State | Checkpoint | None = None,
        method: str | None = None,
        accuracy: float | None = None,
        step: float | None = None,
        sample: float | None = None,
        record: Sequence[str] | None = None,
        sensors: Sensors | None = None,
        limits: WorkLimits | None = None,
        allow: bool = False,
    ) -> None:
        """Set a run up; arguments as of `simulate`.

        Args:
            scene: what is simulated.
            initial: where it starts: None stands in the robot's posture; a `Checkpoint` continues.
            method: integration method.
            accuracy: of an adaptive method [m and rad].
            step: of a fixed-step method [s].
            sample: time between the samples of the trace [s].
            record: groups of samples to keep, as of `simulate`.
            sensors: the sensors of `measure`; None: ideal ones. A session has no ticks, so their
                delay must be 0.
            limits: as of `simulate`; None: evaluations are not limited.
            allow: as of `simulate`.

        Raises:
            ParameterError: a setting out of range, or a method that cannot do this scene.
            StateError: `initial` does not fit the robot.
        """
        chosen = limits or chosen_limits(None, allow).model_copy(update={"evaluations": math.inf})
        settings = RunSettings.of(0.0, method, accuracy, None, step, sample, limits=chosen)
        groups = recorded_groups(record)
        check_work(settings, scene, groups)
        begin_of(initial, settings)
        start = starting_point(scene, scene.robot.posture, initial)
        self._run = live_run(scene, settings, start, groups=groups)
        self._together = LockStep([self._run])
        self._measured = ticks_of(start, "measured") if "measured" in (start.loop or {}) else 0
        self._reader = (sensors or Sensors()).start([0])
        if sensors is not None and sensors.delay > 0.0:
            raise ParameterError("sensors.delay", sensors.delay, "0 s in a session")

    def __reduce__(self) -> tuple[Any, ...]:
        """Refuse a pickle or a copy: the run is the native core's.

        Raises:
            NotPicklableError: names what to send instead.
        """
        hint = "With it, Session(scene, initial=...) continues from there."
        raise NotPicklableError("Session", "Session.checkpoint()", hint)

    @property
    def time(self) -> float:
        """Simulated time reached [s]."""
        return self._run.time

    def measure(self) -> Measurement:
        """Return what the sensors read now: arrays (n,), (3, 3), (3,), (F, 3), (F,).

        Their noise is drawn again in each call.
        """
        readings = self._reader.read(self._measured, self._together.measure())
        self._measured += 1
        self._run.loop = {"measured": self._measured}
        return without_time(readings, 0)

    @checked
    def command(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        *,
        ramp: float = 0.0,
    ) -> None:
        """Give the drives set-points, which act until the next command.

        The angles move there no faster than the joints' velocity limits allow: all joints leave
        together and arrive together.

        Args:
            q: joint angles [rad]; None: the present set-points. Shape (n,).
            v: joint rates [rad/s], with a ramp those at its end; None: 0, with a ramp its mean
                rates. (n,).
            torque: added to the drives' own [N m]; None: 0. Shape (n,).
            ramp: time in which the angles go to `q` [s], longer where the limits require it, on
                cubics that begin with the angles and rates of the set-points; then they rest. 0: as
                fast as the limits allow.

        Raises:
            ParameterError: wrong shape, not finite, `q` beyond a joint's range or `v` beyond its
                velocity limit.
        """
        if not (math.isfinite(ramp) and ramp >= 0.0):
            raise ParameterError("ramp", ramp, "finite and not negative [s]")
        angles = self._run.rollout.set_points() if q is None else self._row("q", q)
        rate = None if v is None else self._row("v", v)[None]
        more = None if torque is None else self._row("torque", torque)[None]
        self._together.command(Command(angles[None], rate, more, ramp=ramp > 0.0), ramp)

    def _row(self, name: str, values: ArrayLike) -> Array:
        """Return values of the joints.

        Raises:
            ParameterError: wrong shape.
        """
        row: Array = np.asarray(values, dtype=float)
        joints = len(self._run.scene.robot.joint_names)
        if row.shape != (joints,):
            allowed = f"of shape ({joints},): joints of the robot"
            raise ParameterError(f"Session.command.{name}", row.shape, allowed)
        return row

    @checked
    def advance(self, until: float) -> None:
        """Simulate to a time [s].

        Raises:
            ParameterError: the time is in the past, not finite, or so late that samples or steps
                do not advance the clock any more.
            DivergenceError: the state is no longer finite; `.trace` holds the samples before.
            SimulationInterrupted: Ctrl-C; `.trace` holds the samples so far.
        """
        latest = self._run.settings.grid.latest()
        if not self.time <= until <= latest:
            raise ParameterError("until", until, f"from {self.time:g} to {latest:g} s")
        begin = time.perf_counter()
        try:
            self._together.advance(float(until))
        except KeyboardInterrupt:
            raise self._run.interrupted() from None
        finally:
            self._run.wall_time += time.perf_counter() - begin
        self._run.require_good_so_far()

    def trace(self) -> Trace:
        """Return the samples so far."""
        return self._run.trace()

    def summary(self) -> Summary:
        """Return the summary so far, over all accepted steps."""
        return self._run.summary()

    def checkpoint(self) -> Checkpoint:
        """Return the present state; `Session(initial=...)` continues from it."""
        return self._run.checkpoint()


def live_run(
    scene: Scene,
    settings: RunSettings,
    start: Checkpoint,
    *,
    controller: Mapping[str, Any] | None = None,
    gait: Gait | None = None,
    end: float = 0.0,
    record: bool = True,
    groups: Sequence[str] | None = None,
) -> NativeRun:
    """Return a run that waits for commands; arguments as of `NativeRun` and `waiting`.

    Until the first command the drives hold the joint angles of the start.
    """
    refuse_commands(scene.prescribed, "where a run is commanded at ticks")
    points = waiting(start.q[7:], gait, end)
    run = NativeRun(
        scene, settings, start, points, controller=controller, record=record, groups=groups
    )
    if not start.command.size:
        LockStep([run]).command(Command(start.q[None, 7:]), 0.0)
    return run


# Cases whose controllers take part in the run: one, or many in lock-step.


def controlled_loop(
    case: CaseData, progress: Callable[[float], None] | None = None, *, record: bool = True
) -> AccuracyControl:
    """Run a case under its feedback controller, finer each time, until it meets its accuracy.

    The controller is started again in every run.

    Raises:
        DivergenceError, SimulationInterrupted: as `ControlledRun.outcome`.
        HexapodError: as `lock_step_runs`.
    """

    def runner(settings: RunSettings, report: Callable[[float], None] | None) -> NativeRun:
        return lock_step_runs([case], settings, record=record, progress=report)[0]

    return ControlledRun(case.settings, runner, progress).outcome()


def lock_step_runs(
    cases: Sequence[CaseData],
    settings: RunSettings,
    *,
    record: bool = True,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[NativeRun]:
    """Run cases of one robot, one controller and one start time side by side.

    Args:
        cases: what to run.
        settings: method, duration and sampling.
        record: whether samples are recorded.
        threads: how many advance at a time, between the ticks; the bits do not depend on it.
        progress: called with the finished fraction from time to time.

    Raises:
        SimulationInterrupted: Ctrl-C; the samples of the first run so far are in the error.
        HexapodError: the controller has raised, or returned something unusable. The error of a
            single run has the samples so far; of several, each is to be run alone.
    """
    runs = [set_up(case, settings, record=record) for case in cases]
    loop = ControlLoop(runs, cases[0].controller, threads)  # type: ignore[arg-type]
    if len(cases) == 1:
        resume(loop, cases[0].initial)
    _run(loop, runs, runs[0].time + settings.duration, progress)
    return runs


def set_up(case: CaseData, settings: RunSettings, *, record: bool = True) -> NativeRun:
    """Return the run of a case with a feedback controller, where it starts."""
    check_controller(case.controller)
    scene, controller, initial = (
        case.scene,
        cast("FeedbackController", case.controller),
        case.initial,
    )
    begin = begin_of(initial, settings, float(controller.period))
    groups = case.record if record else settings.compared_groups or case.record
    check_work(
        settings, scene, groups if record or settings.estimate else (), tick=controller.period
    )
    start = starting_point(scene, _posture(controller, scene), initial)
    run = live_run(
        scene,
        settings,
        start,
        controller=settings_of(controller),
        record=record or settings.estimate,
        groups=groups,
        gait=getattr(controller, "gait", None),
        end=begin + settings.duration,
    )
    run.case_settings = run_to_dict(case)
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


# What the drives of a run follow until its first command.


def waiting(q: Array, gait: Gait | None = None, end: float = 0.0) -> JointTrajectory:
    """Return set-points that stay at `q` (n,) [rad].

    Args:
        q: [rad]. Shape (n,).
        gait: the gait that a controller walks, if any: a trace knows its cycles by it.
        end: end of the run, as far as it is known [s].
    """
    heading = 0.0 if gait is None else gait.heading
    return JointTrajectory(
        time=np.zeros(1),
        q=q[None, :],
        v=np.zeros((1, len(q))),
        cycle_time=None if gait is None else gait.cycle_time,
        steady_from=0.0 if gait is None else TRANSIENT_CYCLES * gait.cycle_time,
        steady_until=end if gait is None else whole_cycles(end, gait.cycle_time),
        travel_direction=np.array([np.cos(heading), np.sin(heading)]),
        speed=0.0 if gait is None else gait.speed,
        kind="held",
    )
