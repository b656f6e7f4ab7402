"""A sweep as CSV: one row for each case, one column for each number."""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Iterator, Mapping
from typing import Any

from hexapod_pin.foreign_text import csv_cell
from hexapod_pin.results.netcdf import Column
from hexapod_pin.sweep.runs.case_numbers import WAY
from hexapod_pin.sweep.runs.dataset import CASE

ROWS = 256
"""Rows that are made at a time."""


def sweep_csv(made: Mapping[str, Column]) -> bytes:
    """Return all columns along the cases but the way; every digit is kept, NaN is empty.

    The head names quantity, label and unit: `torque_peak.lf_coxa_joint [N m]`.
    """
    along = {k: c for k, c in made.items() if c.dims[:1] == (CASE,) and k != WAY}
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
