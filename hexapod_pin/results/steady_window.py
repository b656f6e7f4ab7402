"""The window of a trace that a budget is taken over: whole cycles of steady walking."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace


@dataclass(frozen=True)
class Window:
    """The time that a budget is taken over, and its samples, both ends included."""

    first: int | None  # None: of a summary, which has no samples
    last: int | None
    start: float  # [s]
    end: float  # [s]
    cycles: int | None  # number of whole gait cycles; None where nothing repeats

    @property
    def parts(self) -> int:
        """What energies are divided by: the number of cycles, or 1."""
        return self.cycles or 1

    @property
    def counted(self) -> str:
        """The cycles in words, ", 2 whole gait cycles"; nothing where nothing repeats."""
        if self.cycles is None:
            return ""
        return f", {self.cycles} whole gait cycle{'' if self.cycles == 1 else 's'}"

    @property
    def samples(self) -> slice:
        """The window as a slice of the time axis.

        Raises:
            ParameterError: the window is that of a summary.
        """
        if self.first is None or self.last is None:
            raise ParameterError(
                "Window.samples", None, "read from the window of a trace: a summary has no samples"
            )
        return slice(self.first, self.last + 1)


def steady_window(trace: Trace) -> Window:
    """Return the whole cycles of steady walking; without cycles, the second half of the run.

    The ends are the samples nearest to `steady_from` and to a whole number of cycles later.

    Raises:
        ParameterError: the run is too short for one whole cycle; the error names the
            duration needed.
    """
    end = float(trace.time[-1])
    walk = trace.run.walk
    begin = min(walk.steady_from, end)
    until = min(walk.steady_until or math.inf, end)
    cycle = walk.cycle_time
    if cycle is None:
        begin, cycles, length = 0.5 * (begin + until), None, 0.5 * (until - begin)
    else:
        spacing = float(np.max(np.diff(trace.time), initial=0.0))
        cycles = math.floor((until - begin + min(0.5 * spacing, 0.1 * cycle)) / cycle)
        length = cycles * cycle
    first, last = _nearest(trace.time, begin), _nearest(trace.time, begin + length)
    if cycles == 0 or last <= first:
        raise _too_short(float(trace.time[-1]), begin, until, cycle)
    return Window(first, last, float(trace.time[first]), float(trace.time[last]), cycles)


def summary_window(summary: Summary, time: Array | None = None) -> Window:
    """Return the window of a summary.

    Args:
        summary: what the window is of.
        time: sample times of its trace [s], if there is one. Shape (T,).

    Raises:
        ParameterError: the run is too short for one whole cycle; the error names the
            duration needed.
    """
    if not (summary.window_time > 0.0 and len(summary.path) > 1):
        raise run_too_short(summary)
    first, last = (
        None if time is None else _nearest(time, end) for end in (summary.start, summary.end)
    )
    return Window(first, last, summary.start, summary.end, summary.cycles)


def run_too_short(summary: Summary) -> ParameterError:
    """Return the error of a run without a whole cycle."""
    walk = summary.run.walk
    until = walk.steady_until or 0.0
    duration = summary.run.numerics.duration or until
    return _too_short(duration, walk.steady_from, until, walk.cycle_time)


def _nearest(time: Array, moment: float) -> int:
    """Return the index of the sample nearest to a time."""
    return int(np.argmin(np.abs(time - moment)))


def _too_short(duration: float, begin: float, until: float, cycle: float | None) -> ParameterError:
    """Return the error of a run without a whole cycle, with the duration needed."""
    if cycle is None:
        return ParameterError("duration", duration, "long enough for two samples [s]")
    return ParameterError(
        "duration",
        duration,
        f"at least {begin + cycle:.4g} s of walking for one whole cycle",
        f"{_steady_part(begin, until)}, a cycle lasts {cycle:.4g} s: "
        f"simulate {begin + cycle:.4g} s or more (two cycles: {begin + 2 * cycle:.4g} s), "
        "and stop the gait no earlier.",
    )


def _steady_part(begin: float, until: float) -> str:
    """Return which part of a walk is steady, if any."""
    if until <= begin:
        return f"The walk ends, or stops, before it is steady at {begin:.4g} s"
    return f"Steady walking lasts from {begin:.4g} to {until:.4g} s"
