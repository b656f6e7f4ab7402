"""Doors: each draws one input from a seeded generator and pushes it through."""

from __future__ import annotations

import contextlib
import copy
import inspect
import io
import json
import os
import pickle
import random
import shlex
from dataclasses import replace
from typing import Any

import numpy as np

import hexapod_pin as hp
from fuzz import material, sound
from fuzz.command_input import COMMANDS, odd_options, write_sound_files
from fuzz.command_process import command_process
from fuzz.public_names import (
    COPIES,
    LONG_NUMBERS,
    METHOD,
    PROPERTY,
    PublicCall,
    public_calls,
    walked,
)
from fuzz.values import (
    OTHERS,
    FaultFound,
    described,
    is_wrong_call,
    odd_data,
    odd_text,
    odd_toml,
    odd_value,
    require_finite,
)
from fuzz.watched_folder import HAZARDS
from hexapod_pin.commands.app import main
from hexapod_pin.errors import HexapodError
from hexapod_pin.results import RunRecord
from hexapod_pin.spec import Spec

# files ----------------------------------------------------------------------------------------


def urdf(rng: random.Random) -> None:
    path = material.written("urdf", odd_text(material.urdf_text(), rng))
    material.used(hp.load_robot(path, repair=rng.random() < 0.2))


def xacro(rng: random.Random) -> None:
    path = material.written("xacro", odd_text(material.xacro_text(), rng))
    material.used(hp.load_robot(path))


def hints(rng: random.Random) -> None:
    """A robot with odd hints beside it."""
    path = material.written("urdf", material.urdf_text())
    beside = material.written("hints.toml", odd_text(material.HINTS_TEXT, rng))
    try:
        material.used(hp.load_robot(path))
    finally:
        beside.unlink()


def scene(rng: random.Random) -> None:
    material.used(hp.Scene.from_toml(odd_toml(material.scene().to_toml(), rng)))


def case(rng: random.Random) -> None:
    found = hp.Case.from_toml(odd_toml(material.case_text(), rng))
    if (found.duration or 0.0) <= 0.02:
        found.with_defaults(limits=material.LIMITS).run()


def study(rng: random.Random) -> None:
    found = hp.study.SweepStudy.from_toml(odd_toml(material.STUDY_TEXT, rng))
    str(found.case(0))


def catalog(rng: random.Random) -> None:
    path = material.written("csv", odd_text(material.catalog_text(), rng))
    require_finite(hp.load_catalog(path).table())


def _damaged(sound: bytes, rng: random.Random) -> bytes:
    data = bytearray(sound)
    if rng.random() < 0.3:
        data = data[: rng.randrange(len(data))]
    for _ in range(rng.choice((0, 1, 4, 30)) if data else 0):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def sweep_store(rng: random.Random) -> None:
    path = material.written("db", _damaged(material.store_bytes(), rng))
    found = hp.study.open_sweep(path)
    str((found.dataset, found.reasons, found.pending, found.case_time))


def damaged_trace(rng: random.Random) -> None:
    _read(hp.load_trace(material.written("nc", _damaged(material.trace_bytes(), rng))))


def forged_trace(rng: random.Random) -> None:
    """A trace whose arrays and texts are others, saved with a digest that matches."""
    path = material.new_file("nc")
    try:
        _forged(material.trace(), rng).save(path)
    except (TypeError, ValueError, AttributeError) as error:
        raise hp.errors.TraceFileError(
            str(path), f"no such file can be written ({error})"
        ) from error
    _read(hp.load_trace(path))


def _forged(trace: hp.Trace, rng: random.Random) -> hp.Trace:
    if rng.random() < 0.5:
        run = RunRecord.from_dict(odd_data(trace.run.to_dict(), rng))
        return replace(trace, run=run)
    name = rng.choice(("time", "q", "v", "torque", "foot_force", "foot_gap", "com"))
    array = getattr(trace, name).copy()
    array[rng.randrange(len(array))] = rng.choice((0.0, -1.0, 1e300, 1e10, float("nan")))
    return replace(trace, **{name: array})


def _read(trace: hp.Trace) -> None:
    for use in (hp.stability, hp.walk_verdict, hp.results.phase_torques, hp.torque_budget):
        try:
            found = use(trace)
            shown = found.table() if hasattr(found, "table") else str(found)
        except hp.errors.HexapodError:
            continue
        require_finite(shown)
    str(trace.checkpoint)


def checkpoint(rng: random.Random) -> None:
    """A checkpoint's data with changes, gone on from."""
    data = odd_data(material.trace().checkpoint.to_dict(), rng)
    start = hp.results.Checkpoint.from_dict(data)
    hp.simulate(material.scene(), material.walk(), duration=2e-3, initial=start, estimate=False,
                limits=material.LIMITS)  # fmt: skip


def summary(rng: random.Random) -> None:
    text = json.dumps(odd_data(material.summary_data(), rng), default=str)
    str(hp.load_summary(material.written("json", text)).torque_peak)


# calls ----------------------------------------------------------------------------------------


def public_call(rng: random.Random) -> None:
    """Anything that can be called from outside, with one or two odd arguments."""
    call = public_calls()[rng.choice((*walked(), *["simulate"] * 50))]  # which takes most of them
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
    if inspect.isgenerator(found):
        found = next(found, None)
    if isinstance(found, str):
        require_finite(found, *given)
    elif callable(getattr(found, "table", None)) and not isinstance(found, type):
        require_finite(found.table(), *given)
    repr(found)


def _copied(instance: Any) -> None:
    for twin in (
        copy.copy(instance), copy.deepcopy(instance), pickle.loads(pickle.dumps(instance))
    ):  # fmt: skip
        if type(twin) is not type(instance):
            raise FaultFound(f"a copy of a {type(instance).__name__} is a {type(twin).__name__}")
        if not isinstance(twin == instance, bool):
            raise FaultFound("a comparison gives neither true nor false")
    str(instance), repr(instance)


def height_field(rng: random.Random) -> None:
    spacing = 0.05 if rng.random() < 0.7 else odd_value(rng)
    heights = np.zeros((4, 4))
    heights[rng.randrange(4)] = rng.choice((0.0, 0.001, -0.002, 1e9, np.nan))
    odd = heights if rng.random() < 0.7 else odd_value(rng)
    ground = hp.HeightField.from_array(odd, spacing=spacing)
    material.used(hp.Scene(material.robot(), terrain=ground))


def session(rng: random.Random) -> None:
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
    for name in ("time", "q", "v", "torque", "foot_force", "com"):
        if not np.isfinite(getattr(trace, name)).all():
            raise FaultFound(f"{name} of a run is not finite")


# commands -------------------------------------------------------------------------------------


STATUSES = {0, 1, 2, 3}
"""Done, failed, used wrongly, does not walk."""

LONG = ("view", "--processes")
"""What stays until Ctrl-C, and starts processes."""


def command_line(rng: random.Random) -> None:
    sound = rng.choice([words for words in COMMANDS if not {*LONG} & {*words}])
    words, shown, status = odd_options(sound, rng), io.StringIO(), 0
    tree, before = material.watched(), os.getcwd()
    tree.clear()
    write_sound_files(tree.work)
    os.chdir(tree.work)
    try:
        with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(shown):
            main(words)
    except SystemExit as end:
        status = int(end.code or 0)
    finally:
        os.chdir(before)
    if status not in STATUSES:
        raise FaultFound(f"status {status} of {shlex.join(words)}")
    require_finite(shown.getvalue(), *words)
    if status in (1, 2):
        raise HexapodError(f"{words} is refused")


DOORS = {
    door.__name__: door
    for door in (
        urdf, xacro, hints, scene, case, study, catalog, damaged_trace, forged_trace, sweep_store,
        checkpoint, summary, public_call, height_field, session, extremes,
        command_line, command_process,
    )
}  # fmt: skip
"""All doors by name."""

WEIGHTS = {"public_call": 8, "command_line": 2}
"""How many inputs go to a door for each that goes to another: it stands for hundreds of calls."""

SELDOM = ("command_process",)
"""Doors whose inputs are processes of their own, which take half a second each."""
