"""The ground in the playback: the surface that was simulated, where the feet stand on it."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from page_data import PageData
from refusals import refused
from synthetic import synthetic_trace, with_run

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.run_record import RunCase
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.html import page_text

HILLS = hp.HeightField.random(7, amplitude=0.03, wavelength=0.5, size=4.0)
STAIRS = hp.Stairs(rise=0.05, run=0.3, count=3, start=0.2, heading=0.4)
GROOVE = hp.terrain.Groove(angle_left=0.5, angle_right=0.9)
PROFILES = (STAIRS, GROOVE)
PATCHES = hp.terrain.PatchedGround(
    ground=HILLS, patches=(hp.terrain.Patch(low=(0.0, 0.0), high=(0.5, 0.3)),)
)


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def standing(robot: hp.Robot, terrain: Any) -> Trace:
    return hp.simulate(hp.Scene(robot, terrain=terrain), hp.HoldPosture(), duration=0.05)


def drawn(trace: Trace) -> PageData:
    return PageData(page_text({"": trace}))


def triangles(trace: Trace) -> np.ndarray:
    corners, index = drawn(trace).ground()
    return corners[index]


def lines(trace: Trace, name: str) -> np.ndarray:
    return np.array(drawn(trace).runs[0]["ground"][name]).reshape(-1, 3)


@pytest.mark.parametrize(
    "terrain", [hp.Slope(angle=0.3, heading=1.0), STAIRS, HILLS, GROOVE], ids=lambda t: t.kind
)
def test_the_surface_is_the_ground_that_was_simulated(robot: hp.Robot, terrain: Any) -> None:
    """Every corner of the mesh lies on the ground, and every face looks up or is a riser."""
    trace = standing(robot, terrain)
    assert ("edges" in drawn(trace).runs[0]["ground"]) == (terrain in PROFILES)
    faces = triangles(trace)
    corners = faces.reshape(-1, 3)
    x, y, z = corners.T
    around = itertools.product((-1e-5, 1e-5), repeat=2)
    heights = [terrain.height_at(x + dx, y + dy) for dx, dy in around]
    # a riser's corners have both heights at one place; heights are rounded to 0.1 mm, places of a
    # profile to 10 um
    assert np.abs(np.array(heights) - z).min(axis=0).max() < 5.5e-5 + 2e-5
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    assert (normal[:, 2] > -1e-9).all() and (normal[:, 2] > 0.0).sum() >= 2


def test_joints_below_the_ground_are_stated(robot: hp.Robot) -> None:
    """Links pass through the ground in a run: the page has the deepest joint, and how deep."""
    trace = standing(robot, hp.Flat())
    assert drawn(trace).runs[0]["below"] == []
    lowered = hp.Trace(**{**vars(trace), "q": trace.q - np.eye(trace.q.shape[1])[2] * 0.3})
    sunk = drawn(lowered).runs[0]
    assert "191 mm below the ground" in sunk["caption"]
    assert sunk["below"] == [[trace.time[0], trace.time[-1]]]


def test_risers_are_drawn_vertical_with_two_lines_each(robot: hp.Robot) -> None:
    """Across the heading, at the foot of the riser and at its edge."""
    trace = standing(robot, STAIRS)
    faces = triangles(trace)
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    risers = normal[np.abs(normal[:, 2]) < 1e-3]
    assert len(risers) == 2 * STAIRS.count
    along = np.array([math.cos(0.4), math.sin(0.4)])
    assert risers[:, :2] @ along == pytest.approx(-1.0, abs=1e-3)
    ends = lines(trace, "edges").reshape(-1, 2, 3)
    expected = np.tile([[0.2], [0.2], [0.5], [0.5], [0.8], [0.8]], 2)
    assert ends[:, :, :2] @ along == pytest.approx(expected, abs=2e-5)
    assert ends[:, 0, 2] == pytest.approx([0.0, 0.05, 0.05, 0.1, 0.1, 0.15], abs=1e-3)


def test_level_ground_is_one_rectangle(robot: hp.Robot) -> None:
    """Flat ground, a slope of no angle, and that of a trace without a scene, at their height."""
    for terrain in (hp.Flat(height=0.2), hp.Slope(angle=0.0, point=(0.0, 0.0, 0.2))):
        found = drawn(standing(robot, terrain))
        assert found.runs[0]["ground"]["level"] and len(found.ground()[1]) == 2
        assert found.ground()[0][:, 2] == pytest.approx(0.2, abs=1e-3)
    trace = synthetic_trace(duration=0.1)
    lifted = replace(trace, foot_position=trace.foot_position + np.array([0, 0, 0.7]))
    assert drawn(lifted).ground()[0][:, 2] == pytest.approx(0.7, abs=1e-4)


def test_an_unknown_ground_is_refused(robot: hp.Robot) -> None:
    trace = standing(robot, hp.Flat())
    text = trace.run.case.to_toml().replace('kind = "flat"', 'kind = "lava"')
    with refused(ParameterError, "terrain.kind", "lava"):
        page_text({"": with_run(trace, case=RunCase(text=text))})


def test_patches_are_outlined_on_the_surface(robot: hp.Robot) -> None:
    x, y, z = lines(standing(robot, PATCHES), "patches").T
    assert (x.min(), x.max(), y.min(), y.max()) == (0.0, 0.5, 0.0, 0.3)
    assert np.abs(z - HILLS.height_at(x, y)).max() < 2e-3


def test_shaken_ground_moves_in_the_picture(robot: hp.Robot) -> None:
    table = hp.terrain.ShakingGround(amplitude=0.01, frequency=5.0)
    found = drawn(standing(robot, table))
    lift = found.arrays[found.runs[0]["ground"]["lift"]][:, 0]
    expected = 0.01 * np.sin(10.0 * np.pi * found.channel("time")[:, 0])
    assert lift == pytest.approx(expected, abs=1e-5)
