"""What a verdict advises is tried by a run, where that is quick."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexapod_pin.results.walk_verdict import WalkVerdict
    from hexapod_pin.simulation.case import Case

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
