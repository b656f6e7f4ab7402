"""The report of a motor selection has sections with tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from itertools import zip_longest
from typing import TYPE_CHECKING

from hexapod_pin.results.motor_selection import USES
from hexapod_pin.view.report_blocks import (
    UNKNOWN,
    Block,
    Cell,
    Column,
    Facts,
    Heading,
    Items,
    Paragraph,
    SignatureFields,
    Table,
    Title,
    Verdict,
    margin_text,
    number,
    use_text,
    with_unit,
)
from hexapod_pin.view.selection_figures import pictures
from hexapod_pin.view.selection_words import (
    deciding,
    mass_change,
    price_text,
    verdict_level,
    verdict_texts,
    verdict_word,
)

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.motor_selection import KindUse, MotorCandidate, MotorSelection


FAILING = 10
"""Motors that do not pass and are shown with all numbers; of the others, the largest use."""

REASONS = 3
"""Reasons that are given for each motor; how many more there are is said."""


def selection_blocks(s: MotorSelection, date: str | None) -> Iterator[Block]:
    """Return the whole report."""
    yield Title(f"Motor selection: {s.robot_name}")
    yield Facts(_facts(s, date))
    yield Verdict(verdict_word(s), verdict_texts(s), verdict_level(s))
    yield from _choice(s)
    yield from _ranking(s)
    yield from pictures(s)
    yield from _simulated(s)
    yield from _grounds(s)
    yield from _sources(s)
    yield SignatureFields(("Prepared by", "Checked by", "Approved by"))


def _facts(s: MotorSelection, date: str | None) -> tuple[tuple[str, str], ...]:
    share = f"of it motors of {1e3 * s.contained:.3g} g each, which are replaced"
    return (
        ("Robot", f"{s.robot_name}, {number(s.total_mass)} kg as its file says ({share})"),
        ("Walks to be carried", "; ".join(s.walks) or UNKNOWN),
        (
            "Motors",
            f"{len(s.candidates)} judged, {sum(c.passes for c in s.candidates)} of them pass on "
            f"all joints; {len(s.unusable)} could not be judged. Catalogue: {s.catalog}",
        ),
        (
            "Allowed",
            f"{s.derating.peak:g} of the torque-speed line at {s.derating.voltage:g} of the rated "
            f"voltage; for ever the published rated torque, else {s.derating.continuous:g} of the "
            "stall torque",
        ),
        ("Made by", f"hexapod-pin {version('hexapod-pin')}" + (f", {date}" if date else "")),
    )


def _choice(s: MotorSelection) -> Iterator[Block]:
    best = s.best
    what = "Choice" if s.choice is not None else "No choice; the first in rank"
    yield Heading(f"1. {what}")
    yield choice_table(best)
    yield Facts(
        (
            ("Robot with these motors", mass_change(s, best)),
            ("Motors in all", with_unit(best.motor_mass, "kg")),
            ("Price of all", price_text(best)),
            ("Battery current (estimate)", _battery(best)),
            *((("Of the masses", "; ".join(best.notes)),) if best.notes else ()),
        )
    )
    if s.iterations:
        yield Paragraph(
            "Lightest motor for each kind of joint, the motors' masses, rotors and lines fed back "
            "into the simulation until masses and choice agree:"
        )
        yield iteration_table(s.iterations)


def _battery(best: MotorCandidate) -> str:
    peak, mean = (
        with_unit(best.battery_current_peak, "A"),
        with_unit(best.battery_current_mean, "A"),
    )
    return peak if peak == mean == UNKNOWN else f"{peak} peak, {mean} mean; hardest walks"


def _ranking(s: MotorSelection) -> Iterator[Block]:
    passing = [c for c in s.candidates if c.passes]
    others = [c for c in s.candidates if not c.passes]
    yield Heading("2. Ranking: one motor on all joints")
    yield Paragraph(f"{USE_NOTE} Battery peaks are estimates.", small=True)
    if passing:
        yield Paragraph(f"Motors that pass ({len(passing)}), the lightest first:")
        yield from ranking_tables(s, passing)
    else:
        yield Paragraph("No motor passes on all joints.")
    if others:
        near = others[:FAILING]
        yield Paragraph(f"Motors that fail: the nearest {len(near)} of {len(others)}:")
        yield from ranking_tables(s, near)
        yield _reasons(near)
    if others[FAILING:]:
        rest = (f"{c.name} ({use_text(deciding(c.uses).use)})" for c in others[FAILING:])
        yield Paragraph(f"Fail as well, with their largest use [-]: {', '.join(rest)}.", small=True)
    if s.unusable:
        yield Paragraph("Could not be judged:", small=True)
        yield Items(tuple(f"{name}: {why}" for name, why in s.unusable))


def _reasons(candidates: Sequence[MotorCandidate]) -> Table:
    rows = []
    for c in candidates:
        found = _varied_reasons(c)
        more = len(found) - REASONS
        found = found[:REASONS] or [UNKNOWN]
        found += [f"and {more} more reason{'s' * (more > 1)}"] if more > 0 else []
        rows.append((Cell(c.name), Cell("; ".join(found))))
    return Table((Column("Motor", wide=True), Column("Why it is rejected", wide=True)), tuple(rows))


def _varied_reasons(candidate: MotorCandidate) -> list[str]:
    """Return all reasons: the first of each kind of joint and of the walks, then the second."""
    groups = [[f"{u.kind}: {reason}" for reason in u.reasons] for u in candidate.uses]
    groups.append([f"{run.walk}: {run.text}" for run in candidate.runs if not run.walks])
    rows = zip_longest(*groups)
    return [reason for row in rows for reason in row if reason is not None]


def _simulated(s: MotorSelection) -> Iterator[Block]:
    yield Heading("4. What was simulated")
    yield Paragraph(f"With {s.best.name}, their masses, rotors and torque-speed lines acting:")
    rows = [(Cell(run.walk), result_cell(run.walks), Cell(run.text)) for run in s.best.runs]
    columns = (Column("Walk", wide=True), Column("Walks"), Column("Verdict", wide=True))
    yield Table(columns, tuple(rows) or ((Cell(UNKNOWN), Cell(UNKNOWN), Cell(UNKNOWN)),))
    if s.confidence is not None:
        yield Paragraph(f"Inputs sampled for the confidence, in the walk {s.confidence.walk}:")
        yield Items(s.confidence.inputs or (UNKNOWN,))


def _grounds(s: MotorSelection) -> Iterator[Block]:
    yield Heading("5. Derating, assumptions and notes")
    yield Paragraph("Derating and its evidence:")
    yield Items(s.derating.evidence or (UNKNOWN,))
    yield Paragraph("Assumed, because no source gives it:")
    yield Items(_assumed(s) or ("nothing",))
    notes = dict.fromkeys(note for d in s.demands.values() for note in d.notes)
    yield Paragraph("Notes:")
    yield Items(tuple(dict.fromkeys([*s.notes, *notes])) or ("none",))


def _assumed(s: MotorSelection) -> tuple[str, ...]:
    """Return what is assumed; of the motors, where it is to be found."""
    of_motors = {line for record in _records(s) for line in record.assumed}
    found = [line for line in s.assumed if line not in of_motors]
    if of_motors:
        found.append("of motors (rotor inertias): see each motor's row in section 6")
    return tuple(found)


def _records(s: MotorSelection) -> list[MotorRecord]:
    """Return all motors of the report, those of the choice first."""
    listed = [s.best, *s.iterations, *s.candidates]
    return list({r.name: r for c in listed for r in c.motors.values()}.values())


def _sources(s: MotorSelection) -> Iterator[Block]:
    yield Heading("6. Motors: data and sources")
    used = list({record.name: record for record in s.best.motors.values()}.values())
    yield Paragraph("Published data of the motors of section 1:")
    yield data_sheet_table(used)
    yield Paragraph("Sources, assumptions, flags and notes of all motors that were judged:")
    columns = (Column("Motor", wide=True), Column("Source", wide=True),
               Column("Assumed, flags, notes", wide=True))  # fmt: skip
    yield Table(columns, tuple(_source_row(record) for record in _records(s)))


def _source_row(record: MotorRecord) -> tuple[Cell, ...]:
    remarks = [f"assumed: {line}" for line in record.assumed]
    remarks += [*record.flags, *([record.note] if record.note else [])]
    return Cell(record.name), Cell(record.source or UNKNOWN), Cell("; ".join(remarks) or "none")


# The tables of a motor selection's report: ranking, choice, iteration, data sheets.

SHORT = {
    "peak_use": "peak", "continuous_use": "RMS", "holding_use": "hold", "speed_use": "speed",
}  # fmt: skip
KINDS_ACROSS = 3
"""Kinds of joints side by side in a table."""

USE_NOTE = (
    "Uses are need over what the derated motor may give [-], the worst joint of the kind in the "
    "worst walk; above 1 (marked *) it does not pass. peak: largest torque over the torque-speed "
    "line at that speed; RMS: over the continuous torque; hold: static torque on all feet over the "
    "continuous torque, or in the worst stance of the walk over the derated stall torque; speed: "
    "over the no-load speed under load; ∞: beyond the no-load speed. Margin: 1 - largest use."
)


def use_cell(use: float) -> Cell:
    """Return a use; marked where it is above 1."""
    return Cell(f"{use_text(use)} *", "bad") if use > 1.0 else Cell(use_text(use))


def result_cell(passes: bool) -> Cell:
    """Return whether something passes."""
    return Cell("pass", "good") if passes else Cell("FAIL", "bad")


def choice_table(candidate: MotorCandidate) -> Table:
    """Return what each kind of joint takes of its motor, a column each."""
    columns = (
        Column("", wide=True),
        *(Column(f"{use.kind} joints", wide=True) for use in candidate.uses),
    )
    rows = tuple(
        (Cell(label), *(value(candidate, use) for use in candidate.uses))
        for label, value in _CHOICE
    )
    return Table(columns, rows, note=CHOICE_NOTE)


def _worst_walk(name: str) -> Callable[[MotorCandidate, KindUse], Cell]:
    def cell(_: MotorCandidate, use: KindUse) -> Cell:
        value = use_cell(getattr(use, name))
        walk = use.walk.get(name, "")
        return value._replace(text=f"{value.text} ({walk})" if walk else value.text)

    return cell


_CHOICE: tuple[tuple[str, Callable[[MotorCandidate, KindUse], Cell]], ...] = (
    ("Motor", lambda c, u: Cell(c.motors[u.kind].name)),
    ("Mass of one [g]", lambda c, u: Cell(_grams(c.motors[u.kind].mass))),
    ("Peak torque, use [-]", _worst_walk("peak_use")),
    ("RMS torque, use [-]", _worst_walk("continuous_use")),
    ("Holding torque, use [-]", _worst_walk("holding_use")),
    ("Speed, use [-]", _worst_walk("speed_use")),
    ("Margin", lambda c, u: Cell(margin_text(deciding((u,)).use))),
    ("Holding with a leg lost, use [-]", lambda c, u: Cell(use_text(u.lost_leg_use))),
    ("Time outside the derated line [%]", lambda c, u: Cell(number(100.0 * u.outside_share, 2))),
    ("Load over rotor inertia [-]", lambda c, u: Cell(number(u.inertia_ratio, 2))),
    ("Result", lambda c, u: result_cell(u.passes)),
)
"""Label and value of each row of the table of the choice."""

CHOICE_NOTE = (
    "Use: need over what the derated motor may give, of the worst joint, in the walk in brackets; "
    "above 1 (marked *) it does not pass. Margin: 1 - largest use. With a leg lost: static torque "
    "over the derated stall torque, for information; unknown where a stance of a walk cannot stand "
    "without a leg."
)


def iteration_table(steps: Sequence[MotorCandidate]) -> Table:
    """Return the choices one after another, until masses and motors agree."""
    columns = (
        Column("Step"), Column("Motors", wide=True), Column("All motors [kg]"),
        Column("Robot [kg]"), Column("Largest use [-]"), Column("Result", wide=True),
    )  # fmt: skip
    rows = tuple(
        (
            Cell(str(k)), Cell(step.name), Cell(number(step.motor_mass)),
            Cell(number(step.total_mass)), use_cell(deciding(step.uses).use),
            Cell("passes", "good") if step.passes else Cell(f"fails: {step.reasons[0]}", "bad"),
        )
        for k, step in enumerate(steps, start=1)
    )  # fmt: skip
    return Table(columns, rows)


def ranking_tables(
    s: MotorSelection, candidates: Sequence[MotorCandidate]
) -> Iterator[Table]:  # fmt: skip
    """Return candidates with all their uses, a table for every three kinds of joints."""
    for first in range(0, max(len(s.kinds), 1), KINDS_ACROSS):
        yield _ranking_table(s, candidates, s.kinds[first : first + KINDS_ACROSS], first == 0)


def _ranking_table(
    s: MotorSelection, candidates: Sequence[MotorCandidate], kinds: Sequence[str], whole: bool
) -> Table:
    """Return one table; uses that are unknown of all its motors are said below it."""
    shown = {
        kind: [n for n in USES if any(not math.isnan(_use(c, kind, n)) for c in candidates)]
        for kind in kinds
    }
    places = {c.name: k for k, c in enumerate(s.candidates, start=1)}
    general = _GENERAL if whole else _GENERAL[-1:]
    priced = any(price_text(c) != UNKNOWN for c in candidates)
    general = [column for column in general if priced or column[0] != PRICE]
    columns = [Column("No."), Column("Motor on all joints", wide=True)]
    columns += [Column(SHORT[name]) for kind in kinds for name in shown[kind]]
    columns += [Column(title) for title, _ in general]
    rows = tuple(
        (
            Cell(str(places[c.name])), Cell(c.name),
            *(use_cell(_use(c, kind, name)) for kind in kinds for name in shown[kind]),
            *(value(c) for _, value in general),
        )
        for c in candidates
    )  # fmt: skip
    spans = [(f"{kind}: use [-]", len(shown[kind])) for kind in kinds if shown[kind]]
    missing = [f"{SHORT[n]} of the {k} joints" for k in kinds for n in USES if n not in shown[k]]
    missing += ["price"] if whole and not priced else []
    note = f"Unknown for every motor of this table: {', '.join(missing)}." if missing else ""
    return Table(tuple(columns), rows, (("", 2), *spans, ("", len(general))), note)


PRICE = "Price of all"
_GENERAL: list[tuple[str, Callable[[MotorCandidate], Cell]]] = [
    ("Margin", lambda c: Cell(margin_text(deciding(c.uses).use))),
    ("One [g]", lambda c: Cell(_grams(next(iter(c.motors.values())).mass))),
    ("Robot [kg]", lambda c: Cell(number(c.total_mass))),
    ("Battery peak [A]", lambda c: Cell(number(c.battery_current_peak))),
    (PRICE, lambda c: Cell(price_text(c))),
    ("Walks", lambda c: Cell(f"{sum(run.walks for run in c.runs)} of {len(c.runs)}")),
    ("Result", lambda c: result_cell(c.passes)),
]


def _use(candidate: MotorCandidate, kind: str, name: str) -> float:
    return float(getattr(candidate.use(kind), name))


def data_sheet_table(records: Sequence[MotorRecord]) -> Table:
    """Return what the data sheets tell of motors, a column each."""
    columns = (Column("Quantity", wide=True), *(Column(r.name, wide=True) for r in records))
    rows = tuple(
        (Cell(label), *(Cell(_value(record, name, scale)) for record in records))
        for label, name, scale in DATA_SHEET
    )
    return Table(columns, rows)


DATA_SHEET = (
    ("Maker", "maker", 0.0), ("Type", "motor_type", 0.0), ("Voltage [V]", "voltage", 1.0),
    ("Allowed from [V]", "voltage_min", 1.0), ("Allowed to [V]", "voltage_max", 1.0),
    ("Stall torque [N m]", "stall_torque", 1.0), ("No-load speed [rad/s]", "no_load_speed", 1.0),
    ("Stall current [A]", "stall_current", 1.0), ("Standby current [A]", "standby_current", 1.0),
    ("Rated torque [N m]", "rated_torque", 1.0), ("Mass [g]", "mass", 1e3),
    ("Gear ratio [-]", "gear_ratio", 1.0),
    ("Rotor inertia at the joint, published [kg m²]", "armature", 1.0),
)  # fmt: skip
"""Label, attribute of `MotorRecord`, and factor; 0 of texts."""


def _value(record: MotorRecord, name: str, scale: float) -> str:
    value = getattr(record, name)
    if not scale:
        return value or UNKNOWN
    return UNKNOWN if value is None else f"{scale * value:.5g}"


def _grams(mass: float | None) -> str:
    return UNKNOWN if mass is None else f"{1e3 * mass:.4g}"
