"""How far the ground rises above the straight line between two footholds of a walk.

A swing foot clears what is lower than its lift. On a slope the trunk leans with the ground, and the
line between two footholds with it; a riser, a ledge or a bump stands above that line.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.trace import Trace

SPACING = 0.005
"""Distance of the places that are looked at [m]."""

CLEARED = 0.9
"""Share of the lift that a foot surely clears: elsewhere than at mid-swing it is lower [-]."""

RESERVE = 1.3
"""Lift that is advised over the height of the obstacle [-]."""

ROUND = 0.005
"""An advised lift is a whole number of these [m]."""


class Obstacle(NamedTuple):
    """The highest part of the ground between two footholds.

    Attributes:
        height: above the line between them [m].
        distance: from where the robot started, along its way [m].
        lift: of the gait [m].
    """

    height: float
    distance: float
    lift: float

    @property
    def is_cleared(self) -> bool:
        """Whether a swing foot passes over it."""
        return self.height <= CLEARED * self.lift

    @property
    def advised_lift(self) -> float:
        """A lift that clears it [m]."""
        return ROUND * math.ceil(RESERVE * self.height / ROUND - 1e-9)


def find_obstacle(trace: Trace) -> Obstacle | None:
    """Return the highest obstacle on the planned way of the feet.

    Returns:
        None where the ground, the gait or the feet of the run are not known.
    """
    scene, gait = trace.run.scene, trace.run.case.controller.get("gait")
    walk = trace.run.case.controller.get("walk")
    if gait is None and isinstance(walk, Mapping):
        gait = walk.get("gait")  # of a controller that moves the feet of a plan
    if scene is None or not isinstance(gait, Mapping) or "contacts" not in trace.recorded:
        return None
    numbers = [gait.get(name) for name in ("stroke", "duty", "lift")]
    if not all(isinstance(number, int | float) for number in numbers):
        return None
    stroke, duty, lift = map(float, numbers)  # type: ignore[arg-type]
    length = trace.run.walk.speed * float(trace.time[-1] - trace.time[0])
    if not (stroke > 0.0 and length > 0.0):
        return None
    swing = stroke / duty  # of a foot over the ground
    along = np.array(trace.run.walk.travel_direction)
    way = np.arange(0.0, length + swing + SPACING, SPACING)
    found = [
        _above_line(scene.terrain.height_at(*(foot[:2, None] + along[:, None] * way)), swing)
        for foot in trace.foot_position[0]
    ]
    heights = np.max(found, axis=0)
    worst = int(np.argmax(heights))
    return Obstacle(float(heights[worst]), float(way[worst]), lift)


def _above_line(height: Array, swing: float) -> Array:
    """Return how far the ground is above the line between footholds a swing apart, at each start.

    Args:
        height: of the ground at places `SPACING` apart [m]. Shape (n,).
        swing: distance of two footholds [m].

    Returns:
        Shape (n,): 0 where no whole swing follows.
    """
    parts = max(2, round(swing / SPACING))
    found = np.zeros(len(height))
    if len(height) <= parts:
        return found
    windows = np.lib.stride_tricks.sliding_window_view(height, parts + 1)
    share = np.linspace(0.0, 1.0, parts + 1)
    line = windows[:, :1] + share * (windows[:, -1:] - windows[:, :1])
    found[: len(windows)] = (windows - line).max(axis=1)
    return found


# How deep feet stand in the ground, and what pulls them there.

MUCH_SUNK = 0.5
"""Depth of a standing foot over the lift from which it is taken for the cause [-] (*assumed*)."""


class Sinking(NamedTuple):
    """How deep feet stand in the ground: depth and lift [m], stiffness [N/m^exponent]."""

    depth: float
    lift: float
    stiffness: float
    exponent: float


def sinking(trace: Trace) -> Sinking | None:
    """Return how deep a foot with a third of the weight stands; None where that is no matter."""
    scene, gait = trace.run.scene, trace.run.case.controller.get("gait")
    lift = gait.get("lift") if isinstance(gait, Mapping) else None
    if scene is None or not isinstance(lift, int | float):
        return None
    law, weight = scene.contact.normal, trace.run.robot.mass * math.hypot(*trace.run.gravity)
    depth = (weight / 3.0 / law.stiffness) ** (1.0 / law.exponent)
    if not depth > MUCH_SUNK * lift:
        return None
    return Sinking(depth, float(lift), law.stiffness, law.exponent)


UPWARDS = "gravity points up"

MOST_GRAVITY = 30.0
"""Gravity above which it is in another unit [m/s^2]: Jupiter has 24.8."""


def gravity_doubt(gravity: tuple[float, ...]) -> str:
    """Return that gravity [m/s^2] points up, or is none of a planet's; mostly nothing."""
    size = math.hypot(*gravity)
    if gravity[2] > 0.0:
        return f"{UPWARDS}, {size:.3g} m/s^2"
    return f"gravity is {size:.4g} m/s^2" if size > MOST_GRAVITY else ""
