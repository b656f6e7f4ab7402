"""What S1 promises and what was asked for, held against the runs of the comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import METRICS, Estimate, relative_change
from hexapod_pin.text_table import Table
from studies.foot_control.cells import (
    HEAD,
    LEAST_TORQUE,
    OWN,
    Cell,
    Found,
    cells,
    variants_in,
)
from studies.foot_control.variants import (
    BOTH_WAYS,
    DISTURBED,
    KP_HIGH,
    KP_LOW,
    NO_PARTS,
    S1,
    SINGLE_PARTS,
    SOLE_UNKNOWN,
    TARGETS,
    TARGETS_SUSPENSION,
    VARIANTS,
    named,
)

SHOWN = {
    "slip_distance": "slip path",
    "torque_rms": "torque RMS",
    "torque_peak": "torque peak",
    "energy_per_metre": "energy",
    "vertical_acceleration_rms": "vertical acceleration",
    "roll_rms": "roll",
    "pitch_rms": "pitch",
    "force_peak": "touch-down force",
}
"""Metrics of `WalkMetrics`, and their names in tables."""

DECREASING = ("slip_distance", "energy_per_metre", "vertical_acceleration_rms")
STEADY = ("roll_rms", "pitch_rms", "force_peak")

SMALL = 9.95
"""Changes below this have a digit behind the point in tables [%]."""

Limits = Mapping[str, float]

NO_CHANGE = 0.01
"""Largest change by a controller without parts at 5 ms, in every metric [-]."""

MOST_STEADY = 0.02
"""Increase of a metric of STEADY that no interval may lie above [-]."""

MOST_TORQUE: Limits = {"torque_rms": 0.02, "torque_peak": 0.05}
MOST_PEAK_END = 0.10
"""Upper end of the interval of the torque's peak [-]."""

MEDIANS: Mapping[str, Limits] = {
    "flat": {"slip_distance": -0.40, "energy_per_metre": -0.08, "vertical_acceleration_rms": -0.25},
    "bumps": {
        "slip_distance": -0.20, "energy_per_metre": -0.12, "vertical_acceleration_rms": -0.15,
    },
}  # fmt: skip
"""Largest medians over the cells of a ground in the posture of least torque [-]."""

WITH_SUSPENSION = {"vertical_acceleration_rms": -0.20}
"""The same on bumps with the suspension, where it is another one."""

UNKNOWN_SOLE = {"flat": {"slip_distance": -0.20}, "bumps": {"slip_distance": -0.08}}
OWN_POSTURE: Limits = {"torque_rms": 0.03, "torque_peak": 0.12}
"""Of targets from which forces deviate both ways, in the robot's own posture [-]."""

JUDGED = ("flat", "cross", "bumps")
"""Grounds on which controllers walk that know wrong numbers."""

JUDGED_TICK = 0.005
"""Of a controller without parts [s]."""


@dataclass(frozen=True)
class CellChange:
    """Changes of one variant at one tick in one cell, against conventional control there.

    Attributes:
        cell: the cell.
        tick: [s].
        variant: name of the variant.
        walked: runs that walked, and all of them.
        changes: by metric; None where no pair of runs walked.
    """

    cell: Cell
    tick: float
    variant: str
    walked: tuple[int, int]
    changes: Mapping[str, Estimate | None]

    def missed(self) -> list[str] | None:
        """Return the names of what was asked for and missed; None where nothing was asked for."""
        rule = _rule(self)
        if rule is None:
            return None
        missed = [SHOWN[metric] for metric in SHOWN if rule(metric, self.changes[metric])]
        return missed if self.walked[0] == self.walked[1] else ["a run that did not walk", *missed]


def cell_changes(found: Found) -> list[CellChange]:
    """Return the changes of all variants in all cells."""
    return [
        _changes(found.comparison, cell, tick, variant)
        for cell in cells(found.size)
        for tick in found.size.ticks
        for variant in variants_in(cell, found.size)
    ]


def _changes(comparison: Comparison, cell: Cell, tick: float, variant: str) -> CellChange:
    name = named(variant, tick)
    runs = comparison.of(cell.name, name)
    walked = sum(run.metrics is not None for run in runs)
    changes = {metric: comparison.change(cell.name, name, metric) for metric in SHOWN}
    return CellChange(cell, tick, variant, (walked, len(runs)), changes)


# What was asked for.


Rule = Callable[[str, Estimate | None], bool]


def _rule(one: CellChange) -> Rule | None:
    """Return what tells whether a change of a metric misses its number; None: none is asked for."""
    cell = one.cell
    if one.variant == NO_PARTS:
        return _differs if one.tick == JUDGED_TICK else None
    if one.variant == BOTH_WAYS and cell.posture == OWN:
        return lambda metric, change: _above(change, OWN_POSTURE.get(metric))
    if cell.posture != LEAST_TORQUE:
        return None
    if one.variant == SOLE_UNKNOWN:
        return lambda metric, change: metric in DECREASING and _above(change, 0.0)
    if one.variant in (TARGETS, TARGETS_SUSPENSION):
        return lambda metric, change: _misses(metric, change, whole=cell.terrain == "bumps")
    return None


def _differs(metric: str, change: Estimate | None) -> bool:
    return change is None or abs(change.value) > NO_CHANGE


def _above(change: Estimate | None, limit: float | None) -> bool:
    return limit is not None and (change is None or change.value > limit)


def _misses(metric: str, change: Estimate | None, *, whole: bool) -> bool:
    """Return whether force targets in the posture of least torque miss what was asked for."""
    if change is None:
        return True
    low, high = _interval(change)
    if metric in DECREASING:
        return (high if whole else change.value) >= 0.0
    if metric in STEADY:
        return low > MOST_STEADY
    beyond = metric == "torque_peak" and high > MOST_PEAK_END
    return beyond or change.value > MOST_TORQUE[metric]


def _interval(change: Estimate) -> tuple[float, float]:
    half = change.half_width or 0.0
    return change.value - half, change.value + half


# Tables.


def percent(change: Estimate | None) -> str:
    """Return a change in percent, with half of its interval where there is one."""
    if change is None:
        return "-"
    value, half = 100.0 * change.value, change.half_width
    digits = 1 if abs(value) < SMALL else 0
    width = "" if half is None else f" ± {100.0 * half:.{digits}f}"
    return f"{value:+.{digits}f}{width}"


JUDGED_CELLS = "Cells for which numbers are asked for: changes [%]"
MEDIANS_OF_CELLS = "Median over robots and contacts (least, largest): changes [%]"


def judged_table(changes: list[CellChange], title: str = JUDGED_CELLS) -> Table:
    """Return every cell for which numbers are asked for, with what it misses."""
    rows = []
    for one in changes:
        missed = one.missed()
        if missed is not None:
            cells_ = [percent(one.changes[metric]) for metric in SHOWN]
            word = f"FAIL: {', '.join(missed)}" if missed else "pass"
            rows.append([*one.cell.row, f"{1e3 * one.tick:g}", one.variant, *cells_, word])
    head = [*HEAD, "tick [ms]", "controller", *SHOWN.values(), "verdict"]
    return Table(title, head, rows)


def median_table(changes: list[CellChange], title: str = MEDIANS_OF_CELLS) -> Table:
    """Return the median over the cells of each posture, ground and tick, and its range."""
    rows = []
    for key, group in _groups(changes).items():
        posture, terrain, tick, variant = key
        walked, count = (sum(one.walked[k] for one in group) for k in (0, 1))
        limits = _median_limits(posture, terrain, variant)
        words, missed = [], []
        for metric, name in SHOWN.items():
            values = _known(group, metric)
            words.append(_range(values))
            limit = limits.get(metric)
            median = np.median(values) if len(values) else np.inf
            if limit is not None and not median <= limit:
                missed.append(f"{name} {100.0 * median:+.1f}, at most {100.0 * limit:+.0f}")
        word = "-" if not limits else f"FAIL: {', '.join(missed)}" if missed else "pass"
        rows.append([
            posture, terrain, f"{1e3 * tick:g}", variant, f"{walked}/{count}", *words, word,
        ])  # fmt: skip
    head = ["posture", "ground", "tick [ms]", "controller", "walked", *SHOWN.values(), "medians"]
    return Table(title, head, rows)


def _groups(
    changes: list[CellChange],
) -> dict[tuple[str, str, float, str], list[CellChange]]:
    found: dict[tuple[str, str, float, str], list[CellChange]] = {}
    for one in changes:
        key = (one.cell.posture, one.cell.terrain, one.tick, one.variant)
        found.setdefault(key, []).append(one)
    return dict(sorted(found.items(), key=lambda item: item[0][:3]))


def _median_limits(posture: str, terrain: str, variant: str) -> Limits:
    """Return the largest medians asked for; none where there is no such number."""
    if posture != LEAST_TORQUE:
        return {}
    if variant == SOLE_UNKNOWN:
        return UNKNOWN_SOLE.get(terrain, {})
    if variant not in (TARGETS, TARGETS_SUSPENSION):
        return {}
    own = terrain == "bumps" and variant == TARGETS_SUSPENSION
    return {**MEDIANS.get(terrain, {}), **(WITH_SUSPENSION if own else {})}


def _known(group: list[CellChange], metric: str) -> list[float]:
    found = [one.changes[metric] for one in group]
    return [change.value for change in found if change is not None]


def _range(values: list[float]) -> str:
    if not values:
        return "-"
    low, middle, high = (100.0 * f(values) for f in (min, np.median, max))
    return f"{middle:+.0f}" + (f" ({low:+.0f}, {high:+.0f})" if len(values) > 1 else "")


SAME_SIGNS = {SOLE_UNKNOWN: 1.0, KP_LOW: 0.9, KP_HIGH: 0.9}
"""Share of the rows that are to decrease of a controller with a wrong number, at least."""


def signs_table(changes: list[CellChange]) -> Table:
    """Return in how many cells each metric of DECREASING decreases with what is wrong."""
    rows = []
    for variant in (SOLE_UNKNOWN, *DISTURBED):
        own = [
            one for one in changes
            if one.variant == variant and one.cell.posture == LEAST_TORQUE
            and one.cell.terrain in JUDGED
        ]  # fmt: skip
        lost = sum(one.walked[1] - one.walked[0] for one in own)
        fallen = [sum(value < 0.0 for value in _known(own, metric)) for metric in DECREASING]
        share = sum(fallen) / (len(own) * len(DECREASING)) if own else 0.0
        least = SAME_SIGNS.get(variant)
        word = "-" if least is None or not own else "pass" if share >= least else "FAIL"
        rows.append([
            variant, f"{len(own)}", f"{lost}", *map(str, fallen), f"{100.0 * share:.0f}", word,
        ])  # fmt: skip
    head = [
        "controller", "cells", "runs that did not walk",
        *(f"{SHOWN[metric]} decreases in" for metric in DECREASING), "of all rows [%]", "verdict",
    ]  # fmt: skip
    return Table("Wrong numbers and measured forces: cells in which metrics decrease", head, rows)


# The claims of S1.

CLAIMS = {
    "the feet slide less": "slip_distance",
    'the "joints efforts" decrease: RMS': "torque_rms",
    'the "joints efforts" decrease: peak': "torque_peak",
    'the "energy consumed" decreases': "energy_per_metre",
    "the trunk's vertical motion is gentler": "vertical_acceleration_rms",
    "the trunk is steadier: roll": "roll_rms",
    "the trunk is steadier: pitch": "pitch_rms",
    "touch-downs are gentler": "force_peak",
}
"""What S1 promises of its control, in words, and the metric that has to decrease."""


def claims_table(changes: list[CellChange], found: Found) -> Table:
    """Return a row per promise: the median of each variant, and in how many cells it decreases."""
    names = [name for name in VARIANTS if name not in DISTURBED]
    rows = []
    for claim, metric in CLAIMS.items():
        columns = {
            name: _known([one for one in changes if one.variant == name], metric) for name in names
        }
        posture = [
            change.value for change in posture_changes(found).get(metric, {}).values() if change
        ]
        held = columns[S1]
        share = sum(value < 0.0 for value in held)
        word = "holds" if held and share == len(held) else f"in {share} of {len(held)}"
        texts = [_falls(columns[name]) for name in names]
        rows.append([
            claim, *texts, _falls(posture), word, _responsible(columns, posture),
        ])  # fmt: skip
    return Table(
        "S1's promises: median of the change [%], and the cells in which it decreases",
        ["promise", *names, "posture alone", "S1's two parts", "what does it"],
        rows,
    )


def _falls(values: list[float]) -> str:
    if not values:
        return "-"
    falling = sum(value < 0.0 for value in values)
    return f"{100.0 * np.median(values):+.0f} ({falling}/{len(values)})"


def _responsible(columns: Mapping[str, list[float]], posture: list[float]) -> str:
    """Return the parts with which a metric decreases in at least three quarters of the cells."""
    single = {name: columns[name] for name in SINGLE_PARTS if name in columns}
    single["posture"] = posture
    known = {
        name: float(np.median(values))
        for name, values in single.items()
        if values and np.mean(np.array(values) < 0.0) >= 0.75
    }
    ordered = sorted(known, key=lambda name: known[name])
    return ", ".join(ordered) or "none of them"


# What the posture does by itself.


def posture_changes(found: Found) -> dict[str, dict[Cell, Estimate | None]]:
    """Return by metric and cell what the posture of least torque changes, both conventional."""
    if not {OWN, LEAST_TORQUE} <= set(found.size.postures):
        return {}
    inward = [cell for cell in cells(found.size) if cell.posture == LEAST_TORQUE]
    return {
        metric: {cell: _posture_change(found.comparison, cell, metric) for cell in inward}
        for metric in SHOWN
    }


def _posture_change(comparison: Comparison, cell: Cell, metric: str) -> Estimate | None:
    own = Cell(cell.robot, OWN, cell.terrain, cell.contact)
    pairs = [
        (getattr(new.metrics, metric), getattr(old.metrics, metric))
        for new, old in zip(
            comparison.of(cell.name, CONVENTIONAL), comparison.of(own.name, CONVENTIONAL),
            strict=True,
        )
        if new.metrics is not None and old.metrics is not None
    ]  # fmt: skip
    known = [pair for pair in pairs if None not in pair]
    return relative_change([new for new, _ in known], [old for _, old in known])


def posture_table(found: Found) -> Table:
    """Return the share of the posture in each cell."""
    changes = posture_changes(found)
    first: Iterator[Cell] = iter(changes["torque_rms"]) if changes else iter(())
    rows = [[*cell.row, *(percent(changes[metric][cell]) for metric in SHOWN)] for cell in first]
    return Table(
        "The posture alone: conventional control in the posture of least torque against the "
        "robot's own [%]",
        [*HEAD, *SHOWN.values()],
        rows,
    )


def conventional_table(found: Found) -> Table:
    """Return the numbers of conventional control in their units."""
    rows = []
    for cell in cells(found.size):
        means = [found.comparison.mean(cell.name, CONVENTIONAL, metric) for metric in SHOWN]
        rows.append([*cell.row, *("-" if one is None else f"{one.value:.3g}" for one in means)])
    head = [f"{name} [{METRICS[metric].unit}]" for metric, name in SHOWN.items()]
    return Table("Conventional control", [*HEAD, *head], rows)
