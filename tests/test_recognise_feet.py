"""Feet from shapes; a file without a walking robot is refused with part and remedy."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from leg_robots import TIBIA, joint, legged, link
from refusals import refused
from rewriting.comparison import found, stripped_file
from rewriting.shape_files import mesh_of, stl_bytes

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, StateError, UnknownNameError, UrdfError
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.recognition.shape_points import Ball, fitted_ball, mesh_parts

LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")


def with_shape(shape: str, place: str = "0 0 0", rpy: str = "0 0 0", tag: str = "collision") -> str:
    feet = r'<(link|joint) name="\w\w_foot(_joint)?".*?</\1>'
    text = re.sub(feet, "", legged(6), flags=re.DOTALL)
    geometry = f'<origin xyz="{place}" rpy="{rpy}"/><geometry>{shape}</geometry>'
    return re.sub(r'(<link name="\w\w_tibia">)', rf"\1<{tag}>{geometry}</{tag}>", text)


def tips(layout: RobotLayout) -> Array:
    """Return the centres of the feet, which are on the tibiae [m]. Shape (6, 3)."""
    assert all(leg.tip_link == f"{leg.name}_tibia" for leg in layout.legs)
    return np.array([leg.centre for leg in layout.legs])


def test_a_sphere_is_the_foot_and_a_rod_ends_in_one_of_its_own_radius() -> None:
    layout = found(with_shape('<sphere radius="0.012"/>', "0.11 0.001 0.002"))
    assert tips(layout) == pytest.approx(np.tile([0.11, 0.001, 0.002], (6, 1)), abs=1e-15)
    assert [leg.radius for leg in layout.legs] == [0.012] * 6
    assert [leg.foot for leg in layout.legs] == [leg.tip_link for leg in layout.legs]
    rod = '<cylinder radius="0.008" length="0.12"/>'
    layout = found(with_shape(rod, "0.06 0 0", f"0 {math.pi / 2!r} 0"))
    assert tips(layout) == pytest.approx(np.tile([0.112, 0.0, 0.0], (6, 1)), abs=1e-12)
    assert [leg.radius for leg in layout.legs] == [0.008] * 6
    assert [leg.foot for leg in layout.legs] == [f"{leg}_foot" for leg in LEGS]
    assert any("cylinder" in text and "assumed" in text for text in layout.inferred)


def test_a_pad_stands_on_the_centre_of_its_face() -> None:
    pad = '<cylinder radius="0.03" length="0.01"/>'
    layout = found(with_shape(pad, "0.115 0 0", f"0 {math.pi / 2!r} 0", tag="visual"))
    centres = tips(layout)
    assert centres[:, 0] + [leg.radius for leg in layout.legs] == pytest.approx([0.12] * 6)
    assert centres[:, 1:] == pytest.approx(np.zeros((6, 2)), abs=1e-12)


def test_a_box_ends_in_the_middle_of_its_lowest_edge_or_face() -> None:
    layout = found(with_shape(f'<box size="{TIBIA} 0.006 0.006"/>', "0.06 0 0"))
    for leg in layout.legs:
        assert leg.centre[0] + leg.radius == pytest.approx(TIBIA, abs=1e-3)
        assert abs(leg.centre[1]) < 1e-12
        assert abs(leg.centre[2]) <= 0.003
        assert leg.radius <= 0.08 * 0.121
    given = found(with_shape(f'<box size="{TIBIA} 0.006 0.006"/>', "0.06 0 0"), foot_radius=0.0)
    for own, other in zip(layout.legs, given.legs, strict=True):  # it leaves the tip where it is
        assert own.centre[0] + own.radius == pytest.approx(other.centre[0], abs=2e-4)


def test_a_mesh_with_a_round_end_gives_that_sphere(tmp_path: Path) -> None:
    ball, triangles = mesh_of("sphere", {"radius": "0.009"})
    ball[:, 0] = np.where(ball[:, 0] > -1e-12, ball[:, 0] + 0.11, 0.0)  # a rod with half a ball
    (tmp_path / "rod.stl").write_bytes(stl_bytes(ball, triangles))
    layout = found(with_shape('<mesh filename="rod.stl"/>'), tmp_path)
    assert tips(layout) == pytest.approx(np.tile([0.11, 0.0, 0.0], (6, 1)), abs=1e-7)
    assert [leg.radius for leg in layout.legs] == pytest.approx([0.009] * 6, abs=1e-7)


def test_a_lost_mesh_is_reported_and_the_centre_of_mass_serves() -> None:
    layout = found(with_shape('<mesh filename="package://gone/rod.stl"/>'))
    assert tips(layout) == pytest.approx(np.tile([TIBIA, 0.0, 0.0], (6, 1)), abs=1e-12)
    assert any("rod.stl" in text and "assumed" in text for text in layout.inferred)
    misplaced = found(with_shape('<box size="0.1 0.1 0.1"/>', "0 0 x"))
    assert any("the origin of a shape has missing" in text for text in misplaced.inferred)


def test_without_shape_frame_and_mass_the_legs_are_named_with_the_remedies() -> None:
    text = re.sub("<inertial>.*?</inertial>", "", with_shape('<mesh filename="gone.stl"/>'))
    with pytest.raises(UrdfError) as caught:
        recognise(stripped_file(text), ResourceFinder("x.urdf"), RobotHints())
    assert len(caught.value.findings) == 6
    assert all("feet=[...]" in f and "package_path=[...]" in f for f in caught.value.findings)


def test_frames_are_trusted_where_shapes_differ_from_leg_to_leg() -> None:
    text = legged(6)
    for leg, length in zip(LEGS, (0.15, 0.15, 0.15, 0.1, 0.1, 0.1), strict=True):
        ball = '<collision><geometry><sphere radius="0.01"/></geometry></collision>'
        text = text.replace(f'<link name="{leg}_foot">{ball}', f'<link name="{leg}_foot">')
        box = f'<box size="{length} 0.01 0.01"/>'
        shape = f'<visual><origin xyz="{length / 2} 0 0"/><geometry>{box}</geometry></visual>'
        text = text.replace(f'<link name="{leg}_tibia">', f'<link name="{leg}_tibia">{shape}')
    layout = found(text)
    assert [leg.tip_link for leg in layout.legs] == [f"{leg}_foot" for leg in LEGS]
    assert [leg.radius for leg in layout.legs] == [0.0] * 6
    assert any("agree" in text for text in layout.inferred)


def test_given_feet_and_radius_go_before_shapes() -> None:
    text = legged(6)
    layout = found(text, feet=[f"{leg}_foot" for leg in LEGS], foot_radius=0.02)
    assert [leg.foot for leg in layout.legs] == [f"{leg}_foot" for leg in LEGS]
    assert [leg.radius for leg in layout.legs] == [0.02] * 6
    knees = [f"{leg}_tibia" for leg in LEGS]
    assert [leg.foot for leg in found(text, feet=knees).legs] == [f"{leg}_foot" for leg in LEGS]
    about = ("leg lf", "'lf_tibia'", "'lf_tibia_joint'", "feet=[...]")
    with refused(UrdfError, source="rewritten.urdf", about=about):
        found(with_shape(""), feet=knees)
    with refused(ParameterError, "foot_radius", -1.0):
        found(text, foot_radius=-1.0)


def test_spheres_differ_from_boxes_and_cylinders_whose_vertices_lie_on_one() -> None:
    ball, triangles = mesh_of("sphere", {"radius": "0.02"})
    (part,) = mesh_parts(ball + [0.1, 0.2, 0.3], triangles)
    assert isinstance(part, Ball)
    assert part.centre == pytest.approx([0.1, 0.2, 0.3], abs=1e-14)
    assert part.radius == pytest.approx(0.02, abs=1e-15)
    angle = 2 * np.pi * np.arange(16) / 16
    rims = [np.column_stack([np.cos(angle), np.sin(angle), np.full(16, z)]) for z in (-0.7, 0.7)]
    k = np.arange(16)
    sides = np.vstack(
        [np.c_[k, (k + 1) % 16, k + 16], np.c_[(k + 1) % 16, (k + 1) % 16 + 16, k + 16]]
    )
    caps = np.vstack([np.c_[0 * k[2:], k[1:-1], k[2:]], np.c_[0 * k[2:], k[1:-1], k[2:]] + 16])
    (part,) = mesh_parts(np.vstack(rims), np.vstack([sides, caps]))
    assert not isinstance(part, Ball)
    assert fitted_ball(np.vstack(rims)) is not None
    assert fitted_ball(rims[0]) is None


WHEELS = "".join(
    joint(f"w{k}", "body", f"leg{k}", (0.2 - 0.2 * (k % 3), 0.1 - 0.2 * (k // 3), 0), axis="0 1 0")
    + link(f"leg{k}", 0.1, 0.05, (0.0, 0.0, -0.1))
    for k in range(6)
)


def refusal(text: str, **hints: object) -> str:
    with pytest.raises(UrdfError) as caught:
        found(text, **hints)
    return "; ".join(caught.value.findings)


def test_wheel_legs_are_refused_and_stand_on_feet_that_are_given() -> None:
    wheels = f'<robot name="wheels">{link("body", 5.0, 0.3)}{WHEELS}</robot>'
    text = refusal(wheels)
    assert "wheel-legs" in text and "w0" in text and "feet=[...]" in text
    layout = found(wheels, feet=["leg0", "leg1"])
    assert (layout.legs, layout.inferred) == ((), ())
    assert np.array_equal(layout.turn, np.eye(3))


def test_a_trunk_below_a_moved_joint_is_named() -> None:
    text = legged(6).replace("</robot>", link("world", 0, 0) + "</robot>")
    moved = joint("lift", "world", "base_link", (0, 0, 0), axis="0 0 1", kind="prismatic")
    text = refusal(text.replace("</robot>", f"{moved}</robot>"))
    assert "'lift'" in text and "'base_link'" in text and "fixed" in text


def test_three_legs_no_legs_and_hips_without_a_middle_line_are_refused() -> None:
    assert "no moved limbs" in refusal(f'<robot name="stone">{link("stone", 1.0, 0.1)}</robot>')
    root = ET.fromstring(legged(4))
    hips = {x.get("name", "")[:2]: x for x in root.findall("joint") if "coxa" in x.get("name", "")}
    places = {"lf": "0 0 0", "lr": "0.2 0 0", "rf": "0.1 0.1732 0", "rr": "0.1 0.0577333 0"}
    for name, place in places.items():
        hips[name].find("origin").set("xyz", place)
    assert "forward=[...]" in refusal(ET.tostring(root, encoding="unicode"))
    hips["lf"].set("type", "fixed")
    assert "legs=[...]" in refusal(ET.tostring(root, encoding="unicode"))


def test_what_is_no_tree_is_refused() -> None:
    fixed = '<joint name="x" type="fixed"><parent link="lf_coxa"/><child link="lm_coxa"/></joint>'
    for old, new, said in (
        ('<child link="lf_foot"/>', '<child link="nowhere"/>', "'nowhere' does not exist"),
        ("</robot>", '<link name="island"/></robot>', "root links: base_link, island"),
        ("</robot>", f"{fixed}</robot>", "'lm_coxa': child of 2 joints"),
        ('<origin xyz="0.05 0.0 0.0"', '<origin xyz="a b c"', "origin or axis has missing"),
    ):
        assert old in legged(6) and said in refusal(legged(6).replace(old, new))


def test_joints_without_a_range_need_a_posture() -> None:
    text = legged(6).replace('lower="-1.5" upper="2.5"', 'lower="0" upper="0"')
    assert "posture=[...]" in refusal(text)
    stated = {f"{leg}_{part}_joint": 0.0 for leg in ("lf", "lm", "lr", "rf", "rm", "rr")
              for part in ("coxa", "femur", "tibia")}  # fmt: skip
    assert found(text, posture=stated).posture == stated


def test_hints_that_do_not_fit_are_refused() -> None:
    with refused(UnknownNameError, kind="moved joint", name="nobody"):
        found(legged(6), held={"nobody": 0.0})
    with refused(UnknownNameError, kind="joint", name="nobody"):
        found(legged(6), posture={"nobody": 0.0})
    with pytest.raises(StateError):
        found(legged(6), posture=[0.0, 1.0])
