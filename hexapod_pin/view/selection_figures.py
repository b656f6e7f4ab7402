"""Figures of a motor selection: lasting torque, battery current, uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.results.sizing.battery_load import battery_current
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.view.report_blocks import use_text
from hexapod_pin.view.selection_use_figures import BLUE, GREY, ORANGE, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.drive.derating import Derating
    from hexapod_pin.results.motor_selection import Confidence
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
    rms = np.max([d.rms_torque for d in rows], axis=0)
    held = np.array([d.standing for d in rows])
    known = np.isfinite(held)
    standing = np.where(known.any(axis=0), np.where(known, held, -np.inf).max(axis=0), np.nan)
    allowed = Motors.of(demand.kinds, motors, derating).continuous
    order = sorted(range(len(demand.kinds)), key=lambda j: list(motors).index(demand.kinds[j]))
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
    current = battery_current(demand, Motors.of(demand.kinds, motors, budget.derating))
    time = demand.time - demand.time[0]
    shown = time <= demand.duration * (1.0 + 1e-9)
    axes = figure.subplots()
    axes.plot(time[shown], current[shown], color=BLUE, lw=0.9, label="current (estimate)")
    for value, style, color, name in (
        (budget.battery.peak_current, "-.", RED, "peak of all cycles"),
        (budget.battery.mean_current, "--", "black", "mean"),
    ):
        axes.axhline(float(value or 0.0), ls=style, color=color, lw=1.1,
                     label=f"{name}: {value:.2f} A")  # fmt: skip
    axes.set_xlabel("time in the cycle [s]" if demand.cycles else "time [s]")
    axes.set_ylabel("battery current\n(estimate) [A]")
    axes.set_xlim(0.0, float(time[shown][-1]))
    axes.set_ylim(0.0, 1.12 * float(budget.battery.peak_current or 1.0))
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
