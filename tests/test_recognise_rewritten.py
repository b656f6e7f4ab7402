"""The built-in robots, written otherwise, are found again: directions, legs, tips."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from rewriting.steps import Rewriter, about_z, found

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.leg_names import LEG_NAMES
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.chains import tree_frames
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise

ROBOTS = {"kharagpur": 0.01, "athena": 0.02}  # radius of the feet [m]
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
NO_HINTS = RobotHints()


def foot_points(robot: Rewriter, layout: RobotLayout) -> Array:
    """Return the feet in the original root frame where the original joints are at zero [m]."""
    frames = tree_frames(robot.file(), robot.zero)
    return (
        np.array([frames.links[leg.tip_link].act(leg.centre) for leg in layout.legs]) @ robot.turn
    )


def true_feet(name: str) -> Array:
    """Return the feet of the original at zero angles from Pinocchio, root frame [m]."""
    robot = hp.load_robot(name)
    data = robot.model.createData()
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], np.zeros(18)])
    pin.forwardKinematics(robot.model, data, q)
    joints = [robot.model.getJointId(foot.joint) for foot in robot.feet]
    return np.array(
        [data.oMi[k].act(foot.offset) for k, foot in zip(joints, robot.feet, strict=True)]
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_that_states_all_is_not_inferred(name: str) -> None:
    robot = hp.load_robot(name)
    layout = recognise(
        parse_urdf(robot.urdf.encode(), name), ResourceFinder(robot.source), NO_HINTS
    )
    assert layout.inferred == ()
    assert np.array_equal(layout.turn, np.eye(3))
    assert [leg.name for leg in layout.legs] == list(LEG_NAMES)
    assert [leg.joints for leg in layout.legs] == [leg.joints for leg in robot.legs]
    assert [leg.foot for leg in layout.legs] == [leg.foot for leg in robot.legs]
    assert [leg.tip_link for leg in layout.legs] == [leg.foot for leg in robot.legs]
    assert all(leg.radius == ROBOTS[name] and not leg.centre.any() for leg in layout.legs)
    assert [layout.posture[joint] for joint in robot.joint_names] == robot.posture.tolist()
    assert not layout.held


@pytest.mark.parametrize(
    ("name", "degrees"),
    [*(("kharagpur", x) for x in (0.0, 37.0, 180.0, 359.0)),
     *(("athena", x) for x in (45.0, 90.0, 270.0))],
)  # fmt: skip
def test_forward_is_found_at_any_angle_with_the_front_by_names(name: str, degrees: float) -> None:
    robot = Rewriter.packaged(name).turned(about_z(degrees)).shifted({"tibia": 0.7})
    layout = found(robot)
    if degrees % 90 == 0:
        assert np.array_equal(layout.turn, np.round(about_z(degrees)))
    assert layout.turn == pytest.approx(about_z(degrees), abs=1e-12)
    assert [leg.joints[0] for leg in layout.legs] == [f"{leg}_coxa_joint" for leg in LEG_NAMES]
    assert foot_points(robot, layout) == pytest.approx(true_feet(name), abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_y_up_is_found_from_where_feet_can_be(name: str) -> None:
    robot = Rewriter.packaged(name).turned(Y_UP).renamed()
    layout = found(robot)
    assert np.array_equal(layout.turn, Y_UP)
    assert foot_points(robot, layout) == pytest.approx(true_feet(name), abs=1e-12)
    assert any("up is +y" in text for text in layout.inferred)


@pytest.mark.parametrize("name", ROBOTS)
def test_names_axes_zeros_and_nested_links_do_not_matter(name: str) -> None:
    robot = Rewriter.packaged(name).flipped(every=2)
    robot = robot.shifted({"femur": -0.4, "tibia": 0.9}).nested().turned(about_z(37.0)).renamed()
    layout = found(robot)
    assert layout.turn == pytest.approx(about_z(37.0), abs=1e-12)
    assert foot_points(robot, layout) == pytest.approx(true_feet(name), abs=1e-12)
    assert [leg.name for leg in layout.legs] == list(LEG_NAMES)
    assert [leg.radius for leg in layout.legs] == [ROBOTS[name]] * 6


@pytest.mark.parametrize("name", ROBOTS)
def test_a_turn_by_half_a_circle_without_names_is_resolved_by_the_user(name: str) -> None:
    layout = found(Rewriter.packaged(name).turned(about_z(180.0)).renamed())
    assert layout.turn[0, 0] == 1.0
    assert any("assumed" in text for text in layout.inferred)
    robot = Rewriter.packaged(name).turned(about_z(180.0)).renamed()
    for forward in ("-x", 180.0, "180"):
        layout = found(robot, forward=forward)
        assert np.array_equal(layout.turn, np.diag([-1.0, -1.0, 1.0]))
        assert foot_points(robot, layout) == pytest.approx(true_feet(name), abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_foot_frame_at_the_knee_with_the_sphere_at_the_tip(name: str) -> None:
    robot = Rewriter.packaged(name).feet_at_knees()
    layout = found(robot)
    assert foot_points(robot, layout) == pytest.approx(true_feet(name), abs=1e-12)
    assert [leg.foot for leg in layout.legs] == [f"{leg}_foot" for leg in LEG_NAMES]


@pytest.mark.parametrize("name", ROBOTS)
def test_a_foot_sphere_of_triangles_gives_the_same_centre_and_radius(
    name: str, tmp_path: Path
) -> None:
    robot = Rewriter.packaged(name).feet_as_meshes(tmp_path).feet_at_knees()
    layout = found(robot, tmp_path)
    assert foot_points(robot, layout) == pytest.approx(true_feet(name), abs=1e-7)
    assert [leg.radius for leg in layout.legs] == pytest.approx([ROBOTS[name]] * 6, abs=1e-7)
    assert all(leg.foot != leg.tip_link for leg in layout.legs)


def test_the_search_of_a_posture_is_that_of_the_same_robot_written_otherwise() -> None:
    plain, other = (Rewriter.packaged("athena") for _ in range(2))
    other.flipped().shifted({"tibia": 0.5}).turned(about_z(90.0))
    one, two = found(plain), found(other)
    for name, angle in one.posture.items():
        there = other.zero.get(name, 0.0) - angle if name in other.zero else -angle
        assert two.posture[name] == pytest.approx(there, abs=1e-9)


def test_the_tree_is_the_one_that_pinocchio_reads() -> None:
    robot = Rewriter.packaged("athena").nested().flipped(every=3).turned(about_z(37.0))
    file = robot.file()
    model = pin.buildModelFromXML(file.text)
    q = np.linspace(-1.0, 1.0, model.nq)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    frames = tree_frames(file, dict(zip(list(model.names)[1:], q.tolist(), strict=True)))
    for link, pose in frames.links.items():
        place = data.oMf[model.getFrameId(link)]
        assert pose.position == pytest.approx(place.translation, abs=1e-12)
        assert pose.rotation == pytest.approx(place.rotation, abs=1e-12)
    assert math.isclose(np.linalg.det(frames.links["lf_foot"].rotation), 1.0, abs_tol=1e-12)
