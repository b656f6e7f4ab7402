"""Where foot control has to know more than the tick before: starts, and feet that do not lift."""

from __future__ import annotations

import numpy as np
import pytest
from foot_control_runs import Recorded, recall, robot, standing
from test_foot_control_loops import NAME, SLIDING, turning_trunk
from test_foot_control_parts import PUSHED, loads_on, made, ticks

import hexapod_pin as hp
from hexapod_pin.control.foot_control.leg_model import PlannedWalk


def test_feet_that_stay_down_keep_their_share_of_the_load():
    """A robot that stands: no foot gives its load back where the schedule would have it lift."""
    law = made(walk=standing(2.0), suspension=hp.foot_control.VirtualSuspension())
    _, memory = ticks(law, [loads_on(NAME, PUSHED)] * 450)
    assert recall(memory, "bearing").min() == 1.0
    assert recall(memory, "share").min() == 1.0


def test_a_standing_foot_knows_that_its_next_swing_does_not_come():
    plan = PlannedWalk(robot(NAME), standing(2.0))
    for time in np.linspace(0.11, 4.01, 40):
        assert plan.table.at(time)[:, 8].min() > 0.99  # half a cycle is the least: a new stance


def test_a_robot_that_stands_stays_at_rest_on_its_suspension():
    run = Recorded(hp.FootControl(standing(2.0), suspension=hp.foot_control.VirtualSuspension()))
    hp.simulate(hp.Scene(robot(NAME)), run, duration=4.0, sample=0.02)
    travel = run.recalled("travel")[200:]
    assert np.ptp(travel, axis=0).max() < 1e-5


def test_the_first_tick_of_a_trunk_that_turns_already_slides_no_foot():
    """A run may begin in motion: the first tick knows of no way of the feet yet."""
    rate = np.array([0.0, 0.0, 0.2])
    _, memory = ticks(made(slip=SLIDING), turning_trunk(rate, rate))
    assert recall(memory, "slid") == pytest.approx(np.zeros((30, 6, 3)), abs=1e-5)
