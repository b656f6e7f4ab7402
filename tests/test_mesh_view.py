"""Meshes of a robot in the playback, and the ground that was simulated."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from page_data import PageData
from PIL import Image
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.reading import ResourceFinder
from hexapod_pin.view.html import page_text
from hexapod_pin.view.mesh_store import MeshStore, decimated, merged, shared_limit
from hexapod_pin.view.robot_shapes import MESH_COLOR, RobotShapes, mesh_visuals

RADIUS = 0.1  # m


def urdf(visual: str) -> str:
    """Return a robot of one body with a link turned and displaced by a fixed joint."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    return f"""<robot name="r"><material name="blue"><color rgba="0 0 1 1"/></material>
    <link name="trunk"><inertial><mass value="1"/>{inertia}</inertial></link>
    <link name="part">{visual}</link>
    <joint name="fixed" type="fixed"><parent link="trunk"/><child link="part"/>
    <origin xyz="1 2 3" rpy="0 0 {np.pi / 2}"/></joint></robot>"""


def visual(file: str, material: str = "") -> str:
    geometry = f'<geometry><mesh filename="{file}"/></geometry>'
    return f'<visual><origin xyz="0.5 0 0"/>{geometry}{material}</visual>'


def shapes(folder: Path, text: str) -> RobotShapes:
    return RobotShapes(text, {}, finder=ResourceFinder(folder / "r.urdf"), store=MeshStore())


def test_the_budget_is_shared_and_kept() -> None:
    assert shared_limit([10, 20, 1000, 2000], 1030) == 500
    assert (shared_limit([10, 20], 1000), shared_limit([], 5)) == (20, 0)
    vertices = np.random.default_rng(1).random((9000, 3))
    assert len(decimated(vertices, np.arange(9000).reshape(-1, 3), 500)[1]) <= 500


def test_a_decimated_ball_is_on_the_ball() -> None:
    """2000 triangles of side s sag s^2/(8 R), 0.5 % of the radius here; 1 % is allowed."""
    ball = trimesh.creation.icosphere(subdivisions=6, radius=RADIUS)
    vertices, faces = decimated(*merged(np.array(ball.vertices), np.array(ball.faces)), 2000)
    assert len(faces) <= 2000
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), RADIUS, atol=0.01 * RADIUS)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    inside = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0  # negative where it is inside out
    assert inside == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.02)


def test_a_mesh_stands_where_its_link_puts_it(tmp_path: Path) -> None:
    """The fixed joint turns by 90 degrees: 0.5 along the link's x is 0.5 along y."""
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "a.stl")
    [part] = shapes(tmp_path, urdf(visual("a.stl"))).bodies["root_joint"]
    np.testing.assert_allclose(part.position, (1.0, 2.5, 3.0), atol=1e-12)
    place = part.geometry["data"]["attributes"]["position"]["array"].reshape(-1, 3)
    vertices = place.astype(float) @ part.rotation.T
    np.testing.assert_allclose(np.ptp(vertices, axis=0), (2.0, 1.0, 3.0), rtol=1e-6)


def test_colours_of_the_urdf_come_first(tmp_path: Path) -> None:
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "a.stl")
    green = trimesh.visual.material.SimpleMaterial(diffuse=(0, 255, 0, 255))
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), material=green)
    box.export(tmp_path / "b.obj")
    own = '<material name="x"><color rgba="255 0 0 1"/></material>'
    parts = [visual("b.obj", given) for given in (own, '<material name="blue"/>', "")]
    text = urdf("".join([*parts, visual("a.stl")]))
    found, notes = mesh_visuals(text, ResourceFinder(tmp_path / "r.urdf"))
    assert not notes
    assert [v.color for v in found[:2]] == [(1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)]
    np.testing.assert_allclose(found[2].color, (0.0, 1.0, 0.0, 1.0), atol=0.02)
    assert found[3].color == MESH_COLOR


def test_what_is_drawn_of_meshes_that_are_not_there(tmp_path: Path) -> None:
    robot = shapes(tmp_path, urdf(visual("package://lost/a.stl")))
    assert not any("data" in part.geometry for part in robot.bodies["root_joint"])
    assert len(robot.notes) == 1 and "lost/a.stl" in robot.notes[0]
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "a.stl")
    collision = visual("a.stl").replace("visual>", "collision>")
    finder = ResourceFinder(tmp_path / "r.urdf")
    assert len(mesh_visuals(urdf(visual("a.stl") + collision), finder)[0]) == 1
    found, [note] = mesh_visuals(urdf(visual("lost.stl") + collision), finder)
    assert [part.link for part in found] == ["part"] and "lost.stl" in note and "collides" in note
    sphere = '<visual><geometry><sphere radius="1"/></geometry></visual>'
    found, [note] = mesh_visuals(urdf(visual("lost.stl") + sphere + collision), finder)
    assert not found and "collides" not in note


def test_a_texture_colours_with_its_mean(tmp_path: Path) -> None:
    """Three red pixels and a blue one: 0.75 red, 0.25 blue; a lost texture leaves the colour."""
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / "a.stl")
    image = Image.new("RGB", (2, 2), (255, 0, 0))
    image.putpixel((1, 1), (0, 0, 255))
    image.save(tmp_path / "skin.png")
    skins = [
        f'<material name="{name}"><color rgba="0 1 0 1"/><texture filename="{name}"/></material>'
        for name in ("skin.png", "lost.png")
    ]
    text = urdf("".join(visual("a.stl", skin) for skin in skins))
    found, _ = mesh_visuals(text, ResourceFinder(tmp_path / "r.urdf"))
    np.testing.assert_allclose(found[0].color, (0.75, 0.0, 0.25, 1.0), atol=1e-9)
    assert found[1].color == (0.0, 1.0, 0.0, 1.0)


# the ground ---------------------------------------------------------------------------------------

HILLS = hp.HeightField.random(7, amplitude=0.03, wavelength=0.5, size=4.0)
STAIRS = hp.Stairs(rise=0.05, run=0.3, count=3, start=0.2, heading=0.4)
GROOVE = hp.terrain.Groove(angle_left=0.5, angle_right=0.9)


def standing(terrain: Any) -> Trace:
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=terrain)
    return hp.simulate(scene, hp.HoldPosture(), duration=0.05)


def drawn(trace: Trace) -> PageData:
    return PageData(page_text({"": trace}))


@pytest.mark.parametrize(
    "terrain", [hp.Slope(angle=0.3, heading=1.0), STAIRS, HILLS, GROOVE], ids=lambda t: t.kind
)
def test_the_surface_is_the_ground_that_was_simulated(terrain: Any) -> None:
    page = drawn(standing(terrain))
    corners, index = page.ground()
    faces = corners[index]
    x, y, z = faces.reshape(-1, 3).T
    around = itertools.product((-1e-5, 1e-5), repeat=2)
    heights = [terrain.height_at(x + dx, y + dy) for dx, dy in around]
    # a riser's corners have both heights at one place; heights are rounded to 0.1 mm, places of a
    # profile to 10 um
    assert np.abs(np.array(heights) - z).min(axis=0).max() < 5.5e-5 + 2e-5
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    assert (normal[:, 2] > -1e-9).all() and (normal[:, 2] > 0.0).sum() >= 2
    assert ("edges" in page.runs[0]["ground"]) == (terrain in (STAIRS, GROOVE))
    if terrain == STAIRS:  # risers are vertical, with a line at the foot and one at the edge
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        risers, along = normal[np.abs(normal[:, 2]) < 1e-3], np.array([np.cos(0.4), np.sin(0.4)])
        assert len(risers) == 2 * STAIRS.count
        assert risers[:, :2] @ along == pytest.approx(-1.0, abs=1e-3)
        ends = np.array(page.runs[0]["ground"]["edges"]).reshape(-1, 2, 3)
        expected = np.tile([[0.2], [0.2], [0.5], [0.5], [0.8], [0.8]], 2)
        assert ends[:, :, :2] @ along == pytest.approx(expected, abs=2e-5)
        assert ends[:, 0, 2] == pytest.approx([0.0, 0.05, 0.05, 0.1, 0.1, 0.15], abs=1e-3)


def test_level_ground_is_one_rectangle_and_joints_below_it_are_stated() -> None:
    trace = standing(hp.Flat(height=0.2))
    found = drawn(trace)
    assert found.runs[0]["ground"]["level"] and len(found.ground()[1]) == 2
    assert found.ground()[0][:, 2] == pytest.approx(0.2, abs=1e-3)
    assert found.runs[0]["below"] == []
    lowered = hp.Trace(**{**vars(trace), "q": trace.q - np.eye(trace.q.shape[1])[2] * 0.3})
    sunk = drawn(lowered).runs[0]
    assert "191 mm below the ground" in sunk["caption"]
    assert sunk["below"] == [[trace.time[0], trace.time[-1]]]
    bare = synthetic_trace(duration=0.1)  # has no scene
    lifted = replace(bare, foot_position=bare.foot_position + np.array([0, 0, 0.7]))
    assert drawn(lifted).ground()[0][:, 2] == pytest.approx(0.7, abs=1e-4)


def test_patches_are_outlined_and_shaken_ground_moves() -> None:
    patch = hp.terrain.Patch(low=(0.0, 0.0), high=(0.5, 0.3))
    page = drawn(standing(hp.terrain.PatchedGround(ground=HILLS, patches=(patch,))))
    x, y, z = np.array(page.runs[0]["ground"]["patches"]).reshape(-1, 3).T
    assert (x.min(), x.max(), y.min(), y.max()) == (0.0, 0.5, 0.0, 0.3)
    assert np.abs(z - HILLS.height_at(x, y)).max() < 2e-3
    page = drawn(standing(hp.terrain.ShakingGround(amplitude=0.01, frequency=5.0)))
    lift = page.arrays[page.runs[0]["ground"]["lift"]][:, 0]
    expected = 0.01 * np.sin(10.0 * np.pi * page.channel("time")[:, 0])
    assert lift == pytest.approx(expected, abs=1e-5)
