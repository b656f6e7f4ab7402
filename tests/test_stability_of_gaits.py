"""Margins of planned walks of kharagpur: a closed form, and tables that were computed elsewhere.

Centre of mass at the middle of the base, 98.8 mm over the contact points.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.results.stability_margins import nesm
from hexapod_pin.robot.static_margins import static_margin

STROKE, PERIOD, HEIGHT = 0.14, 2.4, 0.0988  # m, s, m
HIP_X, HIP_Y, REACH = 0.2, 0.1025, 0.20284  # m; S2's legs, hips assumed

# Least values over a cycle in mm: static margin on straight lines and on arcs of the same stroke,
# NESM on straight lines, feet down. Computed independently of this package, at the middles of 720
# parts of a cycle: so each is somewhat above the least of all times.
TABLE = {
    "tripod": (28.7, 28.6, 4.1, 3),
    "tetrapod": (63.7, 65.0, 18.8, 4),
    "wave 2/3": (79.8, 79.9, 28.2, 4),
    "wave 3/4": (97.1, 97.1, 39.7, 4),
    "wave 5/6": (111.1, 110.7, 49.9, 5),
}
PRINTED = 0.0505e-3  # m: half of the last digit, and the round-off of halves


def gait(name: str) -> hp.Gait:
    fields = {"stroke": STROKE, "cycle_time": PERIOD, "lift": 0.02}
    kind, _, duty = name.partition(" ")
    if kind == "wave":
        up, down = map(int, duty.split("/"))
        return hp.Gait.wave(duty=up / down, **fields)
    return getattr(hp.Gait, kind)(**fields)


@cache
def least(name: str, motion: str, at_events: bool = False) -> tuple[float, float, int]:
    """Return the least static margin and NESM [m] and the least number of feet down."""
    robot, table = hp.load_robot("kharagpur"), gait(name)
    if motion == "arc":
        amplitude = float(np.arcsin(0.5 * STROKE / REACH))
        path = hp.motion.ArcWalk(table, amplitude=amplitude).path(robot)
    elif motion == "rolling":
        path = hp.KinematicControl(table).path(robot)
    else:
        path = FootPath(table, leg_group(robot).neutral_feet)
    begin = path.steady_from
    time = begin + PERIOD * (np.arange(720) + 0.5) / 720
    if at_events:  # margins are least just before lift-offs and after placements
        events = path.events(begin + 1.5 * PERIOD, begin - 0.5 * PERIOD)
        time = np.concatenate([events - 1e-10, events + 1e-10])
    points, down = path.positions(time) * [1.0, 1.0, 0.0], path.stance(time)
    com = np.array([0.0, 0.0, HEIGHT])
    margin = static_margin(points[..., :2], np.zeros((len(time), 2)), down)
    return float(margin.min()), float(nesm(points, com, down).min()), int(down.sum(axis=1).min())


@pytest.mark.parametrize("name", TABLE)
def test_table_of_straight_walks_and_of_walks_on_arcs(name: str) -> None:
    """The table's arcs have the stroke of 0.14 m (20.19 degrees); those of S2's 20 differ."""
    expected, on_arc, expected_energy, expected_feet = TABLE[name]
    margin, energy, feet = least(name, "straight")
    assert margin == pytest.approx(1e-3 * expected, abs=PRINTED)
    assert energy == pytest.approx(1e-3 * expected_energy, abs=PRINTED)
    margin, _, feet_on_arc = least(name, "arc")
    assert margin == pytest.approx(1e-3 * on_arc, abs=PRINTED)
    assert feet == feet_on_arc == expected_feet


def test_tripod_closed_forms() -> None:
    """28.51 mm; samples at the events to 1e-10 s, in which feet go 1e-11 m.

    Feet at (s, -b), (a + s, b), (s - a, b), a the hips' spacing, b = y_hip + R; s goes from half a
    stroke to minus that. The side from (s, -b) to (a + s, b) is b |2 s + a| / sqrt(a^2 + 4 b^2)
    from the middle, least at the end of the stance; on arcs b = y_hip + R cos A there.
    """
    b = HIP_Y + REACH
    expected = b * (HIP_X - STROKE) / np.hypot(HIP_X, 2.0 * b)
    found, energy, _ = least("tripod", "straight", at_events=True)
    assert expected == pytest.approx(28.51e-3, abs=5e-6)
    assert found == pytest.approx(expected, abs=1e-9)
    assert energy == pytest.approx(np.hypot(HEIGHT, expected) - HEIGHT, abs=1e-9)
    b = HIP_Y + REACH * np.cos(np.arcsin(0.5 * STROKE / REACH))
    expected = b * (HIP_X - STROKE) / np.hypot(HIP_X, 2.0 * b)
    assert least("tripod", "arc", at_events=True)[0] == pytest.approx(expected, abs=1e-9)


def test_spheres_that_roll_stand_a_little_more_safely() -> None:
    """A contact point goes along with the rolling foot, so the stroke below the body is shorter."""
    rolling, point = least("tripod", "rolling", at_events=True), least("tripod", "straight", True)
    assert 0.0 < rolling[0] - point[0] < 0.3e-3


def test_wave_3_4_closed_form() -> None:
    """The least is that of a quadrilateral found by hand from the planned phases."""
    table, duty = gait("wave 3/4"), 0.75
    phase = np.array(table.phases)
    hips = np.array([HIP_X, 0.0, -HIP_X, HIP_X, 0.0, -HIP_X])
    side = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0]) * (HIP_Y + REACH)
    found = [
        _margin_by_lines(hips + STROKE * (0.5 - age / duty), side, age < duty)
        for u in np.concatenate([phase, phase + duty])
        for age in (np.mod(u - phase + 1e-12, 1.0), np.mod(u - phase - 1e-12, 1.0))
    ]
    assert least("wave 3/4", "straight", at_events=True)[0] == pytest.approx(min(found), abs=1e-9)


def _margin_by_lines(x: NDArray, y: NDArray, down: NDArray[np.bool_]) -> float:
    """Return the margin of the origin in a polygon of two rows of feet: two rows, two slants."""
    left, right = x[down & (y > 0)], x[down & (y < 0)]
    b = float(y[0])
    best = b
    for sign in (1.0, -1.0):  # the side that bounds the polygon ahead, and the one behind
        first, second = max(sign * left), max(sign * right)
        best = min(best, b * (first + second) / float(np.hypot(first - second, 2.0 * b)))
    return best


# Torques of very slow walks against statics: the envelope of docs/references.md's S2 robot.

CYCLE = 24.0  # s, ten times S2's
FEMUR, SHANK_WEIGHT_TORQUE = 0.11934, 0.153  # m; N m by which the leg's own weight relieves joint 2
ENVELOPE = {
    "tripod": (hp.Gait.tripod, 1.66, 1.17, 2.73),
    "wave 5/6": (lambda **k: hp.Gait.wave(5 / 6, **k), 0.93, 0.61, 1.50),
}
CONTACT = hp.Contact(
    normal=hp.contact.HuntCrossley(stiffness=1e6, exponent=1.0, dissipation=100.0),
    friction=hp.Contact.preset("s2").friction,
)


@pytest.fixture(scope="module", params=ENVELOPE)
def slow(request: pytest.FixtureRequest) -> tuple[str, hp.Trace, slice]:
    """Return the steady cycle of a gait at a tenth of S2's speed, joints prescribed."""
    gait = ENVELOPE[request.param][0](cycle_time=CYCLE)
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=CONTACT, prescribed=True)
    how = {"method": "ndf", "accuracy": 1e-8, "sample": CYCLE / 1200}
    trace = hp.simulate(scene, hp.motion.ArcWalk(gait), duration=3 * CYCLE, **how)
    return request.param, trace, hp.torque_budget(trace).window.samples


def test_slow_walks_meet_the_static_envelope(slow: tuple[str, hp.Trace, slice]) -> None:
    name, trace, cycle = slow
    _, peak, rms, moment = ENVELOPE[name]
    femur, down = trace.torque[cycle, 1::3], trace.normal_force[cycle] > 0.0
    assert hp.torque_budget(trace).kind("femur").peak.torque_peak == pytest.approx(peak, rel=0.02)
    assert np.sqrt(np.mean(femur[down] ** 2)) == pytest.approx(rms, rel=0.02)
    assert hp.results.joint_moments(trace).moment[:, 0::3].max() == pytest.approx(moment, rel=0.02)
    assert np.median(np.abs(femur[~down])) == pytest.approx(SHANK_WEIGHT_TORQUE, rel=0.02)


def test_feet_share_the_weight_as_springs_do(slow: tuple[str, hp.Trace, slice]) -> None:
    """The share of least squares at each sample, away from touch-downs and lift-offs."""
    _, trace, cycle = slow
    force, down = trace.normal_force[cycle], trace.normal_force[cycle] > 0.0
    weight = 3.08746 * 9.81
    steady = np.array([(down[max(0, k - 15) : k + 16] == down[k]).all() for k in range(len(down))])
    share = np.array([
        least_squares_share(foot[feet], com, weight, feet)
        for foot, com, feet in zip(
            trace.foot_position[cycle], trace.com[cycle], down, strict=True
        )
    ])  # fmt: skip
    assert np.abs(force - share)[steady].max() < 0.02 * force.max()
    assert steady.mean() > 0.5


def least_squares_share(feet: Array, com: Array, weight: float, down: Array) -> Array:
    """Return vertical forces (6,) [N] of least squares that carry a weight at `com`."""
    rows = np.vstack([np.ones(len(feet)), feet[:, 0] - com[0], feet[:, 1] - com[1]])
    force = np.zeros(len(down))
    force[down] = np.linalg.lstsq(rows, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    return force
