"""The figure of a walk's centre of mass: its way, and how stably it stands ([S2], figure 5)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.stability import EXCURSIONS, Stability, stability
from hexapod_pin.results.support_polygon import support_polygon
from hexapod_pin.results.zero_moment_point import contact_points
from hexapod_pin.view.figure_file import figure_format, save_figure
from hexapod_pin.view.leg_panels import COLORS, STANCE, cycle_of
from hexapod_pin.view.walk_figures import robot_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.results.trace import Trace

MARGINS = {"static_margin": "static", "zmp_margin": "zero-moment point", "nesm": "energy (NESM)"}
"""Margins that are drawn, and their names."""

WIDTHS = (2.4, 0.9, 1.2)
"""Of their curves: the first two nearly coincide."""

POLYGONS, MOST_POLYGONS = 3, 1000
"""Support polygons in the top view, where none is asked for and at most."""


@checked
def write_mass_center_figure(trace: Trace, path: str | Path, *, polygons: int = POLYGONS) -> Path:
    """Draw the way of the centre of mass into a file, and return its path.

    Its coordinates over the whole run with the steady window shaded; of the window its excursion
    from the mean straight line, the margins of stability with their least values marked, and its
    way from above with the support polygon at some instants.

    Args:
        trace: of a run; must hold its feet's radii.
        path: ends in .png, .svg or .pdf.
        polygons: instants at which the polygon is drawn, evenly over the window's first cycle.

    Raises:
        ParameterError: another ending, no polygon, no whole cycle, or what `stability` refuses.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_mass_center(trace, polygons=polygons), path, ending)


def draw_mass_center(trace: Trace, *, polygons: int = POLYGONS) -> Figure:
    """Return the figure; arguments and errors as `write_mass_center_figure`."""
    from matplotlib.figure import Figure

    if not 1 <= polygons <= MOST_POLYGONS:
        raise ParameterError("polygons", polygons, f"from 1 to {MOST_POLYGONS}")
    found = stability(trace)
    figure = Figure(figsize=(9.0, 8.6), layout="constrained")
    grid = figure.add_gridspec(5, 3, height_ratios=(1.4, 1.6, 1.0, 1.0, 1.0))
    _draw_excursion(figure.add_subplot(grid[0, :]), found)
    _draw_margins(figure.add_subplot(grid[1, :]), found)
    _draw_from_above(figure.add_subplot(grid[2:, :2]), trace, found, polygons)
    first = None
    for axis in range(3):
        first = figure.add_subplot(grid[2 + axis, 2], sharex=first)
        _draw_coordinate(first, trace, found, axis)
    figure.suptitle(f"{robot_of(trace)}: centre of mass of the whole robot", fontsize="medium")
    return figure


def _draw_coordinate(axes: Axes, trace: Trace, found: Stability, axis: int) -> None:
    """Draw x, y or z over the whole run."""
    axes.axvspan(found.window.start, found.window.end, color=STANCE, lw=0)
    axes.plot(trace.time, 1e3 * trace.com[:, axis], color=COLORS[axis], lw=1.2)
    _dress(axes, f"{'xyz'[axis]} [mm]", "time [s]" if axis == 2 else "")
    axes.tick_params(labelbottom=axis == 2)
    if axis == 0:
        axes.set_title("whole run (shaded: steady window)", fontsize="small")


def _draw_excursion(axes: Axes, found: Stability) -> None:
    """Draw what is left of the mean straight line."""
    for k, name in enumerate(EXCURSIONS):
        values = 1e3 * found.excursion[:, k]
        label = f"{name} (peak to peak {np.ptp(values):.2g} mm)"
        axes.plot(found.time, values, color=COLORS[k], lw=1.2, label=label)
    _dress(axes, "off the mean line [mm]")
    _legend_above(axes)


def _draw_margins(axes: Axes, found: Stability) -> None:
    """Draw the margins, and mark where they are least."""
    for k, (name, meaning) in enumerate(MARGINS.items()):
        values = 1e3 * getattr(found, name)
        least, time = found.least(name)
        axes.plot(found.time, values, color=COLORS[k], lw=WIDTHS[k],
                  label=f"{meaning}: least {1e3 * least:.1f} mm")  # fmt: skip
        axes.plot([time], [1e3 * least], "v", color=COLORS[k], mec="black", ms=6, zorder=3)
    _dress(axes, "margin [mm]")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _legend_above(axes)


def _draw_from_above(axes: Axes, trace: Trace, found: Stability, polygons: int) -> None:
    """Draw the way and the support polygons in world x and y, to scale."""
    window = found.window.samples
    place, points = 1e3 * found.com[:, :2], 1e3 * contact_points(trace)[window, :, :2]
    down = trace.contact[window]
    axes.plot(place[:, 0], place[:, 1], color="black", lw=1.2, label="centre of mass")
    # Between two changes of the feet on the ground, not at one.
    share = (np.arange(polygons) + 0.5) / polygons
    for k, at in enumerate(found.window.start + share * cycle_of(found.window)):
        row = int(np.argmin(np.abs(found.time - at)))
        color = f"C{k}"
        corners = support_polygon(points[row, down[row]])
        closed = np.concatenate([corners, corners[:1]])
        axes.fill(*corners.T, color=color, alpha=0.12, lw=0)
        axes.plot(*closed.T, color=color, lw=1.0, marker="o", ms=4,
                  label=f"support at {found.time[row]:.2f} s")  # fmt: skip
        axes.plot(*place[row], "o", color=color, mec="black", ms=6, zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    _dress(axes, "y [mm]", "x [mm]")
    _legend_above(axes, 2)


def _dress(axes: Axes, label: str, across: str = "time [s]") -> None:
    axes.set_xlabel(across, fontsize="small")
    axes.set_ylabel(label, fontsize="small")
    axes.tick_params(labelsize="small")
    axes.grid(lw=0.3)
    axes.margins(x=0.01)


def _legend_above(axes: Axes, columns: int = 3) -> None:
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=columns, fontsize="small",
                frameon=False, borderaxespad=0.2)  # fmt: skip
