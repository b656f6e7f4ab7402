"""Input of public callables, checked against type annotations before anything runs.

`@checked` goes on a public function, or on a class: then its constructor, public methods, class
methods, static methods and setters are checked. The bases `Spec` (parameter sets) and `Immutable`
(records) check their subclasses without a decorator. An argument of a wrong type, or a number that
is not finite, ends in a `ParameterError` whose `name` is the path of the argument, such as
`Gait.feet_down.phase[2]`. Ranges, and how arguments fit together, are for the callable itself.

A method that a run calls at every step is marked by `@every_step`: its arguments are checked only
after the call has failed, so that a call that succeeds costs nothing.

A call that fails on arguments of the right type (by arithmetic, or because the shapes of arrays do
not fit) ends in a `ParameterError`, too, whose cause is the failure.
"""

from __future__ import annotations

import builtins
import dataclasses
import functools
import inspect
import math
import numbers
import os
import sys
import types
import typing
from collections import abc
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, overload

from hexapod_pin.errors import HexapodError, ParameterError

LARGEST_INT = 2**63
"""No larger int is a number of the machine."""

LARGEST_NUMBER = 1e30
"""In SI units: powers and products of larger parameters leave double precision."""

Check = Callable[[Any], None]
"""Raises a `_WrongTypeError` of a value that will not do."""

Owner = TypeVar("Owner", bound=type)
Public = TypeVar("Public", bound=Callable[..., Any])


class _WrongTypeError(Exception):
    """A value is not of the type that is required; `where` inside the argument."""

    def __init__(self, value: Any, allowed: str, where: str = "") -> None:
        self.value, self.allowed, self.where = value, allowed, where
        super().__init__(allowed)


# What is checked, and when.


@overload
def checked(public: Public) -> Public: ...
@overload
def checked(*, but: str) -> Callable[[Public], Public]: ...
def checked(public: Public | None = None, *, but: str = "") -> Any:
    """Return a function or class whose arguments are checked by their annotations.

    Args:
        public: the function or class.
        but: name of an argument that the callable itself checks, with more to say.

    Raises:
        ParameterError: from each call with an argument of a wrong type.
    """
    if public is None:
        return functools.partial(checked, but=but)
    if not inspect.isclass(public):
        return _checked(public, _Arguments(public, public.__name__, but=but))
    own = vars(public)
    if "__init__" in own:  # that of a dataclass is made from its fields
        made = _Arguments(own["__init__"], public.__name__, public, but)
        public.__init__ = _checked(own["__init__"], made)  # type: ignore[method-assign]
    public._constructor_checked = True  # type: ignore[attr-defined]
    return check_members(public)


def every_step(public: Public) -> Public:
    """Mark what a run calls at every step: a method is then checked only after it has failed.

    The fields of a class that is marked are checked where they are used.
    """
    public._every_step = True  # type: ignore[attr-defined]
    return public


def check_members(owner: Owner) -> Owner:
    """Check the arguments of what the body of a class defines, as `checked` does.

    Returns:
        The class.
    """
    for name, member in list(vars(owner).items()):
        if name.startswith("_") and name not in ("__init__", "__call__"):
            continue
        path = owner.__name__ if name == "__init__" else f"{owner.__name__}.{name}"
        if isinstance(member, property) and member.fset is not None:
            setter = _checked(member.fset, _Arguments(member.fset, path, owner))
            setattr(owner, name, member.setter(setter))
        kind = type(member) if isinstance(member, classmethod | staticmethod) else None
        function: Any = member if kind is None else member.__func__
        if inspect.isfunction(function) and not hasattr(function, "__wrapped__"):
            wrapped = _checked(function, _Arguments(function, path, owner))
            setattr(owner, name, wrapped if kind is None else kind(wrapped))
    return owner


def check_made(owner: type) -> None:
    """Check the fields of each new instance of a dataclass, before its own `__post_init__`.

    For a base class, which cannot decorate the constructor that `dataclass` is going to make. NaN
    and infinity are allowed: they stand for what is not known, and for no limit.
    """
    own: Any = vars(owner).get("__post_init__")
    if own is None and hasattr(owner, "__post_init__"):
        return  # that of the base checks all fields

    def __post_init__(self: Any, *given: Any) -> None:
        kind = type(self)
        for name, check in _field_checks(kind):
            _refuse_wrong(check, getattr(self, name), f"{kind.__name__}.{name}")
        try:
            if own is not None:
                own(self, *given)
        except HexapodError:
            raise
        except Exception as failure:
            _explain(kind.__name__, dict(vars(self)), type_hints(kind, kind), failure)
            raise

    owner.__post_init__ = __post_init__  # type: ignore[attr-defined]


@functools.cache
def _field_checks(owner: Any) -> tuple[tuple[str, Check], ...]:
    """Return name and check of each field; none of a class that `checked` has decorated."""
    if "_constructor_checked" in vars(owner):
        return ()
    hints, optional = type_hints(owner, owner), getattr(owner, "_may_be_none", ())
    found = []
    for one in dataclasses.fields(owner):
        check = _check(hints.get(one.name, Any), RECORD)
        if one.init:
            found.append((one.name, _any_of([_none, check]) if one.name in optional else check))
    return tuple(found)


def check_fields(owner: Any, fields: Mapping[str, Any], rule: _Rule) -> None:
    """Check fields that an instance of a class of pydantic is to be made of.

    Raises:
        ParameterError: one is of a wrong type, or too large a number.
    """
    checks = _parameter_checks(owner, rule)
    for name, value in fields.items():
        if name in checks:
            _refuse_wrong(checks[name], value, f"{owner.__name__}.{name}")


@functools.cache
def _parameter_checks(owner: Any, rule: _Rule) -> dict[str, Check]:
    owner.model_rebuild()
    return {name: _check(one.annotation, rule) for name, one in owner.model_fields.items()}


def _refuse_wrong(
    check: Check, value: Any, path: str, failure: BaseException | None = None
) -> None:
    try:
        check(value)
    except _WrongTypeError as error:
        raise ParameterError(path + error.where, error.value, error.allowed) from failure


def _checked(function: Any, arguments: _Arguments) -> Any:
    early = not hasattr(function, "_every_step")

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        if early:
            arguments.check(args, keywords)
        try:
            return function(*args, **keywords)
        except HexapodError:
            raise
        except Exception as failure:
            arguments.explain(args, keywords, failure)
            raise

    return call


class _Arguments:
    """The arguments of a function, and what its annotations, read at its first call, ask of them.

    Attributes:
        path: name of the function, with its class.
    """

    def __init__(self, function: Any, path: str, owner: Any = None, but: str = "") -> None:
        self._function, self.path, self._owner, self._but = function, path, owner, but

    @functools.cached_property
    def _signature(self) -> inspect.Signature:
        return inspect.signature(self._function)

    @functools.cached_property
    def _hints(self) -> Mapping[str, Any]:
        return type_hints(self._function, self._owner)

    @functools.cached_property
    def _checks(self) -> tuple[tuple[Check, ...], dict[str, Check], Check]:
        """Checks of positional arguments in order, of arguments by name, and of the others."""
        row, names = list[Check](), dict[str, Check]()
        others: Check = _anything
        for name, parameter in self._signature.parameters.items():
            check = _check(self._hints.get(name, Any), CALL) if name != self._but else _anything
            if parameter.kind is parameter.VAR_KEYWORD:
                others = check
            elif parameter.kind is not parameter.VAR_POSITIONAL:
                names[name] = check
                if parameter.kind is not parameter.KEYWORD_ONLY:
                    row.append(check)
        return tuple(row), names, others

    def check(self, args: tuple[Any, ...], keywords: dict[str, Any]) -> None:
        """Refuse the first argument of a wrong type.

        Raises:
            ParameterError: there is one.
        """
        row, names, others = self._checks
        try:
            for check, value in zip(row, args, strict=False):
                check(value)
            for name, value in keywords.items():
                names.get(name, others)(value)
        except _WrongTypeError:
            self._refuse(args, keywords)

    def _given(self, args: tuple[Any, ...], keywords: dict[str, Any]) -> dict[str, Any]:
        """Return the arguments by name; none where they are not those of the function."""
        try:
            given = self._signature.bind(*args, **keywords).arguments
        except TypeError:
            return {}
        for name, parameter in self._signature.parameters.items():
            if parameter.kind is parameter.VAR_KEYWORD:
                given |= given.pop(name, {})
        return given

    def _refuse(
        self, args: tuple[Any, ...], keywords: dict[str, Any], failure: Exception | None = None
    ) -> None:
        _, names, others = self._checks
        for name, value in self._given(args, keywords).items():
            _refuse_wrong(names.get(name, others), value, f"{self.path}.{name}", failure)

    def explain(self, args: tuple[Any, ...], keywords: dict[str, Any], failure: Exception) -> None:
        """Refuse what a call has failed on.

        Raises:
            ParameterError: an argument is the reason; its cause is the failure.
        """
        self._refuse(args, keywords, failure)
        _explain(self.path, self._given(args, keywords), self._hints, failure)


def _explain(
    path: str, given: Mapping[str, Any], hints: Mapping[str, Any], failure: Exception
) -> None:
    """Refuse arguments of the right type that a call has failed on: arrays, or by arithmetic.

    Raises:
        ParameterError: there are such; its cause is the failure.
    """
    import numpy as np

    shapes = {}
    for name, value in given.items():
        hint = hints.get(name, Any)
        array, like = _takes_arrays(hint)
        if isinstance(value, np.ndarray) and not (array or like or hint is Any):
            raise ParameterError(f"{path}.{name}", value, "a list") from failure
        if array and not isinstance(value, np.ndarray | np.number | float | int | None):
            raise ParameterError(f"{path}.{name}", value, "a NumPy array") from failure
        if (array or like) and value is not None:
            shapes[name] = np.shape(value)
    if shapes and isinstance(failure, ValueError | IndexError | TypeError | AttributeError):
        where, allowed = f"{path}.{', '.join(shapes)}", "arrays of the shapes that are documented"
        raise ParameterError(where, tuple(shapes.values()), allowed) from failure
    if isinstance(failure, ArithmeticError):
        named = {key: x for key, x in given.items() if isinstance(x, int | float)}
        values = list(named.values() or given.values())
        shown: Any = tuple(values) if len(named) > 1 else [*values, None][0]
        where = ".".join(filter(None, (path, ", ".join(named))))
        reason = f"{type(failure).__name__}: {failure}"
        raise ParameterError(where, shown, "such that it can be computed", reason) from failure


# What a type asks of a value.


class _Rule(NamedTuple):
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


CALL, RECORD = _Rule(finite=True), _Rule(finite=False, scalars=False)
PARAMETERS = _Rule(finite=False, largest=LARGEST_NUMBER, tables=True)
FACTS = _Rule(finite=False, tables=True)


def _check(kind: Any, rule: _Rule) -> Check:
    """Return the check of a type."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return _check(parts[0], rule)
    if origin is typing.Literal:
        return _one_of(parts)
    if origin in (typing.Union, types.UnionType):
        array_like = _array_like_parts()
        if array_like <= set(parts):
            others = [_check(part, rule) for part in parts if part not in array_like]
            return _any_of([*others, _arrays]) if others else _arrays
        paths = any(part is Path for part in parts)  # a str is one, too
        return _any_of([_check(part, rule) for part in parts if not (paths and part is str)])
    if kind is float:
        return _number(rule)
    if kind in _PLAIN:
        return _PLAIN[kind]
    if origin is tuple and parts[1:] != (...,):
        return _row([_check(part, rule) for part in parts])
    if origin in (tuple, list, set, frozenset, abc.Sequence, abc.Collection, abc.Set):
        return _each(_check(parts[0], rule))
    if origin in (dict, abc.Mapping):
        return _values(_check(parts[0], rule), _check(parts[1], rule))
    if origin in (abc.Iterable, abc.Iterator):
        return _iterable(_check(parts[0], rule))
    kind = origin or kind
    if kind is abc.Callable:
        return _callable
    if getattr(kind, "__name__", "") == "ndarray":
        scalar = typing.get_args(parts[1])[0] if parts else Any
        if getattr(scalar, "__name__", "") not in _NUMBERS:
            return _instance(kind, rule)
        return _arrays if rule.scalars else _rows
    return _instance(kind, rule) if isinstance(kind, type) else _anything


@functools.cache
def _array_like_parts() -> set[Any]:
    """Return the types that NumPy's ArrayLike is a union of."""
    from numpy.typing import ArrayLike

    return set(typing.get_args(ArrayLike))


def _takes_arrays(kind: Any) -> tuple[bool, bool]:
    """Tell whether a type is that of an array, and whether of what makes one (`ArrayLike`)."""
    parts = typing.get_args(kind)
    union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    kinds = (typing.get_origin(one) or one for one in (parts if union else (kind,)))
    named = any(getattr(one, "__name__", "") == "ndarray" for one in kinds)
    return named, union and _array_like_parts() <= set(parts)


def _anything(value: Any) -> None:
    return


def _number(rule: _Rule) -> Check:
    finite, largest = rule.finite, rule.largest

    def check(value: Any) -> None:
        if type(value) is not float:
            if isinstance(value, numbers.Integral):
                _integer(value, "a float")
                value = int(value)
                if abs(value) > LARGEST_INT:
                    raise _WrongTypeError(value, f"at most {LARGEST_INT:g} in size")
            elif not isinstance(value, numbers.Real) or isinstance(value, numbers.Rational):
                raise _WrongTypeError(value, "a float")
        if finite and not math.isfinite(value):
            raise _WrongTypeError(value, "finite")
        if largest < abs(value) < math.inf:
            raise _WrongTypeError(value, f"at most {largest:g} in size")

    return check


def _integer(value: Any, allowed: str = "an int") -> None:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise _WrongTypeError(value, allowed)


def _bool(value: Any) -> None:
    if not isinstance(value, bool) and type(value).__name__ not in ("bool_", "bool"):
        raise _WrongTypeError(value, "a bool")


def _text(value: Any) -> None:
    if not isinstance(value, str):
        raise _WrongTypeError(value, "a str")
    try:
        value.isascii() or value.encode()
    except UnicodeEncodeError:
        raise _WrongTypeError(value, "a str without unpaired surrogates") from None


def _path(value: Any) -> None:
    if not isinstance(value, str | os.PathLike) or isinstance(os.fspath(value), bytes):
        raise _WrongTypeError(value, "a path")
    if "\0" in os.fspath(value):
        raise _WrongTypeError(value, "a path without a null character")


def _none(value: Any) -> None:
    if value is not None:
        raise _WrongTypeError(value, "None")


def _callable(value: Any) -> None:
    if not callable(value):
        raise _WrongTypeError(value, "callable")


_PLAIN: Mapping[Any, Check] = {
    Any: _anything, None: _none, type(None): _none, int: _integer, bool: _bool, str: _text,
    Path: _path, os.PathLike: _path,
}  # fmt: skip


_NUMBERS = ("float64", "bool", "bool_", "int64", "intp", "uint8", "float32", "int32")
"""Names of NumPy's types of numbers that annotations ask for."""


def _arrays(value: Any) -> None:
    import numpy as np

    if type(value) is not np.ndarray:
        try:
            value_of = np.asarray(value)
        except (TypeError, ValueError, OverflowError):
            value_of = np.asarray(None)
    else:
        value_of = value
    if value_of.dtype.kind not in "biuf":
        raise _WrongTypeError(value, "an array of numbers, all rows of one length")


def _rows(value: Any) -> None:
    _arrays(value)
    if not _is_collection(value):
        raise _WrongTypeError(value, "an array with an axis")


def _one_of(choices: tuple[Any, ...]) -> Check:
    def check(value: Any) -> None:
        if not any(type(value) is type(one) and value == one for one in choices):
            raise _WrongTypeError(value, f"one of {', '.join(map(repr, choices))}")

    return check


def _any_of(checks: list[Check]) -> Check:
    def check(value: Any) -> None:
        refusals = []
        for one in checks:
            try:
                return one(value)
            except _WrongTypeError as error:
                refusals.append(error)
        deepest = max(refusals, key=lambda error: len(error.where))
        if deepest.where:
            raise deepest
        allowed = list(dict.fromkeys(refusal.allowed for refusal in refusals))
        raise _WrongTypeError(value, "finite" if "finite" in allowed else " or ".join(allowed))

    return check


def _each(check: Check) -> Check:
    def check_all(value: Any) -> None:
        if isinstance(value, str | bytes | bytearray | Mapping) or not _is_collection(value):
            raise _WrongTypeError(value, "a sequence")
        if check is not _anything:
            for index, one in enumerate(value):
                _inside(check, one, f"[{index}]")

    return check_all


def _is_collection(value: Any) -> bool:
    """Tell whether a value has a length and items; an array without an axis has none."""
    return isinstance(value, abc.Collection) and getattr(value, "ndim", 1) > 0


def _row(checks: list[Check]) -> Check:
    def check_all(value: Any) -> None:
        _each(_anything)(value)
        if len(value) != len(checks):
            raise _WrongTypeError(value, f"{len(checks)} values")
        for index, (check, one) in enumerate(zip(checks, value, strict=True)):
            _inside(check, one, f"[{index}]")

    return check_all


def _iterable(check: Check) -> Check:
    def check_stored(value: Any) -> None:
        if isinstance(value, str | bytes | bytearray) or not isinstance(value, abc.Iterable):
            raise _WrongTypeError(value, "a sequence")
        if isinstance(value, Mapping) or _is_collection(value):
            _each(check)(list(value))  # others are made as they are taken

    return check_stored


def _values(key_check: Check, check: Check) -> Check:
    def check_all(value: Any) -> None:
        if not isinstance(value, Mapping):
            raise _WrongTypeError(value, "a mapping")
        for key, one in value.items():
            _inside(key_check, key, f"[{key!r}]")
            _inside(check, one, f"[{key!r}]" if not isinstance(key, str) else f"[{key}]")

    return check_all


def _inside(check: Check, value: Any, where: str) -> None:
    """Check a part of an argument."""
    try:
        check(value)
    except _WrongTypeError as error:
        raise _WrongTypeError(error.value, error.allowed, where + error.where) from None


def _instance(kind: type, rule: _Rule) -> Check:
    allowed = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    table = rule.tables and hasattr(kind, "model_fields")
    if getattr(kind, "_is_protocol", False) or kind is object or kind is _Unknown:
        return _anything  # what a protocol's object lacks is reported where it is used

    def check(value: Any) -> None:
        if isinstance(value, kind):
            return
        if not (table and isinstance(value, Mapping) and all(isinstance(k, str) for k in value)):
            raise _WrongTypeError(value, allowed)

    return check


# What the names in annotations stand for, those imported for type checkers alone included.


def type_hints(annotated: Any, owner: Any = None) -> dict[str, Any]:
    """Return the types that annotations name.

    Args:
        annotated: a function or a class.
        owner: the class of a function.
    """
    bases = owner.__mro__ if owner is not None else ()
    modules = dict.fromkeys([annotated.__module__, *(base.__module__ for base in bases)])
    rooms = [name.rpartition(".")[0] for name in modules]
    return typing.get_type_hints(annotated, localns=_Names([*modules, *rooms]))


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

    def __init__(self, modules: Sequence[str]) -> None:
        super().__init__()
        self._rooms = [sys.modules[name] for name in modules if name in sys.modules]

    def __missing__(self, name: str) -> Any:
        import numpy.typing

        import hexapod_pin
        from hexapod_pin import arrays

        for room in (*self._rooms, builtins, hexapod_pin, arrays, numpy.typing, abc):
            try:
                return getattr(room, name)
            except AttributeError:
                continue
        return _Unknown
