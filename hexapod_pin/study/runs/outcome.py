"""An outcome is what became of one case: its state and its numbers in the order of a store."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.schema import Quantity, Record, pack, quantity, schema
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.summary_verdict import SummaryVerdict, summary_verdict
from hexapod_pin.results.torque_budget import energy_per_way
from hexapod_pin.scene.loads import Push
from hexapod_pin.simulation.case import Case

TEXTS = ("digest", "reason", "verdict", "labels", "assumed", "counters")
"""Text of an outcome."""


@dataclass(frozen=True)
class Outcome:
    """What became of one case.

    Attributes:
        index: of the case in its study.
        digest: of the case; empty where there is none.
        reason: why it failed; empty of a case that was run.
        verdict: why it does not walk; empty where it does.
        labels: of its joints and feet, as JSON.
        assumed: what it assumes, as JSON.
        counters: steps, evaluations, ... as JSON.
        numbers: its numbers, in the order of `case_numbers`, little-endian doubles.
        wall_time: from its planning to its end [s]; of a failed case 0.
    """

    index: int
    digest: str
    reason: str
    verdict: str = ""
    labels: str = ""
    assumed: str = ""
    counters: str = ""
    numbers: bytes = b""
    wall_time: float = 0.0


def outcome_of(index: int, case: Case | Exception, result: object) -> Outcome:
    """Return what became of a case: numbers of a summary, the reason of an error."""
    digest = case.digest if isinstance(case, Case) else ""
    if not isinstance(result, Summary):
        return Outcome(index, digest, failure(result))
    width = standing_width(case) if isinstance(case, Case) else math.nan
    verdict = summary_verdict(result, width)
    return Outcome(
        index, digest, "", verdict.reason, labels_of(result),
        json.dumps(list(result.run.assumed)), json.dumps(dict(result.counters)),
        case_numbers(result, verdict).astype("<f8").tobytes(),
        result.run.wall_time or 0.0,
    )  # fmt: skip


def standing_width(case: Case) -> float:
    """Return the distance of the feet farthest apart as a robot that is pushed stands [m].

    NaN of a case without pushes, or of a robot whose legs are not known.
    """
    if not any(isinstance(load, Push) for load in case.scene.loads):
        return math.nan
    try:
        feet = leg_group(case.scene.robot).neutral_feet[:, :2]
    except HexapodError:
        return math.nan
    return float(np.linalg.norm(feet[:, None] - feet, axis=-1).max())


def failure(error: object) -> str:
    """Return why a case failed, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def to_bytes(outcomes: Iterable[Outcome]) -> bytes:
    """Return outcomes as a message: one line of JSON, then the numbers; texts stand in it once."""
    texts: dict[str, int] = {}
    rows, numbers = [], []
    for one in outcomes:
        places = [texts.setdefault(getattr(one, name), len(texts)) for name in TEXTS]
        rows.append([one.index, *places, one.wall_time, len(one.numbers)])
        numbers.append(one.numbers)
    head = json.dumps({"texts": list(texts), "rows": rows}).encode()
    return b"\n".join([head, b"".join(numbers)])


def from_bytes(message: bytes) -> list[Outcome]:
    """Return the outcomes of a message."""
    head, _, numbers = message.partition(b"\n")
    data = json.loads(head)
    found, place = [], 0
    for index, *texts, wall_time, size in data["rows"]:
        words = {name: data["texts"][k] for name, k in zip(TEXTS, texts, strict=True)}
        own = numbers[place : place + size]
        found.append(Outcome(index, **words, numbers=own, wall_time=wall_time))
        place += size
    return found


# What a case leaves: its numbers in the order in which a store keeps them.

PATH, PATH_COLUMNS = "path", 4
"""The array of a summary whose length differs from run to run; it is the last one."""


class CaseNumbers(Record):
    """What is found from a summary and its run, beside the summary's own numbers.

    Attributes:
        joint_names: of the axis "joint".
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {"joint": "joint_names"}

    # fmt: off
    joint_names: tuple[str, ...]
    cycles: float = quantity("", "1", "whole gait cycles in the window; NaN where nothing repeats")
    states: float = quantity("", "1", "accepted states of the whole run")
    total_mass: float = quantity("", "kg", "mass of the robot with its loads")
    distance: float = quantity("", "m",
        "distance of the centre of mass per cycle along the heading")
    measured_speed: float = quantity("", "m/s", "distance per time")
    nominal_speed: float = quantity("", "m/s", "planned speed of the gait")
    measured_turn_rate: float = quantity("", "rad/s", "mean yaw rate, left > 0")
    cost_of_transport: float = quantity("", "1", "absolute energy over weight and distance")
    cost_of_transport_positive: float = quantity("", "1", "work done over weight and distance")
    speed_share: float = quantity("", "1", "distance over planned distance")
    turn_share: float = quantity("", "1", "yaw over planned yaw")
    walks: float = quantity("", "1", "1: walks as planned; 0: does not; NaN: cannot be judged")
    trunk_contacts: float = quantity("", "1", "contacts of the trunk with the ground")
    effort_limit: Array = quantity("joint", "N m", "torque limit at standstill")
    limit_count: Array = quantity("joint", "1", "times the torque limit was reached, whole run")
    limit_time: Array = quantity("joint", "s", "time at the torque limit, whole run")
    stop_count: Array = quantity("joint", "1", "times a joint stop was reached, whole run")
    # fmt: on


def quantities() -> dict[str, Quantity]:
    """Return all quantities but the path, in the order of the stored doubles."""
    own = schema(Summary)
    return {**schema(CaseNumbers), **{name: own[name] for name in own if name != PATH}}


@lru_cache(maxsize=64)
def labels_text(
    joints: tuple[str, ...], kinds: tuple[str, ...], feet: tuple[str, ...], robot: str
) -> str:
    """Return the labels of the axes of a case as JSON text."""
    return json.dumps({"joints": joints, "kinds": kinds, "feet": feet, "robot": robot})


def labels_of(summary: Summary) -> str:
    """Return the labels of a summary's axes as JSON text."""
    joints, feet = summary.joint_names, summary.foot_names
    robot = summary.run.robot
    kinds = joint_kinds(joints, len(feet), robot.joint_kinds)
    return labels_text(joints, kinds, feet, f"{robot.name}: {robot.provenance}")


def case_numbers(summary: Summary, verdict: SummaryVerdict) -> Array:
    """Return all numbers of a case in one row: `quantities` one after the other, then the path."""
    found = CaseNumbers(
        summary.joint_names, **_found(summary), speed_share=_number(verdict.speed_share),
        turn_share=_number(verdict.turn_share), walks=_number(verdict.walks),
    )  # fmt: skip
    return np.concatenate([pack(found), pack(summary)])


def _found(summary: Summary) -> dict[str, Any]:
    """Return what is found from a summary, besides the verdict."""
    run, distance = summary.run, summary.distance
    mass, nominal = run.robot.mass, run.walk.nominal_speed
    weight = mass * float(np.linalg.norm(run.gravity))
    given, taken = float(summary.positive_energy.sum()), float(summary.negative_energy.sum())
    way = distance if nominal else None  # none of a turn on the spot
    nothing = np.full(len(summary.joint_names), math.nan)
    touches = sum(event.kind == "trunk-contact" for event in run.events)
    return {
        "cycles": _number(summary.cycles),
        "states": summary.states,
        "total_mass": mass,
        "distance": _number(distance),
        "measured_speed": _number(summary.measured_speed),
        "nominal_speed": _number(nominal if summary.cycles else None),
        "measured_turn_rate": _number(summary.measured_turn_rate),
        "cost_of_transport": _number(energy_per_way(given - taken, weight, way)),
        "cost_of_transport_positive": _number(energy_per_way(given, weight, way)),
        "trunk_contacts": touches,
        "effort_limit": nothing if run.robot.effort_limit is None else run.robot.effort_limit,
        **{
            name: nothing
            if run.limits is None
            else np.array([getattr(row, name) for row in run.limits], dtype=float)
            for name in ("limit_count", "limit_time", "stop_count")
        },
    }


def _number(value: float | bool | None) -> float:
    return math.nan if value is None else float(value)


def sizes_of(labels: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Return the lengths of the axes of a case by its labels."""
    return {"joint": len(labels["joints"]), "foot": len(labels["feet"]), "axis": 3}


def shape_of(axes: Sequence[str], sizes: Mapping[str, int]) -> tuple[int, ...]:
    """Return the shape of a quantity."""
    return tuple(sizes[axis] for axis in axes)
