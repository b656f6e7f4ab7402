"""What the peaks of a run are computed again with, and how far their numbers spread."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

RUN, ACCURACY, CONTACT, SERVO = "run", "accuracy", "contact stiffness", "servo stiffness"
"""What a peak is computed with: as the run was, and what is changed."""


@dataclass(frozen=True)
class Recomputation:
    """One change under which peaks were computed again.

    Attributes:
        name: "accuracy", "contact stiffness" or "servo stiffness".
        title: the change in words.
        change: the numbers before and after, with units.
        baseline: what its peaks are compared with: "run" or "accuracy".
        unneeded: why it does not apply; empty where it does.
        failure: why there is no result, details behind a colon; empty where there is one.
    """

    name: str
    title: str
    change: str
    baseline: str
    unneeded: str = ""
    failure: str = ""


@dataclass(frozen=True)
class Spread:
    """A number over all computations that ran.

    Attributes:
        value: its best estimate: at ten times the accuracy, where that ran.
        low: its least.
        high: its largest.
    """

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, computed: Mapping[str, float]) -> Spread:
        """Return the spread of what was computed."""
        value = computed.get(ACCURACY, computed[RUN])
        return cls(value, min(computed.values()), max(computed.values()))

    @property
    def share(self) -> float:
        """From the least to the largest, over the value [-]; NaN where that is 0."""
        return (self.high - self.low) / self.value if self.value else float("nan")

    def to_dict(self) -> dict[str, float]:
        """Return all numbers as plain data."""
        return {**asdict(self), "share": self.share}
