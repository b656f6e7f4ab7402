"""Figures of any walk over time: joint motions and joint torques, leg by leg ([S2], figures 3, 6).

Drawn from a trace alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.view.figure_file import figure_format, save_figure
from hexapod_pin.view.leg_panels import (
    COLORS,
    KINDS,
    add_legend,
    first_cycles,
    label_rows,
    leg_grid,
    legs_of,
    shade_stance,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from hexapod_pin.results.trace import Trace

SIGNS = (1.0, -1.0, 1.0)
"""Of theta_1, beta_2 and beta_3 over the joints' angles: S2's beta_2 is positive upwards."""

TIBIA_REFERENCE = 90.0
"""Of beta_3 as drawn [degrees]: the tibia upright below a level femur."""

ANGLES = ("θ₁", "β₂", f"β₃ − {TIBIA_REFERENCE:g}°")

LINES = ("-", "-", "--")
"""Of the joints: femur and tibia both stand still in stance."""

RATES = ("dθ₁/dt", "dβ₂/dt", "dβ₃/dt")


@checked
def write_joint_motion_figure(
    trace: Trace, path: str | Path, legs: Sequence[str] | None = None, *, cycles: int = 2
) -> Path:
    """Draw the joints' angles and rates against time into a file, and return its path.

    In degrees with [S2]'s signs: theta_1 is the coxa's angle, beta_2 the femur's, positive
    upwards, and beta_3 the tibia's, drawn less 90 degrees. Stance is shaded.

    Args:
        trace: of a run; must hold its URDF.
        path: ends in .png, .svg or .pdf.
        legs: names, as "lf"; None: all.
        cycles: how many of the steady window are drawn.

    Raises:
        ParameterError: another ending, no leg of three joints, no whole cycle, or less than one.
        UnknownNameError: there is no such leg.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_joint_motion(trace, legs, cycles=cycles), path, ending)


def draw_joint_motion(
    trace: Trace, legs: Sequence[str] | None = None, *, cycles: int = 2
) -> Figure:
    """Return the figure; arguments and errors as `write_joint_motion_figure`."""
    shown, kept = legs_of(trace, legs), first_cycles(trace, cycles)
    time = trace.time[kept]
    figure, panels = leg_grid(shown, 2, 1.6)
    for leg, (above, below) in zip(shown, panels, strict=True):
        for axes in (above, below):
            shade_stance(axes, time, trace.contact[kept, leg.foot])
        for k, joint in enumerate(leg.joints):
            angle = SIGNS[k] * np.degrees(trace.q[kept, 7 + joint])
            angle -= TIBIA_REFERENCE if KINDS[k] == "tibia" else 0.0
            rate = SIGNS[k] * np.degrees(trace.v[kept, 6 + joint])
            line, color = LINES[k], COLORS[k]
            above.plot(time, angle, line, color=color, lw=1.3, label=f"{KINDS[k]} {ANGLES[k]}")
            below.plot(time, rate, line, color=color, lw=1.3, label=RATES[k])
    label_rows(panels, ("angle [°]", "rate [°/s]"), "time [s]")
    add_legend(figure, panels[0][0], f"{robot_of(trace)}: joint motions, and their rates below")
    return figure


@checked
def write_joint_torque_figure(
    trace: Trace,
    path: str | Path,
    legs: Sequence[str] | None = None,
    *,
    cycles: int | None = 2,
    points: float | None = None,
) -> Path:
    """Draw axis torques and total joint moments against time into a file, and return its path.

    For each leg the torque about the axes of joints 1, 2 and 3, and below it the size of the total
    moment across them (`results.joint_moments`): means over the trace's sampling intervals.

    Args:
        trace: of a run; must hold its URDF.
        path: ends in .png, .svg or .pdf.
        legs: names, as "lf"; None: all.
        cycles: how many of the steady window are drawn; None: all.
        points: spacing of points on the curves [s], as of a coarser sampling; None: without.

    Raises:
        ParameterError: another ending, no leg of three joints, no whole cycle, less than one, or
            points closer than the samples.
        UnknownNameError: there is no such leg.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    figure = draw_joint_torques(trace, legs, cycles=cycles, points=points)
    return save_figure(figure, path, ending)


def draw_joint_torques(
    trace: Trace,
    legs: Sequence[str] | None = None,
    *,
    cycles: int | None = 2,
    points: float | None = None,
) -> Figure:
    """Return the figure; arguments and errors as `write_joint_torque_figure`."""
    shown, kept = legs_of(trace, legs), first_cycles(trace, cycles)
    moments = joint_moments(trace)
    count = kept.stop - kept.start - 1
    time = moments.time[:count]
    every = _stride(trace, kept, points)
    figure, panels = leg_grid(shown, 2, 1.7)
    for leg, own in zip(shown, panels, strict=True):
        for axes, values in zip(own, (moments.axis_torque, moments.moment), strict=True):
            shade_stance(axes, trace.time[kept], trace.contact[kept, leg.foot])
            for k, joint in enumerate(leg.joints):
                drawn, label = values[:count, joint], f"joint {k + 1} ({KINDS[k]})"
                axes.plot(time, drawn, color=COLORS[k], lw=0.9, label=label)
                if every:
                    axes.plot(time[::every], drawn[::every], ".", color=COLORS[k], ms=3.5)
    label_rows(panels, ("axis torque [N m]", "total moment [N m]"), "time [s]")
    title = f"{robot_of(trace)}: torque about the joints' axes; below, size of the total moment"
    title += f"\npoints: every {1e3 * points:.3g} ms" if points else ""
    add_legend(figure, panels[0][0], title)
    return figure


def _stride(trace: Trace, kept: slice, points: float | None) -> int:
    """Return how many samples lie between points; 0 without points."""
    if points is None:
        return 0
    spacing = float(np.mean(np.diff(trace.time[kept])))
    every = round(points / spacing)
    if every < 1:
        raise ParameterError("points", points, f"the samples' spacing, {spacing:.4g} s, or more")
    return every


def robot_of(trace: Trace) -> str:
    """Return the name of a trace's robot."""
    return str(trace.meta.get("robot_name", "robot"))
