"""Entries run a task in turn, and rows keep error beside cost.

The cheapest setting that reaches an error is found.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.validation.position_error import PositionError, trunk_error
from hexapod_pin.validation.solver_setting import KEPT

# What takes part in a comparison: something with a setting that runs a task and is timed.

OURS = "hexapod_pin"


@dataclass(frozen=True, eq=False)
class RunOutcome:
    """One run.

    Attributes:
        places: (T, 3) trunk in the world at the samples, t = 0 included [m].
        q: (T, 7 + n) all positions at the samples; None from another engine.
        wall: wall time of the integration alone [s].
        evaluations: of the dynamics; None where the engine gives no count.
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
        """Its step or accuracy as text."""
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


# Work-precision: every entry in turn, round after round; rows that keep error beside cost.

SINGLE_RUN_WALL = 1.0
"""Wall time [s] above which a run is timed once: its noise is small and its cost no contest."""


@dataclass(frozen=True)
class BenchmarkRow:
    """What one entry did.

    Attributes:
        engine: whose method it is.
        method: its name.
        setting: its step or accuracy as text.
        value: the same as a number; smaller is tighter.
        error: largest difference of any position from the reference [m, rad]; nan for another
            engine and for a run that did not end.
        trunk: largest distance of the trunk from the reference [m]; nan for a run that did not end.
        estimate: the method's own estimate of `error`; nan where it has none.
        uncertainty: uncertainty of the reference in `error`, or in `trunk` for another engine.
        wall: median wall time per simulated second [s].
        runs: how many runs that is the median of.
        evaluations: per simulated second; None where the engine gives no count.
        steps: accepted steps per simulated second; None where the engine gives no count.
        rejected: rejected steps per simulated second; None where the engine gives no count.
        note: what went wrong, or a warning.
    """

    engine: str
    method: str
    setting: str
    value: float
    error: float
    trunk: float
    estimate: float
    uncertainty: float
    wall: float
    runs: int
    evaluations: float | None
    steps: float | None
    rejected: float | None
    note: str

    @property
    def ended(self) -> bool:
        """Whether the run came to its end, so that it has an error."""
        return math.isfinite(self.trunk)

    @property
    def refused(self) -> bool:
        """Whether the method does not offer this setting, or not on this scene."""
        return self.note.startswith("refused")

    @property
    def promises(self) -> bool:
        """Whether the setting is an accuracy of the whole run, which the error must be within."""
        return self.engine == OURS and self.method.endswith(KEPT)

    @property
    def missed(self) -> bool:
        """Whether it ran, missed its requested accuracy, and did not report that itself."""
        return self.verdict.startswith("FAIL")

    @property
    def verdict(self) -> str:
        """Return the verdict on the requested accuracy: "pass", "FAIL: 3.2 times", or why neither.

        A run whose own estimate exceeds the accuracy has reported that it missed it.
        """
        if self.refused:
            return f"not run: {self.note.partition(': ')[2]}"
        if not self.promises:
            return "no promise" if self.ended else "no promise; did not end"
        if not self.ended:
            return "FAIL: did not end"
        if self.error <= self.value:
            return "pass"
        if self.uncertainty > self.value:
            return f"not judged: reference known to {self.uncertainty:.0e}"
        size = f"{self.error / self.value:.2g} times"
        return f"error reported: {size}" if self.estimate > self.value else f"FAIL: {size}"


@dataclass(frozen=True)
class Measured:
    """Rows in the order of the entries, and whether Ctrl-C cut them short."""

    rows: tuple[BenchmarkRow, ...]
    interrupted: bool


def measure(
    entries: Sequence[Entry],
    duration: float,
    rounds: int,
    progress: Callable[[float], None] | None = None,
) -> Measured:
    """Run all entries `rounds` times in turn, every other round backwards.

    A round before the first gives errors and counts; its times are used only where there are no
    others: of runs slower than `SINGLE_RUN_WALL`, and when interrupted.

    Args:
        entries: put next to each other what is to be compared.
        duration: simulated time of a run [s].
        rounds: how many timed rounds.
        progress: called with the finished fraction of all runs.
    """
    first: dict[int, RunOutcome] = {}
    walls: dict[int, list[float]] = {k: [] for k in range(len(entries))}
    total, done, interrupted = len(entries) * (rounds + 1), 0, False
    try:
        for turn in range(rounds + 1):
            for k in list(range(len(entries)))[:: -1 if turn % 2 else 1]:
                if turn == 0:
                    first[k] = entries[k].run()
                elif first[k].ended and first[k].wall <= SINGLE_RUN_WALL:
                    walls[k].append(entries[k].run().wall)
                done += 1
                if progress is not None:
                    progress(done / total)
    except (KeyboardInterrupt, SimulationInterrupted):
        interrupted = True
    rows = [row_of(entries[k], first[k], walls[k], duration) for k in sorted(first)]
    return Measured(tuple(rows), interrupted)


def row_of(
    entry: Entry, outcome: RunOutcome, walls: Sequence[float], duration: float
) -> BenchmarkRow:
    """Return the row of one entry from its first run and its timed ones [s]."""
    reference = entry.reference
    apart = outcome.distance(reference.outcome)
    uncertainty = (
        reference.uncertainty.trunk
        if math.isnan(reference.uncertainty.q)
        else reference.uncertainty.q
    )
    per_second = (
        None if count is None else count / duration
        for count in (outcome.evaluations, outcome.steps, outcome.rejected)
    )  # fmt: skip
    evaluations, steps, rejected = per_second
    return BenchmarkRow(
        entry.engine, entry.method, entry.setting, entry.value,
        error=apart.q, trunk=apart.trunk, estimate=outcome.estimate, uncertainty=uncertainty,
        wall=statistics.median(walls or [outcome.wall]) / duration, runs=max(1, len(walls)),
        evaluations=evaluations, steps=steps, rejected=rejected, note=outcome.note,
    )  # fmt: skip


# The cheapest setting of each method that reaches an error, and all tighter ones with it.

LEVELS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
DEFAULT = "extrapolated-euler"
"""The method that `simulate` takes where none is named and set-points jump, as in the walk here."""

Measure = Literal["error", "trunk"]


def sweeps(rows: Iterable[BenchmarkRow]) -> dict[tuple[str, str], list[BenchmarkRow]]:
    """Return the rows by engine and method, loosest first, without refused settings."""
    found: dict[tuple[str, str], list[BenchmarkRow]] = {}
    for row in rows:
        if not row.refused:
            found.setdefault((row.engine, row.method), []).append(row)
    return {name: sorted(own, key=lambda row: -row.value) for name, own in found.items()}


def cheapest(
    own: Sequence[BenchmarkRow], level: float, measure: Measure = "error"
) -> BenchmarkRow | None:
    """Return the cheapest setting of one method whose error is at most `level`.

    A setting counts only if every tighter one meets the level too: a run that hits it by chance
    does not. A run that diverged meets none. Within one method the count of evaluations
    decides which is cheapest, where there is one: it has no noise.

    Args:
        own: rows of one method, loosest first.
        level: wanted error [m, rad].
        measure: "error" for all positions, "trunk" for the trunk alone.
    """
    best: BenchmarkRow | None = None
    for row in reversed(own):
        if not getattr(row, measure) <= level:
            break
        if best is None or _cost(row) < _cost(best):
            best = row
    return best


def _cost(row: BenchmarkRow) -> float:
    return row.wall if row.evaluations is None else row.evaluations


def resolved(own: Sequence[BenchmarkRow], level: float) -> bool:
    """Tell whether the reference of a method is certain to the level."""
    return all(row.uncertainty <= level for row in own)


def best_of(
    rows: Iterable[BenchmarkRow], engine: str, level: float, measure: Measure = "trunk"
) -> BenchmarkRow | None:
    """Return the cheapest row of any method of an engine that reaches a level."""
    found = [
        cheapest(own, level, measure) for (name, _), own in sweeps(rows).items() if name == engine
    ]
    return min((row for row in found if row is not None), key=lambda row: row.wall, default=None)


def ratios(rows: Sequence[BenchmarkRow], levels: Sequence[float] = (1e-3, 1e-4)) -> list[str]:
    """Return one line per other engine and level: our wall time over its best."""
    engines = list(dict.fromkeys(row.engine for row in rows if row.engine != OURS))
    return [_ratio(rows, engine, level) for engine in engines for level in levels]


def _ratio(rows: Sequence[BenchmarkRow], engine: str, level: float) -> str:
    """Return the line of one engine and level: our best method's ratio, and the default's."""
    head = f"trunk within {level:.0e} m: "
    other = best_of(rows, engine, level)
    ours = best_of(rows, OURS, level)
    if ours is None:
        return f"{head}no method of ours reached it"
    default = best_of([row for row in rows if row.method == DEFAULT], OURS, level)
    shown = [ours] if default in (None, ours) else [ours, default]
    if other is None:
        mine = ", ".join(f"ours {_text(row)}" for row in shown if row)
        return f"{head}{mine}; no method of {engine} reached it"
    mine = ", ".join(
        f"ours {_text(row)}, ratio {row.wall / other.wall:.3f}" for row in shown if row
    )  # fmt: skip
    return f"{head}{engine} {_text(other)}; {mine}"


def _text(row: BenchmarkRow) -> str:
    return f"{row.wall * 1e3:.3g} ms ({row.method}, {row.setting})"
