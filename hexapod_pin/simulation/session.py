"""A run that is led from outside: measure, command, advance."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import NotPicklableError, ParameterError
from hexapod_pin.results.recording import recorded_groups
from hexapod_pin.simulation.control_loop import ticks_of, without_time
from hexapod_pin.simulation.lock_step import LockStep
from hexapod_pin.simulation.native_run import NativeRun, begin_of, starting_point
from hexapod_pin.simulation.prescribed import refuse_commands
from hexapod_pin.simulation.run_settings import RunSettings
from hexapod_pin.simulation.set_points import waiting
from hexapod_pin.simulation.work_forecast import check_work
from hexapod_pin.simulation.work_limits import WorkLimits, chosen_limits

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.results.summary import Summary
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.scene import Scene


@checked(but="record")
class Session:
    """A scene under simulation; time passes when it is told to.

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
            initial: where it starts: None stands in the robot's posture; a `Checkpoint` goes on.
            method: integration method.
            accuracy: of an adaptive method [m and rad].
            step: of a fixed-step method [s].
            sample: time between the samples of the trace [s].
            record: groups of samples to keep, as of `simulate`; None for all.
            sensors: what `measure` reads through; None: ideal ones. A session has no ticks to be
                late by: their delay must be 0.
            limits: as of `simulate`; without, evaluations are not counted.
            allow: as of `simulate`.

        Raises:
            ParameterError: a setting out of range, or a method that cannot do this scene.
            StateError: `initial` does not fit the robot.
        """
        chosen = limits or chosen_limits(None, allow).model_copy(update={"evaluations": math.inf})
        how = RunSettings.of(0.0, method, accuracy, step, sample, limits=chosen)
        groups = recorded_groups(record)
        check_work(how, scene, groups)
        begin_of(initial, how)
        start = starting_point(scene, scene.robot.posture, initial)
        self._run = live_run(scene, how, start, groups=groups)
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
        hint = "With it, Session(scene, initial=...) goes on from there."
        raise NotPicklableError("Session", "Session.checkpoint()", hint)

    @property
    def time(self) -> float:
        """Simulated time reached [s]."""
        return self._run.time

    def measure(self) -> Measurement:
        """Return what the sensors read now: arrays (n,), (3, 3), (3,), (F, 3), (F,).

        Their noise is drawn anew in each call.
        """
        told = self._reader.read(self._measured, self._together.measure())
        self._measured += 1
        self._run.loop = {"measured": self._measured}
        return without_time(told, 0)

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
            q: joint angles [rad]; None: where they are told to be now. Shape (n,).
            v: joint rates [rad/s]; None: 0, or those of the way where the command ramps. (n,).
            torque: added to the drives' own [N m]; None: 0. Shape (n,).
            ramp: time in which the angles go to `q` [s], longer where the limits ask for it; 0: at
                once, as the limits allow.

        Raises:
            ParameterError: wrong shape, not finite, `q` beyond a joint's range or `v` beyond its
                velocity limit.
        """
        if not (math.isfinite(ramp) and ramp >= 0.0):
            raise ParameterError("ramp", ramp, "finite and not negative [s]")
        told = self._run.rollout.set_points() if q is None else self._row("q", q)
        rate = None if v is None else self._row("v", v)[None]
        more = None if torque is None else self._row("torque", torque)[None]
        self._together.command(Command(told[None], rate, more, ramp=ramp > 0.0), ramp)

    def _row(self, name: str, values: ArrayLike) -> Array:
        """Return values of the joints.

        Raises:
            ParameterError: wrong shape.
        """
        row: Array = np.asarray(values, dtype=float)
        joints = len(self._run.scene.robot.joint_names)
        if row.shape != (joints,):
            allowed = f"of shape ({joints},): joints of the robot"
            raise ParameterError(f"command.{name}", row.shape, allowed)
        return row

    @checked
    def advance(self, until: float) -> None:
        """Simulate to a time [s].

        Raises:
            ParameterError: the time is in the past, not finite, or so late that samples or steps
                do not advance the clock any more.
            DivergenceError: the run left the finite world; `.trace` holds what was good.
            SimulationInterrupted: Ctrl-C; `.trace` holds what was done.
        """
        latest = self._run.how.grid.latest()
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
        """Return what the run has come to so far, gathered at its accepted steps."""
        return self._run.summary()

    def checkpoint(self) -> Checkpoint:
        """Return where the run stands; `Session(initial=...)` goes on from there."""
        return self._run.checkpoint()


def live_run(
    scene: Scene,
    how: RunSettings,
    start: Checkpoint,
    *,
    controller: Mapping[str, Any] | None = None,
    gait: Gait | None = None,
    end: float = 0.0,
    record: bool = True,
    groups: Sequence[str] | None = None,
) -> NativeRun:
    """Return a run that waits for commands, holding the joint angles of its start.

    Args:
        scene: what is simulated.
        how: method and sampling.
        start: where it starts.
        controller: as of `NativeRun`.
        gait: as of `waiting`.
        end: as of `waiting` [s].
        record: as of `NativeRun`.
        groups: as of `NativeRun`.
    """
    refuse_commands(scene.prescribed, "where a run is commanded at ticks")
    points = waiting(start.q[7:], gait, end)
    run = NativeRun(scene, how, start, points, controller=controller, record=record, groups=groups)
    if not start.command.size:
        LockStep([run]).command(Command(start.q[None, 7:]), 0.0)
    return run
