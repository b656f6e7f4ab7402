"""Repairs: each against a file that needs exactly it; values against closed forms; refusals."""

from __future__ import annotations

import copy
import io
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from broken_urdfs import (
    SOUND,
    WHOLE,
    NoMeshes,
    add,
    all_inertias,
    broken,
    every,
    limit,
    masses,
    moments,
    part,
    put,
    remove,
    repaired,
)
from refusals import refused
from test_findings import ALONE, TOGETHER

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UrdfError
from hexapod_pin.robot.description.urdf_file import parse_urdf, read_urdf
from hexapod_pin.robot.repair import RepairOptions, find_all, repair_urdf
from hexapod_pin.robot.repair.find_all import check_urdf
from hexapod_pin.robot.repair.inertias import nearest_possible
from hexapod_pin.robot.repair.rules import DENSITY, JOINT_RANGE, SPEED
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.urdf_report import inspect

NO_REPAIR = {"too dense", "absurd resistance", "mesh not found", "unreadable origin", "loop"}
NO_REPAIR |= {"absurd size"}  # kinds that only the user can repair

CUT_LEG = {"zero axis", "axis of two", "unnamed joint"}
"""Troubles whose repair leaves one leg without a joint or a foot, which is said of it."""


@pytest.mark.parametrize("name", [*TOGETHER, *ALONE])
def test_each_trouble_is_found_and_gone(name: str, tmp_path: Path) -> None:
    """Kind and place; a repair removes it where it can, adds nothing, and has no second effect.

    Where a file is refused for it, the error says so, with place and value.
    """
    change, kind, place = {**TOGETHER, **ALONE}[name]
    file = broken(change)
    findings = find_all(file, NoMeshes())
    found = [x for x in findings if x.what == kind and place in x.where + x.value]
    assert found and all(x.value and x.rule and x.repair for x in findings), findings
    assert {x.repairable for x in found} == {kind not in NO_REPAIR}
    if "refused" in {x.severity for x in found}:
        path = tmp_path / "broken.urdf"
        path.write_text(file.text)
        with pytest.raises(UrdfError) as caught:
            load_robot(path)
        assert any(kind in text and place in text for text in caught.value.findings)
        assert any(x.value in text for x in found for text in caught.value.findings)
    done = repair_urdf(file, NoMeshes())
    after = find_all(done.file, NoMeshes())
    left, places = {x.what for x in after}, {(x.what, x.where) for x in after}
    assert {(x.what, x.where) in places for x in found} == {kind in NO_REPAIR}
    if kind != "absurd size":  # of which nothing else can be judged
        cut = {"unlike the other legs"} if name in CUT_LEG else set()
        assert left - {"mesh not found"} == (({kind} & NO_REPAIR) - {"mesh not found"}) | cut
    assert done.changes or kind in NO_REPAIR
    assert repair_urdf(done.file, NoMeshes()).file is done.file


def test_everything_at_once() -> None:
    done = repaired(*(change for change, _, _ in TOGETHER.values()))
    left = {x.what for x in find_all(done.file, NoMeshes()) if x.severity == "refused"}
    assert left <= NO_REPAIR


def test_a_limit_assumed_for_one_leg_becomes_that_of_the_others() -> None:
    """Two heavy legs let the limit that is assumed for one joint be 45 N m."""
    done = repaired(TOGETHER["13.8 kg on two"][0], TOGETHER["no limit"][0])
    assert any(text.endswith("effort None -> 45 N m") for text in done.changes)
    assert done.changes[-1].endswith("effort 45 -> 6 N m")
    assert repair_urdf(done.file, NoMeshes()).changes == ()


@pytest.mark.parametrize("names", [
    ("no inertial", "triangle", "two roots", "a joint twice", "a link twice", "material twice",
     "planar", "mimic"), ("millimetres",)], ids=str)  # fmt: skip
def test_other_parsers_open_it(names: tuple[str, ...]) -> None:
    """yourdfpy, Pinocchio and MuJoCo read the repaired text with one total mass."""
    import mujoco
    import pinocchio as pin
    import yourdfpy

    file = repaired(*[{**TOGETHER, **ALONE}[name][0] for name in names]).file
    total = masses(file).sum()
    model = pin.buildModelFromXML(file.text, pin.JointModelFreeFlyer())
    assert sum(body.mass for body in model.inertias) == pytest.approx(total, rel=1e-12)
    robot = yourdfpy.URDF.load(io.BytesIO(file.text.encode()), build_scene_graph=False)
    theirs = [x.inertial.mass for x in robot.robot.links if x.inertial is not None]
    assert math.fsum(theirs) == pytest.approx(total, rel=1e-12)
    compiled = mujoco.MjModel.from_xml_string(file.text)
    assert compiled.body_mass.sum() == pytest.approx(total, rel=1e-9)


def test_limits() -> None:
    file = repaired(put("joint lm_coxa_joint/limit", lower="1", upper="-0.5")).file
    assert [limit(file, "lm_coxa_joint", end) for end in ("lower", "upper")] == [-0.5, 1]
    for name in ("no limit", "limit nan", "zero limits", "many turns", "continuous"):
        change, _, joint = TOGETHER[name]
        done = repaired(change)
        assert limit(done.file, joint, "lower") == -JOINT_RANGE
        assert limit(done.file, joint, "upper") == JOINT_RANGE
        assert any("-2.618 to 2.618 rad" in text for text in done.assumed)


def test_effort_and_speed() -> None:
    file = repaired(every("joint", "limit", effort="0", velocity="0")).file
    leg = 0.0835 + 0.11934 + 0.09879
    chain = leg + 0.01  # to the end of the foot sphere, fixed to the tibia
    holding = masses(WHOLE).sum() * 9.81 / 3 * leg / 2
    for joint in WHOLE.joints:
        if joint.moves:
            effort = limit(file, joint.name, "effort")
            assert 3 * holding * 0.95 <= effort <= 3 * holding * chain / leg * 1.05  # two digits
            assert limit(file, joint.name, "velocity") == SPEED
    given = repaired(effort=2.5, velocity=5.0)
    assert {limit(given.file, j.name, "effort") for j in WHOLE.joints if j.moves} == {2.5}
    assert {limit(given.file, j.name, "velocity") for j in WHOLE.joints if j.moves} == {5.0}
    assert given.assumed == ()


def test_a_copied_leg_is_renamed_with_its_joints() -> None:
    """All names of the leg lm are those of lf: two legs again, each a chain of its own."""
    file = parse_urdf(SOUND.replace("lm_", "lf_").encode(), "copied")
    done = repair_urdf(file, NoMeshes())
    assert [x.what for x in find_all(done.file, NoMeshes())] == []
    assert [j.xyz for j in done.file.joints] == [j.xyz for j in WHOLE.joints]
    assert {j.child for j in done.file.joints if j.parent == "lf_coxa_2"} == {"lf_femur_2"}
    np.testing.assert_allclose(masses(done.file), masses(WHOLE))


def test_a_wheel_leg_stays_continuous() -> None:
    text = '<robot name="w"><link name="b"/><link name="l"/><joint name="j" type="continuous">' \
           '<parent link="b"/><child link="l"/><axis xyz="0 1 0"/></joint></robot>'  # fmt: skip
    file = repair_urdf(parse_urdf(text.encode(), "w"), None).file
    assert file.joints[0].kind == "continuous"


def test_colours_and_materials() -> None:
    file = repaired(TOGETHER["rgba 255"][0], TOGETHER["material twice"][0]).file
    colour = part(file.root, "link lf_foot/visual/material/color").get("rgba")
    assert colour == "1 0 0 1"
    assert len(file.root.findall("material[@name='steel']")) == 1


def test_comments_and_foreign_elements_stay() -> None:
    text = SOUND.replace(
        "</robot>", "<!-- kept --><gazebo:plugin/><transmission name='t'/></robot>"
    )
    done = repair_urdf(parse_urdf(text.encode(), "x"), NoMeshes())
    assert "<!-- kept -->" in done.file.text
    assert ET.fromstring(done.file.text).find("transmission") is not None


def test_units_come_back_exactly() -> None:
    slips = ("grams", "kg mm^2", "g mm^2", "g cm^2", "centres in mm", "boxes in mm", "millimetres")
    together = [ALONE["millimetres"][0], ALONE["grams"][0], all_inertias(1e9)]
    for changes in (*([ALONE[slip][0]] for slip in slips), together):
        file = repaired(*changes).file
        np.testing.assert_allclose(masses(file), masses(WHOLE), rtol=1e-11)
        for old, new in zip(WHOLE.links, file.links, strict=True):
            np.testing.assert_allclose(new.com, old.com, rtol=1e-11)
            if old.mass:
                np.testing.assert_allclose(new.moments, old.moments, rtol=1e-11)
        for a, b in zip(WHOLE.joints, file.joints, strict=True):
            np.testing.assert_allclose(b.xyz, a.xyz, rtol=1e-11)


def test_a_missing_inertial_is_that_of_the_box() -> None:
    """coxa: 0.0835 x 0.045 x 0.045 m at x = 0.04175 m, density as assumed: closed form."""
    legs = ("lf", "lm", "lr", "rf", "rm", "rr")  # none is left with a mass
    done = repaired(*[remove(f"link {leg}_coxa/inertial") for leg in legs])
    link = done.file.link_by_name["rr_coxa"]
    mass = DENSITY * 0.0835 * 0.045**2
    assert link.mass == pytest.approx(mass, rel=1e-8)
    assert link.com == pytest.approx((0.04175, 0, 0), abs=1e-12)
    along, across = mass / 12 * 2 * 0.045**2, mass / 12 * (0.045**2 + 0.0835**2)
    assert link.moments == pytest.approx((along, across, across, 0, 0, 0), rel=1e-8, abs=1e-15)
    assert any("rr_coxa" in text and "430 kg/m^3" in text for text in done.assumed)
    own = done.file.root.find("hexapod_pin")
    assert own is not None
    assert set(done.assumed) <= {x.text for x in own.findall("assumed")}


def test_one_part_of_six_weighs_what_the_others_do() -> None:
    """A single coxa without a mass gets that of the other five; its inertia is that of its box."""
    for change in (put("link rr_coxa/inertial/mass", value="0"), remove("link rr_coxa/inertial")):
        done = repaired(change)
        link = done.file.link_by_name["rr_coxa"]
        assert link.mass == 0.15
        along, across = 0.15 / 12 * 2 * 0.045**2, 0.15 / 12 * (0.045**2 + 0.0835**2)
        assert link.moments[:3] == pytest.approx((along, across, across), rel=1e-8)
        assert any("rr_coxa" in text and "other legs" in text for text in done.assumed)
        np.testing.assert_allclose(masses(done.file), masses(WHOLE), rtol=1e-12)


def test_a_ball_and_a_turned_cylinder() -> None:
    """2/5 m r^2; m r^2/2 along the cylinder's axis, which rpy = (pi/2, 0, 0) turns to y."""
    ball = '<visual><geometry><sphere radius="0.03"/></geometry></visual>'
    rod = ('<visual><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.01" '
           'length="0.1"/></geometry></visual>')  # fmt: skip
    across = 1e-4 / 4 + 1e-2 / 12
    for shape, wanted in ((ball, (0.4 * 9e-4,) * 3), (rod, (across, 1e-4 / 2, across))):
        gone = [remove("link lf_coxa/inertial"), remove("link lf_coxa/visual")]
        link = repaired(*gone, add("link lf_coxa", shape)).file.link_by_name["lf_coxa"]
        assert np.array(link.moments[:3]) / link.mass == pytest.approx(np.array(wanted), rel=1e-7)


def test_mass_and_density_as_given() -> None:
    """--mass fills what is missing, else scales masses and inertias alike; --density is used."""
    gone = remove("link rr_coxa/inertial")
    rest = masses(WHOLE).sum() - 0.15
    filled = repaired(gone, mass=rest + 0.2).file
    assert filled.link_by_name["rr_coxa"].mass == pytest.approx(0.2, rel=1e-8)
    assert filled.link_by_name["lf_coxa"].mass == 0.15
    scaled = repaired(mass=2 * masses(WHOLE).sum()).file
    np.testing.assert_allclose(masses(scaled), 2 * masses(WHOLE), rtol=1e-11)
    np.testing.assert_allclose(
        moments(scaled, "lf_coxa"), 2 * moments(WHOLE, "lf_coxa"), rtol=1e-11
    )
    dense = repaired(gone, density=1000.0).file
    assert dense.link_by_name["rr_coxa"].mass == pytest.approx(1e3 * 0.0835 * 0.045**2, rel=1e-8)
    assert "--density is not used" in repaired(density=1000.0).notes[0]
    (_,) = repaired(TOGETHER["no limit"][0], density=1000.0).notes  # once, in two rounds of repair
    with refused(ParameterError, "RepairOptions.mass", -1.0):
        RepairOptions(mass=-1.0)


def test_nearest_possible_inertia() -> None:
    """One moment too large by d: a third of d off it, and on each other (orthogonal projection)."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    low, high = np.array([1.0, 2.0, 6.0]), np.array([2.0, 3.0, 5.0])
    nearest = nearest_possible(turn @ np.diag(low) @ turn.T)
    np.testing.assert_allclose(nearest, turn @ np.diag(high) @ turn.T, atol=3e-5)  # FLATNESS
    possible = turn @ np.diag([3.0, 4.0, 5.0]) @ turn.T
    np.testing.assert_allclose(nearest_possible(possible), possible, rtol=1e-12, atol=1e-12)
    small, middle, large = np.linalg.eigvalsh(nearest_possible(np.diag([-1.0, 2.0, 2.0])))
    assert small > 0.0
    assert small + middle > large


def test_what_is_not_drawn_is_a_ball_and_a_sliding_joint_lifts_twice_the_weight() -> None:
    slide = '<joint name="slide" type="prismatic"><parent link="base_link"/><child link="head"/>' \
            '<limit lower="-1" upper="1" effort="0" velocity="1"/></joint>'  # fmt: skip
    done = repaired(add("", '<link name="head"/>'), add("", slide))
    head = done.file.link_by_name["head"]
    assert head.mass > 0.0 and head.moments[0] == head.moments[2] < 1e-3 * head.mass
    force = 2.0 * 9.81 * masses(done.file).sum()
    assert limit(done.file, "slide", "effort") == pytest.approx(force, rel=0.05)  # two digits
    assert any("ball of radius" in text for text in done.assumed)


def test_an_impossible_inertia_keeps_mass_and_centre() -> None:
    file = repaired(put("link rf_femur/inertial/inertia", izz="4e-4")).file
    old, new = WHOLE.link_by_name["rf_femur"], file.link_by_name["rf_femur"]
    assert (new.mass, new.com) == (old.mass, old.com)
    xx, yy, _ = old.moments[:3]
    excess = 4e-4 - xx - yy
    wanted = (xx + excess / 3, yy + excess / 3, 4e-4 - excess / 3)
    assert new.moments[:3] == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize(("moved", "said"), [(0.0, True), (0.01, False)])
def test_a_body_that_counts_twice_is_a_doubt(tmp_path: Path, moved: float, said: bool) -> None:
    """Builders give the trunk a link of its own for its inertial; all peaks were 50 % too large."""
    root = ET.fromstring(hp.urdf_path("athena").read_text())
    trunk = next(link for link in root.iter("link") if link.get("name") == "base_link")
    again = copy.deepcopy(trunk)
    again.set("name", "base_inertia")
    joint = ET.SubElement(root, "joint", name="again", type="fixed")
    ET.SubElement(joint, "parent", link="base_link")
    ET.SubElement(joint, "child", link="base_inertia")
    ET.SubElement(joint, "origin", xyz=f"{moved} 0 0")
    root.append(again)
    (tmp_path / "twice.urdf").write_bytes(ET.tostring(root))
    doubts = hp.load_robot(tmp_path / "twice.urdf").doubts
    text = "base_inertia: has mass and inertia of base_link, to which it is fixed"
    assert (text in doubts) == said


MASS = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>' \
       '</inertial>'  # fmt: skip


def refusal(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "broken.urdf"
    path.write_text(text)
    with refused(UrdfError, source=str(path)) as caught:
        load_robot(path)
    return caught.value.findings


@pytest.mark.parametrize(
    ("text", "culprit", "value"),
    [
        (broken(remove("link base_link/inertial")).text, "base_link", "floating base"),
        (SOUND.replace('posture joint="lf_coxa_joint"', 'posture joint="nope"'), "nope", "posture"),
        (broken(put("link lf_foot/collision/geometry/sphere", radius="-0.01")).text, "lf_foot",
         "radius -0.01"),
        ("not xml at all", "line 1", "not XML"),
        ('<robot name="empty"/>', "robot", "no <link>"),
    ],
)  # fmt: skip
def test_refused_by_name(tmp_path: Path, text: str, culprit: str, value: str) -> None:
    findings = refusal(tmp_path, text)
    assert any(culprit in finding and value in finding for finding in findings), findings


def test_unreadable_files(tmp_path: Path) -> None:
    missing = tmp_path / "missing.urdf"
    for path, cause in ((missing, FileNotFoundError), (tmp_path, IsADirectoryError)):
        about = ("folder", "URDF") if path is tmp_path else ()
        with refused(UrdfError, source=str(path), about=about) as caught:
            load_robot(path)
        assert isinstance(caught.value.__cause__, cause)
    big = tmp_path / "big.urdf"
    big.write_text(SOUND)
    with refused(UrdfError, source=str(big), about=(str(big.stat().st_size), "1000")):
        read_urdf(big, max_bytes=1000)


def test_long_chain_is_refused(tmp_path: Path) -> None:
    """1500 joints would need gigabytes for the mass matrix's workspace."""
    parts = [f'<link name="l{k}">{MASS}</link>' for k in range(1501)]
    parts += [
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(1500)
    ]
    (finding,) = refusal(tmp_path, f'<robot name="chain">{"".join(parts)}</robot>')
    assert "1500 moved joints; at most 300 are simulated" in finding


def test_mass_may_come_from_a_fixed_link() -> None:
    found = re.search('<link name="rm_tibia">\\s*(<inertial>.*?</inertial>)', SOUND, re.S)
    assert found is not None
    text = SOUND.replace(found[0], '<link name="rm_tibia">')
    text = text.replace('<link name="rm_foot">', f'<link name="rm_foot">{found[1]}')
    checked = check_urdf(parse_urdf(text.encode(), "test"))
    assert (checked[0], checked[1]) == ([], [])


def test_inspection_reports(tmp_path: Path) -> None:
    """`inspect` reports instead of raising: content, then accepted or every refusal."""
    path, bad = tmp_path / "robot.urdf", broken(every("joint", "axis", xyz="0 0 0")).text
    for content, ok, said in ((SOUND, True, "accepted"), (bad, False, "REFUSED: zero axis")):
        path.write_text(content)
        report = inspect(path)
        assert (report.ok, report.links, report.joints, report.moved_joints) == (ok, 25, 24, 18)
        assert report.chains == (3,) * 6 and len(report.legs) == (6 if ok else 0)
        assert report.total_mass == pytest.approx(3.08746, rel=1e-12)
        assert said in str(report)
