"""A robot whose file is doubtful walks once more, with the file repaired: what changes?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexapod_pin.results.torque_budget import TorqueBudget
    from hexapod_pin.results.walk_answer import WalkAnswer
    from hexapod_pin.simulation.case import Case

MUCH = 0.1
"""Change of a kind's peak or RMS torque from which a doubt is in the first line [-]."""


@dataclass(frozen=True)
class RepairTrial:
    """What the repair of a robot's file changes.

    Attributes:
        line: the largest torques with the repaired file, or why there are none.
        change: largest relative change of a kind's peak or RMS torque [-]; None: not known.
    """

    line: str
    change: float | None

    def judged(self, answer: WalkAnswer) -> WalkAnswer:
        """Return an answer without doubts where the repair changes little."""
        if self.change is None or self.change > MUCH:
            return answer
        return replace(answer, verdict=replace(answer.verdict, doubts=()))


def try_repaired(answer: WalkAnswer, repaired: Callable[[], Case]) -> RepairTrial:
    """Run the same walk with the robot's file repaired, with a progress bar.

    Args:
        answer: to the walk as the file has it.
        repaired: makes the case with the repaired robot.
    """
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.errors import HexapodError
    from hexapod_pin.results.torque_budget import torque_budget
    from hexapod_pin.simulation.case import run_case

    try:
        with progress_bar("walking with the file repaired") as progress:
            after = torque_budget(run_case(repaired(), progress))
    except HexapodError as error:
        return RepairTrial(f"with --repair it could not be walked: {error}", None)
    if answer.budget is None:
        return RepairTrial("", None)
    change = _largest_change(answer.budget, after)
    if change <= MUCH:
        doubts = ", ".join(answer.verdict.doubts)
        text = f"tried with --repair: no torque changes by more than {change:.1%} ({doubts})"
        return RepairTrial(text, change)
    peaks = ", ".join(f"{row.kind} {row.peak.torque_peak:.3g}" for row in after.kinds)
    return RepairTrial(f"tried with --repair, peaks are: {peaks} N m", change)


def _largest_change(before: TorqueBudget, after: TorqueBudget) -> float:
    """Return the largest relative change of a kind's peak or RMS torque [-]."""
    kinds = {row.kind: row for row in after.kinds}
    pairs = [
        pair
        for row in before.kinds
        if (new := kinds.get(row.kind)) is not None
        for pair in (
            (row.peak.torque_peak, new.peak.torque_peak),
            (row.rms.torque_rms, new.rms.torque_rms),
        )
    ]
    least = 1e-3 * max(max(pair) for pair in pairs)  # of torques that do not matter
    return max(abs(old - new) / max(new, least) for old, new in pairs)
