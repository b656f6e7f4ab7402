"""Choose a stroke that the robot can walk."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.control.named_gait import named_gait
from hexapod_pin.errors import GaitError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

DEFAULT_STROKE = 0.14
"""Stroke of S2 [m], taken where none is given and the robot can walk it."""

STROKE_SHARE = 0.8
"""Share of the largest possible stroke taken where DEFAULT_STROKE is too long (*assumed*)."""


def feasible_gait(
    robot: Robot, name: str, stroke: float | None, **fields: float
) -> tuple[Gait, str]:
    """Return the gait, and how its stroke was chosen.

    Without a stroke it is 0.14 m (S2's), or 80 % of the largest that the robot can walk where
    0.14 m is too long.

    Args:
        robot: the robot that must be able to walk it.
        name: one of `control.gait.GAITS`.
        stroke: [m], or None.
        fields: cycle_time, duty, lift, heading, turn_rate.

    Raises:
        UnknownNameError: there is no such gait for the robot's number of legs.
        GaitError: the robot cannot walk it, whatever the stroke where none was given.
        ParameterError: a value is out of range.
    """
    gait = named_gait(robot, name, stroke=DEFAULT_STROKE if stroke is None else stroke, **fields)
    try:
        refuse_impossible(robot, gait)
    except GaitError as error:
        if stroke is not None or error.quantity != "stroke" or error.limit is None:
            raise
        shorter = named_gait(robot, name, stroke=STROKE_SHARE * error.limit, **fields)
        refuse_impossible(robot, shorter)
        return shorter, (
            f"chosen: {STROKE_SHARE:.0%} of the largest that fits, {error.limit:.4g} m, "
            f"because {DEFAULT_STROKE} m does not"
        )
    return gait, "default" if stroke is None else "as given"
