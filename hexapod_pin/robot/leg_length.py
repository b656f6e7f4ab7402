"""How long a robot's legs are."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


def leg_length(robot: Robot) -> float:
    """Return the length of the longest leg from its first joint to its foot, stretched [m]."""
    model, found = robot.model, 0.0
    for foot in robot.feet:
        chain = [j for j in model.supports[model.getJointId(foot.joint)] if j > 1]
        links = [model.jointPlacements[j].translation for j in chain[1:]] + [foot.offset]
        found = max(found, math.fsum(float(np.linalg.norm(link)) for link in links))
    return found
