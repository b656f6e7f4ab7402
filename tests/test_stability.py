"""`hp.stability`: margins of whole traces, on level and sloping ground, as data and as text."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from synthetic import synthetic_trace
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.commands.app import app
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.stability import MARGINS
from hexapod_pin.results.stability_margins import horizontal_axes, nesm
from hexapod_pin.robot.static_margins import longitudinal_margins, static_margin, support_polygon

RADIUS, HEIGHT = 0.3, 0.1  # of the synthetic trace's hexagon of feet, and of its centre of mass
APOTHEM = RADIUS * math.sqrt(3.0) / 2.0


@pytest.fixture(scope="module")
def walk() -> hp.Trace:
    gait = hp.Gait.tripod(stroke=0.14, cycle_time=2.4)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.KinematicControl(gait), duration=7.2, accuracy=1e-3)


def aside(x: float, y: float) -> hp.Trace:
    """Return a trace at rest whose centre of mass is off the middle [m]."""
    trace = synthetic_trace(speed=0.0)
    return replace(trace, com=trace.com + [x, y, 0.0])


def test_hexagon_closed_forms() -> None:
    found = hp.stability(synthetic_trace())
    assert found.static_margin == pytest.approx(APOTHEM, abs=1e-12)
    assert found.margin_ahead == pytest.approx(RADIUS, abs=1e-12)
    assert found.margin_behind == pytest.approx(RADIUS, abs=1e-12)
    assert found.nesm == pytest.approx(math.hypot(HEIGHT, APOTHEM) - HEIGHT, abs=1e-12)
    assert found.energy_margin == pytest.approx(found.weight * found.nesm)
    assert found.weight == pytest.approx(30.0)
    assert (found.feet_down == 6).all()


def test_lifted_foot_cuts_a_corner() -> None:
    trace = synthetic_trace()
    force = np.array(trace.foot_force)
    force[150:, 0] = 0.0  # the foot on the x axis, from 1.5 s on
    found = hp.stability(replace(trace, foot_force=force))
    least, time = found.least("margin_ahead")
    assert least == pytest.approx(0.5 * RADIUS, abs=1e-12)
    assert time > 1.499
    assert found.feet_down.min() == 5
    force[200] = 0.0  # in the air
    found = hp.stability(replace(trace, foot_force=force))
    assert all(found.least(name) == (-math.inf, pytest.approx(2.0)) for name in MARGINS)
    assert found.to_dict()["margins"]["nesm"]["least"] is None
    json.loads(found.to_json())


def test_heading_turns_with_the_trunk() -> None:
    trace = aside(0.05, 0.0)
    q = np.array(trace.q)
    q[1:, 3:7] = [0.0, 0.0, 1.0, 0.0]
    found = hp.stability(replace(trace, q=q))
    assert found.margin_ahead == pytest.approx(RADIUS + 0.05, abs=1e-12)


def test_tilted_gravity_projects_along_itself() -> None:
    """The centre of mass at height h under gravity tilted by a stands h tan a further down."""
    angle = 0.2
    gravity = [9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle)]
    found = hp.stability(synthetic_trace(gravity=gravity))
    shift = HEIGHT * math.tan(angle)
    # the plane of projection is across gravity: lengths along x shrink by cos a
    assert found.margin_ahead == pytest.approx((RADIUS - shift) * math.cos(angle), abs=1e-12)
    assert found.margin_behind == pytest.approx((RADIUS + shift) * math.cos(angle), abs=1e-12)


def test_table_data_and_command(walk: hp.Trace, tmp_path: Path) -> None:
    found = hp.stability(walk)
    assert found.feet_down.min() == 3
    assert found.window.samples == hp.torque_budget(walk).window.samples
    table, data = found.table(), found.to_dict()
    for name, meaning in MARGINS.items():
        least, time = found.least(name)
        assert f"{1e3 * least:.2f}" in next(x for x in table.splitlines() if meaning in x)
        assert data["margins"][name] | {"least": least, "time": time} == data["margins"][name]
    assert "[mm]" in table and "mean normal force > 0" in table
    assert len(found.to_dict(samples=True)["samples"]["zmp"]) == len(found.time)
    with refused(hp.errors.UnknownNameError, kind="margin", name="margin"):
        found.least("margin")
    path, runner = walk.save(tmp_path / "walk.nc"), CliRunner()
    assert runner.invoke(app, ["stability", str(path)]).output.strip() == table
    plain = json.loads(runner.invoke(app, ["stability", str(path), "--json", "--whole"]).output)
    assert plain == hp.stability(walk, whole=True).to_dict()


SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
ROUND_OFF = 1e-12  # m, of points within a metre


def test_triangle_closed_forms() -> None:
    """Inside: the incircle. Outside: to a side where its foot falls within, else to a corner."""
    points = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    assert static_margin(points, [1.0, 1.0]) == pytest.approx(1.0, abs=ROUND_OFF)  # incentre
    assert static_margin(points, [2.0, -0.5]) == pytest.approx(-0.5, abs=ROUND_OFF)
    assert static_margin(points, [-3.0, -4.0]) == pytest.approx(-5.0, abs=ROUND_OFF)


def test_too_few_points() -> None:
    assert len(support_polygon([[1.0, 2.0], [1.0, 2.0]])) == 1
    assert len(support_polygon(np.vstack([SQUARE, 0.5 * SQUARE, [[1.0, 0.0]]]))) == 4
    assert static_margin(np.zeros((0, 2)), [0.0, 0.0]) == -np.inf
    assert static_margin([[3.0, 4.0]], [0.0, 0.0]) == pytest.approx(-5.0, abs=ROUND_OFF)
    pair = np.array([[-1.0, -1.0], [1.0, 1.0]])
    assert static_margin(pair, [1.0, -1.0]) == pytest.approx(-np.sqrt(2.0), abs=ROUND_OFF)
    line = np.array([[0.1, 0.3], [0.2, 0.6], [0.3, 0.9]])
    assert static_margin(line, [0.4, 1.2]) == pytest.approx(-np.hypot(0.1, 0.3), abs=ROUND_OFF)
    assert static_margin(line, [0.15, 0.45]) == pytest.approx(0.0, abs=ROUND_OFF)


def test_feet_in_the_air_do_not_count() -> None:
    rng = np.random.default_rng(3)
    points, com = rng.normal(size=(40, 6, 2)), 0.3 * rng.normal(size=(40, 2))
    down = rng.random((40, 6)) < 0.6
    down[0], down[1] = False, [True, False, False, False, False, False]
    together = static_margin(points, com, down)
    ahead, behind = longitudinal_margins(points, com, [0.0, 1.0], down)
    for k in range(40):
        alone = points[k][down[k]]
        assert together[k] == pytest.approx(static_margin(alone, com[k]), abs=ROUND_OFF)
        one = longitudinal_margins(alone, com[k], [0.0, 1.0])
        pair = np.array([ahead[k], behind[k]])
        assert pair == pytest.approx(np.array(one), abs=1e-10)  # crossings may be shallow
    assert together[0] == ahead[0] == behind[0] == -np.inf
    assert (static_margin(points, com, np.zeros_like(down)) == -np.inf).all()


def test_longitudinal_margins_of_a_rectangle() -> None:
    points, com = SQUARE * [0.3, 0.2], [0.05, 0.1]
    assert longitudinal_margins(points, com, [1.0, 0.0]) == pytest.approx((0.25, 0.35))
    assert longitudinal_margins(points, com, [0.0, 1.0]) == pytest.approx((0.1, 0.3))
    slanted = np.array([1.0, 1.0]) / np.sqrt(2.0)  # meets the left side first, then the right
    expected = np.sqrt(2.0) * np.array([0.1, 0.3])
    assert longitudinal_margins(points, com, slanted) == pytest.approx(tuple(expected))
    # behind the polygon the margin behind is negative; beside it there is none
    assert longitudinal_margins(SQUARE, [-3.0, 0.0], [1.0, 0.0]) == pytest.approx((4.0, -2.0))
    assert longitudinal_margins(SQUARE, [0.0, 2.0], [1.0, 0.0]) == (-np.inf, -np.inf)
    assert longitudinal_margins(SQUARE, [0.0, 1.0], [1.0, 0.0]) == pytest.approx((1.0, 1.0))
    assert longitudinal_margins([[2.0, 0.0]], [0.0, 0.0], [1.0, 0.0]) == pytest.approx((2.0, -2.0))


def test_what_cannot_be_projected_is_refused() -> None:
    with refused(ParameterError, "gravity"):
        hp.stability(synthetic_trace(gravity=[0.0, 0.0, 0.0]))
    with refused(ParameterError, "gravity", (-9.81, 0.0, 0.0)):
        horizontal_axes((-9.81, 0.0, 0.0))
    with refused(ParameterError, "points", (4, 3)):
        static_margin(np.zeros((4, 3)), [0.0, 0.0])
    with refused(ParameterError, "grounded", (2,)):
        static_margin(SQUARE, [0.0, 0.0], [True, True])


# margins of planned walks: a closed form, and tables that were computed elsewhere

STROKE, PERIOD, OVER_GROUND = 0.14, 2.4, 0.0988  # m, s, m
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
    else:
        path = FootPath(table, leg_group(robot).neutral_feet)
    begin = path.steady_from
    time = begin + PERIOD * (np.arange(720) + 0.5) / 720
    if at_events:  # margins are least just before lift-offs and after placements
        events = path.events(begin + 1.5 * PERIOD, begin - 0.5 * PERIOD)
        time = np.concatenate([events - 1e-10, events + 1e-10])
    points, down = path.positions(time) * [1.0, 1.0, 0.0], path.stance(time)
    com = np.array([0.0, 0.0, OVER_GROUND])
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
    """28.51 mm; samples at the events to 1e-10 s, in which feet go 1e-11 m."""
    b = HIP_Y + REACH
    expected = b * (HIP_X - STROKE) / np.hypot(HIP_X, 2.0 * b)
    found, energy, _ = least("tripod", "straight", at_events=True)
    assert expected == pytest.approx(28.51e-3, abs=5e-6)
    assert found == pytest.approx(expected, abs=1e-9)
    assert energy == pytest.approx(np.hypot(OVER_GROUND, expected) - OVER_GROUND, abs=1e-9)
    b = HIP_Y + REACH * np.cos(np.arcsin(0.5 * STROKE / REACH))
    expected = b * (HIP_X - STROKE) / np.hypot(HIP_X, 2.0 * b)
    assert least("tripod", "arc", at_events=True)[0] == pytest.approx(expected, abs=1e-9)
