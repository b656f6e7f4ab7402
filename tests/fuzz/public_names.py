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
from typing import Any

from public_surface import surface

import hexapod_pin
from hexapod_pin.errors import HexapodError

FUNCTION, CONSTRUCTOR, CLASS_METHOD = "function", "constructor", "class method"
METHOD, PROPERTY, COPIES = "method", "property", "copies"

RUN = "called by a run with what the run made itself"

LEFT_OUT: Mapping[str, str] = {
    "view.view": "opens a browser, and stays until Ctrl-C",
    "view.live_viewer": "starts a server that a browser connects to",
    "FeedbackController()": "a protocol: nothing is made of it",
    "TorqueMap.from_group": "takes what a file was read into: the files have doors of their own",
    "GaitEnergy.from_group": "takes what a file was read into: the files have doors of their own",
    "Summary.from_data": "takes what a run or a file was read into",
    "FootControl.update": RUN, "FeedbackController.update": RUN,
}  # fmt: skip
"""Public calls that no input goes to."""

SOUND_ONLY: Mapping[str, str] = {
    "run_sweep.scheduler": "waits for as long as Dask does for a scheduler that does not answer",
    "register_controller.kind": "a kind that is registered stays registered",
}
"""Parameters that are only given what they take."""

LONG_NUMBERS = ("tune.budget", "tune.population")
"""Parameters that are given anything odd but numbers: large ones are allowed, and take long."""


@dataclass(frozen=True)
class PublicCall:
    """One thing that can be called, such as "Gait.tripod", "Trace()" or "Trace (copies)".

    Its owner is the module or the class; a static method counts as a class method.
    """

    name: str
    kind: str
    owner: Any
    attribute: str = ""

    @property
    def target(self) -> Callable[..., Any]:
        return getattr(self.owner, self.attribute) if self.attribute else self.owner  # type: ignore[no-any-return]

    @property
    def is_called(self) -> bool:
        return self.kind not in (PROPERTY, COPIES)

    def parameters(self) -> Mapping[str, inspect.Parameter]:
        """Return the parameters that a caller gives, those of parameter sets by their fields."""
        if not self.is_called:
            return {}
        try:
            found = dict(inspect.signature(self.target).parameters)
        except ValueError:  # an exception without a constructor of its own
            return {}
        found.pop("self", None)
        return found

    def odd_parameters(self) -> list[str]:
        if self.kind == CONSTRUCTOR and issubclass(self.owner, HexapodError):
            return []  # an error is made by the package itself
        return [
            name for name, one in self.parameters().items()
            if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)
            and f"{self.name}.{name}" not in SOUND_ONLY
        ]  # fmt: skip


@cache
def public_calls() -> Mapping[str, PublicCall]:
    named = {name.rpartition(".")[2]: one for name, one in surface().items()}
    for room in (hexapod_pin.errors, hexapod_pin.view):
        prefix = room.__name__.rpartition(".")[2]
        own = [name for name, one in vars(room).items() if _is_of(one, room.__name__)]
        for name in getattr(room, "__all__", own):
            named[f"{prefix}.{name}"] = getattr(room, name)
    return {call.name: call for name, one in named.items() for call in _calls(name, one)}


def _is_of(value: Any, module: str) -> bool:
    public = not getattr(value, "__name__", "_").startswith("_")
    return public and getattr(value, "__module__", "") == module


@cache
def public_classes() -> tuple[type, ...]:
    return tuple(call.owner for call in public_calls().values() if call.kind == CONSTRUCTOR)


@cache
def walked() -> tuple[str, ...]:
    return tuple(name for name in public_calls() if name not in LEFT_OUT)


def _calls(name: str, value: Any) -> Iterator[PublicCall]:
    if inspect.isclass(value):
        yield PublicCall(f"{name}()", CONSTRUCTOR, value)
        yield PublicCall(f"{name} (copies)", COPIES, value)
        yield from members_of(value, name)
    elif callable(value):
        yield PublicCall(name, FUNCTION, inspect.getmodule(value), value.__name__)


def members_of(owner: type, dotted: str) -> Iterator[PublicCall]:
    """Yield the methods and properties of a class that the package defines."""
    ours = [base for base in owner.__mro__ if base.__module__.startswith("hexapod_pin")]
    for name, value in inspect.getmembers_static(owner):
        kind = _kind_of(value)
        if kind and not name.startswith("_") and any(name in vars(base) for base in ours):
            yield PublicCall(f"{dotted}.{name}", kind, owner, name)


def _kind_of(value: Any) -> str:
    if isinstance(value, property | cached_property):
        return PROPERTY
    if isinstance(value, classmethod | staticmethod):
        return CLASS_METHOD
    return METHOD if inspect.isfunction(value) else ""
