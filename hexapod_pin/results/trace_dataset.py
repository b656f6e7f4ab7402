"""A trace's dataset for xarray, whose table for pandas is refused where no memory holds it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import xarray

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Hashable

    import pandas

MOST_ROWS = 10_000_000
"""Rows of a table, at most."""


class TraceDataset(xarray.Dataset):  # type: ignore[no-untyped-call]  # of xarray's subclassing
    """An `xarray.Dataset` like any other; parts of it are one, too."""

    __slots__ = ()

    def to_dataframe(self, dim_order: Sequence[Hashable] | None = None) -> pandas.DataFrame:
        """Return xarray's table: a row for every combination of all axes.

        Raises:
            ParameterError: that are more than ten million rows, as of a whole walk.
        """
        rows = math.prod(self.sizes.values())
        if rows > MOST_ROWS:
            axes = ", ".join(str(axis) for axis in self.sizes)
            allowed = f"at most {MOST_ROWS:g}: a row for every combination of {axes}"
            hint = (
                "`trace.to_pandas()` has one row per sample; `dataset[['torque']].to_dataframe()` "
                "has the axes of the torque alone."
            )
            raise ParameterError("rows of to_dataframe", rows, allowed, hint)
        found: Any = super().to_dataframe(dim_order)
        return found
