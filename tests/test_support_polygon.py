"""Support polygon, static and longitudinal margins: closed forms, another algorithm, symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from refusals import refused
from scipy.spatial import ConvexHull

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.stability_margins import (
    horizontal_axes,
    longitudinal_margins,
    static_margin,
    support_polygon,
)

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
