"""What a case means as one text in which equal numbers are spelt alike, and its SHA-256.

Parts that many cases share (robot, contact, servos, stops, terrain, walk) are spelt once.
"""

from __future__ import annotations

import hashlib
import json
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.registry import controller_to_dict
from hexapod_pin.robot.once_per_robot import once_per_robot
from hexapod_pin.simulation.case_data import run_to_dict
from hexapod_pin.simulation.robot_data import robot_to_dict
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.simulation.scene import Scene

EXACT_INTEGERS = 2**53
"""Up to here a double holds every whole number."""

KEPT_TEXTS = 128
"""How many parts are remembered with their text."""

FROZEN = (Spec, KinematicControl, ArcWalk)
"""Parts that never change: their text may be kept."""


def case_digest(case: Case) -> str:
    """Return the SHA-256 over what a case means.

    Raises:
        ParameterError: the controller cannot be written.
    """
    run = run_to_dict(case)
    how = case._settings(0.0 if case.duration is None else case.duration)
    settings = {
        "duration": case.duration,
        "method": how.choice.method.name,
        "accuracy": how.choice.accuracy,
        "step": how.grid.step,
        "sample": how.grid.sample,
        **({} if case.record is None else {"record": list(case.record)}),
        **({} if how.controlled or not how.choice.method.adaptive else {"estimate": False}),
        **how.choice.torque_request,
    }
    parts = {
        "schema": canonical_text(run["schema"]),
        "run": canonical_text(settings),
        "controller": _TEXTS.of(case.controller, lambda x: canonical_text(controller_to_dict(x))),
        "scene": scene_text(case.scene),
    }
    if "initial" in run:
        parts["initial"] = canonical_text(run["initial"])
    return hashlib.sha256(_joined(parts).encode()).hexdigest()


def canonical_text(value: Any) -> str:
    """Return plain data as JSON with sorted keys, equal numbers spelt alike to the bit."""
    return json.dumps(_canonical(value), sort_keys=True)


def scene_text(scene: Scene) -> str:
    """Return the text of `Scene.to_dict`; of the robot what its file and options lead to."""
    rest = scene.settings_to_dict()
    parts = {name: canonical_text(value) for name, value in rest.items()}
    parts["robot"] = _robot_text(scene.robot)
    for name, part in scene.laws().items():
        parts[name] = _TEXTS.of(part, lambda x: canonical_text(x.model_dump()))
    return _joined(parts)


@once_per_robot
def _robot_text(robot: Robot) -> str:
    data = robot_to_dict(robot)
    for where in ("source", "options"):  # the robot's digest covers what they lead to
        data.pop(where, None)
    return canonical_text(data)


def _joined(parts: Mapping[str, str]) -> str:
    """Return the JSON of a table from the JSON of its values."""
    return "{" + ", ".join(f"{json.dumps(key)}: {parts[key]}" for key in sorted(parts)) + "}"


def _canonical(value: Any) -> Any:
    """Return data in which equal numbers are spelt alike, to the bit."""
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return value
    if isinstance(value, dict):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, int):
        return str(value) if abs(value) > EXACT_INTEGERS else float(value).hex()
    return _canonical(dict(value)) if isinstance(value, Mapping) else value


class _Texts:
    """Texts of the parts used last, by identity: the part is kept, so that its id stays its own."""

    def __init__(self) -> None:
        self.kept: OrderedDict[int, tuple[object, str]] = OrderedDict()

    def of(self, part: Any, write: Callable[[Any], str]) -> str:
        """Return the text of a part; that of one which may change is written anew."""
        if not isinstance(part, FROZEN):
            return write(part)
        found = self.kept.get(id(part))
        if found is not None and found[0] is part:
            return found[1]
        text = write(part)
        self.kept[id(part)] = (part, text)
        while len(self.kept) > KEPT_TEXTS:
            self.kept.pop(next(iter(self.kept)), None)
        return text


_TEXTS = _Texts()
