"""The base of a study is a case from a file or a short table.

Its controller may be given another gait.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import Field

from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.body_path import TRANSIENT_CYCLES
from hexapod_pin.control.feasible_gait import default_gait, fit_gait, named_gait
from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.gait import GAITS, Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import GaitError, HexapodError, ParameterError, UnknownNameError
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.contact.contact import preset_names
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.robot import Robot
from hexapod_pin.robot.robot_source import PACKAGED
from hexapod_pin.scene.robot_file import read_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import Case, load_case
from hexapod_pin.simulation.case_data import case_from_dict
from hexapod_pin.simulation.methods import METHODS
from hexapod_pin.simulation.steady_walk import until_steady
from hexapod_pin.spec import Spec
from hexapod_pin.study.sweep.fields import (
    Number,
    known_name,
    placed,
    read_spec,
    refuse_unknown,
    suggestion,
    table_at,
)
from hexapod_pin.user_file import user_path

SETTINGS = ("duration", "accuracy", "method", "step", "sample", "record")

CARRIED = ("stroke", "cycle_time", "lift", "heading", "turn_rate")

LEAST_DURATION = 5.0
"""Simulated time where none is given, at least [s]."""

WALKED_CYCLES = 4
"""Cycles that it holds at least: two to start and two steady ones."""


class BaseWalk(Spec):
    """A walk in short; what is left out is as in `hexapod-pin walk`, but duration and sample.

    Attributes:
        robot: name of a robot in the package, or the path of a file.
        repair: whether the file's faults are repaired first.
        options: further options of loading, as in a hints file.
        gait: a name, or a table of a gait's fields; fields left out of a named one are fitted.
        contact: name of a contact.
        mu: coefficient [-]; None: the contact's own.
        kp: servo stiffness [N m/rad]; None: *assumed*.
        kd: servo damping [N m s/rad]; None: *assumed*.
        prescribed: whether joints follow the plan exactly.
        motor: name in the catalogue; None: torques without a limit in speed.
        voltage: of the supply [V]; None: that of the catalogue's record.
        catalog: path of a catalogue of your own; None: the package's.
        duration: simulated time [s]; None: until a cycle repeats; of a walk none of whose cycles
            can, 5, or four cycles where that is more.
        accuracy: as of `simulate` [m and rad].
        method: as of `simulate`.
        step: as of `simulate` [s].
        sample: as of `simulate` [s]; None: 5 ms where steps adapt and a duration is given. They end
            at samples, of which a summary stores none, so a shorter one costs more.
        record: as of `simulate`.
    """

    robot: str = Field(min_length=1)
    repair: bool = False
    options: dict[str, Any] = Field(default_factory=dict)
    gait: str | dict[str, Any] | None = None
    contact: str = "accurate"
    mu: Number | None = None
    kp: Number | None = None
    kd: Number | None = None
    prescribed: bool = False
    motor: str | None = None
    voltage: Number | None = None
    catalog: str | None = None
    duration: Number | None = None
    accuracy: Number | None = None
    method: str | None = None
    step: Number | None = None
    sample: Number | None = None
    record: list[str] | None = None


def base_case(data: Mapping[str, Any], folder: Path, gait: str | None = None) -> Case:
    """Return the case that a study varies.

    Args:
        data: the table `base` of its file.
        folder: where relative paths start.
        gait: name of the gait where the base has none of its own; None: the robot's default.

    Raises:
        ParameterError: an unknown or missing key, a value out of range, a case that is not there.
        UrdfError, UnknownNameError: the robot's file is not usable, or lacks what is named.
        GaitError: the robot cannot walk the gait.
    """
    both = [key for key in ("case", "robot") if key in data]
    if len(both) != 1:
        found = None if not both else f"{data['case']!r} beside robot = {data['robot']!r}"
        raise ParameterError("base.case", found, "given, or base.robot in its place, and not both")
    if both == ["case"]:
        refuse_unknown(data, "base", ("case", "motor", "voltage", "catalog"))
        case = _given_case(data["case"], folder)
        refuse_motor(data.get("motor"), case.scene.prescribed)
        return case
    for key in (key for key in data if key in Gait.model_fields):
        allowed = f'in the gait: gait = {{ name = "tripod", {key} = {data[key]} }}'
        raise ParameterError(f"base.{key}", data[key], allowed)
    walk = read_spec(BaseWalk, data, "base")
    with placed("base"):
        return _walk(walk, folder, gait)


def kept_fields(data: Mapping[str, Any], base: Case) -> dict[str, float]:
    """Return what a gait of another name takes over from the base; all else is fitted.

    Of a walk in short: the numbers that are given of its gait. Of a case's file: stroke, cycle
    time, lift, heading and turn rate.
    """
    found = gait_of(base.controller)
    if "case" in data:
        return {} if found is None else {key: getattr(found, key) for key in CARRIED}
    given = data.get("gait")
    fields = given if isinstance(given, Mapping) else {}
    return {key: fields[key] for key in (*CARRIED, "duty") if key in fields}


def _given_case(given: Any, folder: Path) -> Case:
    """Return the case of a file, or of a table that holds what such a file does."""
    if isinstance(given, Mapping):
        case, place = case_from_dict(Case, given, folder), "base.case"
    elif isinstance(given, str) and given:
        case, place = load_case(folder / user_path(given)), given
    else:
        raise ParameterError("base.case", given, "the path of a case's file, or its tables")
    if case.duration is None:
        raise ParameterError("run.duration", None, f"given [s] in {place}")
    return case


def refuse_motor(motor: Any, prescribed: bool) -> None:
    """Refuse a motor where no servo acts.

    Raises:
        ParameterError: there is one, and motion is prescribed.
    """
    if prescribed and motor is not None:
        allowed = "left out with prescribed motion: no motor acts"
        raise ParameterError("base.motor", motor, allowed)


def _walk(base: BaseWalk, folder: Path, name: str | None) -> Case:
    robot = _robot(base, folder)
    gait = _gait(robot, base.gait if base.gait is not None else name)
    known_name("base.contact", base.contact, preset_names(base.contact))
    if base.prescribed and not (base.kp is None and base.kd is None):
        key = "kd" if base.kp is None else "kp"
        allowed = "left out with prescribed = true: no servo acts"
        raise ParameterError(f"base.{key}", getattr(base, key), allowed)
    refuse_motor(base.motor, base.prescribed)
    scene = Scene(
        robot,
        contact=Contact.preset(base.contact).with_mu(base.mu),
        servo=Servo.for_robot(robot, kp=base.kp, kd=base.kd),
        prescribed=base.prescribed,
    )
    settings = {key: getattr(base, key) for key in SETTINGS}
    control = KinematicControl(gait)
    if base.duration is None:
        settings["duration"] = max(LEAST_DURATION, WALKED_CYCLES * gait.cycle_time)
        return until_steady(Case(scene, control, **settings))
    if base.sample is None and _adapts(base):
        settings["sample"] = LONGEST_SAMPLE
    return Case(scene, control, **settings)


def _adapts(base: BaseWalk) -> bool:
    """Return whether the steps of a walk adapt; a method of no such name is refused elsewhere."""
    if base.method is None:
        return base.step is None
    return base.method in METHODS and METHODS[base.method].adaptive


def _robot(base: BaseWalk, folder: Path) -> Robot:
    options = read_spec(LoadOptions, base.options, "base.options")
    if base.repair:
        options = LoadOptions(repair=True).over(options)
    source = base.robot
    if source not in PACKAGED and os.path.isfile(folder / source):
        source = str(folder / source)
    try:
        return read_robot({"source": source, "options": options.given()})
    except UnknownNameError as error:
        if error.name != source:
            raise
        allowed = f"{', '.join(error.known)}, or the path of a file that is there"
        hint = suggestion(source, error.known)
        raise ParameterError("base.robot", base.robot, allowed, hint) from error


def _gait(robot: Robot, given: str | Mapping[str, Any] | None) -> Gait:
    """Return a gait that the robot can walk: given fields stay, the rest is fitted."""
    if given is None or isinstance(given, str):
        return fit_gait(robot, default_gait(robot) if given is None else _named(given)).gait
    fields = dict(table_at(given, "base.gait"))
    if "phases" in fields:
        return read_spec(Gait, fields, "base.gait")
    refuse_unknown(fields, "base.gait", Gait.model_fields)
    name = _named(fields.pop("name", default_gait(robot)), "base.gait.name")
    for key, value in fields.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ParameterError(f"base.gait.{key}", value, "a number")
    with placed("base.gait"):
        return fit_gait(robot, name, **fields).gait


def _named(name: Any, where: str = "base.gait") -> str:
    return known_name(where, name, GAITS)


# Controllers that walk another gait, or the same one with other numbers.

ARC_INPUTS = ("gait", "cycle_time", "duty")
"""What of a gait an `ArcWalk` uses."""

COMMANDED = ("stroke", "speed", "heading", "turn_rate")
"""What of a gait a velocity command takes the place of."""

DEGREES = {"heading_deg": "heading", "turn_rate_deg": "turn_rate"}


def gait_of(controller: Any) -> Gait | None:
    """Return the gait that a controller walks; None where its steps are not those of a gait."""
    if isinstance(controller, KinematicControl | ArcWalk):
        return controller.gait
    if isinstance(controller, FootControl) and gait_of(controller.walk) is not None:
        return controller.gait
    return None


def with_gait(controller: Any, gait: Gait) -> Any:
    """Return the controller with another gait."""
    if isinstance(controller, FootControl):
        return replace(controller, walk=with_gait(controller.walk, gait))
    return replace(controller, gait=gait)


def refused_input(controller: Any, name: str) -> str:
    """Return why a controller has no use for an input of its gait; empty where it has."""
    if gait_of(controller) is None:
        return f"the controller of the base ({type(controller).__name__}) has no gait"
    walk = controller.walk if isinstance(controller, FootControl) else controller
    name = DEGREES.get(name, name)
    if isinstance(walk, ArcWalk) and name not in ARC_INPUTS:
        return f"an ArcWalk takes of its gait only {', '.join(ARC_INPUTS)}"
    if getattr(walk, "velocity", None) is not None and name in COMMANDED:
        return f"the base has a velocity command in the place of its gait's {name}"
    return ""


class GaitChanges:
    """Makes the controllers of a study; a gait of another name is fitted once.

    Args:
        controller: of the base.
        robot: that walks.
        kept: fields that a gait of another name takes over; the rest is fitted.
    """

    def __init__(self, controller: Any, robot: Robot, kept: Mapping[str, float]) -> None:
        """Remember the base."""
        self.controller, self.robot, self.kept = controller, robot, dict(kept)
        self._named = lru_cache(maxsize=None)(self._fitted)

    def controller_with(self, controller: Any, values: Mapping[str, float | str]) -> Any:
        """Return a controller with inputs by their names.

        Raises:
            GaitError, ParameterError: the robot cannot walk it, or a value is out of range.
        """
        fields = {
            DEGREES.get(key, key): math.radians(float(value)) if key in DEGREES else value
            for key, value in values.items()
        }
        name = fields.pop("gait", None)
        gait: Gait | HexapodError | None = gait_of(controller)
        if name is not None:
            gait = self._named(str(name))
        if isinstance(gait, HexapodError):
            raise gait
        if gait is None:
            raise ParameterError("controller", type(controller).__name__, "one with a gait")
        numbers = {key: float(value) for key, value in fields.items()}
        return with_gait(controller, changed_gait(self.robot, gait, numbers))

    def _fitted(self, name: str) -> Gait | HexapodError:
        """Return a gait by name, or why there is none."""
        try:
            return fit_gait(self.robot, name, **self.kept).gait
        except (GaitError, ParameterError, UnknownNameError) as error:
            return error


def changed_gait(robot: Robot, gait: Gait, fields: Mapping[str, float]) -> Gait:
    """Return a gait with some numbers replaced.

    A speed sets the cycle time and keeps the stroke; beside a cycle time it sets the stroke. The
    phases of a wave follow its duty.

    Raises:
        GaitError, ParameterError: there is no such gait.
    """
    changes: dict[str, Any] = dict(fields)
    speed = changes.pop("speed", None)
    if "duty" in changes and _by_name(robot, gait):
        changes["phases"] = named_gait(robot, gait.name, duty=changes["duty"]).phases
    if speed is not None:
        duty = changes.get("duty", gait.duty)
        if "cycle_time" in changes:
            changes["stroke"] = speed * duty * changes["cycle_time"]
        else:
            changes["cycle_time"] = changes.get("stroke", gait.stroke) / (duty * speed)
    return gait.with_changes(**changes) if changes else gait


def _by_name(robot: Robot, gait: Gait) -> bool:
    """Return whether a gait's phases are those of its name at its duty."""
    if gait.name not in GAITS or gait.leg_names is not None:
        return False
    try:
        return named_gait(robot, gait.name, duty=gait.duty).phases == gait.phases
    except (GaitError, UnknownNameError):
        return False


# How long a walk lasts, and how densely it is sampled.

LONGEST_SAMPLE = 5e-3
"""Largest time between samples [s]. Steps end there, so a shorter one costs more, for nothing."""

SAMPLES_PER_CYCLE = 120
"""Samples of a cycle are a multiple of this: duty and phases of named gaits fall on samples."""


def walk_times(cycle_time: float, cycles: int, least: int = 1) -> tuple[float, float]:
    """Return duration and sample [s] of a run of whole cycles after the start-up.

    Args:
        cycle_time: [s].
        cycles: how many.
        least: samples of a cycle, at least.
    """
    wanted = max(float(least), cycle_time / LONGEST_SAMPLE)
    count = SAMPLES_PER_CYCLE * math.ceil(wanted / SAMPLES_PER_CYCLE)
    sample = cycle_time / count
    return (TRANSIENT_CYCLES + cycles) * count * sample, sample


def walk_case(case: Case, cycles: int | None) -> Case:
    """Return a case of `walk_times`; without a number of cycles, one until a cycle repeats."""
    return until_steady(case) if cycles is None else case
