"""Figures of a walk show joint motion and torques in one panel for each leg.

Drawn from a trace alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.schema import require_known
from hexapod_pin.results.steady_window import Window, steady_window
from hexapod_pin.view.figure_file import figure_format, save_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
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
    shown, inside = legs_of(trace, legs), first_cycles(trace, cycles)
    time = trace.time[inside]
    figure, panels = leg_grid(shown, 2, 1.6)
    for leg, (above, below) in zip(shown, panels, strict=True):
        for axes in (above, below):
            shade_stance(axes, time, trace.contact[inside, leg.foot])
        for k, joint in enumerate(leg.joints):
            angle = SIGNS[k] * np.degrees(trace.q[inside, 7 + joint])
            angle -= TIBIA_REFERENCE if KINDS[k] == "tibia" else 0.0
            rate = SIGNS[k] * np.degrees(trace.v[inside, 6 + joint])
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
    shown, inside = legs_of(trace, legs), first_cycles(trace, cycles)
    moments = joint_moments(trace)
    count = inside.stop - inside.start - 1
    time = moments.time[:count]
    every = _stride(trace, inside, points)
    figure, panels = leg_grid(shown, 2, 1.7)
    for leg, own in zip(shown, panels, strict=True):
        for axes, values in zip(own, (moments.axis_torque, moments.moment), strict=True):
            shade_stance(axes, trace.time[inside], trace.contact[inside, leg.foot])
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


def _stride(trace: Trace, inside: slice, points: float | None) -> int:
    """Return how many samples lie between points; 0 without points."""
    if points is None:
        return 0
    spacing = float(np.mean(np.diff(trace.time[inside])))
    every = round(points / spacing)
    if every < 1:
        raise ParameterError("points", points, f"the samples' spacing, {spacing:.4g} s, or more")
    return every


def robot_of(trace: Trace) -> str:
    """Return the name of a trace's robot."""
    return trace.run.robot.name


# What figures of legs share: which joints a leg has, panels in a grid, stance.

KINDS = ("coxa", "femur", "tibia")
"""Joints 1, 2 and 3 of a leg."""

COLORS = ("#0072b2", "#d55e00", "#009e73")
"""Of joints 1, 2 and 3: blue, orange, green (Okabe & Ito 2008)."""

STANCE = "0.91"
"""Shade of the time in which a foot is on the ground."""

PAPER_NUMBERS = {"lf": 1, "rf": 2, "lm": 3, "rm": 4, "lr": 5, "rr": 6}
"""[S2]'s numbers of the legs; that odd ones are left is *assumed*."""

COLUMNS = 3
"""Legs side by side."""


class Leg(NamedTuple):
    """A leg of a trace: its name, and where its foot and two or three joints are in the arrays."""

    name: str
    foot: int
    joints: tuple[int, ...]

    @property
    def title(self) -> str:
        """The name, with [S2]'s number where it has one."""
        number = PAPER_NUMBERS.get(self.name)
        return self.name if number is None else f"leg {number} ({self.name})"


def legs_of(trace: Trace, names: Sequence[str] | None = None) -> list[Leg]:
    """Return the legs of coxa, femur and perhaps tibia, in the order of the feet or of `names`.

    A leg has the name of its foot without "_foot".

    Raises:
        ParameterError: no leg has these joints, or the robot cannot be built from the trace.
        UnknownNameError: there is no such leg.
    """
    robot = RecordedRobot.of(trace)
    kinds = joint_kinds(trace.joint_names, len(robot.robot.feet), trace.run.robot.joint_kinds)
    found = {}
    for foot in range(len(robot.robot.feet)):
        joints = {kinds[j]: j for j in robot.joints_above(foot)}
        own = tuple(joints[kind] for kind in KINDS if kind in joints)
        if len(own) >= 2:
            name = trace.foot_names[foot].removesuffix("_foot")
            found[name] = Leg(name, foot, own)
    if not found:
        raise ParameterError(
            "trace.joint_names", trace.joint_names, "legs of coxa, femur (and tibia)"
        )
    for name in names or ():
        require_known("leg", name, found)
    return [found[name] for name in (names or found)]


def first_cycles(trace: Trace, cycles: int | None) -> slice:
    """Return the samples of the first cycles of the steady window; all of it without cycles.

    Args:
        trace: of a run.
        cycles: how many; None: all.

    Raises:
        ParameterError: fewer than one cycle is requested, or the run is too short for one.
    """
    if cycles is not None and cycles < 1:
        raise ParameterError("cycles", cycles, "1 or more, or None")
    window = steady_window(trace)
    samples = window.samples
    if cycles is None or window.cycles is None or cycles >= window.cycles:
        return samples
    end = window.start + cycles * cycle_of(window)
    return slice(samples.start, int(np.argmin(np.abs(trace.time - end))) + 1)


def cycle_of(window: Window) -> float:
    """Return the length of a cycle, or of the window where nothing repeats [s]."""
    return (window.end - window.start) / window.parts


def leg_grid(legs: Sequence[Leg], rows: int, height: float) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure, and for each leg its column of `rows` panels; three legs side by side.

    Panels of the same row of all legs share their axes.

    Args:
        legs: what is drawn.
        rows: panels of a leg, one above the other.
        height: of a panel [inches].
    """
    from matplotlib.figure import Figure

    columns, blocks = min(COLUMNS, len(legs)), -(-len(legs) // COLUMNS)
    size = (1.0 + 2.9 * columns, 0.8 + height * rows * blocks)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows * blocks, columns, squeeze=False, sharex=True)
    panels: list[list[Axes]] = []
    for k, leg in enumerate(legs):
        top, column = rows * (k // COLUMNS), k % COLUMNS
        own = [grid[top + row, column] for row in range(rows)]
        for row, axes in enumerate(own):
            axes.grid(lw=0.3)
            axes.tick_params(labelsize="small")
            if k:
                axes.sharey(panels[0][row])
            if column:
                axes.tick_params(labelleft=False)
        own[0].set_title(leg.title, fontsize="medium")
        own[-1].tick_params(labelbottom=True)
        panels.append(own)
    for k in range(len(legs), blocks * columns):
        for row in range(rows):
            grid[rows * (k // COLUMNS) + row, k % COLUMNS].set_axis_off()
    return figure, panels


def label_rows(panels: Sequence[Sequence[Axes]], labels: Sequence[str], across: str) -> None:
    """Label the panels' y axes at the left, and the x axes of the lowest ones."""
    for k, own in enumerate(panels):
        if k % COLUMNS == 0:
            for axes, label in zip(own, labels, strict=True):
                axes.set_ylabel(label, fontsize="small")
        if k + COLUMNS >= len(panels):
            own[-1].set_xlabel(across, fontsize="small")


def shade_stance(axes: Axes, time: Array, down: NDArray[np.bool_]) -> None:
    """Shade the intervals at whose end a foot was pushed."""
    ends, pushed = np.repeat(time, 2)[1:-1], np.repeat(down[1:], 2)  # of each interval
    axes.fill_between(ends, 0.0, 1.0, where=pushed.tolist(), color=STANCE, lw=0,
                      transform=axes.get_xaxis_transform(), zorder=0)  # fmt: skip


def add_legend(figure: Figure, axes: Axes, title: str, *, shaded: bool = True) -> None:
    """Put the curves' legend and a title above all panels."""
    from matplotlib.patches import Patch

    handles, labels = axes.get_legend_handles_labels()
    if shaded:
        handles, labels = [*handles, Patch(color=STANCE)], [*labels, "foot on the ground"]
    figure.suptitle(title, fontsize="medium")
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize="small")
