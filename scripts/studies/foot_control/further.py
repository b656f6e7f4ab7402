"""Further cells of S1's comparison: dry joints, other ticks, and why numbers are missed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import failures
from hexapod_pin.text_table import Table
from studies.foot_control.cells import (
    DRY,
    LEAST_TORQUE,
    OWN,
    REFERENCE,
    TERRAINS,
    Found,
    Size,
    cells,
)
from studies.foot_control.judgement import (
    JUDGED,
    NO_CHANGE,
    CellChange,
    cell_changes,
    judged_table,
    median_table,
    percent,
)
from studies.foot_control.variants import (
    NO_PARTS,
    SOLE_UNKNOWN,
    TARGETS,
    TARGETS_SUSPENSION,
)
from studies.study import verdict

Runs = Callable[[Size], Found]
"""Runs everything of a size."""

AIMED = (TARGETS, TARGETS_SUSPENSION, SOLE_UNKNOWN)
"""Controllers that walk at `FINE_TICK`."""

FIRST_RUN: Mapping[str, Any] = {"estimate": False}
"""Settings of runs whose error as a whole is not controlled. The numbers are the same where the
control accepts the first run, at a quarter of the time."""

TICK, FINE_TICK = 0.005, 0.002
"""Of further grounds, and of the grounds of the main part once more [s]."""


def further_sizes(draws: int, seed: int) -> Iterator[Size]:
    """Yield what is run besides the main part, with draws of its own."""
    base = Size(
        robots=tuple(REFERENCE),
        postures=(OWN, LEAST_TORQUE),
        terrains=(DRY,),
        contacts=("accurate", "s1"),
        ticks=(TICK,),
        draws=dict.fromkeys(TERRAINS, draws),
        seed=seed,
        settings={},
        variants=(NO_PARTS, TARGETS_SUSPENSION),
    )
    yield base
    yield replace(
        base, postures=(LEAST_TORQUE,), terrains=JUDGED, ticks=(FINE_TICK,), variants=AIMED,
        settings=FIRST_RUN,
    )  # fmt: skip


# Why numbers are missed.

ACCURACIES = (1e-4, 1e-6)
"""Of conventional control and of a controller without parts, both [m and rad]."""

LOOKED_AT = (TARGETS, TARGETS_SUSPENSION, SOLE_UNKNOWN)
"""Controllers of which one thing is changed."""

CHANGED: Mapping[str, Mapping[str, Any]] = {
    "as drawn": {},
    "stroke 40 mm": {"gait": {"stroke": 0.04}},
    "stroke 100 mm": {"gait": {"stroke": 0.1}},
    "bumps half as high": {"bumps": 0.2},
}
"""Attributes of `Size` by what is changed of the draws of the main part, one thing at a time."""

DISSIPATIONS = (100.0, 30.0, 10.0, 1.0)
"""Of the sand, its own first [s/m]."""


def accuracy_sizes(draws: int, seed: int) -> Iterator[tuple[float, Size]]:
    """Yield runs without parts on S1's contact by accuracy, on the draws of the main part."""
    for accuracy in ACCURACIES:
        yield (
            accuracy,
            Size(
                robots=("athena",),
                postures=(LEAST_TORQUE,),
                terrains=("flat", "bumps"),
                contacts=("s1",),
                ticks=(TICK,),
                draws=dict.fromkeys(("flat", "bumps"), draws),
                seed=seed,
                settings={"accuracy": accuracy},
                variants=(NO_PARTS,),
            ),
        )


def energy_sizes(draws: int, seed: int) -> Iterator[tuple[str, Size]]:
    """Yield runs by what is changed of the draws of the main part."""
    for name, change in CHANGED.items():
        yield (
            name,
            Size(
                robots=tuple(REFERENCE),
                postures=(LEAST_TORQUE,),
                terrains=("bumps",),
                contacts=("accurate",),
                ticks=(TICK,),
                draws={"bumps": draws},
                seed=seed,
                settings=FIRST_RUN,
                variants=LOOKED_AT,
                **change,
            ),
        )


def sand_sizes(draws: int, seed: int) -> Iterator[tuple[str, Size]]:
    """Yield athena's runs on sand by its dissipation, on the draws of the main part."""
    for dissipation in DISSIPATIONS:
        yield (
            f"dissipation {dissipation:g} s/m",
            Size(
                robots=("athena",),
                postures=(LEAST_TORQUE,),
                terrains=("soil",),
                contacts=("soil",),
                ticks=(TICK,),
                draws={"soil": draws},
                seed=seed,
                settings={},
                variants=LOOKED_AT,
                dissipation=dissipation,
            ),
        )


# What they found.


@dataclass(frozen=True)
class Further:
    """Parts of the page, and what goes into the file beside it.

    Attributes:
        parts: paragraphs and tables, in order.
        changes: in all cells.
        drawn: gaits and grounds, as of `Found.data`.
        lost: a line for each run without numbers.
    """

    parts: list[str | Table]
    changes: list[CellChange]
    drawn: list[Mapping[str, Any]]
    lost: list[str]


def further_cells(run: Runs, draws: int, seed: int) -> Further:
    """Run further cells and judge them by the numbers that the main part is held to."""
    found = [run(size) for size in further_sizes(draws, seed)]
    changes = [change for one in found for change in cell_changes(one)]
    parts: list[str | Table] = [
        f"{FURTHER} Gaits and grounds are drawn from seed {seed}, {draws} of each robot on each "
        f"ground, as above.\n\n{JUDGED_ALIKE}",
        median_table(changes, "Further cells: median (least, largest), changes [%]"),
        judged_table(changes, "Further cells for which numbers are asked for: changes [%]"),
    ]
    lost = [line for one in found for line in failures(one.comparison)]
    return Further(parts, changes, [one.data for one in found], lost)


FURTHER_TITLE = "## Further cells: dry joints, ticks of 2 ms"

FURTHER = f"""\
{FURTHER_TITLE}

With dry joints the ground is flat and ticks are 5 ms. On the grounds above they are 2 ms here, for
force targets alone; there the error of the whole run is not controlled: the accuracy is that of the
first run, whose numbers are the same where the control would accept it. Soft ground is not run
here: `--grounds soil=3,patches=3` adds it to the cells above."""

JUDGED_ALIKE = """\
The same numbers are asked for as above; with dry joints those of flat ground, without medians."""


def accuracy_table(run: Runs, draws: int, seed: int) -> Table:
    """Return how far the slip path without parts is off conventional control by accuracy."""
    rows: list[list[str]] = []
    for accuracy, size in accuracy_sizes(draws, seed):
        found = run(size)
        for one in cell_changes(found):
            mean = found.comparison.mean(one.cell.name, CONVENTIONAL, "slip_distance")
            change = one.changes["slip_distance"]
            good = change is not None and abs(change.value) <= NO_CHANGE
            last = accuracy == ACCURACIES[-1]
            rows.append([
                one.cell.robot, one.cell.terrain, one.cell.contact, f"{accuracy:g}",
                "-" if mean is None else f"{1e3 * mean.value:.4g}", f"{one.walked[0]}",
                percent(change), verdict(good) if last else "-",
            ])  # fmt: skip
    head = [
        "robot", "ground", "contact", "accuracy of both [m and rad]", "conventional [mm]", "walks",
        "no parts, change [%]", "within 1 %",
    ]  # fmt: skip
    rows.sort(key=lambda row: row[1])
    return Table(ACCURACY_TITLE, head, rows)


def energy_table(run: Runs, draws: int, seed: int) -> Table:
    """Return what force targets save of the energy, one thing of gait or ground changed."""
    sizes = energy_sizes(draws, seed)
    return _changed_table(run, sizes, "energy_per_metre", "[J/m]", ENERGY_TITLE)


def sand_table(run: Runs, draws: int, seed: int) -> Table:
    """Return what force targets make of the largest torque on sand that dissipates less."""
    return _changed_table(run, sand_sizes(draws, seed), "torque_peak", "[N m]", SAND_TITLE)


ACCURACY_TITLE = "Slip path without parts, by accuracy"
ENERGY_TITLE = "Energy, one thing changed: changes [%]"
SAND_TITLE = "Torque peak on sand, its dissipation changed: changes [%]"


def _changed_table(
    run: Runs, sizes: Iterable[tuple[str, Size]], metric: str, unit: str, title: str
) -> Table:
    """Return the change of one number by controller, in runs of which one thing is changed."""
    rows: list[list[str]] = []
    for name, size in sizes:
        found = run(size)
        changes = cell_changes(found)
        for cell in cells(found.size):
            own = [one for one in changes if one.cell == cell]
            mean = found.comparison.mean(cell.name, CONVENTIONAL, metric)
            rows.append([
                cell.robot, cell.terrain, cell.contact, name,
                f"{min(one.walked[0] for one in own)}",
                "-" if mean is None else f"{mean.value:.3g}",
                *(percent(one.changes[metric]) for one in own),
            ])  # fmt: skip
    head = [
        "robot", "ground", "contact", "what is changed", "walks", f"conventional {unit}",
        *LOOKED_AT,
    ]  # fmt: skip
    rows.sort(key=lambda row: row[0])
    return Table(title, head, rows)
