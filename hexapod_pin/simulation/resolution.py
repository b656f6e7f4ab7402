"""How finely a run must be resolved for its error to stay within the accuracy requested.

Two runs of one case, the second finer, differ by the error of the first less that of the second.
The factors below turn this difference into bounds of both; they were found over random scenes of
all laws, grounds and kinds of motion (docs/accuracy.md). Three runs show how fast errors fall:
where they fall more slowly than tolerances, the bounds are wider, as in Richardson's extrapolation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

LEVELS_PER_DECADE = 4
"""Levels of resolution by which tolerances fall to a tenth."""

COARSER_SHARE = 2.2
"""Error of the coarser of two runs over their difference, at most [-]."""

FINER_SHARE = {4: 1.0, 5: 0.7, 6: 0.45, 8: 0.25, 10: 0.2, 12: 0.15}
"""Error of the finer one over their difference, at most [-], by the levels between them."""

USUAL_DECAY = 10.0 ** (-1.0 / LEVELS_PER_DECADE)
"""Error of a run over that of one a level coarser: it follows the tolerance [-]."""

SLOWEST_DECAY = 0.9
"""Of what is found by three runs: slower is no gain [-]."""

DECAY_SLACK = 1.5
"""How much larger the share that follows from a decay may be than the usual, uncounted [-]."""

LARGEST_JUMP = max(FINER_SHARE)
"""Levels to the next run, at most."""

TYPICAL_SHARE = 0.25
"""The finer run's error over its bound, as is usual [-]."""

AIM = 0.7
"""Share of the accuracy that the next bound is meant to come to [-]."""

MOST_LEVELS = 32
"""Finest level: tolerances a hundred million times those of level 0."""

LEAST_GAIN = 0.5
"""A difference that has not fallen to this share over four levels has not gained [-]."""

MANY_MORE_EVENTS, FEW_EVENTS = 2, 10
"""A finer run with more events than so many times those of the coarser [-], and so many on top, has
found what the coarser missed, such as hops far lower than its tolerance."""


@dataclass(frozen=True)
class Comparison:
    """Two runs beside each other.

    Attributes:
        coarser: level of the first.
        finer: level of the second.
        difference: of the two, over the accuracy requested [-].
        decay: of the error from level to level, from this and the comparison before [-].
        events: touch-downs, lift-offs and switches that ended a step, of both.
    """

    coarser: int
    finer: int
    difference: float
    decay: float = USUAL_DECAY
    events: tuple[int, int] = (0, 0)

    def after(self, last: Comparison | None) -> Comparison:
        """Return this comparison as one that follows another, with the decay that both show."""
        if last is None or last.finds_more:
            return self
        if not (last.difference > 0.0 and self.coarser > last.coarser):
            return self
        decay = (self.difference / last.difference) ** (1.0 / (self.coarser - last.coarser))
        return replace(self, decay=decay)

    @property
    def finds_more(self) -> bool:
        """Whether the finer run went through far more events: of two motions, neither is known."""
        coarser, finer = self.events
        return finer > MANY_MORE_EVENTS * coarser + FEW_EVENTS

    @property
    def error_fraction(self) -> float:
        """Error of the run that suffices, or of the finer one, over the difference, at most [-]."""
        return self._coarser_share if self.takes_coarser else self._finer_share

    @property
    def coarser_error_ratio(self) -> float:
        """Bound of the coarser run's error over the accuracy requested [-]."""
        return self._coarser_share * self.difference

    @property
    def finer_error_ratio(self) -> float:
        """Bound of the finer run's error over the accuracy requested [-]."""
        return self._finer_share * self.difference

    @property
    def kept(self) -> bool:
        """Whether one of them is within the accuracy requested."""
        return not self.finds_more and min(self.coarser_error_ratio, self.finer_error_ratio) <= 1.0

    @property
    def takes_coarser(self) -> bool:
        """Whether the coarser one suffices: its bound is the sharper one."""
        return not self.finds_more and self.coarser_error_ratio <= 1.0

    @property
    def _coarser_share(self) -> float:
        levels = self.finer - self.coarser
        return COARSER_SHARE * _slower(self.decay, lambda r: 1.0 / (1.0 - r**levels))

    @property
    def _finer_share(self) -> float:
        levels = self.finer - self.coarser
        return finer_share(levels) * _slower(self.decay, lambda r: r**levels / (1.0 - r**levels))


def _slower(decay: float, share: Callable[[float], float]) -> float:
    """Return by how much a share that follows from the decay is larger than usual, at least 1."""
    found = share(min(max(decay, USUAL_DECAY), SLOWEST_DECAY))
    return max(1.0, found / (DECAY_SLACK * share(USUAL_DECAY)))


def finer_share(levels: int) -> float:
    """Return `FINER_SHARE` for so many levels between two runs, that of the next fewer known."""
    return FINER_SHARE[
        max(known for known in FINER_SHARE if known <= max(levels, min(FINER_SHARE)))
    ]


def next_level(made: Sequence[Comparison], finest: int = MOST_LEVELS) -> int | None:
    """Return the level of the next run; None where the last suffices, or where none would help."""
    last = made[-1]
    if last.kept or last.finer + min(FINER_SHARE) > finest or has_stalled(made):
        return None
    jump = min(FINER_SHARE) if _without_gain(made) else _jump_for(last.finer_error_ratio)
    return min(last.finer + jump, finest)


def _jump_for(error_ratio: float) -> int:
    """Return the levels to a run whose bound should suffice; `error_ratio`: of the last run [-]."""
    expected = TYPICAL_SHARE * error_ratio
    return next((j for j, share in FINER_SHARE.items() if share * expected <= AIM), LARGEST_JUMP)


def has_stalled(made: Sequence[Comparison]) -> bool:
    """Tell whether two finer runs in a row have brought no gain: the motion amplifies any error."""
    return _without_gain(made) >= 2


def _without_gain(made: Sequence[Comparison]) -> int:
    """Return how many finer runs in a row, up to the last, have brought no gain."""
    count = 0
    for earlier, later in zip(reversed(made[:-1]), reversed(made), strict=False):
        least = LEAST_GAIN ** ((later.coarser - earlier.coarser) / LEVELS_PER_DECADE)
        if earlier.finds_more or later.difference <= earlier.difference * least:
            break
        count += 1
    return count
