"""The doors: each draws one input from a seeded generator and pushes it through."""

from __future__ import annotations

import inspect
import json
import os
import random
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import hexapod_pin as hp
from hexapod_pin.spec import Spec
from hexapod_pin.validation.fuzz import material
from hexapod_pin.validation.fuzz.values import odd_data, odd_text, odd_value

Door = Callable[[random.Random], None]


def urdf(dice: random.Random) -> None:
    """A URDF with changes."""
    path = material.folder() / f"{os.getpid()}.urdf"
    path.write_text(odd_text(material.urdf_text(), dice), encoding="utf-8")
    material.used(hp.load_robot(path, mend=dice.random() < 0.2))


def scene(dice: random.Random) -> None:
    """A scene as TOML with changes."""
    from hexapod_pin.simulation.scene import Scene

    material.used(Scene.from_toml(odd_text(material.scene().to_toml(), dice)))


def case(dice: random.Random) -> None:
    """A case as TOML with changes."""
    from hexapod_pin.simulation.case import Case

    found = Case.from_toml(odd_text(material.case_text(), dice))
    if (found.duration or 0.0) <= 0.02:
        found.with_defaults(limits=hp.WorkLimits(evaluations=3e4, steps=1e4)).run()


def parameters(dice: random.Random) -> None:
    """A parameter set with odd fields."""
    kinds = [getattr(hp, name) for name in hp.__all__ if name != "__version__"]
    specs = [kind for kind in kinds if inspect.isclass(kind) and issubclass(kind, Spec)]
    kind = dice.choice(specs)
    names = [name for name in kind.model_fields if name != "kind"]
    fields = {name: odd_value(dice) for name in names if dice.random() < 0.7}
    str(kind(**fields))


SIMULATED = ("duration", "accuracy", "torque_accuracy", "estimate", "method", "step", "sample",
             "record", "initial", "progress", "limits", "allow")  # fmt: skip


def settings(dice: random.Random) -> None:
    """A run with odd settings."""
    given = {"duration": 2e-3, **{name: odd_value(dice) for name in dice.sample(SIMULATED, 2)}}
    given.setdefault("limits", hp.WorkLimits(evaluations=3e4, steps=1e4, memory=1e8))
    if given["limits"] is None or given.get("allow"):
        given |= {"limits": hp.WorkLimits(evaluations=3e4, steps=1e4, memory=1e8)}
    hp.simulate(material.scene(), material.control(), **given)


GRIDS = ("run_sweep", "select_motors", "torque_map", "gait_energy", "tune")
"""Calls that run many walks, for minutes where nothing is wrong."""


def arguments(dice: random.Random) -> None:
    """A public call with odd arguments."""
    names = [name for name in hp.__all__ if inspect.isroutine(getattr(hp, name, None))]
    names += ["State", "Checkpoint", "HoldPosture", "KinematicControl", "SampledTrajectory",
              "Scene", "Case", "Session", "FootControl", "JointMotion", "ArcWalk"]  # fmt: skip
    name = dice.choice([one for one in names if one not in GRIDS])
    public = getattr(hp, name)
    given = {}
    for parameter in inspect.signature(public).parameters.values():
        needed = parameter.default is parameter.empty
        if needed or dice.random() < 0.3:
            given[parameter.name] = _sound(parameter.name) if dice.random() < 0.6 else None
            if given[parameter.name] is None:
                given[parameter.name] = odd_value(dice)
    found = public(**given)
    if inspect.isgenerator(found):
        next(found, None)


def _sound(name: str) -> Any:
    """Return something that arguments of this name take; None where nothing is known."""
    return {
        "scene": material.scene(), "robot": material.robot(), "trace": material.trace(),
        "run": material.trace(), "controller": material.control(), "duration": 2e-3,
        "gait": material.control().gait, "cases": [], "scenes": {"a": material.scene()},
    }.get(name)  # fmt: skip


def damaged_trace(dice: random.Random) -> None:
    """A trace's file with bytes changed or cut off."""
    data = bytearray(material.trace_bytes())
    if dice.random() < 0.3:
        data = data[: dice.randrange(len(data))]
    for _ in range(dice.choice((0, 1, 4, 30))):
        if data:
            data[dice.randrange(len(data))] = dice.randrange(256)
    path = material.folder() / f"{os.getpid()}.nc"
    path.write_bytes(data)
    _read(hp.load_trace(path))


def forged_trace(dice: random.Random) -> None:
    """A trace whose arrays and texts are others, saved with a digest that matches."""
    path = material.folder() / f"{os.getpid()}.nc"
    try:
        _forged(material.trace(), dice).save(path)
    except (TypeError, ValueError, AttributeError):  # no such file can be written
        return
    _read(hp.load_trace(path))


def _forged(trace: hp.Trace, dice: random.Random) -> hp.Trace:
    """Return a trace with other numbers or texts."""
    if dice.random() < 0.5:
        return replace(trace, meta=odd_data(dict(trace.meta), dice))
    name = dice.choice(("time", "q", "v", "torque", "foot_force", "foot_gap", "com"))
    array = getattr(trace, name).copy()
    array[dice.randrange(len(array))] = dice.choice((0.0, -1.0, 1e300, 1e10, float("nan")))
    return replace(trace, **{name: array})


def _read(trace: hp.Trace) -> None:
    for use in (hp.stability, hp.walk_verdict, hp.phase_torques, hp.torque_budget):
        try:
            shown = str(use(trace))
        except hp.errors.HexapodError:
            continue
        if "nan" in shown.split():
            raise ArithmeticError(f"{use.__name__} shows nan")
    str(trace.checkpoint)


def checkpoint(dice: random.Random) -> None:
    """A checkpoint's data with changes, gone on from."""
    data = odd_data(material.trace().checkpoint.to_dict(), dice)
    start = hp.Checkpoint.from_dict(data)
    hp.simulate(material.scene(), material.control(), duration=2e-3, initial=start, estimate=False,
                limits=hp.WorkLimits(evaluations=3e4, memory=1e8))  # fmt: skip


def summary(dice: random.Random) -> None:
    """A summary's file with changes."""
    path = material.folder() / f"{os.getpid()}.json"
    path.write_text(json.dumps(odd_data(material.summary_data(), dice), default=str), "utf-8")
    found = hp.load_summary(path)
    str(found.torque_peak)


def height_field(dice: random.Random) -> None:
    """Heights of ground, and a step on them."""
    given = {"spacing": 0.05} if dice.random() < 0.7 else {"spacing": odd_value(dice)}
    rows = [
        [dice.choice((0.0,) * 20 + (0.001, -0.002, 1e9, float("nan"))) for _ in range(4)]
        for _ in "abcd"
    ]
    heights = rows if dice.random() < 0.7 else odd_value(dice)
    ground = hp.HeightField.from_array(heights, **given)
    material.used(hp.Scene(material.robot(), terrain=ground))


def session(dice: random.Random) -> None:
    """Commands to a session."""
    led = hp.Session(material.scene(), accuracy=1e-3, limits=hp.WorkLimits(evaluations=3e4))
    given = {name: odd_value(dice) for name in ("q", "v", "torque", "ramp") if dice.random() < 0.4}
    led.command(**given)
    led.advance(dice.choice((1e-3, odd_value(dice))))
    led.measure()


DOORS: Mapping[str, Door] = {
    door.__name__: door
    for door in (urdf, scene, case, parameters, settings, arguments, damaged_trace, forged_trace,
                 checkpoint, summary, height_field, session)
}  # fmt: skip
"""All doors by name."""
