"""A type annotation asks for a kind of value.

Names in an annotation are resolved here, also those imported for type checkers only.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import numbers
import os
import sys
import types
import typing
from collections import abc
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

Check = Callable[[Any], None]
"""Raises `WrongKindError` of a value that will not do."""


LARGEST_WHOLE = 2**63
"""Larger whole numbers are no numbers of the machine."""


class WrongKindError(Exception):
    """A value is not of the kind that is asked for."""

    def __init__(self, value: Any, allowed: str, where: str = "") -> None:
        """Keep the value, what it must be, and where inside the argument it stands."""
        self.value, self.allowed, self.where = value, allowed, where
        super().__init__(allowed)


def kind_of(annotation: Any, function: Any, *, of_all: Any = None) -> Check:
    """Return the check of an annotation.

    Args:
        annotation: as it stands in the signature: a text, or a type.
        function: whose it is: names are looked up in its module.
        of_all: kind of the parameter; of *args and **keywords each value is checked.
    """
    if annotation is inspect.Parameter.empty:
        return _anything
    check = _check(resolved(annotation, function))
    if of_all is inspect.Parameter.VAR_POSITIONAL:
        return _each(check)
    if of_all is inspect.Parameter.VAR_KEYWORD:
        return _values(_anything, check)
    return check


def takes_arrays(annotation: Any, function: Any) -> tuple[bool, bool]:
    """Tell whether an annotation asks for an array itself, and for what makes one (`ArrayLike`)."""
    found = resolved(annotation, function)
    kinds = {getattr(typing.get_origin(part) or part, "__name__", "") for part in _parts(found)}
    members = typing.get_args(found)  # of a callable, one of them is a list
    return "ndarray" in kinds, all(part in members for part in _array_like_parts())


def _parts(kind: Any) -> tuple[Any, ...]:
    """Return the members of a union; a type that is none by itself."""
    union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    return typing.get_args(kind) if union else (kind,)


def _check(kind: Any) -> Check:
    """Return the check of a type."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any or isinstance(kind, typing.TypeVar):
        return _anything
    if kind is None or kind is type(None):
        return _nothing
    if origin is typing.Annotated:
        return _check(parts[0])
    if origin is typing.Literal:
        return _one_of(parts)
    if origin in (typing.Union, types.UnionType):
        array_like = _array_like_parts()
        if array_like <= set(parts):
            others = [_check(part) for part in parts if part not in array_like]
            return _any_of([*others, _arrays]) if others else _arrays
        paths = any(part is Path for part in parts)  # which may be texts
        return _any_of([_check(part) for part in parts if not (paths and part is str)])
    if kind in _PLAIN:
        return _PLAIN[kind]
    if origin is tuple:
        return _each(_check(parts[0])) if parts[1:] == (...,) else _row([_check(p) for p in parts])
    if origin in (list, abc.Sequence, abc.Collection, abc.Set):
        return _each(_check(parts[0]))
    if origin in (dict, abc.Mapping):
        return _values(_check(parts[0]), _check(parts[1]))
    if origin is abc.Callable or kind is abc.Callable:
        return _callable
    if origin in (abc.Iterable, abc.Iterator):
        return _iterable(_check(parts[0]))
    kind = origin or kind
    if isinstance(kind, type) and kind.__name__ == "ndarray":
        return _arrays
    return _instance(kind) if isinstance(kind, type) else _anything


def _array_like_parts() -> set[Any]:
    """Return the types that NumPy's ArrayLike is a union of."""
    from numpy.typing import ArrayLike

    return set(typing.get_args(ArrayLike))


def _anything(value: Any) -> None:
    return


def _nothing(value: Any) -> None:
    if value is not None:
        raise WrongKindError(value, "None")


def _number(value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise WrongKindError(value, "a number")
    if isinstance(value, numbers.Integral) and abs(int(value)) > LARGEST_WHOLE:
        raise WrongKindError(value, f"at most {LARGEST_WHOLE:g}")
    if not math.isfinite(value):
        raise WrongKindError(value, "finite")


def _whole_number(value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise WrongKindError(value, "a whole number")


def _truth(value: Any) -> None:
    if not isinstance(value, bool) and type(value).__name__ not in ("bool_", "bool"):
        raise WrongKindError(value, "true or false")


def _text(value: Any) -> None:
    if not isinstance(value, str):
        raise WrongKindError(value, "a text")


def _path(value: Any) -> None:
    if not isinstance(value, str | os.PathLike) or isinstance(os.fspath(value), bytes):
        raise WrongKindError(value, "a path")
    if "\0" in os.fspath(value):
        raise WrongKindError(value, "a path without a null character")


def _callable(value: Any) -> None:
    if not callable(value):
        raise WrongKindError(value, "callable")


def _iterable(check: Check) -> Check:
    def check_stored(value: Any) -> None:
        if isinstance(value, str | bytes) or not hasattr(value, "__iter__"):
            raise WrongKindError(value, "several of them, such as a list")
        if isinstance(value, abc.Sequence | abc.Set | Mapping) or hasattr(value, "dtype"):
            _each(check)(list(value))  # others are made as they are taken

    return check_stored


def _arrays(value: Any) -> None:
    import numpy as np

    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        array = np.asarray(None)
    if array.dtype.kind not in "biuf":
        raise WrongKindError(value, "numbers, all rows of one length")


def _one_of(choices: tuple[Any, ...]) -> Check:
    def check(value: Any) -> None:
        if not any(isinstance(value, type(one)) and value == one for one in choices):
            raise WrongKindError(value, f"one of {', '.join(map(repr, choices))}")

    return check


def _any_of(checks: list[Check]) -> Check:
    def check(value: Any) -> None:
        refusals = []
        for one in checks:
            try:
                return one(value)
            except WrongKindError as error:
                refusals.append(error)
        deepest = max(refusals, key=lambda error: len(error.where))
        if deepest.where:
            raise deepest
        told = list(dict.fromkeys(refusal.allowed for refusal in refusals))
        raise WrongKindError(value, "finite" if "finite" in told else " or ".join(told))

    return check


def _each(check: Check) -> Check:
    def check_all(value: Any) -> None:
        if isinstance(value, str | bytes | Mapping) or not _has_length(value):
            raise WrongKindError(value, "several of them, such as a list")
        for index, one in enumerate(value):
            _inside(check, one, f"[{index}]")

    return check_all


def _has_length(value: Any) -> bool:
    """Tell whether a value has a length; an array without an axis has none."""
    try:
        return len(value) >= 0
    except TypeError:
        return False


def _row(checks: list[Check]) -> Check:
    def check_all(value: Any) -> None:
        _each(_anything)(value)
        if len(value) != len(checks):
            raise WrongKindError(value, f"{len(checks)} values")
        for index, (check, one) in enumerate(zip(checks, value, strict=True)):
            _inside(check, one, f"[{index}]")

    return check_all


def _values(key_check: Check, check: Check) -> Check:
    def check_all(value: Any) -> None:
        if not isinstance(value, Mapping):
            raise WrongKindError(value, "a mapping, such as a dictionary")
        for key, one in value.items():
            _inside(key_check, key, f" key {key!r}")
            _inside(check, one, f"[{key}]")

    return check_all


def _inside(check: Check, value: Any, where: str) -> None:
    """Check a part of an argument."""
    try:
        check(value)
    except WrongKindError as error:
        raise WrongKindError(error.value, error.allowed, where + error.where) from None


def _instance(kind: type) -> Check:
    name = kind.__name__
    article = "an" if name[0] in "AEIOU" else "a"
    if getattr(kind, "_is_protocol", False):  # what it lacks is told where it is used
        return _anything

    def check(value: Any) -> None:
        if not isinstance(value, kind):
            raise WrongKindError(value, f"{article} {name}")

    return check


_PLAIN: Mapping[Any, Check] = {
    float: _number,
    int: _whole_number,
    bool: _truth,
    str: _text,
    Path: _path,
    os.PathLike: _path,
}


# What the names in a type annotation stand for, those imported for type checkers alone too.


def resolved(annotation: Any, function: Any) -> Any:
    """Return the type that an annotation names; `Any` where its module does not tell."""
    if not isinstance(annotation, str):
        return annotation
    module = inspect.unwrap(function).__module__
    try:
        return eval(annotation, {}, _Names(module))  # noqa: S307  # our own source
    except (NameError, TypeError, AttributeError, ImportError):
        return Any


class _Names(dict[str, Any]):
    """The names that an annotation of a module may use, those for type checkers included."""

    def __init__(self, module: str) -> None:
        super().__init__()
        self._module = module

    def __missing__(self, name: str) -> Any:
        module = sys.modules[self._module]
        if hasattr(module, name):
            return getattr(module, name)
        if hasattr(builtins, name):
            return getattr(builtins, name)
        source = _imports_for_checking(self._module).get(name)
        if source is None:  # such as another name for a type, for type checkers alone
            return Any
        return getattr(import_module(source[0]), source[1])


@cache
def _imports_for_checking(module: str) -> Mapping[str, tuple[str, str]]:
    """Return the names that a module imports where `TYPE_CHECKING`, with where they come from."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {
        alias.asname or alias.name: (statement.module or "", alias.name)
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
