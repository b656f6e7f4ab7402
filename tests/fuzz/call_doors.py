"""Doors of calls: each draws odd arguments from a seeded generator and calls with them."""

from __future__ import annotations

import copy
import inspect
import pickle
import random
from collections.abc import Callable
from typing import Any

import hexapod_pin as hp
from fuzz import material, sound
from fuzz.public_names import (
    CONSTRUCTOR,
    COPIES,
    LONG_NUMBERS,
    METHOD,
    PROPERTY,
    PublicCall,
    public_calls,
    walked,
)
from fuzz.shown import FaultFound, described, is_wrong_call, require_finite, require_finite_data
from fuzz.values import OTHERS, odd_value
from fuzz.watched_folder import HAZARDS
from hexapod_pin.errors import HexapodError
from hexapod_pin.spec import Spec


def public_call(rng: random.Random) -> None:
    """Anything that can be called from outside, with one or two odd arguments."""
    _call(public_calls()[rng.choice(walked())], rng)


def parameters(rng: random.Random) -> None:
    """A parameter set with odd fields."""
    calls = [call for call in public_calls().values() if call.kind == CONSTRUCTOR]
    _call(rng.choice([call for call in calls if issubclass(call.owner, Spec)]), rng)


def settings(rng: random.Random) -> None:
    """A run with odd settings."""
    _call(public_calls()["simulate"], rng)


def _call(call: PublicCall, rng: random.Random) -> None:
    try:
        _called(call, rng)
    except (HexapodError, FaultFound):
        raise
    except Exception as error:
        if is_wrong_call(error):
            raise
        raise FaultFound(f"{call.name}: {described(error)}") from error


def _called(call: PublicCall, rng: random.Random) -> None:
    instance, changed = None, list[str]()
    if isinstance(call.owner, type):
        instance = rng.choice(sound.instances(call.owner))
        needed = call.kind in (METHOD, PROPERTY, COPIES)
        if needed and isinstance(instance, Spec) and rng.random() < 0.5:
            name = rng.choice(list(type(instance).model_fields))
            fields = {one: getattr(instance, one) for one in type(instance).model_fields}
            instance = type(instance)(**{**fields, name: odd_value(rng)})
            changed = [repr(instance)]
    if call.kind == COPIES:
        _copied(instance)
    elif call.kind == PROPERTY:
        _shown(getattr(instance, call.attribute), *changed)
    else:
        given = sound.arguments(call, rng, instance)
        odd = _make_odd(call, given, rng)
        own = (instance,) if call.kind == METHOD else ()
        _shown(call.target(*own, **given), *odd, *changed)


def _make_odd(call: PublicCall, given: dict[str, Any], rng: random.Random) -> list[str]:
    """Make one or two arguments odd; return them as text."""
    names = call.odd_parameters()
    odd = rng.sample(names, min(len(names), rng.choice((0, 1, 1, 1, 2))))
    for name in odd:
        if name in ("path", "store", "folder") and rng.random() < 0.7:
            given[name] = material.watched().work / rng.choice(HAZARDS)
        elif f"{call.name}.{name}" in LONG_NUMBERS:
            given[name] = rng.choice(OTHERS)
        else:
            given[name] = odd_value(rng)
    return [repr(given[name]) for name in odd]


def _shown(found: Any, *given: str) -> None:
    """Show what a call returns, as a user would."""
    if inspect.isgenerator(found):
        found = next(found, None)
    if isinstance(found, str):
        require_finite(found, *given)
    elif callable(getattr(found, "table", None)) and not isinstance(found, type):
        require_finite(found.table(), *given)
    repr(found)


def _copied(instance: Any) -> None:
    """Copy, pickle, compare and show an instance."""
    for twin in (
        copy.copy(instance), copy.deepcopy(instance), pickle.loads(pickle.dumps(instance))
    ):  # fmt: skip
        if type(twin) is not type(instance):
            raise FaultFound(f"a copy of a {type(instance).__name__} is a {type(twin).__name__}")
        if not isinstance(twin == instance, bool):
            raise FaultFound("a comparison gives neither true nor false")
    str(instance), repr(instance)


def height_field(rng: random.Random) -> None:
    """Heights of ground, and a step on them."""
    given = {"spacing": 0.05} if rng.random() < 0.7 else {"spacing": odd_value(rng)}
    rows = [
        [rng.choice((0.0,) * 20 + (0.001, -0.002, 1e9, float("nan"))) for _ in range(4)]
        for _ in "abcd"
    ]
    heights = rows if rng.random() < 0.7 else odd_value(rng)
    ground = hp.HeightField.from_array(heights, **given)
    material.used(hp.Scene(material.robot(), terrain=ground))


def session(rng: random.Random) -> None:
    """Commands to a session."""
    led = sound.session()
    given = {name: odd_value(rng) for name in ("q", "v", "torque", "ramp") if rng.random() < 0.4}
    led.command(**given)
    led.advance(rng.choice((1e-3, odd_value(rng))))
    led.measure()


METHODS = ("extrapolated-euler", "ndf", "dop853", "robust", "implicit-euler", "rk4")
"""Three that keep an accuracy, and three of a fixed step."""


def extremes(rng: random.Random) -> None:
    """A sound scene with one or two allowed quantities at their ends, run for a moment."""
    size = rng.choice((1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e15))
    contact = rng.choice((hp.Contact.accurate, hp.Contact.s1, hp.Contact.s2))()
    normal, friction = contact.normal, contact.friction
    if hasattr(normal, "stiffness") and rng.random() < 0.5:
        normal = normal.model_copy(update={"stiffness": normal.stiffness * size})
    if hasattr(friction, "mu") and rng.random() < 0.5:
        friction = friction.model_copy(update={"mu": friction.mu * size})
    scene = hp.Scene(
        material.robot(),
        contact=hp.Contact(normal=normal, friction=friction),
        servo=hp.Servo(kp=rng.choice((100.0, 100.0 * size)), kd=rng.choice((1.0, size))),
        gravity=(0.0, 0.0, -rng.choice((9.81, 9.81 * size))),
        loads=[hp.Payload("base_link", mass=rng.choice((0.1, size)), position=(0.0, 0.0, 0.1))],
    )
    method: dict[str, Any] = {"method": rng.choice(METHODS)}
    if method["method"] in METHODS[:3]:
        method["accuracy"] = rng.choice((1e-3, 1e-6))
    else:
        method["step"] = rng.choice((1e-3, 1e-5))
    trace = hp.simulate(
        scene, material.walk(), duration=0.01, estimate=False, limits=material.LIMITS, **method
    )
    require_finite_data(trace)


CALL_DOORS: tuple[Callable[[random.Random], None], ...] = (
    parameters, settings, public_call, height_field, session, extremes,
)  # fmt: skip
