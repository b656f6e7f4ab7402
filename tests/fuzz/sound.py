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
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import public_samples

import hexapod_pin as hp
from fuzz import material
from fuzz.public_names import CONSTRUCTOR, PublicCall, public_classes
from hexapod_pin.type_checks import type_hints

QUICK: Mapping[str, Any] = {"accuracy": 1e-3, "threads": 1}
"""Of every call that runs something."""

LEAST = 3.9
"""Time in which the gait of `material.control` makes a whole steady cycle [s]."""


STEPS: Mapping[str, Any] = {"duration": 0.05, "method": "robust", "step": 2e-3}


def crouch(values: Mapping[str, float]) -> hp.HoldPosture:
    """Return a controller of one tuned number."""
    q = np.array(material.robot().posture)
    q[1::3] += values["angle"]
    return hp.HoldPosture(q)


def height(found: Any, baseline: Any) -> float:
    """Return an objective's value."""
    return float(np.mean([run.height_mean for run in found]))


def session() -> hp.Session:
    """Return a session; unlike other instances it changes, and is made anew for each call."""
    limits = hp.simulation.WorkLimits(evaluations=3e4)
    return hp.Session(material.scene(), accuracy=1e-3, limits=limits)


@cache
def pool() -> Mapping[type, list[Any]]:
    """Return instances by their class, those in others' fields included."""
    found: dict[type, list[Any]] = collections.defaultdict(list)
    roots = [
        hp.study.SweepStudy.from_toml(material.STUDY_TEXT), material.walk().plot,
        hp.rl.WalkEnv(material.robot(), duration=0.1),
        hp.rl.WalkVectorEnv(2, material.robot(), duration=0.1),
        *public_samples.samples(material.folder()),
    ]  # fmt: skip
    for one in _within(roots, set()):
        found[type(one)].append(one)
    return found


def _within(value: Any, seen: set[int]) -> Iterator[Any]:
    """Yield the instances of this package's classes in a value, itself included."""
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, list | tuple):
        for one in value:
            yield from _within(one, seen)
    elif isinstance(value, Mapping):
        yield from _within(list(value.values()), seen)
    elif type(value).__module__.startswith("hexapod_pin"):
        yield value
        for name, one in getattr(value, "__dict__", {}).items():
            if not name.startswith("_"):
                yield from _within(one, seen)


def instances(owner: type) -> list[Any]:
    """Return sound instances of a class; empty where there is none."""
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

    Args:
        call: what they are for.
        rng: draws which.
        instance: of its owner: a constructor is given what it was made from.
    """
    given, small = dict[str, Any](), SMALL.get(call.name, {})
    for name, parameter in call.parameters().items():
        if parameter.kind is parameter.VAR_POSITIONAL:
            continue
        needed = (
            parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
        )
        if name in small:
            given[name] = _made(small[name])
        elif needed or rng.random() < 0.2:
            own = call.kind == CONSTRUCTOR and hasattr(instance, name)
            if own and not inspect.ismethod(getattr(instance, name)):
                given[name] = getattr(instance, name)
            elif needed:
                given[name] = argument(call, parameter, rng)
    return given


def argument(call: PublicCall, parameter: inspect.Parameter, rng: random.Random) -> Any:
    """Return a sound argument of a call for one of its parameters."""
    for key in (f"{call.name}.{parameter.name}", parameter.name):
        if key in BY_NAME:
            return _made(BY_NAME[key])
    function, owner = call.target, call.owner
    if parameter.name == "obj":  # of `model_validate`
        return (instances(owner) or [{}])[0]
    if isinstance(owner, type) and call.kind == CONSTRUCTOR:
        function = vars(owner).get("__init__", owner.__new__)
    known = inspect.isroutine(function) and getattr(function, "__module__", None)
    hints = type_hints(function, owner if isinstance(owner, type) else None) if known else {}
    return _of_kind(hints.get(parameter.name, parameter.annotation), rng)


def _made(entry: Any) -> Any:
    """Return the value of an entry of a table: of a function what it returns."""
    return entry() if callable(entry) else entry


def _of_kind(kind: Any, rng: random.Random) -> Any:
    """Return a sound value of a type."""
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


TIME_FUNCTIONS = (
    "Hermite", "Waypoints", "Havsin", "Step", "Step5", "VelocityStep", "Sine", "Sum", "Periodic",
)  # fmt: skip

FIGURES = tuple(
    f"write_{name}" for name in (
        "figure", "comparison_figure", "gait_energy_figure", "joint_motion_figure",
        "joint_torque_figure", "mass_center_figure", "quasi_static_figure", "torque_curves",
        "torque_heat_map",
    )
)  # fmt: skip


def _limits() -> hp.simulation.WorkLimits:
    return hp.simulation.WorkLimits(evaluations=3e4, steps=1e4)


def _soil() -> Any:
    from hexapod_pin.ground.contact.soil import SOILS

    return next(iter(SOILS.values()))


def _checkpoint_data() -> dict[str, Any]:
    return material.trace().checkpoint.to_dict()


def _study_parts() -> dict[str, Any]:
    return {"a": instances(hp.study.TorqueMap)[0]}


def _study_file() -> Path:
    return hp.study.write_study(material.new_file("nc"), _study_parts())


def _image() -> Path:
    """Write a portable grey map of four pixels."""
    return material.written("pgm", b"P5 2 2 255\n\0\1\2\3")


def _walk_plan() -> hp.motion.WalkPlan:
    return hp.motion.WalkPlan(material.robot(), material.control().gait)


def _joint() -> str:
    return material.robot().joint_names[0]


BY_NAME: Mapping[str, Any] = {
    "robot": material.robot,
    "scene": material.scene,
    "trace": material.walk,
    "run": material.walk,
    "dynamic": material.walk,
    "slow": material.walk,
    "controller": material.control,
    "walk": material.control,
    "gait": lambda: material.control().gait,
    "duration": 2e-3,
    "cases": lambda: [hp.Case(material.scene(), material.control(), duration=2e-3, **EASY)],
    "initial": material.state,
    "state": material.state,
    "q": lambda: material.state().q,
    "v": lambda: material.state().v,
    "Session.advance.until": 1e-3,
    "KinematicControl.plan_part.until": 1.0,
    "since": 0.0,
    **{
        f"{kind}.{name}.time": lambda: np.array([0.0, 0.5])
        for kind in TIME_FUNCTIONS
        for name in ("acceleration", "derivatives", "value_and_rate")
    },
    **{f"view.{name}.path": lambda: material.new_file("png") for name in FIGURES},
    "source": "kharagpur",
    "study": lambda: instances(hp.study.SweepStudy)[0],
    "vary": lambda: VARY,
    "measurement": lambda: instances(hp.feedback.Measurement)[0],
    "time": 0.5,
    "points": [[0.0, 0.0, 0.1]],
    "traces": lambda: {"a": material.walk()},
    "scenes": lambda: {"a": material.scene()},
    "parts": dict,
    "method": "robust",
    "step": 2e-3,
    "sample": 1e-3,
    "threads": 1,
    "kind": "coxa",
    "joint": _joint,
    "Trace.joint.name": _joint,
    "Robot.joint_index.name": _joint,
    "TorqueBudget.joint.name": _joint,
    "MotorBudget.joint.name": _joint,
    "PeakVerdicts.joint.name": _joint,
    "JointMoments.joint.name": _joint,
    "TorqueBudget.kind.name": "coxa",
    "legs": 6,
    "MotorBudget.kind.name": "coxa",
    "PeakVerdicts.kind.name": "coxa",
    "Robot.leg.name": lambda: material.robot().legs[0].name,
    "leg": "left_front",
    "Robot.foot.name": lambda: material.robot().feet[0].name,
    "links": ("base_link",),
    "Trace.foot.name": lambda: material.robot().feet[0].name,
    "link": "base_link",
    "Contact.preset.name": "s1",
    "Contact.soil.name": "sand",
    "urdf_path.name": "athena",
    "Stability.least.name": "static_margin",
    "model": "AX-12A",
    "quantity": "torque_peak",
    "uncertainty.values": lambda: {"torque_peak": np.arange(8.0)},
    "cost": "cost_of_transport",
    "polygons": 1,
    "postures": 2,
    "seed": 1,
    "size": 1.0,
    "spacing": 0.5,
    "Scene.from_toml.text": lambda: material.scene().to_toml(),
    "Case.from_toml.text": material.case_text,
    "SweepStudy.from_toml.text": lambda: material.STUDY_TEXT,
    "z": [[0.0, 0.0]] * 3,
    "Checkpoint.from_dict.data": _checkpoint_data,
    "Amplification.at.time": 0.01,
    "voltage": 12.0,
    "supply": 11.0,
    "Comparison.change.controller": "b",
    "Comparison.of.scene": "a",
    "Comparison.mean.scene": "a",
    "Comparison.change.scene": "a",
    "Comparison.of.controller": "a",
    "metric": "torque_rms",
    "Comparison.mean.controller": "a",
    "record": lambda: hp.load_catalog().records[0],
    "simulate.record": ["torque"],
    "Session().record": ["torque"],
    "Case().record": ["torque"],
    "errors.NotRecordedError().record": ["com"],
    "Gait.feet_down.phase": [0.0, 0.5],
    "HuntCrossley.soil.soil": _soil,
    "Summary.error_of.name": "torque_rms",
    "RelativeObjective.value.run": lambda: instances(hp.Summary)[0],
    "Segment.box.size": (0.1, 0.02, 0.02),
    "Trunk.solid.size": (0.2, 0.1, 0.05),
    "limits": _limits,
    "Segment.box.limits": (-1.0, 1.0),
    "Segment.rod.limits": (-1.0, 1.0),
    "SweepStudy.of_case.case": lambda: instances(hp.Case)[0],
    "phase": "retraction",
    "AdamsImpact.from_mm.exponent": 1.5,
    "Gait.custom.phases": [0.0, 0.5] * 3,
    "load": 10.0,
    "JointDemand.of_kinds.kinds": ("coxa",),
    "posture": lambda: list(material.robot().posture),
    "Scene.require_unloaded.where": "here",
    "Gait.custom.duty": 0.6,
    "JointDemand.torque_rms_with_armature.armature": lambda: np.zeros(18),
    "write_study.parts": _study_parts,
    "RelativeObjective.value.name": "torque_rms",
    "HeightField.from_image.path": _image,
    "JointDemand.of_samples.torque": lambda: np.zeros((3, 18)),
    "JointDemand.of_samples.speed": lambda: np.zeros((3, 18)),
    "JointDemand.of_samples.time": lambda: np.arange(3.0),
    "Comparison.save.path": lambda: material.new_file("json"),
    "Summary.save.path": lambda: material.new_file("json"),
    "view.write_html.path": lambda: material.new_file("html"),
    "view.write_side_by_side.path": lambda: material.new_file("html"),
    "view.write_study_report.path": lambda: material.new_file("html"),
    "view.write_selection_report.path": lambda: material.new_file("html"),
    "load_study.path": _study_file,
    "path": lambda: str(material.new_file("nc")),
    "load_catalog.path": lambda: material.written("csv", material.catalog_text()),
    "load_case.path": lambda: material.written("toml", material.case_text()),
    "load_sweep.path": lambda: material.written("toml", material.STUDY_TEXT),
    "load_trace.path": lambda: material.written("nc", material.trace_bytes()),
    "open_sweep.path": lambda: material.written("db", material.store_bytes()),
    "SweepResult().path": lambda: material.written("db", material.store_bytes()),
    "load_torque_map.path": lambda: instances(hp.study.TorqueMap)[0].save(material.new_file("nc")),
    "load_gait_energy.path": lambda: instances(hp.study.GaitEnergy)[0].save(
        material.new_file("nc")
    ),
    "load_summary.path": lambda: instances(hp.Summary)[0].save(material.new_file("json")),
    "write_mcap.path": lambda: material.new_file("mcap"),
    "read_mcap.path": lambda: hp.interchange.write_mcap(
        material.trace(), material.new_file("mcap")
    ),
    "write_joint_trajectory.path": lambda: material.new_file("yaml"),
    "write_servo_ticks.path": lambda: material.new_file("csv"),
    "write_joint_trajectory.source": _walk_plan,
    "write_servo_ticks.source": _walk_plan,
    "write_servo_ticks.servo": "dynamixel-x",
    "HeightField.from_csv.path": lambda: material.written("csv", "0,0,0\n0,0.1,0\n"),
}
"""Sound arguments by call and parameter, or by parameter; of a function: what it returns."""

EASY: Mapping[str, Any] = {"accuracy": 1e-3, "estimate": False}

VARY: list[dict[str, Any]] = [{"input": "stroke", "values": [0.06, 0.08]}]

SMALL: Mapping[str, Mapping[str, Any]] = {
    "simulate": {"duration": 2e-3, **EASY}, "amplification": {"duration": 0.02},
    "simulate_batch": {"threads": 1, **EASY}, "iterate_batch": {"threads": 1, **EASY},
    "compare": {"duration": LEAST, "controllers": lambda: {"a": material.control()}, **QUICK},
    "torque_map": {"strokes": [0.06], "cycle_times": [0.8], "check": 0, "walk": "arc", **QUICK},
    "gait_energy": {
        "speeds": [0.09], "check": 0, "gaits": lambda: {"a": material.control().gait}, **QUICK,
    },
    "judge_peaks": {"run": lambda: instances(hp.Case)[0], "threads": 1},
    "select_motors": {"text": lambda: material.MOTORS_TEXT, "samples": 0, "threads": 1},
    "run_sweep": {
        "study": lambda: hp.study.SweepStudy.from_toml(material.SHORT_STUDY), "threads": 1,
        "store": lambda: material.new_file("db"),
    },
    "tune": {
        "make_controller": lambda: crouch, "start": {"angle": 0.0}, "budget": 10, "population": 5,
        "bounds": {"angle": (-0.2, 0.2)}, "objective": lambda: height,
        "held_out": lambda: {"b": hp.Scene(material.robot())}, "threads": 1, **STEPS,
    },
    "Session()": {"limits": lambda: hp.simulation.WorkLimits(evaluations=3e4), "accuracy": 1e-3},
    "joint_demand": {"postures": 2}, "HeightField.random": {"size": 1.0},
    "uncertainty": {"grid_point": 0},
    "write_joint_trajectory": {"duration": 5.0, "rate": 50.0},
    "write_servo_ticks": {"duration": 5.0, "rate": 50.0},
}  # fmt: skip
"""What is always given, so that a sound call ends within a second."""
