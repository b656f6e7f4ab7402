"""Controllers that walk another gait, or the same one with other numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.feasible_gait import fit_gait
from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.gait import GAITS, Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.named_gait import named_gait
from hexapod_pin.errors import GaitError, HexapodError, ParameterError, UnknownNameError
from hexapod_pin.robot.robot import Robot

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
        name, gait = fields.pop("gait", None), gait_of(controller)
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
