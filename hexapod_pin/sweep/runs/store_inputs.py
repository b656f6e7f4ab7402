"""The inputs of a study's cases, kept in its store: one column for each."""

from __future__ import annotations

import json
import sqlite3
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

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


def write_inputs(connection: sqlite3.Connection, study: SweepStudy) -> None:
    """Write the inputs of a study into the tables of its store."""
    for place, (about, values) in enumerate(input_columns(study)):
        text = values.dtype == object
        numbers = None if text else values.astype("<f8").tobytes()
        words = json.dumps(values.tolist()) if text else None
        connection.execute(
            "INSERT INTO inputs VALUES (?, ?, ?, ?)", (place, json.dumps(about), numbers, words)
        )


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
