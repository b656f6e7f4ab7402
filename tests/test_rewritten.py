"""The same robot in other conventions: what Pinocchio sees, what is found, what the walk costs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from rewriting import ConventionSet, Rewritten, rewrite
from rewriting.comparison import difference, foot_centres, found, reference_walk
from rewriting.rewrite import stripped

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.leg_names import LEG_NAMES
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.recognition.chains import tree_frames
from hexapod_pin.robot.recognition.layout import RobotLayout
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.robot_source import urdf_path

ROBOTS = {"kharagpur": 0.01, "athena": 0.02}  # radius of the feet [m]
TEXTS = {name: urdf_path(name).read_text() for name in ROBOTS}
EVERYTHING = ConventionSet(
    yaw=0.7, y_up=True, names="nonsense", signs=True, zeros=True, frames=True, fixed=True,
    feet="beyond the sphere", shapes="obj in mm", shuffled=True,
)  # fmt: skip


def model_of(text: str) -> pin.Model:
    return pin.buildModelFromXML(text, pin.JointModelFreeFlyer())


@pytest.mark.parametrize(("robot", "seed"), [("kharagpur", 1), ("athena", 0), ("athena", 2)])
def test_pinocchio_sees_the_same_robot(robot: str, seed: int) -> None:
    """Kinetic energy, centre of mass, limits, gravity torques: the original's to 1e-9.

    A joint whose axis is turned round has the opposite torque.
    """
    rng = np.random.default_rng(seed)
    conventions = EVERYTHING if seed == 0 else ConventionSet.draw(rng)
    rewritten = rewrite(TEXTS[robot], conventions, rng)
    old, new = model_of(stripped(TEXTS[robot])), model_of(rewritten.text)
    q, v, p, u = pin.neutral(old), rng.normal(size=old.nv), pin.neutral(new), np.empty(new.nv)
    q[7:] = rng.uniform(old.lowerPositionLimit[7:], old.upperPositionLimit[7:])
    turned = rewritten.base.r  # the old frame in the new one; the old one is the world's
    p[3:7] = pin.Quaternion(turned.T).coeffs()
    u[:3], u[3:6] = turned @ v[:3], turned @ v[3:6]
    pairs = []
    for name, (other, sign, offset) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)], new.joints[new.getJointId(other)]
        p[j.idx_q], u[j.idx_v] = sign * q[i.idx_q] + offset, sign * v[i.idx_v]
        limits = [old.lowerPositionLimit[i.idx_q], old.upperPositionLimit[i.idx_q]]
        mine = [new.lowerPositionLimit[j.idx_q], new.upperPositionLimit[j.idx_q]]
        assert mine == pytest.approx(np.sort(sign * np.array(limits) + offset), abs=1e-12)
        pairs.append((i.idx_v, j.idx_v, sign))
    data, other = old.createData(), new.createData()
    energy = pin.computeKineticEnergy(old, data, q, v)
    assert pin.computeKineticEnergy(new, other, p, u) == pytest.approx(energy, rel=1e-9)
    centre = pin.centerOfMass(old, data, q)
    assert pin.centerOfMass(new, other, p) == pytest.approx(centre, abs=1e-12)
    first, second = pin.rnea(old, data, q, v, 0.0 * v), pin.rnea(new, other, p, u, 0.0 * u)
    for i, j, sign in pairs:
        assert sign * second[j] == pytest.approx(first[i], abs=1e-9)
    assert seed or {sign for *_, sign in pairs} == {-1.0, 1.0}


@pytest.mark.parametrize(("robot", "seed"), [("kharagpur", 3), ("athena", 12)])
def test_the_walk_is_the_same_whatever_the_conventions(robot, seed):
    """Found by its geometry, the robot stands and walks with the original's torques to 1e-6."""
    found = difference(robot, seed, reference_walk(robot))
    assert found.passed, found
    assert found.torque > 0.0  # another file: rounding must show


def feet_at_zero(rewritten: Rewritten, layout: RobotLayout) -> Array:
    """Return the feet in the original root frame where the original joints are at zero [m]."""
    zero = {change.name: change.offset for change in rewritten.joints.values()}
    frames = tree_frames(parse_urdf(rewritten.text.encode(), "rewritten"), zero)
    feet = [frames.links[leg.tip_link].act(leg.centre) for leg in layout.legs]
    return np.array(feet) @ rewritten.base.r


def true_feet(name: str) -> Array:
    robot = load_robot(name)
    return foot_centres(robot, pin.neutral(robot.model))


CHANGES = {
    "names alone tell the front": {"yaw": np.pi},
    "a quarter turn": {"yaw": 0.5 * np.pi, "zeros": True},
    "y up": {"y_up": True, "names": "nonsense"},
    "all but names": {"yaw": -0.65, "signs": True, "zeros": True, "fixed": True, "frames": True},
    "nonsense": {"yaw": -0.65, "names": "nonsense", "signs": True, "zeros": True, "shuffled": True},
    "foot frames at knees": {"feet": "at the knee", "shapes": "stl"},
}


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
def test_directions_legs_tips_and_posture_are_found(name: str, changes: dict, tmp_path: Path):
    rewritten = rewrite(TEXTS[name], ConventionSet(**changes), np.random.default_rng(2))
    for path, content in rewritten.files.items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_bytes(content)
    layout, plain = found(rewritten.text, tmp_path), found(TEXTS[name])
    exact = changes.get("yaw", 0.0) != -0.65  # axes of the root link
    assert layout.turn == pytest.approx(rewritten.base.r, abs=1e-12)
    assert not exact or np.array_equal(layout.turn, np.round(layout.turn))
    single = 1e-7 if rewritten.files else 1e-12  # precision of STL
    assert feet_at_zero(rewritten, layout) == pytest.approx(true_feet(name), abs=single)
    assert [leg.name for leg in layout.legs] == list(LEG_NAMES)
    hips = [rewritten.joints[f"{leg}_coxa_joint"].name for leg in LEG_NAMES]
    assert [leg.joints[0] for leg in layout.legs] == hips
    assert [leg.radius for leg in layout.legs] == pytest.approx([ROBOTS[name]] * 6, abs=single)
    for joint, angle in plain.posture.items():
        new, sign, offset = rewritten.joints[joint]
        assert layout.posture[new] == pytest.approx(sign * angle + offset, abs=1e3 * single)
    assert any("up is +y" in text for text in layout.inferred) == ("y_up" in changes)


def test_a_turn_by_half_a_circle_without_names_is_resolved_by_the_user() -> None:
    conventions = ConventionSet(yaw=np.pi, names="nonsense")
    rewritten = rewrite(TEXTS["athena"], conventions, np.random.default_rng(0))
    layout = found(rewritten.text)
    assert layout.turn[0, 0] == 1.0
    assert any("assumed" in text for text in layout.inferred)
    for forward in ("-x", 180.0, "180"):
        layout = found(rewritten.text, forward=forward)
        assert np.array_equal(layout.turn, np.diag([-1.0, -1.0, 1.0]))
        assert feet_at_zero(rewritten, layout) == pytest.approx(true_feet("athena"), abs=1e-12)


def test_the_tree_is_the_one_that_pinocchio_reads() -> None:
    file = parse_urdf(rewrite(TEXTS["athena"], EVERYTHING, np.random.default_rng(1)).text.encode(),
                      "rewritten")  # fmt: skip
    model = pin.buildModelFromXML(file.text)
    q = np.linspace(-1.0, 1.0, model.nq)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    frames = tree_frames(file, dict(zip(list(model.names)[1:], q.tolist(), strict=True)))
    for link, pose in frames.links.items():
        place = data.oMf[model.getFrameId(link)]
        assert pose.position == pytest.approx(place.translation, abs=1e-12)
        assert pose.rotation == pytest.approx(place.rotation, abs=1e-12)
