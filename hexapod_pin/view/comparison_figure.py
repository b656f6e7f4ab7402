"""The figure of a comparison: each metric relative to the baseline, a panel per scene."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.estimate import CONFIDENCE
from hexapod_pin.results.walk_metrics import METRICS
from hexapod_pin.view.figure_file import figure_bytes, figure_format

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.results.comparison import Comparison
    from hexapod_pin.results.estimate import Estimate

BAR_HEIGHT = 0.8
"""Of all bars of a metric, in rows."""

WIDEST = 150.0
"""Change at which the axis ends [%]; of a longer bar the number is written."""


@checked
def write_comparison_figure(
    comparison: Comparison, path: str | Path, *, metrics: Sequence[str] | None = None
) -> Path:
    """Draw a comparison into a file, and return its path.

    Args:
        comparison: of at least two controllers.
        path: ends in .png, .svg or .pdf.
        metrics: which, from top to bottom; None: all that changed by a number.

    Raises:
        ParameterError: another ending, or nothing that could be compared.
        UnknownNameError: there is no such metric.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return write_atomically(
        path, figure_bytes(draw_comparison(comparison, metrics=metrics), ending)
    )


def draw_comparison(comparison: Comparison, *, metrics: Sequence[str] | None = None) -> Figure:
    """Return the figure; errors as `write_comparison_figure`."""
    from matplotlib.figure import Figure

    for name in metrics or ():
        if name not in METRICS:
            raise UnknownNameError("metric", name, list(METRICS))
    shown = [name for name in metrics or METRICS if _changed(comparison, name)]
    if not shown:
        raise ParameterError(
            "comparison", comparison.controllers, "of two controllers that walked one scene",
            "Nothing can be drawn relative to the baseline.",
        )  # fmt: skip
    scenes = comparison.scenes
    rows = len(shown) * max(1, len(comparison.controllers) - 1)
    size = (3.6 + 3.4 * len(scenes), 1.6 + 0.24 * max(rows, len(shown)))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    for axes, scene in zip(panels, scenes, strict=True):
        _draw_scene(axes, comparison, scene, shown)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize="small")
    return figure


def _changed(comparison: Comparison, metric: str) -> bool:
    """Tell whether any controller's change of a metric is known on any scene."""
    return any(
        comparison.change(scene, name, metric) is not None
        for scene in comparison.scenes
        for name in comparison.controllers[1:]
    )


def _draw_scene(axes: Axes, comparison: Comparison, scene: str, metrics: list[str]) -> None:
    others = comparison.controllers[1:]
    height = BAR_HEIGHT / len(others)
    for k, name in enumerate(others):
        changes = [comparison.change(scene, name, metric) for metric in metrics]
        place = np.arange(len(metrics)) + (k - 0.5 * (len(others) - 1)) * height
        _draw_bars(axes, place, changes, height, name)
    low, high = axes.get_xlim()
    axes.set_xlim(max(low, -WIDEST), min(high, WIDEST))
    axes.axvline(0.0, color="black", lw=0.8)
    axes.set_yticks(np.arange(len(metrics)), [METRICS[metric].meaning for metric in metrics])
    axes.set_ylim(len(metrics) - 0.5, -0.5)  # the first on top
    axes.tick_params(labelsize="small")
    axes.grid(axis="x", lw=0.3)
    axes.set_xlabel(f"change against {comparison.baseline} [%]", fontsize="small")
    runs = len({run.number for run in comparison.runs if run.scene == scene})
    bars = f" ({runs} variants, {100 * CONFIDENCE:.0f} % intervals)" if runs > 1 else ""
    axes.set_title(f"{scene}{bars}", fontsize="small")


def _draw_bars(
    axes: Axes, place: np.ndarray, changes: list[Estimate | None], height: float, name: str
) -> None:
    """Draw a controller's bars; what is not known leaves its place empty."""
    known = [(y, change) for y, change in zip(place, changes, strict=True) if change is not None]
    y = [at for at, _ in known]
    value = [100.0 * change.value for _, change in known]
    width = [100.0 * (change.half_width or 0.0) for _, change in known]
    axes.barh(y, value, height=height, label=name)
    if any(width):
        axes.errorbar(value, y, xerr=width, fmt="none", ecolor="black", elinewidth=0.8, capsize=2.0)
    for at, percent in zip(y, value, strict=True):
        if abs(percent) > WIDEST:
            side = "right" if percent > 0.0 else "left"
            axes.text(math.copysign(0.98 * WIDEST, percent), at, f"{percent:+.0f} %",
                      ha=side, va="center", fontsize="x-small", color="white")  # fmt: skip
