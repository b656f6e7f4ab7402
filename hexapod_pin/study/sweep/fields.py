"""Tables of a study file: unknown keys, missing keys and bad values by their place in the file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Annotated, Any, TypeVar

from pydantic import Strict

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Spec

Model = TypeVar("Model", bound=Spec)
Number = Annotated[float, Strict()]
"""A number that is written as one: no text, no true or false."""


def table_at(data: Any, where: str) -> Mapping[str, Any]:
    """Return a table.

    Raises:
        ParameterError: it is something else.
    """
    if not isinstance(data, Mapping):
        raise ParameterError(where, data, f"a table: [{where.split('[', maxsplit=1)[0]}]")
    return data


def refuse_unknown(data: Mapping[str, Any], where: str, known: Iterable[str]) -> None:
    """Refuse keys that a table does not have, naming those that it has.

    Raises:
        ParameterError: the key by its path, and what is like it.
    """
    names = list(known)
    for key, value in data.items():
        if key not in names:
            allowed = f"left out: there is no such key here; known: {', '.join(names)}"
            raise ParameterError(joined(where, key), value, allowed, suggestion(key, names))


def known_name(where: str, value: Any, known: Iterable[str]) -> str:
    """Return a name that is one of those known.

    Raises:
        ParameterError: it is not; the message suggests a similar name.
    """
    names = list(known)
    if not isinstance(value, str) or value not in names:
        hint = suggestion(value, names) if isinstance(value, str) else ""
        raise ParameterError(where, value, f"one of {', '.join(names)}", hint)
    return value


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return a question after the name that was meant; empty where none is like it."""
    near = get_close_matches(name, list(known), n=1)
    return f"Did you mean {near[0]!r}?" if near else ""


def read_spec(model: type[Model], data: Mapping[str, Any], where: str) -> Model:
    """Return a parameter set from a table of the file.

    Raises:
        ParameterError: an unknown or missing key or a bad value, by its path in the file.
    """
    refuse_unknown(data, where, model.model_fields)
    try:
        return model(**data)
    except ParameterError as error:
        own = f"{model.__name__}."
        name = error.name.removeprefix(own)
        if name == error.name and "." in name:
            raise
        raise ParameterError(joined(where, name), error.value, error.allowed, error.hint) from error


@contextmanager
def placed(where: str, names: Mapping[str, str] | None = None) -> Iterator[None]:
    """Name errors of a part by its place in the file.

    Args:
        where: table of the file.
        names: keys of the table by what the part itself calls them, where they differ.

    Raises:
        ParameterError: as inside, `where` in front of the last part of its name.
    """
    try:
        yield
    except ParameterError as error:
        if error.name.startswith("base"):
            raise
        last = error.name.rpartition(".")[2]
        name = joined(where, (names or {}).get(last, last))
        raise ParameterError(name, error.value, error.allowed, error.hint) from error


def joined(where: str, key: str) -> str:
    """Return the path of a key in a table; the file itself has an empty one."""
    return f"{where}.{key}" if where else key
