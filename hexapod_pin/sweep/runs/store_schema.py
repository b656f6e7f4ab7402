"""What the store of a sweep must hold: rules of its texts and of its rows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import FileData, Name, Number, check_data, per
from hexapod_pin.results.joint_budget import KINDS, OTHER_KINDS
from hexapod_pin.sweep.runs.case_numbers import WAY_COLUMNS, Quantity, shape_of, sizes_of
from hexapod_pin.sweep.runs.store_file import DONE, FAILED
from hexapod_pin.sweep.runs.store_rows import CaseRow

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
    """Return what a JSON text says.

    Raises:
        ParameterError: it is none.
    """
    try:
        return json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise ParameterError(name, str(text)[:40], f"JSON ({error})") from error


def checked_meta(texts: Mapping[str, str]) -> tuple[int, dict[str, Quantity]]:
    """Return the number of cases and the quantities that table `meta` tells.

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
        found[about["name"]] = Quantity(tuple(about["axes"]), about["unit"], about["meaning"])
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
        if kind not in (*KINDS, *OTHER_KINDS):
            raise ParameterError("labels.kinds", kind, f"one of {(*KINDS, *OTHER_KINDS)}")
    return text


def checked_input(about: Any, values: np.ndarray[Any, Any], count: int) -> dict[str, Any]:
    """Return what is told of an input, with so many values.

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
    """Return the doubles of a case: its quantities, then its way.

    Raises:
        ParameterError: there are too few, or part of a row of the way.
    """
    sizes = sizes_of(labels)
    needed = sum(int(np.prod(shape_of(one.axes, sizes))) for one in stored.values())
    rest = len(numbers) - 8 * needed
    if rest < 0 or rest % (8 * WAY_COLUMNS):
        allowed = f"{8 * needed} bytes and whole rows of the way"
        raise ParameterError(f"cases[{number}].numbers", len(numbers), allowed)
    return np.frombuffer(numbers, dtype="<f8")
