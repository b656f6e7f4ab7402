"""The grounds of comparisons: level at the start, of the stated sizes, and walkable."""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import read_terrain

LIFT, LENGTH = 0.03, 3.0
GROUNDS = hp.terrain.study_grounds(LIFT, seed=3, length=LENGTH)
NAMES = ["flat", "slope", "bumps", "step", "slippery", "soft", "soil"]


def test_names() -> None:
    assert list(GROUNDS) == NAMES
    assert [name for name, (_, contact) in GROUNDS.items() if contact is not None] == ["soil"]


@pytest.mark.parametrize("name", NAMES)
def test_level_where_the_robot_starts_and_kept_in_toml(name: str) -> None:
    """Up to 0.5 m all round: height 0, normal up, factors 1; heights of the core, too."""
    ground = GROUNDS[name][0]
    angle, radius = np.meshgrid(np.linspace(0.0, 2 * np.pi, 73), np.linspace(0.0, 0.4999, 40))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    assert np.abs(ground.height_at(x, y)).max() < 1e-15
    assert np.abs(ground.normal_at(x, y) - (0.0, 0.0, 1.0)).max() < 1e-14
    low = np.stack([0.8 * x, 0.8 * y, 0 * x + 0.02], -1).reshape(-1, 3)
    assert ground.clearance(low) == pytest.approx(0.02, rel=1e-12)
    if isinstance(ground, hp.terrain.PatchedGround):
        assert (ground.factors_at(x, y) == 1.0).all()
    assert read_terrain(ground.model_dump(mode="json")) == ground


def test_bumps_reach_half_the_lift_along_the_whole_path() -> None:
    bumps = GROUNDS["bumps"][0]
    x, y = np.meshgrid(np.arange(-1.0, LENGTH + 1.0, 0.01), np.arange(-1.0, 1.0, 0.01))
    z = bumps.height_at(x, y)
    assert np.abs(bumps.z).max() == pytest.approx(0.5 * LIFT, rel=1e-12)
    assert np.abs(z).max() == pytest.approx(0.5 * LIFT, rel=0.05)  # splines between the points
    for begin in np.arange(1.0, LENGTH, 0.5):
        there = z[(x >= begin) & (x < begin + 0.5)]
        assert np.ptp(there) > 0.4 * LIFT
    cut = bumps.height_at(np.arange(1.0, LENGTH, 0.01), 0.3)
    crossings = np.count_nonzero(np.diff(np.sign(cut)))
    assert 1.5 < 2.0 * (LENGTH - 1.0) / crossings / 0.3 * 2.0 < 6.0  # waves of about 0.3 m
    other = hp.terrain.study_grounds(LIFT, seed=4, length=LENGTH)["bumps"][0]
    assert (
        other != bumps
        and hp.terrain.study_grounds(LIFT, seed=3, length=LENGTH)["bumps"][0] == bumps
    )


def test_slope_step_and_patches_have_their_sizes() -> None:
    """Values by hand; to the right is -y."""
    slope, step = GROUNDS["slope"][0], GROUNDS["step"][0]
    assert slope.height_at(1.5, 0.4) == pytest.approx(math.tan(math.radians(15.0)))
    assert slope.normal_at(1.5, 0.0) == pytest.approx(
        [-math.sin(math.pi / 12), 0.0, math.cos(math.pi / 12)]
    )
    assert slope.height_at(9.0, 0.0) == pytest.approx(LENGTH * math.tan(math.pi / 12))
    assert step.height_at(0.499, 0.0) == 0.0 and step.height_at(0.501, 0.0) == LIFT
    slippery, soft = GROUNDS["slippery"][0], GROUNDS["soft"][0]
    assert slippery.factors_at([0.6, 1.4, 1.6], 0.2)[:, 0].tolist() == [0.15, 0.15, 1.0]
    assert (slippery.factors_at([0.6, 1.4], 0.2)[:, 1] == 1.0).all()
    left, right = (soft.factors_at([0.6, 0.9, 1.2], y)[:, 1].tolist() for y in (0.2, -0.2))
    assert left == [0.02, 1.0, 0.02] and right == [1.0, 0.02, 1.0]


def test_ramp_goes_up_and_down() -> None:
    """A sphere on the face touches with its normal; negative angles descend."""
    down = hp.terrain.Ramp(angle=-0.2, run=1.0, start=0.2, heading=math.pi / 2, height=0.5)
    assert down.height_at(7.0, 0.7) == pytest.approx(0.5 - 0.5 * math.tan(0.2))
    assert down.height_at(0.0, 5.0) == pytest.approx(0.5 - math.tan(0.2))
    ((gap, normal),) = down.native().contacts(np.array([0.0, 0.7, 0.5]), 0.02)
    assert normal == pytest.approx([0.0, math.sin(0.2), math.cos(0.2)])
    assert gap == pytest.approx(0.5 * math.tan(0.2) * math.cos(0.2) - 0.02)
    with refused(ParameterError, "Ramp.angle", 1.2):
        hp.terrain.Ramp(angle=1.2, run=1.0)


def test_random_hills_keep_their_bits_and_their_place() -> None:
    """The old arguments give the old field; a centre moves it; a level place takes nothing else."""
    plain = hp.HeightField.random(5, size=2.0)
    moved = hp.HeightField.random(5, size=2.0, centre=(1.5, -0.5))
    assert plain.heights == moved.heights
    assert np.subtract(moved.origin, plain.origin) == pytest.approx([1.5, -0.5])
    level = hp.HeightField.random(5, size=6.0, flat_radius=1.0)
    assert not level.height_at(np.linspace(-0.99, 0.99, 50), 0.0).any()
    far = hp.HeightField.random(5, size=6.0)
    ratio = level.height_at(2.5, [0.1, 0.3, 0.5]) / far.height_at(2.5, [0.1, 0.3, 0.5])
    assert np.ptp(ratio) < 1e-9
    with refused(ParameterError, "flat_radius", 3.0):
        hp.HeightField.random(5, size=1.0, flat_radius=3.0)
    with refused(ParameterError, "flat_radius", -1.0):
        hp.HeightField.random(5, flat_radius=-1.0)
    with refused(ParameterError, "HeightField.random.centre[0]", math.nan):
        hp.HeightField.random(5, centre=(math.nan, 0.0))


@pytest.mark.parametrize("robot", ["kharagpur", "athena"])
def test_robots_start_on_all_of_them(robot: str) -> None:
    """Every foot stands level at the start: the trunk does not move in the first half second."""
    loaded = hp.load_robot(robot)
    for name, (ground, contact) in GROUNDS.items():
        scene = hp.Scene(loaded, terrain=ground, contact=contact or hp.Contact.accurate())
        trace = hp.simulate(scene, hp.HoldPosture(), duration=0.5)
        assert np.abs(trace.q[-1, :2]).max() < 1e-4, name
        assert abs(trace.q[-1, 2] - trace.q[0, 2]) < 5e-3, name


def test_sizes_are_refused() -> None:
    with refused(ParameterError, "lift", 0.0):
        hp.terrain.study_grounds(0.0, length=LENGTH, seed=1)
    with refused(ParameterError, "study_grounds.length", math.inf):
        hp.terrain.study_grounds(LIFT, length=math.inf, seed=1)
