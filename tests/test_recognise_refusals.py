"""A file without a walking robot is refused with part and remedy, never with a traceback."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from leg_robots import joint, legged, link
from refusals import refused
from rewriting.steps import found

from hexapod_pin.errors import HexapodError, StateError, UnknownNameError, UrdfError
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.layout import RobotHints
from hexapod_pin.robot.recognition.recognise import recognise

FINDER = ResourceFinder("none.urdf")
WHEELS = "".join(
    joint(f"w{k}", "body", f"leg{k}", (0.2 - 0.2 * (k % 3), 0.1 - 0.2 * (k // 3), 0), axis="0 1 0")
    + link(f"leg{k}", 0.1, 0.05, (0.0, 0.0, -0.1))
    for k in range(6)
)


def refusal(text: str, **hints: object) -> str:
    """Return the findings of a robot that is refused."""
    with pytest.raises(UrdfError) as caught:
        found(text, **hints)
    return "; ".join(caught.value.findings)


def test_wheel_legs_are_refused_with_what_works() -> None:
    text = refusal(f'<robot name="wheels">{link("body", 5.0, 0.3)}{WHEELS}</robot>')
    assert "wheel-legs" in text
    assert "w0" in text
    assert "feet=[...]" in text


def test_feet_that_are_given_leave_a_robot_without_legs() -> None:
    text = f'<robot name="wheels">{link("body", 5.0, 0.3)}{WHEELS}</robot>'
    layout = found(text, feet=["leg0", "leg1"])
    assert layout.legs == ()
    assert layout.inferred == ()
    assert np.array_equal(layout.turn, np.eye(3))


def test_a_trunk_below_a_moved_joint_is_named() -> None:
    text = legged(6).replace("</robot>", link("world", 0, 0) + "</robot>")
    moved = joint("lift", "world", "base_link", (0, 0, 0), axis="0 0 1", kind="prismatic")
    text = refusal(text.replace("</robot>", f"{moved}</robot>"))
    assert "'lift'" in text
    assert "'base_link'" in text
    assert "fixed" in text


def test_three_legs_and_no_legs_are_refused() -> None:
    root = ET.fromstring(legged(4))
    hip = next(x for x in root.findall("joint") if x.get("name") == "lf_coxa_joint")
    hip.set("type", "fixed")
    assert "legs=[...]" in refusal(ET.tostring(root, encoding="unicode"))
    assert "no moved limbs" in refusal(f'<robot name="stone">{link("stone", 1.0, 0.1)}</robot>')


def test_hips_without_a_middle_line_need_a_direction() -> None:
    text = legged(4)
    root = ET.fromstring(text)
    for name, place in (
        ("lf", "0 0 0"),
        ("lr", "0.2 0 0"),
        ("rf", "0.1 0.1732 0"),
        ("rr", "0.1 0.0577333 0"),
    ):
        hip = next(x for x in root.findall("joint") if x.get("name") == f"{name}_coxa_joint")
        hip.find("origin").set("xyz", place)
    assert "forward=[...]" in refusal(ET.tostring(root, encoding="unicode"))


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


@pytest.mark.parametrize("seed", range(25))
def test_broken_files_never_end_in_a_traceback(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = ET.fromstring(legged(int(rng.choice([4, 6])), pan=True, spring=bool(seed % 2)))
    root.remove(root.find("hexapod_pin"))
    for _ in range(3):
        _break(root, rng)
    try:
        recognise(parse_urdf(ET.tostring(root), "broken"), FINDER, RobotHints())
    except HexapodError as error:
        assert str(error)


def _break(root: ET.Element, rng: np.random.Generator) -> None:
    """Do one odd thing to a URDF."""
    links, joints = root.findall("link"), root.findall("joint")
    victim = joints[rng.integers(len(joints))]
    match rng.integers(8):
        case 0:
            root.remove(victim)
        case 1:
            root.remove(links[rng.integers(len(links))])
        case 2:
            victim.set(
                "type", str(rng.choice(["fixed", "floating", "planar", "continuous", "odd"]))
            )
        case 3:
            victim.find("child").set("link", str(links[rng.integers(len(links))].get("name")))
        case 4:
            victim.find("parent").set("link", str(links[rng.integers(len(links))].get("name")))
        case 5:
            victim.find("origin").set("xyz", str(rng.choice(["0 0 0", "a b c", "nan 0 0", "1"])))
        case 6:
            for axis in root.iter("axis"):
                axis.set("xyz", str(rng.choice(["0 0 0", "1 0 0", "0 0 1"])))
        case _:
            for element in root.iter("sphere"):
                element.set("radius", str(rng.choice(["-1", "nan", "0", "x"])))
