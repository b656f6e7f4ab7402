"""The size of a playback: long walks have fewer pictures per second, with a note."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.results.run_record import RunCase
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.reading import ResourceFinder
from hexapod_pin.view import html as page_budget
from hexapod_pin.view import write_html, write_side_by_side
from hexapod_pin.view.ground_shapes import Sizes, eye_level, ground_rectangle, middle
from hexapod_pin.view.html import still_bytes, write_page
from hexapod_pin.view.mesh_store import MESH_BUDGET, TRIANGLE_BYTES, MeshStore
from hexapod_pin.view.meshcat_commands import triangle_mesh
from hexapod_pin.view.robot_shapes import RobotShapes
from hexapod_pin.view.scene_graph import animation_command, scene_commands


def embedded(path: Path) -> Any:
    """Return the data in a page."""
    found = re.search(r'id="trace" type="application/json">(.*?)</script>', path.read_text(), re.S)
    assert found
    return json.loads(found[1])


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> int:
    """Let files have 1.3 MB, and the motion no more than they leave; return the limit."""
    monkeypatch.setattr(page_budget, "PAGE_BYTES", 1_300_000)
    monkeypatch.setattr(page_budget, "LEAST_MOTION_BYTES", 1000)
    return 1_300_000


def test_the_budget_is_ten_megabytes() -> None:
    assert page_budget.PAGE_BYTES == 10_000_000
    assert MESH_BUDGET * TRIANGLE_BYTES + 3 * page_budget.LEAST_MOTION_BYTES < 9e6  # viewer, ground


def test_a_long_walk_keeps_the_budget_with_a_note(tmp_path: Path, small: int) -> None:
    """As full as it goes: not below 95 % of the limit; the times still span the walk."""
    path = write_html(synthetic_trace(duration=60.0), tmp_path / "a.html")
    assert 0.95 * small < path.stat().st_size <= small
    times = np.array(embedded(path)["times"])
    assert (times[0], times[-1]) == pytest.approx((0.0, 60.0), abs=0.5)
    [note] = re.findall(r"<br>([\d.]+) pictures per second instead of 30", path.read_text())
    assert float(note) == pytest.approx((len(times) - 1) / 60.0, rel=0.1)


def test_runs_side_by_side_keep_the_budget(tmp_path: Path, small: int) -> None:
    traces = {name: synthetic_trace(duration=30.0) for name in ("a", "b")}
    path = write_side_by_side(traces, tmp_path / "a.html")
    assert 0.9 * small < path.stat().st_size <= small
    assert "pictures per second instead of 30" in path.read_text()


def test_a_minute_with_meshes_on_rough_ground_keeps_ten_megabytes(tmp_path: Path) -> None:
    """All the triangles of the budget, each with its own corners, and the finest ground."""
    ground = hp.HeightField.random(7, amplitude=0.03, wavelength=0.5, size=4.0)
    trace = synthetic_trace(duration=60.0, case=_case_on(ground))
    corners = np.random.default_rng(1).normal(size=(3 * MESH_BUDGET, 3))
    loose = triangle_mesh("/m", corners, np.arange(3 * MESH_BUDGET).reshape(-1, 3))
    scene = [*scene_commands(trace), loose]
    motion, note = page_budget.fitted_motion(
        lambda rate: animation_command(trace, fps=rate), 30.0, scene, ""
    )
    path = write_page(tmp_path / "a.html", title="", caption=note, scene=scene, animation=motion)
    assert "pictures per second" in note
    assert 9.5e6 < path.stat().st_size <= 10e6


def test_large_grounds_leave_fewer_triangles_to_meshes() -> None:
    """Half a million loose triangles of ground take 24 bytes each, in base64 4/3 of that."""
    ground = triangle_mesh("/g", np.zeros((60_000, 3)), np.zeros((500_000, 3), dtype=np.intp))
    left = page_budget.PAGE_BYTES - still_bytes([ground], "") - 2e6
    assert page_budget.mesh_budget([]) == MESH_BUDGET
    assert page_budget.mesh_budget([ground]) == pytest.approx(left / TRIANGLE_BYTES, abs=1)


def test_a_store_keeps_a_budget_that_is_set_late(tmp_path: Path) -> None:
    """As the page of runs side by side sets it, once the grounds are known."""
    trimesh.creation.icosphere(subdivisions=4).export(tmp_path / "a.stl")
    text = '<robot name="r"><link name="b"><visual><geometry><mesh filename="a.stl"/></geometry>'
    store = MeshStore()
    finder = ResourceFinder(tmp_path / "r.urdf")
    robot = RobotShapes(f"{text}</visual></link></robot>", {}, finder=finder, store=store)
    store.budget = 500
    [part] = robot.bodies["root_joint"]
    assert len(part.geometry["data"]["index"]["array"]) <= 3 * 500


def _case_on(ground: hp.HeightField) -> RunCase:
    """Return the case of a robot on a ground."""
    trace = hp.simulate(
        hp.Scene(hp.load_robot("kharagpur"), terrain=ground), hp.HoldPosture(), duration=0.01
    )
    return trace.run.case


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
