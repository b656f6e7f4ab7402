"""Run settings are method, accuracy, step and samples, checked together."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.run_schema import LATEST_SAMPLE as LATEST
from hexapod_pin.simulation.methods import MethodSettings, resolve_method
from hexapod_pin.simulation.work_limits import WorkLimits

# The times of a run: samples at k * sample, and for a fixed-step method the steps between them.

DENSE_SAMPLE = 1e-3
"""Time between samples of a fixed-step run where none is given [s]."""

ADAPTIVE_SAMPLE = 2e-3
"""The same for an adaptive run: near the steps of a walk at 1e-4, so samples cost little [s]."""


MOST_APART = 1e11
"""Latest time in samples, steps or ticks: the core takes times for one instant that are closer than
1e-12 of themselves, in doubles, so that later ones would be lost."""


@dataclass(frozen=True)
class TimeGrid:
    """A run's times.

    Attributes:
        sample: time between samples [s].
        samples: how many, not counting the first.
        step: integration step [s]; 0 for an adaptive method.
        stride: steps between samples; 1 for an adaptive method.
    """

    sample: float
    samples: int
    step: float
    stride: int

    def latest(self, tick: float = math.inf) -> float:
        """Return the latest time that a run on this grid may reach [s].

        Args:
            tick: period of a controller that takes part in it [s].
        """
        part = min(self.sample, self.step or math.inf, tick)
        return min(LATEST, MOST_APART * part)

    @classmethod
    def fixed(cls, duration: float, step: float, sample: float | None) -> TimeGrid:
        """Return the grid of a fixed-step run.

        Args:
            duration: simulated time [s], a whole number of samples.
            step: integration step [s].
            sample: time between samples [s], a whole number of steps; None: 1 ms or one step.

        Raises:
            ParameterError: a time is not positive and finite, or they do not divide.
        """
        _require_time("step", step, smallest=0.0)
        _require_times(duration, sample)
        stride = (
            max(1, round(DENSE_SAMPLE / step))
            if sample is None
            else integer_ratio("sample/step", sample, step)
        )
        steps = integer_ratio("duration/step", duration, step)
        if steps % stride:
            raise ParameterError(
                "duration", duration, f"a whole number of samples of {stride * step:g} s"
            )
        return cls(stride * step, steps // stride, step, stride)

    @classmethod
    def adaptive(cls, duration: float, sample: float | None) -> TimeGrid:
        """Return the grid of an adaptive run; its steps end at the samples.

        Args:
            duration: simulated time [s], a whole number of samples.
            sample: time between samples [s]; None: 2 ms, or the duration where that is no whole
                number of them.

        Raises:
            ParameterError: a time is not positive and finite, or they do not divide.
        """
        _require_times(duration, sample)
        if sample is None:
            sample = duration / max(1, round(duration / ADAPTIVE_SAMPLE)) or ADAPTIVE_SAMPLE
        return cls(sample, integer_ratio("duration/sample", duration, sample), 0.0, 1)


MOST = 2.0**53
"""Most samples or steps that can be counted in doubles."""


def integer_ratio(name: str, total: float, part: float) -> int:
    """Return total/part, which must be a whole number to 1e-9 of itself.

    Raises:
        ParameterError: it is not.
    """
    if not abs(total) <= MOST * part:
        raise ParameterError(name, total / part if part else math.inf, f"at most {MOST:g}")
    count = round(total / part)
    if abs(count * part - total) > 1e-9 * max(abs(total), part) or (count < 1 and total > 0.0):
        raise ParameterError(
            name, total / part, f"a whole number ({total:g} s is not a multiple of {part:g} s)"
        )
    return count


LONGEST = 1e15
"""Longest time that a grid is made of [s]."""


def _require_times(duration: float, sample: float | None) -> None:
    _require_time("duration", duration, smallest=-1.0)
    if duration < 0.0:
        raise ParameterError("duration", duration, "not negative [s]")
    if sample is not None:
        _require_time("sample", sample, smallest=0.0)


def _require_time(name: str, value: float, *, smallest: float) -> None:
    if not (math.isfinite(value) and smallest < value <= LONGEST):
        raise ParameterError(name, value, "positive and finite [s]")


# How a case is run: the method with its number, and the times of its samples.


@dataclass(frozen=True)
class RunSettings:
    """How to run: the method with its number, and the grid of samples.

    Attributes:
        choice: method, and its accuracy or step.
        grid: samples and steps.
        duration: simulated time [s].
        controlled: whether the error of the whole run is estimated and kept.
        limits: what it may use.
    """

    choice: MethodSettings
    grid: TimeGrid
    duration: float
    controlled: bool = False
    limits: WorkLimits = field(default_factory=WorkLimits)

    @classmethod
    def of(
        cls,
        duration: float,
        method: str | None,
        accuracy: float | None,
        step: float | None,
        sample: float | None,
        torque_accuracy: float | str | None = None,
        estimate: bool = True,
        limits: WorkLimits | None = None,
    ) -> RunSettings:
        """Check the settings of `simulate` against each other.

        Raises:
            ParameterError: one is out of range, or they do not fit together.
        """
        choice = resolve_method(method, accuracy, step, torque_accuracy)
        grid = (
            TimeGrid.adaptive(duration, sample)
            if choice.method.adaptive
            else TimeGrid.fixed(duration, choice.step, sample)
        )
        controlled = choice.method.adaptive and estimate
        return cls(choice, grid, duration, controlled, limits or WorkLimits())

    @property
    def evaluations(self) -> float:
        """Evaluations that it may use; those of fixed steps are known before."""
        if self.limits.evaluations is None and not self.choice.method.adaptive:
            return math.inf
        return self.limits.evaluations_of(self.duration)

    @property
    def compared_groups(self) -> tuple[str, ...]:
        """The groups of samples, besides the motion, that keeping the error takes."""
        return ("torque",) if self.choice.torque_request else ()

    def at_level(self, level: int) -> RunSettings:
        """Return the settings of a run of this level of resolution."""
        return replace(self, choice=replace(self.choice, level=level))
