"""The control loop: what is measured and commanded when, between the steps of the core.

Tick k is at k * period. It acts on what was measured `sensors.delay` before it, and its command
acts `delay` after it. All three are events of the run's clock: a step ends there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hexapod_pin.control.check_controller import called_at, checked_answer, method_name
from hexapod_pin.control.feedback import FeedbackController, Measurement
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.plain_state import odd_part
from hexapod_pin.simulation.lock_step import LockStep
from hexapod_pin.simulation.native_run import NativeRun
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

        Args:
            runs: of one kind of robot, at one time.
            controller: as of `check_controller`.
            threads: as of `LockStep`.

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
        """Run until a time [s]; what is due at it comes first when the run goes on."""
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
        """Ask the controller for the command of a tick, which is still to come where that fails."""
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
        """Return what the loop's future depends on beside the runs, for a checkpoint."""
        return {
            "measured": self.measured,
            "commanded": self.commanded,
            "waiting": [vars(measurement) for measurement in self.waiting],
            "state": self.state,
        }

    def restore(self, start: Checkpoint) -> None:
        """Go on from where a loop stood that left its `memory` in a checkpoint.

        Raises:
            ParameterError: it has not, or it had other ticks.
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
                "(dataclasses.replace(checkpoint, loop=None)), and the controller starts anew.",
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
            "Run the case alone: its bits are the same, and its controller's state is kept.",
        )  # fmt: skip
    if "state" not in start.loop:  # of a session: the controller starts anew
        return
    loop.restore(start)


def ticks_of(start: Checkpoint, name: str) -> int:
    """Return a number of ticks that a loop has left in a checkpoint.

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
        raise ParameterError(f"{called_at(call, time)}: {odd[0]}", odd[1], allowed)
    return state
