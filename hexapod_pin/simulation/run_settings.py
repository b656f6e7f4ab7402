"""How a case is run: the method with its number, and the times of its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from hexapod_pin.simulation.methods import MethodSettings, resolve_method
from hexapod_pin.simulation.time_grid import TimeGrid
from hexapod_pin.simulation.work_limits import WorkLimits


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
