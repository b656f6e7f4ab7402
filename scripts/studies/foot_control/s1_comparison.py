"""S1's comparison: each part of foot control, and parts together, beside conventional control."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hexapod_pin.results.comparison import failures
from hexapod_pin.results.schema import require_known
from hexapod_pin.results.walk_metrics import Estimate
from hexapod_pin.text_table import Table
from studies.foot_control.cells import (
    ACCURATE,
    KINDS,
    LEAST_TORQUE,
    LIFT,
    OWN,
    REFERENCE,
    STROKE,
    SWING,
    TERRAINS,
    Found,
    Size,
)
from studies.foot_control.further import (
    ACCURACY_TITLE,
    ENERGY_TITLE,
    FURTHER_TITLE,
    SAND_TITLE,
    Runs,
    accuracy_table,
    energy_table,
    further_cells,
    sand_table,
)
from studies.foot_control.judgement import (
    SHOWN,
    CellChange,
    cell_changes,
    claims_table,
    conventional_table,
    judged_table,
    median_table,
    posture_table,
    signs_table,
)
from studies.study import RESULTS, StudyReport

SEED = 20261127
CONTACTS = ("accurate", "s1", "s1-printed", "s2")
FASTER: dict[str, Any] = {"method": "robust", "step": 5e-3, "accuracy": None}
"""Settings of the runs of a quick study: fixed steps, for what the tables are, not for numbers."""


def s1_comparison(
    *,
    draws: int = 10,
    seed: int = SEED,
    robots: str = ",".join(REFERENCE),
    postures: str = f"{OWN},{LEAST_TORQUE}",
    grounds: str = ",".join(TERRAINS),
    contacts: str = "accurate,s1",
    ticks: str = "2,5",
    further: int = 0,
    further_seed: int = SEED + 1,
    accuracy: int = 0,
    energy: int = 0,
    sand: int = 0,
    keep: bool = False,
    store: Path = Path(),
    threads: int = 2,
    quick: bool = False,
) -> StudyReport:
    """S1's claims, part by part, on gaits and grounds drawn from a seed.

    A ground may have a number of draws of its own, such as "flat,bumps,soil=3". `further` is the
    number of draws of further cells (dry joints, ticks of 2 ms), from a seed of their own;
    `accuracy`, `energy` and `sand` are those of the runs that look for reasons, which are drawn as
    in the main part. With `keep` all that stands in the page and is not run again is kept. With a
    store (an SQLite file) finished runs are kept, and the study continues where it was stopped;
    runs that failed are run again. `quick` takes one robot, one ground, 5 ms and fixed steps of
    5 ms.
    """

    def run(size: Size) -> Found:
        how: dict[str, Any] = {"threads": threads}
        if store != Path():
            how |= {"store": store, "resume": store.exists(), "retry_failed": store.exists()}
        return Found.of(size, **how)

    drawn = _draws("bumps" if quick else grounds, min(draws, 2) if quick else draws)
    size = Size(
        robots=("kharagpur",) if quick else _names("robot", robots, REFERENCE),
        postures=_names("posture", postures, (OWN, LEAST_TORQUE)),
        terrains=tuple(drawn),
        contacts=("accurate",) if quick else _names("contact", contacts, CONTACTS),
        ticks=(0.005,) if quick else tuple(1e-3 * float(tick) for tick in ticks.split(",")),
        draws=drawn,
        seed=seed,
        settings=FASTER if quick else {},
    )
    before = kept(RESULTS) if keep else Kept([], {}, {})
    parts, data = (before.main, before.data) if keep else _main_part(run, size)
    again: list[str] = []
    if further:
        more = further_cells(run, further, further_seed)
        parts += [*more.parts, _without_numbers(more.lost)]
        data["further"] = {"cells": [_plain(one) for one in more.changes], "drawn": more.drawn}
        again.append(FURTHER_TITLE.removeprefix("## "))
    else:
        parts += [before.tables[FURTHER]] if FURTHER in before.tables else []
    parts.append(REASONS)
    reasons = (
        (accuracy, accuracy_table, ACCURACY_TITLE),
        (energy, energy_table, ENERGY_TITLE),
        (sand, sand_table, SAND_TITLE),
    )
    for count, table, title in reasons:
        if count:
            parts.append(table(run, count, seed))
            again.append(title.partition(":")[0])
        elif title in before.tables:
            parts.append(before.tables[title])
    if keep:
        parts.insert(0, KEPT.format("; ".join(again) or "nothing"))
    return StudyReport("S1's comparison", parts, data)


def _main_part(run: Runs, size: Size) -> tuple[list[str | Table], dict[str, Any]]:
    """Run the cells of the main part. Return its parts of the page, and its data."""
    found = run(size)
    changes = cell_changes(found)
    parts: list[str | Table] = [
        INTRODUCTION,
        _drawn(size),
        claims_table(changes, found),
        READING,
        median_table(changes),
        DISTURBANCES,
        signs_table(changes),
        posture_table(found),
        conventional_table(found),
        ASKED,
        judged_table(changes),
        _without_numbers(failures(found.comparison)),
    ]
    return parts, {
        "numbers": ["change [-]", "half of its 95 % interval [-]"],
        "cells": [_plain(one) for one in changes],
        "drawn": found.data,
    }


def _without_numbers(lost: list[str]) -> str:
    return "Runs without numbers: " + ("; ".join(lost) if lost else "none") + "."


@dataclass(frozen=True)
class Kept:
    """What stands in a page.

    Attributes:
        main: the main part, with the command that has run it.
        tables: what follows it by `FURTHER` and the titles of its last tables.
        data: of the file beside it.
    """

    main: list[str | Table]
    tables: dict[str, str]
    data: dict[str, Any]


FURTHER = "further"


def kept(folder: Path) -> Kept:
    """Return what stands in a page of a folder."""
    name = s1_comparison.__name__
    text = (folder / f"{name}.md").read_text(encoding="utf-8")
    data: dict[str, Any] = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    main = text.partition("\n\n")[2]
    if KEPT_BEGIN in main:  # that of an earlier command, which has kept it
        main = main.partition(KEPT_BEGIN)[2].partition("\n\n")[2]
    main, _, last = main.partition(f"\n{REASONS_BEGIN}")
    main, title, further = main.partition(f"\n{FURTHER_TITLE}")
    tables = {FURTHER: f"{title}{further}".strip()} if title else {}
    for part in last.split("\n## ")[1:]:
        tables[part.partition("\n")[0]] = f"## {part}".rstrip()
    by = data.get("main", {key: data[key] for key in ("command", "machine")})
    names = {"numbers", "cells", "drawn", FURTHER} & data.keys()
    return Kept([main.rstrip()], tables, {"main": by, **{key: data[key] for key in sorted(names)}})


def _names(kind: str, text: str, known: Iterable[str]) -> tuple[str, ...]:
    """Return the names in a comma-separated list; UnknownNameError lists the known ones."""
    found = tuple(name.strip() for name in text.split(","))
    for name in found:
        require_known(kind, name, tuple(known))
    return found


def _draws(grounds: str, draws: int) -> dict[str, int]:
    """Return the number of draws by ground; "soil=3" has its own."""
    parts = [text.partition("=") for text in grounds.split(",")]
    names = _names("ground", ",".join(part[0] for part in parts), TERRAINS)
    return {name: int(part[2] or draws) for name, part in zip(names, parts, strict=True)}


def _plain(one: CellChange) -> dict[str, Any]:
    return {
        "cell": one.cell.row,
        "tick": one.tick,
        "controller": one.variant,
        "walked": one.walked,
        **{metric: _digits(one.changes[metric]) for metric in SHOWN},
    }


def _digits(change: Estimate | None) -> list[float | None] | None:
    if change is None:
        return None
    half = change.half_width
    return [float(f"{change.value:.4g}"), None if half is None else float(f"{half:.2g}")]


def _drawn(size: Size) -> str:
    """Return what was drawn, as text."""
    swings = "; ".join(f"{name} {low:g} to {high:g} s" for name, (low, high) in SWING.items())
    ends = [f"{1e3 * low:g} to {1e3 * high:g} mm" for low, high in (STROKE, LIFT)]
    return (
        f"Gaits and grounds are drawn from seed {size.seed}, of each robot "
        f"{', '.join(f'{count} on {name}' for name, count in size.draws.items())}: "
        f"{', '.join(KINDS)}, stroke {ends[0]}, lift {ends[1]}, swing {swings}. A gait "
        "that one of the postures cannot walk is drawn again. All controllers walk the same gaits "
        "on the same grounds, in both postures, with all contacts and ticks. A run starts from "
        "standing and has two whole steady cycles. Accuracy is the default, of runs without parts "
        f"{ACCURATE:g}: at the default integration alone makes them slip up to 3 % less."
    )


KEPT_BEGIN = "This command has run:"
KEPT = f"{KEPT_BEGIN} {{}}. All else was kept as this command had written it:"

DISTURBANCES = """\
What the controller knows of the robot is wrong or measured, in the posture of least torque. Kp too
low or too high: it counts on servos with 0.7 or 1.3 of their gains (`FootControl.servo`). Forces
from torques: J^-T (own torques - torques) behind a filter of 40 Hz, no sensors in the feet. From
currents: friction of the joints is not known, torques are noisy by 0.02 N m and angles by 1e-4 rad
(standard deviations), sensors and commands are 2 ms late each (all *assumed*). Rows: slip path,
energy and vertical acceleration in each cell; asked for of another sole all of them, of another kp
9 of 10."""

REASONS_BEGIN = "What misses, and why (further runs)."
REASONS = f"""\
{REASONS_BEGIN}

- *Medians of energy.* Strides are short here. Lifting a foot costs the same work at every stroke,
  and targets save none of it. Flat ground: they save 4 % at strokes of 40 to 50 mm and 8 % at 70 to
  80 mm (medians), one point per 10 mm by regression over all walks; with 100 mm 13 % (athena,
  tripod) and 9 % (kharagpur, tetrapod). Bumps, ticks of 2 ms, 12 walks: 4 points per 10 mm
  (correlation 0.80; with the suspension 0.79, without the soles 0.77), so that 12 % is reached at
  65 mm, and 10 % at the mean stroke of 60 mm. Stroke and kind of gait are not independent there.
  In the last table they are: the same gaits save 4 to 7 % with 40 mm, 5 to 16 % as drawn and 17 to
  26 % with 100 mm (kharagpur the least, athena the most; three gaits each). The suspension
  changes energy by -0.2 points in the mean and 2 at most, so it is not the cause. Pushing soles
  down costs 1 to 4 points on flat ground: without it a controller saves more energy, and improves
  all else less.
- *Slip path without parts, athena with S1's contact.* It is the error of the integration of
  conventional control, which slips 2 to 4 % too far at the default accuracy. With the same gaits at
  1e-6 both paths agree within 0.2 % in the mean (table "by accuracy").
- *Torques with dry joints, athena.* Friction does it: of the same gaits on sticking contact the
  torque RMS changes by +1.2, +2.6 and +4.6 % and its peak by -5, +7 and +18 % with 0, 0.1 and 0.2 N
  m. Offsets of set-points do not know of it.
- *Ticks of 2 ms.* Of three gaits the interval is 4.3 standard errors wide on each side: most rows
  that miss do so by their interval alone, on bumps and in the upper end of the peak. By its mean
  one does, the peak of athena's targets without suspension on bumps with sticking contact.
- *Sand and squares of soft ground.* Three gaits each, so that most rows miss by their interval, of
  20 to 50 points in the peak. Two miss by their mean: the peak of athena's targets on sand (+15 %;
  -6 % with the suspension) and that of two-sided deviations there (+27 %). The sand's dissipation
  does it where the sole is known (last table): with 1 instead of 100 s/m the peak falls by 12 %,
  and with the sole unknown it does not rise on any of the four sands by more than 2 %. Soles are
  pressed and lifted as they sink slowly; a foot that rises faster than 1/dissipation = 10 mm/s has
  no force. Both tetrapods peak just before two feet land (+20 and +31 %), the wave does not (-4
  %). There, of the second, the rear left foot that is about to lift carries nothing (5 N
  conventionally) and the rear right one 50 N (40 N).
- *Torques of two-sided deviations across the way, own posture, sticking contact.* The slope takes
  tan 7 degrees = 0.12 of the cone of 0.35; what is left props legs too little. With
  `ForceTargets(friction=0.47)` torque RMS changes by 0 % and its peak by -4 and +6 % (one walk of
  each robot).
- *Nothing asked, but worth knowing.* Where deviations are corrected both ways, feet on S1's contact
  creep up to their targets in the robot's own posture, and slide as far as without."""

INTRODUCTION = """\
S1 corrects the positions of the feet by a PID on tangential contact forces, lets the legs yield to
normal forces (virtual suspension), adds both to the planned feet, and compares that with
conventional kinematic control. S1 promises less slip, a steadier trunk, gentler touch-downs, and
"decreasing both the joints efforts and the energy consumed". It prints neither equations nor gains
nor numbers: the equations are those of [foot control](../foot_control.md), and their gains follow
from stated bandwidths (*assumed*), the same on all grounds.

All numbers are changes in percent against `hp.KinematicControl` **in the same posture, with the
same gait, on the same ground**; ± is half of the 95 % interval over gaits and grounds. Parts are
tried one by one, so that a change has one cause: the ticks alone ("no parts"), the anticipation of
the servos' yield (not in S1), S1's PID, S1's suspension leg by leg, and the posture, which no
controller changes. The [posture of least torque](../walking.md#posture-of-least-torque) is
searched for a tripod with a stroke of 60 mm and a lift of 40 mm. The changes of every controller
in every cell, with their intervals, are in `s1_comparison.json` beside this page.

Grounds: flat; 7 degrees across the way; bumps of 0.4 of the lift, 0.4 m long; sand
(`Contact.soil`); squares of 0.2 m with 0.02 to 1 of the ground's stiffness; flat ground and joints
with dry friction of 0.1 N m (athena) and 0.03 N m (kharagpur). Parts walk alone on flat ground and
bumps, whole controllers on the others; with dry joints the one without parts and that with most."""

READING = """\
A promise holds where it does in every cell of robot, posture, ground, contact and tick. "What does
it" names the single parts with which the number decreases in at least three quarters of the cells,
the strongest first. Why torques cannot decrease much on flat ground: servos of one stiffness, on
feet that stick, share the load with the least sum of squared torques by themselves (Castigliano),
so that only the posture, or a better sharing on uneven ground, can lower their RMS."""

ASKED = """\
What is asked for. Of a controller without parts at 5 ms: within 1 % of conventional control in
every number, with dry joints, too. Of force targets, with the suspension or without, in the
posture of least torque on flat ground, across the slope and on bumps: slip path, energy and
vertical acceleration decrease in every cell, on bumps with the whole interval; torque RMS at most
+2 %, torque peak at most +5 % and the upper end of its interval at most +10 %; roll, pitch and
touch-down force in no cell surely above +2 %. Of targets that do not know the sole: the same three
numbers decrease. Of targets from which the PID takes deviations both ways, in the robot's own
posture: torque RMS at most +3 %, peak at most +12 %. Medians asked for stand in the table of
medians. In other cells nothing is asked for."""
