"""The result of a sweep is read from its store, as a labelled dataset, a CSV file or lists."""

from __future__ import annotations

import csv
import io
import itertools
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.foreign_text import csv_cell
from hexapod_pin.results.result_files import (
    NETCDF,
    Column,
    check_ending,
    without_non_finite,
    write_netcdf,
)
from hexapod_pin.results.schema import require_known
from hexapod_pin.study.runs.outcome import PATH
from hexapod_pin.study.runs.store_reading import NOT_RUN, StoredSweep, read_store
from hexapod_pin.study.runs.sweep_columns import (
    CASE,
    COUNTER,
    coordinate_names,
    has_kinds,
    sweep_attributes,
    sweep_columns,
    to_dataset,
)
from hexapod_pin.text_table import Cell, Table, cell_text
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from xarray import Dataset


CSV = (".csv",)
"""Endings of tables."""


ENDINGS = (*NETCDF, *CSV)
"""Of a dataset's file."""


@checked
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
        return self._stored.texts["name"]

    @property
    def study_text(self) -> str:
        """The study's file."""
        return self._stored.texts["study"]

    @property
    def study_digest(self) -> str:
        """The study's digest."""
        return self._stored.texts["digest"]

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
        return to_dataset(self.columns, self.attributes, self.inputs)

    @cached_property
    def columns(self) -> dict[str, Column]:
        """The dataset's variables and coordinates, without importing xarray."""
        return sweep_columns(self._stored)

    @cached_property
    def attributes(self) -> dict[str, str]:
        """The dataset's attributes."""
        return sweep_attributes(self._stored)

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """What the study varies: `name`, `unit`, `meaning`, and `grid`, False where it is drawn."""
        return [item.about for item in self._stored.inputs]

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

    def table(self, rows: int = 10) -> Table:
        """Return the cases of largest torque: inputs, speed, and the peak of each kind of joint.

        A peak at its joint's limit, and a robot that does not walk, are marked with *.

        Args:
            rows: at most.
        """
        return sweep_table(self, rows)

    def to_dict(self) -> dict[str, Any]:
        """Return inputs and numbers of each case as plain data; NaN and infinities as None."""
        names = {*coordinate_names(self.inputs).values(), "reason", "verdict", CASE}
        plain = {
            name: column.values.tolist()
            for name, column in self.columns.items()
            if column.dims == (CASE,) or name in names or name.startswith("kind")
        }
        found: dict[str, Any] = without_non_finite({**self.attributes, "columns": plain})
        return found

    def save(self, path: str | Path, columns: Sequence[str] | None = None) -> Path:
        """Write the dataset as netCDF-4 (.nc) or CSV (.csv), wholly or not at all.

        Args:
            path: of the file.
            columns: of a CSV file: variables to write, beside the index of the case and the
                inputs; None: all.

        Raises:
            TraceFileError: another ending, or the file cannot be written; an old one is intact.
            UnknownNameError: there is no such variable.
        """
        form = check_ending(path, ENDINGS)
        made, attributes = self.columns, self.attributes
        if form in CSV:
            known = [name for name, column in made.items() if _in_csv(name, column)]
            for name in columns or ():
                require_known("column", name, known)
            inputs = coordinate_names(self.inputs).values()
            chosen = None if columns is None else {CASE, *inputs, *columns}
            return write_atomically(path, sweep_csv(made, chosen))
        names = coordinate_names(self.inputs).values()
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


# A sweep as CSV: one row for each case, one column for each number.

ROWS = 256
"""Rows that are made at a time."""


def sweep_csv(made: Mapping[str, Column], chosen: Container[str] | None = None) -> bytes:
    """Return columns along the cases, all or those chosen, except the path.

    Every digit is kept, NaN is empty.

    The head names quantity, label and unit: `torque_peak.lf_coxa_joint [N m]`.
    """
    along = {
        name: column
        for name, column in made.items()
        if _in_csv(name, column) and (chosen is None or name in chosen)
    }
    order = sorted(along, key=lambda name: (name != CASE, len(along[name].dims)))
    parts = {name: column for name in order for column in [along[name]]}
    heads = [head for name, column in parts.items() for head in _heads(name, column, made)]
    content = io.BytesIO()
    text = io.TextIOWrapper(
        content, encoding="utf-8", errors="backslashreplace", newline="", write_through=True
    )
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    tables = [column.values.reshape(len(column.values), -1) for column in parts.values()]
    for start in range(0, len(along[CASE].values), ROWS):
        some = [table[start : start + ROWS].tolist() for table in tables]
        for rows in zip(*some, strict=True):
            writer.writerow([_cell(value) for row in rows for value in row])
    return content.getvalue()


def _in_csv(name: str, column: Column) -> bool:
    return column.dims[:1] == (CASE,) and name != PATH


def require_columns(columns: Iterable[str], inputs: Iterable[Mapping[str, Any]]) -> None:
    """Refuse columns of a CSV file that no sweep of these inputs has, before its cases are run.

    Which counters there are is known from the runs alone: any name that begins with `count_` passes
    here.

    Args:
        columns: names.
        inputs: what the study varies, as of `SweepResult.inputs`.

    Raises:
        UnknownNameError: there is no such column.
    """
    from hexapod_pin.study.runs.outcome import quantities

    own = quantities()
    kinds = [f"kind_{name}" for name, one in own.items() if has_kinds(one)]
    known = [CASE, *coordinate_names(inputs).values(), *own, *kinds, "reason", "verdict"]
    for name in columns:
        if not name.startswith(COUNTER):
            require_known("column", name, known)


def _heads(name: str, column: Column, made: Mapping[str, Column]) -> Iterator[str]:
    unit = column.attributes.get("units", "")
    shown = f" [{unit}]" if unit not in ("", "1", "-") else ""
    labels = [made[axis].values.tolist() for axis in column.dims[1:]]
    for place in itertools.product(*labels):
        yield csv_cell(".".join([name, *place]) + shown)


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return csv_cell(value)
    return "" if value != value else repr(value)


# A sweep in few lines: the cases of largest torque.

LIMITED = 0.999
"""Share of the torque limit from which a peak counts as limited [-]."""


def sweep_table(result: SweepResult, rows: int) -> Table:
    """Return the table of `SweepResult.table`."""
    made = result.columns
    peak, use = made["kind_torque_peak"].values, made["kind_limit_use"].values
    inputs = list(coordinate_names(result.inputs).values())[:MOST_INPUTS]
    units = [made[name].attributes.get("units", "") for name in inputs]
    kinds = made["kind"].values.tolist()
    largest = np.nan_to_num(peak, nan=-1.0).max(axis=1)
    order = np.argsort(-largest, kind="stable")[: min(rows, result.done)]
    head = ["case", *(_two_lines(*one) for one in zip(inputs, units, strict=True)),
            "speed\n[m/s]", "slip per\ncycle\n[m]",
            *(f"{kind}\npeak\n[N m]" for kind in kinds)]  # fmt: skip
    slip = made["slip_distance"].values.sum(axis=1)
    found: list[list[Cell]] = []
    for k in sorted(order.tolist()):
        walks = "" if made["walks"].values[k] else " *"
        peaks = [
            f"{_short(one)}{' *' if share >= LIMITED else ''}"
            for one, share in zip(peak[k], use[k], strict=True)
        ]
        given = [_short(made[name].values[k]) for name in inputs]
        speed = f"{_short(made['measured_speed'].values[k])}{walks}"
        found.append([k, *given, speed, _short(slip[k]), *peaks])
    return Table("", head, found, ">", rule=False)


MOST_INPUTS = 4
"""Inputs of a printed table, the first of the study."""

LONGEST_INPUT = 12
"""Characters of a text in it."""


def _two_lines(name: str, unit: str) -> str:
    """Return a column's head: the end of a long name, and the unit below it."""
    short = name if len(name) <= LONGEST_INPUT else name.rpartition(".")[2][-LONGEST_INPUT:]
    return f"{short}\n[{unit}]" if unit not in ("", "1", "-") else short


def _short(value: Any) -> str:
    """Return a text cut to its first characters, or a number to three digits."""
    return value[:LONGEST_INPUT] if isinstance(value, str) else cell_text(value, ".3g")
