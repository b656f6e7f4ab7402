"""What can be called from outside, found by inspection of the package.

The public names are those of `public_surface`, of errors and of `view`. Of a class
its constructor, class methods, static methods, methods and properties count, as far as a class of
this package defines them, and what every object does: it is shown, compared, copied and pickled.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from operator import attrgetter
from types import ModuleType
from typing import Any

from public_surface import surface

import hexapod_pin

FUNCTION, CONSTRUCTOR, CLASS_METHOD = "function", "constructor", "class method"
METHOD, PROPERTY, COPIES = "method", "property", "copies"

PACKAGE = "hexapod_pin"


@dataclass(frozen=True)
class PublicCall:
    """One thing that can be called.

    Attributes:
        name: dotted, such as "Gait.tripod", "view.write_html", "Trace()" or "Trace (copies)".
        kind: one of the six above; a static method counts as a class method.
        owner: the module, or the class.
        attribute: of the owner; empty: the owner itself.
    """

    name: str
    kind: str
    owner: Any
    attribute: str = ""

    @property
    def target(self) -> Callable[..., Any]:
        """What is called, of a method without its instance."""
        return getattr(self.owner, self.attribute) if self.attribute else self.owner  # type: ignore[no-any-return]

    @property
    def needs_instance(self) -> bool:
        """Whether it is called on an instance of its owner."""
        return self.kind in (METHOD, PROPERTY, COPIES)

    def parameters(self) -> Mapping[str, inspect.Parameter]:
        """Return the parameters that a caller gives, those of parameter sets by their fields."""
        if self.kind in (PROPERTY, COPIES):
            return {}
        try:
            found = dict(inspect.signature(self.target).parameters)
        except ValueError:  # an exception without a constructor of its own
            return {}
        found.pop("self", None)
        return found


@cache
def public_calls() -> Mapping[str, PublicCall]:
    """Return all public calls by name."""
    found = [call for name, value in surface().items() for call in _calls(name, value)]
    for room in (hexapod_pin.errors, hexapod_pin.view):
        prefix = room.__name__.rpartition(".")[2]
        for name in _names_of(room):
            found += _calls(f"{prefix}.{name}", getattr(room, name), f"{prefix}.{name}")
    return {call.name: call for call in found}


@cache
def public_classes() -> tuple[type, ...]:
    """Return all public classes."""
    return tuple(call.owner for call in public_calls().values() if call.kind == CONSTRUCTOR)


def _calls(place: str, value: Any, shown: str = "") -> Iterator[PublicCall]:
    """Yield what can be called of a public name, which is found at a place of the package."""
    room, _, name = place.rpartition(".")
    dotted = shown or name
    if inspect.isclass(value):
        yield PublicCall(f"{dotted}()", CONSTRUCTOR, value)
        yield PublicCall(f"{dotted} (copies)", COPIES, value)
        yield from members_of(value, dotted)
    elif callable(value):
        owner = attrgetter(room)(hexapod_pin) if room else hexapod_pin
        yield PublicCall(dotted, FUNCTION, owner, name)


def _names_of(room: ModuleType) -> list[str]:
    """Return the public names of a module: those that it lists, else those that it defines."""
    listed = getattr(room, "__all__", None)
    if listed is not None:
        return list(listed)
    return [
        name for name, value in vars(room).items()
        if not name.startswith("_") and getattr(value, "__module__", "") == room.__name__
    ]  # fmt: skip


def members_of(owner: type, dotted: str) -> Iterator[PublicCall]:
    """Yield the methods and properties of a class that the package defines."""
    for name, value in inspect.getmembers_static(owner):
        if name.startswith("_") or not _is_ours(owner, name):
            continue
        kind = _kind_of(value)
        if kind:
            yield PublicCall(f"{dotted}.{name}", kind, owner, name)


def _is_ours(owner: type, name: str) -> bool:
    return any(
        name in vars(base) and base.__module__.partition(".")[0] == PACKAGE
        for base in owner.__mro__
    )


def _kind_of(value: Any) -> str:
    if isinstance(value, property | cached_property):
        return PROPERTY
    if isinstance(value, classmethod | staticmethod):
        return CLASS_METHOD
    return METHOD if inspect.isfunction(value) else ""
