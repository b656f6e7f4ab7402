"""A motor selection lists the motors that can drive a robot, as data, text and rows."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.motor_candidate import (
    COLUMNS,
    MotorCandidate,
    deciding_need,
    ranking_row,
    worst_text,
)
from hexapod_pin.results.result_files import check_ending, without_non_finite
from hexapod_pin.shown import drawn
from hexapod_pin.text_table import Table, folded

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog.motor_record import Derating
    from hexapod_pin.results.sizing import JointDemand


@dataclass(frozen=True)
class Confidence:
    """How sure it is that the chosen motors pass.

    Attributes:
        sentence: the result in one sentence.
        walk: the walk that was varied: the one with the largest use.
        share: of the sampled walks that pass [-].
        low: lower end of its 95 % interval [-].
        high: upper end [-].
        walks: how many were run.
        indices: total Sobol index of each input [-], largest first; empty where there are none.
        percentiles: 5, 50, 95 and 99 % of the largest use [-].
        inputs: the distributions, as text.
        values: largest use of each sampled walk [-]; infinite where it fell.
    """

    sentence: str
    walk: str
    share: float
    low: float
    high: float
    walks: int
    indices: Mapping[str, float]
    percentiles: Mapping[str, float]
    inputs: tuple[str, ...]
    values: tuple[float, ...] = ()


@dataclass(frozen=True)
class MotorSelection(Immutable):
    """Motors ranked for a robot.

    Attributes:
        robot_name: its name.
        total_mass: of the robot as in its file [kg].
        contained: mass of each motor that the file contains [kg].
        walks: names of the walks that must be carried.
        candidates: every motor on all joints: those that pass first, the lightest first; then the
            others by their largest use.
        unusable: motors of the catalogue that could not be compared, with the reason.
        choice: the lightest motor that passes for each kind of joint; None where a kind has none.
        iterations: choices one after another, until masses and choice agree.
        confidence: of the choice; None where it was not computed.
        demands: what the joints need on each walk, by its name, with the motors of the choice (of
            the best candidate where there is none) in the robot and their lines not acting.
        derating: what a motor may be loaded with.
        catalog: source of the motors.
        assumed: what no source gives.
        notes: what else to know.
        interrupted: whether Ctrl-C ended it early.
        contact: laws of the feet on the ground, as text.
        accuracy: of the runs, and their method, as text.
    """

    robot_name: str
    total_mass: float
    contained: float
    walks: tuple[str, ...]
    candidates: tuple[MotorCandidate, ...]
    unusable: tuple[tuple[str, str], ...]
    choice: MotorCandidate | None
    iterations: tuple[MotorCandidate, ...]
    confidence: Confidence | None
    derating: Derating
    catalog: str
    assumed: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
    interrupted: bool = False
    demands: Mapping[str, JointDemand] = field(default_factory=dict, repr=False)
    contact: str = field(default="", repr=False)
    accuracy: str = field(default="", repr=False)

    @property
    def best(self) -> MotorCandidate:
        """The choice; without one, the first candidate."""
        return self.candidates[0] if self.choice is None else self.choice

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of joints."""
        return tuple(use.kind for use in self.candidates[0].uses) if self.candidates else ()

    def candidate(self, model: str) -> MotorCandidate:
        """Return the candidate of a motor by its name, or its model where that has one voltage.

        Raises:
            UnknownNameError: there is none.
        """
        found = [c for c in self.candidates if model in (c.name, c.model)]
        if len(found) != 1:
            raise UnknownNameError("motor", model, [c.name for c in self.candidates])
        return found[0]

    def passing(self, kind: str) -> tuple[MotorCandidate, ...]:
        """Return the motors that carry a kind of joint, in their order."""
        return tuple(c for c in self.candidates if c.use(kind).passes)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the verdict, and the ranking."""
        return str(drawn("notebook_html", self))

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data; NaN and infinities as None."""
        return selection_to_dict(self)

    def lines(self) -> list[str]:
        """Return what a user decides by: the choice, and the first motors of the ranking."""
        return selection_answer(self)

    def table(self) -> str:
        """Return everything as text."""
        return selection_table(self)


# The ranking of motors as text: the answer in few lines, and everything.

ROWS = 4
"""Motors in the answer: those that pass, the lightest first; where none does, the nearest."""

SHOWN = 12
"""Motors of the full table that do not pass; all are in the CSV file."""


def selection_answer(selection: MotorSelection) -> list[str]:
    """Return what a user decides by, in ten lines at a terminal's width and more beyond them."""
    s = selection
    passing = [c for c in s.candidates if c.passes]
    shown = (passing or list(s.candidates))[:ROWS]
    lines = [line for text in _headline(s) for line in folded(text)]
    head = [
        "motor on all joints",
        "robot\n[kg]",
        *(f"{kind}\nuse" for kind in s.kinds),
        "needs\nmost",
    ]
    rows = [
        [c.name, f"{c.total_mass:.2f}", *(worst_text(use) for use in c.uses), deciding_need(c)]
        for c in shown
    ]
    title = f"{len(passing)} of {len(s.candidates)} motors pass all joints of {len(s.walks)} walks"
    title += "; the lightest:" if passing else "; the nearest:"
    lines += [title, *Table("", head, rows, "<>", rule=False).lines()]
    if s.confidence is not None:
        lines += folded(s.confidence.sentence)
    mixed = s.choice.mixed if s.choice is not None else ()
    lines += [line for text in mixed for line in folded(text)]
    others = [note for note in s.notes if note not in mixed]
    count = len(s.unusable)
    notes = [f"{len(s.assumed)} assumed", f"{count} motor{'s' * (count != 1)} not compared"]
    kept = [note for note, parts in zip(notes, (s.assumed, s.unusable), strict=True) if parts]
    if any(use.doubtful for one in shown for use in one.uses):
        lines += folded(_doubtful_words(s.best, passing))
    lines += folded("; ".join([*kept, *others[:1], "--full has everything, --json, --csv all"]))
    return lines


def _doubtful_words(best: MotorCandidate, passing: Sequence[MotorCandidate]) -> str:
    """Return what the question mark says of the choice, and which motor has none."""
    what = "too warm by the less favourable of the assumed thermal constants"
    kinds = [use.kind for use in best.uses if use.doubtful]
    sure = next((one.name for one in passing if not any(use.doubtful for use in one.uses)), "")
    if not kinds:
        return f"? is {what}"
    other = f"; the lightest that stays cool enough by both is {sure}" if sure else ""
    return f"?: {best.name} is {what} on the {', '.join(kinds)} joints{other}"


def _headline(s: MotorSelection) -> list[str]:
    """Return the choice, or that there is none, in one sentence."""
    start = "so far: " if s.interrupted else ""
    best = s.best
    if s.choice is None and not best.passes:
        reason = best.reasons[0].partition(": ")[2] or best.reasons[0] if best.reasons else ""
        return [f"{start}{s.robot_name}: no motor carries every joint; {best.name}: {reason}"]
    mass = f"robot {best.total_mass:.3g} kg, motors {best.motor_mass:.3g} kg of it"
    return [f"{start}{s.robot_name}: {best.name}; {mass}"]


def selection_table(selection: MotorSelection) -> str:
    """Return the ranking as text."""
    parts = [_heading(selection), _ranking(selection), _choice(selection), _notes(selection)]
    return "\n\n".join("\n".join(part) for part in parts if part)


def _heading(s: MotorSelection) -> list[str]:
    lines = [
        f"Motors for {s.robot_name}: {s.total_mass:.4g} kg as in its file, "
        f"motors of {1e3 * s.contained:.3g} g each among it",
        f"{len(s.walks)} walks: {'; '.join(s.walks)}",
        f"catalogue: {s.catalog}",
        f"derating: largest torque {s.derating.peak:.0%} of the line at that speed, continuous "
        f"torque {s.derating.continuous:.0%} of stall (by heat where thermal constants are "
        f"published); supply under load {s.derating.voltage:.0%} of the row's voltage",
        "Need over what the derated motor may give; a motor passes a joint at 1 or less of each.",
        "? doubtful: it passes at one end of the assumed thermal constants and fails at the other.",
    ]
    if s.interrupted:
        lines.append("INTERRUPTED: only what was done so far is listed.")
    return lines


def _ranking(s: MotorSelection) -> list[str]:
    passing = [c for c in s.candidates if c.passes]
    others = [c for c in s.candidates if not c.passes]
    head = ("motor on all joints", "robot", *(f"{k} peak/cont/hold/speed" for k in s.kinds), "")
    shown = Table("", head, [ranking_row(c) for c in passing + others[:SHOWN]], rule=False).lines()
    lines = shown[: 1 + len(passing)]
    if not passing:
        lines.append("none carries every joint and every walk")
    lines += shown[1 + len(passing) :]
    if len(others) > SHOWN:
        lines.append(f"... and {len(others) - SHOWN} more that do not pass (--csv lists all)")
    rejected = [f"  {c.name}: {c.reasons[0]}" for c in others[:SHOWN] if c.reasons]
    if rejected:
        lines += ["", "Why not:", *rejected]
    if s.unusable:
        lines += ["", "Not compared:", *(f"  {n}: {why}" for n, why in s.unusable)]
    return lines


def _choice(s: MotorSelection) -> list[str]:
    if not s.iterations:
        return []
    lines = ["Lightest motors for each kind of joint, masses fed back:"]
    for number, step in enumerate(s.iterations, start=1):
        state = "passes" if step.passes else f"fails: {step.reasons[0]}"
        lines.append(f"  {number}. {step.name}: {step.total_mass:.3f} kg, {state}")
    if s.choice is None:
        return [*lines, "  no choice: " + "; ".join(s.notes)]
    use = s.choice
    battery = (
        f"; battery: {use.battery_current_peak:.3g} A peak, {use.battery_current_mean:.3g} A mean "
        "(estimate)"
        if math.isfinite(use.battery_current_peak)
        else "; battery current unknown"
    )
    lines.append(f"  choice: {use.name}, {1e3 * use.motor_mass:.4g} g of motors{battery}")
    if s.confidence is not None:
        lines += ["", s.confidence.sentence, *(f"  {text}" for text in s.confidence.inputs)]
    return lines


def _notes(s: MotorSelection) -> list[str]:
    lines = [f"note: {note}" for note in s.notes]
    lines += [f"evidence: {line}" for line in s.derating.evidence]
    return lines + [f"assumed: {line}" for line in s.assumed]


# The ranking as plain data.


def selection_to_dict(selection: MotorSelection) -> dict[str, Any]:
    """Return all numbers as plain data; NaN and infinities as None."""
    plain = {
        "robot_name": selection.robot_name,
        "total_mass": selection.total_mass,
        "contained_motor_mass": selection.contained,
        "walks": list(selection.walks),
        "catalog": selection.catalog,
        "derating": selection.derating.model_dump(),
        "candidates": [c.to_dict() for c in selection.candidates],
        "unusable": [{"motor": name, "reason": why} for name, why in selection.unusable],
        "iterations": [c.to_dict() for c in selection.iterations],
        "choice": None if selection.choice is None else selection.choice.to_dict(),
        "confidence": None if selection.confidence is None else asdict(selection.confidence),
        "assumed": list(selection.assumed),
        "notes": list(selection.notes),
        "interrupted": selection.interrupted,
    }
    finite: dict[str, Any] = without_non_finite(plain)
    return finite


# The ranking as CSV: a row for each motor and kind of joint, for other programs.


def write_selection_csv(selection: MotorSelection, path: str | Path) -> Path:
    """Write one row for each motor and kind of joint, wholly or not at all.

    Raises:
        TraceFileError: the ending is not .csv, or the file cannot be written.
    """
    check_ending(path, (".csv",))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for row in _csv_rows(selection):
        writer.writerow([csv_cell(x) if isinstance(x, str) else x for x in row])
    return write_atomically(path, encoded(stream.getvalue()))


def _csv_rows(selection: MotorSelection) -> Iterator[list[Any]]:
    yield [
        "rank", "motor", "voltage [V]", "kind of joint", "passes joint", "passes all",
        *(heading for _, heading in COLUMNS), "robot mass [kg]", "motor mass [kg]", "price",
        "battery peak [A]", "battery mean [A]", "walks in simulation", "reasons", "source",
    ]  # fmt: skip
    for rank, c in enumerate(selection.candidates, start=1):
        walked = f"{sum(run.walks for run in c.runs)} of {len(c.runs)}"
        for use in c.uses:
            record = c.motors[use.kind]
            numbers = [_number(getattr(use, name)) for name, _ in COLUMNS]
            yield [
                rank, record.model, record.voltage, use.kind, use.passes, c.passes, *numbers,
                c.total_mass, record.mass, "" if record.price is None else record.price,
                _number(c.battery_current_peak), _number(c.battery_current_mean), walked,
                "; ".join(use.reasons), record.source,
            ]  # fmt: skip


def _number(value: float) -> Any:
    return "" if math.isnan(value) else value
