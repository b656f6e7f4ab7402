"""Findings: every kind of trouble is found, alone and together."""

from __future__ import annotations

import random
import xml.etree.ElementTree as ET

from broken_urdfs import (
    SOUND,
    Break,
    NoMeshes,
    add,
    all_inertias,
    broken,
    every,
    part,
    put,
    remove,
    scale,
    unset,
)

from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.repair import find_all, folded, repair_urdf
from hexapod_pin.robot.repair.finding import finding_lines

MESH = '<visual><geometry><mesh filename="package://none/a.stl"/></geometry></visual>'


def both(*breaks: Break) -> Break:

    def change(root: ET.Element) -> None:
        for one in breaks:
            one(root)

    return change


TOGETHER: dict[str, tuple[Break, str, str]] = {
    "mass below 0": (put("link lf_coxa/inertial/mass", value="-1"), "unreadable mass", "lf_coxa"),
    "comma": (put("link lr_coxa/inertial/mass", value="0,1"), "unreadable mass", "lr_coxa"),
    "zero mass": (put("link rm_coxa/inertial/mass", value="0"), "zero mass", "rm_coxa"),
    "no inertial": (remove("link rr_coxa/inertial"), "no inertial", "rr_coxa"),
    "izz missing": (unset("link lf_femur/inertial/inertia", "izz"), "unreadable inertial",
                    "lf_femur"),
    "triangle": (put("link rf_femur/inertial/inertia", izz="9e-4"), "impossible inertia",
                    "rf_femur"),
    "zero inertia": (put("link rm_femur/inertial/inertia", ixx="0", iyy="0", izz="0"),
                     "zero inertia", "rm_femur"),
    "kg mm^2 on one": (put("link rr_femur/inertial/inertia", ixx="30", iyy="40", izz="50"),
                       "inertia against size", "rr_femur"),
    "lighter than air": (put("link lf_tibia/inertial/mass", value="1e-8"), "dummy mass",
                    "lf_tibia"),
    "13.8 kg on two": (both(put("link lm_tibia/inertial/mass", value="13.8"),
                              put("link rm_tibia/inertial/mass", value="13.8")), "too dense",
                    "lm_tibia"),
    "centre in mm": (put("link lr_tibia/inertial/origin", xyz="49 0 0"), "centre of mass outside",
                     "lr_tibia"),
    "no limit": (remove("joint lf_coxa_joint/limit"), "no limits", "lf_coxa_joint"),
    "reversed": (put("joint lm_coxa_joint/limit", lower="1", upper="-1"), "reversed limits",
                 "lm_coxa_joint"),
    "limit nan": (put("joint lr_coxa_joint/limit", lower="inf"), "unreadable limits",
                  "lr_coxa_joint"),
    "zero limits": (put("joint rf_coxa_joint/limit", lower="0", upper="0"), "no range",
                    "rf_coxa_joint"),
    "many turns": (put("joint rm_coxa_joint/limit", lower="-100", upper="100"),
                    "range above a turn",
                   "rm_coxa_joint"),
    "effort below 0": (put("joint rr_coxa_joint/limit", effort="-6"), "unreadable effort",
                       "rr_coxa_joint"),
    "zero effort": (put("joint lf_femur_joint/limit", effort="0"), "zero effort", "lf_femur_joint"),
    "no effort": (unset("joint lm_femur_joint/limit", "effort"), "unreadable effort",
                  "lm_femur_joint"),
    "zero velocity": (put("joint rf_femur_joint/limit", velocity="0"), "zero velocity",
                      "rf_femur_joint"),
    "no velocity": (unset("joint rm_femur_joint/limit", "velocity"), "unreadable velocity",
                    "rm_femur_joint"),
    "velocity 1000": (put("joint rr_femur_joint/limit", velocity="1000"), "absurd velocity",
                      "rr_femur_joint"),
    "velocity 0.1": (put("joint lf_tibia_joint/limit", velocity="0.1"), "slow velocity",
                     "lf_tibia_joint"),
    "damping": (put("joint lm_tibia_joint/dynamics", damping="-1"), "bad damping",
                    "lm_tibia_joint"),
    "continuous": (put("joint lr_tibia_joint", type="continuous"), "continuous joint",
                   "lr_tibia_joint"),
    "planar": (put("joint lr_foot_joint", type="planar"), "planar joint", "lr_foot_joint"),
    "floating": (put("joint lf_foot_joint", type="floating"), "floating joint", "lf_foot_joint"),
    "unknown type": (put("joint rm_foot_joint", type="hinge"), "unknown joint type",
                     "rm_foot_joint"),
    "zero axis": (put("joint rf_tibia_joint/axis", xyz="0 0 0"), "zero axis", "rf_tibia_joint"),
    "long axis": (put("joint rr_tibia_joint/axis", xyz="0 10 0"), "axis not of unit length",
                  "rr_tibia_joint"),
    "mimic": (add("joint rr_tibia_joint", '<mimic joint="lf_coxa_joint"/>'), "coupled joint",
              "rr_tibia_joint"),
    "origin": (put("joint rr_foot_joint/origin", xyz="0 0 z"), "unreadable origin",
                    "rr_foot_joint"),
    "no such link": (add("", '<joint name="odd" type="fixed"><parent link="base_link"/>'
                         '<child link="nowhere"/></joint>'), "unknown link", "nowhere"),
    "two parents": (add("", '<joint name="second" type="fixed"><parent link="lf_coxa"/>'
                        '<child link="rf_coxa"/></joint>'), "two parents", "rf_coxa"),
    "two roots": (add("", '<link name="island"/>'), "several roots", "island"),
    "a link twice": (add("", '<link name="lm_foot"/>'), "duplicate name", "lm_foot"),
    "a joint twice": (put("joint lm_foot_joint", name="lm_femur_joint"), "duplicate name",
                      "lm_femur_joint"),
    "unnamed link": (add("", "<link/>"), "link without name", "<link>"),
    "unnamed joint": (add("", '<joint type="fixed"><parent link="base_link"/>'
                          '<child link="rm_foot"/></joint>'), "joint without name", "<joint>"),
    "rgba 255": (add("link lf_foot/visual/material", '<color rgba="255 0 0 1"/>'),
                 "colour out of range", "colour"),
    "material twice": (lambda root: [add("", '<material name="steel"/>')(root) for _ in "ab"] and
                       None, "material defined twice", "steel"),
    "radius": (put("link lf_foot/collision/geometry/sphere", radius="-1"), "unreadable shape",
               "lf_foot"),
    "mesh": (add("link rf_foot", MESH), "mesh not found", "rf_foot"),
    "mesh scale": (add("link rr_foot", MESH.replace("/></g", ' scale="0 1 1"/></g')), "mesh scale",
                   "rr_foot"),
}  # fmt: skip
"""Breaks that can be in one file, with kind and place of the finding."""


def loop(root: ET.Element) -> None:
    part(root, "joint lf_coxa_joint/parent").set("link", "lf_tibia")


def floor(root: ET.Element) -> None:
    add("", '<link name="world"/>')(root)
    add("", '<joint name="bolt" type="fixed"><parent link="world"/><child link="base_link"/>'
        "</joint>")(root)  # fmt: skip


def lengths(factor: float) -> Break:
    return both(
        scale("joint", "origin", "xyz", factor), scale("link", "inertial/origin", "xyz", factor),
        scale("link", "visual/origin", "xyz", factor),
        scale("link", "visual/geometry/box", "size", factor),
    )  # fmt: skip


def degrees(root: ET.Element) -> None:
    for end in ("lower", "upper"):
        scale("joint", "limit", end, 57.29577951)(root)


UNLIKE = "unlike the other legs"
ALONE: dict[str, tuple[Break, str, str]] = {
    "reserved": (put("joint rr_coxa_joint", name="root_joint"), "reserved name", "root_joint"),
    "loop": (loop, "loop", "lf_coxa"),
    "world": (floor, "fixed to the world", "world"),
    "millimetres": (lengths(1e3), "joints in mm", "robot"),
    "inches": (lengths(1.0 / 0.0254), "joints in inches", "robot"),
    "3 kg on a leg": (put("link lf_tibia/inertial/mass", value="3"), UNLIKE, "lf_tibia"),
    "an axis": (put("joint rf_tibia_joint/axis", xyz="0 -1 0"), UNLIKE, "rf_tibia_joint"),
    "a weak joint": (put("joint rm_femur_joint/limit", effort="1.5"), UNLIKE, "rm_femur_joint"),
    "all damping": (every("joint", "dynamics", damping="2"), "absurd resistance", "lf_coxa_joint"),
    "centres in mm": (scale("link", "inertial/origin", "xyz", 1e3), "inertials in mm", "robot"),
    "boxes in mm": (scale("link", "visual/geometry/box", "size", 1e3), "shapes in mm", "robot"),
    "grams": (scale("link", "inertial/mass", "value", 1e3), "masses in g", "robot"),
    "kg mm^2": (all_inertias(1e6), "inertias in kg mm^2", "robot"),
    "g mm^2": (all_inertias(1e9), "inertias in g mm^2", "robot"),
    "g cm^2": (all_inertias(1e7), "inertias in g cm^2", "robot"),
    "dummies": (every("link", "inertial/mass", value="1e-5"), "absurd mass", "robot"),
    "giant": (scale("joint", "origin", "xyz", 1e6), "absurd size", "robot"),
    "degrees": (degrees, "limits in degrees", "lf_coxa_joint"),
    "effort 1000": (every("joint", "limit", effort="1000"), "absurd effort", "lf_coxa_joint"),
    "weak": (every("joint", "limit", effort="0.001"), "weak effort", "lf_coxa_joint"),
}


def test_all_at_once_in_one_pass() -> None:
    kinds = {kind for _, kind, _ in [*TOGETHER.values(), *ALONE.values()]}
    assert len(kinds) >= 41
    assert find_all(parse_urdf(SOUND.encode(), "sound"), NoMeshes()) == []
    findings = find_all(broken(*(change for change, _, _ in TOGETHER.values())), NoMeshes())
    missing = {
        name for name, (_, kind, place) in TOGETHER.items()
        if not any(x.what == kind and place in x.where + x.value for x in findings)
    }  # fmt: skip
    assert missing == set()
    assert len({x.what for x in findings}) >= 38


def test_equal_findings_are_one_block() -> None:
    findings = find_all(broken(every("joint", "limit", velocity="0")), NoMeshes())
    (block,) = folded(findings)
    lines = finding_lines(findings)
    assert (len(block.places), len(lines)) == (18, 5) and "velocity 0 rad/s" in lines[2]
    assert "18 joints: 'lf_coxa_joint', " in lines[1] and "'rr_tibia_joint'" in lines[1]


def test_oddities_of_the_text_are_read_and_reported() -> None:
    file = parse_urdf(("<!-- (c) -->\n" + SOUND).encode(), "x")
    assert [x.what for x in find_all(file, None)] == ["text before XML"] and file.text == SOUND
    text = SOUND.replace("</robot>", "<gazebo:plugin xacro:if='1'/></robot>")
    found = find_all(parse_urdf(text.encode(), "x"), None)
    values = {x.value for x in found if x.what == "unbound prefix"}
    assert values == {"prefix 'gazebo'", "prefix 'xacro'"}


JUNK = ["", "nan", "inf", "-1", "0", "1e308", "-1e308", "1e-320", "x", "0 0", "0 0 0", "1 2 3 4",
        "base_link", "lf_coxa", "revolute", "prismatic", "floating", "{x}", "\u00b5"]  # fmt: skip


def test_odd_attributes_are_no_traceback() -> None:
    """Attributes set to junk, elements dropped and doubled, are found and repaired without one."""
    for seed in range(24):
        rng, root = random.Random(seed), parse_urdf(SOUND.encode(), "x").root
        for _ in range(rng.randint(1, 30)):
            parents = [x for x in root.iter() if len(x)]
            parent = rng.choice(parents)
            child = rng.choice(list(parent))
            action = rng.random()
            if action < 0.1:
                parent.remove(child)
            elif action < 0.2:
                parent.append(child)
            elif child.attrib:
                child.set(rng.choice(list(child.attrib)), rng.choice(JUNK))
        file = parse_urdf(ET.tostring(root), f"seed {seed}")
        find_all(file, NoMeshes())
        if seed % 4 == 0:
            find_all(repair_urdf(file, NoMeshes()).file, NoMeshes())
