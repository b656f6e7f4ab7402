"""What takes part in a comparison: something with a setting that runs a task and is timed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.validation.position_error import PositionError, trunk_error

OURS = "hexapod_pin"


@dataclass(frozen=True, eq=False)
class RunOutcome:
    """One run.

    Attributes:
        places: (T, 3) trunk in the world at the samples, t = 0 included [m].
        q: (T, 7 + n) all positions at the samples; None from another engine.
        wall: wall time of the integration alone [s].
        evaluations: of the dynamics; None where the engine does not tell.
        steps: accepted steps.
        rejected: rejected steps.
        touches: changes between touching and not, over all feet, from sample to sample.
        estimate: the method's own estimate of its error [m, rad]; nan where it has none.
        note: why there is no result ("diverged at ..."), or a warning; empty else.
        ended: whether the run came to its end.
    """

    places: Array = field(repr=False)
    q: Array | None = field(repr=False)
    wall: float
    evaluations: int | None = None
    steps: int | None = None
    rejected: int | None = None
    touches: int | None = None
    estimate: float = math.nan
    note: str = ""
    ended: bool = True

    @classmethod
    def failed(cls, note: str, wall: float = math.nan) -> RunOutcome:
        """Return a run without a result."""
        return cls(np.empty((0, 3)), None, wall, note=note, ended=False)

    def distance(self, reference: RunOutcome) -> PositionError:
        """Return how far this run is from another; nan where there is nothing to compare."""
        if not (self.ended and reference.ended):
            return PositionError(math.nan, math.nan)
        if self.q is not None and reference.q is not None:
            return PositionError.between(self.q, reference.q)
        return PositionError(math.nan, trunk_error(self.places, reference.places))


@dataclass(frozen=True, eq=False)
class ReferenceSolution:
    """What runs are compared with.

    Attributes:
        outcome: the reference run.
        text: what it is.
        uncertainty: how far it is from the run that checks it.
        check: what that run is.
    """

    outcome: RunOutcome
    text: str
    uncertainty: PositionError
    check: str


class Entry(Protocol):
    """A method of an engine at one setting."""

    @property
    def engine(self) -> str:
        """Whose method it is."""
        ...

    @property
    def method(self) -> str:
        """Its name."""
        ...

    @property
    def setting(self) -> str:
        """Its step or accuracy, in words."""
        ...

    @property
    def value(self) -> float:
        """The same as a number; smaller is tighter."""
        ...

    @property
    def reference(self) -> ReferenceSolution:
        """What it is compared with."""
        ...

    def run(self) -> RunOutcome:
        """Run the task from its start."""
        ...
