"""A store holds rows, inputs and texts with checksums, and is checked against a schema."""

from __future__ import annotations

import json
import sqlite3
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import FileData, Name, Number, check_data, per
from hexapod_pin.results.joint_budget import GAP, KINDS, OTHER_KINDS
from hexapod_pin.results.schema import Quantity
from hexapod_pin.study.runs.outcome import PATH_COLUMNS, Outcome, shape_of, sizes_of
from hexapod_pin.study.runs.store_file import DONE, FAILED

if TYPE_CHECKING:
    from hexapod_pin.study.sweep import SweepStudy


MAX_CASES = 10_000_000


def _each_once(names: Sequence[str]) -> Sequence[str]:
    if len(set(names)) < len(names):
        raise ValueError("each there once")
    return names


Names = Annotated[list[Name], AfterValidator(_each_once), Field(max_length=2000)]
Axes = list[Literal["joint", "foot", "axis"]]


class MetaTexts(FileData):
    """Table `meta`, its JSON texts read."""

    name: str
    study: str
    folder: str
    digest: str
    cases: Annotated[int, Field(ge=1, le=MAX_CASES)]
    versions: dict[str, str]
    quantities: list[Annotated[list[Any], Field(min_length=4, max_length=4)]]
    sum: str


class QuantityText(FileData):
    """A quantity in `meta`."""

    name: Name
    axes: Axes
    unit: str
    meaning: str


class LabelsText(FileData):
    """Labels of the axes of a case."""

    joints: Names
    kinds: Annotated[list[str], per("joint")]
    feet: Names
    robot: str


class InputText(FileData):
    """An input of the study."""

    name: Name
    unit: str
    meaning: str
    values: str
    grid: bool


class ListText(FileData):
    """A list of texts."""

    texts: list[str]


class CounterText(FileData):
    """Counters of a case."""

    counters: dict[str, Number]


def read_json(name: str, text: Any) -> Any:
    """Return the data of a JSON text.

    Raises:
        ParameterError: it is none.
    """
    try:
        return json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise ParameterError(name, str(text)[:40], f"JSON ({error})") from error


def checked_meta(texts: Mapping[str, str]) -> tuple[int, dict[str, Quantity]]:
    """Return the number of cases and the quantities in table `meta`.

    Raises:
        ParameterError: it breaks a rule.
    """
    data: dict[str, Any] = dict(texts) | {"cases": read_json("meta.cases", texts.get("cases"))}
    for key in ("versions", "quantities"):
        data[key] = read_json(f"meta.{key}", texts.get(key))
    check_data(MetaTexts, "meta", data)
    found = {}
    for place, entry in enumerate(data["quantities"]):
        about = dict(zip(("name", "axes", "unit", "meaning"), entry, strict=True))
        check_data(QuantityText, f"meta.quantities[{place}]", about)
        found[about["name"]] = Quantity(
            tuple(about["axes"]), about["unit"], meaning=about["meaning"]
        )
    return data["cases"], found


def checked_labels(text: Any) -> dict[str, Any]:
    """Return the labels of a case's axes.

    Raises:
        ParameterError: they break a rule.
    """
    if not isinstance(text, dict):
        raise ParameterError("labels", text, "of joints and feet")
    check_data(LabelsText, "labels", text, joint=len(text.get("joints", ())))
    for kind in text["kinds"]:
        if kind not in (known := (*KINDS, *OTHER_KINDS, GAP)):
            raise ParameterError("labels.kinds", kind, f"one of {known}")
    return text


def checked_input(about: Any, values: np.ndarray[Any, Any], count: int) -> dict[str, Any]:
    """Return the description of an input that has this number of values.

    Raises:
        ParameterError: it breaks a rule.
    """
    check_data(InputText, "inputs.about", about)
    if values.shape != (count,):
        raise ParameterError(f"inputs[{about['name']}]", values.shape, f"{count} values")
    if values.dtype == object and not all(isinstance(one, str) for one in values):
        raise ParameterError(f"inputs[{about['name']}]", "texts", "texts alone")
    return dict(about)


def checked_number(number: Any, count: int) -> int:
    """Return the index of a case.

    Raises:
        ParameterError: the study has no such case.
    """
    if not (isinstance(number, int) and 0 <= number < count):
        raise ParameterError("cases.number", number, f"0 to {count - 1}")
    return number


def check_row(row: CaseRow) -> None:
    """Check the types in a row that is what was written: it may have been written by others.

    Raises:
        ParameterError: it breaks a rule.
    """
    if row.state not in (DONE, FAILED):
        raise ParameterError(f"cases[{row.number}].state", row.state, f"{DONE} or {FAILED}")
    texts = row.digest, row.reason, row.verdict, row.counters
    fits = all(isinstance(text, str) for text in texts) and isinstance(row.numbers, bytes)
    if not fits or not isinstance(row.wall_time, float):
        raise ParameterError(f"cases[{row.number}]", texts, "texts, numbers and a wall time [s]")


def checked_numbers(
    number: int, numbers: bytes, labels: Mapping[str, Any], stored: Mapping[str, Quantity]
) -> np.ndarray[Any, Any]:
    """Return the doubles of a case: its quantities, then its path.

    Raises:
        ParameterError: there are too few, or an incomplete row of the path.
    """
    sizes = sizes_of(labels)
    needed = sum(int(np.prod(shape_of(one.axes, sizes))) for one in stored.values())
    rest = len(numbers) - 8 * needed
    if rest < 0 or rest % (8 * PATH_COLUMNS):
        allowed = f"{8 * needed} bytes and whole rows of the path"
        raise ParameterError(f"cases[{number}].numbers", len(numbers), allowed)
    return np.frombuffer(numbers, dtype="<f8")


# The rows of a store: each carries a checksum of all that it means, its shared texts included.


class CaseRow(NamedTuple):
    """What the row of a case means, in the order of its checksum."""

    number: int  # index of the case in its study
    digest: str
    state: int  # DONE or FAILED
    reason: str
    verdict: str
    labels: str | None  # JSON
    assumed: str | None  # JSON
    counters: str  # JSON
    numbers: bytes
    wall_time: float  # [s]


def row_of(outcome: Outcome) -> CaseRow:
    """Return the row of what became of a case."""
    return CaseRow(
        outcome.index, outcome.digest, FAILED if outcome.reason else DONE, outcome.reason,
        outcome.verdict, outcome.labels or None, outcome.assumed or None, outcome.counters,
        outcome.numbers, float(outcome.wall_time),
    )  # fmt: skip


def write_rows(connection: sqlite3.Connection, rows: list[CaseRow], known: dict[str, int]) -> None:
    """Insert rows within a transaction of the caller's.

    Args:
        connection: to the store.
        rows: none of which is there.
        known: numbers of texts that many cases share; new ones are added.
    """
    for row in rows:
        labels, assumed = (_text(connection, text, known) for text in (row.labels, row.assumed))
        connection.execute(
            f"INSERT INTO cases VALUES ({', '.join('?' * 11)})",
            (*row[:5], labels, assumed, row.counters, row.numbers, checksum(*row), row.wall_time),
        )


def _text(connection: sqlite3.Connection, text: str | None, known: dict[str, int]) -> int | None:
    """Return the number of a text that many cases share."""
    if text is None:
        return None
    if text not in known:
        connection.execute("INSERT OR IGNORE INTO texts (text) VALUES (?)", (text,))
        row = connection.execute("SELECT id FROM texts WHERE text = ?", (text,))
        known[text] = int(row.fetchone()[0])
    return known[text]


def stored_rows(
    connection: sqlite3.Connection, number: int | None = None
) -> Iterator[tuple[CaseRow, bool]]:
    """Yield the rows in the order of their cases, and whether each is what was written.

    Args:
        connection: to the store.
        number: of the only one to yield; None: all.
    """
    only = "" if number is None else f" WHERE number = {number:d}"
    rows = connection.execute(
        "SELECT number, digest, state, reason, verdict, first.text, second.text, counters, "
        "numbers, wall_time, sum FROM cases LEFT JOIN texts AS first ON first.id = labels "
        f"LEFT JOIN texts AS second ON second.id = assumed{only} ORDER BY number"
    )
    for *values, total in rows:
        row = CaseRow._make(values)
        yield row, checksum(*row) == total


def checksum(*values: Any) -> int:
    """Return the CRC-32 of values with their types."""
    total = 0
    for value in values:
        data = value if isinstance(value, bytes) else repr(value).encode()
        head = f"{type(value).__name__} {len(data)};".encode()
        total = zlib.crc32(data, zlib.crc32(head, total))
    return total


# What a store holds of its study: texts that stand for all cases, and a column of each input.


class InputColumn(NamedTuple):
    """What an input is over all cases of a study.

    `about` holds name, unit, meaning, "values" as text, and whether it is a grid axis.
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


def write_meta(
    connection: sqlite3.Connection, meta: Mapping[str, str], inputs: Sequence[InputColumn] = ()
) -> None:
    """Replace what a store holds of its study, completely or not at all.

    Args:
        connection: to the store.
        meta: the texts of table `meta`, without their checksum.
        inputs: of the study.
    """
    with connection:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("DELETE FROM meta")
        connection.execute("DELETE FROM inputs")
        for place, (about, values) in enumerate(inputs):
            text = values.dtype == object
            numbers = None if text else values.astype("<f8").tobytes()
            listed = json.dumps(values.tolist()) if text else None
            connection.execute(
                "INSERT INTO inputs VALUES (?, ?, ?, ?)",
                (place, json.dumps(about), numbers, listed),
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


ROWS = {"name": "rows of studies"}
"""Table `meta` of a store that holds rows of any studies, and no sweep."""


def is_of_rows(meta: Mapping[str, str]) -> bool:
    """Tell whether a store holds rows of any studies by its table `meta`."""
    return "digest" not in meta and meta.get("name") == ROWS["name"]


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
        checked = checked_input(read_json("inputs.about", about), values, count)
        found.append(InputColumn(checked, values))
    return found
