"""The same robot in other conventions: what Pinocchio sees, and what the walk then costs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from rewriting import ConventionSet, rewrite
from rewriting.comparison import difference, reference_walk
from rewriting.rewrite import stripped
from rewriting.shape_files import mesh_of
from rewriting.steps import Rewriter, about_z, found

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.leg_names import LEG_NAMES
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.chains import tree_frames
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.robot_source import urdf_path

EVERYTHING = ConventionSet(
    yaw=0.7, y_up=True, names="nonsense", signs=True, zeros=True, frames=True, fixed=True,
    feet="beyond the sphere", shapes="obj in mm", shuffled=True,
)  # fmt: skip


def model_of(text: str) -> pin.Model:
    """Return Pinocchio's model of a URDF with a free base."""
    return pin.buildModelFromXML(text, pin.JointModelFreeFlyer())


def configurations(old, new, rewritten, rng):
    """Return a random configuration and velocity of the original, and the same of the other."""
    q, v = pin.neutral(old), rng.normal(size=old.nv)
    q[7:] = rng.uniform(old.lowerPositionLimit[7:], old.upperPositionLimit[7:])
    p, u = pin.neutral(new), np.empty(new.nv)
    base = rewritten.base  # the old frame in the new one
    turned = base.r.T  # the new frame in the old one, which lies at the world's origin
    p[3:7] = pin.Quaternion(turned).coeffs()
    u[:3], u[3:6] = base.r @ v[:3], base.r @ v[3:6]
    for name, (other, sign, offset) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)], new.joints[new.getJointId(other)]
        p[j.idx_q] = sign * q[i.idx_q] + offset
        u[j.idx_v] = sign * v[i.idx_v]
    return (q, v), (p, u)


@pytest.mark.parametrize("robot", ["kharagpur", "athena"])
@pytest.mark.parametrize("seed", range(4))
def test_pinocchio_sees_the_same_robot(robot, seed):
    """Kinetic energy, centre of mass and limits of a rewritten file are the original's to 1e-9."""
    rng = np.random.default_rng(seed)
    text = urdf_path(robot).read_text()
    conventions = EVERYTHING if seed == 0 else ConventionSet.draw(rng)
    rewritten = rewrite(text, conventions, rng)
    old, new = model_of(stripped(text)), model_of(rewritten.text)
    (q, v), (p, u) = configurations(old, new, rewritten, rng)
    data, other = old.createData(), new.createData()
    energy = pin.computeKineticEnergy(old, data, q, v)
    assert pin.computeKineticEnergy(new, other, p, u) == pytest.approx(energy, rel=1e-9)
    assert pin.centerOfMass(new, other, p) == pytest.approx(
        pin.centerOfMass(old, data, q), abs=1e-12
    )
    for name, (renamed, sign, offset) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)].idx_q, new.joints[new.getJointId(renamed)].idx_q
        limits = sign * np.array([old.lowerPositionLimit[i], old.upperPositionLimit[i]]) + offset
        found = [new.lowerPositionLimit[j], new.upperPositionLimit[j]]
        assert found == pytest.approx(np.sort(limits), abs=1e-12)


def test_torques_of_gravity_map_with_the_signs():
    """A joint whose axis is turned round has the opposite torque."""
    rng = np.random.default_rng(3)
    text = urdf_path("athena").read_text()
    rewritten = rewrite(text, EVERYTHING, rng)
    old, new = model_of(stripped(text)), model_of(rewritten.text)
    (q, v), (p, u) = configurations(old, new, rewritten, rng)
    first = pin.rnea(old, old.createData(), q, v, 0.0 * v)
    second = pin.rnea(new, new.createData(), p, u, 0.0 * u)
    assert {change.sign for change in rewritten.joints.values()} == {-1.0, 1.0}
    for name, (renamed, sign, _) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)].idx_v, new.joints[new.getJointId(renamed)].idx_v
        assert sign * second[j] == pytest.approx(first[i], abs=1e-9)


@pytest.mark.parametrize("units", ["kg mm2", "gram", "millimetre"])
def test_units_scale_their_quantities(units):
    """Inertias in kg mm^2, masses in g, lengths in mm: seen in total mass and a hip's place."""
    text = urdf_path("athena").read_text()
    rewritten = rewrite(text, replace(ConventionSet(), units=units), np.random.default_rng(0))
    old, new = model_of(stripped(text)), model_of(rewritten.text)
    mass, length, inertia = {
        "kg mm2": (1.0, 1.0, 1e6), "gram": (1e3, 1.0, 1e3), "millimetre": (1.0, 1e3, 1e6),
    }[units]  # fmt: skip
    assert new.inertias[1].mass == pytest.approx(mass * old.inertias[1].mass, rel=1e-12)
    assert new.inertias[1].inertia == pytest.approx(inertia * old.inertias[1].inertia, rel=1e-9)
    place = new.jointPlacements[2].translation
    assert place == pytest.approx(length * old.jointPlacements[2].translation, abs=1e-12)


@pytest.mark.parametrize(
    ("kind", "size", "volume"),
    [
        ("box", {"size": "0.2 0.3 0.4"}, 0.024),
        ("cylinder", {"radius": "0.1", "length": "0.5"}, np.pi * 0.1**2 * 0.5),
        ("sphere", {"radius": "0.1"}, 4.0 / 3.0 * np.pi * 0.1**3),
    ],
)
def test_meshes_are_closed_and_face_outwards(kind, size, volume):
    """The volume by the divergence theorem is the primitive's, less what 24 sides leave out."""
    vertices, triangles = mesh_of(kind, size)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    enclosed = float((a * np.cross(b, c)).sum() / 6.0)
    assert 0.95 * volume < enclosed <= volume * (1.0 + 1e-12)
    if kind == "sphere":
        assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.1, rel=1e-12)


def test_clearance_does_not_depend_on_where_frames_lie(tmp_path):
    """Joint frames slid along their axes leave the links' capsules where they are."""
    rng = np.random.default_rng(5)
    text = urdf_path("athena").read_text()
    rewritten = rewrite(text, ConventionSet(frames=True), rng)
    robots = []
    for name, content in (("old", stripped(text)), ("new", rewritten.text)):
        path = tmp_path / f"{name}.urdf"
        path.write_text(content)
        robots.append(load_robot(path))
    q = np.tile(pin.neutral(robots[0].model), (20, 1))
    q[:, 7:] = rng.uniform(robots[0].lower, robots[0].upper, (20, 18))
    first, second = (leg_bodies(robot).distances(q)[0] for robot in robots)
    assert second == pytest.approx(first, abs=1e-9)


@pytest.mark.parametrize(("robot", "seeds"), [("kharagpur", (3,)), ("athena", (12,))])
def test_the_walk_is_the_same_whatever_the_conventions(robot, seeds):
    """Found by its geometry, the robot stands and walks with the original's torques to 1e-6."""
    reference = reference_walk(robot)
    for seed in seeds:
        found = difference(robot, seed, reference)
        assert found.passed, found
    assert found.torque > 0.0  # another file: rounding must show


# The built-in robots, written otherwise, are found again: directions, legs, tips.

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
