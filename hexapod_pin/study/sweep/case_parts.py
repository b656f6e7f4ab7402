"""The parts of a study's cases are rebuilt only where their own inputs differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from hexapod_pin.control.gait import GAITS
from hexapod_pin.control.registry import read_controller
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.robot.loading.pin_model import placement
from hexapod_pin.robot.robot import Robot
from hexapod_pin.scene.loads import read_loads
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.case_data import case_to_dict
from hexapod_pin.study.sweep import scene_inputs as scenes
from hexapod_pin.study.sweep.base_case import GaitChanges, refused_input
from hexapod_pin.study.sweep.fields import known_name, suggestion
from hexapod_pin.study.sweep.scene_inputs import StudyMotors
from hexapod_pin.study.sweep.study_file import (
    CONTACT,
    GAIT,
    GRAVITY,
    LOADS,
    PATH,
    SERVO,
    TERRAIN,
    StudyInput,
)

KEPT_PARTS = 64
"""How many variants of a part are remembered: cases next to each other share theirs."""

Values = tuple[float | str, ...]


class CaseParts:
    """Makes the parts of a case from the values of a study's inputs.

    Args:
        base: what does not vary.
        inputs: what does.
        kept: fields that a gait of another name takes over from the base.
        motors: of the study.

    Raises:
        ParameterError: an input does not fit the base.
    """

    def __init__(
        self,
        base: Case,
        inputs: Sequence[StudyInput],
        kept: Mapping[str, float],
        motors: StudyMotors,
    ) -> None:
        """Sort the inputs by the part that they change."""
        self.base, self.gaits = base, GaitChanges(base.controller, base.scene.robot, kept)
        self.motors = motors
        self.options = {item.name: item.options for item in inputs}
        self.trunk = trunk_link(base.scene.robot)
        data: dict[str, Any] = {}
        if any(item.kind.part == PATH for item in inputs):
            data = case_to_dict(base)
        self.paths: dict[int, Steps] = {}
        places: dict[str, list[int]] = {}
        for place, item in enumerate(inputs):
            part = item.kind.part
            if part == PATH:
                steps = steps_to(data, item.name, f"{item.where}.path")
                self.paths[place], part = steps, part_of(steps)
            places.setdefault(part, []).append(place)
        _refuse_unfit(base, inputs)
        motors.check(inputs)
        self.makers = {
            part: (found, lru_cache(maxsize=KEPT_PARTS)(self._maker(part, found, inputs, data)))
            for part, found in places.items()
        }

    def of(self, values: Values) -> dict[str, Any]:
        """Return the parts that inputs change, by name; parts of equal inputs are one object.

        Raises:
            HexapodError: a part cannot be made of these values.
        """
        return {
            part: make(tuple(values[place] for place in places))
            for part, (places, make) in self.makers.items()
        }

    def _maker(
        self, part: str, places: list[int], inputs: Sequence[StudyInput], data: Mapping[str, Any]
    ) -> Callable[[Values], Any]:
        """Return what makes a part from the values of its inputs: numbers by path, then names."""
        steps = [self.paths.get(place) for place in places]
        names = [inputs[place].name for place in places]
        section = data.get("scene", {}).get(part) if part in _SCENE else data.get(part)
        depth = 2 if part in _SCENE else 1

        def make(values: Values) -> Any:
            found, named = self._of_base(part), {}
            changed = section
            for path, name, value in zip(steps, names, values, strict=True):
                if path is None:
                    named[name] = value
                else:
                    changed = with_number(changed, path[depth:], float(value))
            if changed is not section:
                found = READERS[part](changed)
            return self._named(part, found, named) if named else found

        return make

    def _of_base(self, part: str) -> Any:
        scene = self.base.scene
        of_scene = {"servo": scene.servos, "stops": scene.joint_stops}
        if part in of_scene:
            return of_scene[part]
        return getattr(scene if part in _SCENE else self.base, part, None)

    def _named(self, part: str, found: Any, named: Mapping[str, Any]) -> Any:
        """Return a part with named inputs on."""
        if part == GAIT:
            return self.gaits.controller_with(found, named)
        if part == CONTACT:
            return scenes.contact_with(found, named)
        if part == SERVO:
            return scenes.servo_with(self.motors.servo_with(found, named), named)
        if part == GRAVITY:
            return scenes.gravity_with(found, named)
        if part == LOADS:
            return scenes.loads_with(found, named, self.options, self.trunk)
        return scenes.terrain_with(self.base, named, self.options)


SET_BY: Mapping[str, tuple[str, ...]] = {
    "mu": ("scene.contact.friction.mu",),
    "slope": ("scene.gravity",),
    "slope_deg": ("scene.gravity",),
    "bumps": ("scene.terrain",),
    "gait": ("gait.",),
    "speed": ("gait.stroke", "gait.cycle_time"),
    "heading_deg": ("gait.heading",),
    "turn_rate_deg": ("gait.turn_rate",),
    "duty": ("gait.duty", "gait.phases"),
    **{name: (f"gait.{name}",) for name in ("stroke", "cycle_time", "lift", "heading")},
    "turn_rate": ("gait.turn_rate",),
}
"""What of a case's file an input sets, whatever stood there."""

_SCENE = (CONTACT, SERVO, "stops", TERRAIN, GRAVITY, LOADS)


def trunk_link(robot: Robot) -> str:
    """Return the name of a robot's root link."""
    import pinocchio as pin

    return next(str(f.name) for f in robot.model.frames if f.type == pin.FrameType.BODY)


def _require_link(robot: Robot, item: StudyInput) -> None:
    """Refuse the name of a link that the robot does not have.

    Raises:
        ParameterError: naming the link's place in the file.
    """
    try:
        placement(robot.model, item.options["link"])
    except UnknownNameError as error:
        where = f"{item.where}.link"
        known_name(where, error.name, error.known)


def _refuse_path(item: StudyInput, inputs: Sequence[StudyInput]) -> None:
    """Refuse a path to what an input sets.

    Raises:
        ParameterError: naming the path's place in the file.
    """
    for other in inputs:
        if other.kind.part == PATH and any(key in other.name for key in SET_BY[item.name]):
            allowed = f"a number that no other input sets: {item.where} varies {item.name}"
            raise ParameterError(f"{other.where}.path", other.name, allowed)


def _refuse_unfit(base: Case, inputs: Sequence[StudyInput]) -> None:
    """Refuse inputs that the base has no use for, and three numbers of which two follow.

    Raises:
        ParameterError: naming the input's place in the file.
    """
    names = {item.name: item for item in inputs}
    for item in inputs:
        if item.kind.part == PATH:
            continue
        if item.kind.part == GAIT:
            reason = refused_input(base.controller, item.name)
        else:
            reason = scenes.refused_scene_input(base, item.name)
        if reason:
            allowed = f"an input that the base has: {reason}"
            raise ParameterError(f"{item.where}.input", item.name, allowed)
        if item.name in SET_BY:
            _refuse_path(item, inputs)
        for k, name in enumerate(item.names if item.name == "gait" else ()):
            known_name(f"{item.where}.values[{k}]", name, GAITS)
        if item.options.get("link") is not None:
            _require_link(base.scene.robot, item)
    if {"speed", "stroke", "cycle_time"} <= names.keys():
        where = f"{names['speed'].where}.input"
        raise ParameterError(where, "speed", "left out beside stroke and cycle_time: it follows")
    if "bumps_seed" in names and "bumps" not in names:
        item = names["bumps_seed"]
        allowed = "beside an input bumps, which says how high they are"
        raise ParameterError(f"{item.where}.input", item.name, allowed)


# Numbers of a case's file by their path, such as "scene.contact.friction.mu".

Steps = tuple[str | int, ...]

SECTIONS = ("controller", "run", "scene")
SCENE_PARTS = ("contact", "servo", "stops", "terrain", "gravity", "loads")

READERS: Mapping[str, Any] = {
    "controller": read_controller,
    "contact": lambda data: Contact(**data),
    "servo": lambda data: Servo(**data),
    "stops": lambda data: JointStops(**data),
    "terrain": read_terrain,
    "gravity": tuple,
    "loads": lambda data: tuple(read_loads(data)),
    "run": dict,
}
"""What makes a part of a case from its data."""


def part_of(steps: Steps) -> str:
    """Return the part of a case that a path leads into."""
    return str(steps[1] if steps[0] == "scene" else steps[0])


def steps_to(data: Mapping[str, Any], path: str, where: str) -> Steps:
    """Return the steps of a path to a number of a case's data.

    Args:
        data: what the case's file holds.
        path: the keys, with dots between them; a list's places are counted from 0.
        where: the path's own place in the study file.

    Raises:
        ParameterError: it leads nowhere, or not to a number; names what is there.
    """
    keys = path.split(".")
    if keys[0] == "scene" and len(keys) > 1:
        _require(where, path, "scene", keys[1], SCENE_PARTS)
    else:
        _require(where, path, "", keys[0], SECTIONS)
    found: Any = data
    steps: list[str | int] = []
    for depth, key in enumerate(keys):
        above = ".".join(keys[:depth])
        if isinstance(found, Mapping):
            _require(where, path, above, key, list(found))
            steps.append(key)
        elif isinstance(found, Sequence) and not isinstance(found, str):
            places = [str(k) for k in range(len(found))]
            _require(where, path, above, key, places)
            steps.append(int(key))
        else:
            raise ParameterError(where, path, f"a path that ends at {above} = {found!r}")
        found = found[steps[-1]]
    if isinstance(found, bool) or not isinstance(found, int | float):
        inside = f": {', '.join(map(str, found))}" if isinstance(found, Mapping) else ""
        kind = "a table" if isinstance(found, Mapping) else f"{found!r}"
        raise ParameterError(where, path, f"the path of a number; there stands {kind}{inside}")
    return tuple(steps)


def _require(where: str, path: str, above: str, key: str, known: Sequence[str]) -> None:
    if key not in known:
        place = f"in {above}" if above else "in a case's file"
        allowed = f"a path to a number: {place} there are {', '.join(known) or 'none'}"
        raise ParameterError(where, path, allowed, suggestion(key, known))


def with_number(data: Any, steps: Steps, value: float) -> Any:
    """Return data with one number replaced; what the path does not touch is shared."""
    if not steps:
        return int(value) if isinstance(data, int) and value % 1.0 == 0.0 else value
    copy: Any = dict(data) if isinstance(data, Mapping) else list(data)
    copy[steps[0]] = with_number(copy[steps[0]], steps[1:], value)
    return copy
