"""The figures of a motor selection's report with their captions, or why one is missing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.results.sizing import motor_budget
from hexapod_pin.view.report_blocks import Block, Heading, Paragraph, Picture, use_text
from hexapod_pin.view.selection_figures import (
    draw_confidence,
    draw_current,
    draw_lasting_torque,
)
from hexapod_pin.view.selection_use_figures import draw_torque_speed, draw_uses
from hexapod_pin.view.selection_words import unknown_uses

if TYPE_CHECKING:
    from hexapod_pin.results.motor_selection import Confidence, MotorCandidate, MotorSelection

NEIGHBOURS = 3
"""Motors on either side of the choice in the figure of uses: that pass, and that fail."""

ROW_HEIGHT = 0.52
"""Of a motor in the figure of uses [inch]."""

PANELS_ACROSS = 3


def pictures(s: MotorSelection) -> Iterator[Block]:
    """Return the section of figures, numbered."""
    yield Heading("3. Figures")
    count = 0
    for block in _drawn(s):
        if isinstance(block, Picture):
            count += 1
            yield replace(block, caption=f"Figure {count}. {block.caption}")
        else:
            yield block


def _drawn(s: MotorSelection) -> Iterator[Block]:
    if s.demands:
        yield from _of_demands(s)
    else:
        yield Paragraph(
            "Torque against speed, lasting torque and battery current are not drawn: no walk with "
            "these motors' masses is there."
        )
    shown = neighbours(s)
    yield Picture(
        partial(draw_uses, shown),
        1.2 + ROW_HEIGHT * len(shown) * -(-len(s.kinds) // PANELS_ACROSS),
        f"Use of what the derated motors may give, {_names(s)} first, then the lightest motors "
        "that pass on all joints and the nearest that fail. A bar beyond 1 fails; a missing bar is "
        f"unknown.{_missing(shown)}",
    )
    if s.confidence is not None and s.confidence.values:
        yield Picture(partial(draw_confidence, s.confidence), 2.9, _confidence_caption(s))
    else:
        yield Paragraph("Distribution over uncertain inputs: not computed.")


def _of_demands(s: MotorSelection) -> Iterator[Block]:
    motors = s.best.motors
    kinds = [kind for kind in motors if any(kind in d.kinds for d in s.demands.values())]
    yield Picture(
        partial(draw_torque_speed, s.demands, motors, s.derating, kinds),
        0.9 + 2.45 * -(-len(kinds) // PANELS_ACROSS),
        "Torque against speed of each kind of joint on all walks, for what the walks ask with "
        f"{_names(s)} in the robot; speed is positive where the joint drives, negative where it "
        "brakes. Dots: samples (one for each spot of the drawing); circles: each joint's largest "
        "torque.",
    )
    yield Picture(
        partial(draw_lasting_torque, s.demands, motors, s.derating),
        2.9,
        "RMS torque over whole cycles of each joint in its hardest walk, and of standing where "
        "known, against the continuous torque of its motor.",
    )
    budgets = {
        walk: motor_budget(demand.of_kinds(kinds), motors, s.derating)
        for walk, demand in s.demands.items()
    }
    known = {w: b for w, b in budgets.items() if b.battery.peak_current is not None}
    if not known:
        why = next(iter(budgets.values())).battery.unknown or "no currents"
        yield Paragraph(f"Battery current: unknown ({why}).")
        return
    walk = max(known, key=lambda name: known[name].battery.peak_current or 0.0)
    yield Picture(
        partial(draw_current, known[walk], motors),
        2.3,
        f"Battery current of all motors together, an estimate from data-sheet currents, nothing "
        f"given back by braking; walk with the largest peak: {walk}.",
    )


def neighbours(s: MotorSelection) -> tuple[MotorCandidate, ...]:
    """Return the choice, the lightest motors that pass, and the nearest that fail."""
    passing = [c for c in s.candidates if c.passes and c.name != s.best.name]
    failing = [c for c in s.candidates if not c.passes and c.name != s.best.name]
    return (s.best, *passing[:NEIGHBOURS], *failing[:NEIGHBOURS])


def _names(s: MotorSelection) -> str:
    return "the motors of the choice" if s.choice is not None else s.best.name


def _missing(shown: tuple[MotorCandidate, ...]) -> str:
    found = unknown_uses(shown[0])
    return f" Unknown: {'; '.join(found)}." if found else ""


def _confidence_caption(s: MotorSelection) -> str:
    found: Confidence = s.confidence  # type: ignore[assignment]  # the caller has looked
    values = np.asarray(found.values)
    lost = int(np.sum(~np.isfinite(values)))
    share = f"{100.0 * found.share:.1f} %" if math.isfinite(found.share) else "unknown"
    parts = ", ".join(f"{name}: {use_text(value)}" for name, value in found.percentiles.items())
    ends = ", ".join(
        f"{100.0 * x:.1f} %" if math.isfinite(x) else "unknown" for x in (found.low, found.high)
    )
    return (
        f"Left: largest use of {found.walks} sampled walks ({found.walk}); {share} pass (95 % "
        f"interval {ends}); {lost} did not walk and count as failing. Percentiles of the use [-]: "
        f"{parts or 'unknown'}. Right: total Sobol index of each input, its share of the variance "
        "with all interactions."
    )
