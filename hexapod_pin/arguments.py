"""Arguments of public calls, checked against their annotations before anything runs.

`@checked` goes on a public function or class: an argument of a wrong type, or a number that is not
finite, ends in a `ParameterError` that names call and argument. Ranges, and how arguments fit
together, are for the call itself and for the parameter sets it takes (`hexapod_pin.spec`).
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar, overload

from hexapod_pin.errors import ParameterError
from hexapod_pin.value_kinds import Check, WrongKindError, kind_of

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
        return public
    return _checked(public, public.__name__, but)


def _checked(function: Any, name: str, but: str) -> Any:
    signature = inspect.signature(function)
    checks: dict[str, Check] = {}

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        if not checks:
            checks.update(_checks_of(function, signature))
        given = signature.bind(*args, **keywords).arguments
        for argument, value in given.items():
            if argument == but:
                continue
            check = checks[argument]
            try:
                check(value)
            except WrongKindError as error:
                where = f"{name}.{argument}{error.where}"
                raise ParameterError(where, error.value, error.allowed) from None
        return function(*args, **keywords)

    return call


def _checks_of(function: Any, signature: inspect.Signature) -> dict[str, Check]:
    """Return what checks each argument; one with a default of None may be None."""
    return {
        name: kind_of(parameter.annotation, function, of_all=parameter.kind)
        for name, parameter in signature.parameters.items()
    }
