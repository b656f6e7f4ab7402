"""Figures of a torque map: torque against stroke and against cycle time, and over both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.scheduled_phases import PHASES
from hexapod_pin.view.figure_file import figure_format, save_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.arrays import Array
    from hexapod_pin.results.torque_map import TorqueMap

QUANTITIES = {"phase_peak": "peak", "phase_rms": "RMS"}
"""What the curves show, and its name on the axis."""

MAP_QUANTITIES = {
    "torque_peak": "peak torque", "torque_p99": "99 % torque", "torque_rms": "RMS torque",
}  # fmt: skip
"""What the heat maps can show, and its name on the scale."""

CURVES = 4
"""Curves of a panel where none are chosen."""

LINES = ("-", "--")
"""Line of each phase."""

HEADROOM = 1.08
"""Height of a panel over its largest value."""


@checked
def write_torque_curves(
    found: TorqueMap,
    path: str | Path,
    *,
    quantity: str = "phase_peak",
    strokes: Sequence[float] | None = None,
    cycle_times: Sequence[float] | None = None,
) -> Path:
    """Draw torque against stroke and against cycle time into a file, and return its path.

    A row of panels for each kind of joint; each curve is of its worst joint, retraction drawn
    solid and protraction dashed.

    Args:
        found: the map.
        path: ends in .png, .svg or .pdf.
        quantity: "phase_peak" or "phase_rms".
        strokes: of the curves against cycle time, those of the map next to these [m]; None: some.
        cycle_times: of the curves against stroke, likewise [s].

    Raises:
        ParameterError: another ending or quantity, or nothing was walked.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    figure = draw_torque_curves(found, quantity, strokes, cycle_times)
    return save_figure(figure, path, ending)


@checked
def write_torque_heat_map(
    found: TorqueMap, path: str | Path, *, quantity: str = "torque_peak"
) -> Path:
    """Draw torque over stroke and cycle time into a file, a panel for each kind of joint.

    Args:
        found: the map.
        path: ends in .png, .svg or .pdf.
        quantity: "torque_peak", "torque_p99" or "torque_rms".

    Raises:
        ParameterError: another ending or quantity, or nothing was walked.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_torque_heat_map(found, quantity), path, ending)


def draw_torque_curves(
    found: TorqueMap,
    quantity: str = "phase_peak",
    strokes: Sequence[float] | None = None,
    cycle_times: Sequence[float] | None = None,
) -> Figure:
    """Return the figure; arguments and errors as `write_torque_curves`."""
    from matplotlib.figure import Figure

    _require(found, quantity, QUANTITIES)
    kinds = found.kind_names
    figure = Figure(figsize=(9.0, 0.9 + 2.3 * len(kinds)), layout="constrained")
    panels = figure.subplots(len(kinds), 2, squeeze=False, sharex="col", sharey="row")
    at_times = _nearest(found.cycle_time, cycle_times)
    at_strokes = _nearest(found.stroke, strokes)
    for row, kind in zip(panels, kinds, strict=True):
        values = found.of_kind(quantity, kind)
        _draw_curves(row[0], 1e3 * found.stroke, values[:, at_times],
                     [f"T = {found.cycle_time[j]:.3g} s" for j in at_times])  # fmt: skip
        _draw_curves(row[1], found.cycle_time, values[at_strokes].swapaxes(0, 1),
                     [f"{1e3 * found.stroke[i]:.3g} mm" for i in at_strokes])  # fmt: skip
        drawn = np.concatenate([values[:, at_times].ravel(), values[at_strokes].ravel()])
        row[0].set_ylim(0.0, HEADROOM * float(np.nanmax(drawn)))  # of both panels
        row[0].set_ylabel(f"{kind}: {QUANTITIES[quantity]} torque [N m]")
    panels[-1, 0].set_xlabel("stroke [mm]")
    panels[-1, 1].set_xlabel("cycle time [s]")
    panels[0, 0].set_title("against stroke", fontsize="medium")
    panels[0, 1].set_title("against cycle time", fontsize="medium")
    for axes in panels[0]:
        axes.legend(fontsize="x-small", loc="best", ncols=2)
    figure.suptitle(
        f"{_title(found)}\nsolid: {PHASES[0]} (stance), dashed: {PHASES[1]} (swing); worst joint",
        fontsize="medium",
    )
    return figure


def _draw_curves(axes: Axes, across: Array, values: Array, labels: list[str]) -> None:
    """Draw a curve for each label and phase; values (X, labels, phases)."""
    for k, label in enumerate(labels):
        for phase, line in enumerate(LINES):
            axes.plot(across, values[:, k, phase], line, color=f"C{k}", marker=".", ms=3, lw=1.2,
                      label=label if phase == 0 else None)  # fmt: skip
    axes.grid(lw=0.3)


def draw_torque_heat_map(found: TorqueMap, quantity: str = "torque_peak") -> Figure:
    """Return the figure; arguments and errors as `write_torque_heat_map`."""
    from matplotlib.figure import Figure

    _require(found, quantity, MAP_QUANTITIES)
    kinds = found.kind_names
    figure = Figure(figsize=(1.0 + 3.6 * len(kinds), 3.9), layout="constrained")
    panels = figure.subplots(1, len(kinds), squeeze=False, sharey=True)[0]
    edges = _edges(1e3 * found.stroke), _edges(found.cycle_time)
    for axes, kind in zip(panels, kinds, strict=True):
        values = np.ma.masked_invalid(found.of_kind(quantity, kind))
        mesh = axes.pcolormesh(*edges, values.T, cmap="viridis")
        axes.set_facecolor("lightgrey")  # what could not be walked
        axes.set_yscale("log")
        ticks = [t for t in (0.5, 1.0, 2.0, 4.0, 8.0) if edges[1][0] <= t <= edges[1][-1]]
        axes.set_yticks(ticks or [found.cycle_time[0]], [f"{t:g}" for t in ticks] or None)
        axes.minorticks_off()
        axes.set_xlabel("stroke [mm]")
        axes.set_title(kind, fontsize="medium")
        figure.colorbar(mesh, ax=axes, label=f"{MAP_QUANTITIES[quantity]} [N m]",
                        location="bottom")  # fmt: skip
    panels[0].set_ylabel("cycle time [s]")
    grey = "; grey: cannot be walked" if np.isnan(found.speed).any() else ""
    figure.suptitle(f"{_title(found)}; worst joint of each kind{grey}", fontsize="medium")
    return figure


def _require(found: TorqueMap, quantity: str, known: dict[str, str]) -> None:
    """Refuse what cannot be drawn."""
    if quantity not in known:
        raise ParameterError("quantity", quantity, f"one of {', '.join(known)}")
    if not np.isfinite(found.speed).any():
        raise ParameterError("found", found.reason.flat[0], "a map with a point that was walked")


def _nearest(values: Array, wanted: Sequence[float] | None) -> list[int]:
    """Return where values next to the wanted ones are; evenly spread ones without."""
    if wanted is None:
        return sorted({round(k) for k in np.linspace(0, len(values) - 1, CURVES)})
    return sorted({int(np.argmin(np.abs(values - one))) for one in wanted})


def _edges(centres: Array) -> Array:
    """Return the edges of the cells around some centres."""
    if len(centres) == 1:
        return np.array([0.9, 1.1]) * float(centres[0])
    middle = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2.0 * centres[0] - middle[0], 2.0 * centres[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _title(found: TorqueMap) -> str:
    """Return what was walked."""
    return f"{found.meta.get('robot_name', 'robot')}, {found.meta.get('walk', 'walk')} walk"
