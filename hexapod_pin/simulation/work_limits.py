"""How much work a run may be, before it is refused and while it goes on."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from hexapod_pin.spec import Spec

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
