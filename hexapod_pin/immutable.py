"""Immutable records: how they are pickled and copied."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Collection
from dataclasses import MISSING, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, TypeVar

import numpy as np

from hexapod_pin.arguments import check_made, check_members

Record = TypeVar("Record", bound="Immutable")


class Immutable:
    """Base of dataclasses whose arrays and mappings nothing can write to.

    A pickle, and what `copy.copy` and `copy.deepcopy` return, holds every field to the bit and is
    as immutable as the original: arrays are write-protected, which NumPy's own pickles are not, and
    mappings are read-only, which Python cannot pickle. Nothing is checked again. What is computed
    when it is first needed (a `cached_property`, or a field with a default that `__init__` does not
    take) stays behind, and is computed again.
    """

    __slots__ = ()
    _may_be_none: ClassVar[Collection[str]] = ()
    """Fields that may be None whatever their annotations say."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Check the arguments of the constructor and of public methods."""
        super().__init_subclass__(**options)
        check_members(cls)
        if "__init__" not in vars(cls):
            check_made(cls)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the fields, and the names of those that nothing can write to."""
        kind = type(self)
        computed = _computed(kind).keys()
        held = {
            name: value
            for name, value in vars(self).items()
            if name not in computed and not isinstance(getattr(kind, name, None), cached_property)
        }
        protected = tuple(name for name, value in held.items() if _is_protected(value))
        for name in protected:
            if isinstance(held[name], MappingProxyType):
                held[name] = dict(held[name])
        return rebuilt, (kind, held, protected)


class ComparedByContent(Immutable):
    """Base of records that are equal where their pickles are, as keys of caches have to be.

    What was computed for the legs of one robot then serves another robot with the same legs.
    """

    @cached_property
    def _content(self) -> bytes:
        return content_digest(self)

    def __eq__(self, other: object) -> bool:
        """Compare the pickled fields."""
        if self is other:
            return True
        return isinstance(other, type(self)) and self._content == other._content

    def __hash__(self) -> int:
        """Return a hash of the pickled fields."""
        return hash(self._content)


def content_digest(value: object) -> bytes:
    """Return the SHA-256 of a value's pickle: a key for caches."""
    return hashlib.sha256(pickle.dumps(value)).digest()


def rebuilt(kind: type[Record], held: dict[str, Any], protected: tuple[str, ...]) -> Record:
    """Return the record that `Immutable.__reduce__` has taken apart."""
    record = object.__new__(kind)
    vars(record).update(_computed(kind) | held)
    vars(record).update({name: _protected(held[name]) for name in protected})
    return record


def _computed(kind: Any) -> dict[str, Any]:
    """Return the fields that `__init__` does not take and that begin with a default."""
    found = {}
    for one in fields(kind):
        if one.init:
            continue
        if one.default_factory is not MISSING:
            found[one.name] = one.default_factory()
        elif one.default is not MISSING:
            found[one.name] = one.default
    return found


def _is_protected(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return not value.flags.writeable
    return isinstance(value, MappingProxyType)


def _protected(value: Any) -> Any:
    """Return an array, or a mapping with the arrays in it, that nothing can write to."""
    mapping = isinstance(value, dict)
    for array in value.values() if mapping else (value,):
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return MappingProxyType(value) if mapping else value
