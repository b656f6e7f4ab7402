"""Figures of balance show the centre of mass in its margins, and quasi-static joint moments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.stability import EXCURSIONS, Stability, stability
from hexapod_pin.results.stability_margins import contact_points
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.robot.static_margins import support_polygon
from hexapod_pin.view.figure_file import figure_format, save_figure
from hexapod_pin.view.walk_figures import (
    COLORS,
    STANCE,
    Leg,
    add_legend,
    cycle_of,
    label_rows,
    leg_grid,
    legs_of,
    robot_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.results.trace import Trace


MARGINS = {"static_margin": "static", "zmp_margin": "zero-moment point", "nesm": "energy (NESM)"}
"""Margins that are drawn, and their names."""

WIDTHS = (2.4, 0.9, 1.2)
"""Of their curves: the first two nearly coincide."""

POLYGONS, MOST_POLYGONS = 3, 1000
"""Support polygons in the top view, by default and at most."""


@checked
def write_mass_center_figure(trace: Trace, path: str | Path, *, polygons: int = POLYGONS) -> Path:
    """Draw the path of the centre of mass into a file, and return its path.

    Its coordinates over the whole run with the steady window shaded; of the window its excursion
    from the mean straight line, the margins of stability with their least values marked, and its
    path from above with the support polygon at some instants.

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
    """Draw the path and the support polygons in world x and y, to scale."""
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


# The figure of what speed adds to joint torques: a walk beside its quasi-static limit.

COXA, FEMUR = 0, 1

LEAST_SWING = 1e-3
"""Of the first harmonics of all coxae below which these stand still [rad]."""

LEAST_OVERLAP = 0.95
"""Of the first harmonics of two walks of one gait, 1 where coxae move alike [-]; *assumed*."""


class Cycle(NamedTuple):
    """One cycle of a walk, the last of its window.

    Attributes:
        length: [s].
        phase: of the intervals' middles, 0 to 1 and ascending. Shape (K,).
        angle: of all joints, half-way [rad]. Shape (K, n).
        axis_torque: [N m]. Shape (K, n).
        moment: total [N m]. Shape (K, n).
    """

    length: float
    phase: Array
    angle: Array
    axis_torque: Array
    moment: Array

    def at(self, phase: Array, values: Array) -> Array:
        """Return periodic values at other phases, linear between the samples. Shape (P, n)."""
        columns = [np.interp(phase, self.phase, column, period=1.0) for column in values.T]
        return np.stack(columns, axis=1)


@checked
def write_quasi_static_figure(
    dynamic: Trace, slow: Trace, path: str | Path, legs: Sequence[str] | None = None
) -> Path:
    """Draw a walk's torques over its cycle beside those of a slow one, and return the file's path.

    For each leg the torque about the femur's axis and below it the total moment at joint 1, at
    both speeds, and their difference: what speed adds, and what else differs between the runs
    (contact laws, motions). The last cycle of each window is drawn; phase 0 is where that of
    `dynamic` begins, and the slow one is shifted until the coxae's first harmonics agree.

    Args:
        dynamic: of a run at some speed; must hold its URDF.
        slow: of the same gait on the same robot, much slower.
        path: ends in .png, .svg or .pdf.
        legs: names, as "lf"; None: all.

    Raises:
        ParameterError: another ending, other joints, a slow run that is no slower, coxae that do
            not move, or no whole cycle.
        UnknownNameError: there is no such leg.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_quasi_static(dynamic, slow, legs), path, ending)


def draw_quasi_static(dynamic: Trace, slow: Trace, legs: Sequence[str] | None = None) -> Figure:
    """Return the figure; arguments and errors as `write_quasi_static_figure`."""
    if slow.joint_names != dynamic.joint_names:
        raise ParameterError("slow.joint_names", slow.joint_names, "those of `dynamic`")
    shown, fast, limit = legs_of(dynamic, legs), _last_cycle(dynamic), _last_cycle(slow)
    if not limit.length > fast.length:
        raise ParameterError("slow", limit.length, f"a cycle longer than {fast.length:.4g} s")
    limit = _aligned(limit, fast, legs_of(dynamic))
    figure, panels = leg_grid(shown, 2, 1.7)
    torque, moment = limit.at(fast.phase, limit.axis_torque), limit.at(fast.phase, limit.moment)
    for leg, (above, below) in zip(shown, panels, strict=True):
        rows = (
            (above, leg.joints[FEMUR], fast.axis_torque, torque),
            (below, leg.joints[COXA], fast.moment, moment),
        )
        for axes, j, quick, still in rows:
            axes.plot(fast.phase, quick[:, j], color=COLORS[1], lw=1.0,
                      label=f"{fast.length:.3g} s a cycle")  # fmt: skip
            axes.plot(fast.phase, still[:, j], color="black", lw=1.2,
                      label=f"{limit.length:.3g} s a cycle")  # fmt: skip
            axes.plot(fast.phase, quick[:, j] - still[:, j], color=COLORS[0], lw=0.9,
                      label="difference")  # fmt: skip
            axes.set_xlim(0.0, 1.0)
    label_rows(panels, ("femur, axis [N m]", "joint 1, total [N m]"), "phase of the cycle [-]")
    apart = float(np.degrees(np.abs(fast.angle - limit.at(fast.phase, limit.angle)).max()))
    title = f"{robot_of(dynamic)}: femur torque; below, total moment at joint 1\n"
    title += f"(joint angles of the two walks differ by {apart:.2g}° at most)"
    add_legend(figure, panels[0][0], title, shaded=False)
    return figure


def _last_cycle(trace: Trace) -> Cycle:
    """Return the last cycle of a trace's window.

    Raises:
        ParameterError: the run has no cycles, or is too short for one.
    """
    window, moments = steady_window(trace), joint_moments(trace)
    if window.cycles is None:
        raise ParameterError("trace.run.walk.cycle_time", None, "of a walk that repeats [s]")
    length = cycle_of(window)
    since = moments.time - (window.end - length)
    inside = since > 0.0
    ends = moments.ends[inside]
    angle = 0.5 * (trace.q[ends, 7:] + trace.q[ends - 1, 7:])
    return Cycle(
        length, since[inside] / length, angle, moments.axis_torque[inside], moments.moment[inside]
    )


def _aligned(slow: Cycle, fast: Cycle, legs: Sequence[Leg]) -> Cycle:
    """Return the slow cycle in the phase of the fast one, by the coxae's first harmonics.

    Raises:
        ParameterError: the coxae stand still, or one is ahead of another by another phase.
    """
    coxae = [leg.joints[COXA] for leg in legs]
    first = [
        np.mean(np.exp(-2j * np.pi * cycle.phase)[:, None] * cycle.angle[:, coxae], axis=0)
        for cycle in (slow, fast)
    ]
    overlap, size = np.vdot(first[0], first[1]), np.linalg.norm(first, axis=1)
    if size.min() < LEAST_SWING or abs(overlap) < LEAST_OVERLAP * size.prod():
        raise ParameterError("slow", slow.length, "a walk of the same gait, whose coxae move")
    phase = np.mod(slow.phase - np.angle(overlap) / (2.0 * np.pi), 1.0)
    order = np.argsort(phase)
    return Cycle(
        slow.length, phase[order], slow.angle[order], slow.axis_torque[order], slow.moment[order]
    )
