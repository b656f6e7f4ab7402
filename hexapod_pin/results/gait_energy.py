"""Energy that gaits need at equal speed and step height, as data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.results.grid_columns import GridResult
from hexapod_pin.results.result_files import read_netcdf
from hexapod_pin.results.schema import quantity, require_known, schema
from hexapod_pin.text_table import Table

GRID = ("scene", "gait", "speed")
POINT = "scene gait speed"

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


class GaitEnergy(GridResult):
    """Costs of G gaits at V speeds on M scenes, at equal speed and step height; SI units.

    Energies are mechanical, at the joints, over whole cycles, unless stated otherwise. A point that
    could not be walked is NaN, and `reason` has the cause. Two are equal when every bit is.

    The copper loss is gamma of `physics`: R / (k N)^2 for a motor of resistance R and torque
    constant k behind a gear N. The torque index is Li's ([S2]'s reference 13), which weighs joints
    by numbers that could not be found: here all are 1.

    Attributes:
        scenes: M names.
        gaits: G names.
        reason: why a point could not be walked, "" where it was (M, G, V).
        check: some points at a tighter accuracy; None where none was run.
        run: how the costs came about: scenes, gaits, settings, what is assumed.
    """

    GRID: ClassVar[tuple[str, ...]] = GRID
    FILE: ClassVar[tuple[str, int]] = ("hexapod_pin.gait_energy", 1)
    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "scene": "scenes", "gait": "gaits", "speed": "speed",
    }  # fmt: skip

    # fmt: off
    scenes: tuple[str, ...]
    gaits: tuple[str, ...]
    duty: Array = quantity("gait", "1", "fraction of the cycle in stance", least=0.0, nan=False)
    speed: Array = quantity("speed", "m/s", "commanded speed, stroke / (duty * cycle time)",
        least=0.0, nan=False)
    lift: float = quantity("", "m", "foot lift, the same for all", least=0.0, nan=False)
    copper_loss: Array = quantity("motor", "W/(N m)^2",
        "electrical loss over torque^2, of each joint of the first scene", least=0.0, nan=False)
    cost_of_transport: Array = quantity(POINT, "1",
        "absolute mechanical energy / (weight * distance)")
    cost_of_transport_positive: Array = quantity(POINT, "1",
        "positive mechanical energy / (weight * distance)")
    cost_of_transport_electrical: Array = quantity(POINT, "1",
        "integral of sum(torque * rate + copper_loss * torque^2) / (weight * distance)")
    torque_index: Array = quantity(POINT, "N^2 m s",
        "integral of sum of torque^2 over joints / distance")
    torque_index_largest: Array = quantity(POINT, "N^2 m s",
        "integral of torque^2 / distance, largest joint")
    torque_peak: Array = quantity(POINT, "N m",
        "largest axis torque of any joint, of accepted steps")
    torque_rms: Array = quantity(POINT, "N m", "largest RMS axis torque of any joint")
    speed_peak: Array = quantity(POINT, "rad/s", "largest joint rate")
    measured_speed: Array = quantity(POINT, "m/s", "speed of the centre of mass along the heading")
    stroke: Array = quantity(POINT, "m", "stroke of the gait")
    cycle_time: Array = quantity(POINT, "s", "cycle time of the gait")
    # fmt: on

    def of(self, quantity: str, scene: str | None = None) -> Array:
        """Return a quantity on one scene, by default the first. Shape (G, V).

        Raises:
            UnknownNameError: there is no such quantity or scene.
        """
        name = self.scenes[0] if scene is None else scene
        points = [key for key, one in schema(GaitEnergy).items() if one.axes == GRID]
        require_known("scene", name, self.scenes)
        require_known("quantity", quantity, points)
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
        require_known("cost", cost, COSTS)
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

    def table(self, cost: str = "cost_of_transport_positive", scene: str | None = None) -> str:
        """Return a cost of all gaits against speed as plain text; * marks the cheapest and ties.

        Raises:
            UnknownNameError: there is no such cost or scene.
        """
        values, best = self.of(cost, scene), self.cheapest(cost, scene)
        about = schema(GaitEnergy)[cost]
        title = (
            f"{about.meaning} [{about.unit}], {scene or self.scenes[0]}; "
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


@checked
def load_gait_energy(path: str | Path) -> GaitEnergy:
    """Read what `GaitEnergy.save` wrote; equal to it.

    Raises:
        TraceFileError: the file is missing, damaged, of another kind or of a newer schema.
    """
    return GaitEnergy.from_group(str(path), read_netcdf(path))
