"""Foot forces that a trace holds: whether they pull, leave the cone, and how much peaks lose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from random_scenes.named import walk

from hexapod_pin.simulation.case import simulate
from hexapod_pin.text_table import Table

PRESETS = ("accurate", "s1", "s2")
FINE_SAMPLE = 5e-5
"""Between samples that show a peak as it is [s]."""

LEAST_LOAD = 0.1
"""Normal force from which a cone is looked at [N]; below it, the ratio is that of round-off."""


@dataclass(frozen=True)
class ForceRow:
    """Foot forces of a walk at the default accuracy and sampling.

    Attributes:
        walk: robot and contact.
        lowest: least normal force [N]; negative pulls.
        cone: largest tangential over normal force [-].
        mu: the limit of the friction law [-].
        recorded: largest normal force among the samples [N].
        peak: the same sampled every `FINE_SAMPLE` at 1e-8 [N].
        summary: the largest that the run's summary tells, in and outside its window [N].
    """

    walk: str
    lowest: float
    cone: float
    mu: float
    recorded: float
    peak: float
    summary: float


def force_rows(duration: float) -> list[ForceRow]:
    """Return the foot forces of tetrapod walks of both robots [s]; none for no duration."""
    if duration <= 0.0:
        return []
    return [_row(name, preset, duration) for name in ("kharagpur", "athena") for preset in PRESETS]


def _row(name: str, preset: str, duration: float) -> ForceRow:
    one = walk(name, "tetrapod", duration, preset=preset)
    usual = simulate(one.scene, one.controller, duration=duration)
    fine = simulate(
        one.scene, one.controller, duration=duration, method="ndf", accuracy=1e-8,
        sample=FINE_SAMPLE, record=("contacts",),
    )  # fmt: skip
    normal = np.einsum("tfk,tfk->tf", usual.foot_force, usual.foot_normal)
    tangential = usual.foot_force - normal[..., None] * usual.foot_normal
    loaded = normal > LEAST_LOAD
    ratio = np.linalg.norm(tangential, axis=-1)[loaded] / normal[loaded]
    true = np.einsum("tfk,tfk->tf", fine.foot_force, fine.foot_normal)
    return ForceRow(
        f"{name}, {preset}, {duration:g} s", float(normal.min()), float(ratio.max(initial=0.0)),
        float(one.scene.contact.friction.limit), float(normal.max()), float(true.max()),
        float(np.nanmax([usual.summary.force_peak, usual.summary.outside_force])),
    )  # fmt: skip


def force_table(rows: Sequence[ForceRow], before: Mapping[str, Any]) -> Table:
    """Return the forces, each "before | after" where it is known."""
    known = {row.walk: row for row in (ForceRow(**data) for data in before["forces"])}
    lines = []
    for row in rows:
        old = known.get(row.walk)
        shown = [
            f"{'-' if old is None else format(getattr(old, name), '.4g')} | "
            f"{getattr(row, name):.4g}"
            for name in ("lowest", "cone", "recorded", "summary")
        ]  # fmt: skip
        lines.append((row.walk, shown[0], shown[1], f"{row.mu:g}", *shown[2:], f"{row.peak:.4g}"))
    head = (
        "walk, default accuracy and samples", "least normal force [N]",
        "tangential over normal, most", "mu", "largest sample [N]", "summary's peak [N]",
        "true peak [N]",
    )  # fmt: skip
    return Table("Foot forces in a trace, before / after", head, lines)
