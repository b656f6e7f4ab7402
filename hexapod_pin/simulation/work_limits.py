"""Work limits bound a run, whose steps and samples are predicted before it starts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.run_settings import RunSettings


EVALUATIONS_AT_START = 2e5
"""Evaluations that a run may use where none is given, however short it is [-]: some seconds."""

EVALUATIONS_PER_SECOND = 3e6
"""And for each simulated second: hundreds of times those of a walk [1/s]."""

Count = Annotated[float, Field(gt=0.0, allow_inf_nan=True)]
"""A positive number; infinity lifts a limit."""


class WorkLimits(Spec):
    """What one run may use; `float("inf")` (0 for times) lifts a limit.

    The first four are looked at before a run, which is refused with the number that it would need;
    the others while it goes on, which ends it with a `WorkLimitError` that has the samples so far.

    Attributes:
        steps: predicted integration steps [-].
        memory: predicted memory of samples and set-points [bytes].
        step: shortest integration step that may be asked for [s].
        sample: shortest time between samples that may be asked for [s].
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

    def evaluations_of(self, duration: float) -> float:
        """Return how many evaluations a run of so long [s] may use."""
        if self.evaluations is not None:
            return self.evaluations
        return EVALUATIONS_AT_START + EVALUATIONS_PER_SECOND * duration


def chosen_limits(limits: WorkLimits | None, allow: bool) -> WorkLimits:
    """Return the limits given, else the usual ones, or none where everything is allowed."""
    if limits is not None:
        return limits
    return WorkLimits.none() if allow else WorkLimits()


# What a run will need, before it starts; refused where that is absurd.

STEPS_PER_SECOND = 500.0
"""Of an adaptive method on a walk at 1e-4, with room to spare [1/s]."""

STEPS_PER_TICK = 10.0
"""Steps that take as long as a controller's answer [-]."""

RUNS_IN_MEMORY = 3
"""Where the error is kept: two that are compared, and the next."""

LIFT = "Or lift the limit: allow=True (--force), or limits=hp.WorkLimits(...)."


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
    def of(cls, how: RunSettings, scene: Scene, groups: Sequence[str] | None) -> WorkForecast:
        """Return what a run will need that keeps these groups of samples, None for all."""
        grid = how.grid
        steps = (
            max(grid.samples, STEPS_PER_SECOND * how.duration)
            if how.choice.method.adaptive
            else float(grid.samples) * grid.stride
        )
        runs = RUNS_IN_MEMORY if how.controlled else 1
        return cls(steps, grid.samples, runs * sample_bytes(how, scene, groups))


def sample_bytes(how: RunSettings, scene: Scene, groups: Sequence[str] | None) -> float:
    """Return what the samples of one run take that keeps these groups, None for all [bytes]."""
    return 8.0 * how.grid.samples * _width(scene, groups)


def _width(scene: Scene, groups: Sequence[str] | None) -> int:
    """Return how many numbers a sample holds."""
    joints, feet = len(scene.robot.joint_names), len(scene.robot.feet)
    columns = {
        "torque": joints, "set_points": 2 * joints, "contacts": 13 * feet, "com": 3, "energy": 9
    }  # fmt: skip
    motion = 1 + (7 + joints) + (6 + joints)
    return motion + sum(columns[name] for name in (columns if groups is None else groups))


def check_work(
    how: RunSettings, scene: Scene, groups: Sequence[str] | None, *, tick: float | None = None
) -> None:
    """Refuse a run that would need more than its limits allow.

    Args:
        how: method and sampling, with the limits.
        scene: what is simulated.
        groups: of samples that are kept, None for all; empty: none but the motion.
        tick: period of a controller that takes part in the run [s]; None: there is none.

    Raises:
        ParameterError: names the setting, what it would come to, and the way out.
    """
    limits, grid = how.limits, how.grid
    _require_time("step", grid.step, limits.step if grid.step else 0.0)
    _require_time("sample", grid.sample, limits.sample)
    _require_time("controller.period", limits.sample if tick is None else tick, limits.sample)
    forecast = WorkForecast.of(how, scene, groups)
    ticks = 0.0 if tick is None else how.duration / tick
    if max(forecast.steps, STEPS_PER_TICK * ticks) > limits.steps:
        raise ParameterError(
            "duration", how.duration,
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


def _require_time(name: str, value: float, least: float) -> None:
    if value < least:
        raise ParameterError(name, value, f"at least {least:g} s", LIFT)
