"""All that was measured, and the ratios that have a target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from accuracy import Accuracy
from subjects import Size
from timing import Array, Quartiles

MOST_OF_MUJOCO, MOST_OF_PINOCCHIO, LEAST_REAL_TIME, LEAST_THREADS = 0.5, 1.4, 100.0, 1.8
"""Targets: step over MuJoCo's, over Pinocchio's crba + nle, times real time, two threads."""


@dataclass(frozen=True)
class Findings:
    """All that was measured.

    Attributes:
        quick: shortened: the figures mean little.
        step: integration step [s].
        size: how long was measured.
        machine: from `machine.describe`.
        load_after: load after the timing.
        servo: gains in words.
        samples: values per round by name: "engine/motion/contact" [us per step], "walk/..." and
            "batch/..." [s].
        accuracy: errors by "engine/motion/contact", "walk" and "batch".
        dense_difference: dense solver's run against the block-arrow solver's [m].
        same_bits: whether one and two threads gave the same bits.
    """

    quick: bool
    step: float
    size: Size
    machine: dict[str, Any]
    load_after: float
    servo: str
    samples: Mapping[str, Array]
    accuracy: Mapping[str, Accuracy]
    dense_difference: float
    same_bits: bool


@dataclass(frozen=True)
class Target:
    """A ratio with its bound."""

    what: str
    values: Array
    bound: float
    at_most: bool

    @property
    def met(self) -> bool:
        """Whether the median is within the bound."""
        median = Quartiles.of(self.values).median
        return median <= self.bound if self.at_most else median >= self.bound

    def row(self) -> list[str]:
        """Return the row of the table."""
        form = ".2f" if self.bound < LEAST_REAL_TIME else ".0f"
        bound = f"{'at most' if self.at_most else 'at least'} {self.bound:g}"
        return [self.what, Quartiles.of(self.values).text(form), bound, "yes" if self.met else "no"]


def targets(found: Findings) -> list[Target]:
    """Return every ratio that has a target, per round."""
    x, size = found.samples, found.size
    cases = [name.removeprefix("step/") for name in x if name.startswith("step/")]
    return [
        *(Target(f"step / MuJoCo pyramidal, {case}", x[f"step/{case}"] / x[f"pyramidal/{case}"],
                 MOST_OF_MUJOCO, True) for case in cases),
        *(Target(f"step / Pinocchio's crba + nle, {case}",
                 x[f"step/{case}"] / x[f"pinocchio/{case}"],
                 MOST_OF_PINOCCHIO, True) for case in cases),
        Target("walk through hp.simulate, times real time", size.walk / x["walk/call"],
               LEAST_REAL_TIME, False),
        Target("the same, rollout alone", size.walk / x["walk/rollout"], LEAST_REAL_TIME, False),
        Target("batch, two threads over one", x["batch/1"] / x["batch/2"], LEAST_THREADS, False),
    ]  # fmt: skip
