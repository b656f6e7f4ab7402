"""The rows of a torque budget as plain text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hexapod_pin.results.joint_budget import JointBudget, KindBudget

_QUANTITIES = (
    "peak torque|[N m]",
    "p99|[N m]",
    "RMS|[N m]",
    "peak speed|[rad/s]",
    "RMS|[rad/s]",
    "peak power|[W]",
    "energy +|[J]",
    "energy -|[J]",
)


def aligned(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines with columns aligned, the first to the left, the others to the right.

    A header is broken at its bars, so that columns stay narrow.
    """
    words = [title.split("|") for title in header]
    depth = max(len(parts) for parts in words)
    heads = [[""] * (depth - len(parts)) + parts for parts in words]
    lines = [[parts[k] for parts in heads] for k in range(depth)] + [list(row) for row in rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    text = [
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])])
        for line in lines
    ]
    rule = "-" * (sum(widths) + 2 * (len(widths) - 1))
    return [*text[:depth], rule, *text[depth:]]


def kind_lines(kinds: Sequence[KindBudget], per: str) -> list[str]:
    """Return one line per kind of joint, and below each quantity the joint that sets it."""
    rows: list[list[str]] = []
    for row in kinds:
        worst = [row.peak, row.p99, row.rms, row.speed, row.rms_speed, row.power]
        values = (
            row.peak.peak_torque,
            row.p99.p99_torque,
            row.rms.rms_torque,
            row.speed.peak_speed,
            row.rms_speed.rms_speed,
            row.power.peak_power,
            row.positive_energy,
            row.negative_energy,
        )
        rows.append([f"{row.kind} (x{len(row.joints)})", *(f"{value:.4g}" for value in values)])
        rows.append(
            ["  worst leg", *(_leg(joint.joint, row.kind) for joint in worst), "all", "all"]
        )
        errors = (row.peak.peak_error, row.p99.p99_error, row.rms.rms_error)
        if any(error is not None for error in errors):
            told = ["" if error is None else f"±{error:.1g}" for error in errors]
            rows.append(["  error of the run", *told, *[""] * 5])
    title = f"Worst joint of each kind; energies of all joints of the kind, per {per}"
    return [title, *aligned(["", *_QUANTITIES], rows)]


def joint_lines(joints: Sequence[JointBudget], per: str) -> list[str]:
    """Return one line per joint; a star marks a peak at the effort limit."""
    rows = [
        [
            row.joint,
            f"{row.peak_torque:.4g}{'*' if row.at_limit else ' '}",
            f"{row.p99_torque:.4g}",
            f"{row.rms_torque:.4g}",
            f"{row.peak_speed:.4g}",
            f"{row.rms_speed:.4g}",
            f"{row.peak_power:.4g}",
            f"{row.positive_energy:.4g}",
            f"{row.negative_energy:.4g}",
            f"{row.peak_time:.3f}",
            "-" if math.isinf(row.effort_limit) else f"{row.effort_limit:.4g}",
            f"{100.0 * row.at_limit:.1f}",
        ]
        for row in joints
    ]
    header = ["joint", *_QUANTITIES, "peak at|[s]", "limit|[N m]", "at limit|[%]"]
    return [f"Every joint; energies per {per}", *aligned(header, rows)]


def _leg(joint: str, kind: str) -> str:
    """Return what is left of a joint's name without its kind: `lf_femur_joint` -> `lf`."""
    short = joint.removesuffix("_joint").removesuffix(f"_{kind}")
    return short or joint
