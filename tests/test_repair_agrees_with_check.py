"""`check` recommends `repair` where it repairs the file, and accepts what `repair` writes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from broken_urdfs import SOUND, NoMeshes, add, broken, every, put, remove
from conftest import Run
from test_findings import ALONE, TOGETHER

import hexapod_pin as hp
from hexapod_pin.robot import inspect
from hexapod_pin.robot.description.urdf_file import parse_urdf, read_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.repair import find_all, repair_urdf
from hexapod_pin.robot.repair.finding import finding_lines
from hexapod_pin.robot.repair.rules import DENSITY

RECOMMENDED = "`hexapod-pin repair` repairs it"
SLIDING = '<joint name="top" type="planar"><parent link="odom"/><child link="lr_foot"/></joint>'
OWN = {
    "all slide": lambda root: [x.set("type", "prismatic") for x in root.iter("joint")
                               if x.get("type") == "revolute"],
    "a sliding foot": lambda root: [step(root) for step in (  # a second root, then a lost joint
        remove("link lr_tibia"), add("", '<link name="odom"/>'), add("", SLIDING))],
    "far centre": put("link base_link/inertial/origin", xyz="2 0 0"),
    "no masses": lambda root: [link.clear() for link in root.iter("inertial")],
    "no trunk's parent": add("", '<joint name="top" type="fixed"><parent link="lf_coxa"/>'
                             '<child link="base_link"/></joint>'),
}  # fmt: skip
COMBINED = (
    ("all slide",), ("a sliding foot",),
    ("far centre",), ("no masses", "zero effort"), ("no trunk's parent",),
    ("mass below 0", "zero velocity"), ("loop",), ("13.8 kg on two", "no velocity"), ("long axis",),
    ("planar", "floating", "mimic"), ("no such link", "two roots", "reserved"), ("mesh", "dummies"),
    ("unnamed joint", "a joint twice"), ("millimetres", "grams"), ("origin", "continuous"),
    ("giant", "effort 1000"), ("unknown type", "zero axis", "radius"), ("degrees", "world"),
)  # fmt: skip
"""Faults in one file: with a repair, without, with both, and such that only warn."""


@pytest.mark.parametrize("names", COMBINED, ids=str)
def test_commands_agree(run: Run, tmp_path: Path, names: tuple[str, ...]) -> None:
    """Of files with some faults each the commands disagreed on every second one.

    After a repair no repairable finding is left, and a second repair changes nothing.
    """
    text = broken(*[OWN.get(name) or {**TOGETHER, **ALONE}[name][0] for name in names]).text
    (tmp_path / "in.urdf").write_text(text)
    before, done = run("check", "in.urdf"), run("repair", "in.urdf", "-o", "out.urdf")
    assert {before.status, done.status} <= {0, 2}
    assert (tmp_path / "in.urdf").read_text() == text
    assert (done.status == 0) == ("out.urdf" in done.left)
    assert (before.status, done.status) != (0, 2)
    if before.status == 2:
        assert (RECOMMENDED in before.out + before.err) == (done.status == 0)
        assert "nothing to repair" not in done.out
    if done.status == 0:
        assert run("check", "out.urdf").status == 0
    else:
        assert "REFUSED" in done.err or " = " in done.err  # the rest, or the option that helps
    repaired = repair_urdf(parse_urdf(text.encode(), "x"), NoMeshes())
    assert [str(x) for x in find_all(repaired.file, NoMeshes()) if x.repairable] == []
    assert repair_urdf(repaired.file, NoMeshes()).changes == ()


def test_a_file_that_is_refused_for_one_thing_too_many(run: Run, tmp_path: Path) -> None:
    bad = broken(
        put("joint lf_foot_joint/origin", xyz="1 2 z"), every("joint", "limit", velocity="0")
    )
    (tmp_path / "a.urdf").write_text(bad.text)
    report = inspect(tmp_path / "a.urdf")
    (left,) = {text for text in report.left if "unreadable origin" in text}
    assert "lf_foot_joint" in left and left in report.findings
    assert not any("velocity" in text for text in report.left)
    done = run("repair", "a.urdf", "-o", "b.urdf")
    assert (done.status, done.left) == (2, ["a.urdf"]) and "nothing is written" in done.err
    assert "lf_foot_joint" in done.err and "velocity" not in done.err
    repairs = [line for line in finding_lines(find_all(bad, None)) if line.startswith("  repair ")]
    assert [line.split()[1] == "none:" for line in repairs] == [True, False]
    assert "another file" in run("repair", "a.urdf", "-o", "a.urdf").err
    for option in ("--mass", "--density", "--effort", "--velocity"):
        done = run("repair", "a.urdf", "-o", "b.urdf", option, "-1")
        assert done.status == 2 and option.removeprefix("--") in done.err


def test_hints_are_those_of_check(run: Run, tmp_path: Path) -> None:
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    box = '<visual><geometry><box size="0.2 0.2 0.05"/></geometry></visual>'
    feet = "".join(
        f'<link name="p{k}"/><joint name="j{k}" type="fixed"><parent link="b"/><child link="p{k}"/>'
        f'<origin xyz="{x} {y} -0.1"/></joint>'
        for k, (x, y) in enumerate(((0.1, 0.1), (-0.1, 0.1), (0, -0.1)))
    )
    text = f'<robot name="block"><link name="b"><inertial><mass value="-1"/>{inertia}</inertial>'
    (tmp_path / "a.urdf").write_text(f"{text}{box}</link>{feet}</robot>")
    given = ("--feet", "p0,p1,p2")
    plain = run("repair", "a.urdf", "-o", "b.urdf")
    assert (plain.status, plain.left) == (2, ["a.urdf"]) and "--feet" in plain.err
    before = run("check", "a.urdf", *given)
    assert before.status == 2 and RECOMMENDED in before.out + before.err
    assert run("repair", "a.urdf", "-o", "b.urdf", *given).status == 0
    assert run("check", "b.urdf", *given).status == 0
    (tmp_path / "a.hints.toml").write_text('feet = ["p0", "p1", "p2"]\n')
    assert run("repair", "a.urdf", "-o", "c.urdf").status == 0


def test_statements_that_do_not_fit_the_links(tmp_path: Path) -> None:
    """A file's own legs and places go where they name nothing; the robot is then inferred."""
    path = tmp_path / "a.urdf"
    root = ET.fromstring(hp.urdf_path("athena").read_text())
    own = root.find("hexapod_pin")
    assert own is not None
    for extra in ('<posture joint="tail" angle="1"/>', '<held joint="tail" position="1"/>',
                  '<posture joint="lf_coxa_joint" angle="nan"/>',
                  '<posture joint="lm_coxa_joint" angle="50"/>',
                  '<leg name="lf" joints="lf_coxa_joint tail" foot="lf_foot"/>'):  # fmt: skip
        own.append(ET.fromstring(extra))
    path.write_text(ET.tostring(root, encoding="unicode"))
    report = inspect(path)
    found = [x for x in report.found if x.what == "unusable statement"]
    assert {x.where for x in found} == {
        "joint 'tail'", "joint 'lf_coxa_joint'", "joint 'lm_coxa_joint'", "robot"
    }  # fmt: skip
    assert not report.ok and report.left == ()
    repaired = repair_urdf(parse_urdf(path.read_bytes(), "x"))
    path.write_text(repaired.file.text)
    assert inspect(path).ok and hp.load_robot(path).legs == hp.load_robot("athena").legs


def test_names_with_blanks_are_kept_apart(tmp_path: Path) -> None:
    """CAD programs name joints "Revolute 1"; the stated legs were split at the blank."""
    path = tmp_path / "a.urdf"
    path.write_text(SOUND.replace("_joint", " joint"))
    robot = hp.load_robot(path)
    assert robot.leg("lf").joints == ("lf_coxa joint", "lf_femur joint", "lf_tibia joint")


@pytest.mark.parametrize(
    ("place", "text", "what"),
    [
        ("link lf_foot", '<inertial><mass value="0"/><inertia ixx="x"/></inertial>', "inertial"),
        ("joint lf_foot_joint", "<limit/>", "element"),
        ("joint lf_foot_joint", '<dynamics friction="0 0"/>', "element"),
        ("joint lf_foot_joint", '<mimic multiplier="2"/>', "element"),
        ("joint lf_foot_joint", '<calibration rising="inf"/>', "element"),
        ("joint lf_foot_joint", '<safety_controller k_position="1"/>', "element"),
        ("1_0", "", "velocity"),  # Python reads it
        ("inf", "", "velocity"),
    ],
)
def test_what_only_other_parsers_refuse(place: str, text: str, what: str) -> None:
    """Parts of fixed joints do not count, yet urdfdom refused the whole file for them."""
    change = add(place, text) if text else put("joint lf_tibia_joint/limit", velocity=place)
    file = broken(change)
    (found,) = find_all(file, None)
    assert (found.what, found.severity, found.repairable) == (f"unreadable {what}", "refused", True)
    assert find_all(repair_urdf(file).file, None) == []


def test_a_sound_file_is_copied_to_the_byte(run: Run, tmp_path: Path) -> None:
    data = b"\xef\xbb\xbf" + SOUND.replace("\n", "\r\n").encode()
    (tmp_path / "sound.urdf").write_bytes(data)
    assert "nothing to repair" in run("repair", "sound.urdf", "-o", "copy.urdf").out
    assert (tmp_path / "copy.urdf").read_bytes() == data
    assert "nothing to repair" in run("repair", "athena", "-o", "athena.urdf").out
    assert (tmp_path / "athena.urdf").read_bytes() == hp.urdf_path("athena").read_bytes()
    assert "no robot named 'atena'; known: " in run("repair", "atena", "-o", "b.urdf").err


def test_a_mesh_in_millimetres_is_found_from_another_folder(run: Run, tmp_path: Path) -> None:
    """A trunk drawn 1000 times too large gets scale 0.001, and a reference from its new folder."""
    import trimesh

    (tmp_path / "in" / "meshes").mkdir(parents=True)
    (tmp_path / "out").mkdir()
    trimesh.creation.box((495.0, 205.0, 89.0)).export(tmp_path / "in" / "meshes" / "trunk.stl")
    shape = '<visual><geometry><mesh filename="meshes/trunk.stl"/></geometry></visual>'
    file = broken(remove("link base_link/visual"), remove("link base_link/inertial"),
                  add("link base_link", shape))  # fmt: skip
    (tmp_path / "in" / "a.urdf").write_text(file.text)
    finder = ResourceFinder(tmp_path / "in" / "a.urdf")
    assert "meshes in mm" in {x.what for x in find_all(file, finder)}
    assert run("repair", "in/a.urdf", "-o", "out/a.urdf").status == 0
    written = read_urdf(tmp_path / "out" / "a.urdf")
    assert find_all(written, ResourceFinder(tmp_path / "out" / "a.urdf")) == []
    mesh = next(written.root.iter("mesh"))
    assert mesh.get("filename") == "../in/meshes/trunk.stl"
    np.testing.assert_array_equal([float(x) for x in mesh.get("scale", "").split()], [0.001] * 3)
    mass = written.link_by_name["base_link"].mass
    assert mass == pytest.approx(DENSITY * 0.495 * 0.205 * 0.089, rel=1e-6)
