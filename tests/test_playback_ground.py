"""The ground in the playback: the surface that was simulated, where the feet stand on it."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from refusals import refused
from synthetic import synthetic_trace, with_run

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.run_record import RunCase
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.scene_graph import animation_command, scene_commands

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


def objects(trace: Trace) -> dict[str, Any]:
    commands = scene_commands(trace)
    return {
        c["path"].removeprefix("/meshcat/ground/"): c["object"]
        for c in commands
        if c["type"] == "set_object" and "/ground/" in c["path"]
    }


def points(drawn: Any) -> np.ndarray:
    [geometry] = drawn["geometries"]
    return np.array(geometry["data"]["attributes"]["position"]["array"]).reshape(-1, 3)


def triangles(drawn: Any) -> np.ndarray:
    [geometry] = drawn["geometries"]
    index = np.array(geometry["data"]["index"]["array"]).reshape(-1, 3)
    return points(drawn)[index]


@pytest.mark.parametrize(
    "terrain", [hp.Slope(angle=0.3, heading=1.0), STAIRS, HILLS, GROOVE], ids=lambda t: t.kind
)
def test_the_surface_is_the_ground_that_was_simulated(robot: hp.Robot, terrain: Any) -> None:
    """Every corner of the mesh lies on the ground, and every face looks up or is a riser."""
    drawn = objects(standing(robot, terrain))
    assert set(drawn) == ({"surface", "edges"} if terrain in PROFILES else {"surface"})
    faces = triangles(drawn["surface"])
    corners = faces.reshape(-1, 3)
    x, y, z = corners.T
    heights = [
        terrain.height_at(x + dx, y + dy) for dx, dy in itertools.product((-1e-5, 1e-5), repeat=2)
    ]
    # a riser's corners have both heights at one place; file numbers are rounded to 1e-6
    assert np.abs(np.array(heights) - z).min(axis=0).max() < 2e-5
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    assert (normal[:, 2] > -1e-9).all()
    assert (normal[:, 2] > 0.0).sum() >= 2


def test_feet_stand_on_the_drawn_surface(robot: hp.Robot) -> None:
    """The mesh covers all feet; its height under them is the simulator's, within its facets."""
    trace = standing(robot, HILLS)
    corners = points(objects(trace)["surface"])
    for foot in trace.foot_position[-1]:
        near = corners[np.argsort(np.hypot(*(corners[:, :2] - foot[:2]).T))[:4]]
        assert np.hypot(*(near[:, :2] - foot[:2]).T).max() < 0.05
        assert near[:, 2].mean() == pytest.approx(float(HILLS.height_at(*foot[:2])), abs=5e-3)


def test_risers_are_drawn_vertical(robot: hp.Robot) -> None:
    faces = triangles(objects(standing(robot, STAIRS))["surface"])
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    risers = normal[np.abs(normal[:, 2]) < 1e-3]
    assert len(risers) == 2 * STAIRS.count
    assert risers[:, :2] @ (math.cos(0.4), math.sin(0.4)) == pytest.approx(-1.0, abs=1e-3)


def test_edges_are_drawn_along_every_corner(robot: hp.Robot) -> None:
    """Two lines a riser, across the heading, at its foot and at its edge."""
    ends = points(objects(standing(robot, STAIRS))["edges"]).reshape(-1, 2, 3)
    assert len(ends) == 2 * STAIRS.count
    along = np.array([math.cos(0.4), math.sin(0.4)])
    expected = [0.2, 0.2, 0.5, 0.5, 0.8, 0.8]
    assert ends[:, 0, :2] @ along == pytest.approx(expected, abs=1e-5)
    assert ends[:, 1, :2] @ along == pytest.approx(expected, abs=1e-5)
    assert ends[:, 0, 2] == pytest.approx([0.0, 0.05, 0.05, 0.1, 0.1, 0.15], abs=1e-3)


def test_level_ground_is_a_slab(robot: hp.Robot) -> None:
    """Flat ground, and a slope of no angle, keep the slab and the grid, at their height."""
    for terrain in (hp.Flat(height=0.2), hp.Slope(angle=0.0, point=(0.0, 0.0, 0.2))):
        drawn = objects(standing(robot, terrain))
        assert sorted(drawn) == ["grid", "slab"]
        assert points(drawn["grid"])[:, 2] == pytest.approx(0.2, abs=1e-3)


def test_a_trace_without_scene_still_gets_a_slab() -> None:
    trace = synthetic_trace(duration=0.1)
    assert trace.run.scene is None
    assert sorted(objects(trace)) == ["grid", "slab"]


def test_an_unknown_ground_is_refused(robot: hp.Robot) -> None:
    trace = standing(robot, hp.Flat())
    text = trace.run.case.to_toml().replace('kind = "flat"', 'kind = "lava"')
    with refused(ParameterError, "terrain.kind", "lava"):
        scene_commands(with_run(trace, case=RunCase(text=text)))


def test_patches_are_outlined_on_the_surface(robot: hp.Robot) -> None:
    drawn = objects(standing(robot, PATCHES))
    assert sorted(drawn) == ["patches", "surface"]
    x, y, z = points(drawn["patches"]).T
    assert (x.min(), x.max(), y.min(), y.max()) == (0.0, 0.5, 0.0, 0.3)
    assert np.abs(z - HILLS.height_at(x, y)).max() < 2e-3


def test_shaken_ground_moves_in_the_picture(robot: hp.Robot) -> None:
    table = hp.terrain.ShakingGround(amplitude=0.01, frequency=5.0)
    command = animation_command(standing(robot, table), fps=100.0)
    [clip] = [c["clip"] for c in command["animations"] if c["path"] == "/meshcat/ground"]
    [track] = clip["tracks"]
    shown = np.array(track["values"]).reshape(-1, 3)
    assert np.abs(shown[:, :2]).max() == 0.0
    assert shown[:, 2] == pytest.approx(
        0.01 * np.sin(10.0 * np.pi * np.array(track["times"])), abs=1e-6
    )
    still = animation_command(standing(robot, hp.Flat()))
    assert not [c for c in still["animations"] if c["path"] == "/meshcat/ground"]
