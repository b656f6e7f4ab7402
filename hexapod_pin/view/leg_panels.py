"""What figures of legs share: which joints a leg has, panels in a grid, stance."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.steady_window import Window, steady_window

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array
    from hexapod_pin.results.trace import Trace

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
    kinds = joint_kinds(trace.joint_names, len(robot.robot.feet), trace.meta)
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
        if name not in found:
            raise UnknownNameError("leg", name, list(found))
    return [found[name] for name in (names or found)]


def first_cycles(trace: Trace, cycles: int | None) -> slice:
    """Return the samples of the first cycles of the steady window; all of it without cycles.

    Args:
        trace: of a run.
        cycles: how many; None: all.

    Raises:
        ParameterError: fewer than one cycle is asked for, or the run is too short for one.
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
