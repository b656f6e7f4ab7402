"""A walk is tried once more: with the robot's file repaired, or with what the verdict advises."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexapod_pin.results.torque_budget import TorqueBudget
    from hexapod_pin.results.walk_answer import WalkAnswer
    from hexapod_pin.results.walk_verdict import WalkVerdict
    from hexapod_pin.simulation.case import Case

MUCH = 0.1
"""Change of a kind's peak or RMS torque from which a doubt is in the first line [-]."""


@dataclass(frozen=True)
class RepairTrial:
    """What the repair of a robot's file changes.

    Attributes:
        line: the largest torques with the repaired file, or why there are none.
        change: largest relative change of a kind's peak or RMS torque [-]; None: not known.
        left: doubts that the repaired file leaves.
    """

    line: str
    change: float | None
    left: tuple[str, ...] = ()

    def judged(self, answer: WalkAnswer) -> WalkAnswer:
        """Return an answer with the doubts that are left where the repair changes little."""
        if self.change is None or self.change > MUCH:
            return answer
        return replace(answer, verdict=replace(answer.verdict, doubts=self.left))


def try_repaired(answer: WalkAnswer, repaired: Callable[[], Case]) -> RepairTrial:
    """Run the same walk with the robot's file repaired, with a progress bar.

    Args:
        answer: to the walk as the file has it.
        repaired: makes the case with the repaired robot.
    """
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.errors import HexapodError
    from hexapod_pin.results.torque_budget import torque_budget
    from hexapod_pin.results.walk_verdict import walk_verdict
    from hexapod_pin.simulation.case import run_case

    try:
        case = repaired()
        with progress_bar("walking with the file repaired") as progress:
            trace = run_case(case, progress)
        verdict = walk_verdict(trace)
        if not verdict.walks:
            why = ", ".join(filter(None, (verdict.cause, verdict.reason)))
            return RepairTrial(f"tried with --repair: it does not walk: {why}", None)
        after = torque_budget(trace)
    except HexapodError as error:
        return RepairTrial(f"with --repair it could not be walked: {error}", None)
    if answer.budget is None:
        return RepairTrial("", None)
    change, left = _largest_change(answer.budget, after), case.scene.robot.doubts
    if change <= MUCH and left:
        return RepairTrial("", change, left)
    if change <= MUCH:
        doubts = ", ".join(answer.verdict.doubts)
        text = f"tried with --repair: no torque changes by more than {change:.1%} ({doubts})"
        return RepairTrial(text, change)
    peaks = ", ".join(f"{row.kind} {row.peak.torque_peak:.3g}" for row in after.kinds)
    return RepairTrial(f"tried with --repair, peaks are: {peaks} N m", change, left)


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


# What a verdict advises, tried where that is quick.

OPTIONS = {"lift": "--lift", "cycle_time": "--cycle-time"}
"""Options of `walk` by the field of a gait."""

LONGEST = 60.0
"""Simulated time up to which advice is tried [s]: a few seconds of work."""


def try_cure(verdict: WalkVerdict, changed: Callable[[str, float], Case]) -> str:
    """Run the walk with what its verdict advises; return what came of it, or nothing.

    Args:
        verdict: on a robot that does not walk.
        changed: makes the case with another value of a field of the gait.
    """
    from hexapod_pin.commands.progress import progress_bar
    from hexapod_pin.errors import HexapodError
    from hexapod_pin.results.walk_verdict import walk_verdict
    from hexapod_pin.simulation.case import run_case

    if verdict.change is None:
        return ""
    name, value = verdict.change
    option = f"{OPTIONS[name]} {value:.4g}"
    try:
        case = changed(name, value)
        if case.settings.duration > LONGEST:
            return ""
        with progress_bar(f"trying {option}") as progress:
            after = walk_verdict(run_case(case, progress))
    except HexapodError as error:
        return f"tried with {option}: {error}"
    path = after.travel
    way = f"{path.travelled_distance:.3g} of {path.planned_distance:.3g} m"
    return f"tried with {option}: it {'walks' if after.walks else 'does not walk'}, {way}"
