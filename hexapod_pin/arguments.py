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

import dataclasses
import functools
import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar, overload

import numpy as np

from hexapod_pin.errors import ArgumentError, HexapodError, ParameterError
from hexapod_pin.type_checks import (
    ANYTHING,
    CALL,
    NOTHING,
    RECORD,
    Check,
    Rule,
    WrongTypeError,
    any_of,
    check_of,
    takes_arrays,
    type_hints,
)

Owner = TypeVar("Owner", bound=type)
Public = TypeVar("Public", bound=Callable[..., Any])


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
        return _checked(public, public.__qualname__.rpartition("<locals>.")[2], None, but)
    if "__init__" in vars(public):  # that of a dataclass is made from its fields
        constructor = _checked(vars(public)["__init__"], public.__name__, public, but)
        public.__init__ = constructor  # type: ignore[method-assign]
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
            setattr(owner, name, member.setter(_checked(member.fset, path, owner)))
        kind = type(member) if isinstance(member, classmethod | staticmethod) else None
        function: Any = member if kind is None else member.__func__
        if inspect.isfunction(function) and not hasattr(function, "__wrapped__"):
            wrapped = _checked(function, path, owner)
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
        kind: Any = type(self)
        outermost = kind.__post_init__ is __post_init__
        if outermost and "_constructor_checked" not in vars(kind):
            check_fields(kind, vars(self), RECORD)
        try:
            if own is not None:
                own(self, *given)
        except HexapodError:
            raise
        except Exception as failure:
            _explain(kind.__name__, dict(vars(self)), type_hints(kind, kind), failure)
            raise

    owner.__post_init__ = __post_init__  # type: ignore[attr-defined]


def check_fields(owner: Any, fields: Mapping[str, Any], rule: Rule) -> None:
    """Check what an instance of a dataclass, or of a class of pydantic, is made of.

    Raises:
        ParameterError: a field is of a wrong type, or too large a number.
    """
    checks = _field_checks(owner, rule)
    try:
        for name, check in checks.items():
            if name in fields:
                check(fields[name])
    except WrongTypeError:
        for name, check in checks.items():
            if name in fields:
                _refuse_wrong(check, fields[name], f"{owner.__name__}.{name}")


@functools.cache
def _field_checks(owner: Any, rule: Rule) -> dict[str, Check]:
    if hasattr(owner, "model_fields"):
        owner.model_rebuild()
        return {name: check_of(one.annotation, rule) for name, one in owner.model_fields.items()}
    hints, fields = type_hints(owner, owner), dataclasses.fields(owner)
    found = {one.name: check_of(hints.get(one.name, Any), rule) for one in fields if one.init}
    optional = {name: any_of([NOTHING, found[name]]) for name in owner._may_be_none}
    return found | optional


def _refuse_wrong(
    check: Check, value: Any, path: str, failure: BaseException | None = None
) -> None:
    try:
        check(value)
    except WrongTypeError as error:
        from hexapod_pin.meant import made_by

        place = path + error.where
        hint = made_by(place.rpartition(".")[2], error.value)
        raise ParameterError(place, error.value, error.allowed, hint) from failure


def _checked(function: Any, path: str, owner: Any, but: str = "") -> Any:
    """Return a function, of a class or of none, whose arguments are checked."""
    early = not hasattr(function, "_every_step")
    arguments = _Arguments(function, path, owner, but)

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        if early:
            arguments.check(args, keywords)
        try:
            return function(*args, **keywords)
        except HexapodError:
            raise
        except Exception as failure:
            arguments.require_known(args, keywords, failure)
            arguments.refuse(args, keywords, failure)
            _explain(path, arguments.given(args, keywords), arguments.hints, failure)
            raise

    return call


class _Arguments:
    """The arguments of a function; its annotations are read at its first call."""

    def __init__(self, function: Any, path: str, owner: Any, but: str) -> None:
        self._function, self._path, self._owner, self._but = function, path, owner, but

    @functools.cached_property
    def _signature(self) -> inspect.Signature:
        return inspect.signature(self._function)

    @functools.cached_property
    def hints(self) -> Mapping[str, Any]:
        """The types that the annotations name."""
        return type_hints(self._function, self._owner)

    @functools.cached_property
    def _checks(self) -> tuple[tuple[Check, ...], dict[str, Check], Check]:
        """Checks of positional arguments in order, of arguments by name, and of the others."""
        row, names, others = list[Check](), dict[str, Check](), ANYTHING
        for name, parameter in self._signature.parameters.items():
            check = ANYTHING if name == self._but else check_of(self.hints.get(name, Any), CALL)
            if parameter.kind is parameter.VAR_KEYWORD:
                others = check
            elif parameter.kind is not parameter.VAR_POSITIONAL:
                names[name] = check
                if parameter.kind is not parameter.KEYWORD_ONLY:
                    row.append(check)
        return tuple(row), names, others

    def check(self, args: tuple[Any, ...], keywords: dict[str, Any]) -> None:
        """Refuse the first argument of a wrong type; the way without names, for speed.

        Raises:
            ParameterError: there is one.
        """
        row, names, others = self._checks
        try:
            for check, value in zip(row, args, strict=False):
                check(value)
            for name, value in keywords.items():
                names.get(name, others)(value)
        except WrongTypeError:
            self.refuse(args, keywords)

    def require_known(
        self, args: tuple[Any, ...], keywords: dict[str, Any], failure: Exception
    ) -> None:
        """Refuse arguments that the function does not have, and a call that lacks some.

        Raises:
            ArgumentError: there are such; its cause is the failure of the call.
        """
        if not isinstance(failure, TypeError):
            return
        try:
            self._signature.bind(*args, **keywords)
        except TypeError as wrong:
            from hexapod_pin.meant import unknown_argument

            own = self._owner is not None and next(iter(self._signature.parameters), "") == "self"
            known = list(self._signature.parameters)[own:]
            for name in keywords:
                if name not in known:
                    raise unknown_argument(self._path, name, known) from failure
            text = f"{self._path}: {wrong}. It takes {', '.join(known) or 'nothing'}."
            raise ArgumentError(self._path, "", text) from failure

    def refuse(
        self, args: tuple[Any, ...], keywords: dict[str, Any], failure: Exception | None = None
    ) -> None:
        """Refuse the first argument of a wrong type.

        Raises:
            ParameterError: there is one; its cause is the failure of the call.
        """
        _, names, others = self._checks
        for name, value in self.given(args, keywords).items():
            _refuse_wrong(names.get(name, others), value, f"{self._path}.{name}", failure)

    def given(self, args: tuple[Any, ...], keywords: dict[str, Any]) -> dict[str, Any]:
        """Return the arguments by name; none where they are not those of the function."""
        try:
            given = self._signature.bind(*args, **keywords).arguments
        except TypeError:
            return {}
        for name, parameter in self._signature.parameters.items():
            if parameter.kind is parameter.VAR_KEYWORD:
                given |= given.pop(name, {})
        return given


def _explain(
    path: str, given: Mapping[str, Any], hints: Mapping[str, Any], failure: Exception
) -> None:
    """Refuse arguments of the right type that a call has failed on: texts, arrays, by arithmetic.

    Raises:
        ParameterError: there are such; its cause is the failure.
    """
    if isinstance(failure, TypeError | UnicodeEncodeError):  # matplotlib's is a TypeError
        for name, value in given.items():
            for text in _texts(value, DEEPEST_TEXT):
                if not _is_unicode(text) and "Path" not in str(hints.get(name)):
                    allowed = "text without unpaired surrogates"
                    raise ParameterError(f"{path}.{name}", text, allowed) from failure
    shapes = {}
    for name, value in given.items():
        hint = hints.get(name, Any)
        array, like = takes_arrays(hint)
        if isinstance(value, np.ndarray) and not (array or like or hint is Any):
            raise ParameterError(f"{path}.{name}", value, "a list") from failure
        if array and not isinstance(value, np.ndarray | np.number | float | int | None):
            raise ParameterError(f"{path}.{name}", value, "a NumPy array") from failure
        if (array or like) and value is not None:
            shapes[name] = np.shape(value)
    if shapes and isinstance(failure, ValueError | IndexError | TypeError | AttributeError):
        where, allowed = f"{path}.{', '.join(shapes)}", "arrays of the shapes that are documented"
        raise ParameterError(where, tuple(shapes.values()), allowed) from failure
    size = isinstance(failure, ValueError) and str(failure).startswith("Maximum allowed")
    if size or isinstance(failure, ArithmeticError | MemoryError):
        named = {key: x for key, x in given.items() if isinstance(x, int | float)}
        values = list(named.values() or given.values())
        shown: Any = tuple(values) if len(named) > 1 else [*values, None][0]
        where = ".".join(filter(None, (path, ", ".join(named))))
        reason = f"{type(failure).__name__}: {failure}"
        raise ParameterError(where, shown, "such that it can be computed", reason) from failure


DEEPEST_TEXT = 6
"""Levels of records and lists in which a text is looked for."""


def _texts(value: Any, depth: int) -> Iterator[str]:
    """Yield the texts in a value: in lists, mappings, arrays and the package's own records."""
    if isinstance(value, str):
        yield value
        return
    if isinstance(value, np.ndarray):
        value = value.ravel().tolist() if value.dtype.kind in "OU" else ()
    elif type(value).__module__.startswith("hexapod_pin."):
        value = getattr(value, "__dict__", {})
    if isinstance(value, Mapping):
        value = [*value, *value.values()]
    if depth and isinstance(value, list | tuple | set | frozenset):
        for one in value:
            yield from _texts(one, depth - 1)


def _is_unicode(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
