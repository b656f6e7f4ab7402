"""The report of a motor selection has figures of margins, of use and of the battery."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.results.sizing.battery import battery_current
from hexapod_pin.results.sizing.motor_budget import motor_budget
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.view.report import Block, Heading, Paragraph, Picture
from hexapod_pin.view.selection_tables import USE_NAMES, unknown_uses, use_text

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.motor_candidate import MotorCandidate
    from hexapod_pin.results.motor_selection import Confidence, MotorSelection
    from hexapod_pin.results.sizing import JointDemand, MotorBudget


INPUTS_SHOWN = 10
"""Inputs with a bar of their Sobol index; the others have smaller ones."""


def draw_lasting_torque(
    demands: Mapping[str, JointDemand],
    motors: Mapping[str, MotorRecord],
    derating: Derating,
    figure: FigureBase,
) -> None:
    """Draw each joint's RMS torque, and that of standing, against its motor's continuous torque."""
    demand = next(iter(demands.values())).of_kinds(tuple(motors))
    rows = [d.of_kinds(tuple(motors)) for d in demands.values()]
    rms = np.max([d.torque_rms for d in rows], axis=0)
    rest = np.array([d.standing for d in rows])
    known = np.isfinite(rest)
    standing = np.where(known.any(axis=0), np.where(known, rest, -np.inf).max(axis=0), np.nan)
    allowed = Motors.of(demand.joint_kinds, motors, derating).continuous
    order = sorted(
        range(len(demand.joint_kinds)), key=lambda j: list(motors).index(demand.joint_kinds[j])
    )
    places = np.arange(len(order), dtype=float)
    axes = figure.subplots()
    axes.bar(places, rms[order], 0.62, color=BLUE, label="RMS torque")
    if np.isfinite(standing).any():
        axes.plot(places, standing[order], "D", color=ORANGE, mec="black", mew=0.5, ms=4.5,
                  label="standing on all feet")  # fmt: skip
    axes.hlines(allowed[order], places - 0.45, places + 0.45, color=RED, lw=2.0,
                label="continuous torque allowed")  # fmt: skip
    names = [demand.joint_names[j] for j in order]
    axes.set_xticks(places, names, rotation=90, fontsize=6, parse_math=False)
    axes.set_xlim(-0.7, len(order) - 0.3)
    axes.set_ylim(0.0, 1.12 * float(np.nanmax([*rms, *allowed, *standing])))
    axes.set_ylabel("torque [N m]")
    axes.grid(axis="y", lw=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)


def draw_current(
    budget: MotorBudget, motors: Mapping[str, MotorRecord], figure: FigureBase
) -> None:
    """Draw what all motors together draw from the battery over one cycle of the gait."""
    demand = budget.demand
    current = battery_current(demand, Motors.of(demand.joint_kinds, motors, budget.derating))
    time = demand.time - demand.time[0]
    shown = time <= demand.duration * (1.0 + 1e-9)
    axes = figure.subplots()
    axes.plot(time[shown], current[shown], color=BLUE, lw=0.9, label="current (estimate)")
    for value, style, color, name in (
        (budget.battery.current_peak, "-.", RED, "peak of all cycles"),
        (budget.battery.current_mean, "--", "black", "mean"),
    ):
        axes.axhline(float(value or 0.0), ls=style, color=color, lw=1.1,
                     label=f"{name}: {value:.2f} A")  # fmt: skip
    axes.set_xlabel("time in the cycle [s]" if demand.cycles else "time [s]")
    axes.set_ylabel("battery current\n(estimate) [A]")
    axes.set_xlim(0.0, float(time[shown][-1]))
    axes.set_ylim(0.0, 1.12 * float(budget.battery.current_peak or 1.0))
    axes.grid(lw=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)


def draw_confidence(found: Confidence, figure: FigureBase) -> None:
    """Draw the distribution of the largest use, and the total Sobol indices."""
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    _draw_distribution(left, found)
    _draw_indices(right, found)


def _draw_distribution(axes: Axes, found: Confidence) -> None:
    """Draw the share of walks whose largest use is below a value."""
    values = np.sort([x for x in found.values if np.isfinite(x)])
    total = len(found.values)
    share = 100.0 * np.arange(1, len(values) + 1) / total
    if len(values):
        axes.step(values, share, where="post", color=BLUE, lw=1.4, label="sampled walks")
    for (name, value), marker in zip(found.percentiles.items(), "ovsD^P*X", strict=False):
        if np.isfinite(value):
            level = float(name.split("%")[0])
            axes.plot(value, level, marker, ms=5.5, mfc="white", mec="black", ls="none",
                      label=f"{name}: {use_text(value)}")  # fmt: skip
    axes.axvline(1.0, color=RED, lw=1.6, ls="-", label="limit")
    low = min([0.95, *values.tolist()])
    high = max([1.05, *values.tolist()])
    axes.set_xlim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    axes.set_ylim(0.0, 103.0)
    axes.set_xlabel("largest use of any motor [-]")
    axes.set_ylabel("share of walks at or below [%]")
    axes.grid(lw=0.3)
    axes.legend(loc="best", fontsize=6.5)


def _draw_indices(axes: Axes, found: Confidence) -> None:
    shown = list(found.indices.items())[:INPUTS_SHOWN]
    if not shown:
        axes.text(0.5, 0.5, "Sobol indices:\nunknown", ha="center", va="center",
                  transform=axes.transAxes)  # fmt: skip
        axes.set_axis_off()
        return
    names = [name if len(name) <= 28 else f"{name[:27]}…" for name, _ in shown]
    values = np.array([value for _, value in shown])
    places = np.arange(len(shown), dtype=float)
    axes.barh(places, np.nan_to_num(values), 0.6, color=BLUE)
    for y, value in zip(places, values, strict=True):
        text = f"{value:.2f}" if np.isfinite(value) else "unknown"
        axes.annotate(text, (max(float(np.nan_to_num(value)), 0.0), y), (3, 0),
                      textcoords="offset points", va="center", fontsize=7)  # fmt: skip
    axes.set_yticks(places, names, fontsize=7, parse_math=False)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlim(min(0.0, 1.1 * float(np.nanmin(values, initial=0.0))),
                  1.2 * max(0.1, float(np.nanmax(values, initial=0.0))))  # fmt: skip
    axes.axvline(0.0, color=GREY, lw=0.7)
    axes.set_xlabel("total Sobol index [-]")
    axes.grid(axis="x", lw=0.3)


# The figures of a motor selection's report with their captions, or why one is missing.

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
    kinds = [kind for kind in motors if any(kind in d.joint_kinds for d in s.demands.values())]
    yield Picture(
        partial(draw_torque_speed, s.demands, motors, s.derating, kinds),
        0.9 + 2.45 * -(-len(kinds) // PANELS_ACROSS),
        "Torque against speed of each kind of joint on all walks, for what the walks demand with "
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
    known = {w: b for w, b in budgets.items() if b.battery.current_peak is not None}
    if not known:
        why = next(iter(budgets.values())).battery.unknown or "no currents"
        yield Paragraph(f"Battery current: unknown ({why}).")
        return
    walk = max(known, key=lambda name: known[name].battery.current_peak or 0.0)
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


# Figures of a motor selection: torque against speed, and uses against the limit.

BLUE, RED, ORANGE, GREY = "#0b5394", "#b3261e", "#d98200", "#777777"
ACROSS = 3
RASTER = (240, 160)
"""Spots of a panel in speed and torque: of samples in the same spot one is drawn."""

LARGEST_SHOWN = 2.0
"""End of the axis of uses [-]: longer bars are cut, and their number is written."""

BARS = (("peak_use", "#0b5394", ""), ("continuous_use", "#e39a2d", "////"),
        ("holding_use", "#8fb8de", "...."), ("speed_use", "#555555", "\\\\\\\\"))  # fmt: skip


def panels(figure: FigureBase, count: int, *, sharey: bool = False) -> list[Axes]:
    """Return so many panels, three in a row."""
    columns = min(count, ACROSS)
    rows = -(-count // columns)
    grid = figure.subplots(rows, columns, squeeze=False, sharey=sharey).ravel()
    for axes in grid[count:]:
        axes.set_visible(False)
    return list(grid[:count])


def draw_torque_speed(
    demands: Mapping[str, JointDemand],
    motors: Mapping[str, MotorRecord],
    derating: Derating,
    kinds: Sequence[str],
    figure: FigureBase,
) -> None:
    """Draw |torque| over speed signed by power, with the lines of each kind's motor."""
    grid = panels(figure, len(kinds))
    for axes, kind in zip(grid, kinds, strict=True):
        found = [d.of_kinds((kind,)) for d in demands.values() if kind in d.joint_kinds]
        _draw_samples(axes, found, motors[kind], derating, kind)
        axes.set_title(f"{kind}: {motors[kind].name}", fontsize=8, parse_math=False, wrap=True)
        axes.set_xlabel("speed: brakes < 0 < drives [rad/s]")
    grid[0].set_ylabel("|torque| [N m]")
    handles = {label: h for axes in grid for h, label in zip(*_legend(axes), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3,
                  markerscale=1.5)  # fmt: skip


def _legend(axes: Axes) -> tuple[list[Artist], list[Any]]:
    return axes.get_legend_handles_labels()


def _draw_samples(
    axes: Axes, found: Sequence[JointDemand], record: MotorRecord, derating: Derating, kind: str
) -> None:
    """Draw one kind of joint."""
    size = np.concatenate([np.abs(d.torque).ravel() for d in found])
    speed = np.concatenate([(d.speed * np.sign(d.torque)).ravel() for d in found])
    limit = Motors.of((kind,), record, derating).allowed(np.ones(1), speed[:, None])[:, 0]
    outside = size > np.maximum(limit, 0.0)
    inside = thinned(speed[~outside], size[~outside])
    axes.plot(*inside, ".", color=BLUE, ms=2.2, mew=0, label="samples inside", rasterized=True)
    if outside.any():
        beyond = thinned(speed[outside], size[outside])
        axes.plot(*beyond, "x", color=RED, ms=4, mew=0.8, label="samples outside", rasterized=True)
    top = np.concatenate([d.torque_peak for d in found])
    at = np.concatenate([d.torque_peak_speed for d in found])
    axes.plot(at, top, "o", mfc="none", mec="black", ms=5, mew=0.8, label="largest of each joint")
    span = 1.08 * max(float(np.abs(speed).max()), float(record.no_load_speed or 0.0))
    reach = 1.15 * max(float(size.max()), float(top.max()), 0.05)
    _draw_lines(axes, kind, record, derating, min(float(speed.min()) * 1.15, -0.15 * span), span)
    axes.axvline(0.0, color=GREY, lw=0.7)
    axes.set_ylim(0.0, max(reach, 1.12 * record.stall_torque))
    axes.set_xlim(right=span)


def _draw_lines(
    axes: Axes, kind: str, record: MotorRecord, derating: Derating, low: float, high: float
) -> None:
    """Draw the motor's torque-speed lines: as published, under load, derated."""
    speed = np.array([low, high])
    lines = (
        (Derating(peak=1.0, voltage=1.0), "-", GREY, 1.1, "line as published"),
        (Derating(peak=1.0, voltage=derating.voltage), "--", ORANGE, 1.3,
         f"under load, {derating.voltage:g} of the voltage"),
        (derating, "-.", RED, 1.6, f"derated limit, {derating.peak:g} of that"),
    )  # fmt: skip
    for allowed, style, color, width, label in lines:
        torque = Motors.of((kind,), record, allowed).allowed(np.ones(1), speed[:, None])[:, 0]
        axes.plot(speed, torque, style, color=color, lw=width, label=label)
    axes.set_xlim(left=low)


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """Return points of which no two are in the same spot of a drawing, in their order."""
    if not len(x):
        return x, y
    spots = [
        np.floor((v - v.min()) / (np.ptp(v) or 1.0) * (count - 1e-6)).astype(int)
        for v, count in zip((x, y), RASTER, strict=True)
    ]
    _, first = np.unique(spots[0] * (RASTER[1] + 1) + spots[1], return_index=True)
    chosen = np.sort(first)
    return x[chosen], y[chosen]


def draw_uses(candidates: Sequence[MotorCandidate], figure: FigureBase) -> None:
    """Draw bars of the uses of each kind of joint, a group for each set of motors."""
    kinds = [use.kind for use in candidates[0].uses]
    grid = panels(figure, len(kinds), sharey=True)
    places = np.arange(len(candidates), dtype=float)
    labels = [_label(c) for c in candidates]
    for axes, kind in zip(grid, kinds, strict=True):
        for k, (name, color, hatch) in enumerate(BARS):
            values = np.array([getattr(c.use(kind), name) for c in candidates], dtype=float)
            _draw_bars(axes, places + 0.2 * (k - 1.5), values, USE_NAMES[name], color, hatch)
        axes.axvline(1.0, color=RED, lw=1.6, label="limit")
        axes.set_xlim(0.0, LARGEST_SHOWN * 1.2)
        axes.set_title(kind, fontsize=9, parse_math=False)
        axes.set_xlabel("need over allowed [-]")
        axes.set_yticks(places, labels, fontsize=6.5, parse_math=False)
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="x", lw=0.3)
    grid[0].set_ylim(len(candidates) - 0.5, -0.5)
    handles, names = _legend(grid[0])
    figure.legend(handles, names, loc="outside lower center", ncols=len(handles))


def _draw_bars(axes: Axes, at: Array, values: Array, label: str, color: str, hatch: str) -> None:
    """Draw one use; what is unknown or cut is written."""
    known = np.isfinite(values)
    drawn = np.where(known, np.minimum(np.nan_to_num(values), LARGEST_SHOWN), 0.0)
    drawn = np.where(np.isposinf(values), LARGEST_SHOWN, drawn)
    axes.barh(at, drawn, 0.2, color=color, hatch=hatch, edgecolor="white", lw=0.3, label=label)
    for y, value in zip(at, values, strict=True):
        if value > LARGEST_SHOWN:
            text = "∞" if math.isinf(value) else f"{value:.1f}"
            axes.text(LARGEST_SHOWN * 1.02, y, text, fontsize=5.5, va="center")


def _label(candidate: MotorCandidate) -> str:
    lines = [line for name in candidate.name.split(", ") for line in textwrap.wrap(name, 30)]
    shown = lines if len(lines) <= 5 else [*lines[:4], "..."]
    return "\n".join([*shown, "passes" if candidate.passes else "FAILS"])
