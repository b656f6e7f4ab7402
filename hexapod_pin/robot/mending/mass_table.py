"""Masses and principal moments before and after a mend, as lines of a table."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hexapod_pin.robot.mending.finding_lines import places_text
from hexapod_pin.robot.mending.mend_urdf import MassRow, Moments
from hexapod_pin.robot.mending.whole_findings import grams

HEADER = ("mass", "mended", "principal moments [kg m^2]", "mended", "link")


def mass_lines(rows: Sequence[MassRow]) -> list[str]:
    """Return a table of the links whose numbers changed, equal rows in one, and the total."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        numbers = (_mass(row.before), _mass(row.after), _moments(row.moments_before),
                   _moments(row.moments_after))  # fmt: skip
        if numbers[0] != numbers[1] or numbers[2] != numbers[3]:
            groups.setdefault(numbers, []).append(f"link {row.link}")
    table = [HEADER, *((*numbers, places_text(links)) for numbers, links in groups.items())]
    widths = [max(len(line[k]) for line in table) for k in range(len(HEADER) - 1)]
    lines = [
        "  ".join(
            [*(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=False)), line[-1]]
        )
        for line in table
    ]
    before, after = (math.fsum(_known(row, name) for row in rows) for name in ("before", "after"))
    return [*(lines if groups else []), f"total mass {grams(before)} -> {grams(after)}"]


def _known(row: MassRow, name: str) -> float:
    mass = row.before if name == "before" else row.after
    return mass if mass is not None and math.isfinite(mass) else 0.0


def _mass(mass: float | None) -> str:
    return "-" if mass is None else grams(mass)


def _moments(moments: Moments | None) -> str:
    return "-" if moments is None else " ".join(f"{value:.3g}" for value in moments)
