"""The figure of the energy that gaits need: costs against speed, a column for each scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.gait_energy import COSTS
from hexapod_pin.view.figure_file import figure_format, save_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hexapod_pin.results.gait_energy import GaitEnergy

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
