"""S1's comparison: tables, the figure, and what its claims come to."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import METRICS
from hexapod_pin.text_table import Table
from studies.foot_control.page import save_figure
from studies.foot_control.scenes import percent, walked

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = (
    "slip_distance", "friction_work_per_metre", "heave_rms", "roll_rms", "pitch_rms",
    "roll_rate_rms", "pitch_rate_rms",
    "vertical_acceleration_rms", "force_peak", "torque_rms", "torque_peak",
    "energy_per_metre", "measured_speed", "path_deviation",
)  # fmt: skip
"""Metrics of the tables."""

DRAWN = (
    "slip_distance", "vertical_acceleration_rms", "force_peak", "roll_rms", "pitch_rms",
    "torque_rms", "energy_per_metre",
)  # fmt: skip
"""Metrics of the figure."""

NOT_DRAWN = ("suspension, touch-down",)
WIDEST = 100.0
"""Change at which a bar ends [%]."""

MEASURES = {
    "slip correction makes feet slide less": ("slip", ("slip_distance",)),
    "the same without anticipation, as S1 has it": ("slip, not anticipating", ("slip_distance",)),
    "(not S1's) slip correction costs less energy": ("slip", ("energy_per_metre",)),
    "suspension makes the trunk's vertical motion gentler": (
        "suspension", ("vertical_acceleration_rms", "heave_rms"),
    ),
    "suspension makes touch-downs gentler": ("suspension", ("force_peak",)),
    "suspension keeps the trunk steadier": ("suspension", ("roll_rms", "pitch_rms")),
    "both together walk better than conventional control": (
        "both", ("slip_distance", "vertical_acceleration_rms", "force_peak", "energy_per_metre"),
    ),
}  # fmt: skip
"""What S1 says in words, as numbers: controller and metrics that have to fall."""


def comparison_table(robot: str, comparison: Comparison) -> Table:
    """Return changes against conventional control in percent, and its own values."""
    rows = []
    for scene in comparison.scenes:
        for name in comparison.controllers:
            if name == CONVENTIONAL:
                values = [comparison.mean(scene, name, metric) for metric in SHOWN]
                cells = ["-" if value is None else f"{value.value:.3g}" for value in values]
            else:
                cells = [percent(comparison.change(scene, name, metric)) for metric in SHOWN]
            rows.append([scene, name, walked(comparison, scene, name), *cells])
    units = [f"{metric} [{METRICS[metric].unit}]" for metric in SHOWN]
    return Table(
        f"{robot}: conventional control in units, others as changes [%]",
        ["ground", "controller", "walked", *units],
        rows,
    )


def claims(comparisons: dict[str, Comparison]) -> Table:
    """Return each claim of S1 with our numbers and a verdict.

    On S1's own ground (athena, flat, both contacts) a claim holds if all its metrics fall; the last
    column counts all other robots and grounds where they do.
    """
    rows = []
    for claim, (name, metrics) in MEASURES.items():
        own, others = [], []
        for robot, comparison in comparisons.items():
            for scene in comparison.scenes:
                changes = [comparison.change(scene, name, metric) for metric in metrics]
                known = [change.value for change in changes if change is not None]
                good = len(known) == len(metrics) and max(known) < 0.0
                if robot == "athena" and scene.startswith("flat"):
                    words = ", ".join(
                        f"{metric} {percent(change)} %"
                        for metric, change in zip(metrics, changes, strict=True)
                    )
                    own.append((good, f"{scene}: {words}"))
                else:
                    others.append(good)
        held = sum(good for good, _ in own)
        verdict = "holds" if held == len(own) else "does not hold" if held == 0 else "in part"
        rows.append([
            claim, name, "; ".join(text for _, text in own) or "-",
            verdict if own else "-", f"{sum(others)} of {len(others)}",
        ])  # fmt: skip
    return Table(
        "S1's claims on its own ground: athena's tripod, flat and rigid",
        ["claim", "controller", "our numbers", "verdict", "elsewhere it holds on"],
        rows,
    )


def draw_comparison(robot: str, comparison: Comparison, path: Path) -> None:
    """Draw changes against conventional control: a panel per metric, a group of bars per ground."""
    from matplotlib.figure import Figure

    names = [name for name in comparison.controllers[1:] if name not in NOT_DRAWN]
    figure = Figure(figsize=(9.0, 1.35 * len(DRAWN) + 0.7), layout="constrained")
    panels = figure.subplots(len(DRAWN), 1, sharex=True)
    for axes, metric in zip(panels, DRAWN, strict=True):
        _draw_metric(axes, comparison, metric, names)
    panels[-1].set_xticks(range(len(comparison.scenes)), comparison.scenes, fontsize="small")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize="small")
    figure.suptitle(f"{robot}: change against conventional kinematic control [%]", fontsize="small")
    save_figure(figure, path)


def _draw_metric(axes: Axes, comparison: Comparison, metric: str, names: list[str]) -> None:
    width = 0.8 / len(names)
    for k, name in enumerate(names):
        place, value, half = [], [], []
        for x, change in _changes(comparison, name, metric):
            place.append(x + (k - 0.5 * (len(names) - 1)) * width)
            value.append(np.clip(100.0 * change[0], -WIDEST, WIDEST))
            half.append(100.0 * change[1])
        axes.bar(place, value, width, label=name)
        axes.errorbar(place, value, half, fmt="none", ecolor="black", elinewidth=0.7)
    axes.axhline(0.0, color="black", lw=0.7)
    axes.set_ylim(-WIDEST, WIDEST)
    axes.set_ylabel(metric.replace("_", " ").replace("vertical ", "vertical\n"), fontsize="x-small")
    axes.tick_params(labelsize="x-small")
    axes.grid(axis="y", lw=0.3)


def _changes(
    comparison: Comparison, name: str, metric: str
) -> Iterator[tuple[int, tuple[float, float]]]:
    """Return the number of a scene, the change and half of its interval, where known."""
    for x, scene in enumerate(comparison.scenes):
        change = comparison.change(scene, name, metric)
        if change is not None:
            yield x, (change.value, change.half_width or 0.0)
