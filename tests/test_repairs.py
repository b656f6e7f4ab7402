"""Repairs: each against a file that needs exactly it; values against closed forms."""

from __future__ import annotations

import io
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from broken_urdfs import (
    SOUND,
    WHOLE,
    Break,
    NoMeshes,
    add,
    broken,
    every,
    limit,
    masses,
    part,
    put,
    remove,
    repaired,
    unset,
)
from test_findings import ALONE, MESH, TOGETHER

from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.repair import find_all, repair_urdf
from hexapod_pin.robot.repair.rules import DENSITY, JOINT_RANGE, SPEED

NO_REPAIR = {"too dense", "mesh not found", "unreadable origin", "loop", "absurd size"}
"""Kinds that only the user can repair."""


@pytest.mark.parametrize("name", [*TOGETHER, *ALONE])
def test_each_trouble_is_found_and_gone(name: str) -> None:
    """Kind and place; a repair removes it where it can, adds nothing, and has no second effect."""
    change, kind, place = {**TOGETHER, **ALONE}[name]
    file = broken(change)
    findings = find_all(file, NoMeshes())
    found = [x for x in findings if x.what == kind and place in x.where + x.value]
    assert found and all(x.value and x.rule and x.repair for x in findings), findings
    assert {x.repairable for x in found} == {kind not in NO_REPAIR}
    done = repair_urdf(file, NoMeshes())
    after = find_all(done.file, NoMeshes())
    left, places = {x.what for x in after}, {(x.what, x.where) for x in after}
    assert {(x.what, x.where) in places for x in found} == {kind in NO_REPAIR}
    if kind != "absurd size":  # of which nothing else can be judged
        assert left - {"mesh not found"} == ({kind} & NO_REPAIR) - {"mesh not found"}
    assert done.changes or kind in NO_REPAIR
    assert repair_urdf(done.file, NoMeshes()).file is done.file


def test_a_sound_file_is_returned_as_it_is() -> None:
    done = repair_urdf(WHOLE, NoMeshes())
    assert done.file is WHOLE
    assert (done.changes, done.assumed) == ((), ())


def test_everything_at_once() -> None:
    """What is left is what has no repair."""
    done = repaired(*(change for change, _, _ in TOGETHER.values()))
    left = {x.what for x in find_all(done.file, NoMeshes()) if x.severity == "refused"}
    assert left <= NO_REPAIR


@pytest.mark.parametrize("breaks", [
    [remove("link rr_coxa/inertial")],
    [every("link", "inertial/mass", value="1e-5")],
    [put("link lr_femur/inertial/inertia", ixx="-1e-5")],
    [TOGETHER["two roots"][0], TOGETHER["a joint twice"][0], TOGETHER["a link twice"][0]],
    [TOGETHER["material twice"][0], TOGETHER["planar"][0], TOGETHER["mimic"][0]],
    [ALONE["millimetres"][0]],
], ids=["no inertial", "dummies", "negative", "names", "materials", "millimetres"])  # fmt: skip
def test_other_parsers_open_it(breaks: list[Break]) -> None:
    """yourdfpy, Pinocchio and MuJoCo read the repaired text with one total mass."""
    import mujoco
    import pinocchio as pin
    import yourdfpy

    file = repaired(*breaks).file
    total = masses(file).sum()
    model = pin.buildModelFromXML(file.text, pin.JointModelFreeFlyer())
    assert sum(body.mass for body in model.inertias) == pytest.approx(total, rel=1e-12)
    robot = yourdfpy.URDF.load(io.BytesIO(file.text.encode()), build_scene_graph=False)
    theirs = [x.inertial.mass for x in robot.robot.links if x.inertial is not None]
    assert math.fsum(theirs) == pytest.approx(total, rel=1e-12)
    compiled = mujoco.MjModel.from_xml_string(file.text)
    assert compiled.body_mass.sum() == pytest.approx(total, rel=1e-9)


# limits -----------------------------------------------------------------------------------------


def test_limits() -> None:
    """Swapped where reversed; assumed where none, zero or many turns."""
    file = repaired(put("joint lm_coxa_joint/limit", lower="1", upper="-0.5")).file
    assert (limit(file, "lm_coxa_joint", "lower"), limit(file, "lm_coxa_joint", "upper")) == (
        -0.5,
        1,
    )
    for name in ("no limit", "limit nan", "zero limits", "many turns", "continuous"):
        change, _, joint = TOGETHER[name]
        done = repaired(change)
        assert limit(done.file, joint, "lower") == -JOINT_RANGE
        assert limit(done.file, joint, "upper") == JOINT_RANGE
        assert any("-2.618 to 2.618 rad" in text for text in done.assumed)


def test_effort_and_speed() -> None:
    """Three times a third of the weight at half a leg; given: on every joint."""
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


# names and structure ----------------------------------------------------------------------------


def test_a_copied_leg_is_renamed_with_its_joints() -> None:
    """All names of the leg lm are those of lf: two legs again, each a chain of its own."""
    file = parse_urdf(SOUND.replace("lm_", "lf_").encode(), "copied")
    done = repair_urdf(file, NoMeshes())
    assert [x.what for x in find_all(done.file, NoMeshes())] == []
    assert [j.xyz for j in done.file.joints] == [j.xyz for j in WHOLE.joints]
    assert {j.child for j in done.file.joints if j.parent == "lf_coxa_2"} == {"lf_femur_2"}
    np.testing.assert_allclose(masses(done.file), masses(WHOLE))


def test_world_and_helpers_are_dropped() -> None:
    done = repaired(ALONE["world"][0], TOGETHER["two roots"][0])
    assert done.file.base == "base_link"
    assert {x.name for x in done.file.links} == {x.name for x in WHOLE.links}
    assert any("world" in text for text in done.changes)


def test_a_wheel_leg_stays_continuous() -> None:
    """One joint a leg: no range is invented."""
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


def test_a_mesh_in_millimetres(tmp_path: Path) -> None:
    """A trunk drawn 1000 times too large gets scale 0.001."""
    import trimesh

    trimesh.creation.box((495.0, 205.0, 89.0)).export(tmp_path / "trunk.stl")
    shape = MESH.replace("package://none/a.stl", "trunk.stl")
    file = broken(remove("link base_link/visual"), remove("link base_link/inertial"),
                  add("link base_link", shape))  # fmt: skip
    finder = FolderFinder(tmp_path)
    assert "meshes in mm" in {x.what for x in find_all(file, finder)}
    done = repair_urdf(file, finder)
    assert find_all(done.file, finder) == []
    mesh = part(done.file.root, "link base_link/visual/geometry/mesh")
    assert [float(x) for x in mesh.get("scale", "").split()] == [0.001] * 3
    mass = done.file.link_by_name["base_link"].mass
    assert mass == pytest.approx(DENSITY * 0.495 * 0.205 * 0.089, rel=1e-6)


class FolderFinder(NoMeshes):
    """Finds files of one folder."""

    def __init__(self, folder: Path) -> None:
        """Keep the folder."""
        self.folder = folder

    def find(self, uri: str) -> Path | None:
        path = self.folder / uri
        return path if path.is_file() else None


def test_unset_speed_is_reported_with_before_and_after() -> None:
    done = repaired(unset("joint rm_femur_joint/limit", "velocity"))
    assert done.changes == ("joint 'rm_femur_joint': velocity None -> 6 rad/s",)
    assert len(done.masses) == len(WHOLE.links)
