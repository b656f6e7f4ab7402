"""Arguments of public calls, checked against their annotations.

`@checked` goes on a public function or class: an argument of a wrong type, or a number that is not
finite, ends in a `ParameterError` that names call and argument, before anything runs. Ranges, and
how arguments fit together, are for the call itself and for the parameter sets it takes
(`hexapod_pin.spec`).

The public methods of such a class, of parameter sets and of records are called by the package
itself, some at every tick of a run. Their arguments are looked at where a call fails, so that a
call that succeeds costs nothing: an argument of a wrong kind then ends in the same error.

Where any of these calls fails by arithmetic, or on what counts as a number but has no place in an
array (a `Fraction`, 2**70), that ends in a `ParameterError`, too, whose cause is the failure. So
does a text with an unpaired surrogate, which no file and no figure can hold.
"""

from __future__ import annotations

import functools
import inspect
import numbers
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar, overload

from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.value_kinds import LARGEST_WHOLE, Check, WrongKindError, kind_of, takes_arrays

Owner = TypeVar("Owner", bound=type)
Public = TypeVar("Public", bound=Callable[..., Any])


@overload
def checked(public: Public) -> Public: ...
@overload
def checked(*, but: str) -> Callable[[Public], Public]: ...
def checked(public: Public | None = None, *, but: str = "") -> Any:
    """Return a function or class whose arguments are checked by their annotations.

    Args:
        public: the function or class.
        but: name of an argument that the call itself checks, with more to say.

    Raises:
        ParameterError: from each call with an argument of a wrong kind.
    """
    if public is None:
        return functools.partial(checked, but=but)
    if inspect.isclass(public):
        public.__init__ = _checked(vars(public)["__init__"], public.__name__, but)  # type: ignore[method-assign]
        explain_methods(public)
        return public
    return _checked(public, public.__name__, but)


def _checked(function: Any, name: str, but: str) -> Any:
    arguments = _Arguments(function, name, but)

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        arguments.check(args, keywords)
        try:
            return function(*args, **keywords)
        except HexapodError:
            raise
        except Exception as failure:
            arguments.explain(args, keywords, failure)
            raise

    return call


def explain_methods(owner: Owner) -> Owner:
    """Let public methods that a class defines name an argument of a wrong kind when they fail.

    What was decorated by `checked` stays as it is.

    Returns:
        The class: this is a decorator, too.
    """
    for name, member in list(vars(owner).items()):
        kind = type(member) if isinstance(member, classmethod | staticmethod) else None
        function = member if kind is None else member.__func__
        if name.startswith("_") or not inspect.isfunction(function):
            continue
        if not hasattr(function, "__wrapped__"):
            explained = _explained(function, f"{owner.__name__}.{name}")
            setattr(owner, name, explained if kind is None else kind(explained))
    return owner


def _explained(function: Any, name: str) -> Any:
    arguments = _Arguments(function, name, "")

    if inspect.isgeneratorfunction(function):  # fails only when it is iterated
        return _checked(function, name, "")

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        try:
            return function(*args, **keywords)
        except HexapodError:
            raise
        except Exception as failure:
            arguments.check(args, keywords, failure)
            arguments.explain(args, keywords, failure)
            raise

    return call


class _Arguments:
    """The arguments of a function and what its annotations ask of them."""

    def __init__(self, function: Any, name: str, but: str) -> None:
        self.function, self.name, self.but = function, name, but
        self.signature = inspect.signature(function)
        self.checks: dict[str, Check] = {}

    def check(
        self, args: tuple[Any, ...], keywords: dict[str, Any], failure: Exception | None = None
    ) -> None:
        """Refuse an argument of a wrong kind; the first of them.

        Raises:
            ParameterError: there is one; its cause is the failure.
            TypeError: the arguments are not those of the function, and there is no failure.
        """
        if not self.checks:
            self.checks.update(_checks_of(self.function, self.signature))
        try:
            given = self.signature.bind(*args, **keywords).arguments
        except TypeError:
            if failure is None:
                raise
            return
        for argument, value in given.items():
            if argument == self.but:
                continue
            try:
                self.checks[argument](value)
            except WrongKindError as error:
                where = f"{self.name}.{argument}{error.where}"
                raise ParameterError(where, error.value, error.allowed) from failure

    def explain(self, args: tuple[Any, ...], keywords: dict[str, Any], failure: Exception) -> None:
        """Refuse what a call has failed on though its kind is that of the annotation.

        Raises:
            ParameterError: there is such an argument; its cause is the failure.
        """
        try:
            given = self.signature.bind(*args, **keywords).arguments
        except TypeError:
            return
        if isinstance(failure, TypeError | UnicodeEncodeError):  # matplotlib's is a TypeError
            self._check_texts(given, failure)
        for argument, value in given.items():
            allowed = self._machine_kind(argument, value)
            if allowed:
                raise ParameterError(f"{self.name}.{argument}", value, allowed) from failure
        self._check_arrays(given, failure)
        if isinstance(failure, ArithmeticError):
            named = {key: x for key, x in given.items() if isinstance(x, int | float)}
            values = list(named.values() or given.values())
            shown: Any = tuple(values) if len(named) > 1 else [*values, None][0]
            where = ".".join(filter(None, (self.name, ", ".join(named))))
            reason = f"{type(failure).__name__}: {failure}"
            raise ParameterError(where, shown, "such that it can be computed", reason) from failure

    def _check_texts(self, given: dict[str, Any], failure: Exception) -> None:
        """Refuse a text that cannot be encoded, wherever in an argument it is; paths may be such.

        Raises:
            ParameterError: there is one; its cause is the failure.
        """
        for argument, value in given.items():
            if "Path" in str(self.signature.parameters[argument].annotation):
                continue
            for text in _texts(value, DEEPEST_TEXT):
                try:
                    text.encode()
                except UnicodeEncodeError:
                    where = f"{self.name}.{argument}"
                    raise ParameterError(
                        where, text, "text without unpaired surrogates"
                    ) from failure

    def _machine_kind(self, argument: str, value: Any) -> str:
        """Return what an argument must be to be a number of the machine, or a list; "": it is."""
        import numpy as np

        if isinstance(value, numbers.Number) and not isinstance(value, int | float | np.number):
            return "a float or an int"
        if isinstance(value, int) and abs(value) > LARGEST_WHOLE:
            return f"at most {LARGEST_WHOLE:g}"
        annotation = self.signature.parameters[argument].annotation
        array = any(takes_arrays(annotation, self.function))
        return "a list" if isinstance(value, np.ndarray) and not array else ""

    def _check_arrays(self, given: dict[str, Any], failure: Exception) -> None:
        """Refuse lists where arrays are wanted, and arrays whose shapes do not fit together.

        Raises:
            ParameterError: there is such an argument; its cause is the failure.
        """
        import numpy as np

        shapes = {}
        for argument, value in given.items():
            annotation = self.signature.parameters[argument].annotation
            array, like = takes_arrays(annotation, self.function)
            if array and not isinstance(value, np.ndarray | np.number | float | int | None):
                allowed = "a NumPy array"
                raise ParameterError(f"{self.name}.{argument}", value, allowed) from failure
            if array or like:
                shapes[argument] = np.shape(value)
        try:
            np.broadcast_shapes(*shapes.values())
        except ValueError:
            where = f"{self.name}.{', '.join(shapes)}"
            allowed = "arrays whose shapes fit together"
            raise ParameterError(where, tuple(shapes.values()), allowed) from failure


DEEPEST_TEXT = 6
"""Levels of records and lists in which a text is looked for."""


def _texts(value: Any, depth: int) -> Iterator[str]:
    """Yield the texts in a value: in lists, mappings, arrays and the package's own records."""
    import numpy as np

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


def _checks_of(function: Any, signature: inspect.Signature) -> dict[str, Check]:
    """Return what checks each argument; one with a default of None may be None."""
    return {
        name: kind_of(parameter.annotation, function, of_all=parameter.kind)
        for name, parameter in signature.parameters.items()
    }
