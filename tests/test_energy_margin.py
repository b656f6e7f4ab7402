"""Energy stability margins: level ground, sloping edges by turning the robot, signs, symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from hexapod_pin.results.stability_margins import edge_rise, nesm

UP = np.array([0.0, 0.0, 1.0])
SQUARE = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])


def test_level_ground() -> None:
    """sqrt(z^2 + d^2) - z for an edge at d; small margins keep their digits."""
    d, z = 0.2, 0.0988
    assert nesm(d * SQUARE, [0.0, 0.0, z]) == pytest.approx(np.hypot(z, d) - z, abs=1e-15)
    near = nesm(d * SQUARE, [0.15, 0.0, z])
    assert near == pytest.approx(np.hypot(z, 0.05) - z, abs=1e-15)
    for d in (0.3, 0.01, 1e-6, 1e-9):
        z = 0.1
        first, second = np.array([d, -1.0, 0.0]), np.array([d, 2.0, 0.0])
        found = edge_rise(first, second, [0.0, 0.0, z], UP)
        assert found == pytest.approx(d * d / (np.hypot(z, d) + z), rel=1e-12)


@pytest.mark.parametrize("slope", [0.0, -0.5, 1.0])
def test_sloping_edge_by_turning_about_it(slope: float) -> None:
    """The highest of all positions of a body that turns about the edge, found by trying them."""
    first, second = np.array([0.2, -0.3, 0.0]), np.array([0.25, 0.4, 0.7 * slope])
    com = np.array([0.0, 0.05, 0.15])
    axis = (second - first) / np.linalg.norm(second - first)

    def height(angle: float) -> float:
        return float(Rotation.from_rotvec(angle * axis).apply(com - first)[2])

    angles = np.linspace(-np.pi, np.pi, 721)
    best = angles[np.argmax([height(angle) for angle in angles])]
    near = minimize_scalar(
        lambda a: -height(a), bounds=(best - 0.01, best + 0.01), method="bounded"
    )
    expected = -near.fun - (com - first)[2]
    # 1e-5 rad beside the top costs 1e-10 / 2 of the arm
    assert edge_rise(first, second, com, UP) == pytest.approx(expected, abs=1e-9)


def test_outside_it_is_what_has_been_lost() -> None:
    """On the boundary 0, beyond an edge minus the rise back; of two points, one, or none."""
    z, d = 0.1, 0.05
    for x, expected in ((1.0, 0.0), (1.0 + d, z - np.hypot(z, d)), (1.0 - d, np.hypot(z, d) - z)):
        assert nesm(SQUARE, [x, 0.0, z]) == pytest.approx(expected, abs=1e-15)
    assert nesm(np.zeros((0, 3)), [0.0, 0.0, z]) == -np.inf
    assert nesm([[0.3, 0.4, 0.0]], [0.0, 0.0, z]) == pytest.approx(z - np.hypot(z, 0.5))
    pair = [[-1.0, 0.2, 0.0], [1.0, 0.2, 0.0]]
    assert nesm(pair, [0.0, 0.0, z]) == pytest.approx(z - np.hypot(z, 0.2), abs=1e-15)
    assert nesm(pair, [0.0, 0.2, z]) == 0.0


def test_what_changes_no_margin() -> None:
    rng = np.random.default_rng(2)
    points, com = rng.normal(size=(5, 3)) * [0.3, 0.3, 0.05], np.array([0.02, -0.03, 0.2])
    before = nesm(points, com)
    world = Rotation.from_rotvec([0.2, 0.4, 0.06]).apply([*points, com, (0.0, 0.0, -9.81)])
    after = nesm(world[:5], world[5], gravity=world[6])
    assert after == pytest.approx(float(before), abs=1e-14)
    mirror = np.array([1.0, -1.0, 1.0])
    assert nesm(points * mirror, com * mirror) == pytest.approx(float(before), abs=1e-15)
    points, com = rng.normal(size=(30, 6, 3)) * [0.3, 0.3, 0.02], np.array([0.0, 0.0, 0.2])
    down = rng.random((30, 6)) < 0.7
    together = nesm(points, com, down)
    alone = [float(nesm(p[d], com)) for p, d in zip(points, down, strict=True)]
    assert together == pytest.approx(np.array(alone), abs=1e-15)
