"""Each part of foot control in simulation: it does what it is for, in the right direction."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from foot_control_runs import EARLY, Recorded, robot, standing

import hexapod_pin as hp
from hexapod_pin.control import ArcWalk, leg_group


def patch(center: np.ndarray, height: float, size: float = 0.035) -> hp.HeightField:
    side = max(0.02, abs(height) / 1.5)
    x = np.arange(-1.0, 1.0 + 1e-9, 0.005)
    across, along = np.meshgrid(x - center[0], x - center[1])
    outside = np.maximum(np.abs(across), np.abs(along)) - size
    z = height * np.clip(1.0 - outside / side, 0.0, 1.0)
    return hp.HeightField.from_array(z, spacing=0.005, origin=(-1.0, -1.0))


ARC = ArcWalk(hp.Gait.tetrapod(cycle_time=2.0))
SLIP = {
    "force": hp.foot_control.SlipPid(),
    "slip": hp.foot_control.SlipPid(signal="slip", bandwidth=2.0),
}


@pytest.mark.parametrize(
    ("name", "contact", "walk", "signal", "most"),
    [
        ("athena", hp.Contact.s1(), hp.Gait.tripod(), "force", 0.5),
        ("kharagpur", hp.Contact.s2(), ARC, "slip", 0.6),
    ],
)
def test_slip_correction_shortens_the_slip_path(name, contact, walk, signal, most):
    """Of whole cycles: by more than half, and by more than 40 % where coxae alone move feet."""
    scene, paths = hp.Scene(robot(name), contact=contact), []
    for part in (None, SLIP[signal]):
        trace = hp.simulate(scene, hp.FootControl(walk, slip=part), duration=8.0, sample=0.02)
        paths.append(np.sum(trace.summary.slip_distance))
    assert 0.0 < paths[1] < most * paths[0]


@pytest.mark.parametrize(("name", "height"), [("athena", 0.003), ("kharagpur", -0.003)])
def test_a_foot_on_a_bump_is_drawn_up_and_one_over_a_hole_reaches_down(name, height):
    ground = patch(leg_group(robot(name)).neutral_feet[0], height)
    level, suspension, uneven = hp.Flat(), hp.foot_control.VirtualSuspension(), []
    for terrain, part in ((level, None), (ground, None), (ground, suspension)):
        run = Recorded(hp.FootControl(standing(), suspension=part))
        trace = hp.simulate(hp.Scene(robot(name), terrain=terrain), run, duration=1.5, sample=0.02)
        uneven.append(np.ptp(trace.foot_force[-1, :, 2]))
    travel = run.recalled("travel")[-1]
    assert travel[0] * np.sign(height) > 0.0005
    assert np.abs(travel).argmax() == 0
    assert uneven[2] - uneven[0] < 0.7 * (uneven[1] - uneven[0])


def test_levelling_puts_the_trunk_level_on_a_slope():
    """Five degrees are within the limit of 0.12 rad; a slope up along x is a negative pitch."""
    heading = -2.5
    scene = hp.Scene(robot("athena"), terrain=hp.Slope(angle=np.radians(5.0), heading=heading))
    tilt = []
    for part in (None, hp.foot_control.Levelling(limit=0.12)):
        control = hp.FootControl(standing(), levelling=part)
        trace = hp.simulate(scene, control, duration=4.0, sample=0.1)
        tilt.append(pin.rpy.matrixToRpy(pin.Quaternion(trace.q[-1, 3:7]).matrix())[:2])
    expected = np.radians(5.0) * np.array([np.sin(heading), -np.cos(heading)])
    assert tilt[0] == pytest.approx(expected, abs=np.radians(0.1))
    assert np.abs(tilt[1]).max() < np.radians(0.05)  # exp(-4 s * 2 pi 0.3 Hz) of 5 degrees


LEG, LANDING = 3, 3.0  # s
"""Whose second step comes down on what is not level, and when."""


@cache
def stepped(name: str, height: float, touch_down: hp.foot_control.TouchDown | None):
    walk = hp.KinematicControl(hp.Gait.tripod(lift=0.03, cycle_time=2.0))
    path = walk.path(robot(name))
    place = path.positions([LANDING])[0][LEG] + path.body_pose([LANDING])[0] * [1.0, 1.0, 0.0]
    scene = hp.Scene(robot(name), terrain=patch(place[:2] + [0.02, 0.0], height))
    run = Recorded(hp.FootControl(walk, touch_down=touch_down))
    return run, hp.simulate(scene, run, duration=3.6, sample=0.02)


def sole(name: str, trace: hp.Trace, time: float) -> float:
    """Return the height of the lowest point of foot LEG [m]."""
    foot = robot(name).leg(leg_group(robot(name)).legs[LEG].name).foot
    index = [f.name for f in robot(name).feet].index(foot)
    row = int(np.argmin(np.abs(trace.time - time)))
    return float(trace.foot_position[row, index, 2] - robot(name).foot(foot).radius)


def test_a_foot_that_meets_the_ground_early_stops_there():
    name = "athena"
    run, trace = stepped(name, 0.015, hp.foot_control.TouchDown())
    early = np.flatnonzero(run.recalled("mode")[:, LEG] == EARLY) * 0.005
    early = early[early > 2.1]
    assert early[0] < LANDING - 0.03 and early[-1] < LANDING + 0.02
    offset = run.recalled("offset")[:, LEG, 2]
    assert offset.max() == pytest.approx(0.015, abs=0.002)
    assert sole(name, trace, 3.2) == pytest.approx(0.015, abs=0.001)
    _, blind = stepped(name, 0.015, None)
    tilt = [np.abs(t.q[(t.time > 2.5) & (t.time < 3.2), 3:5]).max() for t in (trace, blind)]
    assert tilt[0] < 0.5 * tilt[1]
