"""A URDF that states its layout: turned trunk, added feet, legs, posture; read back as written."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from hexapod_pin.robot.description.urdf_annotation import read_provenance, stated_places
from hexapod_pin.robot.description.urdf_file import UrdfFile, read_urdf
from hexapod_pin.robot.recognition.layout import LegLayout, RobotLayout, annotate_urdf
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.robot.rotations import roll_pitch_yaw

TURN = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()


@pytest.fixture(scope="module")
def file() -> UrdfFile:
    return read_urdf(urdf_path("athena"))


def model_of(file: UrdfFile) -> pin.Model:
    return pin.buildModelFromXML(file.text, pin.JointModelFreeFlyer())


def layout() -> RobotLayout:
    leg = LegLayout(
        name="lf", joints=("lf_coxa_joint", "lf_femur_joint", "lf_tibia_joint"), held=(),
        tip_link="lf_tibia", foot="lf_new_foot", centre=np.array([0.1, 0.02, -0.03]), radius=0.004,
    )  # fmt: skip
    return RobotLayout(
        turn=TURN, legs=(leg,), held={"rr_coxa_joint": 0.25}, posture={"lf_femur_joint": -0.5},
        inferred=("forward is 37 deg from x",),
    )  # fmt: skip


def test_the_trunk_is_turned_by_a_new_root(file: UrdfFile) -> None:
    """Mass matrix of the joints as before; the trunk's own inertia turned with its axes."""
    model = model_of(annotate_urdf(file, layout()))
    old = model.frames[model.getFrameId("base_link")]
    assert annotate_urdf(file, layout()).base == "trunk_axes"
    q, before = np.concatenate([pin.neutral(model)[:7], np.linspace(-0.5, 0.5, 18)]), model_of(file)
    first, second = (pin.crba(m, m.createData(), q) for m in (before, model))
    np.testing.assert_allclose(first[6:, 6:], second[6:, 6:], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(first[3:6, 6:], TURN @ second[3:6, 6:], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(old.placement.rotation @ TURN[:, 0], [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(old.placement.translation, 0.0, atol=0)
    assert annotate_urdf(file, RobotLayout(turn=np.eye(3), legs=())) is file


def test_a_foot_becomes_a_link_with_its_sphere(file: UrdfFile) -> None:
    made = annotate_urdf(file, layout())
    model = model_of(made)
    frame = model.frames[model.getFrameId("lf_new_foot")]
    tibia = model.frames[model.getFrameId("lf_tibia")]
    place = tibia.placement.actInv(frame.placement).translation
    np.testing.assert_allclose(place, [0.1, 0.02, -0.03], atol=1e-15)
    sphere = made.link_by_name["lf_new_foot"].collision_sphere
    assert sphere is not None and sphere.radius == 0.004 and sphere.centre == (0, 0, 0)


def test_the_statement_replaces_that_of_the_file(file: UrdfFile) -> None:
    made = annotate_urdf(file, layout())
    written = read_provenance(made)
    assert stated_places(made, "posture") == {"lf_femur_joint": -0.5}
    assert written.inferred == ("forward is 37 deg from x",)
    assert written.assumed == read_provenance(file).assumed
    assert written.line == read_provenance(file).line
    element = made.root.find("hexapod_pin")
    assert element is not None
    (leg,) = element.findall("leg")
    joints = "lf_coxa_joint lf_femur_joint lf_tibia_joint"
    assert dict(leg.attrib) == {"name": "lf", "joints": joints, "foot": "lf_new_foot"}
    (held,) = element.findall("held")
    assert dict(held.attrib) == {"joint": "rr_coxa_joint", "position": "0.25"}


@pytest.mark.parametrize("angles", [(0.3, -1.1, 2.0), (0, np.pi / 2, 0.4), (-1, -np.pi / 2, 3)])
def test_roll_pitch_yaw_is_the_urdf_convention(angles: tuple[float, float, float]) -> None:
    """Against SciPy's fixed axes x, y, z; at a pitch of 90 degrees only the product is defined."""
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    again = Rotation.from_euler("xyz", roll_pitch_yaw(turn)).as_matrix()
    np.testing.assert_allclose(again, turn, atol=1e-15 + 1e-9 * (abs(angles[1]) > 1.5))
