"""What bounds peak force and acceleration on bumps: parameters varied one by one, impacts timed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import Estimate
from hexapod_pin.text_table import Table
from studies.foot_control.page import save_figure
from studies.foot_control.scenes import (
    Size,
    bumps,
    controllers,
    percent,
    stable,
    uneven,
)
from studies.foot_control.targets import BUMP_CUT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

METRICS = ("vertical_acceleration_rms", "force_peak")

SUSPENSION: dict[str, tuple[str, tuple[float, ...]]] = {
    "travel": ("mm", (0.5, 1.0, 2.0, 4.0)),
    "frequency": ("Hz", (2.0, 4.0, 6.0, 10.0)),
    "damping": ("-", (0.4, 0.8, 1.6, 3.2)),
}
"""Parameters of the suspension: unit and values shown."""

PERIODS = (1.25, 2.5, 5.0, 10.0)
"""Times between ticks [ms]."""

CYCLES = (0.8, 1.0, 1.5, 2.0, 3.0)
"""Factors on the cycle time."""

LIFTS = (25.0, 30.0, 40.0, 50.0)
"""Lifts of the foot, on the same ground [mm]."""

GROUNDS = 3
"""Seeds of bumps, at most."""

ALONE, WITH_TOUCH_DOWN = "suspension", "suspension, touch-down"


@dataclass(frozen=True)
class Point:
    """Runs with one value of one parameter.

    Attributes:
        robot: name of the robot.
        parameter: what was varied.
        value: in the unit of `unit`.
        unit: of the value.
        comparison: holds the runs.
        names: of the controllers in it, by ALONE and WITH_TOUCH_DOWN.
    """

    robot: str
    parameter: str
    value: float
    unit: str
    comparison: Comparison
    names: Mapping[str, str]

    def change(self, name: str, metric: str) -> Estimate | None:
        """Return a change; None where there is no such run, or it did not walk."""
        if name not in self.names:
            return None
        return self.comparison.change("bumps", self.names[name], metric)

    def text(self, name: str, metric: str) -> str:
        """Return the same as text, and why where it is not known."""
        if name not in self.names:
            return "-"
        found = self.change(name, metric)
        outcomes = {run.outcome.value for run in self.comparison.of("bumps", self.names[name])}
        return percent(found) if found is not None else ", ".join(sorted(outcomes))


def points(robot: str, size: Size) -> list[Point]:
    """Return the runs of all parameters: those of the gait, and those of the controller."""
    gait, found = uneven(robot), []
    for factor in size.some(CYCLES):
        slower = gait.with_changes(cycle_time=factor * gait.cycle_time)
        found.append(_of_gait(robot, "cycle time", "s", slower.cycle_time, slower, size))
    for lift in size.some(LIFTS):
        higher = gait.with_changes(lift=1e-3 * lift)
        found.append(_of_gait(robot, "lift", "mm", lift, higher, size))
    return [*found, *_of_control(robot, size)]


def _way(size: Size) -> float:
    return size.way if size.quick else size.way - 0.4


def _scenes(robot: str, size: Size) -> list[hp.Scene]:
    return bumps(robot, 1 if size.quick else GROUNDS, _way(size))


def _of_gait(
    robot: str, parameter: str, unit: str, value: float, gait: hp.Gait, size: Size
) -> Point:
    names = (ALONE, WITH_TOUCH_DOWN)
    found = hp.compare(
        {"bumps": _scenes(robot, size)},
        controllers(gait, names),
        duration=_way(size) / gait.speed,
        **size.settings,
    )
    return Point(robot, parameter, value, unit, found, {name: name for name in names})


def _of_control(robot: str, size: Size) -> list[Point]:
    """Return the runs of all parameters of the controller, which share the conventional walk."""
    gait, scenes = uneven(robot), _scenes(robot, size)
    walks: dict[str, Any] = {CONVENTIONAL: hp.KinematicControl(gait)}
    places: list[tuple[str, float, str, dict[str, str]]] = []
    for parameter, (unit, values) in SUSPENSION.items():
        for value in size.some(values):
            part = hp.foot_control.VirtualSuspension(
                **{parameter: 1e-3 * value if unit == "mm" else value}
            )
            key = f"{parameter} {value:g}"
            walks[key] = hp.FootControl(gait, suspension=part)
            places.append((parameter, value, unit, {ALONE: key}))
    for period in size.some(PERIODS):
        names = {}
        for name in (ALONE, WITH_TOUCH_DOWN):
            control = controllers(gait, (name,), period=1e-3 * period)[name]
            names[name] = f"tick {period:g} {name}"
            walks[names[name]] = stable(control, scenes[0])
        places.append(("tick", period, "ms", names))
    found = hp.compare({"bumps": scenes}, walks, duration=_way(size) / gait.speed, **size.settings)
    return [
        Point(robot, parameter, value, unit, found, names)
        for parameter, value, unit, names in places
    ]


def bounds_table(found: list[Point]) -> Table:
    """Return values of conventional control and changes of the others."""
    rows = []
    for one in found:
        cells = []
        for metric in METRICS:
            base = one.comparison.mean("bumps", CONVENTIONAL, metric)
            cells.append("-" if base is None else f"{base.value:.3g}")
            cells += [one.text(name, metric) for name in (ALONE, WITH_TOUCH_DOWN)]
        rows.append([one.robot, f"{one.parameter} [{one.unit}]", f"{one.value:g}", *cells])
    return Table(
        "What bounds acceleration and peak force on bumps (± 95 % over grounds)",
        [
            "robot", "parameter", "value", "acceleration RMS, conventional [m/s^2]",
            "suspension [%]", "with touch-down [%]", "peak force, conventional [N]",
            "suspension [%]", "with touch-down [%]",
        ],
        rows,
    )  # fmt: skip


def draw_bounds(found: list[Point], path: Path) -> None:
    """Draw the changes of both metrics over each parameter."""
    from matplotlib.figure import Figure

    parameters = list(dict.fromkeys(one.parameter for one in found))
    figure = Figure(figsize=(1.7 * len(parameters) + 0.8, 4.6), layout="constrained")
    panels = figure.subplots(2, len(parameters), sharey=True, squeeze=False)
    for column, parameter in enumerate(parameters):
        own = [one for one in found if one.parameter == parameter]
        for row, metric in enumerate(METRICS):
            _draw_panel(panels[row][column], own, metric)
        panels[1][column].set_xlabel(f"{parameter} [{own[0].unit}]", fontsize="small")
    for row, metric in enumerate(METRICS):
        text = metric.replace("vertical_acceleration_rms", "acceleration RMS").replace("_", " ")
        panels[row][0].set_ylabel(f"{text}: change [%]", fontsize="small")
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize="small")
    save_figure(figure, path)


def _draw_panel(axes: Axes, own: list[Point], metric: str) -> None:
    for colour, robot in enumerate(dict.fromkeys(one.robot for one in own)):
        for name, line in ((ALONE, "-o"), (WITH_TOUCH_DOWN, "--s")):
            changes = [(x.value, x.change(name, metric)) for x in own if x.robot == robot]
            known = [(x, 100.0 * change.value) for x, change in changes if change is not None]
            axes.plot(
                [x for x, _ in known], [y for _, y in known], line, color=f"C{colour}", ms=3,
                lw=1, label=f"{robot}, {name}",
            )  # fmt: skip
    axes.axhline(0.0, color="black", lw=0.6)
    axes.axhline(-100.0 * BUMP_CUT, color="grey", lw=0.8, ls=":")
    axes.set_ylim(-60.0, 60.0)
    axes.set_xscale("log")
    axes.minorticks_off()
    values = sorted({one.value for one in own})[::2]
    axes.set_xticks(values, [f"{value:.3g}" for value in values])
    axes.tick_params(labelsize="x-small")
    axes.grid(lw=0.3)
