"""How finely a run must be resolved for its error to stay below what was asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

ERROR_SHARE = {1: 1.0, 2: 0.3, 3: 0.18, 4: 0.1, 5: 0.06, 6: 0.035}
"""Error of the finer of two runs over their difference, at most, by the levels between them."""

TYPICAL_SHARE = 0.4
"""A run's error over its estimate, as is usual."""

AIM = 0.7
"""Share of the accuracy that the next run's estimate is meant to come to."""

MOST_LEVELS = 12
"""Finest level: a million times finer than level 0."""

LEAST_GAIN = 0.7
"""An estimate that has not fallen below this share of the one before has not gained."""


@dataclass(frozen=True)
class Attempt:
    """A run that was compared with the one before it.

    Attributes:
        level: of its resolution.
        excess: its estimated error over what was asked [-].
        difference: of the two runs, over what was asked [-].
    """

    level: int
    excess: float
    difference: float

    @property
    def kept(self) -> bool:
        """Whether the estimate is within what was asked."""
        return self.excess <= 1.0


def next_level(attempts: Sequence[Attempt], finest: int = MOST_LEVELS) -> int | None:
    """Return the level of the next run; None where the last will do, or where none would help.

    Args:
        attempts: those made, of finer and finer levels.
        finest: the finest level there is.
    """
    last = attempts[-1]
    if last.kept or last.level >= finest or _has_stalled(attempts):
        return None
    jump = next(
        (j for j, share in ERROR_SHARE.items() if share * TYPICAL_SHARE * last.excess <= AIM),
        max(ERROR_SHARE),
    )
    return min(last.level + jump, finest)


def _has_stalled(attempts: Sequence[Attempt]) -> bool:
    """Tell whether two finer runs in a row have brought no gain: the motion amplifies any error."""
    gains = [
        later.difference <= LEAST_GAIN * earlier.difference
        for earlier, later in zip(attempts, attempts[1:], strict=False)
    ]
    return len(gains) >= 2 and not any(gains[-2:])
