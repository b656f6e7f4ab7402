"""Robots of other layouts are found: round ones, 4 to 8 legs, surplus joints, heads."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import Run
from leg_robots import COXA, FEMUR, RADIUS, TIBIA, joint, legged, link
from refusals import refused
from rewriting.comparison import about_z, found
from synthetic import synthetic_trace

from hexapod_pin.commands.terminal import DOES_NOT_WALK
from hexapod_pin.errors import UrdfError
from hexapod_pin.results.walk_answer import walk_answer
from hexapod_pin.robot.description.leg_names import leg_names
from hexapod_pin.robot.recognition.chains import Axis, axis_distance
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.robot_source import urdf_path


def round_robot(count: int, first: float, *, front: bool = False) -> str:
    """Return a robot with hips on a circle, the first one at an angle from x [deg]."""
    text = link("body", 2.0, 0.15)
    for k in range(count):
        yaw = math.radians(first + 360.0 * k / count)
        place = (0.1 * math.cos(yaw), 0.1 * math.sin(yaw), 0.0)
        text += joint(f"a{k}", "body", f"c{k}", place, axis="0 0 1", rpy=f"0 0 {yaw!r}")
        text += link(f"c{k}", 0.05, 0.03)
        text += joint(f"b{k}", f"c{k}", f"f{k}", (COXA, 0.0, 0.0), axis="0 1 0")
        text += link(f"f{k}", 0.05, 0.03)
        text += joint(f"e{k}", f"f{k}", f"t{k}", (FEMUR, 0.0, 0.0), axis="0 1 0")
        ball = f'<origin xyz="{TIBIA} 0 0"/><geometry><sphere radius="{RADIUS}"/></geometry>'
        text += f'<link name="t{k}"><collision>{ball}</collision></link>\n'
    if front:
        text += joint("eyes", "body", "camera_link", (0.0, 0.11, 0.05)) + link("camera_link", 0, 0)
    return f'<robot name="round">{text}</robot>'


@pytest.mark.parametrize(
    ("count", "first", "forward"),
    [
        (6, 30.0, 0.0),  # x is between hips
        (6, 0.0, 90.0),  # hips on x: no direction but y is an axis of the root link
        (6, 2.0, -28.0),  # no axis of the root link: the nearest to x, not 32 deg
        (4, 45.0, 0.0),
        (8, 22.5, 0.0),
        (5, 0.0, 0.0),  # the odd leg in front
    ],
)
def test_round_robots_walk_along_the_nearest_line_between_hips(
    count: int, first: float, forward: float
) -> None:
    layout = found(round_robot(count, first))
    assert layout.turn == pytest.approx(about_z(forward), abs=1e-12)
    left = (count + 1) // 2
    assert [leg.name for leg in layout.legs] == list(leg_names(left, count - left))
    assert [leg.radius for leg in layout.legs] == [RADIUS] * count


@pytest.mark.parametrize(
    ("forward", "said"),
    [
        ("x", ""), (30.0, ""), (-34.0, ""),
        ("y", "forward y is 90 degrees off its body's, +x"),
        (40.0, "forward 40.0 is 40 degrees off its body's, +x"),
        ("-x", "forward -x is to its rear: its front is +x"),
    ],
)  # fmt: skip
def test_a_stated_direction_is_held_against_hips_and_names(forward: str | float, said: str) -> None:
    """Beyond 35 degrees, as for the names of legs; kharagpur's names determine its front."""
    assert load_robot("kharagpur", forward=forward).caution == said
    assert load_robot("kharagpur", forward=forward).notes.count(said) == bool(said)


def test_a_caution_stands_in_the_first_line_with_and_without_doubts() -> None:
    warned = replace(walk_answer(synthetic_trace()), caution="forward y is 90 degrees off")
    assert f", {warned.caution}, " in warned.headline + ", "
    verdict = replace(warned.verdict, doubts=("inertias look like g m^2, not SI units",))
    assert replace(warned, verdict=verdict).headline.endswith(f"not SI units; {warned.caution}")


def test_a_robot_on_its_back_does_not_pass_for_one_that_walks(run: Run, tmp_path: Path) -> None:
    """It walked with status 0, and "(upside down?)" stood among other remarks."""
    text = urdf_path("kharagpur").read_text(encoding="utf-8")
    up = text.replace('angle="1.57', 'angle="-1.57').replace('lower="0"', 'lower="-2.8"')
    (tmp_path / "robot.urdf").write_text(up, encoding="utf-8")
    walk = ("walk", "robot.urdf", "--quick", "--no-html")
    done = run(*walk)
    assert done.status == DOES_NOT_WALK and " ".join(done.out.split()).startswith(
        "kharagpur: torques are NOT to be trusted: left and right legs are exchanged: it lies on "
        "its back (turn its root link over), or the legs' names are wrong (--forward=x takes it as "
        "it is) it walks with these numbers; no motor can be sized by it until that is decided "
    )
    done = run(*walk, "--forward=x")
    assert done.status == 0 and "exchanged" not in done.out


@pytest.mark.parametrize(
    ("shifted", "far"),
    [({"lf", "lm", "lr"}, 100.0), ({"rf", "rr"}, 100.0), ({"lf", "lm", "lr"}, 5.0)],
)
def test_hips_of_one_side_that_are_shifted_alike_are_named(
    shifted: set[str], far: float, tmp_path: Path
) -> None:
    """Each leg was like the others, and no hip was alone; 5 mm are 3 % of the layout."""
    root = ET.fromstring(urdf_path("kharagpur").read_text(encoding="utf-8"))
    for name in shifted:
        [origin] = root.iterfind(f"joint[@name='{name}_coxa_joint']/origin")
        x, y, z = map(float, origin.get("xyz", "").split())
        origin.set("xyz", f"{x + 1e-3 * far!r} {y!r} {z!r}")
    path = tmp_path / "robot.urdf"
    path.write_text(ET.tostring(root, encoding="unicode"), encoding="utf-8")
    said = f"left and right legs differ: hips of the left are up to {far:g} mm from the mirror "
    said += "images of those of the right (--forward=x takes it as it is)"
    robot = load_robot(path)
    assert (said in robot.doubts) == (said in robot.notes) == (far > 10.0)
    assert said not in load_robot(path, forward="x").doubts


def test_a_stated_direction_along_a_line_as_long_is_as_good() -> None:
    """Six hips on a circle: no line is longer; without names either end is the front."""
    for turn in (0.0, 60.0, 180.0):
        assert not found(round_robot(6, 30.0), forward=turn).caution
    layout = found(round_robot(6, 0.0, front=True), forward="-y")
    assert layout.caution == "forward -y is to its rear: its front is +y"


def test_a_camera_marks_the_front_and_names_go_before_it() -> None:
    text = round_robot(6, 0.0, front=True)
    assert found(text).turn == pytest.approx(about_z(90.0), abs=1e-12)
    assert any("camera_link" in line for line in found(text).inferred)
    for k, name in enumerate(("m_r", "fr", "fl", "ml", "bl", "br")):
        text = text.replace(f'"a{k}"', f'"hip_{name.replace("_", "")}"')
    layout = found(text.replace('xyz="0.0 0.11', 'xyz="0.0 -0.11'))
    assert layout.turn == pytest.approx(about_z(90.0), abs=1e-12)
    assert any("names" in text for text in layout.inferred)
    assert layout.legs[0].joints[0] == "hip_fl"


def test_legs_that_start_in_a_row_are_ordered_by_where_they_reach() -> None:
    root = ET.fromstring(legged(6))
    for name in leg_names(3, 3):
        hip = next(x for x in root.findall("joint") if x.get("name") == f"{name}_coxa_joint")
        place = hip.find("origin")
        place.set("xyz", " ".join([place.get("xyz").split()[0], "0", "0"]))
    layout = found(ET.tostring(root, encoding="unicode"))
    assert [leg.foot for leg in layout.legs] == [f"{name}_foot" for name in leg_names(3, 3)]
    assert layout.turn == pytest.approx(np.eye(3), abs=1e-12)


def test_surplus_joints_are_held() -> None:
    layout = found(legged(6, tarsus=0.0, pan=True))
    leg = layout.legs[0]
    assert leg.joints == ("lf_coxa_joint", "lf_femur_joint", "lf_tibia_joint")
    assert leg.held == ("lf_tarsus_joint",)
    assert set(layout.held) == {f"{leg.name}_tarsus_joint" for leg in layout.legs} | {"pan_joint"}
    assert layout.held["pan_joint"] == 0.0
    assert any("pan_joint" in text for text in layout.inferred)
    assert found(legged(4, joints=2)).legs[0].joints == ("lf_coxa_joint", "lf_femur_joint")
    sprung = found(legged(6, spring=True))
    assert sprung.legs[0].held == ("lf_spring_joint",)
    assert sprung.held["lf_spring_joint"] == 0.0
    assert sprung.legs[0].tip_link == "lf_foot"


def test_an_arm_with_as_many_joints_as_a_leg_is_held() -> None:
    text = legged(6)
    arm = joint("arm1", "base_link", "arm1", (0.2, 0.0, 0.1), axis="0 0 1") + link(
        "arm1", 0.1, 0.03
    )
    arm += joint("arm2", "arm1", "arm2", (0.0, 0.0, 0.1), axis="0 1 0") + link("arm2", 0.1, 0.03)
    arm += joint("arm3", "arm2", "arm3", (0.3, 0.0, 0.0), axis="0 1 0")
    arm += link("arm3", 0.1, 0.03, (0.3, 0.0, 0.0))
    layout = found(text.replace("</robot>", f"{arm}</robot>"))
    assert len(layout.legs) == 6
    assert {"arm1", "arm2", "arm3"} <= set(layout.held)


def test_hints_name_legs_direction_and_places() -> None:
    names = ["one", "two", "three", "four", "five", "six"]
    given = {name: [f"{leg}_coxa"] for name, leg in zip(names, leg_names(3, 3), strict=True)}
    layout = found(legged(6, pan=True), legs=given, forward="y", held={"pan_joint": 0.2})
    assert layout.turn == pytest.approx(about_z(90.0), abs=1e-15)
    assert sorted(leg.name for leg in layout.legs) == sorted(names)
    assert layout.held == {"pan_joint": 0.2}
    with refused(UrdfError, source="rewritten.urdf", about=("'z'", "+z", "forward=[...]")):
        found(legged(6), forward="z")
    about = ("legs=[...]", "leg two", "no_such_joint", "'base_link'")
    with refused(UrdfError, source="rewritten.urdf", about=about):
        found(legged(6), legs={**given, "two": ["no_such_joint"]})


def test_axes_parallel_to_the_rounding_of_a_file_are_as_far_apart_as_parallel_ones() -> None:
    """The common normal of skew lines would give 0.04 m, of 0.08 m sideways and 0.04 m down."""
    a = Axis(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    for angle in (0.0, 3.1416 - math.pi):
        b = Axis(np.array([0.08, 0.0, -0.04]), np.array([math.sin(angle), math.cos(angle), 0.0]))
        assert axis_distance(a, b) == pytest.approx(math.hypot(0.08, 0.04), rel=1e-3)


def test_a_leg_whose_last_joint_is_fixed_is_a_leg_and_that_joint_is_held_in_the_others() -> None:
    text = legged(6, tarsus=0.0)
    one = r'(<joint name="rm_tarsus_joint" type=")revolute(".*?)<axis[^>]*/><limit[^>]*/>'
    text = re.sub(one, r"\1fixed\2", text, flags=re.DOTALL)
    text = re.sub(r'<held joint="rm_tarsus_joint"[^>]*/>', "", text)
    layout = found(text)
    assert [leg.name for leg in layout.legs] == ["lf", "lm", "lr", "rf", "rm", "rr"]
    assert {len(leg.joints) for leg in layout.legs} == {3}
    assert layout.legs[0].held == ("lf_tarsus_joint",)
    assert layout.legs[4].held == ()
    assert layout.held == {f"{n}_tarsus_joint": 0.0 for n in ("lf", "lm", "lr", "rf", "rr")}


HIGH_FEMUR, HIGH_TIBIA = 0.05, 0.09  # [m]


def high_kneed(turned: str) -> str:
    text = link("root", 0.0, 0.0) + joint("fixed", "root", "body", (0.0, 0.0, 0.0), rpy=turned)
    text += link("body", 1.0, 0.1)
    for number, (side, x) in enumerate((s, x) for s in (1.0, -1.0) for x in (0.08, 0.0, -0.08)):
        n = "ab"[side < 0.0] + str(number)
        text += joint(f"{n}1", "body", f"{n}c", (x, 0.03 * side, 0.0), axis="0 0 1",
                      rpy=f"0 0 {side * math.pi / 2!r}", limits=(-0.8, 0.8))  # fmt: skip
        text += joint(f"{n}2", f"{n}c", f"{n}f", (0.012, 0.0, 0.0), axis="0 -1 0",
                      limits=(-0.25, 2.5))  # fmt: skip
        text += joint(f"{n}3", f"{n}f", f"{n}t", (HIGH_FEMUR, 0.0, 0.0), axis="0 -1 0",
                      limits=(-2.6, 0.5))  # fmt: skip
        text += link(f"{n}c", 0.03, 0.02) + link(f"{n}f", 0.03, 0.02)
        ball = f'<origin xyz="{HIGH_TIBIA} 0 0"/><geometry><sphere radius="0.005"/></geometry>'
        text += f'<link name="{n}t"><collision>{ball}</collision></link>\n'
    return f'<robot name="high">{text}</robot>'


@pytest.mark.parametrize(
    ("turned", "up"), [("0 0 0", (0, 0, 1)), (f"{-math.pi / 2!r} 0 0", (0, 1, 0))]
)
def test_up_is_where_knees_do_not_fold_to_though_feet_are_above_hips_on_average(
    turned: str, up: tuple[float, ...]
) -> None:
    layout = found(high_kneed(turned))
    assert layout.turn[:, 2] == pytest.approx(up, abs=1e-12)
