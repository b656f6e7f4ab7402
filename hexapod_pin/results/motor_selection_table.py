"""The ranking of motors as text, as rows for other programs, and as plain data."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.file_ending import check_ending
from hexapod_pin.results.plain_json import without_non_finite

if TYPE_CHECKING:
    from hexapod_pin.results.motor_selection import KindUse, MotorCandidate, MotorSelection

SHOWN = 12
"""Motors of the text table that do not pass; all are in the CSV file."""

COLUMNS = (
    ("peak", "peak [-]"),
    ("continuous", "continuous [-]"),
    ("holding", "holding [-]"),
    ("lost_leg", "holding, a leg lost [-]"),
    ("speed", "speed [-]"),
    ("outside", "share outside the line [-]"),
    ("inertia_ratio", "inertia ratio [-]"),
)
"""Field and heading of what stands in the CSV file for each kind of joint."""


def selection_table(selection: MotorSelection) -> str:
    """Return the ranking as text."""
    parts = [_heading(selection), _ranking(selection), _choice(selection), _notes(selection)]
    return "\n\n".join("\n".join(part) for part in parts if part)


def _heading(s: MotorSelection) -> list[str]:
    lines = [
        f"Motors for {s.robot}: {s.mass:.4g} kg as its file says, "
        f"motors of {1e3 * s.contained:.3g} g each among it",
        f"{len(s.walks)} walks: {'; '.join(s.walks)}",
        f"catalogue: {s.catalog}",
        f"derating: largest torque {s.derating.peak:.0%} of the line at that speed, continuous "
        f"torque the rated one, else {s.derating.continuous:.0%} of stall; supply under load "
        f"{s.derating.voltage:.0%} of the row's voltage",
        "Need over what the derated motor may give; a motor passes a joint at 1 or less of each.",
    ]
    if s.interrupted:
        lines.append("INTERRUPTED: only what was done so far is listed.")
    return lines


def _ranking(s: MotorSelection) -> list[str]:
    passing = [c for c in s.candidates if c.passes]
    others = [c for c in s.candidates if not c.passes]
    width = max((len(c.name) for c in s.candidates), default=5)
    head = f"{'motor on all joints':<{width}}  robot   " + "".join(
        f"{kind + ' peak/cont/hold/speed':<31}" for kind in s.kinds
    )
    lines = [head, *(_row(c, width) for c in passing)]
    if not passing:
        lines.append("none carries every joint and every walk")
    lines += [_row(c, width) for c in others[:SHOWN]]
    if len(others) > SHOWN:
        lines.append(f"... and {len(others) - SHOWN} more that do not pass (--csv lists all)")
    rejected = [f"  {c.name}: {c.reasons[0]}" for c in others[:SHOWN] if c.reasons]
    if rejected:
        lines += ["", "Why not:", *rejected]
    if s.unusable:
        lines += ["", "Not held against a line:", *(f"  {n}: {why}" for n, why in s.unusable)]
    return lines


def _row(candidate: MotorCandidate, width: int) -> str:
    mark = "pass" if candidate.passes else "FAIL"
    uses = "".join(f"{_uses(use):<31}" for use in candidate.uses)
    return f"{candidate.name:<{width}}  {candidate.robot_mass:.2f} kg {uses}{mark}"


def _uses(use: KindUse) -> str:
    values = (use.peak, use.continuous, use.holding, use.speed)
    return "/".join(f"{x:.2f}" if math.isfinite(x) else "-" for x in values) + (
        "" if use.passes else " *"
    )


def _choice(s: MotorSelection) -> list[str]:
    if not s.iterations:
        return []
    lines = ["Lightest motors for each kind of joint, masses fed back:"]
    for number, step in enumerate(s.iterations, start=1):
        state = "passes" if step.passes else f"fails: {step.reasons[0]}"
        lines.append(f"  {number}. {step.name}: {step.robot_mass:.3f} kg, {state}")
    if s.choice is None:
        return [*lines, "  no choice: " + "; ".join(s.notes)]
    use = s.choice
    battery = (
        f"; battery: {use.battery_peak:.3g} A peak, {use.battery_mean:.3g} A mean (estimate)"
        if math.isfinite(use.battery_peak)
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


def selection_to_dict(selection: MotorSelection) -> dict[str, Any]:
    """Return all numbers as plain data; NaN and infinities as None."""
    plain = {
        "robot": selection.robot,
        "mass": selection.mass,
        "contained_motor_mass": selection.contained,
        "walks": list(selection.walks),
        "catalog": selection.catalog,
        "derating": selection.derating.model_dump(),
        "candidates": [_candidate(c) for c in selection.candidates],
        "unusable": [{"motor": name, "reason": why} for name, why in selection.unusable],
        "iterations": [_candidate(c) for c in selection.iterations],
        "choice": None if selection.choice is None else _candidate(selection.choice),
        "confidence": None if selection.confidence is None else asdict(selection.confidence),
        "assumed": list(selection.assumed),
        "notes": list(selection.notes),
        "interrupted": selection.interrupted,
    }
    finite: dict[str, Any] = without_non_finite(plain)
    return finite


def _candidate(c: MotorCandidate) -> dict[str, Any]:
    return {
        "name": c.name,
        "passes": c.passes,
        "motors": {kind: record.name for kind, record in c.motors.items()},
        "robot_mass": c.robot_mass,
        "motor_mass": c.motor_mass,
        "price": c.price,
        "battery_peak": c.battery_peak,
        "battery_mean": c.battery_mean,
        "kinds": {
            use.kind: {
                **{name: getattr(use, name) for name, _ in COLUMNS},
                "walk": dict(use.walk), "passes": use.passes, "reasons": list(use.reasons),
            }
            for use in c.uses
        },
        "runs": [{"walk": r.walk, "walks": r.walks, "text": r.text} for r in c.runs],
        "notes": list(c.notes),
    }  # fmt: skip


def write_selection_csv(selection: MotorSelection, path: str | Path) -> Path:
    """Write one row for each motor and kind of joint, wholly or not at all.

    Raises:
        TraceFileError: the ending is not .csv, or the file cannot be written.
    """
    check_ending(path, (".csv",))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for row in _rows(selection):
        writer.writerow([csv_cell(x) if isinstance(x, str) else x for x in row])
    return write_atomically(path, encoded(stream.getvalue()))


def _rows(selection: MotorSelection) -> Iterator[list[Any]]:
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
                c.robot_mass, record.mass, "" if record.price is None else record.price,
                _number(c.battery_peak), _number(c.battery_mean), walked,
                "; ".join(use.reasons), record.source,
            ]  # fmt: skip


def _number(value: float) -> Any:
    return "" if math.isnan(value) else value
