"""Run settings are method, accuracy, step, samples and limits, checked together.

What a run will need is predicted before it starts, and refused beyond its limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.run_facts import USUAL
from hexapod_pin.results.samples import LATEST_SAMPLE as LATEST
from hexapod_pin.simulation.methods import MethodSettings, resolve_method
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.scene.scene import Scene

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

        The last sample is at the end, sooner after the one before where the times do not divide.

        Args:
            duration: simulated time [s].
            sample: time between samples [s]; None: 2 ms, or nearly so where that does not divide
                the duration.

        Raises:
            ParameterError: a time is not positive and finite, or there are too many samples.
        """
        _require_times(duration, sample)
        if sample is None:
            sample = duration / max(1, round(duration / ADAPTIVE_SAMPLE)) or ADAPTIVE_SAMPLE
        if not duration <= MOST * sample:
            raise ParameterError("duration/sample", duration / sample, f"at most {MOST:g}")
        whole = round(duration / sample)
        divide = abs(whole * sample - duration) <= DIVIDE * max(duration, sample)
        return cls(sample, whole if divide else math.ceil(duration / sample), 0.0, 1)


MOST = 2.0**53
"""Most samples or steps that can be counted in doubles."""


DIVIDE = 1e-9
"""Of a time, by which it may miss a whole number of others [-]."""


def integer_ratio(name: str, total: float, part: float) -> int:
    """Return total/part, which must be a whole number to 1e-9 of itself.

    Args:
        name: of the ratio, in the error.
        total: [s].
        part: [s].

    Raises:
        ParameterError: it is not.
    """
    if not abs(total) <= MOST * part:
        raise ParameterError(name, total / part if part else math.inf, f"at most {MOST:g}")
    count = round(total / part)
    if abs(count * part - total) > DIVIDE * max(abs(total), part) or (count < 1 and total > 0.0):
        low = max(1, math.floor(total / part)) * part
        raise ParameterError(
            name, total / part, f"a whole number ({total:g} s is not a multiple of {part:g} s)",
            f"{low:.10g} s and {low + part:.10g} s are multiples.",
        )  # fmt: skip
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


# Limits of a run.

EVALUATIONS_AT_START = 2e5
"""Default limit of evaluations of a run of no length [-]: some seconds."""

EVALUATIONS_PER_SECOND = 3e6
"""Added for each simulated second: hundreds of times those of a walk [1/s]."""

Count = Annotated[float, Field(gt=0.0, allow_inf_nan=True)]
"""A positive number; infinity lifts a limit."""


class WorkLimits(Spec):
    """Limits of one run; `float("inf")` (0 for times) lifts a limit.

    The first four are checked before a run, which is refused with the number that it would need;
    the others end a run with a `WorkLimitError` that has the samples so far.

    Attributes:
        steps: predicted integration steps [-].
        memory: predicted memory of samples and set-points [bytes].
        step: shortest integration step accepted [s].
        sample: shortest time between samples accepted [s].
        evaluations: of the equations of motion [-]; None: 2e5, and 3e6 for each simulated second.
        smallest_step: mean of the steps over 20 000 evaluations [s]: below it a run would never
            end.
        wall_time: since the run's first step [s].
    """

    steps: Count = 2e8
    memory: Count = 4e9
    step: Annotated[float, Field(ge=0.0)] = 1e-7
    sample: Annotated[float, Field(ge=0.0)] = 1e-7
    evaluations: Count | None = None
    smallest_step: Annotated[float, Field(ge=0.0)] = 1e-12
    wall_time: Count = math.inf

    @classmethod
    def none(cls) -> WorkLimits:
        """Return limits that refuse and end nothing."""
        return cls(steps=math.inf, memory=math.inf, step=0.0, sample=0.0,
                   evaluations=math.inf, smallest_step=0.0)  # fmt: skip


def chosen_limits(limits: WorkLimits | None, allow: bool) -> WorkLimits:
    """Return the limits given, else the usual ones, or none where everything is allowed."""
    if limits is not None:
        return limits
    return WorkLimits.none() if allow else WorkLimits()


# How a case is run: the method with its number, and the times of its samples.


@dataclass(frozen=True)
class RunSettings:
    """How to run: the method with its number, and the grid of samples.

    Attributes:
        method_settings: method, and its accuracy or step.
        grid: samples and steps.
        duration: simulated time [s].
        estimate: whether the error of the whole run is estimated and controlled.
        limits: of the run.
    """

    method_settings: MethodSettings
    grid: TimeGrid
    duration: float
    estimate: bool = False
    limits: WorkLimits = field(default_factory=WorkLimits)

    @classmethod
    def of(
        cls,
        duration: float,
        method: str | None,
        accuracy: float | None,
        torque_accuracy: float | str | None,
        step: float | None,
        sample: float | None,
        estimate: bool = True,
        limits: WorkLimits | None = None,
    ) -> RunSettings:
        """Check the settings of `simulate` against each other.

        Raises:
            ParameterError: one is out of range, or they do not fit together.
        """
        method_settings = resolve_method(method, accuracy, step, torque_accuracy)
        grid = (
            TimeGrid.adaptive(duration, sample)
            if method_settings.method.adaptive
            else TimeGrid.fixed(duration, method_settings.step, sample)
        )
        estimate = method_settings.method.adaptive and estimate
        return cls(method_settings, grid, duration, estimate, limits or WorkLimits())

    @property
    def evaluations(self) -> float:
        """Limit of evaluations; infinite for fixed steps, whose number is known before."""
        if self.limits.evaluations is not None:
            return self.limits.evaluations
        if not self.method_settings.method.adaptive:
            return math.inf
        return EVALUATIONS_AT_START + EVALUATIONS_PER_SECOND * self.duration

    @property
    def accuracy_text(self) -> str:
        """Method and accuracy or step, for reports."""
        chosen = self.method_settings
        how = f"accuracy {chosen.accuracy:g}" if chosen.accuracy else f"step {chosen.step:g} s"
        return f"{chosen.method.name}, {how}"

    @property
    def compared_groups(self) -> tuple[str, ...]:
        """The groups of samples, besides the motion, that the control of the error needs."""
        return ("torque",) if self.method_settings.torque_request else ()

    def at_first_level(self) -> RunSettings:
        """Return the settings of the first run; these where errors are not estimated."""
        if not self.estimate:
            return self
        return self.at_level(self.method_settings.first_levels[0])

    def at_level(self, refinement: int) -> RunSettings:
        """Return the settings of a run of this level of resolution."""
        return replace(self, method_settings=replace(self.method_settings, refinement=refinement))


# What a run will need: predicted before it starts, and refused beyond its limits.

STEPS_PER_SECOND = 500.0
"""Of an adaptive method on a walk at 1e-4, with room to spare [1/s]."""

STEPS_PER_TICK = 10.0
"""Steps that take as long as a controller's answer [-]."""

RUNS_IN_MEMORY = 3
"""Where the error is controlled: two that are compared, and the next."""

LIFT = "Or lift the limit: allow=True (--force), or limits=hp.simulation.WorkLimits(...)."


@dataclass(frozen=True)
class WorkForecast:
    """What a run will need.

    Attributes:
        steps: integration steps [-], of an adaptive method those of a walk.
        samples: [-].
        memory: of its samples [bytes].
    """

    steps: float
    samples: int
    memory: float

    @classmethod
    def of(cls, settings: RunSettings, scene: Scene, groups: Sequence[str] | None) -> WorkForecast:
        """Return what a run will need that records these groups of samples, None for all."""
        grid = settings.grid
        steps = (
            max(grid.samples, STEPS_PER_SECOND * settings.duration)
            if settings.method_settings.method.adaptive
            else float(grid.samples) * grid.stride
        )
        runs = RUNS_IN_MEMORY if settings.estimate else 1
        return cls(steps, grid.samples, runs * sample_bytes(settings, scene, groups))


def sample_bytes(settings: RunSettings, scene: Scene, groups: Sequence[str] | None) -> float:
    """Return the memory of the samples of one run, of these groups or all (None) [bytes]."""
    joints, feet = len(scene.robot.joint_names), len(scene.robot.feet)
    columns = {
        "torque": joints, "set_points": 2 * joints, "contacts": 13 * feet, "com": 3, "energy": 9,
        "sliding": feet, "current": joints, "temperature": joints,
    }  # fmt: skip
    motion = 1 + (7 + joints) + (6 + joints)
    width = motion + sum(columns[name] for name in (USUAL[1:] if groups is None else groups))
    return 8.0 * settings.grid.samples * width


def check_work(
    settings: RunSettings, scene: Scene, groups: Sequence[str] | None, *, tick: float | None = None
) -> None:
    """Refuse a run that would need more than its limits allow.

    Args:
        settings: method and sampling, with the limits.
        scene: what is simulated.
        groups: of samples that are recorded, None for all; empty: none but the motion.
        tick: period of a controller that takes part in the run [s]; None: there is none.

    Raises:
        ParameterError: names the setting, what the run would need, and the remedy.
    """
    limits, grid = settings.limits, settings.grid
    _require_least("step", grid.step, limits.step if grid.step else 0.0)
    _require_least("sample", grid.sample, limits.sample)
    _require_least("controller.period", limits.sample if tick is None else tick, limits.sample)
    forecast = WorkForecast.of(settings, scene, groups)
    ticks = 0.0 if tick is None else settings.duration / tick
    if max(forecast.steps, STEPS_PER_TICK * ticks) > limits.steps:
        raise ParameterError(
            "duration", settings.duration,
            f"short enough for {limits.steps:.3g} steps; it would take about "
            f"{forecast.steps:.3g}" + (f" and {ticks:.3g} ticks" if ticks else ""),
            f"Run it in parts (initial=trace.checkpoint), or with a longer step or sample. {LIFT}",
        )  # fmt: skip
    if forecast.memory > limits.memory:
        raise ParameterError(
            "sample", grid.sample,
            f"such that the samples fit into {limits.memory / 1e9:.3g} GB; {forecast.samples} of "
            f"them take {forecast.memory / 1e9:.3g} GB",
            f"Sample less often, or record fewer groups (record=['motion']). {LIFT}",
        )  # fmt: skip


def _require_least(name: str, value: float, least: float) -> None:
    if value < least:
        raise ParameterError(name, value, f"at least {least:g} s", LIFT)
