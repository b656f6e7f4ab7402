"""Figures of many runs show comparisons of controllers, and sweeps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.schema import require_known
from hexapod_pin.results.walk_metrics import CONFIDENCE, METRICS
from hexapod_pin.view.figure_file import figure_bytes, figure_format, save_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.arrays import Array
    from hexapod_pin.results.comparison import Comparison
    from hexapod_pin.results.peak_verdict import PeakVerdicts
    from hexapod_pin.results.result_files import Column
    from hexapod_pin.results.walk_metrics import Estimate


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
        require_known("metric", name, METRICS)
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


# Figures of a sweep: lines, heat maps, or distributions, by what the study varies.

PEAK, RMS = "kind_torque_peak", "kind_torque_rms"
LINES = {PEAK: ("-", "peak"), RMS: ("--", "RMS")}
"""Line of each quantity."""

BAND = (5.0, 95.0)
"""Percentiles between which a band is drawn."""

MARKED = (50.0, 95.0, 99.0)
"""Percentiles that are marked in a histogram."""

BINS = 40
SCATTERED = 5000
"""Most points of a scatter plot."""


@runtime_checkable
class SweepNumbers(Protocol):
    """What is drawn of a `SweepResult`."""

    @property
    def name(self) -> str:
        """Name of the study."""

    @property
    def columns(self) -> Mapping[str, Column]:
        """Quantities along the cases."""

    @property
    def attributes(self) -> Mapping[str, str]:
        """What holds for all cases."""

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """What the study varies."""

    def input_values(self, name: str) -> Array:
        """Return the values of an input along the cases."""

    def __len__(self) -> int:
        """Return the number of cases."""


def write_sweep_figure(found: SweepNumbers, path: str | Path) -> Path:
    """Draw a sweep into a file, and return its path.

    One grid axis of numbers: peak and RMS torque of each kind of joint against it, with a band from
    the 5th to the 95th percentile where there are samples. Two: heat maps of the peak torque, of
    samples their median. Else: histograms of the peak torque with percentiles, and the largest one
    against every input.

    Args:
        found: the sweep.
        path: ends in .png, .svg or .pdf.

    Raises:
        ParameterError: another ending, or no case has numbers.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_sweep(found), path, ending)


def draw_sweep(found: SweepNumbers) -> Figure:
    """Return the figure; errors as of `write_sweep_figure`."""
    if PEAK not in found.columns or not np.isfinite(found.columns[PEAK].values).any():
        raise ParameterError("found", _reason(found), "a sweep with a case that has numbers")
    inputs = found.inputs
    axes = [item for item in inputs if item["grid"] and _is_number(found, item)]
    named = [item for item in inputs if item["grid"] and not _is_number(found, item)]
    if not named and len(axes) == 1:
        return _lines(found, axes[0])
    if not named and len(axes) == 2:
        return _heat_maps(found, *axes)
    return _distributions(found, inputs)


def _reason(found: SweepNumbers) -> str:
    return str(found.columns["reason"].values[0]) if len(found) else "no case"


def _values(found: SweepNumbers, item: dict[str, Any]) -> Array:
    """Return the values of an input along the cases."""
    return found.input_values(item["name"])


def _is_number(found: SweepNumbers, item: dict[str, Any]) -> bool:
    return bool(_values(found, item).dtype.kind == "f")


def _label(item: dict[str, Any]) -> str:
    unit = item["unit"]
    return f"{item['name']} [{unit}]" if unit not in ("", "-") else str(item["name"])


def _title(found: SweepNumbers) -> str:
    known = int(np.isfinite(found.columns[PEAK].values).any(axis=1).sum())
    robots = "; ".join(line.split(":")[0] for line in found.attributes["robots"].split("\n"))
    return f"{found.name} ({robots}): {known} of {len(found)} cases"


def _lines(found: SweepNumbers, item: dict[str, Any]) -> Figure:
    """Draw torque against one axis."""
    from matplotlib.figure import Figure

    kinds = found.columns["kind"].values.tolist()
    across = _values(found, item)
    points = np.unique(across)
    figure = Figure(figsize=(1.0 + 3.4 * len(kinds), 3.8), layout="constrained")
    panels = figure.subplots(1, len(kinds), squeeze=False, sharey=True)[0]
    for k, (axes, kind) in enumerate(zip(panels, kinds, strict=True)):
        for name, (line, label) in LINES.items():
            cells = [found.columns[name].values[across == x, k] for x in points]
            low, middle, high = np.array(
                [_percentiles(c, (BAND[0], 50.0, BAND[1])) for c in cells]
            ).T
            axes.plot(points, middle, line, color=f"C{k}", marker=".", label=label)
            if max(map(len, cells)) > 1:
                axes.fill_between(points, low, high, color=f"C{k}", alpha=0.2, lw=0)
        axes.set_title(kind, fontsize="medium")
        axes.set_xlabel(_label(item))
        axes.grid(lw=0.3)
        axes.legend(fontsize="small")
    panels[0].set_ylim(bottom=0.0)
    panels[0].set_ylabel("torque of the worst joint [N m]")
    many = len(across) > len(points)
    band = "; median, band 5 to 95 % of the samples" if many else ""
    figure.suptitle(_title(found) + band, fontsize="medium")
    return figure


def _percentiles(values: Array, which: tuple[float, ...]) -> Array:
    known = values[np.isfinite(values)]
    return np.percentile(known, which) if len(known) else np.full(len(which), np.nan)


def _heat_maps(found: SweepNumbers, first: dict[str, Any], second: dict[str, Any]) -> Figure:
    """Draw peak torque over two axes, a panel for each kind."""
    from matplotlib.figure import Figure

    kinds = found.columns["kind"].values.tolist()
    x, y = _values(found, first), _values(found, second)
    along, up = np.unique(x), np.unique(y)
    figure = Figure(figsize=(1.0 + 3.6 * len(kinds), 3.9), layout="constrained")
    panels = figure.subplots(1, len(kinds), squeeze=False, sharey=True)[0]
    for k, (axes, kind) in enumerate(zip(panels, kinds, strict=True)):
        peak = found.columns[PEAK].values[:, k]
        cells = [[_percentiles(peak[(x == a) & (y == b)], (50.0,))[0] for a in along] for b in up]
        mesh = axes.pcolormesh(_edges(along), _edges(up), np.ma.masked_invalid(cells))
        axes.set_facecolor("lightgrey")
        axes.set_xlabel(_label(first))
        axes.set_title(kind, fontsize="medium")
        figure.colorbar(mesh, ax=axes, label="peak torque [N m]", location="bottom")
    panels[0].set_ylabel(_label(second))
    many = "; median of the samples" if len(x) > len(along) * len(up) else ""
    grey = "; grey: no numbers" if not np.isfinite(found.columns[PEAK].values).all() else ""
    figure.suptitle(f"{_title(found)}, worst joint of each kind{many}{grey}", fontsize="medium")
    return figure


def _edges(centres: Array) -> Array:
    """Return the edges of the cells around some centres."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2.0 * centres[0] - middle[0], 2.0 * centres[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _distributions(found: SweepNumbers, inputs: list[dict[str, Any]]) -> Figure:
    """Draw histograms of the peak torque, and the largest one against every input."""
    from matplotlib.figure import Figure

    kinds = found.columns["kind"].values.tolist()
    columns = max(len(kinds), min(len(inputs), 4))
    rows = 1 + -(-len(inputs) // columns)
    figure = Figure(figsize=(1.0 + 3.2 * columns, 0.6 + 2.8 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False)
    for k, (axes, kind) in enumerate(zip(panels[0], kinds, strict=False)):
        _histogram(axes, found.columns[PEAK].values[:, k], kind, f"C{k}")
    panels[0, 0].set_ylabel("cases")
    peak = found.columns[PEAK].values
    known = np.flatnonzero(np.isfinite(peak).any(axis=1))
    shown = known[:: max(1, len(known) // SCATTERED)]
    largest = np.nanmax(peak[shown], axis=1)
    for axes, item in zip(panels[1:].ravel(), inputs, strict=False):
        axes.scatter(_values(found, item)[shown], largest, s=4, alpha=0.5, lw=0)
        axes.set_xlabel(_label(item))
        axes.grid(lw=0.3)
    for row in panels[1:]:
        row[0].set_ylabel("largest peak torque [N m]")
    for axes in [*panels[0, len(kinds) :], *panels[1:].ravel()[len(inputs) :]]:
        axes.set_axis_off()
    figure.suptitle(f"{_title(found)}, worst joint of each kind", fontsize="medium")
    return figure


def _histogram(axes: Axes, values: Array, kind: str, color: str) -> None:
    """Draw how often a kind of joint has which peak torque, and some percentiles."""
    known = values[np.isfinite(values)]
    axes.hist(known, bins=min(BINS, max(5, len(known) // 5)), color=color, alpha=0.6)
    for share, line in zip(MARKED, ("-", "--", ":"), strict=True):
        at = float(np.percentile(known, share))
        axes.axvline(at, color="k", lw=0.8, ls=line, label=f"{share:g} %: {at:.3g} N m")
    axes.set_title(kind, fontsize="medium")
    axes.set_xlabel("peak torque [N m]")
    axes.legend(fontsize="x-small")


# Peaks with their verdicts, and tuned parameters.


def draw_peak_verdicts(found: PeakVerdicts) -> Figure:
    """Return the range of every joint's peak, its value, and the joint's limit where in sight."""
    from matplotlib.figure import Figure

    rows = found.joints
    figure = Figure(figsize=(7.3, 1.2 + 0.17 * len(rows)), layout="constrained")
    axes = figure.subplots()
    place = np.arange(len(rows))
    low, high = (np.array([getattr(r.torque_peak, n) for r in rows]) for n in ("low", "high"))
    value = np.array([row.torque_peak.value for row in rows])
    limit = np.array([row.effort_limit for row in rows])
    holds = np.array([row.holds for row in rows])
    for chosen, color, label in (
        (holds, "tab:blue", "holds"), (~holds, "tab:red", "moves by more than 5 %, or is limited")
    ):  # fmt: skip
        axes.hlines(place[chosen], low[chosen], high[chosen], color=color, lw=5, alpha=0.35)
        axes.plot(value[chosen], place[chosen], "o", color=color, ms=3.5, label=label)
    near = limit <= 1.5 * np.max(high, initial=0.0)
    axes.plot(limit[near], place[near], "|", color="black", ms=9, label="torque limit")
    axes.set_yticks(place, [row.name for row in rows], fontsize="small")
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(left=0.0)
    axes.grid(axis="x", lw=0.3)
    axes.set_xlabel("peak torque, its value and the range of all that was computed [N m]")
    axes.legend(fontsize="small")
    return figure


@runtime_checkable
class TunedParameters(Protocol):
    """What a report of tuning shows; that of `tune`."""

    start: Mapping[str, float]
    best: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]
    logarithmic: tuple[str, ...]
    tuned: Any
    held_out: Any
    history: tuple[Any, ...]
    penalty: float
    seed: int
    robot: str
    walk: str

    @property
    def failed(self) -> int:
        """How many candidates failed."""


def draw_tuning(found: TunedParameters) -> Figure:
    """Return the score of every candidate in the order tried, and the best so far."""
    from matplotlib.figure import Figure

    scores = np.array([one.score for one in found.history])
    good = np.array([not one.failure for one in found.history])
    order = np.arange(1, len(scores) + 1)
    figure = Figure(figsize=(7.3, 2.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(order[good], scores[good], "o", color="tab:blue", ms=3, label="candidate")
    if not good.all():
        top = scores[good].max(initial=found.tuned.baseline)
        axes.plot(order[~good], np.full((~good).sum(), top), "x", color="tab:red", label="failed")
    best = np.minimum.accumulate(np.where(good, scores, np.inf))
    axes.plot(order[np.isfinite(best)], best[np.isfinite(best)], color="tab:blue", lw=1.2,
              drawstyle="steps-post", label="best so far")  # fmt: skip
    axes.axhline(found.tuned.baseline, color="black", lw=0.8, ls="--", label="baseline")
    axes.set_xlabel("candidate, in the order tried")
    axes.set_ylabel("score (less is better)")
    axes.grid(lw=0.3)
    axes.legend(fontsize="small")
    return figure
