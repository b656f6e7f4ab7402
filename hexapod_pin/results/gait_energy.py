"""Energy that gaits need at equal speed and step height, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.file_schema import ArrayRule
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.grid_columns import (
    AccuracyCheck,
    GridRecord,
    check_grid,
    freeze_grid,
    grid_fields,
    grid_group,
    require_schema,
    same_group,
)
from hexapod_pin.results.result_files import Column, Group, read_netcdf, write_netcdf
from hexapod_pin.results.torque_map import NOT_RUN
from hexapod_pin.results.trace_layout import described
from hexapod_pin.text_table import Table

SCHEMA = ("hexapod_pin.gait_energy", 1)

GRID = ("scene", "gait", "speed")

LAYOUT: dict[str, tuple[tuple[str, ...], str, str]] = {
    "cost_of_transport": (GRID, "1", "absolute mechanical energy / (weight * distance)"),
    "cost_of_transport_positive": (GRID, "1", "positive mechanical energy / (weight * distance)"),
    "cost_of_transport_electrical": (
        GRID, "1", "integral of sum(torque * rate + copper_loss * torque^2) / (weight * distance)",
    ),
    "torque_index": (GRID, "N^2 m s", "integral of sum of torque^2 over joints / distance"),
    "torque_index_largest": (GRID, "N^2 m s", "integral of torque^2 / distance, largest joint"),
    "torque_peak": (GRID, "N m", "largest axis torque of any joint, of accepted steps"),
    "torque_rms": (GRID, "N m", "largest RMS axis torque of any joint"),
    "speed_peak": (GRID, "rad/s", "largest joint rate"),
    "measured_speed": (GRID, "m/s", "speed of the centre of mass along the heading"),
    "stroke": (GRID, "m", "stroke of the gait"),
    "cycle_time": (GRID, "s", "cycle time of the gait"),
}  # fmt: skip
"""Name: (axes, unit, meaning) of every array."""

NAMES = ("scene", "gait")
RULES = {
    "speed": ArrayRule(("speed",), "m/s", least=0.0),
    "duty": ArrayRule(("gait",), least=0.0),
    "lift": ArrayRule((), "m", least=0.0),
    "copper_loss": ArrayRule(("motor",), "W/(N m)^2", least=0.0),
}
"""Names and numbers of a file besides the arrays of `LAYOUT`."""

COSTS = (
    "cost_of_transport_positive", "cost_of_transport", "cost_of_transport_electrical",
    "torque_index", "torque_index_largest",
)  # fmt: skip
"""What gaits are ranked by."""


class Cheapest(NamedTuple):
    """The cheapest gait at one speed.

    Attributes:
        speed: commanded [m/s].
        gaits: the cheapest one first, then those that are as cheap within the stated error; empty
            where no gait could walk.
        cost: of the first.
    """

    speed: float
    gaits: tuple[str, ...]
    cost: float


class DutyTest(NamedTuple):
    """Whether gaits of low duty are cheaper, at the highest speed that every gait walks.

    Attributes:
        speed: [m/s].
        duty: of each gait, ascending [-].
        cost: of each gait, in that order.
        gaits: their names.
        low_is_cheaper: whether a gait of the lowest duty is the cheapest, or ties with it.
    """

    speed: float
    duty: tuple[float, ...]
    cost: tuple[float, ...]
    gaits: tuple[str, ...]
    low_is_cheaper: bool


@dataclass(frozen=True, eq=False)
class GaitEnergy(Immutable):
    """Costs of G gaits at V speeds on M scenes, at equal speed and step height; SI units.

    Energies are mechanical, at the joints, over whole cycles, unless said otherwise. A point that
    could not be walked is NaN, and `reason` says why. Two are equal when every bit is.

    Attributes:
        scenes: M names.
        gaits: G names.
        duty: of each gait [-]. Shape (G,).
        speed: commanded, stroke / (duty * cycle_time) [m/s]. Shape (V,).
        lift: lift of the swing feet, the same for all [m].
        copper_loss: electrical loss of each joint over torque^2, gamma of `physics`: R / (k N)^2
            for a motor of resistance R and torque constant k behind a gear N [W/(N m)^2], of the
            first scene's joints. Shape (n,).
        cost_of_transport: absolute energy / (weight * distance): braking costs as much as driving
            [-]. This and all that follow (M, G, V).
        cost_of_transport_positive: positive energy / (weight * distance): braking is free [-].
        cost_of_transport_electrical: integral of sum(torque * rate + copper_loss torque^2) over
            (weight * distance): braking gives back [-].
        torque_index: integral of the sum of torque^2 over joints, per distance [N^2 m s]. Li's
            index ([S2]'s reference 13) weighs joints by numbers that could not be found: here all
            are 1.
        torque_index_largest: the same of the joint with the largest [N^2 m s].
        torque_peak: largest of any joint [N m].
        torque_rms: largest of any joint [N m].
        speed_peak: largest joint rate [rad/s].
        measured_speed: of the centre of mass along the heading [m/s].
        stroke: of the gait [m].
        cycle_time: of the gait [s].
        reason: why a point could not be walked, "" where it was.
        check: some points at a tighter accuracy; None where none was run.
        run: how the costs came about: scenes, gaits, settings, what is assumed.
    """

    scenes: tuple[str, ...]
    gaits: tuple[str, ...]
    duty: Array
    speed: Array
    lift: float
    copper_loss: Array
    cost_of_transport: Array
    cost_of_transport_positive: Array
    cost_of_transport_electrical: Array
    torque_index: Array
    torque_index_largest: Array
    torque_peak: Array
    torque_rms: Array
    speed_peak: Array
    measured_speed: Array
    stroke: Array
    cycle_time: Array
    reason: npt.NDArray[np.object_]
    check: AccuracyCheck | None = None
    run: GridRecord = GridRecord()

    __hash__ = None  # type: ignore[assignment]  # equal by content

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        for name in ("scenes", "gaits"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in ("duty", "speed", "copper_loss"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        if self.duty.shape != (len(self.gaits),):
            raise ParameterError("GaitEnergy.duty", self.duty.shape, "one per gait")
        sizes = dict(zip(GRID, (len(self.scenes), len(self.gaits), len(self.speed)), strict=True))
        freeze_grid(self, LAYOUT, sizes, GRID)

    def __eq__(self, other: object) -> bool:
        """Tell whether every bit is the same."""
        return isinstance(other, GaitEnergy) and same_group(self.group(), other.group())

    def of(self, quantity: str, scene: str | None = None) -> Array:
        """Return a quantity on one scene, by default the first. Shape (G, V).

        Raises:
            UnknownNameError: there is no such quantity or scene.
        """
        name = self.scenes[0] if scene is None else scene
        for kind, wanted, known in (
            ("scene", name, list(self.scenes)), ("quantity", quantity, list(LAYOUT)),
        ):  # fmt: skip
            if wanted not in known:
                raise UnknownNameError(kind, wanted, known)
        values: Array = getattr(self, quantity)[self.scenes.index(name)]
        return values

    def tie(self, cost: str, scene: str | None = None) -> float:
        """Return the relative difference within which two gaits of a scene cost the same [-].

        Twice the largest change of that cost at the tighter accuracy; 0 without a check.

        Raises:
            UnknownNameError: there is no such scene, or that cost was not compared.
        """
        self.of(cost, scene)  # refuses unknown names
        if self.check is None:
            return 0.0
        error = self.check.error(cost, 0 if scene is None else self.scenes.index(scene))
        return 2.0 * error if error >= 0.0 else 0.0

    def cheapest(
        self, cost: str = "cost_of_transport_positive", scene: str | None = None
    ) -> tuple[Cheapest, ...]:
        """Return the cheapest gait at each speed, with those that tie with it.

        Args:
            cost: one of `COSTS`.
            scene: None: the first.

        Raises:
            UnknownNameError: there is no such cost or scene.
        """
        if cost not in COSTS:
            raise UnknownNameError("cost", cost, list(COSTS))
        rows, tie = [], self.tie(cost, scene)
        for speed, column in zip(self.speed, self.of(cost, scene).T, strict=True):
            known = [int(k) for k in np.argsort(column) if np.isfinite(column[k])]
            least = float(column[known[0]]) if known else float("nan")
            best = [self.gaits[k] for k in known if column[k] <= least * (1.0 + tie)]
            rows.append(Cheapest(float(speed), tuple(best), least))
        return tuple(rows)

    def duty_test(
        self, cost: str = "cost_of_transport_positive", scene: str | None = None
    ) -> DutyTest | None:
        """Return whether low duty is cheaper at the highest speed that every gait walks.

        Roy and Pratihar found so (Robotics and Autonomous Systems 60 (2012) 72-82, abstract), for
        turning wave gaits. None where no speed is walked by every gait.

        Raises:
            UnknownNameError: there is no such cost or scene.
        """
        walked = np.flatnonzero(np.isfinite(self.of(cost, scene)).all(axis=0))
        if not len(walked):
            return None
        column, order = self.of(cost, scene)[:, walked[-1]], np.argsort(self.duty, kind="stable")
        cheap = self.cheapest(cost, scene)[walked[-1]].gaits
        low = {name for name, duty in zip(self.gaits, self.duty, strict=True)
               if duty == self.duty.min()}  # fmt: skip
        return DutyTest(
            float(self.speed[walked[-1]]),
            tuple(float(self.duty[k]) for k in order),
            tuple(float(column[k]) for k in order),
            tuple(self.gaits[k] for k in order),
            bool(low & set(cheap)),
        )

    @property
    def finished(self) -> bool:
        """Whether every point was run or refused."""
        return not any(reason == NOT_RUN for reason in self.reason.flat)

    def table(self, cost: str = "cost_of_transport_positive", scene: str | None = None) -> str:
        """Return a cost of all gaits against speed as plain text; * marks the cheapest and ties.

        Raises:
            UnknownNameError: there is no such cost or scene.
        """
        values, best = self.of(cost, scene), self.cheapest(cost, scene)
        title = (
            f"{LAYOUT[cost][2]} [{LAYOUT[cost][1]}], {scene or self.scenes[0]}; "
            f"* cheapest, or as cheap within {self.tie(cost, scene):.2g}"
        )
        rows = [
            [
                f"{row.speed:.4g}",
                *(
                    f"{value:.4g}{'*' if name in row.gaits else ' '}"
                    if np.isfinite(value)
                    else "- "
                    for name, value in zip(self.gaits, column, strict=True)
                ),
            ]
            for row, column in zip(best, values.T, strict=True)
        ]
        wide = max(10, *map(len, self.gaits))
        table = Table(title, ("speed [m/s]", *self.gaits), rows, ">", rule=False, least=wide)
        return "\n".join(table.lines())

    def group(self) -> Group:
        """Return everything as columns and attributes of a file."""
        loss = described("W/(N m)^2", "electrical loss over torque^2, of each joint")
        axes = {
            "scene": Column(("scene",), np.array(self.scenes, dtype=object), {}),
            "gait": Column(("gait",), np.array(self.gaits, dtype=object), {}),
            "speed": Column(("speed",), self.speed, described("m/s", "commanded speed")),
            "duty": Column(("gait",), self.duty, described("1", "share of the cycle in stance")),
            "lift": Column((), np.array(self.lift), described("m", "foot lift")),
            "copper_loss": Column(("motor",), self.copper_loss, loss),
        }
        return grid_group(self, LAYOUT, axes, GRID, SCHEMA)

    @classmethod
    def from_group(
        cls, where: str, group: tuple[Mapping[str, npt.NDArray[Any]], Mapping[str, Any]]
    ) -> GaitEnergy:
        """Return what a group's arrays and attributes hold; `where` is for messages.

        Raises:
            TraceFileError: the group is damaged, of another kind or of a newer schema.
        """
        arrays, attributes = group
        require_schema(where, attributes, SCHEMA)
        try:
            check_grid(arrays, LAYOUT, GRID, NAMES, RULES)
            return cls(
                scenes=tuple(arrays["scene"]),
                gaits=tuple(arrays["gait"]),
                duty=arrays["duty"],
                speed=arrays["speed"],
                lift=float(arrays["lift"]),
                copper_loss=arrays["copper_loss"],
                **grid_fields(arrays, LAYOUT),
            )
        except ParameterError as error:
            raise TraceFileError(f"{where}: {error}") from error

    def save(self, path: str | Path) -> Path:
        """Write a netCDF-4 file, wholly or not at all, and return its path.

        Raises:
            TraceFileError: the file cannot be written; an old one stays as it was.
        """
        return write_netcdf(path, *self.group())


@checked
def load_gait_energy(path: str | Path) -> GaitEnergy:
    """Read what `GaitEnergy.save` wrote; equal to it.

    Raises:
        TraceFileError: the file is missing, damaged, of another kind or of a newer schema.
    """
    return GaitEnergy.from_group(str(path), read_netcdf(path))
