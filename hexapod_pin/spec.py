"""Frozen, validated parameter sets that know their TOML form."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from hexapod_pin.arguments import check_fields, check_members
from hexapod_pin.errors import ParameterError
from hexapod_pin.meant import meant_by
from hexapod_pin.type_checks import PARAMETERS

if TYPE_CHECKING:
    from typing import Self


class Spec(BaseModel):
    """Base of all parameter sets: frozen, no unknown fields, finite numbers, our own error type.

    Raises:
        ParameterError: on construction, naming the field, the value and the allowed range.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    def __init__(self, /, **fields: Any) -> None:
        """Validate `fields`."""
        check_fields(type(self), fields, PARAMETERS)
        with plain_errors(type(self).__name__, fields, tuple(type(self).model_fields)):
            super().__init__(**fields)

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        """Check the arguments of public methods."""
        check_members(cls)

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """Return the parameter set that plain data describe; the options are pydantic's."""
        table = isinstance(obj, Mapping) and all(isinstance(key, str) for key in obj)
        if not table and not isinstance(obj, cls):
            raise ParameterError(cls.__name__, obj, f"a {cls.__name__}, or a mapping of its fields")
        with plain_errors(cls.__name__, obj, tuple(cls.model_fields)):
            return super().model_validate(obj, **options)

    def __str__(self) -> str:
        """Return the call that builds this parameter set."""
        return repr(self)


@contextmanager
def plain_errors(owner: str, data: Any, known: Sequence[str] = ()) -> Iterator[None]:
    """Raise pydantic's refusals of data as errors of this package.

    Args:
        owner: name of what is made.
        data: of which it is made.
        known: names of its fields.
    """
    try:
        yield
    except ValidationError as error:
        raise parameter_error(owner, error, data, known) from error


_TYPES = {
    "float": "a float", "int": "an int", "bool": "a bool", "string": "a str",
    "tuple": "a sequence", "list": "a sequence", "dict": "a mapping",
}  # fmt: skip
"""What pydantic's errors about a type are called here, by the first part of their name."""


def parameter_error(
    owner: str, error: ValidationError, data: Any, known: Sequence[str] = ()
) -> ParameterError:
    """Turn pydantic's finding that is deepest within the data into this package's error.

    Args:
        owner: name of what was to be made.
        error: pydantic's.
        data: of which it was to be made.
        known: names of the fields of what was to be made.
    """
    places = [(_place(one["loc"], data, one["type"]), one) for one in error.errors()]
    place, found = max(places, key=lambda pair: len(pair[0]))
    cause = found.get("ctx", {}).get("error")
    if isinstance(cause, ParameterError):
        return cause
    where = owner + "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in place)
    if found["type"] == "extra_forbidden":
        meant = meant_by(str(place[-1]), known) if len(place) == 1 else None
        hint = "" if meant is None else f"{meant} was probably meant."
        return ParameterError(where, found["input"], "left out: there is no such parameter", hint)
    if found["type"] == "missing":
        return ParameterError(where, None, "given: it has no default")
    allowed = found["msg"][0].lower() + found["msg"][1:]
    for prefix in ("input should be ", "value error, "):
        allowed = allowed.removeprefix(prefix)
    kind, _, rest = found["type"].partition("_")
    if rest in ("type", "parsing", "from_float"):
        allowed = _TYPES.get(kind, allowed)
    return ParameterError(where, found["input"], allowed)


def _place(steps: tuple[int | str, ...], data: Any, kind: str) -> list[int | str]:
    """Return the steps into data without those that pydantic makes among the members of a union."""
    place: list[int | str] = []
    for number, step in enumerate(steps, 1):
        absent = number == len(steps) and kind in ("missing", "extra_forbidden")
        if isinstance(step, int):
            data = data[step] if isinstance(data, Sequence) and step < len(data) else None
        elif isinstance(data, Mapping) and step in data:
            data = data[step]
        elif not absent:
            continue
        place.append(step)
    return place


def _within_turns(value: float) -> float:
    """Return an angle of at most one turn either way.

    Raises:
        ValueError: it is larger.
    """
    if abs(value) > LARGEST_ANGLE:
        radians = f"; {value:g} degrees are {math.radians(value):.4g} rad"
        raise ValueError(f"from -2 pi to 2 pi rad{radians}")
    return value


LARGEST_ANGLE = 2.0 * math.pi + 1e-9
"""Of a heading, and of what a robot turns by in a second: a larger one is in degrees [rad]."""


def degrees_meant(angle: float, low: float, high: float) -> str:
    """Return as a hint that an angle [rad] was meant in degrees; empty where it may not be.

    Args:
        angle: beyond a range [rad].
        low: least angle of the range [rad].
        high: largest; in degrees it is within the range.
    """
    meant = math.radians(angle)
    if not (abs(angle) > LARGEST_ANGLE and low <= meant <= high):
        return ""
    return f"Degrees? {angle:g} degrees are {meant:.4g} rad."


Radians = Annotated[float, AfterValidator(_within_turns)]
"""An angle [rad], or an angle in a second [rad/s]; one beyond a turn was meant in degrees."""


def _in_metres(value: float) -> float:
    """Return a length that a walking robot may have, or step over.

    Raises:
        ValueError: it is larger.
    """
    if abs(value) > LARGEST_LENGTH:
        raise ValueError(f"at most {LARGEST_LENGTH:g} m; mm? {value:g} mm are {1e-3 * value:.4g} m")
    return value


LARGEST_LENGTH = 10.0
"""Of a stroke, a lift, a step or a link [m]: three times a leg of 3 m, longer than any that walks.
A larger number is in millimetres."""

Metres = Annotated[float, AfterValidator(_in_metres)]
"""A length of the size of legs [m]; one beyond `LARGEST_LENGTH` was meant in millimetres."""


def _in_kilograms(value: float) -> float:
    """Return a mass that a walking robot may have, or carry.

    Raises:
        ValueError: it is larger.
    """
    if value > LARGEST_MASS:
        raise ValueError(
            f"at most {LARGEST_MASS:g} kg; grams? {value:g} g are {1e-3 * value:.4g} kg"
        )
    return value


LARGEST_MASS = 2000.0
"""Of a robot, a part of it or its payload [kg]: four times a hexapod of 500 kg, among the heaviest
that walk. A larger number is in grams."""

Kilograms = Annotated[float, AfterValidator(_in_kilograms)]
"""A mass [kg]; one beyond `LARGEST_MASS` was meant in grams."""


def require_factor(factor: float, name: str = "factor") -> float:
    """Return a factor on a parameter.

    Raises:
        ParameterError: it is not positive and finite.
    """
    if not (math.isfinite(factor) and factor > 0.0):
        raise ParameterError(name, factor, "positive and finite")
    return float(factor)


@lru_cache(maxsize=64)
def parsed_toml(text: str) -> Mapping[str, Any]:
    """Parse TOML text that is asked for many times; what is returned must not be changed.

    Raises:
        ParameterError: bad syntax.
    """
    return MappingProxyType(read_toml(text))


MOST_KEY_PARTS = 100
"""Parts of a dotted key: the time that one takes grows with their square, 40 s for 50 000."""

_STRING = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*"""|"(?:[^"\\\n]|\\.)*"'
    r"|'''(?:[^']|'(?!''))*'''|'[^'\n]*'|#[^\n]*",
    re.DOTALL,
)
"""A string or a comment of a TOML text."""

_NO_KEY = re.compile(r"[^\w\-. \t]+")
"""What ends a dotted key whose quoted parts are taken out."""


def read_toml(text: str, *, required: tuple[str, ...] = ()) -> dict[str, Any]:
    """Parse TOML text and require top-level keys.

    Raises:
        ParameterError: an unpaired surrogate, which no file can hold, bad syntax, a key of more
            than `MOST_KEY_PARTS` parts, or a missing key.
    """
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib

    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ParameterError("TOML text", text[:40], f"UTF-8 ({error})") from error
    parts = max(piece.count(".") for piece in _NO_KEY.split(_STRING.sub("", text))) + 1
    if parts > MOST_KEY_PARTS:
        allowed = (
            f"without keys of more than {MOST_KEY_PARTS} parts, such as a.b.c; one has {parts}"
        )
        raise ParameterError("TOML text", text[:40], allowed)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # of its syntax, or of a number without end
        raise ParameterError("TOML text", text[:40], f"valid TOML ({error})") from error
    for key in required:
        if key not in data:
            raise ParameterError(key, None, "present in the TOML text")
    return data
