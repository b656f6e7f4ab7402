"""Figures of grids of walks show torque maps and the energy of gaits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.gait_energy import COSTS
from hexapod_pin.results.phase_torque import PHASES
from hexapod_pin.view.figure_file import figure_format, save_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.arrays import Array
    from hexapod_pin.results.gait_energy import GaitEnergy
    from hexapod_pin.results.torque_map import TorqueMap


QUANTITIES = {"phase_torque_peak": "peak", "phase_torque_rms": "RMS"}
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
    quantity: str = "phase_torque_peak",
    strokes: Sequence[float] | None = None,
    cycle_times: Sequence[float] | None = None,
) -> Path:
    """Draw torque against stroke and against cycle time into a file, and return its path.

    A row of panels for each kind of joint; each curve is of its worst joint, retraction drawn
    solid and protraction dashed.

    Args:
        found: the map.
        path: ends in .png, .svg or .pdf.
        quantity: "phase_torque_peak" or "phase_torque_rms".
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
    quantity: str = "phase_torque_peak",
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
    grey = "; grey: cannot be walked" if np.isnan(found.measured_speed).any() else ""
    figure.suptitle(f"{_title(found)}; worst joint of each kind{grey}", fontsize="medium")
    return figure


def _require(found: TorqueMap, quantity: str, known: dict[str, str]) -> None:
    """Refuse what cannot be drawn."""
    if quantity not in known:
        raise ParameterError("quantity", quantity, f"one of {', '.join(known)}")
    if not np.isfinite(found.measured_speed).any():
        raise ParameterError("found", found.reason.flat[0], "a map with a point that was walked")


def _nearest(values: Array, chosen: Sequence[float] | None) -> list[int]:
    """Return where the values nearest to the chosen ones are; evenly spread ones without."""
    if chosen is None:
        return sorted({round(k) for k in np.linspace(0, len(values) - 1, CURVES)})
    return sorted({int(np.argmin(np.abs(values - one))) for one in chosen})


def _edges(centres: Array) -> Array:
    """Return the edges of the cells around some centres."""
    if len(centres) == 1:
        return np.array([0.9, 1.1]) * float(centres[0])
    middle = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2.0 * centres[0] - middle[0], 2.0 * centres[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _title(found: TorqueMap) -> str:
    """Return what was walked."""
    return f"{found.run.robot}, {found.run.walk} walk"


# The figure of the energy that gaits need: costs against speed, a column for each scene.

LABELS = {
    "cost_of_transport_positive": "CoT, positive [-]",
    "cost_of_transport": "CoT, absolute [-]",
    "cost_of_transport_electrical": "CoT, electrical [-]",
    "torque_index": "torque index [N² m s]",
    "torque_index_largest": "torque index,\nlargest joint [N² m s]",
}
"""Label of the axis of each cost."""

SHOWN = ("cost_of_transport_positive", "cost_of_transport_electrical", "torque_index")

MARKERS = "osD^v<>pPX"


@checked
def write_gait_energy_figure(
    found: GaitEnergy, path: str | Path, *, costs: Sequence[str] = SHOWN
) -> Path:
    """Draw costs against speed into a file, and return its path.

    A row for each cost, a column for each scene; the cheapest gait at each speed, and those that
    tie with it, are ringed.

    Args:
        found: what is drawn.
        path: ends in .png, .svg or .pdf.
        costs: some of `results.gait_energy.COSTS`, from top to bottom.

    Raises:
        ParameterError: another ending or cost, or nothing was walked.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_gait_energy(found, costs=costs), path, ending)


def draw_gait_energy(found: GaitEnergy, *, costs: Sequence[str] = SHOWN) -> Figure:
    """Return the figure; errors as `write_gait_energy_figure`."""
    from matplotlib.figure import Figure

    for cost in costs:
        if cost not in COSTS:
            raise ParameterError("costs", cost, f"some of {', '.join(COSTS)}")
    if not costs or not np.isfinite(found.cost_of_transport).any():
        raise ParameterError("found", costs, "costs of a gait that was walked")
    size = (1.2 + 3.8 * len(found.scenes), 1.3 + 2.3 * len(costs))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(
        len(costs), len(found.scenes), squeeze=False, sharex=True, sharey="row"
    )
    for row, cost in zip(panels, costs, strict=True):
        for axes, scene in zip(row, found.scenes, strict=True):
            _draw_cost(axes, found, cost, scene)
        row[0].set_ylabel(LABELS[cost])
    for axes, scene in zip(panels[0], found.scenes, strict=True):
        axes.set_title(scene, fontsize="medium")
    for axes in panels[-1]:
        axes.set_xlabel("speed [m/s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    columns = 2 if len(found.scenes) == 1 else 3
    figure.legend(handles, labels, loc="outside upper center", ncols=columns, fontsize="small")
    return figure


def _draw_cost(axes: Axes, found: GaitEnergy, cost: str, scene: str) -> None:
    """Draw one cost of all gaits on one scene."""
    from matplotlib.ticker import FuncFormatter

    values = found.of(cost, scene)
    for k, (name, row) in enumerate(zip(found.gaits, values, strict=True)):
        label = f"{name} (duty {found.duty[k]:.2f})"
        axes.plot(found.speed, row, marker=MARKERS[k % len(MARKERS)], ms=4, lw=1.2, label=label)
    best = [
        (column.speed, values[found.gaits.index(name), k])
        for k, column in enumerate(found.cheapest(cost, scene))
        for name in column.gaits
    ]
    axes.plot([at for at, _ in best], [value for _, value in best], "o", mfc="none", mec="black",
              ms=9, mew=0.9, label="cheapest, and ties")  # fmt: skip
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(_plain))
    axes.yaxis.set_minor_formatter(FuncFormatter(_plain))
    axes.tick_params(axis="y", which="both", labelsize="small")
    axes.grid(which="both", lw=0.3)


def _plain(value: float, _: int | None) -> str:
    """Return a number of a logarithmic axis that begins with 1, 2, 3 or 5; of others nothing."""
    return f"{value:g}" if f"{value:e}"[0] in "1235" else ""
