"""Every public callable refuses what its annotations do not allow, before it runs."""

from __future__ import annotations

import importlib
import inspect
import random
import re
import typing
from collections import abc
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz import sound
from fuzz.left_out import LEFT_OUT, SOUND_ONLY
from fuzz.public_names import (
    CONSTRUCTOR,
    COPIES,
    FUNCTION,
    METHOD,
    PROPERTY,
    PublicCall,
    members_of,
    public_calls,
)
from public_surface import surface

from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.results import run_record
from hexapod_pin.type_checks import _Unknown, type_hints

ROOMS = (
    "robot drive control scene simulation results study interchange ground.contact ground.terrain"
).split()

AT_EVERY_STEP = {
    "Command()", "Measurement()", "FootControl.update", "FirmwareControl.update",
    "control.SensorReader.read", "control.LegGroup.joint_angles", "control.LegGroup.feet",
}  # fmt: skip
"""What a run calls at every step: checked where it is used, or when it has failed."""

PATH = re.compile(r"[A-Za-z_]\w*(\.\w+|\[[^\]]*\])*(, \w+)*")
"""What the name of a parameter looks like."""


@cache
def calls() -> dict[str, PublicCall]:
    """Return all public callables: those of the package, of its rooms, and the facts of a run."""
    found = dict(public_calls())
    classes = {call.owner for call in found.values() if call.kind == CONSTRUCTOR}
    facts = [name for name, one in vars(run_record).items() if _is_facts(one)]
    rooms = [(name, importlib.import_module(f"hexapod_pin.{name}")) for name in ROOMS]
    listed = [(name, room, list(room.__all__)) for name, room in rooms]
    for prefix, room, names in (*listed, ("run_record", run_record, facts)):
        for name in names:
            value, dotted = getattr(room, name), f"{prefix}.{name}"
            if inspect.isclass(value) and not typing.is_typeddict(value) and value not in classes:
                classes.add(value)
                found[f"{dotted}()"] = PublicCall(f"{dotted}()", CONSTRUCTOR, value)
                found |= {call.name: call for call in members_of(value, dotted)}
            elif inspect.isfunction(value) and value not in surface().values():
                found[dotted] = PublicCall(dotted, FUNCTION, room, name)
    return {
        name: call for name, call in found.items()
        if call.kind not in (PROPERTY, COPIES) and not _is_of_others(call)
    }  # fmt: skip


def _is_facts(value: Any) -> bool:
    return inspect.isclass(value) and issubclass(value, run_record.Facts)


def _is_of_others(call: PublicCall) -> bool:
    """Tell whether only the package calls it, or a user implements it."""
    owner = call.owner if isinstance(call.owner, type) else object
    return issubclass(owner, BaseException | tuple) or getattr(owner, "_is_protocol", False)


def is_checked(call: PublicCall) -> bool:
    """Tell whether the arguments of a call are checked before it runs."""
    if call.kind == CONSTRUCTOR:
        own: Any = call.owner.__init__
        made = hasattr(call.owner, "__post_init__") or hasattr(call.owner, "model_fields")
        return made or hasattr(own, "__wrapped__")
    target: Any = call.target
    return hasattr(target, "__wrapped__") or call.attribute.startswith("model_")


def test_every_public_callable_is_checked() -> None:
    """But for those that a run calls at every step."""
    marked = {name for name, call in calls().items() if hasattr(call.target, "_every_step")}
    assert marked == AT_EVERY_STEP
    assert [name for name in calls().keys() - marked if not is_checked(calls()[name])] == []


ODD: tuple[Any, ...] = (
    True, 1.5, "1.5", b"x", 1j, None, [], {}, {1: 2}, object(), int, [True], ["x"], [None],
    np.array("x"), np.array([None]), np.zeros(2, complex),
)  # fmt: skip


def fits(kind: Any, value: Any, *, table: bool) -> bool:
    """Tell whether a value may be of a type, by rules written anew; in doubt it is."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return fits(parts[0], value, table=table)
    if parts and "nion" in getattr(origin, "__name__", str(origin)):
        return any(fits(part, value, table=table) for part in parts)
    plain = {
        float: (float, int, np.number), int: (int, np.integer), bool: (bool,), str: (str,),
        Path: (str, Path), type(None): (type(None),),
    }  # fmt: skip
    if kind in plain:
        return isinstance(value, plain[kind]) and (kind is bool or not isinstance(value, bool))
    if origin in (dict, abc.Mapping):
        return isinstance(value, dict) and all(fits(parts[0], key, table=table) for key in value)
    if origin in (tuple, list, abc.Sequence, abc.Collection, abc.Iterable):
        items = isinstance(value, list) or (isinstance(value, np.ndarray) and value.ndim > 0)
        return items and all(fits(parts[0], one, table=table) for one in value)
    kind = origin or kind
    if kind is np.ndarray:
        return isinstance(value, int | float | list | np.ndarray)
    unknown = getattr(kind, "_is_protocol", False) or kind is _Unknown
    if unknown or not isinstance(kind, type) or not kind.__module__.startswith("hexapod_pin"):
        return True
    if table and hasattr(kind, "model_fields") and isinstance(value, dict):
        return True
    return isinstance(value, kind)


def kinds(call: PublicCall) -> Iterator[tuple[str, Any]]:
    """Yield the parameters of a call, with their types."""
    fields = getattr(call.owner, "model_fields", {}) if call.kind == CONSTRUCTOR else {}
    target: Any = call.owner.__init__ if call.kind == CONSTRUCTOR else call.target
    hints = type_hints(target, call.owner if isinstance(call.owner, type) else None)
    for name, parameter in call.parameters().items():
        named = parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
        if named and f"{call.name}.{name}" not in SOUND_ONLY:
            yield name, hints.get(name, fields[name].annotation if name in fields else Any)


@pytest.mark.parametrize("name", sorted(calls().keys() - AT_EVERY_STEP - set(LEFT_OUT)))
def test_odd_arguments_end_in_one_error_that_names_a_path(name: str) -> None:
    """What cannot be of an argument's type is refused; nothing ends in another exception."""
    call = calls()[name]
    instances = sound.instances(call.owner) if isinstance(call.owner, type) else [None]
    if not instances and call.kind == METHOD:
        return
    own = instances[:1] if call.kind == METHOD else []
    table = hasattr(call.owner, "model_fields")
    optional = getattr(call.owner, "_may_be_none", ())
    for argument, kind in kinds(call):
        given = sound.arguments(call, random.Random(argument), (instances or [None])[0])
        for value in ODD:
            if fits(kind, value, table=table) or (value is None and argument in optional):
                continue
            with pytest.raises(HexapodError) as caught:
                call.target(*own, **{**given, argument: value})
                pytest.fail(f"{argument} = {value!r} is taken")
            if isinstance(caught.value, ParameterError):
                assert PATH.fullmatch(caught.value.name), caught.value
