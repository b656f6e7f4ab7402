"""What a type annotation asks of a value.

Names in an annotation are resolved here, also those imported for type checkers alone.
"""

from __future__ import annotations

import builtins
import functools
import math
import numbers
import os
import sys
import types
import typing
from collections import abc
from collections.abc import Callable, Mapping
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing

LARGEST_INT = 2**63
"""No larger int is a number of the machine."""

LARGEST_NUMBER = 1e30
"""In SI units: powers and products of larger parameters leave double precision."""

Unbounded = Annotated[float, "may be infinite"]
"""A float that may be infinite, in the annotations of functions."""

Check = Callable[[Any], None]
"""Raises a `WrongTypeError` of a value that will not do."""


class WrongTypeError(Exception):
    """A value is not of the type that is required."""

    def __init__(self, value: Any, allowed: str, where: str = "") -> None:
        """Keep the value, what it must be, and its place inside the argument."""
        self.value, self.allowed, self.where = value, allowed, where
        super().__init__(allowed)


class Rule(NamedTuple):
    """What is asked of values besides their types.

    Attributes:
        finite: whether numbers must be finite.
        largest: size of a float that is finite.
        tables: whether a mapping may stand for a parameter set.
        scalars: whether a number may stand for an array.
    """

    finite: bool
    largest: float = math.inf
    tables: bool = False
    scalars: bool = True


CALL, RECORD = Rule(finite=True), Rule(finite=False, scalars=False)
PARAMETERS = Rule(finite=False, largest=LARGEST_NUMBER, tables=True)
FACTS = Rule(finite=False, tables=True)


def check_of(kind: Any, rule: Rule) -> Check:
    """Return the check of a type."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        finite = rule.finite and parts[1] != "may be infinite"
        return check_of(parts[0], rule._replace(finite=finite))
    if kind is float:
        return functools.partial(_float, rule)
    if kind in _PLAIN:
        return _PLAIN[kind]
    if origin is typing.Literal:
        names = ", ".join(map(repr, parts))
        fits = lambda x: any(isinstance(x, type(one)) and x == one for one in parts)  # noqa: E731
        return _plain(f"one of {names}", fits)
    if origin in (typing.Union, types.UnionType):
        array_like = _array_like_parts()
        if array_like <= set(parts):
            others = [check_of(part, rule) for part in parts if part not in array_like]
            return any_of([*others, _PLAIN["array"]])
        paths = any(part is Path for part in parts)  # a str is one, too
        return any_of([check_of(part, rule) for part in parts if not (paths and part is str)])
    if origin is tuple and parts[1:] != (...,):
        return _row([check_of(part, rule) for part in parts])
    if origin in (tuple, list, set, frozenset, abc.Sequence, abc.Collection, abc.Set):
        return _each(check_of(parts[0], rule), _exact(parts[0], rule))
    if origin in (abc.Iterable, abc.Iterator):
        return _each(check_of(parts[0], rule), stored=False)
    if origin in (dict, abc.Mapping):
        return _values(check_of(parts[0], rule), check_of(parts[1], rule))
    kind = origin or kind
    if kind is abc.Callable:
        return _plain("callable", callable)
    if getattr(kind, "__name__", "") == "ndarray" and _of_numbers(parts):
        return _PLAIN["array"] if rule.scalars else _PLAIN["rows"]
    return _instance(kind, rule)


def _of_numbers(parts: tuple[Any, ...]) -> bool:
    """Tell whether the parameters of an array's type ask for numbers, or bools."""
    scalar = typing.get_args(parts[1])[0] if parts else Any
    return getattr(scalar, "__name__", "") in ("float64", "bool", "bool_", "int64", "intp")


@functools.cache
def _array_like_parts() -> set[Any]:
    """Return the types that NumPy's ArrayLike is a union of."""
    return set(typing.get_args(numpy.typing.ArrayLike))


def takes_arrays(kind: Any) -> tuple[bool, bool]:
    """Tell whether a type is that of an array, and whether of what makes one (`ArrayLike`)."""
    parts = typing.get_args(kind)
    union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    kinds = (typing.get_origin(one) or one for one in (parts if union else (kind,)))
    named = any(getattr(one, "__name__", "") == "ndarray" for one in kinds)
    return named, union and _array_like_parts() <= set(parts)


def _plain(allowed: str, fits: Callable[[Any], bool]) -> Check:
    def check(value: Any) -> None:
        if not fits(value):
            raise WrongTypeError(value, allowed)

    return check


def _instance(kind: Any, rule: Rule) -> Check:
    """Return the check of a class; of a protocol none: what is missing is reported where used."""
    if not isinstance(kind, type) or getattr(kind, "_is_protocol", False) or kind is _Unknown:
        return _PLAIN[Any]
    allowed = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    table = rule.tables and hasattr(kind, "model_fields")

    def check(value: Any) -> None:
        if isinstance(value, kind):
            return
        if not (table and isinstance(value, Mapping) and all(isinstance(k, str) for k in value)):
            raise WrongTypeError(value, allowed)

    return check


def _exact(kind: Any, rule: Rule) -> type | None:
    """Return the type all of whose own instances pass the check of a type; None where none does."""
    passes = kind in (str, int, bool) or (
        kind is float and not rule.finite and rule.largest == math.inf
    )
    return kind if passes else None


def _float(rule: Rule, value: Any) -> None:
    if type(value) is not float:
        whole = _is_int(value)
        if not whole and (
            not isinstance(value, numbers.Real) or isinstance(value, numbers.Rational)
        ):
            raise WrongTypeError(value, "a float")
        if whole and abs(int(value)) > LARGEST_INT:
            raise WrongTypeError(value, f"at most {LARGEST_INT:g} in size")
    if rule.finite and not math.isfinite(value):
        raise WrongTypeError(value, "finite")
    if rule.largest < abs(value) < math.inf:
        raise WrongTypeError(value, f"at most {rule.largest:g} in size")


def _is_int(value: Any) -> bool:
    return isinstance(value, numbers.Integral) and not isinstance(value, bool)


def _is_path(value: Any) -> bool:
    if not isinstance(value, str | os.PathLike):
        return False
    path = os.fspath(value)
    return isinstance(path, str) and "\0" not in path


def _is_array(value: Any) -> bool:
    """Tell whether something is an array of numbers, or makes one."""
    if type(value) is np.ndarray:
        return value.dtype.kind in "biuf"
    try:
        return np.asarray(value).dtype.kind in "biuf"
    except (TypeError, ValueError, OverflowError):
        return False


def _is_collection(value: Any) -> bool:
    """Tell whether a value has a length and items; an array without an axis has none."""
    return isinstance(value, abc.Collection) and getattr(value, "ndim", 1) > 0


_PLAIN: Mapping[Any, Check] = {
    Any: lambda x: None,
    None: _plain("None", lambda x: x is None),
    type(None): _plain("None", lambda x: x is None),
    int: _plain("an int", _is_int),
    bool: _plain("a bool", lambda x: type(x) is bool or type(x).__name__ in ("bool", "bool_")),
    str: _plain("a str", lambda x: isinstance(x, str)),
    Path: _plain("a path, without a null character", _is_path),
    os.PathLike: _plain("a path, without a null character", _is_path),
    "array": _plain("an array of numbers, all rows of one length", _is_array),
    "rows": _plain("an array of numbers", lambda x: _is_array(x) and _is_collection(x)),
}


ANYTHING, NOTHING = _PLAIN[Any], _PLAIN[None]


def any_of(checks: list[Check]) -> Check:
    """Return the check that a value passes one of several; the deepest refusal counts."""
    optional, others = NOTHING in checks, [one for one in checks if one is not NOTHING]

    def check(value: Any) -> None:
        if value is None and optional:
            return
        for one in others:
            try:
                return one(value)
            except WrongTypeError:
                continue  # all refusals are collected below
        refusals = [refusal for one in checks if (refusal := _refusal(one, value))]
        deepest = max(refusals, key=lambda error: len(error.where))
        if deepest.where:
            raise deepest
        allowed = list(dict.fromkeys(refusal.allowed for refusal in refusals))
        raise WrongTypeError(value, "finite" if "finite" in allowed else " or ".join(allowed))

    return check


def _refusal(check: Check, value: Any) -> WrongTypeError | None:
    try:
        check(value)
    except WrongTypeError as error:
        return error
    return None


def _each(check: Check, exact: type | None = None, *, stored: bool = True) -> Check:
    """Return the check of a sequence; where it need not be stored, of what can be iterated.

    Args:
        check: of an item.
        exact: type whose own instances pass, which are looked at together, for speed.
        stored: whether it must be stored.
    """

    def check_all(value: Any) -> None:
        if type(value) in (tuple, list) and exact and set(map(type, value)) <= {exact}:
            return
        if not stored and isinstance(value, abc.Iterator):
            return  # its items are made as they are taken
        if not _is_collection(value) or isinstance(value, str | bytes | bytearray | Mapping):
            raise WrongTypeError(value, "a sequence")
        index = 0
        try:
            for index, one in enumerate(value):  # noqa: B007  # for the error
                check(one)
        except WrongTypeError as error:
            raise _inside(error, index) from None

    return check_all


def _row(checks: list[Check]) -> Check:
    stored = _each(_PLAIN[Any])

    def check_all(value: Any) -> None:
        stored(value)
        if len(value) != len(checks):
            raise WrongTypeError(value, f"{len(checks)} values")
        index = 0
        try:
            for index, (check, one) in enumerate(zip(checks, value, strict=True)):  # noqa: B007
                check(one)
        except WrongTypeError as error:
            raise _inside(error, index) from None

    return check_all


def _values(key_check: Check, check: Check) -> Check:
    def check_all(value: Any) -> None:
        if not isinstance(value, Mapping):
            raise WrongTypeError(value, "a mapping")
        key = None
        try:
            for key, one in value.items():
                key_check(key)
                check(one)
        except WrongTypeError as error:
            raise _inside(error, key) from None

    return check_all


def _inside(error: WrongTypeError, place: Any) -> WrongTypeError:
    """Return the refusal of a part of an argument."""
    return WrongTypeError(error.value, error.allowed, f"[{place}]{error.where}")


# What the names in annotations stand for, those imported for type checkers alone included.


def type_hints(annotated: Any, owner: Any = None) -> dict[str, Any]:
    """Return the types that annotations name.

    Args:
        annotated: a function or a class.
        owner: the class of a function.
    """
    bases = owner.__mro__ if owner is not None else ()
    modules = dict.fromkeys([annotated.__module__, *(base.__module__ for base in bases)])
    return typing.get_type_hints(annotated, localns=_Names(modules), include_extras=True)


class _UnknownType(type):
    """Type of `_Unknown`, whose attributes and parameters are as unknown."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return cls

    def __getitem__(cls, parts: Any) -> Any:
        return cls


class _Unknown(metaclass=_UnknownType):
    """A type that type checkers alone know."""


class _Names(dict[str, Any]):
    """The names that annotations may use: of some modules, of Python, of this package."""

    def __init__(self, modules: Mapping[str, None]) -> None:
        super().__init__()
        self._modules = [sys.modules[name] for name in modules if name in sys.modules]

    def __missing__(self, name: str) -> Any:
        import hexapod_pin
        from hexapod_pin import arrays

        own = "hexapod_pin."
        first = (*self._modules, builtins, hexapod_pin, arrays, numpy.typing, abc)
        rooms = (  # looked through only where nothing before them has the name
            sys.modules[key]
            for key in list(sys.modules)
            if key.startswith(own) and name in getattr(sys.modules[key], "__all__", ())
        )
        for place in chain(first, rooms):
            try:
                return getattr(place, name)
            except AttributeError:
                continue
        return _Unknown
