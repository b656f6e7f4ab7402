"""Errors of every type, and what two things differ in, to the bit."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.errors import CatalogFault, HexapodError


def differences(one: Any, other: Any, where: str = "") -> Iterator[str]:
    """What two things differ in, to the bit and with what may be written to."""
    if type(one) is not type(other):
        yield f"{where}: {type(one).__name__} and {type(other).__name__}"
    elif isinstance(one, np.ndarray):
        if (one.dtype, one.shape) != (other.dtype, other.shape):
            yield f"{where}: other kinds or shapes"
        elif one.dtype.kind == "f":
            if one.tobytes() != other.tobytes():
                yield f"{where}: other bits"
        elif repr(one.tolist()) != repr(other.tolist()):
            yield f"{where}: other numbers"
        if one.flags.writeable != other.flags.writeable:
            yield f"{where}: writeable {one.flags.writeable} and {other.flags.writeable}"
    elif isinstance(one, Mapping):
        if list(one) != list(other):
            yield f"{where}: other keys"
        else:
            for key in one:
                yield from differences(one[key], other[key], f"{where}[{key!r}]")
    elif isinstance(one, list | tuple):
        if len(one) != len(other):
            yield f"{where}: other lengths"
        for k, pair in enumerate(zip(one, other, strict=False)):
            yield from differences(*pair, f"{where}[{k}]")
    elif isinstance(one, float):
        if one.hex() != other.hex():
            yield f"{where}: {one!r} and {other!r}"
    elif isinstance(one, hp.study.SweepStudy):  # made again from its text
        yield from differences((one.text, one.digest), (other.text, other.digest), where)
    elif isinstance(one, hp.study.SweepResult):
        if not one.dataset.identical(other.dataset) or one.path != other.path:
            yield f"{where}: other results"
    elif type(one).__module__.startswith("hexapod_pin") and hasattr(one, "__dict__"):
        yield from differences(_content(one), _content(other), f"{where}.{type(one).__name__}")
    elif not (one == other or (isinstance(one, FunctionType) and one is other)):
        yield f"{where}: {one!r} and {other!r}"


MADE_READY = ("_ready", "_motions")
"""What controllers keep of the runs that they have been in."""


def _content(record: Any) -> dict[str, Any]:
    """The attributes of a record but those that follow from others."""
    return {
        name: value
        for name, value in sorted(vars(record).items())
        if not isinstance(getattr(type(record), name, None), cached_property)
        and name not in MADE_READY
    }


ERROR_TYPE = re.compile(r"^class \w+\(.*(?:Error|Interrupted)\):", re.MULTILINE)
"""What a module has that defines a type of error."""


@cache
def error_types() -> list[type[HexapodError]]:
    """Every type of error of the package, whichever module it stands in."""
    package = Path(hp.__file__).parent
    for path in sorted(package.rglob("*.py")):
        if ERROR_TYPE.search(path.read_text("utf-8")):
            place = path.relative_to(package.parent).with_suffix("")
            importlib.import_module(".".join(place.parts))
    found, fresh = {HexapodError}, [HexapodError]
    while fresh:
        fresh = [kind for one in fresh for kind in one.__subclasses__() if kind not in found]
        found.update(fresh)
    return sorted(
        (kind for kind in found if kind.__module__.startswith("hexapod_pin")),
        key=lambda kind: kind.__name__,
    )


GIVEN: dict[str, Any] = {
    "faults": [CatalogFault(3, "mass", -1.0, "positive")],
    "cause": ValueError("from a controller"),
    "known": ["one", "other"], "findings": ["first", "second"], "record": ["motion"],
    "results": [None, 1.5], "trace": "a trace", "result": "a result", "comparison": "a comparison",
    "value": (1.5, float("nan"), np.arange(3.0)),
}  # fmt: skip
"""Arguments of errors by their names."""


def _argument(parameter: inspect.Parameter) -> Any:
    """Something that an error takes for an argument."""
    kind = str(parameter.annotation)
    if kind.startswith("float"):
        return 1.25
    if kind.startswith("int"):
        return 7
    if kind.startswith("str") or parameter.name not in GIVEN:
        return f"the {parameter.name}"
    return GIVEN[parameter.name]


def one_of(kind: type[HexapodError]) -> HexapodError:
    """An error of a type, with an attribute and a note of its own."""
    if not isinstance(kind.__init__, FunctionType):  # Python's own: any arguments
        error = kind("what, where, and what to do")
    else:
        parameters = list(inspect.signature(kind.__init__).parameters.values())[1:]
        named = [one for one in parameters if one.kind is not one.VAR_POSITIONAL]
        error = kind(**{one.name: _argument(one) for one in named})
    error.trace = getattr(error, "trace", None) or "samples until then"
    if hasattr(error, "add_note"):
        error.add_note("while a user's pool ran it")
    return error
