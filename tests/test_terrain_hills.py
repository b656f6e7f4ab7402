"""Height fields: native contacts against NumPy, gradients and nearest points."""

from __future__ import annotations

import numpy as np
import pytest
from grounds import HILLS, nearest, places

import hexapod_pin as hp

# --- height fields ------------------------------------------------------------------------------


def test_hills_native_and_numpy_agree() -> None:
    """Two implementations (splines by rows in C++, Hermite weights in NumPy), inside and beyond."""
    native = HILLS.native()
    for x, y in places():
        z, normal = float(HILLS.height_at(x, y)), HILLS.normal_at(x, y)
        [(gap, direction)] = native.contacts(np.array([x, y, z]), 0.0)
        assert gap == pytest.approx(0.0, abs=1e-14)
        assert direction == pytest.approx(normal, abs=1e-12)


def test_hills_normals_are_the_gradient_of_the_heights() -> None:
    x, y = places().T
    step = 1e-6
    slope_x = (HILLS.height_at(x + step, y) - HILLS.height_at(x - step, y)) / (2.0 * step)
    slope_y = (HILLS.height_at(x, y + step) - HILLS.height_at(x, y - step)) / (2.0 * step)
    normals = HILLS.normal_at(x, y)
    # rounding of heights of 0.02 m over 2e-6 m: 1e-12; curvature jumps at grid lines: 1e-6
    assert -normals[:, 0] / normals[:, 2] == pytest.approx(slope_x, abs=1e-5)
    assert -normals[:, 1] / normals[:, 2] == pytest.approx(slope_y, abs=1e-5)


def test_hills_pass_through_their_points_and_run_out_to_level() -> None:
    z = np.random.default_rng(0).uniform(-0.01, 0.01, (5, 7))
    field = hp.HeightField.from_array(z, (0.1, 0.2), origin=(3.0, -1.0))
    x, y = np.meshgrid(3.0 + 0.1 * np.arange(7), -1.0 + 0.2 * np.arange(5))
    assert field.height_at(x, y) == pytest.approx(z, abs=1e-15)
    far = field.height_at([2.9, 0.0, 3.7, 9.0], [-0.8, -0.8, -0.8, -0.8])
    assert far == pytest.approx([z[1, 0], z[1, 0], z[1, 6], z[1, 6]], abs=1e-15)
    assert field.normal_at(-9.0, -9.0) == pytest.approx([0.0, 0.0, 1.0])
    edge = [field.normal_at(x, -0.7) for x in (2.9 - 1e-9, 2.9 + 1e-9, 3.0 - 1e-9, 3.0 + 1e-9)]
    assert edge[0] == pytest.approx(edge[1], abs=1e-7)  # no kink where the field begins
    assert edge[2] == pytest.approx(edge[3], abs=1e-7)


def test_field_of_a_plane_is_the_plane() -> None:
    """Away from the border, splines through a plane are that plane; x is the column."""
    slope = hp.Slope(angle=0.2, heading=0.5)
    grid = 0.1 * np.arange(-10, 11)
    field = hp.HeightField.from_array(slope.height_at(grid[None, :], grid[:, None]), 0.1)
    for x, y in places(20, reach=0.85):
        center = (x, y, float(slope.height_at(x, y)) + 0.015)
        gap, normal = nearest(field, center, 0.02)
        flat_gap, flat_normal = nearest(slope, center, 0.02)
        assert gap == pytest.approx(flat_gap, abs=1e-12)
        assert normal == pytest.approx(flat_normal, abs=1e-12)


@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_hills_gap_is_the_distance_to_the_nearest_point(radius: float) -> None:
    """Brute force: the nearest of many surface points, for a penetration and a gap of 1 mm."""
    native, away = HILLS.native(), np.linspace(-0.012, 0.012, 121)
    dx, dy = np.meshgrid(away, away)
    for x, y in places(12, reach=0.9):
        for up in (-1e-3, 1e-3):
            center = np.array([x, y, float(HILLS.height_at(x, y)) + radius + up])
            cloud = HILLS.height_at(x + dx, y + dy) - center[2]
            distance = np.sqrt(dx**2 + dy**2 + cloud**2).min()
            side = 1.0 if radius + up > 0.0 else -1.0
            [(gap, _)] = native.contacts(center, radius)
            # points 0.2 mm apart: 1e-4^2 / 1e-3 for point feet
            assert gap == pytest.approx(side * distance - radius, abs=1.5e-5)


@pytest.mark.parametrize("gap", [-1e-3, 0.0, 1e-3])
@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_hills_push_along_the_gradient_of_the_gap(radius: float, gap: float) -> None:
    """A force along the normal stores energy in the gap: the normal is the gap's gradient."""
    native, step = HILLS.native(), 1e-6
    for x, y in places(20, reach=0.9):
        center = np.array([x, y, float(HILLS.height_at(x, y))])
        center += (radius + gap) * HILLS.normal_at(x, y)
        [(found, normal)] = native.contacts(center, radius)
        gradient = [
            (native.contacts(center + e, radius)[0][0] - native.contacts(center - e, radius)[0][0])
            / (2.0 * step)
            for e in step * np.eye(3)
        ]
        # the search ends at 1e-14 m, seen through a difference of 2e-6 m
        assert gradient == pytest.approx(normal, abs=1e-7)
        assert found == pytest.approx(gap, abs=1e-12)


def test_random_hills() -> None:
    """The same seed gives the same hills, another seed others; the amplitude is reached."""
    again = hp.HeightField.random(3, amplitude=0.02, wavelength=0.3, size=2.0)
    assert again == HILLS
    assert hp.HeightField.random(4, amplitude=0.02, wavelength=0.3, size=2.0) != HILLS
    assert np.abs(HILLS.z).max() == pytest.approx(0.02, rel=1e-12)
    rows, columns = HILLS.shape
    assert HILLS.origin == pytest.approx((-1.02, -1.02), abs=0.03)
    crossings = np.count_nonzero(np.diff(np.sign(HILLS.z), axis=1)) / rows / 2.0
    assert 0.15 < 2.0 / crossings < 0.6  # hills are about a wavelength apart
    assert columns == rows
