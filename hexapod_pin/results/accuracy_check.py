"""How much the numbers of a sweep change at a tighter accuracy: its stated error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.netcdf import Column
from hexapod_pin.results.trace_layout import described


@dataclass(frozen=True, eq=False)
class AccuracyCheck:
    """Some points of a sweep, run again at a tighter accuracy.

    Attributes:
        accuracy: that the repeated runs were asked for [m and rad].
        points: their places on the grid, K points with an index per axis. Shape (K, D).
        quantities: Q names.
        change: largest change of each quantity over joints or feet, over its largest value there
            [-]. Shape (K, Q).
    """

    accuracy: float
    points: npt.NDArray[np.int64]
    quantities: tuple[str, ...]
    change: Array

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        points = np.array(self.points, dtype=np.int64)
        points.flags.writeable = False
        change = read_only(self.change)
        if points.ndim != 2 or change.shape != (len(points), len(self.quantities)):
            raise ParameterError("AccuracyCheck.change", change.shape, "points by quantities")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "change", change)
        object.__setattr__(self, "quantities", tuple(self.quantities))

    def error(self, quantity: str, first: int | None = None) -> float:
        """Return the largest relative change of a quantity at the repeated points [-].

        Args:
            quantity: one of `quantities`.
            first: of the points with this index on the grid's first axis alone; NaN where there is
                none. None: of all.

        Raises:
            UnknownNameError: that quantity was not compared.
        """
        if quantity not in self.quantities:
            raise UnknownNameError("quantity", quantity, list(self.quantities))
        change = self.change[:, self.quantities.index(quantity)]
        if first is not None:
            change = change[self.points[:, 0] == first]
        known = change[np.isfinite(change)]
        return float(known.max()) if len(known) else float("nan")

    def columns(self) -> dict[str, Column]:
        """Return the check as columns of a file; names begin with "check_"."""
        names = np.array(self.quantities, dtype=object)
        about = described("1", "largest relative change at check_accuracy")
        accuracy = described("m and rad", "accuracy of the repeated runs")
        places = described("1", "place of a repeated point: an index per axis of the grid")
        return {
            "check_quantity": Column(("check_quantity",), names, {}),
            "check_accuracy": Column((), np.array(self.accuracy), accuracy),
            "check_point": Column(("check", "grid_axis"), self.points, places),
            "check_change": Column(("check", "check_quantity"), self.change, about),
        }

    @classmethod
    def from_columns(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> AccuracyCheck | None:
        """Return the check among the variables of a file; None where there is none."""
        if "check_change" not in arrays:
            return None
        return cls(
            float(arrays["check_accuracy"]), arrays["check_point"],
            tuple(arrays["check_quantity"]), arrays["check_change"],
        )  # fmt: skip


def relative_change(value: Any, other: Any) -> float:
    """Return the largest difference of two numbers or arrays over the largest size of the other."""
    size = float(np.max(np.abs(other)))
    difference = float(np.max(np.abs(np.asarray(value) - np.asarray(other))))
    return difference / size if size > 0.0 else difference
