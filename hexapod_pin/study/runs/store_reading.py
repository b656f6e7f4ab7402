"""A store read as columns: a value of every quantity for every case of the study."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import SweepStoreError
from hexapod_pin.file_schema import check_data
from hexapod_pin.results.schema import Quantity
from hexapod_pin.study.runs.outcome import PATH_COLUMNS, shape_of, sizes_of
from hexapod_pin.study.runs.store_file import DONE, connect, nothing_yet, store_errors
from hexapod_pin.study.runs.store_schema import (
    CounterText,
    InputColumn,
    ListText,
    check_row,
    checked_labels,
    checked_meta,
    checked_number,
    checked_numbers,
    is_of_rows,
    read_inputs,
    read_json,
    read_meta,
    stored_rows,
    study_sum,
)

NOT_RUN = "not run"
"""Reason of a case that has no row yet."""

DAMAGED = "damaged in the store: --resume (resume=True) runs it again"
"""Reason of a case whose row is not what was written."""

Labels = Mapping[str, Sequence[str]]


@dataclass
class StoredSweep:
    """All that a store holds; N cases.

    Attributes:
        texts: of the table `meta`, by its keys.
        inputs: with N values each.
        quantities: of which `values` holds the numbers.
        labels: of the axes of each case that was run, by its index.
        values: the doubles of each case that was run, by its index.
        counters: of each case that was run.
        reason: why a case has no numbers, N; empty of those that have.
        verdict: why a case does not walk, N.
        assumed: what the cases assume, each once.
        wall_time: of each case, N [s]; NaN of those that were not run.
    """

    texts: dict[str, str]
    inputs: list[InputColumn]
    quantities: dict[str, Quantity]
    reason: list[str]
    verdict: list[str]
    wall_time: Array
    labels: dict[int, Labels] = field(default_factory=dict)
    values: dict[int, Array] = field(default_factory=dict)
    counters: dict[int, dict[str, float]] = field(default_factory=dict)
    assumed: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of cases of the study."""
        return len(self.reason)

    def place(self, axis: str) -> list[str]:
        """Return the labels of an axis, of all cases together: "joints" or "feet"."""
        return list(dict.fromkeys(name for one in self._distinct() for name in one[axis]))

    @property
    def kinds(self) -> dict[str, str]:
        """The kind of every joint."""
        pairs = (zip(one["joints"], one["kinds"], strict=True) for one in self._distinct())
        return {joint: kind for part in pairs for joint, kind in part}

    @property
    def robots(self) -> list[str]:
        """The robots of all cases, each once."""
        return list(dict.fromkeys(str(one["robot"]) for one in self._distinct()))

    def _distinct(self) -> list[Labels]:
        """Return the labels of all cases, each once, in the order of the cases."""
        return list({id(one): one for _, one in sorted(self.labels.items())}.values())


def read_store(path: Path) -> StoredSweep:
    """Return all that a store holds.

    Raises:
        SweepStoreError: missing, damaged, no store, of a newer schema, or not accessible.
    """
    connection = connect(path, write=False)
    try:
        with store_errors(path):
            connection.execute("BEGIN")  # one state of it, even while cases are added
            meta = read_meta(connection)
            if not meta:
                raise nothing_yet(path)
            if is_of_rows(meta):
                raise SweepStoreError(str(path), "holds rows of other studies, and no sweep.")
            if meta.get("sum") != study_sum(connection):
                raise SweepStoreError(
                    str(path), "what it holds of its study (tables meta, inputs) is damaged: run "
                    "the study again with --resume (resume=True), which writes that again.",
                )  # fmt: skip
            return _read(connection, meta)
    finally:
        connection.close()


def _read(connection: sqlite3.Connection, meta: dict[str, str]) -> StoredSweep:
    count, stored = checked_meta(meta)
    found = StoredSweep(
        meta, read_inputs(connection, count), stored, [NOT_RUN] * count, [""] * count,
        np.full(count, np.nan),
    )  # fmt: skip
    labels = lru_cache(maxsize=None)(lambda text: checked_labels(read_json("labels", text)))
    assumed: dict[str | None, None] = {}
    for row, intact in stored_rows(connection):
        number = checked_number(row.number, count)
        if not intact:
            found.reason[number] = DAMAGED
            continue
        check_row(row)
        found.reason[number] = row.reason
        if row.state != DONE:
            continue
        found.verdict[number] = row.verdict
        found.labels[number] = labels(row.labels)  # one object for cases that share the text
        assumed[row.assumed] = None
        found.wall_time[number] = row.wall_time
        found.values[number] = checked_numbers(number, row.numbers, found.labels[number], stored)
        found.counters[number] = read_json(f"cases[{number}].counters", row.counters)
        check_data(CounterText, f"cases[{number}]", {"counters": found.counters[number]})
    found.assumed = list(dict.fromkeys(one for text in assumed for one in _assumptions(text)))
    return found


def _assumptions(text: str | None) -> list[str]:
    listed: list[str] = read_json("assumed", text)
    check_data(ListText, "assumed", {"texts": listed})
    return listed


def columns(found: StoredSweep) -> dict[str, Array]:
    """Return an array of every quantity, first over the cases; NaN where there is no number.

    The second axis of "joint" and "foot" goes over the labels of all cases together.
    """
    sizes = {"joint": len(found.place("joints")), "foot": len(found.place("feet")), "axis": 3}
    filled = {
        name: np.full((found.count, *shape_of(one.axes, sizes)), np.nan)
        for name, one in found.quantities.items()
    }
    for group in _same_labels(found):
        _fill(found, group, filled)
    return filled


def _same_labels(found: StoredSweep) -> list[list[int]]:
    """Return the cases that share their labels, for each set of labels."""
    groups: dict[int, list[int]] = {}
    for number in found.values:
        groups.setdefault(id(found.labels[number]), []).append(number)
    return list(groups.values())


def _fill(found: StoredSweep, group: list[int], filled: Mapping[str, Array]) -> None:
    """Put the numbers of cases with the same labels where they belong."""
    labels = found.labels[group[0]]
    sizes = sizes_of(labels)
    places = {
        "joint": _places(found.place("joints"), labels["joints"]),
        "foot": _places(found.place("feet"), labels["feet"]),
        "axis": np.arange(3),
    }
    length = _length(found, sizes)
    table = np.stack([found.values[number][:length] for number in group])
    start = 0
    for name, one in found.quantities.items():
        shape = shape_of(one.axes, sizes)
        end = start + int(np.prod(shape))
        where = np.ix_(np.array(group), *(places[axis] for axis in one.axes))
        filled[name][where] = table[:, start:end].reshape(len(group), *shape)
        start = end


def _places(all_names: Sequence[str], names: Sequence[str]) -> np.ndarray[Any, Any]:
    """Return where names stand among all."""
    place = {name: k for k, name in enumerate(all_names)}
    return np.array([place[name] for name in names], dtype=int)


def ways(found: StoredSweep) -> Array:
    """Return the path of every case (N, W, 4), as `Summary.path`; NaN beyond its end."""
    own: dict[int, Array] = {}
    for group in _same_labels(found):
        length = _length(found, sizes_of(found.labels[group[0]]))
        own |= {k: found.values[k][length:].reshape(-1, PATH_COLUMNS) for k in group}
    longest = max((len(way) for way in own.values()), default=0)
    filled = np.full((found.count, longest, PATH_COLUMNS), np.nan)
    for number, way in own.items():
        filled[number, : len(way)] = way
    return filled


def _length(found: StoredSweep, sizes: Mapping[str, int]) -> int:
    """Return how many doubles the quantities of a case take."""
    return sum(int(np.prod(shape_of(one.axes, sizes))) for one in found.quantities.values())
