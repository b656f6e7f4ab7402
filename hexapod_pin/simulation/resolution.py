"""How finely a run must be resolved for its error to stay within the accuracy requested.

Two runs of one case, the second finer, differ by the error of the first less that of the second.
The factors below turn this difference into a bound of the finer one's; they were found over random
scenes of all laws, grounds and kinds of motion (docs/accuracy.md). Three runs show how fast errors
fall: where they fall more slowly than tolerances, the bound is wider, as in Richardson's
extrapolation; where they fall far faster, two runs may agree by chance, and a third must confirm.
Where samples, not tolerances, end the steps, the finer run is hardly finer: what it cost more says
by how much.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

LEVELS_PER_DECADE = 4
"""Levels of resolution by which tolerances fall to a tenth."""

JUMP = 4
"""Levels to the next run. Longer jumps overshoot, and what a run costs grows with them."""

FINER_SHARE = {4: 0.9, 6: 0.3, 8: 0.2}
"""Error of the finer of two runs over their difference, at most [-], by the levels between."""

SLOW_SHARE = 3.5
"""Error of the finer of two runs over their difference, at most [-], where errors may fall more
slowly than tolerances. In 40 scenes with firmware, gear friction and backlash (seed 784359215) it
was at most 0.7 in `ndf` and 3.1 in `extrapolated-euler`; why is not known."""

USUAL_DECAY = 10.0 ** (-1.0 / LEVELS_PER_DECADE)
"""Error of a run over that of one a level coarser: it follows the tolerance [-]."""

REGULAR_DECAY, REGULAR_SHARE = (0.5, 0.68), 0.55
"""Errors that three runs show to fall so, as tolerances do, have this share of the usual bound."""

SLOWEST_DECAY = 0.9
"""Of what is found by three runs: slower is no gain [-]."""

DECAY_SLACK = 1.5
"""How much larger the share that follows from a decay may be than the usual, uncounted [-]."""

CHANCE = 0.1
"""A difference that falls to less than this times what tolerances do may have done so by chance
[-]. In random scenes 1 of 100 does."""

LEAST_EFFORT = 1.01
"""Evaluations of the finer run over those of the coarser, counted at least [-]."""

CARRIED_SHARE = {"ndf": 4.0, "extrapolated-euler": 2.0}
CARRIED_FORCE_SHARE = {"ndf": 6.0, "extrapolated-euler": 4.0}
CARRIED_NUMBER_SHARE = 3.0
"""Error of a run over that which it has carried along, at most [-]: of positions, of torques and
forces, and of a summary's numbers. With `ndf` positions of walks are off by 0.8 to 1.3 times that
as a rule, of robots that are pushed or dropped by up to 3 times; with `extrapolated-euler`, whose
steps know the error of their best result but one, by 0.1 to 0.5 times, of robots that are pushed by
up to 1.5 times, and torques by up to 2.3 times.
Torques at samples within a step have an interpolation's error, too; numbers of half the states are
off by a multiple of those of all."""

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
        decay: of the error from level to level, from this and the comparison before [-]; None:
            there was none before.
        by_chance: whether they may agree by chance: the comparison before was beyond the accuracy,
            and this one is smaller by far more than tolerances are.
        events: touch-downs, lift-offs and switches that ended a step, of both.
        effort: evaluations of the finer run over those of the coarser [-].
        order: of the method, where steps that samples end have its error; 0: unknown.
        slow: whether errors may fall more slowly than tolerances: as `MethodSettings.slow_decay`.
        amplifies: whether errors have grown beyond a linearised motion in the finer run: where a
            sliding foot or its neighbour may take the load, two runs may have gone the same wrong
            way.
        seconded: whether the comparison before was within the accuracy, too.
        least_ratio: bound over the accuracy that two runs gave between which the coarser one lies
            [-]: it may confirm that bound, but chance must not make it smaller. 0: none did.
    """

    coarser: int
    finer: int
    difference: float
    decay: float | None = None
    by_chance: bool = False
    events: tuple[int, int] = (0, 0)
    effort: float = math.inf
    order: int = 0
    slow: bool = False
    amplifies: bool = False
    seconded: bool = False
    least_ratio: float = 0.0

    def after(self, last: Comparison | None) -> Comparison:
        """Return this comparison as one that follows another, with the decay that both show."""
        if last is None or last.finds_more:
            return self
        levels = self.coarser - last.coarser
        if not (last.difference > 0.0 and levels > 0):
            return self
        fall = self.difference / last.difference
        return replace(
            self,
            decay=fall ** (1.0 / levels),
            seconded=last.finer == self.coarser and last.error_ratio <= 1.0,
            by_chance=last.error_ratio > 1.0 and fall < CHANCE * USUAL_DECAY**levels,
            least_ratio=last.error_ratio if last.finer == self.finer else 0.0,
        )

    @property
    def finds_more(self) -> bool:
        """Whether the finer run went through far more events: of two motions, neither is known."""
        coarser, finer = self.events
        return finer > MANY_MORE_EVENTS * coarser + FEW_EVENTS

    @property
    def error_fraction(self) -> float:
        """Error of the finer run over the difference, at most [-]."""
        if self.slow:
            return SLOW_SHARE
        share = finer_share(self.finer - self.coarser) * self._share_by_decay
        if self.difference > 0.0:
            share = max(share, self.least_ratio / self.difference)
        if not self.order:
            return share
        return max(share, _finer_share(max(self.effort, LEAST_EFFORT) ** -self.order))

    @property
    def _share_by_decay(self) -> float:
        """What the decay makes of the usual share [-]."""
        if self.decay is None:
            return 1.0
        slowest, quickest = max(REGULAR_DECAY), min(REGULAR_DECAY)
        if quickest <= self.decay <= slowest:
            return REGULAR_SHARE
        levels = self.finer - self.coarser
        found = _finer_share(min(max(self.decay, USUAL_DECAY), SLOWEST_DECAY) ** levels)
        return max(1.0, found / (DECAY_SLACK * _finer_share(USUAL_DECAY**levels)))

    @property
    def error_ratio(self) -> float:
        """Bound of the finer run's error over the accuracy requested [-]."""
        return self.error_fraction * self.difference

    @property
    def needs_witness(self) -> bool:
        """Whether a run between the two has to show that errors fall as they are supposed to.

        The coarser run is beyond the accuracy. That the finer one is not follows from their
        tolerances alone. But where corners hit the ground in another order, an error is as large as
        the motion allows, and no larger in a far coarser run: both may be equally wrong.
        """
        far = self.finer - self.coarser > JUMP
        return far and self.decay is None and self.difference > 1.0 >= self.error_ratio

    @property
    def kept(self) -> bool:
        """Whether the finer run is within the accuracy requested."""
        alone = self.amplifies and not self.seconded
        doubtful = self.finds_more or self.by_chance or self.needs_witness or alone
        return not doubtful and self.error_ratio <= 1.0


def _finer_share(ratio: float) -> float:
    """Return the finer run's error over the difference; `ratio`: its error over the coarser's."""
    return ratio / (1.0 - ratio)


def finer_share(levels: int) -> float:
    """Return `FINER_SHARE` for so many levels between two runs, that of the next fewer known."""
    return FINER_SHARE[
        max(known for known in FINER_SHARE if known <= max(levels, min(FINER_SHARE)))
    ]


def next_level(
    made: Sequence[Comparison], finest: int = MOST_LEVELS, taken: Collection[int] = ()
) -> int | None:
    """Return the level of the next run; None where the last suffices, or where none would help.

    Args:
        made: the comparisons so far.
        finest: level beyond which no run goes.
        taken: levels of the runs so far, also of those that diverged.
    """
    last, between = made[-1], made[-1].finer - JUMP
    if last.needs_witness and not last.finds_more and between not in taken:
        return between
    if last.kept or last.finer + JUMP > finest or has_stalled(made):
        return None
    return last.finer + JUMP


def has_stalled(made: Sequence[Comparison]) -> bool:
    """Tell whether two finer runs in a row have brought no gain: the motion amplifies any error."""
    count = 0
    for earlier, later in zip(reversed(made[:-1]), reversed(made), strict=False):
        if later.finer == earlier.finer:  # a run between the two: none was finer
            continue
        least = LEAST_GAIN ** ((later.coarser - earlier.coarser) / LEVELS_PER_DECADE)
        if earlier.finds_more or later.difference <= earlier.difference * least:
            break
        count += 1
    return count >= 2
