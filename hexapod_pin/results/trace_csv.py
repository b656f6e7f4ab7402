"""Samples as a CSV table, for spreadsheets and other programs."""

from __future__ import annotations

import csv
import gzip
import io
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path

import numpy as np

from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.result_files import CSV, Column, ending

Q_UNITS = ("m", "m", "m", "1", "1", "1", "1")
V_UNITS = ("m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s")

LEVEL = 6
"""Compression of ".csv.gz"."""


def csv_bytes(path: str | Path, columns: Mapping[str, Column]) -> bytes:
    """Return a table: a header, then a row per sample; compressed where the path ends in ".gz".

    A heading is a variable, its joint, foot or axis where it has one, and its unit:
    "foot_force.lf_foot.z [N]". Numbers are the shortest that give the same double again; what is
    either true or false is 1 or 0.

    Args:
        path: names the format by its ending.
        columns: of a trace; those along time are written.
    """
    stream = io.StringIO()
    head, tables = sampled_table(columns)
    csv.writer(stream, lineterminator="\n").writerow(map(csv_cell, head))
    for row in zip(*(_texts(table) for table in tables), strict=True):
        stream.write(",".join(row) + "\n")
    text = encoded(stream.getvalue())
    if ending(path, CSV[1:]) is None:
        return text
    return gzip.compress(text, LEVEL, mtime=0)


def sampled_table(
    columns: Mapping[str, Column],
) -> tuple[list[str], list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]]:
    """Return the headings and numbers of what is along time: T rows, of one table or several.

    Args:
        columns: of a trace.
    """
    sampled = {name: c for name, c in columns.items() if c.dims[:1] == ("time",)}
    head = [text for name, c in sampled.items() for text in _headings(name, c, columns)]
    return head, [c.values.reshape(len(c.values), -1) for c in sampled.values()]


def _headings(name: str, column: Column, columns: Mapping[str, Column]) -> Iterator[str]:
    """Return a heading for each number in a row of a variable."""
    labels = [columns[axis].values.tolist() for axis in column.dims[1:]]
    units = _units(name, column, [len(names) for names in labels])
    for unit, place in zip(units, product(*labels), strict=True):
        yield f"{'.'.join((name, *place))} [{unit}]"


def _units(name: str, column: Column, sizes: list[int]) -> list[str]:
    """Return a unit for each number in a row; a configuration and a velocity hold several."""
    if name == "q":
        return [*Q_UNITS, *["rad"] * (sizes[0] - len(Q_UNITS))]
    if name == "v":
        return [*V_UNITS, *["rad/s"] * (sizes[0] - len(V_UNITS))]
    return [column.attributes["units"]] * int(np.prod(sizes, dtype=int))


def _texts(table: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Iterator[str]:
    """Return the numbers of each row as text."""
    numbers = table.astype(np.int8) if table.dtype == bool else table
    for row in numbers:
        yield ",".join(map(repr, row.tolist()))
