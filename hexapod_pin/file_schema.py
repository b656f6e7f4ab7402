"""Schemas of files: rules as data, and one check of arrays and of JSON or TOML data against them.

What a file holds is checked when it is read; what breaks a rule is named with its place in the
file, its value and what is allowed there.
"""

from __future__ import annotations

import json
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, ValidationInfo

from hexapod_pin.arguments import check_fields, check_members
from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import parameter_error, plain_errors
from hexapod_pin.type_checks import FACTS

LARGEST = 1e150
"""Largest size of a number in a file: its square is still a number."""

UNIT_TOLERANCE = 1e-6
"""How far the length of a unit vector or quaternion may be off."""

MISSING = "there: it is missing"

LONGEST_NAME = 500
"""Characters of a name."""

Arrays = Mapping[str, npt.NDArray[Any]]

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 60
_short.maxlist = _short.maxtuple = _short.maxdict = 4


@dataclass(frozen=True)
class ArrayRule:
    """What an array of doubles must be.

    Attributes:
        axes: names of its axes; arrays with an axis in common have its length in common.
        unit: for messages.
        least: smallest value; None: none.
        most: largest value; None: `LARGEST`.
        nan: whether NaN may stand for what is not known.
        ascending: whether each value along the first axis must be greater than the one before;
            "weakly": not smaller.
        unit_vector: columns of the last axis that have length 1 together; None: none.
    """

    axes: tuple[str, ...]
    unit: str = ""
    least: float | None = None
    most: float | None = None
    nan: bool = False
    ascending: bool | str = False
    unit_vector: tuple[int, int] | None = None


def check_arrays(arrays: Arrays, rules: Mapping[str, ArrayRule], sizes: Mapping[str, int]) -> None:
    """Check the arrays that a file must hold.

    Args:
        arrays: of the file.
        rules: by the names of the arrays.
        sizes: lengths of the axes.

    Raises:
        ParameterError: an array is missing or breaks its rule.
    """
    for name, rule in rules.items():
        if name not in arrays:
            raise ParameterError(f"variable {name!r}", None, MISSING)
        shape = tuple(sizes[axis] for axis in rule.axes)
        _check_array(name, arrays[name], rule, shape)


def _check_array(
    name: str, array: npt.NDArray[Any], rule: ArrayRule, shape: tuple[int, ...]
) -> None:
    if array.dtype.kind != "f" or array.dtype.itemsize != np.dtype(float).itemsize:
        raise ParameterError(f"{name}.dtype", str(array.dtype), "float64")
    if array.shape != shape:
        raise ParameterError(f"{name}.shape", array.shape, f"{shape}, of {', '.join(rule.axes)}")
    unit = f" [{rule.unit}]" if rule.unit else ""
    if not _surely_plain(array):
        known = np.abs(array) <= LARGEST
        if rule.nan:
            known |= np.isnan(array)
        _require(name, array, known, f"a number of at most {LARGEST:g}{unit}")
    if rule.least is not None:
        fits = ~(array < rule.least)
        _require(name, array, fits, f"at least {rule.least:g}{unit}")
    if rule.most is not None:
        _require(name, array, ~(array > rule.most), f"at most {rule.most:g}{unit}")
    if rule.ascending and len(array) > 1:
        step = np.diff(array, axis=0)
        rises = step >= 0.0 if rule.ascending == "weakly" else step > 0.0
        word = "not smaller" if rule.ascending == "weakly" else "greater"
        _require(name, array[1:], rises, f"{word} than the one before{unit}", first=1)
    if rule.unit_vector is not None:
        begin, end = rule.unit_vector
        part = array[..., begin:end]
        off = np.abs(np.einsum("...i,...i->...", part, part) - 1.0)
        _require(name, part, off <= 2.0 * UNIT_TOLERANCE, "of length 1")


def _surely_plain(array: npt.NDArray[Any]) -> bool:
    """Tell whether all numbers are finite and their squares too, as far as one pass can say."""
    flat = array.reshape(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.einsum("i,i->", flat, flat) <= LARGEST)  # no threads, unlike `dot`


def _require(
    name: str, array: npt.NDArray[Any], fits: npt.NDArray[np.bool_], allowed: str, first: int = 0
) -> None:
    """Raise for the first place where a rule is broken."""
    if fits.all():
        return
    place = np.argwhere(~fits)[0]
    value = array[tuple(place)]
    shown = [int(place[0]) + first, *(int(k) for k in place[1:])] if len(place) else []
    where = f"{name}[{', '.join(map(str, shown))}]" if shown else name
    raise ParameterError(where, value.tolist(), allowed)


def check_names(
    name: str, array: npt.NDArray[Any] | None, *, repeated: bool = False
) -> tuple[str, ...]:
    """Return the names of an axis: texts that can be printed, each there once unless `repeated`.

    Raises:
        ParameterError: they are missing, or no such names.
    """
    if array is None:
        raise ParameterError(f"variable {name!r}", None, MISSING)
    if array.ndim != 1 or array.dtype.kind != "O":
        raise ParameterError(name, f"{array.dtype} of shape {array.shape}", "a list of names")
    found: list[str] = array.tolist()
    for k, text in enumerate(found):
        if not is_name(text):
            raise ParameterError(f"{name}[{k}]", _short.repr(text), "a name that can be printed")
    if len(set(found)) < len(found) and not repeated:
        twice = next(text for text in found if found.count(text) > 1)
        raise ParameterError(name, twice, "there once")
    return tuple(found)


def is_name(text: Any) -> bool:
    """Tell whether something is a text that can stand in a table."""
    return isinstance(text, str) and 0 < len(text) <= LONGEST_NAME and text.isprintable()


def text_of(name: str, array: npt.NDArray[Any] | None) -> str:
    """Return the text that a variable of a file holds.

    Raises:
        ParameterError: it is missing, or no text.
    """
    if array is None:
        raise ParameterError(f"variable {name!r}", None, MISSING)
    text = array.item() if array.size == 1 else None
    if not isinstance(text, str | bytes):
        raise ParameterError(name, f"{array.dtype} of shape {array.shape}", "a text")
    return text if isinstance(text, str) else text.decode("utf-8", "replace")


def json_object(name: str, array: npt.NDArray[Any] | None) -> dict[str, Any]:
    """Return the JSON object that a variable of a file holds as text.

    Raises:
        ParameterError: it is missing, no JSON, or no object.
    """
    text = text_of(name, array)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ParameterError(name, _short.repr(text), f"JSON ({error})") from error
    if not isinstance(found, dict):
        raise ParameterError(name, _short.repr(found), "a JSON object")
    return found


class _Shown(str):
    """A value as it is shown, shortened."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class FileData(BaseModel):
    """Base of what a file's JSON or TOML parts must be; what is not named may be anything."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, defer_build=True)

    def __init__(self, /, **fields: Any) -> None:
        """Validate `fields`.

        Raises:
            ParameterError: one is of a wrong type or breaks a rule.
        """
        try:
            super().__init__(**fields)
        except ValidationError as error:
            check_fields(type(self), fields, FACTS)  # names the place where a type is wrong
            with plain_errors(type(self).__name__, fields):
                raise error

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        """Check the arguments of public methods."""
        check_members(cls)

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # parts keep the context


Checked = TypeVar("Checked", bound=FileData)


def check_data(model: type[Checked], name: str, data: Any, **sizes: int) -> Checked:
    """Check data against a model, and return it as one.

    Args:
        model: what it must be.
        name: of the data, for messages.
        data: plain data, as JSON or TOML gives it.
        sizes: lengths of axes that lists in it have.

    Raises:
        ParameterError: it breaks a rule; names the place.
    """
    try:
        return model.model_validate(data, context=sizes)
    except ValidationError as error:
        found = parameter_error(name, error, data)
        raise ParameterError(
            found.name, _Shown(_short.repr(found.value)), found.allowed, found.hint
        ) from None
    except (RecursionError, OverflowError) as error:
        raise ParameterError(name, type(data).__name__, f"plain data ({error})") from error


def per(axis: str) -> AfterValidator:
    """Return the rule that a list has the length of an axis, where that is known."""

    def check(values: Any, info: ValidationInfo) -> Any:
        size = (info.context or {}).get(axis)
        if values is not None and size is not None and len(values) != size:
            raise ValueError(f"{size} values, one per {axis}")
        return values

    return AfterValidator(check)


def _small(value: float) -> float:
    if not abs(value) <= LARGEST:
        raise ValueError(f"a number of at most {LARGEST:g}")
    return value


def _name(text: str) -> str:
    if not is_name(text):
        raise ValueError("a name that can be printed")
    return text


Number = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_small)]
"""A number as in files."""

NotNegative = Annotated[Number, Field(ge=0.0)]
Positive = Annotated[Number, Field(gt=0.0)]
Bound = Annotated[float, Field(ge=0.0)]
"""Not negative; may be infinite."""

Name = Annotated[str, AfterValidator(_name)]


def unit_quaternion(values: Sequence[float]) -> bool:
    """Tell whether four numbers are of length 1."""
    return abs(sum(x * x for x in values) - 1.0) <= 2.0 * UNIT_TOLERANCE
