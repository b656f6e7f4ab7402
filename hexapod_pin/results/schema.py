"""A number is declared once: as a line in the class of the record that holds it.

The line gives the axes, the unit, the meaning and the allowed range. The shapes that a record
requires, the columns of its files and tables, the checks of what is read, its rows of doubles and
its documentation are derived from these lines.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import Field, dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from hexapod_pin.arrays import Array, read_only, same_bits
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.file_schema import LARGEST, ArrayRule
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import Column, without_non_finite

if TYPE_CHECKING:
    import xarray
    from typing_extensions import dataclass_transform

else:

    def dataclass_transform(**_: Any) -> Any:
        """Return a decorator that does nothing: only type checkers use the real one."""
        return lambda kind: kind


Item = TypeVar("Item")


@dataclass(frozen=True)
class Quantity(ArrayRule):
    """What a record declares of one of its numbers, besides the rule that its values obey.

    Attributes:
        nan: whether NaN may stand for what is not known.
        meaning: one phrase.
        error: whether the difference of two runs of different resolution is an error of it.
    """

    nan: bool = True
    meaning: str = ""
    error: bool = True

    @property
    def by_kind(self) -> str:
        """How values of the joints of one kind are combined: "sum", "largest"; "" if not at all.

        Energies are added; the largest of times and of angles has no meaning.
        """
        return {"J": "sum", "s": "", "rad": ""}.get(self.unit, "largest")

    @property
    def about(self) -> dict[str, str]:
        """The attributes of its column in a file."""
        return {"units": self.unit, "long_name": self.meaning}


def quantity(axes: str, unit: str, meaning: str, **rule: Any) -> Any:
    """Declare a number as a field of a `Record`.

    Args:
        axes: the names of its axes, separated by spaces; "" for a single number.
        unit: in SI; several, separated by commas, where the last axis has several.
        meaning: one phrase.
        rule: further attributes of `Quantity`, and `default` or `default_factory` of a field.

    Raises:
        ValueError: the field has the name of one of several axes: netCDF would take the variable
            for the labels of that axis. It is raised when the class is made.
    """
    own = {key: rule.pop(key) for key in ("default", "default_factory") if key in rule}
    declared = Quantity(tuple(axes.split()), unit, **rule, meaning=meaning)
    return field(metadata={"quantity": declared}, repr=not axes, **own)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(quantity, field))
class Record(Immutable):
    """Base of results: a frozen dataclass whose numbers are declared by `quantity`.

    Arrays are read-only. Two records are equal when every bit is.

    Raises:
        ParameterError: on construction, where an array has another shape than its axes.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {}
    """The labels of each axis, or the name of the field that holds them."""

    SCHEMA: ClassVar[Mapping[str, Quantity]] = {}
    """The quantities by name, in the order of the fields; see `schema`."""

    __hash__: ClassVar[None]  # type: ignore[assignment]  # equal by content, and contents are large

    def __init_subclass__(cls, **options: Any) -> None:
        """Make a frozen dataclass, and document its quantities."""
        super().__init_subclass__(**options)
        dataclass(frozen=True, eq=False)(cls)
        cls.__hash__ = None
        declared = (one for one in _fields(cls) if "quantity" in one.metadata)
        cls.SCHEMA = {one.name: one.metadata["quantity"] for one in declared}
        for name, one in schema(cls).items():
            if name in one.axes and len(one.axes) > 1:
                raise ValueError(f"{cls.__name__}.{name} has the name of one of its axes")
        cls.__doc__ = _documented(cls)

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        for labels in self.AXES.values():
            if isinstance(labels, str) and isinstance(vars(self).get(labels), list):
                object.__setattr__(self, labels, tuple(getattr(self, labels)))
        sizes = self.sizes()
        for name, one in schema(type(self)).items():
            if one.axes and name in vars(self):
                self._freeze(name, one, sizes)

    def _freeze(self, name: str, one: Quantity, sizes: Mapping[str, int]) -> None:
        array = read_only(getattr(self, name))
        if not _fits(array.shape, one.axes, sizes):
            expected = ", ".join(str(sizes.get(axis, axis)) for axis in one.axes)
            allowed = f"of shape ({expected}), of {', '.join(one.axes)}"
            raise ParameterError(f"{type(self).__name__}.{name}", array.shape, allowed)
        object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        """Tell whether all fields are the same, numbers to the bit."""
        if type(other) is not type(self):
            return False
        return all(
            same_bits(vars(self).get(one.name), vars(other).get(one.name))
            for one in _fields(type(self))
        )

    def sizes(self) -> dict[str, int]:
        """Return the length of every axis that has labels."""
        return {axis: len(labels) for axis, labels in self.labels().items()}

    def labels(self) -> dict[str, Any]:
        """Return the labels of every axis: texts, or numbers where the axis is a quantity."""
        return {
            axis: getattr(self, labels) if isinstance(labels, str) else labels
            for axis, labels in self.AXES.items()
        }

    def columns(self) -> dict[str, Column]:
        """Return the labels of the axes and all quantities as columns of a file."""
        known = schema(type(self))
        found = {
            axis: Column((axis,), np.array(labels, dtype=object), {})
            for axis, labels in self.labels().items()
            if axis not in known
        }
        for name, one in known.items():
            if name in vars(self):
                found[name] = Column(one.axes, np.asarray(getattr(self, name)), one.about)
        return found

    def to_dataset(self) -> xarray.Dataset:
        """Return an xarray.Dataset with named axes and units."""
        import xarray

        columns = {k: (c.dims, c.values, dict(c.attributes)) for k, c in self.columns().items()}
        labels = {axis: columns.pop(axis) for axis in self.labels()}
        return xarray.Dataset(columns, coords=labels)


def _fields(kind: Any) -> tuple[Field[Any], ...]:
    """Return the fields of a class of records, which type checkers do not take for a dataclass."""
    return fields(kind)


def schema(kind: type[Record]) -> Mapping[str, Quantity]:
    """Return the quantities of a class of records by name, in the order of its fields."""
    return kind.SCHEMA


def known_quantity(kind: type[Record], name: str) -> Quantity:
    """Return a quantity of a class of records.

    Raises:
        UnknownNameError: there is no such quantity.
    """
    return named("quantity", name, schema(kind))


def named(kind: str, name: str, known: Mapping[str, Item]) -> Item:
    """Return what has a name; `kind` is for the message.

    Raises:
        UnknownNameError: there is none of that name.
    """
    require_known(kind, name, known)
    return known[name]


def require_known(kind: str, name: str, known: Collection[str]) -> None:
    """Refuse a name that is not among the known ones; `kind` is for the message.

    Raises:
        UnknownNameError: it is not.
    """
    if name not in known:
        raise UnknownNameError(kind, name, list(known))


def _fits(shape: tuple[int, ...], axes: tuple[str, ...], sizes: Mapping[str, int]) -> bool:
    """Tell whether a shape is that of some axes; one without labels may have any length."""
    if shape == tuple(map(sizes.get, axes)):
        return True
    expected = (sizes.get(axis) for axis in axes)
    return len(shape) == len(axes) and all(
        size in (None, own) for size, own in zip(expected, shape, strict=True)
    )


def _documented(kind: type[Record]) -> str:
    """Return the docstring of a class with a line for each quantity under "Attributes"."""
    text = (kind.__doc__ or "").rstrip()
    lines = [f"        {name}: {line}" for name, line in document(kind).items()]
    if not lines or not text:
        return text
    head, found, rest = text.partition("    Attributes:\n")
    if not found:
        return "\n".join([f"{text}\n\n    Attributes:", *lines, "    "])
    own, blank, more = rest.partition("\n\n")  # such as "Raises"
    return "\n".join([f"{head}{found}{own.rstrip()}", *lines]) + blank + (more or "\n    ")


def document(kind: type[Record]) -> dict[str, str]:
    """Return what each quantity of a class means, with shape and unit."""
    found = {}
    for name, one in schema(kind).items():
        shape = f" ({', '.join(one.axes)}{',' * (len(one.axes) == 1)})" if one.axes else ""
        found[name] = f"{one.meaning}{shape} [{one.unit}]."
    return found


# Records as plain data: for JSON, and as rows of doubles.


def plain(record: Record) -> dict[str, Any]:
    """Return all quantities as nested lists of numbers, with None in place of NaN."""
    return {name: without_non_finite(getattr(record, name)) for name in schema(type(record))}


def from_plain(
    kind: type[Record],
    data: Mapping[str, Any],
    sizes: Mapping[str, int],
    *,
    where: str = "",
    errors: bool = False,
) -> dict[str, Any]:
    """Return the quantities that plain data holds, as numbers and arrays; None is NaN.

    Args:
        kind: the class of records.
        data: nested lists by name, as `plain` gives them, or arrays. None is a quantity that is
            not known; one that has an axis of any length is required.
        sizes: lengths of the axes.
        where: name of the data, for messages.
        errors: whether these are errors of the quantities: only those given, none negative.

    Raises:
        ParameterError: a value is no number, out of its range, or there are too many or too few.
    """
    found: dict[str, Any] = {}
    known = schema(kind)
    for name, one in {k: known[k] for k in known if k in data}.items() if errors else known.items():
        value, place = data.get(name), f"{where}.{name}" if where else name
        if name not in data or (value is None and not sizes.keys() >= {*one.axes}):
            raise ParameterError(place, None, "there: it is missing")
        if value is None:
            shape = tuple(sizes[axis] for axis in one.axes)
            found[name] = np.full(shape, np.nan) if shape else math.nan
            continue
        rule = Quantity(one.axes, one.unit, least=0.0, nan=True) if errors else one
        array = _array(place, value, rule, sizes)
        found[name] = array if one.axes else float(array)
    return found


def _array(where: str, value: Any, rule: Quantity, sizes: Mapping[str, int]) -> Array:
    """Return a nested list as an array, every number checked."""
    if isinstance(value, np.ndarray):
        return np.array(value, dtype=float).reshape([sizes.get(axis, -1) for axis in rule.axes])
    shape = _require_numbers(where, value, rule.axes, rule, sizes)
    array: Array = np.array(value, dtype=float).reshape(shape)
    if rule.ascending and (np.diff(array[:, 0] if array.ndim > 1 else array) < 0.0).any():
        raise ParameterError(where, "numbers that fall", "ascending")
    return array


def _require_numbers(
    where: str, value: Any, axes: tuple[str, ...], rule: Quantity, sizes: Mapping[str, int]
) -> tuple[int, ...]:
    """Return the shape of nested lists of numbers, refusing what is none."""
    if not axes:
        _require_number(where, value, rule)
        return ()
    size = sizes.get(axes[0])
    if not isinstance(value, list) or size not in (None, len(value)):
        raise ParameterError(where, value, f"{'' if size is None else f'{size} '}values in a list, "
                             f"one per {axes[0]}")  # fmt: skip
    for k, one in enumerate(value):
        _require_numbers(f"{where}[{k}]", one, axes[1:], rule, sizes)
    return (len(value), *(sizes[axis] for axis in axes[1:]))


def _require_number(where: str, value: Any, rule: Quantity) -> None:
    if rule.nan and (value is None or value != value):  # noqa: PLR0124  # NaN
        return
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ParameterError(where, value, "a number")
    least = -LARGEST if rule.least is None else rule.least
    most = LARGEST if rule.most is None else rule.most
    if not least <= value <= most:
        raise ParameterError(where, value, f"from {least:g} to {most:g} [{rule.unit}]")


def pack(record: Record) -> Array:
    """Return all quantities in one row of doubles, those with an axis of any length last."""
    sizes = record.sizes()
    return np.concatenate([
        np.ravel(np.asarray(getattr(record, name), dtype=float))
        for name in _packed(type(record), sizes)
    ])  # fmt: skip


def unpack(kind: type[Record], row: Array, sizes: Mapping[str, int]) -> dict[str, Any]:
    """Return the quantities of a row that `pack` made.

    Raises:
        ParameterError: the row has another length.
    """
    found: dict[str, Any] = {}
    place = 0
    for name in _packed(kind, sizes):
        one = schema(kind)[name]
        shape = tuple(sizes.get(axis, -1) for axis in one.axes)
        count = len(row) - place if -1 in shape else math.prod(shape)
        if len(row) < place + count or (-1 in shape and count % math.prod(shape)):
            raise ParameterError("row", len(row), f"as many numbers as a {kind.__name__} has")
        values = row[place : place + count].reshape(shape)
        found[name], place = values if one.axes else float(values), place + count
    if place != len(row):
        raise ParameterError("row", len(row), f"{place} numbers, as a {kind.__name__} has")
    return found


def _packed(kind: type[Record], sizes: Mapping[str, int]) -> list[str]:
    """Return the names of quantities in the order of a row."""
    known = schema(kind)
    return sorted(known, key=lambda name: not all(axis in sizes for axis in known[name].axes))


def differences(
    kind: type[Record], numbers: Mapping[str, Any], others: Mapping[str, Any], error_fraction: float
) -> dict[str, Any]:
    """Return the error of each quantity from a companion run of another resolution, in its unit.

    Of quantities with a sign, that of their size. Times of peaks have none: of two peaks of the
    same height either may be found.

    Args:
        kind: the class of records.
        numbers: the quantities of a run by name; None where one is not known.
        others: those of the companion.
        error_fraction: largest error over the difference of the two [-].
    """
    found: dict[str, Any] = {}
    for name, one in schema(kind).items():
        value, other = numbers.get(name), others.get(name)
        if not one.error or value is None or other is None or np.shape(value) != np.shape(other):
            continue
        found[name] = error_fraction * abs(abs(value) - abs(other))
    return found
