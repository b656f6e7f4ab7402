"""Walks go where their plans say, at any heading and foot radius: a part of its study."""

from __future__ import annotations

import numpy as np
import pytest
from studies.walks.walk_tracking import LIMIT, measured

import hexapod_pin as hp

WALKS = [
    ("kharagpur", 0.03, hp.Gait.tetrapod(stroke=0.06, cycle_time=1.6, heading=np.pi / 2)),
    ("kharagpur", None, hp.Gait.ripple(stroke=0.06, heading=np.radians(37), turn_rate=0.1)),
    ("athena", None, hp.Gait.tripod(stroke=0.06, heading=np.radians(-120))),
    ("athena", 0.0, hp.Gait.wave(stroke=0.06, cycle_time=4.0, turn_rate=-0.05)),
]


@pytest.mark.parametrize(("robot", "radius", "gait"), WALKS)
def test_walk_follows_its_plan(robot: str, radius: float | None, gait: hp.Gait) -> None:
    """Within 1 %, as the mission asks; 0.3 % is what the load's pressing of feet leaves."""
    found = measured(robot, radius, gait)
    assert abs(found.speed) < LIMIT
    assert abs(found.heading) < LIMIT
    assert abs(found.turn_rate) < LIMIT
