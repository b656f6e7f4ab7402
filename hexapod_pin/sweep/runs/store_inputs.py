"""What a store holds of its study: texts that stand for all cases, and a column of each input."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hexapod_pin.sweep.runs.store_rows import checksum
from hexapod_pin.sweep.runs.store_schema import checked_input, read_json

if TYPE_CHECKING:
    from hexapod_pin.sweep.study import SweepStudy


class InputColumn(NamedTuple):
    """What an input is over all cases of a study.

    `about` holds its name, unit and meaning, "values" in words, and whether it is a grid axis.
    """

    about: dict[str, Any]
    values: np.ndarray[Any, Any]  # (N,) doubles, or text as objects


def input_columns(study: SweepStudy) -> list[InputColumn]:
    """Return the inputs of a study with their value in each case."""
    points = [study.point(index) for index in range(len(study))]
    found = []
    for item in study.inputs:
        values = [point[item.name] for point in points]
        text = any(isinstance(value, str) for value in values)
        about = {
            "name": item.name,
            "unit": item.unit,
            "meaning": item.kind.meaning,
            "values": item.text,
            "grid": bool(item.values),
        }
        column = [str(value) for value in values] if text else values
        found.append(InputColumn(about, np.array(column, dtype=object if text else float)))
    return found


def write_study(connection: sqlite3.Connection, study: SweepStudy, meta: Mapping[str, str]) -> None:
    """Write what a store holds of its study, in place of what stands there, wholly or not at all.

    Args:
        connection: to the store.
        study: whose inputs are written.
        meta: the texts of table `meta`, but for their checksum.
    """
    with connection:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("DELETE FROM meta")
        connection.execute("DELETE FROM inputs")
        for place, (about, values) in enumerate(input_columns(study)):
            text = values.dtype == object
            numbers = None if text else values.astype("<f8").tobytes()
            words = json.dumps(values.tolist()) if text else None
            connection.execute(
                "INSERT INTO inputs VALUES (?, ?, ?, ?)",
                (place, json.dumps(about), numbers, words),
            )
        connection.executemany("INSERT INTO meta VALUES (?, ?)", meta.items())
        connection.execute("INSERT INTO meta VALUES ('sum', ?)", (study_sum(connection),))


def study_sum(connection: sqlite3.Connection) -> str:
    """Return the checksum of all that a store holds of its study: its texts and its inputs."""
    rows = [
        *connection.execute("SELECT key, value FROM meta WHERE key != 'sum' ORDER BY key"),
        *connection.execute("SELECT place, about, numbers, texts FROM inputs ORDER BY place"),
    ]
    return str(checksum(len(rows), *(value for row in rows for value in row)))


def read_meta(connection: sqlite3.Connection) -> dict[str, str]:
    """Return the texts that stand for the whole store."""
    return dict(connection.execute("SELECT key, value FROM meta"))


def read_inputs(connection: sqlite3.Connection, count: int) -> list[InputColumn]:
    """Return the inputs that the store of so many cases holds.

    Raises:
        ParameterError: they break a rule of `store_schema`.
    """
    found = []
    rows = connection.execute("SELECT about, numbers, texts FROM inputs ORDER BY place")
    for about, numbers, texts in rows:
        if isinstance(numbers, bytes) and len(numbers) == 8 * count:
            values = np.frombuffer(numbers, dtype="<f8").astype(float)
        else:
            values = np.array(read_json("inputs.texts", texts), dtype=object)
        told = checked_input(read_json("inputs.about", about), values, count)
        found.append(InputColumn(told, values))
    return found
