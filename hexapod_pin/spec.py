"""Frozen, validated parameter sets that know their TOML form."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from hexapod_pin.arguments import explain_methods
from hexapod_pin.errors import ParameterError

LARGEST_NUMBER = 1e30
"""In SI units: powers and products of larger ones leave double precision."""


class Spec(BaseModel):
    """Base of all parameter sets: frozen, no unknown fields, finite numbers, our own error type.

    Raises:
        ParameterError: on construction, naming the field, the value and the allowed range.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __init__(self, /, **fields: Any) -> None:
        """Validate `fields`."""
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise parameter_error(type(self).__name__, error) from error

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        """Let public methods name an argument of a wrong kind when they fail."""
        explain_methods(cls)

    @model_validator(mode="before")
    @classmethod
    def _of_a_size(cls, fields: Any) -> Any:
        """Refuse numbers beyond LARGEST_NUMBER."""
        if isinstance(fields, Mapping):
            for name, value in fields.items():
                _require_size(f"{cls.__name__}.{name}", value)
        return fields

    def __str__(self) -> str:
        """Return the call that builds this parameter set."""
        return repr(self)


def _require_size(name: str, value: Any) -> None:
    """Refuse a number, or one in a row of them, that is finite and beyond LARGEST_NUMBER."""
    if isinstance(value, list | tuple):
        for index, one in enumerate(value):
            _require_size(f"{name}.{index}", one)
    elif isinstance(value, float | int) and LARGEST_NUMBER < abs(value) < math.inf:
        raise ParameterError(name, value, f"at most {LARGEST_NUMBER:g} in size")


def parameter_error(owner: str, error: ValidationError) -> ParameterError:
    """Turn pydantic's first finding into this package's error."""
    first = error.errors()[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, ParameterError):
        return cause
    where = ".".join([owner, *(str(part) for part in first["loc"])])
    allowed = first["msg"][0].lower() + first["msg"][1:]
    for prefix in ("input should be ", "value error, "):
        allowed = allowed.removeprefix(prefix)
    if first["type"] == "extra_forbidden":
        allowed = "left out: there is no such parameter"
    if first["type"] == "missing":
        return ParameterError(where, None, "given: it has no default")
    return ParameterError(where, first["input"], allowed)


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
