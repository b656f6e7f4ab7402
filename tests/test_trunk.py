"""The trunk's outermost points, from collision shapes, drawn shapes, meshes or hips."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from vehicles import block

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description.paper_robots import PAPER_ROBOTS
from hexapod_pin.robot.link_shapes import TrunkPoints, trunk_points

EXACT = 1e-15
"""Rounding of lengths below 1 m."""

BALL = '<sphere radius="0.02"/>'
FACET = "facet normal 0 0 1\nouter loop\n{}\nvertex 2 0 0\nvertex 0 4 0\nendloop\nendfacet\n"
CUBE = f"solid cube\n{FACET.format('vertex 0 0 0')}{FACET.format('vertex 0 0 6')}endsolid cube\n"


def with_trunk(
    tmp_path: Path, shapes: str, more: str = "", folders: Sequence[Path] = ()
) -> hp.Robot:
    text = hp.load_robot("kharagpur").urdf
    start = text.index("    <visual>")
    end = text.index("</visual>", start) + len("</visual>")
    path = tmp_path / "robot.urdf"
    path.write_text(text[:start] + shapes + text[end:].replace("</robot>", more + "</robot>"))
    return hp.load_robot(path, package_path=folders)


def collision(shape: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>'


def same_points(found: TrunkPoints, wanted: np.ndarray, atol: float = EXACT) -> None:
    assert found.points.shape == wanted.shape
    order = [np.lexsort(np.round(p, 9).T) for p in (found.points, wanted)]
    np.testing.assert_allclose(found.points[order[0]], wanted[order[1]], rtol=0, atol=atol)


def box_corners(size: tuple[float, ...]) -> np.ndarray:
    grid = np.meshgrid(*([-0.5 * x, 0.5 * x] for x in size), indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, 3)


def test_a_turned_and_shifted_collision_box(tmp_path: Path) -> None:
    shape = collision('<box size="0.3 0.2 0.1"/>', "0.01 -0.02 0.03", "0.1 0.2 0.3")
    part = (
        f'<link name="mast">{collision(BALL, "0 0 0.1")}'
        '</link><joint name="mast_fix" type="fixed"><parent link="base_link"/>'
        '<child link="mast"/><origin xyz="0.05 0 0.1" rpy="1.5707963267948966 0 0"/></joint>'
    )
    robot = with_trunk(tmp_path, shape, part)
    found = trunk_points(robot)
    geometry = pin.buildGeomFromUrdfString(robot.model, robot.urdf, pin.COLLISION)
    place = next(x.placement for x in geometry.geometryObjects if x.name == "base_link_0")
    corners = np.array([place.act(corner) for corner in box_corners((0.3, 0.2, 0.1))])
    same_points(found, np.vstack([corners, [[0.05, -0.1, 0.1]]]), atol=1e-14)
    assert found.names[-1] == "mast sphere"
    assert found.radius.tolist() == [0.0] * 8 + [0.02]
    assert found.assumed == ""


def test_a_cylinder_has_eight_points_on_each_rim(tmp_path: Path) -> None:
    lying = collision('<cylinder radius="0.1" length="0.4"/>', rpy="0 1.5707963267948966 0")
    found = trunk_points(with_trunk(tmp_path, lying))
    assert len(found) == 16
    np.testing.assert_allclose(np.abs(found.points[:, 0]), 0.2, atol=EXACT)
    np.testing.assert_allclose(np.hypot(*found.points[:, 1:].T), 0.1, atol=EXACT)
    assert found.points[:, 2].min() == pytest.approx(-0.1, abs=EXACT)


def test_of_many_points_the_outermost_are_kept(tmp_path: Path) -> None:
    """A small box inside a large one adds nothing; a drawn one counts where there is no other."""
    drawn = trunk_points(hp.load_robot("kharagpur"))
    same_points(drawn, box_corners(PAPER_ROBOTS["kharagpur"].trunk.size))
    assert drawn.assumed == "the trunk is as large as it is drawn" and not drawn.radius.any()
    assert drawn.names[int(np.argmin(drawn.points.sum(axis=1)))] == "base_link -x-y-z"
    outer, inner = '<box size="0.4 0.2 0.1"/>', '<box size="0.1 0.1 0.05"/>'
    shapes = collision(outer) + collision(inner) + collision(inner, "0.02 0 0")
    shapes += '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    found = trunk_points(with_trunk(tmp_path, shapes))
    same_points(found, box_corners((0.4, 0.2, 0.1)))
    assert found.assumed == "8 of 24 points kept"


def test_a_mesh_is_its_bounding_box(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for place, name in (tmp_path, "cube.stl"), (elsewhere, "far.stl"):
        (place / name).write_text(CUBE)
    for name in ("cube.stl", f"package://{tmp_path.name}/cube.stl", "far.stl"):
        mesh = f'<mesh filename="{name}" scale="0.1 0.05 0.01"/>'
        robot = with_trunk(tmp_path, collision(mesh, "0 0 0.1"), folders=[elsewhere])
        found = trunk_points(robot)
        same_points(found, box_corners((0.2, 0.2, 0.06)) + [0.1, 0.1, 0.13], atol=1e-7)
        assert found.assumed == "a mesh is its bounding box"


def test_without_a_usable_shape_the_trunk_is_a_box_around_the_hips(tmp_path: Path) -> None:
    """Hips at x +-0.2, y +-0.1025: 0.4 times 0.205 m thick; the unusable shape is reported."""
    robot = with_trunk(tmp_path, collision('<mesh filename="package://none/cube.stl"/>'))
    found = trunk_points(robot)
    same_points(found, box_corners((0.4, 0.205, 0.082)))
    assert "the trunk is a box around the hips, 0.082 m thick" in found.assumed
    assert "not found" in found.assumed


def test_a_trunk_without_shape_and_hips_has_no_points(tmp_path: Path) -> None:
    robot = block(tmp_path, {"foot": (0.0, 0.0, 0.0)})
    assert trunk_points(robot).points.shape == (0, 3)
    with refused(ParameterError, "Scene.body_contact", True, about=("block",)):
        hp.Scene(robot, body_contact=True)
