"""The table of a walk in the core against the foot path and the gait that it is made of."""

from __future__ import annotations

import numpy as np
import pytest
from foot_control_runs import robot

import hexapod_pin as hp
from hexapod_pin.control import ArcWalk
from hexapod_pin.control.foot_control.leg_model import CYCLES_AT_ONCE, PlannedWalk

TURN = hp.motion.VelocityCommand(time=[0.0, 3.0], forward=[0.04, 0.0], turn_rate=[0.0, 0.1])
WALKS = {
    "tripod": ("athena", hp.KinematicControl(hp.Gait.tripod())),
    "ripple": ("kharagpur", hp.KinematicControl(hp.Gait.ripple(turn_rate=0.1))),
    "stops": ("athena", hp.KinematicControl(hp.Gait.tripod(), stop_at=9.0)),
    "commanded": ("athena", hp.KinematicControl(hp.Gait.tripod(), velocity=TURN)),
    "arc": ("kharagpur", ArcWalk(hp.Gait.tetrapod(cycle_time=2.0))),
    "high": (
        "athena",
        hp.KinematicControl(hp.Gait.wave(cycle_time=3.0), body=hp.motion.BodyMotion(height=0.01)),
    ),
}
every_walk = pytest.mark.parametrize("walk", WALKS)


def made(walk: str):
    name, control = WALKS[walk]
    return control, control.path(robot(name)), PlannedWalk(robot(name), control)


def times(control, until: float) -> np.ndarray:
    gait = control.gait
    t = np.random.default_rng(3).uniform(0.0, until, 90)
    age = np.mod(t[:, None] / gait.cycle_time - np.array(gait.phases), 1.0)
    near = np.minimum.reduce([age, 1.0 - age, np.abs(age - gait.duty)]).min(axis=1)
    return np.sort(t[near > 1e-6])


@every_walk
def test_feet_are_where_the_path_has_them(walk):
    control, path, plan = made(walk)
    cycle = control.gait.cycle_time
    t = times(control, 6.0 * cycle)
    feet, rates = path.positions_and_velocities(t)
    # linear in a cell; on arcs feet leave and land with jumps of acceleration [m], [-]
    most, off = (3e-6, 2e-2) if walk == "arc" else (1e-6, 5e-3)
    far = (path.steady_from > 0.0) * 1e5 * cycle
    for time, foot, rate in zip(t, feet, rates, strict=True):
        plan.reach(time)
        row = plan.table.at(time)
        assert np.abs(row[:, :3] - foot).max() < most
        assert np.abs(row[:, 3:6] - rate).max() < off * np.abs(rates).max()
        if plan.repeats and time > 2.0 * cycle:
            assert np.abs(plan.table.at(time + far)[:, :3] - foot).max() < most
    assert plan.repeats == (walk not in ("stops", "commanded"))


@every_walk
def test_the_schedule_is_that_of_the_path(walk):
    control, path, plan = made(walk)
    gait = control.gait
    cycle, duty = gait.cycle_time, gait.duty
    t = times(control, 5.0 * cycle)
    stance = path.stance(t)
    for time, down in zip(t, stance, strict=True):
        plan.reach(time)
        row = plan.table.at(time)
        assert list(row[:, 6] == 1.0) == list(down)
        age = np.mod(time / cycle - np.array(gait.phases), 1.0)
        swings = ~down
        assert row[swings, 7] == pytest.approx((age[swings] - duty) / (1.0 - duty), abs=1e-9)
        assert not row[down, 7].any()
        planned = age < duty
        left = np.where(planned, duty - age, 1.0 - age + duty) * cycle
        middle = np.where(planned, time + left + 0.5 * (1.0 - duty) * cycle, 0.0)
        left += cycle * (planned & np.diagonal(path.stance(middle)))
        assert row[down, 8] == pytest.approx(left[down], abs=1e-9)


def test_the_table_grows_with_the_walk_and_stands_where_it_ends():
    control, path, plan = made("commanded")
    first, cycle = plan.table.end, control.gait.cycle_time
    late = first + 3.3 * cycle
    standing_still = plan.table.at(late)[:, :3]
    assert standing_still == pytest.approx(plan.table.at(first)[:, :3], abs=1e-12)
    plan.reach(late)
    assert plan.table.end == pytest.approx(first + CYCLES_AT_ONCE * cycle)
    assert plan.table.at(late)[:, :3] == pytest.approx(path.positions([late])[0], abs=1e-6)


def test_a_walk_that_stops_stands():
    control, path, plan = made("stops")
    plan.reach(60.0)
    for time in (9.0, 9.7, 14.0, 59.0):
        row = plan.table.at(time)
        assert (row[:, 6] == 1.0).all() and np.abs(row[:, 3:6]).max() < 1e-9
        assert row[:, :3] == pytest.approx(path.neutral_feet, abs=1e-6)
