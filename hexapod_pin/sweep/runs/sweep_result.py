"""What a sweep has come to: read from its store, as a dataset, a file, or lists."""

from __future__ import annotations

import json
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked, explain_methods
from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.results.file_ending import NETCDF, check_ending
from hexapod_pin.results.netcdf import Column, write_netcdf
from hexapod_pin.sweep.runs.dataset import (
    coordinate_names,
    sweep_attributes,
    sweep_columns,
    to_dataset,
)
from hexapod_pin.sweep.runs.store_reading import NOT_RUN, StoredSweep, read_store
from hexapod_pin.sweep.runs.sweep_csv import sweep_csv
from hexapod_pin.user_file import user_path

CSV = (".csv",)
"""Endings of tables."""

if TYPE_CHECKING:
    from xarray import Dataset


ENDINGS = (*NETCDF, *CSV)
"""Of a dataset's file."""


@explain_methods
class SweepResult:
    """What a store held when it was opened; a sweep under way may be looked at.

    Attributes:
        path: of the store.
    """

    def __init__(self, path: str | Path) -> None:
        """Read the store.

        Raises:
            SweepStoreError: missing, damaged, no store, of a newer schema, or not accessible.
        """
        self.path = user_path(path)
        self._stored: StoredSweep = read_store(self.path)

    def __len__(self) -> int:
        """Return the number of cases of the study."""
        return self._stored.count

    @property
    def name(self) -> str:
        """Name of the study."""
        return self._stored.meta["name"]

    @property
    def study_text(self) -> str:
        """The study's file."""
        return self._stored.meta["study"]

    @property
    def study_digest(self) -> str:
        """The study's digest."""
        return self._stored.meta["digest"]

    @property
    def done(self) -> int:
        """How many cases were run and have numbers."""
        return len(self._stored.values)

    @property
    def failed(self) -> list[tuple[int, str]]:
        """Index and reason of each case that failed."""
        reasons = enumerate(self._stored.reason)
        return [(k, reason) for k, reason in reasons if reason not in ("", NOT_RUN)]

    @property
    def pending(self) -> list[int]:
        """Indices of the cases that were not run yet."""
        return [k for k, reason in enumerate(self._stored.reason) if reason == NOT_RUN]

    @property
    def reasons(self) -> dict[str, int]:
        """How many cases failed for each type of error, most first."""
        kinds = Counter(reason.split(":", 1)[0] for _, reason in self.failed)
        return dict(kinds.most_common())

    @property
    def not_walking(self) -> int:
        """How many cases were run in which the robot does not walk."""
        return int(np.sum(self.columns["walks"].values == 0.0))

    @property
    def case_time(self) -> float:
        """Mean wall time of a case, from its planning to its end [s]; NaN without any."""
        known = self._stored.wall_time[~np.isnan(self._stored.wall_time)]
        return float(known.mean()) if len(known) else float("nan")

    @cached_property
    def dataset(self) -> Dataset:
        """An `xarray.Dataset`: case by joint, foot or kind; inputs are coordinates along `case`.

        Variables have `units` and `long_name`. Cases without numbers are NaN, and `reason` says
        why. Wall times are no part of it: the same study gives the same bits.
        """
        return to_dataset(self.columns, self.attributes)

    @cached_property
    def columns(self) -> dict[str, Column]:
        """The dataset's variables and coordinates, without importing xarray."""
        return sweep_columns(self._stored)

    @cached_property
    def attributes(self) -> dict[str, str]:
        """The dataset's attributes."""
        return sweep_attributes(self._stored)

    def input_values(self, name: str) -> Array:
        """Return the values of an input along the cases, as of the dataset's coordinate.

        Raises:
            UnknownNameError: the study does not vary it.
        """
        names = [item.about["name"] for item in self._stored.inputs]
        if name not in names:
            raise UnknownNameError("input", name, names)
        values: Array = self._stored.inputs[names.index(name)].values
        return values

    def save(self, path: str | Path) -> Path:
        """Write the dataset as netCDF-4 (.nc) or CSV (.csv), wholly or not at all.

        Raises:
            TraceFileError: another ending, or the file cannot be written; an old one is intact.
        """
        form = check_ending(path, ENDINGS)
        made, attributes = self.columns, self.attributes
        if form in CSV:
            return write_atomically(path, sweep_csv(made))
        names = coordinate_names(json.loads(attributes["inputs"])).values()
        return write_netcdf(path, made, {**attributes, "coordinates": " ".join(names)})


@checked
def open_sweep(path: str | Path) -> SweepResult:
    """Return what the store of a sweep holds, finished or not; it may be written to meanwhile.

    Args:
        path: of the store that `run_sweep` or `hexapod-pin sweep` wrote.

    Raises:
        SweepStoreError: missing, damaged, no store, of a newer schema, or not accessible.

    Example:
        >>> sweep = open_sweep("study.db")
        >>> sweep.dataset["kind_torque_peak"].sel(kind="femur").max()
    """
    return SweepResult(path)
