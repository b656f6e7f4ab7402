"""A closed-loop run has a clock of ticks and delays, and several runs advance in lock-step.

Tick k is at k * period. It acts on what was measured `sensors.delay` before it, and its command
acts `delay` after it. All three are events of the run's clock: a step ends there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.check_controller import (
    UNITS,
    at_time,
    checked_answer,
    checked_rows,
    method_name,
)
from hexapod_pin.control.feedback import Command, FeedbackController, Measurement
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.checkpoint import Checkpoint, odd_part
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.run_outcome import contact_names
from hexapod_pin.spec import degrees_meant
from hexapod_pin.user_code import UserCode

SAME_INSTANT = 1e-12
"""Times closer than this share of themselves (or of 1 s) are one instant."""


MOST_TICKS = 2**53
"""More cannot be counted in doubles."""


class ControlLoop:
    """B runs in lock-step under one controller."""

    def __init__(
        self, runs: Sequence[NativeRun], controller: FeedbackController, threads: int = 1
    ) -> None:
        """Start a checked controller of runs of one kind of robot, at one time.

        Raises:
            ParameterError: its `start` returns what a checkpoint cannot hold.
            UserCodeError: it raises.
        """
        self.together, self.controller = LockStep(runs, threads), controller
        self.period = float(controller.period)
        self.delay = float(getattr(controller, "delay", 0.0))
        sensors: Sensors = getattr(controller, "sensors", None) or Sensors()
        self.reader = sensors.start([0] * len(runs))  # each has the noise of a run of its own
        self.sensor_delay = sensors.delay
        # a loop that begins later has missed the ticks before
        first = math.ceil(self.together.time / self.period - SAME_INSTANT)
        self.measured = self.commanded = max(0, first)  # ticks
        self.waiting: list[Measurement] = []
        call = method_name(controller, "start")
        with UserCode(call):
            state = controller.start(runs[0].scene, len(runs))
        self.state = _checked_state(call, state)
        self.update_name = method_name(controller, "update")

    def run_to(self, until: float, progress: Callable[[float], None] | None = None) -> None:
        """Run until a time [s]; events at that time come first when the run continues."""
        together, begin, shown = self.together, self.together.time, 0.0
        while together.alive:
            measure_at = max(0.0, self.measured * self.period - self.sensor_delay)
            command_at = self.commanded * self.period + self.delay
            event = min(measure_at, command_at)
            if event >= until or _same(event, until):
                together.advance(until)
                return
            if event > together.time and not _same(event, together.time):
                together.advance(event)
            if measure_at <= command_at or _same(measure_at, command_at):
                self._measure()
            else:
                self._command()
            done = (event - begin) / (until - begin)
            if progress is not None and done - shown > 0.01:
                shown = done
                progress(done)

    def _measure(self) -> None:
        self.waiting.append(self.together.measure())
        self.measured += 1

    def _command(self) -> None:
        """Call the controller for the command of a tick; if it fails, the tick is still to come."""
        measurement = self.reader.read(self.commanded, self.waiting[0])
        time, call = self.commanded * self.period, self.update_name
        with UserCode(call, time):
            answer = self.controller.update(time, measurement, self.state)
        command, state = checked_answer(call, time, answer)
        state = _checked_state(call, state, time)
        self.together.command(command, self.period, call, time)
        self.state = state
        del self.waiting[0]
        self.commanded += 1

    def memory(self) -> dict[str, Any]:
        """Return the state of the loop without that of the runs, for a checkpoint."""
        return {
            "measured": self.measured,
            "commanded": self.commanded,
            "waiting": [vars(measurement) for measurement in self.waiting],
            "state": self.state,
        }

    def restore(self, start: Checkpoint) -> None:
        """Continue from a checkpoint that holds the `memory` of a loop.

        Raises:
            ParameterError: the checkpoint holds none, or that of other ticks.
        """
        self.measured, self.commanded = ticks_of(start, "measured"), ticks_of(start, "commanded")
        self.waiting = self._measurements(start.loop.get("waiting"))
        self.state = start.loop["state"]
        if self.measured - self.commanded != len(self.waiting):
            allowed = f"one for each of the ticks {self.commanded} to {self.measured - 1}"
            raise ParameterError("initial.loop.waiting", f"{len(self.waiting)} of them", allowed)
        late = max(0.0, self.measured * self.period - self.sensor_delay)
        due = min(late, self.commanded * self.period + self.delay)
        if due < self.together.time and not _same(due, self.together.time):
            raise ParameterError(
                "initial.loop", f"a tick that was due at {due:g} s",
                f"none before the checkpoint at {self.together.time:g} s",
                "It is of a controller with other ticks or delays: give initial without its loop "
                "(dataclasses.replace(checkpoint, loop=None)), and the controller starts again.",
            )  # fmt: skip

    def _measurements(self, found: Any) -> list[Measurement]:
        """Return what was measured and not yet acted on.

        Raises:
            ParameterError: it is no measurement of these runs.
        """
        like, name = self.together.measure(), "initial.loop.waiting"
        if not isinstance(found, list) or not all(isinstance(one, Mapping) for one in found):
            raise ParameterError(name, type(found).__name__, "a list of measurements")
        for k, one in enumerate(found):
            for field, value in vars(like).items():
                if np.shape(one.get(field)) != np.shape(value):
                    where, shape = f"{name}[{k}].{field}", np.shape(one.get(field))
                    raise ParameterError(where, shape, f"of shape {np.shape(value)}")
        return [Measurement(**{field: one[field] for field in vars(like)}) for one in found]


def without_time(measurement: Measurement, row: int) -> Measurement:
    """Return one run's part of a measurement, without the leading axis."""
    fields = {name: value[row] for name, value in vars(measurement).items() if name != "time"}
    return replace(measurement, **fields)


def resume(loop: ControlLoop, start: object) -> None:
    """Restore a loop from the checkpoint that its run starts from, if there is one.

    Raises:
        ParameterError: the checkpoint is of a run in lock-step with others.
    """
    if not isinstance(start, Checkpoint) or start.loop is None:
        return
    if "runs" in start.loop:
        raise ParameterError(
            "initial", f"a checkpoint of {start.loop['runs']} runs in lock-step",
            "that of a run of its own",
            "Run the case alone: its bits are the same, and its controller's state is stored.",
        )  # fmt: skip
    if "state" not in start.loop:  # of a session: the controller starts again
        return
    loop.restore(start)


def ticks_of(start: Checkpoint, name: str) -> int:
    """Return a number of ticks of a loop that a checkpoint holds.

    Raises:
        ParameterError: it is none.
    """
    count = start.loop.get(name)
    if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count <= MOST_TICKS:
        raise ParameterError(
            f"initial.loop.{name}", count, f"a whole number from 0 to {MOST_TICKS}"
        )
    return count


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= SAME_INSTANT * max(1.0, abs(a), abs(b))


def _checked_state(call: str, state: Any, time: float | None = None) -> Any:
    """Return the state that a controller has returned, if a checkpoint can hold it.

    Raises:
        ParameterError: it cannot.
    """
    odd = odd_part(state)
    if odd is not None:
        allowed = "made of numbers, arrays of them, str, mappings, lists and tuples"
        raise ParameterError(f"{call}.{odd[0]}", odd[1], allowed + at_time(time))
    return state


# Native runs at one time, side by side: their readings and commands, a row for each.

ROUNDING = 1e-9
"""How far a set-point may be beyond its range for rounding [rad, rad/s]."""

NO_ROWS = np.zeros((0, 0))


class LockStep:
    """B runs that are advanced, read and commanded together.

    A run that diverges drops out: its row of a measurement stays what it was, and what it is
    commanded does not matter.
    """

    def __init__(self, runs: Sequence[NativeRun], threads: int = 1) -> None:
        """Take runs of one kind of robot; they stand at one time. So many advance at a time."""
        self.runs, self.threads = list(runs), threads
        self.robot = self.runs[0].scene.robot
        self.time = max(run.time for run in self.runs)
        self._shape = (len(self.runs), len(self.robot.joint_names))
        self._feet = len(self.robot.feet)
        self._limits = {
            "q": (self.robot.lower - ROUNDING, self.robot.upper + ROUNDING),
            "v": (-self.robot.velocity_limit - ROUNDING, self.robot.velocity_limit + ROUNDING),
            "torque": (np.full(self._shape[1], -np.inf), np.full(self._shape[1], np.inf)),
        }
        self._points = len(contact_names(self.runs[0].scene))
        self._width = 3 * self._shape[1] + 15 + 4 * self._points
        self._last = np.zeros((len(self.runs), self._width))
        self._select()

    def _select(self) -> None:
        """Find the runs that continue."""
        self._going = [k for k, run in enumerate(self.runs) if run.good]
        self._rollouts = [self.runs[k].rollout for k in self._going]

    @property
    def alive(self) -> bool:
        """Whether any run has not diverged."""
        return bool(self._going)

    def advance(self, until: float) -> None:
        """Advance all that have not diverged to a time [s]."""
        from hexapod_pin import native as _native

        try:
            good = _native.advance_together(self._rollouts, until, self.threads)
        except BaseException:  # Ctrl-C
            self.time = max(run.time for run in self.runs)
            raise
        self.time = until
        if not all(good):
            for k, still in zip(self._going, good, strict=True):
                self.runs[k].good = still
            self._select()

    def measure(self) -> Measurement:
        """Return what ideal sensors read now, with a leading axis of length B."""
        from hexapod_pin import native as _native

        rows = np.empty((len(self._rollouts), self._width))
        _native.read_together(self._rollouts, rows)
        if len(rows) < len(self.runs):
            self._last[self._going] = rows
            rows = self._last.copy()
        else:
            self._last = rows.copy()
        n, batch, points = self._shape[1], len(self.runs), self._points
        force = rows[:, 3 * n + 15 : 3 * n + 15 + 3 * points].reshape(batch, points, 3)
        return Measurement(
            time=self.time,
            q=rows[:, :n],
            v=rows[:, n : 2 * n],
            torque=rows[:, 2 * n : 3 * n],
            rotation=rows[:, 3 * n : 3 * n + 9].reshape(batch, 3, 3),
            angular_velocity=rows[:, 3 * n + 9 : 3 * n + 12],
            acceleration=rows[:, 3 * n + 12 : 3 * n + 15],
            foot_force=force[:, : self._feet],
            loaded=rows[:, self._width - points : self._width - points + self._feet] != 0.0,
        )

    def command(
        self,
        command: Command,
        period: float,
        call: str = "Session.command",
        time: float | None = None,
    ) -> None:
        """Give the drives new set-points.

        Args:
            command: checked here, but for its `ramp`.
            period: time after which one that ramps arrives [s].
            call: what has given it, for messages.
            time: when [s]; None: now.

        Raises:
            ParameterError: no numbers, a wrong shape, not finite, or beyond a joint's range or its
                largest rate.
        """
        by = (call, self.time if time is None else time)
        from hexapod_pin import native as _native

        arrival = self.time + period if command.ramp else -np.inf
        q = self._rows(by, "q", command.q)
        v, torque = (
            NO_ROWS if given is None else self._rows(by, name, given)
            for name, given in (("v", command.v), ("torque", command.torque))
        )
        _native.command_together(self._rollouts, q, v, torque, arrival)

    def _rows(self, by: tuple[str, float], name: str, given: Any) -> Array:
        """Return the checked set-points of the runs that continue."""
        from hexapod_pin import native as _native

        rows = checked_rows(by[0], name, given, self._shape, by[1])
        if len(self._going) < len(self.runs):
            rows = rows[self._going]
        bad = _native.first_outside(rows, *self._limits[name])
        if bad >= 0:
            raise self._refusal(by, name, rows, *divmod(bad, self._shape[1]))
        return rows

    def _refusal(
        self, by: tuple[str, float], name: str, rows: Array, row: int, joint: int
    ) -> ParameterError:
        """Return the error that names a set-point that is not good."""
        lower, upper = (limit[joint] for limit in self._limits[name])
        span = f" and from {lower:.4g} to {upper:.4g} {UNITS[name]}"
        allowed = f"finite, in {UNITS[name]}" if np.isinf(upper) else f"finite{span}"
        where = f"{by[0]}.{name}[{self.robot.joint_names[joint]}]"
        value = float(rows[row, joint])
        hint = degrees_meant(value, lower, upper) if name == "q" else ""
        return ParameterError(where, value, allowed + at_time(by[1]), hint)
