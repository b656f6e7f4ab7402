"""A measure is what a study keeps of a run; its rows are stored and sent as text and doubles."""

from __future__ import annotations

import builtins
import hashlib
import inspect
import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property, lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

import numpy as np

from hexapod_pin import errors
from hexapod_pin.arguments import checked
from hexapod_pin.control.check_controller import settings_of
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.run_record import RunCase, RunRecord
from hexapod_pin.results.schema import pack, schema, unpack
from hexapod_pin.results.summary import Summary
from hexapod_pin.scene.robot_file import robot_to_dict
from hexapod_pin.simulation.case_data import run_to_dict
from hexapod_pin.simulation.run_outcome import package_versions

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.simulation.case import Case

Row = TypeVar("Row")
"""What a study keeps of a run."""


@checked
@dataclass(frozen=True)
class Measure(Generic[Row]):
    """What a study keeps of each run.

    Attributes:
        name: "module:NAME" of this object; a worker imports it from there.
        version: another number whenever the function computes something else.
        keep: "summary", or "trace" where the function needs samples.
        row: type of the rows: `Summary`, a dict, or a dataclass of numbers, texts and arrays.
        of: returns the row of a case and its run; `settings` are its keyword arguments.
        parts: dataclasses that stand within a row.
        settings: plain data that the function needs besides; part of what identifies a row.
    """

    name: str
    version: int
    keep: Literal["summary", "trace"]
    row: type[Row]
    of: Callable[..., Row]
    parts: tuple[type, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    def with_settings(self, **settings: Any) -> Measure[Row]:
        """Return the measure with other settings: plain data, such as lists of numbers."""
        return replace(self, settings=settings)

    def measured(self, case: Case, result: Trace | Summary) -> Row:
        """Return the row of a run."""
        return self.of(case, result, **self.settings)

    def key(self, case: Case) -> str:
        """Return the SHA-256 that identifies the row of a case.

        Its limits of work count, and the source of a controller or measure of the user's own.

        Raises:
            ParameterError: the controller cannot be written as data.
        """
        limits = "" if case.limits is None else str(case.limits.model_dump())
        source = own_source(type(case.controller)) + own_source(self.of)
        text = f"{case.digest} {limits} {self._identity} {source}"
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def _identity(self) -> str:
        """What a row depends on besides its case."""
        kinds = [kind for kind in (self.row, *self.parts) if is_dataclass(kind)]
        named: Any = [[kind.__name__, *(one.name for one in fields(kind))] for kind in kinds]
        if self.row is Summary:
            named = [*schema(Summary), *sorted(RunRecord.model_fields)]
        parts = [self.name, self.version, self.settings, package_versions(), named]
        return json.dumps(parts, sort_keys=True)

    def pack(self, row: Row) -> tuple[str, bytes]:
        """Return a row as text, which rows of the same kind share, and little-endian doubles.

        Raises:
            TypeError: something in the row is no number, text, array, list, dict or dataclass.
        """
        numbers: list[Any] = []
        text = json.dumps(_taken_apart(row, numbers))
        return text, np.concatenate([np.zeros(0), *numbers]).astype("<f8").tobytes()

    def unpack(self, case: Case, text: str, numbers: bytes) -> Row:
        """Return the row of a case that `pack` gave.

        Raises:
            ParameterError: text and numbers do not belong together.
        """
        doubles = _Doubles(np.frombuffer(numbers, "<f8").astype(float))
        kinds = {kind.__name__: kind for kind in (self.row, *self.parts)}
        try:
            found: Row = _put_together(_parsed(text), doubles, kinds, case)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise ParameterError("row", text[:40], f"one of {self.name} ({error})") from error
        if not isinstance(found, self.row):
            raise ParameterError("row", type(found).__name__, f"a {self.row.__name__}")
        if doubles.place != len(doubles.values):
            raise ParameterError("row", len(doubles.values), f"{doubles.place} numbers")
        return found


def measure_named(name: str, settings: Mapping[str, Any]) -> Measure[Any]:
    """Return a measure by its name, "module:NAME".

    Raises:
        ParameterError: there is none.
    """
    module, _, attribute = name.partition(":")
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        hint = "Install the module, or start the workers with its folder in PYTHONPATH."
        raise ParameterError("measure", name, f"importable ({error})", hint) from error
    if not isinstance(found, Measure):
        raise ParameterError("measure", name, "a Measure")
    return found.with_settings(**settings)


def _summary(case: Case, summary: Summary) -> Summary:
    return summary


SUMMARY = Measure("hexapod_pin.study.runs.measure:SUMMARY", 1, "summary", Summary, _summary)
"""The whole summary of a run."""


# A row as text and doubles. In the text, 0 means the next float and 1 the next whole number;
# objects with one key mark kinds that JSON does not distinguish.

EXACT = 2**53
"""Whole numbers up to this one are doubles."""


@lru_cache(maxsize=256)
def own_source(made: Callable[..., Any]) -> str:
    """Return the source of a function, or of a class and its bases, that is not this package's.

    It is empty for what this package defines and for what was typed at a prompt. What the code
    calls elsewhere is not followed.
    """
    texts = []
    for part in made.__mro__[:-1] if isinstance(made, type) else (made,):
        if not part.__module__.startswith("hexapod_pin."):
            with suppress(OSError, TypeError):
                texts.append(inspect.getsource(part))
    return "\n".join(texts)


def _taken_apart(value: Any, numbers: list[Any]) -> Any:
    """Return a value as JSON-able data; its numbers are appended to `numbers`."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, np.generic):
        return _taken_apart(value.item(), numbers)
    if isinstance(value, float):
        numbers.append((value,))
        return 0
    if isinstance(value, int):
        if abs(value) > EXACT:
            return {"int": str(value)}
        numbers.append((float(value),))
        return 1
    if isinstance(value, np.ndarray):
        if value.dtype != np.float64:
            raise TypeError(f"an array of {value.dtype} in a row")
        numbers.append(value.ravel())
        return {"array": list(value.shape)}
    if isinstance(value, Summary):
        return {"summary": _taken_apart(_summary_parts(value), numbers)}
    if is_dataclass(value) and not isinstance(value, type):
        parts = {one.name: getattr(value, one.name) for one in fields(value) if one.init}
        return {"of": type(value).__name__, "parts": _taken_apart(parts, numbers)}
    if isinstance(value, Mapping):
        return {"map": {_key(key): _taken_apart(one, numbers) for key, one in value.items()}}
    if isinstance(value, list | tuple):
        return _sequence(value, numbers)
    raise TypeError(f"{type(value).__name__} in a row")


def _sequence(value: list[Any] | tuple[Any, ...], numbers: list[Any]) -> Any:
    if value and all(type(one) is float for one in value):
        numbers.append(value)
        inner: Any = len(value)
    else:
        inner = [_taken_apart(one, numbers) for one in value]
    return {"tuple" if isinstance(value, tuple) else "list": inner}


def _key(key: object) -> str:
    if not isinstance(key, str):
        raise TypeError(f"the key {key!r} in a row: it must be a text")
    return key


class _Doubles:
    """The doubles of a row, taken one after the other."""

    def __init__(self, values: np.ndarray[Any, np.dtype[np.float64]]) -> None:
        self.values, self.place = values, 0
        self.plain: list[float] = values.tolist()

    def one(self) -> float:
        """Return the next one."""
        self.place += 1
        return self.plain[self.place - 1]

    def take(self, count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the next ones."""
        found = self.values[self.place : self.place + count]
        if len(found) < count:
            raise ValueError("too few numbers")
        self.place += count
        return found


def _put_together(data: Any, doubles: _Doubles, kinds: Mapping[str, type], case: Case) -> Any:
    """Return the value that `_taken_apart` gave."""
    if data is None or isinstance(data, bool | str):
        return data
    if isinstance(data, int):
        number = doubles.one()
        return int(number) if data else number

    def inner(value: Any) -> Any:
        return _put_together(value, doubles, kinds, case)

    [(kind, value), *more] = data.items()
    if kind == "int":
        return int(value)
    if kind == "array":
        return doubles.take(math.prod(value)).reshape(value).copy()
    if kind == "map":
        return {key: inner(one) for key, one in value.items()}
    if kind in ("list", "tuple"):
        plain = isinstance(value, int)
        found = doubles.take(value).tolist() if plain else [inner(one) for one in value]
        return tuple(found) if kind == "tuple" else found
    if kind == "summary":
        return _summary_of(case, inner(value))
    return kinds[value](**inner(dict(more)["parts"]))


@lru_cache(maxsize=64)
def _parsed(text: str) -> Any:
    """Return the data of a row's text, which many rows share; nothing writes to it."""
    return json.loads(text)


def _summary_parts(summary: Summary) -> dict[str, Any]:
    """Return what a row holds of a summary; what was run is known from its case."""
    return {
        **{name: getattr(summary, name) for name in ("joint_names", "foot_names", "cycles")},
        "states": summary.states,
        "numbers": pack(summary),
        "counters": summary.counters,
        "errors": summary.errors,
        "run": summary.run.to_dict(),
    }


def _summary_of(case: Case, parts: dict[str, Any]) -> Summary:
    joints, feet = len(parts["joint_names"]), len(parts["foot_names"])
    sizes = {"joint": joints, "foot": feet, "axis": 3, "path_column": 4}
    numbers = unpack(Summary, parts.pop("numbers"), sizes)
    run = RunRecord.from_dict(parts.pop("run"), joint=joints, foot=feet)
    what = RunCase(
        case.scene.settings, robot_to_dict(case.scene.robot), settings_of(case.controller),
        run_to_dict(case),
    )  # fmt: skip
    return Summary(**parts, **numbers, run=run.model_copy(update={"case": what}))


# An error as text.


def pack_error(error: Exception) -> str:
    """Return an error as JSON text: its type, arguments and plain attributes."""
    state = {name: _plain(value) for name, value in vars(error).items() if name != "trace"}
    args = [_plain(value) for value in error.args]
    return json.dumps({"error": type(error).__name__, "args": args, "state": state})


def unpack_error(text: str) -> Exception:
    """Return the error that `pack_error` gave; of a type of others, one of the same name."""
    data = json.loads(text)
    name, args = data["error"], data["args"]
    kind = getattr(errors, name, None) or getattr(builtins, name, None)
    if not (isinstance(kind, type) and issubclass(kind, Exception)):
        kind = type(name, (Exception,), {})
    error: Exception = kind.__new__(kind, *args)
    error.args = tuple(args)
    for attribute, value in data["state"].items():
        setattr(error, attribute, value)
    return error


def _plain(value: Any) -> Any:
    """Return a value as plain data, or as text."""
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, Sequence):
        return [_plain(one) for one in value]
    return repr(value)
