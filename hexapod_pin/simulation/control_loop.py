"""The control loop: what is measured and commanded when, between the steps of the core.

Tick k is at k * period. It acts on what was measured `sensors.delay` before it, and its command
acts `delay` after it. All three are events of the run's clock: a step ends there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hexapod_pin.control.check_controller import checked_answer
from hexapod_pin.control.feedback import FeedbackController, Measurement
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.simulation.lock_step import LockStep
from hexapod_pin.simulation.native_run import NativeRun

SAME_INSTANT = 1e-12
"""Times closer than this share of themselves (or of 1 s) are one instant."""


class ControlLoop:
    """B runs in lock-step under one controller."""

    def __init__(
        self, runs: Sequence[NativeRun], controller: FeedbackController, threads: int = 1
    ) -> None:
        """Start the controller of runs of one kind of robot, at one time; threads as `LockStep`.

        Raises:
            ParameterError: a period or delay out of range.
        """
        self.together, self.controller = LockStep(runs, threads), controller
        self.period = _time("period", controller.period, smallest=np.nextafter(0.0, 1.0))
        self.delay = _time("delay", getattr(controller, "delay", 0.0), smallest=0.0)
        sensors: Sensors = getattr(controller, "sensors", None) or Sensors()
        self.reader = sensors.start([0] * len(runs))  # each has the noise of a run of its own
        self.sensor_delay = sensors.delay
        # a loop that begins later has missed the ticks before
        first = math.ceil(self.together.time / self.period - SAME_INSTANT)
        self.measured = self.commanded = max(0, first)  # ticks
        self.waiting: list[Measurement] = []
        self.state = controller.start(runs[0].scene, len(runs))

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
        measurement = self.reader.read(self.commanded, self.waiting.pop(0))
        time = self.commanded * self.period
        answer = self.controller.update(time, measurement, self.state)
        command, self.state = checked_answer(self.controller, time, answer)
        self.together.command(command, self.period)
        self.commanded += 1

    def memory(self) -> dict[str, Any]:
        """Return what the loop's future depends on beside the runs, for a checkpoint."""
        return {
            "measured": self.measured,
            "commanded": self.commanded,
            "waiting": [vars(measurement) for measurement in self.waiting],
            "state": self.state,
        }

    def restore(self, memory: dict[str, Any]) -> None:
        """Go on from what `memory` returned."""
        self.measured, self.commanded = int(memory["measured"]), int(memory["commanded"])
        self.waiting = [Measurement(**fields) for fields in memory["waiting"]]
        self.state = memory["state"]


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
    loop.restore(start.loop)


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= SAME_INSTANT * max(1.0, abs(a), abs(b))


def _time(name: str, value: float, smallest: float) -> float:
    """Return a time of the controller, checked [s]."""
    if not (np.isfinite(value) and value >= smallest):
        allowed = "finite and above 0 s" if smallest > 0.0 else "finite and not negative [s]"
        raise ParameterError(f"controller.{name}", value, allowed)
    return float(value)
