"""`hp.stability`: margins of whole traces, on level and sloping ground, as data and as text."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from refusals import refused
from scipy.spatial import ConvexHull
from synthetic import synthetic_trace, with_run
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.commands.app import app
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.stability import MARGINS
from hexapod_pin.results.stability_margins import horizontal_axes
from hexapod_pin.robot.static_margins import longitudinal_margins, static_margin, support_polygon

RADIUS, HEIGHT = 0.3, 0.1  # of the synthetic trace's hexagon of feet, and of its centre of mass
APOTHEM = RADIUS * math.sqrt(3.0) / 2.0


@pytest.fixture(scope="module")
def walk() -> hp.Trace:
    gait = hp.Gait.tripod(stroke=0.14, cycle_time=2.4)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.KinematicControl(gait), duration=7.2)


def with_com(trace: hp.Trace, offset: np.ndarray) -> hp.Trace:
    return replace(trace, com=trace.com + offset)


def test_hexagon_closed_forms() -> None:
    """Six feet on a circle: apothem, corner ahead, corner behind, rise over a side."""
    found = hp.stability(synthetic_trace())
    count = len(found.time)
    assert found.static_margin == pytest.approx(np.full(count, APOTHEM), abs=1e-12)
    assert found.margin_ahead == pytest.approx(np.full(count, RADIUS), abs=1e-12)
    assert found.margin_behind == pytest.approx(np.full(count, RADIUS), abs=1e-12)
    assert found.nesm == pytest.approx(math.hypot(HEIGHT, APOTHEM) - HEIGHT, abs=1e-12)
    assert found.energy_margin == pytest.approx(found.weight * found.nesm)
    assert found.weight == pytest.approx(30.0)
    assert (found.feet_down == 6).all()


def test_lifted_foot_cuts_a_corner() -> None:
    """Without the foot ahead, the side between its neighbours is half a radius ahead."""
    trace = synthetic_trace()
    force = np.array(trace.foot_force)
    force[150:, 0] = 0.0  # the foot on the x axis, from 1.5 s on
    found = hp.stability(replace(trace, foot_force=force))
    least, time = found.least("margin_ahead")
    assert least == pytest.approx(0.5 * RADIUS, abs=1e-12)
    assert time > 1.499
    assert found.margin_ahead[found.time < 1.499] == pytest.approx(RADIUS, abs=1e-12)
    assert found.least("static_margin")[0] == pytest.approx(0.5 * RADIUS, abs=1e-12)
    assert found.feet_down.min() == 5


def test_in_the_air_there_is_no_margin() -> None:
    trace = synthetic_trace()
    force = np.array(trace.foot_force)
    force[200] = 0.0
    found = hp.stability(replace(trace, foot_force=force))
    for name in MARGINS:
        assert found.least(name) == (-math.inf, pytest.approx(2.0))
    assert found.to_dict()["margins"]["nesm"]["least"] is None
    json.loads(found.to_json())


def test_centre_of_mass_outside() -> None:
    """0.4 m to the left of the middle, with a side at the apothem: beyond it by the rest."""
    found = hp.stability(with_com(synthetic_trace(), np.array([0.0, 0.4, 0.0])))
    assert found.static_margin == pytest.approx(APOTHEM - 0.4, abs=1e-12)
    assert found.nesm == pytest.approx(HEIGHT - math.hypot(HEIGHT, 0.4 - APOTHEM), abs=1e-12)
    assert (found.margin_ahead == -math.inf).all()


def test_excursion_of_a_known_path() -> None:
    """Sines of 2, 3 and 5 mm about a line that climbs and goes aside, in whole periods."""
    trace = synthetic_trace(speed=0.0)
    phase = 2.0 * np.pi * trace.time
    waves = np.stack(
        [2e-3 * np.cos(2 * phase), 3e-3 * np.cos(phase), 5e-3 * np.cos(3 * phase)], axis=1
    )
    line = trace.time[:, None] * np.array([0.1, 0.0, 0.02]) + [0.5, -0.2, 0.1]
    found = hp.stability(replace(trace, com=line + waves))
    size = np.ptp(found.excursion, axis=0)
    # the line is fitted to 300 samples of cosines: their ends tilt it by 1 % of the amplitudes
    assert size == pytest.approx([4e-3, 6e-3, 10e-3], rel=0.02)
    assert np.abs(found.excursion.mean(axis=0)).max() < 1e-15


def test_turned_walk_has_the_same_margins() -> None:
    """Everything turned by 90 degrees, the direction of travel with it."""
    trace = with_com(synthetic_trace(speed=0.0), np.array([0.03, 0.02, 0.0]))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(trace, com=trace.com @ turn.T, foot_position=trace.foot_position @ turn.T)
    turned = with_run(turned, travel_direction=(0.0, 1.0))
    before, after = hp.stability(trace), hp.stability(turned)
    for name in MARGINS:
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-14)
    assert before.margin_ahead[0] != pytest.approx(before.margin_behind[0], abs=0.01)


def test_heading_turns_with_the_trunk() -> None:
    """A trunk that has yawed by 180 degrees since the start has ahead where behind was."""
    trace = with_com(synthetic_trace(speed=0.0), np.array([0.05, 0.0, 0.0]))
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


def test_walk_on_level_ground(walk: hp.Trace) -> None:
    """The planned tripod's least margin is 28.7 mm, where the sides change at one instant.

    A robot that sags stands on six feet for a while: the margin is that of a stroke shorter by up
    to the distance moved meanwhile (factor 2 b / sqrt(a^2 + 4 b^2) = 0.95 of the closed form).
    """
    found = hp.stability(walk)
    exchanges = 2 * found.window.cycles
    overlap = np.mean(found.feet_down > 3) * (found.window.end - found.window.start) / exchanges
    most = 28.7e-3 + 0.95 * 0.14 / 1.2 * overlap
    sway = 1e-3  # m, of the centre of mass
    assert 28.7e-3 - sway < found.least("static_margin")[0] < most + sway
    assert found.least("nesm")[0] > 0.0
    assert found.feet_down.min() == 3
    assert (found.static_margin <= found.longitudinal_margin + 1e-12).all()
    assert found.window.samples == hp.torque_budget(walk).window.samples
    assert len(found.time) == found.window.last - found.window.first + 1
    assert np.abs(found.excursion[:, 1]).max() < 2e-3
    every = hp.stability(walk, whole=True)
    assert len(every.time) == len(walk.time)
    assert every.static_margin.min() <= found.static_margin.min()


def test_slope_lowers_the_margin_behind(walk: hp.Trace) -> None:
    """Uphill the projection moves back by h tan a; lengths in the ground shrink by cos a."""
    angle, robot = 0.1, hp.load_robot("kharagpur")
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.14, cycle_time=2.4))
    tilted = (-9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle))
    uphill = hp.stability(hp.simulate(hp.Scene(robot, gravity=tilted), gait, duration=7.2))
    level = hp.stability(walk)
    height = float(walk.com[-1, 2])
    change = uphill.margin_behind.mean() - level.margin_behind.mean()
    # the walk yields downhill by a few mm more than on the level
    assert change == pytest.approx(-height * math.tan(angle), abs=4e-3)


def test_text_and_data(walk: hp.Trace) -> None:
    """Every margin is in the table with its unit, and in the data with its time."""
    found = hp.stability(walk)
    table, data = found.table(), found.to_dict()
    for name, meaning in MARGINS.items():
        least, time = found.least(name)
        assert f"{1e3 * least:.2f}" in next(x for x in table.splitlines() if meaning in x)
        assert data["margins"][name]["least"] == least
        assert data["margins"][name]["time"] == time
    assert "[mm]" in table and "mean normal force > 0" in table
    assert len(found.to_dict(samples=True)["samples"]["zmp"]) == len(found.time)
    with refused(hp.errors.UnknownNameError, kind="margin", name="margin"):
        found.least("margin")
    with refused(ValueError, about=("read-only",)):
        found.nesm[0] = 1.0


def test_command(walk: hp.Trace, tmp_path: Path) -> None:
    path = walk.save(tmp_path / "walk.nc")
    runner = CliRunner()
    text = runner.invoke(app, ["stability", str(path)]).output
    assert text.strip() == hp.stability(walk).table()
    plain = json.loads(runner.invoke(app, ["stability", str(path), "--json", "--whole"]).output)
    assert plain == hp.stability(walk, whole=True).to_dict()


def test_gravity_is_needed() -> None:
    with refused(hp.errors.ParameterError, "gravity"):
        hp.stability(synthetic_trace(gravity=[0.0, 0.0, 0.0]))


# Support polygon, static and longitudinal margins: closed forms, another algorithm, symmetry.

Points = NDArray[np.float64]

SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
ROUND_OFF = 1e-12  # m, of points within a metre


def margin_by_hull(points: Points, com: Points) -> float:
    """Return the margin by SciPy's hull: half-planes inside, the nearest side outside."""
    hull = ConvexHull(points)
    depth = -(hull.equations[:, :2] @ com + hull.equations[:, 2])
    if depth.min() >= 0.0:
        return float(depth.min())
    distances = []
    for i, j in hull.simplices:
        side = points[j] - points[i]
        share = np.clip(np.dot(com - points[i], side) / np.dot(side, side), 0.0, 1.0)
        distances.append(np.linalg.norm(com - points[i] - share * side))
    return -float(min(distances))


def test_triangle_closed_forms() -> None:
    """Inside: the incircle. Outside: to a side where its foot falls within, else to a corner."""
    points = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    assert static_margin(points, [1.0, 1.0]) == pytest.approx(1.0, abs=ROUND_OFF)  # incentre
    assert static_margin(points, [2.0, -0.5]) == pytest.approx(-0.5, abs=ROUND_OFF)
    assert static_margin(points, [-3.0, -4.0]) == pytest.approx(-5.0, abs=ROUND_OFF)
    assert static_margin(points, [2.0, 1.5]) == pytest.approx(0.0, abs=ROUND_OFF)  # on a side


def test_quadrilateral_closed_form() -> None:
    """A rhombus with half diagonals a and b: the centre is a b / sqrt(a^2 + b^2) inside."""
    a, b = 0.3, 0.2
    points = np.array([[a, 0.0], [0.0, b], [-a, 0.0], [0.0, -b]])
    assert static_margin(points, [0.0, 0.0]) == pytest.approx(a * b / np.hypot(a, b), abs=ROUND_OFF)


@pytest.mark.parametrize("count", [3, 4, 6, 9, 20])
def test_general_polygons_agree_with_another_hull(count: int) -> None:
    rng = np.random.default_rng(count)
    points, com = rng.normal(size=(60, count, 2)), 0.8 * rng.normal(size=(60, 2))
    found = static_margin(points, com)
    expected = [margin_by_hull(p, c) for p, c in zip(points, com, strict=True)]
    assert found == pytest.approx(np.array(expected), abs=ROUND_OFF)
    assert (found < 0.0).any() and (found > 0.0).any()


def test_too_few_points() -> None:
    """None: no support; one and two: minus the distance; on a line beyond its ends too."""
    assert static_margin(np.zeros((0, 2)), [0.0, 0.0]) == -np.inf
    assert static_margin([[3.0, 4.0]], [0.0, 0.0]) == pytest.approx(-5.0, abs=ROUND_OFF)
    pair = np.array([[-1.0, -1.0], [1.0, 1.0]])
    assert static_margin(pair, [0.0, 0.0]) == pytest.approx(0.0, abs=ROUND_OFF)
    assert static_margin(pair, [1.0, -1.0]) == pytest.approx(-np.sqrt(2.0), abs=ROUND_OFF)
    line = np.array([[0.1, 0.3], [0.2, 0.6], [0.3, 0.9]])
    assert static_margin(line, [0.4, 1.2]) == pytest.approx(-np.hypot(0.1, 0.3), abs=ROUND_OFF)
    assert static_margin(line, [0.15, 0.45]) == pytest.approx(0.0, abs=ROUND_OFF)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_moving_turning_and_mirroring_change_nothing(mirror: float) -> None:
    rng = np.random.default_rng(7)
    points, com, angle = rng.normal(size=(6, 2)), np.array([0.1, -0.2]), 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = (np.vstack([points, com]) * [1.0, mirror]) @ turn.T + [3.0, -8.0]
    before = static_margin(points, com)
    assert static_margin(moved[:6], moved[6]) == pytest.approx(before, abs=1e-11)  # 10 m away
    assert static_margin(points[::-1], com) == pytest.approx(before, abs=ROUND_OFF)
    ahead = np.array(longitudinal_margins(points, com, [1.0, 0.0]))
    turned = np.array(longitudinal_margins(moved[:6], moved[6], turn @ [1.0, 0.0]))
    assert turned == pytest.approx(ahead, abs=1e-11)


def test_feet_in_the_air_do_not_count() -> None:
    """A sample with some feet up is one with those feet left out; none down is no support."""
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
    assert static_margin(points, com, np.zeros_like(down)) == pytest.approx(np.full(40, -np.inf))


def along(points: ArrayLike, com: ArrayLike, heading: ArrayLike) -> tuple[float, float]:
    """Return the longitudinal margins of one sample."""
    ahead, behind = longitudinal_margins(points, com, heading)
    return float(ahead), float(behind)


def test_longitudinal_margins_of_a_rectangle() -> None:
    """Half lengths 0.3 and 0.2, centre of mass 0.05 ahead of the middle and 0.1 to the left."""
    points, com = SQUARE * [0.3, 0.2], [0.05, 0.1]
    assert along(points, com, [1.0, 0.0]) == pytest.approx((0.25, 0.35))
    assert along(points, com, [0.0, 1.0]) == pytest.approx((0.1, 0.3))
    assert along(points, com, [-1.0, 0.0]) == pytest.approx((0.35, 0.25))
    slanted = np.array([1.0, 1.0]) / np.sqrt(2.0)  # meets the left side first, then the right
    expected = np.sqrt(2.0) * np.array([0.1, 0.3])
    assert along(points, com, slanted) == pytest.approx(tuple(expected))


def test_longitudinal_margins_outside() -> None:
    """Behind the polygon the margin behind is negative; beside it there is none; on a side 0."""
    assert along(SQUARE, [-3.0, 0.0], [1.0, 0.0]) == pytest.approx((4.0, -2.0))
    assert along(SQUARE, [0.0, 2.0], [1.0, 0.0]) == (-np.inf, -np.inf)
    assert along(SQUARE, [0.0, 1.0], [1.0, 0.0]) == pytest.approx((1.0, 1.0))
    one = along([[2.0, 0.0]], [0.0, 0.0], [1.0, 0.0])
    assert one == pytest.approx((2.0, -2.0))


def test_longitudinal_margins_end_on_the_boundary() -> None:
    """Where the margins say the boundary is, the static margin is zero."""
    rng = np.random.default_rng(11)
    points, com = rng.normal(size=(50, 6, 2)), 0.2 * rng.normal(size=(50, 2))
    inside = static_margin(points, com) > 0.0
    points, com, heading = points[inside], com[inside], np.array([0.6, 0.8])
    assert inside.sum() > 20
    ahead, behind = longitudinal_margins(points, com, heading)
    for distance in (ahead, -behind):
        there = static_margin(points, com + distance[:, None] * heading)
        assert np.abs(there).max() < 1e-10  # shallow crossings
    assert (static_margin(points, com) <= np.minimum(ahead, behind) + ROUND_OFF).all()


def test_corners_of_the_polygon() -> None:
    """Counter-clockwise, without inner and collinear points; area as of SciPy's hull."""
    inner = np.array([[0.0, 0.0], [0.5, 0.5], [1.0, 0.0], [1.0, 1.0]])
    corners = support_polygon(np.vstack([SQUARE, inner]))
    assert sorted(map(tuple, corners)) == sorted(map(tuple, SQUARE))
    points = np.random.default_rng(5).normal(size=(30, 2))
    x, y = support_polygon(points).T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert area == pytest.approx(ConvexHull(points).volume, rel=1e-12)
    assert len(support_polygon([[1.0, 2.0], [1.0, 2.0]])) == 1


def test_axes_across_gravity() -> None:
    """Level: the world's own. Tilted: orthonormal, right-handed, the last against gravity."""
    assert np.array_equal(horizontal_axes((0.0, 0.0, -9.81)), np.eye(3))
    gravity = np.array([1.0, -2.0, -9.0])
    axes = horizontal_axes(gravity)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[2] == pytest.approx(-gravity / np.linalg.norm(gravity))


def test_what_cannot_be_projected_is_refused() -> None:
    for gravity in ((0.0, 0.0, 0.0), (-9.81, 0.0, 0.0), (0.0, np.nan, 1.0)):
        with refused(ParameterError, "gravity", gravity):
            horizontal_axes(gravity)
    with refused(ParameterError, "points", (4, 3)):
        static_margin(np.zeros((4, 3)), [0.0, 0.0])
    with refused(ParameterError, "grounded", (2,)):
        static_margin(SQUARE, [0.0, 0.0], [True, True])
