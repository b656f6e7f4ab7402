"""Further cells of S1's comparison: other grounds and ticks, and why numbers are missed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import failures
from hexapod_pin.text_table import Table
from studies.foot_control.cells import DRY, LEAST_TORQUE, OWN, REFERENCE, Found, Size, cells
from studies.foot_control.judgement import (
    NO_CHANGE,
    CellChange,
    cell_changes,
    judged_table,
    known_changes,
    median_range,
    median_table,
    percent,
)
from studies.foot_control.variants import (
    NO_PARTS,
    NO_PID,
    S1,
    SOLE_UNKNOWN,
    TARGETS,
    TARGETS_SUSPENSION,
)
from studies.study import verdict

Runs = Callable[[Size], Found]
"""Runs everything of a size."""

WHOLE = (NO_PARTS, S1, TARGETS, TARGETS_SUSPENSION, SOLE_UNKNOWN)
"""Controllers that walk in further cells; with dry joints the first and the fourth."""

TICK, FINE_TICK = 0.005, 0.002
"""Of further grounds, and of the grounds of the main part once more [s]."""


def further_sizes(draws: int, seed: int) -> Iterator[Size]:
    """Yield what is run besides the main part, with draws of its own."""
    base = Size(
        robots=tuple(REFERENCE),
        postures=(LEAST_TORQUE,),
        terrains=("soil", "patches"),
        contacts=("accurate", "s1"),
        ticks=(TICK,),
        draws=dict.fromkeys(("soil", "patches", DRY, "flat", "cross", "bumps"), draws),
        seed=seed,
        settings={},
        variants=WHOLE,
    )
    yield base
    yield replace(
        base, postures=(OWN, LEAST_TORQUE), terrains=(DRY,), variants=(NO_PARTS, TARGETS_SUSPENSION)
    )
    yield replace(base, terrains=("flat", "cross", "bumps"), ticks=(FINE_TICK,))


# Why numbers are missed.

ACCURACIES = (1e-4, 1e-5, 1e-6)
"""Of conventional control and of a controller without parts, both [m and rad]."""

SAVING = (TARGETS, TARGETS_SUSPENSION, SOLE_UNKNOWN, NO_PID)
"""Controllers whose energy is looked at."""

CHANGED: Mapping[str, Mapping[str, Any]] = {
    "as drawn": {},
    "stroke 40 mm": {"gait": {"stroke": 0.04}},
    "stroke 100 mm": {"gait": {"stroke": 0.1}},
    "lift 25 mm": {"gait": {"lift": 0.025}},
    "bumps half as high": {"bumps": 0.2},
}
"""Attributes of `Size` by what is changed of the draws of the main part, one thing at a time."""


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
        grounds = ("bumps",) if "bumps" in change else ("flat", "bumps")
        yield (
            name,
            Size(
                robots=tuple(REFERENCE),
                postures=(LEAST_TORQUE,),
                terrains=grounds,
                contacts=("accurate", "s1"),
                ticks=(TICK,),
                draws=dict.fromkeys(grounds, draws),
                seed=seed,
                settings={},
                variants=SAVING,
                **change,
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
    parts = [
        f"{FURTHER} Gaits and grounds are drawn from seed {seed}, {draws} of each robot on each "
        f"ground, as above.\n\n{JUDGED_ALIKE}",
        median_table(changes, "Further cells: median (least, largest), changes [%]"),
        judged_table(changes, "Further cells for which numbers are asked for: changes [%]"),
    ]
    lost = [line for one in found for line in failures(one.comparison)]
    return Further(parts, changes, [one.data for one in found], lost)


FURTHER_TITLE = "## Further cells: soft ground, dry joints, ticks of 2 ms"

FURTHER = f"""\
{FURTHER_TITLE}

Whole controllers walk on soft ground (sand; squares of soft and hard ground) and with dry joints
at ticks of 5 ms, and on the grounds above at ticks of 2 ms."""

JUDGED_ALIKE = """\
The same numbers are asked for as above; on soft ground and with dry joints those of flat ground,
without medians."""


def accuracy_table(run: Runs, draws: int, seed: int) -> Table:
    """Return how far the slip path without parts is off conventional control by accuracy."""
    rows = []
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
    return Table("Slip path without parts, by accuracy", head, sorted(rows, key=lambda row: row[1]))


def energy_table(run: Runs, draws: int, seed: int) -> Table:
    """Return what force targets save of the energy, one thing of gait or ground changed."""
    rows = []
    for name, size in energy_sizes(draws, seed):
        found = run(size)
        changes = cell_changes(found)
        for terrain in found.size.terrains:
            group = [one for one in changes if one.cell.terrain == terrain]
            walked = [one.walked for one in group]
            rows.append([
                terrain, name, f"{sum(a for a, _ in walked)}/{sum(b for _, b in walked)}",
                *(_conventional_energy(found, robot, terrain) for robot in REFERENCE),
                *(
                    median_range(known_changes(
                        [one for one in group if one.variant == variant], "energy_per_metre"
                    ))
                    for variant in SAVING
                ),
            ])  # fmt: skip
    head = [
        "ground", "what is changed", "walked",
        *(f"conventional, {robot} [J/m]" for robot in REFERENCE), *SAVING,
    ]  # fmt: skip
    rows.sort(key=lambda row: row[0] != "flat")
    return Table("Energy, one thing changed: median over cells (least, largest) [%]", head, rows)


def _conventional_energy(found: Found, robot: str, terrain: str) -> str:
    """Return the mean over contacts of the energy of conventional control [J/m]."""
    means = [
        found.comparison.mean(cell.name, CONVENTIONAL, "energy_per_metre")
        for cell in cells(found.size)
        if (cell.robot, cell.terrain) == (robot, terrain)
    ]
    values = [mean.value for mean in means if mean is not None]
    return f"{sum(values) / len(values):.3g}" if values else "-"
