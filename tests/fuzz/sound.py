"""Sound instances of every public class, and sound arguments of every public call.

Instances are those of `public_samples` and what they are made of; arguments are made from the
annotation and the name of a parameter.
"""

from __future__ import annotations

import collections
import inspect
import random
import types
import typing
from collections import abc
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import public_samples

import hexapod_pin as hp
from fuzz import material
from fuzz.public_names import CONSTRUCTOR, PublicCall, public_classes
from hexapod_pin.type_checks import type_hints

QUICK: Mapping[str, Any] = {"accuracy": 1e-2, "threads": 1}
"""Of every call that runs something."""

EASY: Mapping[str, Any] = {"accuracy": 1e-3, "estimate": False}

LEAST = public_samples.QUICK["duration"]
"""Time in which the gait of `public_samples.walk` makes a whole steady cycle [s]."""


def crouch(values: Mapping[str, float]) -> hp.HoldPosture:
    q = np.array(material.robot().posture)
    q[1::3] += values["angle"]
    return hp.HoldPosture(q)


def height(found: Any, baseline: Any) -> float:
    return float(np.mean([run.height_mean for run in found]))


def session() -> hp.Session:
    """Return a session; unlike other instances it changes, and is made anew for each call."""
    return hp.Session(material.scene(), accuracy=1e-3, limits=material.LIMITS)


@cache
def pool() -> Mapping[type, list[Any]]:
    """Return instances by their class, those in others' fields included."""
    found: dict[type, list[Any]] = collections.defaultdict(list)
    roots = [
        hp.study.SweepStudy.from_toml(material.STUDY_TEXT), public_samples.trace().plot,
        hp.rl.WalkEnv(material.robot(), duration=0.1),
        hp.rl.WalkVectorEnv(2, material.robot(), duration=0.1),
        *public_samples.samples(material.folder()),
    ]  # fmt: skip
    for one in public_samples.within(roots, set()):
        found[type(one)].append(one)
    return found


def instances(owner: type) -> list[Any]:
    if owner is hp.Session:
        return [session()]
    if owner is hp.feedback.FeedbackController:  # a protocol
        owner = hp.FootControl
    found = [one for kind, several in pool().items() if issubclass(kind, owner) for one in several]
    if not found and issubclass(owner, Exception | tuple):
        call = PublicCall(f"errors.{owner.__name__}()", CONSTRUCTOR, owner)
        found = [owner(**arguments(call, random.Random(0)))]
    return found


def arguments(call: PublicCall, rng: random.Random, instance: Any = None) -> dict[str, Any]:
    """Return sound arguments: what is needed, some of the others, and what keeps the call short.

    A constructor is given what an instance was made from.
    """
    given = {name: _made(one) for name, one in SMALL.get(call.name, {}).items()}
    for name, parameter in call.parameters().items():
        if parameter.kind is parameter.VAR_POSITIONAL or name in given:
            continue
        needed = (
            parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
        )
        if needed or rng.random() < 0.2:
            own = getattr(instance, name, None) if call.kind == CONSTRUCTOR else None
            if own is not None and not inspect.ismethod(own):
                given[name] = own
            elif needed:
                given[name] = argument(call, parameter, rng)
    return given


def argument(call: PublicCall, parameter: inspect.Parameter, rng: random.Random) -> Any:
    name = parameter.name
    for key in (f"{call.name}.{name}", f"{call.attribute}.{name}", name):
        if key in BY_NAME:
            return _made(BY_NAME[key])
    function, owner = call.target, call.owner
    if name == "obj":  # of `model_validate`
        return (instances(owner) or [{}])[0]
    if name == "path":
        endings = [one for one, names in NEW_FILES.items() if call.name in names.split()]
        other = "png" if call.name.startswith("view.write_") else "nc"
        return str(material.new_file(*endings or [other]))
    if isinstance(owner, type) and call.kind == CONSTRUCTOR:
        function = vars(owner).get("__init__", owner.__new__)
    known = inspect.isroutine(function) and getattr(function, "__module__", None)
    hints = type_hints(function, owner if isinstance(owner, type) else None) if known else {}
    return _of_kind(hints.get(name, parameter.annotation), rng)


def _made(entry: Any) -> Any:
    return entry() if callable(entry) else entry


def _of_kind(kind: Any, rng: random.Random) -> Any:
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return _of_kind(parts[0], rng)
    if origin is typing.Literal:
        return rng.choice(parts)
    if kind in PLAIN:
        return PLAIN[kind]
    if origin in (typing.Union, types.UnionType):
        if len(parts) > 6:  # NumPy's ArrayLike
            return [0.0, 0.1]
        return _of_kind(rng.choice([part for part in parts if part is not type(None)]), rng)
    if origin is tuple:
        return tuple(_of_kind(part, rng) for part in parts if part is not ...)
    if origin in (list, abc.Sequence, abc.Iterable, abc.Collection):
        return [_of_kind(parts[0], rng)]
    if origin in (dict, abc.Mapping):
        return {_of_kind(parts[0], rng): _of_kind(parts[1], rng)}
    if origin is abc.Callable:
        return lambda *given: given[0]
    kind = origin or kind
    if kind is np.ndarray:
        return np.zeros(2)
    if isinstance(kind, type) and (kind in public_classes() or instances(kind)):
        return rng.choice(instances(kind))
    return None


PLAIN: Mapping[Any, Any] = {
    float: 0.1, int: 2, bool: True, str: "tripod", type(None): None, Any: 0.1,
    Path: Path("new.nc"), BaseException: ValueError("a"),
}  # fmt: skip


NEW_FILES: Mapping[str, str] = {
    "html": "view.write_html view.write_side_by_side view.write_study_report "
    "view.write_selection_report",
    "json": "Comparison.save Summary.save",
    "mcap": "write_mcap",
    "yaml": "write_joint_trajectory",
    "csv": "write_servo_ticks",
}
"""Endings of files that calls write; of other pictures: png, of others: nc."""


def _soil() -> Any:
    from hexapod_pin.ground.contact.soil import SOILS

    return next(iter(SOILS.values()))


def _first(owner: type) -> Any:
    return lambda: instances(owner)[0]


def _saved(owner: type, ending: str) -> Any:
    return lambda: instances(owner)[0].save(material.new_file(ending))


def _study_parts() -> dict[str, Any]:
    return {"a": instances(hp.study.TorqueMap)[0]}


def _walk_plan() -> hp.motion.WalkPlan:
    return hp.motion.WalkPlan(material.robot(), material.walk().gait)


_GIVEN: Mapping[str, Any] = {
    "robot": material.robot,
    "scene": material.scene,
    "trace run dynamic slow": public_samples.trace,
    "controller walk": material.walk,
    "gait": lambda: material.walk().gait,
    "cases": lambda: [hp.Case(material.scene(), material.walk(), duration=2e-3, **EASY)],
    "initial state": lambda: material.robot().stand(),
    "q": lambda: material.robot().stand().q,
    "v": lambda: material.robot().stand().v,
    "duration step": 2e-3,
    "sample Session.advance.until": 1e-3,
    "size KinematicControl.plan_part.until": 1.0,
    "since": 0.0,
    "time spacing": 0.5,
    "Amplification.at.time": 0.01,
    "acceleration.time derivatives.time value_and_rate.time": lambda: np.array([0.0, 0.5]),
    "source": "kharagpur",
    "study": _first(hp.study.SweepStudy),
    "case": _first(hp.Case),
    "measurement": _first(hp.feedback.Measurement),
    "vary": lambda: [{"input": "stroke", "values": [0.06, 0.08]}],
    "points": [[0.0, 0.0, 0.1]],
    "traces": lambda: {"a": public_samples.trace()},
    "scenes": lambda: {"a": material.scene()},
    "parts": dict,
    "method": "robust",
    "threads polygons seed": 1,
    "postures": 2,
    "legs": 6,
    "kind kind.name": "coxa",
    "joint joint.name joint_index.name": lambda: material.robot().joint_names[0],
    "leg": "left_front",
    "Robot.leg.name": lambda: material.robot().legs[0].name,
    "foot.name": lambda: material.robot().feet[0].name,
    "links": ("base_link",),
    "link": "base_link",
    "Contact.preset.name": "s1",
    "Contact.soil.name": "sand",
    "urdf_path.name": "athena",
    "Stability.least.name": "static_margin",
    "model": "AX-12A",
    "quantity": "torque_peak",
    "uncertainty.values": lambda: {"torque_peak": np.arange(64.0)},
    "cost": "cost_of_transport",
    "Scene.from_toml.text": lambda: material.scene().to_toml(),
    "Case.from_toml.text": material.case_text,
    "SweepStudy.from_toml.text": material.SHORT_STUDY,
    "z": [[0.0, 0.0]] * 3,
    "Checkpoint.from_dict.data": lambda: dict(material.trace().checkpoint.to_dict()),
    "voltage": 12.0,
    "supply": 11.0,
    "of.scene mean.scene change.scene of.controller mean.controller": "a",
    "change.controller": "b",
    "metric error_of.name RelativeObjective.value.name": "torque_rms",
    "record": lambda: hp.load_catalog().records[0],
    "simulate.record Session().record Case().record": ["torque"],
    "errors.NotRecordedError().record": ["com"],
    "Gait.feet_down.phase": [0.0, 0.5],
    "HuntCrossley.soil.soil": _soil,
    "RelativeObjective.value.run": _first(hp.Summary),
    "Segment.box.size": (0.1, 0.02, 0.02),
    "Trunk.solid.size": (0.2, 0.1, 0.05),
    "limits": material.LIMITS,
    "box.limits rod.limits": (-1.0, 1.0),
    "phase": "retraction",
    "AdamsImpact.from_mm.exponent": 1.5,
    "Gait.custom.phases": [0.0, 0.5] * 3,
    "Gait.custom.duty": 0.6,
    "load": 10.0,
    "JointDemand.of_kinds.kinds": ("coxa",),
    "posture": lambda: list(material.robot().posture),
    "Scene.require_unloaded.where": "here",
    "JointDemand.torque_rms_with_armature.armature": lambda: np.zeros(18),
    "of_samples.torque of_samples.speed": lambda: np.zeros((3, 18)),
    "of_samples.time": lambda: np.arange(3.0),
    "write_study.parts": _study_parts,
    "load_study.path": lambda: hp.study.write_study(material.new_file("nc"), _study_parts()),
    "load_catalog.path": lambda: material.written("csv", material.catalog_text()),
    "load_case.path": lambda: material.written("toml", material.case_text()),
    "load_sweep.path": lambda: material.written("toml", material.SHORT_STUDY),
    "load_trace.path": lambda: material.written("nc", material.trace_bytes()),
    "open_sweep.path SweepResult().path": lambda: material.written("db", material.store_bytes()),
    "load_torque_map.path": _saved(hp.study.TorqueMap, "nc"),
    "load_gait_energy.path": _saved(hp.study.GaitEnergy, "nc"),
    "load_summary.path": _saved(hp.Summary, "json"),
    "read_mcap.path": lambda: hp.interchange.write_mcap(
        material.trace(), material.new_file("mcap")
    ),
    "write_joint_trajectory.source write_servo_ticks.source": _walk_plan,
    "write_servo_ticks.servo": "dynamixel-x",
    "HeightField.from_csv.path": lambda: material.written("csv", "0,0,0\n0,0.1,0\n"),
    "HeightField.from_image.path": lambda: material.written("pgm", b"P5 2 2 255\n\0\1\2\3"),
}

BY_NAME: Mapping[str, Any] = {
    name: value for names, value in _GIVEN.items() for name in names.split()
}
"""Sound arguments by call and parameter, by method and parameter, or by parameter; of a function:
what it returns."""

SMALL: Mapping[str, Mapping[str, Any]] = {
    "simulate": {"duration": 2e-3, "limits": material.LIMITS, **EASY},
    "amplification": {"duration": 0.02},
    "simulate_batch": {"threads": 1, **EASY}, "iterate_batch": {"threads": 1, **EASY},
    "compare": {"duration": LEAST, "controllers": lambda: {"a": material.walk()}, **QUICK},
    "torque_map": {"strokes": [0.04], "cycle_times": [0.4], "check": 0, "walk": "arc", **QUICK},
    "gait_energy": {
        "speeds": [0.1], "stroke": 0.04, "check": 0, "gaits": lambda: {"a": hp.Gait.tripod()},
        **QUICK,
    },
    "judge_peaks": {"run": _first(hp.Case), "threads": 1},
    "select_motors": {"text": material.MOTORS_TEXT, "samples": 0, "threads": 1},
    "run_sweep": {
        "study": lambda: hp.study.SweepStudy.from_toml(material.SHORT_STUDY), "threads": 1,
        "store": lambda: material.new_file("db"),
    },
    "tune": {
        "make_controller": lambda: crouch, "start": {"angle": 0.0}, "budget": 10, "population": 5,
        "bounds": {"angle": (-0.2, 0.2)}, "objective": lambda: height,
        "held_out": lambda: {"b": hp.Scene(material.robot())}, "threads": 1, "duration": 0.05,
        "method": "robust", "step": 2e-3,
    },
    "Session()": {"limits": material.LIMITS, "accuracy": 1e-3},
    "joint_demand": {"postures": 2}, "uncertainty": {"grid_point": 0},
    "write_joint_trajectory": {"duration": 5.0, "rate": 100.0},
    "write_servo_ticks": {"duration": 5.0, "rate": 100.0},
}  # fmt: skip
"""What is always given, so that a sound call ends within a second."""
