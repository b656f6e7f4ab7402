"""Figures of a motor selection: torque against speed, and uses against the limit."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.derating import Derating
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.view.selection_words import WORDS

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.motor_selection import MotorCandidate
    from hexapod_pin.results.sizing import JointDemand

BLUE, RED, ORANGE, GREY = "#0b5394", "#b3261e", "#d98200", "#777777"
ACROSS = 3
RASTER = (240, 160)
"""Spots of a panel in speed and torque: of samples in the same spot one is drawn."""

LARGEST_SHOWN = 2.0
"""End of the axis of uses [-]: longer bars are cut, and their number is written."""

BARS = (("peak", "#0b5394", ""), ("continuous", "#e39a2d", "////"),
        ("holding", "#8fb8de", "...."), ("speed", "#555555", "\\\\\\\\"))  # fmt: skip


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
        found = [d.of_kinds((kind,)) for d in demands.values() if kind in d.kinds]
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
    top = np.concatenate([d.peak_torque for d in found])
    at = np.concatenate([d.peak_torque_speed for d in found])
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
    kept = np.sort(first)
    return x[kept], y[kept]


def draw_uses(candidates: Sequence[MotorCandidate], figure: FigureBase) -> None:
    """Draw bars of the uses of each kind of joint, a group for each set of motors."""
    kinds = [use.kind for use in candidates[0].uses]
    grid = panels(figure, len(kinds), sharey=True)
    places = np.arange(len(candidates), dtype=float)
    labels = [_label(c) for c in candidates]
    for axes, kind in zip(grid, kinds, strict=True):
        for k, (name, color, hatch) in enumerate(BARS):
            values = np.array([getattr(c.use(kind), name) for c in candidates], dtype=float)
            _draw_bars(axes, places + 0.2 * (k - 1.5), values, WORDS[name], color, hatch)
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
