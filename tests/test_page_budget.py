"""What a page keeps of meshes, and what its picture is centred on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from synthetic import synthetic_trace

from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.reading import ResourceFinder
from hexapod_pin.view.ground_shapes import Sizes, eye_level, ground_rectangle, middle
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.robot_shapes import RobotShapes


def test_a_store_keeps_a_budget_that_is_set_late(tmp_path: Path) -> None:
    """A budget counts when the meshes are drawn."""
    trimesh.creation.icosphere(subdivisions=4).export(tmp_path / "a.stl")
    text = '<robot name="r"><link name="b"><visual><geometry><mesh filename="a.stl"/></geometry>'
    store = MeshStore()
    finder = ResourceFinder(tmp_path / "r.urdf")
    robot = RobotShapes(f"{text}</visual></link></robot>", {}, finder=finder, store=store)
    store.budget = 500
    [part] = robot.bodies["root_joint"]
    assert len(part.geometry["data"]["index"]["array"]) <= 3 * 500


# What a picture is centred on: the trunk, or the middle of the feet where its frame is aside.


def aside(x: float, y: float) -> Trace:
    """A glide along x at 0.1 m/s, feet on a circle of 0.3 m around a point beside the trunk."""
    trace = synthetic_trace(duration=1.0)
    return replace(trace, foot_position=trace.foot_position + np.array([x, y, 0.0]))


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.08, 0.0)])
def test_a_trunk_between_its_feet_is_the_middle(place: tuple[float, float]) -> None:
    """Up to 0.3 of 0.3 m: 0.08 m is within."""
    trace = aside(*place)
    np.testing.assert_array_equal(middle(trace, np.arange(101)), trace.q[:, :2])


def test_a_frame_aside_of_the_feet_moves_the_picture_to_them() -> None:
    """The reach is that of the feet around their mean, 0.3 m, and the ground lies around it."""
    trace = aside(0.5, 0.2)
    sizes = Sizes.of(trace, None)
    assert sizes.reach == pytest.approx(0.3)
    np.testing.assert_allclose(middle(trace, np.array([0, 100])), [(0.5, 0.2), (0.6, 0.2)])
    low, high, spacing = ground_rectangle(trace, sizes)
    np.testing.assert_allclose(0.5 * (low + high), (0.55, 0.2), atol=spacing)


def test_the_middle_turns_with_the_trunk() -> None:
    """A quarter turn to the left takes 0.5 m ahead to 0.5 m to the left."""
    trace = aside(0.5, 0.0)
    q = np.array(trace.q)
    q[50:, 5] = q[50:, 6] = np.sqrt(0.5)
    [turned] = middle(replace(trace, q=q), np.array([100]))
    np.testing.assert_allclose(turned, (0.1, 0.5), atol=1e-12)


@pytest.mark.parametrize(("height", "seen"), [(0.1, 0.1), (-0.05, 0.13), (0.47, 0.13)])
def test_a_frame_below_or_far_above_the_feet_is_not_looked_at(height: float, seen: float) -> None:
    """Feet's centres are 0.01 m up and 0.3 m from the middle: 0.01 + 0.4 * 0.3, up to 0.46 m."""
    trace = synthetic_trace(duration=0.1)
    q = np.array(trace.q)
    q[:, 2] = height
    assert eye_level(replace(trace, q=q)) == pytest.approx(seen)
