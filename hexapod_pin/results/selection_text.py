"""A motor selection as text: the answer in few lines, and everything."""

from __future__ import annotations

import math

from hexapod_pin.results.motor_selection import USES, KindUse, MotorCandidate, MotorSelection
from hexapod_pin.text_table import Table, folded

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
        [c.name, f"{c.total_mass:.2f}", *(_worst(use) for use in c.uses), _deciding(c)]
        for c in shown
    ]
    title = f"{len(passing)} of {len(s.candidates)} motors pass all joints of {len(s.walks)} walks"
    title += "; the lightest:" if passing else "; the nearest:"
    lines += [title, *Table("", head, rows, "<>", rule=False).lines()]
    if s.confidence is not None:
        lines += folded(s.confidence.sentence)
    notes = [f"{len(s.assumed)} assumed", f"{len(s.unusable)} motors not compared"]
    kept = [note for note, parts in zip(notes, (s.assumed, s.unusable), strict=True) if parts]
    lines += folded("; ".join([*s.notes[:1], *kept, "--full has everything, --json, --csv all"]))
    return lines


def _headline(s: MotorSelection) -> list[str]:
    """Return the choice, or that there is none, in one sentence."""
    start = "so far: " if s.interrupted else ""
    best = s.best
    if s.choice is None and not best.passes:
        reason = best.reasons[0].partition(": ")[2] or best.reasons[0] if best.reasons else ""
        return [f"{start}{s.robot_name}: no motor carries every joint; {best.name}: {reason}"]
    mass = f"robot {best.total_mass:.3g} kg, motors {1e3 * best.motor_mass:.3g} g of it"
    return [f"{start}{s.robot_name}: {best.name}; {mass}"]


def _worst(use: KindUse) -> str:
    """Return the largest use of a kind, marked where it does not pass."""
    return f"{use.worst:.2f}" + ("" if use.passes else " *")


def _deciding(candidate: MotorCandidate) -> str:
    """Return what a motor is used most by: the kind of joint and of need."""
    uses = [(getattr(u, name), u.kind, name) for u in candidate.uses for name in USES]
    known = [row for row in uses if not math.isnan(row[0])]
    if not known:
        return "-"
    _, kind, name = max(known)
    return f"{kind} {name.removesuffix('_use')}"


# Everything.


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
    head = ("motor on all joints", "robot", *(f"{k} peak/cont/hold/speed" for k in s.kinds), "")
    shown = Table("", head, [_row(c) for c in passing + others[:SHOWN]], rule=False).lines()
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


def _row(candidate: MotorCandidate) -> tuple[str, ...]:
    mark = "pass" if candidate.passes else "FAIL"
    return (candidate.name, f"{candidate.total_mass:.2f} kg", *map(_uses, candidate.uses), mark)


def _uses(use: KindUse) -> str:
    values = (use.peak_use, use.continuous_use, use.holding_use, use.speed_use)
    return "/".join(f"{x:.2f}" if math.isfinite(x) else "-" for x in values) + (
        "" if use.passes else " *"
    )


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
