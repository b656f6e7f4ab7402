"""The worst of several joints, number by number."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hexapod_pin.results.sizing.motor_use import UNKNOWN, USES, MotorUse

LARGEST = (
    *USES, "outside_share", "current_peak", "current_rms", "reflected_inertia", "inertia_ratio",
    "rms_with_rotor",
)  # fmt: skip
SMALLEST = ("margin", "optimal_ratio", "ratio_limit")


def worst_use(kind: str, rows: Sequence[MotorUse]) -> MotorUse:
    """Return the worst of each number, and in `worst` which joint sets it; see `MotorUse`.

    The largest of uses, currents and ratios of inertia, the smallest margin and gear ratio.
    """
    numbers: dict[str, Any] = {}
    worst: dict[str, str] = {}
    for names, pick in ((LARGEST, max), (SMALLEST, min)):
        for name in names:
            row = _pick(name, rows, pick)
            numbers[name] = None if row is None else getattr(row, name)
            if row is not None:
                worst[name] = row.joint
    heats = [r.winding_temperature for r in rows if not isinstance(r.winding_temperature, str)]
    numbers["winding_temperature"] = max(heats) if len(heats) == len(rows) else UNKNOWN
    decides = max(rows, key=lambda row: row.deciding_use)
    return MotorUse(
        joint=decides.joint, kind=kind, motor=_motor(rows), **numbers,
        failures=_failures(rows), worst=worst,
    )  # fmt: skip


def _pick(name: str, rows: Sequence[MotorUse], pick: Callable[..., MotorUse]) -> MotorUse | None:
    known = [row for row in rows if getattr(row, name) is not None]
    return pick(known, key=lambda row: getattr(row, name)) if known else None


def _failures(rows: Sequence[MotorUse]) -> dict[str, str]:
    """Return one sentence for each number that fails: that of the joint where it is largest."""
    found: dict[str, str] = {}
    for name in (*USES, "winding_temperature"):
        failing = [row for row in rows if name in row.failures]
        if failing:
            found[name] = max(failing, key=lambda row: getattr(row, name)).failures[name]
    return found


def _motor(rows: Sequence[MotorUse]) -> str:
    return ", ".join(dict.fromkeys(row.motor for row in rows))
