"""Work-precision: every entry in turn, round after round; rows that keep error beside cost."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hexapod_pin.benchmark.work_precision.entry import OURS, Entry, RunOutcome
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.validation.solver_setting import KEPT

SINGLE_RUN_WALL = 1.0
"""Wall time [s] above which a run is timed once: its noise is small and its cost no contest."""


@dataclass(frozen=True)
class BenchmarkRow:
    """What one entry did.

    Attributes:
        engine: whose method it is.
        method: its name.
        setting: its step or accuracy, in words.
        value: the same as a number; smaller is tighter.
        error: largest difference of any position from the reference [m, rad]; nan for another
            engine and for a run that did not end.
        trunk: largest distance of the trunk from the reference [m]; nan for a run that did not end.
        estimate: the method's own estimate of `error`; nan where it has none.
        uncertainty: uncertainty of the reference in `error`, or in `trunk` for another engine.
        wall: median wall time per simulated second [s].
        runs: how many runs that is the median of.
        evaluations: per simulated second; None where the engine does not tell.
        steps: accepted steps per simulated second; None where the engine does not tell.
        rejected: rejected steps per simulated second; None where the engine does not tell.
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
        """Whether it ran, missed the accuracy it asked for, and did not say so itself."""
        return self.verdict.startswith("FAIL")

    @property
    def verdict(self) -> str:
        """Return what became of the accuracy asked for: "pass", "FAIL: 3.2 times", or why neither.

        A run whose own estimate is beyond the accuracy has said that it could not keep it.
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
        return f"said so: {size}" if self.estimate > self.value else f"FAIL: {size}"


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

    A round before the first gives errors and counts; its times are kept only where there are no
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
