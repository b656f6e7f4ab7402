"""A file without a walking robot is refused with part and remedy, never with a traceback."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from leg_robots import joint, legged, link
from refusals import refused
from rewriting.steps import found

from hexapod_pin.errors import StateError, UnknownNameError, UrdfError
from hexapod_pin.robot.reading.resources import ResourceFinder

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
