"""The report of a motor selection, section by section, as an HTML page or a PDF file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.result_files import check_ending
from hexapod_pin.view.report import (
    Block,
    Cell,
    Column,
    Facts,
    Header,
    Heading,
    Items,
    Paragraph,
    SignatureFields,
    Table,
    Verdict,
    report_bytes,
)
from hexapod_pin.view.selection_figures import pictures
from hexapod_pin.view.selection_tables import (
    UNKNOWN,
    USE_NOTE,
    choice_table,
    data_sheet_table,
    deciding,
    iteration_table,
    mass_change,
    number,
    price_text,
    ranking_tables,
    result_cell,
    use_text,
    verdict_level,
    verdict_texts,
    verdict_word,
    with_unit,
)

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.motor_candidate import MotorCandidate
    from hexapod_pin.results.motor_selection import MotorSelection


ENDINGS = (".html", ".htm")


@checked
def write_selection_report(
    selection: MotorSelection, path: str | Path, *, date: str | None = None, command: str = ""
) -> Path:
    r"""Write the report of a motor selection, wholly or not at all, and return its path.

    A page that needs no network and no other file, and prints as pages of A4: verdict, choice,
    ranking, figures, what was simulated, derating with its evidence, assumptions, data and sources
    of the motors. The same selection gives the same bytes.

    Args:
        selection: the result of `select_motors`.
        path: ends in .html.
        date: printed as it is; None: none is printed.
        command: that makes the report again; printed as it is.

    Raises:
        TraceFileError: another ending, or the file cannot be written.
        ParameterError: the selection has no motor to report on.
        MissingPackageError: matplotlib is not installed.

    Example:
        >>> found = select_motors('schema = 1\n[base]\nrobot = "kharagpur"')
        >>> write_selection_report(found, "motors.html")
    """
    check_ending(path, ENDINGS)
    if not selection.candidates and selection.choice is None:
        raise ParameterError(
            "selection.candidates", 0, "one motor or more", "Choose motors of the catalogue."
        )
    return write_atomically(path, report_bytes(tuple(selection_blocks(selection, date, command))))


FAILING = 10
"""Motors that do not pass and are shown with all numbers; of the others, the largest use."""

REASONS = 3
"""Reasons that are listed for each motor; of the others the number is given."""


def selection_blocks(
    s: MotorSelection, date: str | None = None, command: str = ""
) -> Iterator[Block]:
    """Return the whole report."""
    yield _header(s, date or "", command)
    yield from _choice(s)
    yield from _ranking(s)
    yield from pictures(s)
    yield from _simulated(s)
    yield from _grounds(s)
    yield from _sources(s)
    yield SignatureFields(("Prepared by", "Checked by", "Approved by"))


def _header(s: MotorSelection, date: str, command: str) -> Header:
    share = f"of it motors of {1e3 * s.contained:.3g} g each, which are replaced"
    judged = (
        f"{len(s.candidates)} judged, {sum(c.passes for c in s.candidates)} of them pass on all "
        f"joints; {len(s.unusable)} could not be judged. Catalogue: {s.catalog}"
    )
    allowed = (
        f"{s.derating.peak:g} of the torque-speed line at {s.derating.voltage:g} of the rated "
        f"voltage; for ever the published rated torque, else {s.derating.continuous:g} of the "
        "stall torque"
    )
    return Header(
        f"Motor selection: {s.robot_name}",
        Verdict(verdict_word(s), verdict_texts(s), verdict_level(s)),
        robot=f"{s.robot_name}, {number(s.total_mass)} kg as in its file ({share})",
        gait="; ".join(s.walks) or UNKNOWN,
        motor=f"{s.best.name}; {judged}",
        contact=s.contact, accuracy=s.accuracy,
        more=(("Allowed", allowed),), date=date, command=command,
    )  # fmt: skip


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
