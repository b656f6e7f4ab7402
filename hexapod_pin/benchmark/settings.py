"""Our methods and the settings they are run at."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hexapod_pin.benchmark.entry import OURS, Outcome, Truth
from hexapod_pin.benchmark.task import Task
from hexapod_pin.errors import (
    DivergenceError,
    HexapodError,
    SimulationInterrupted,
    UnknownNameError,
)
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.simulation.run import simulate

ACCURACIES = (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8)
STEPS = (5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5, 2.5e-5, 1e-5)
"""[s]"""

QUICK_ACCURACIES = (1e-3, 1e-4, 1e-5)
QUICK_STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4)


@dataclass(frozen=True)
class Setting:
    """One of our methods with its accuracy [m, rad] or its step [s]."""

    method: str
    value: float

    @property
    def adaptive(self) -> bool:
        """Whether `value` is an accuracy."""
        return METHODS[self.method].adaptive

    @property
    def arguments(self) -> dict[str, Any]:
        """What `simulate` is given."""
        return {"method": self.method, "accuracy" if self.adaptive else "step": self.value}

    @property
    def text(self) -> str:
        """The setting without the method."""
        return setting_text("accuracy" if self.adaptive else "step", self.value)

    def __str__(self) -> str:
        """Return method and setting."""
        return f"{self.method}, {self.text}"


def setting_text(kind: str, value: float) -> str:
    """Return "step 0.25 ms" or "accuracy 1e-04"."""
    return f"step {value * 1e3:g} ms" if kind == "step" else f"accuracy {value:.0e}"


def methods(names: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the methods asked for, or all.

    Raises:
        UnknownNameError: there is no such method.
    """
    if names is None:
        return tuple(METHODS)
    for name in names:
        if name not in METHODS:
            raise UnknownNameError("method", name, list(METHODS))
    return tuple(names)


def ladder(task: Task, method: str, *, quick: bool = False) -> list[Setting]:
    """Return the settings of a method on a task, loosest first."""
    found = METHODS[method]
    if found.adaptive:
        accuracies = QUICK_ACCURACIES if quick else ACCURACIES
        values = [x for x in accuracies if found.tightest <= x <= found.loosest]
    else:
        values = [x for x in (QUICK_STEPS if quick else STEPS) if divides(x, task.sample)]
    return [Setting(method, value) for value in values]


def divides(part: float, whole: float) -> bool:
    """Tell whether a whole number of parts makes the whole, to 1e-9 of it."""
    count = round(whole / part)
    return count >= 1 and math.isclose(count * part, whole, rel_tol=1e-9)


def run_ours(
    task: Task, setting: Setting, progress: Callable[[float], None] | None = None
) -> Outcome:
    """Run a task with one of our methods; divergence and refusal become a note."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            trace = simulate(
                task.scene, task.controller, duration=task.duration, sample=task.sample,
                initial=task.initial, progress=progress, **setting.arguments,
            )  # fmt: skip
        except SimulationInterrupted:
            raise
        except DivergenceError as error:
            wall = float(error.trace.meta["wall_time"])
            return Outcome.failed(f"diverged after {error.trace.time[-1]:.3g} s", wall)
        except HexapodError as error:
            return Outcome.failed(f"refused: {error}")
    counters = trace.counters
    return Outcome(
        places=trace.q[:, :3], q=trace.q, wall=float(trace.meta["wall_time"]),
        evaluations=int(counters["evaluations"]), steps=int(counters["steps"]),
        rejected=int(counters.get("rejected", 0)),
        estimate=trace.error_estimate,
        touches=int(np.count_nonzero(np.diff(trace.contact, axis=0))),
        note="; ".join(str(warning.message) for warning in caught),
    )  # fmt: skip


@dataclass(frozen=True)
class Own:
    """One of our methods on a task, as a contender."""

    task: Task
    choice: Setting
    truth: Truth
    engine: str = OURS

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.choice.method

    @property
    def setting(self) -> str:
        """Its accuracy or step, in words."""
        return self.choice.text

    @property
    def value(self) -> float:
        """Its accuracy [m, rad] or step [s]."""
        return self.choice.value

    def run(self) -> Outcome:
        """Run the task."""
        return run_ours(self.task, self.choice)
