"""`hexapod-pin repair` and `check`: files written, references kept, the input left alone."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from broken_urdfs import SOUND, add, broken, every, put, remove
from conftest import Run

from hexapod_pin.robot.description.urdf_file import read_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.repair import find_all
from hexapod_pin.robot.urdf_report import inspect


def test_a_repaired_file_is_accepted(run: Run, tmp_path: Path) -> None:
    """Refused, repaired, accepted; changes, assumptions and masses are printed."""
    file = broken(remove("link rr_coxa/inertial"), every("joint", "limit", velocity="0"))
    (tmp_path / "bad.urdf").write_text(file.text)
    assert run("check", "bad.urdf").status == 2
    done = run("repair", "bad.urdf", "-o", "good.urdf", "--velocity", "5")
    assert (done.status, done.err) == (0, "")
    for text in ("18 joints", "velocity 0 -> 5 rad/s", "assumed: link 'rr_coxa'", "total mass"):
        assert text in done.out
    report = inspect(tmp_path / "good.urdf")
    assert report.ok
    assert any("rr_coxa" in text for text in report.assumed)
    assert (tmp_path / "bad.urdf").read_text() == file.text


def test_a_sound_file_is_copied_to_the_byte(run: Run, tmp_path: Path) -> None:
    data = b"\xef\xbb\xbf" + SOUND.replace("\n", "\r\n").encode()
    (tmp_path / "sound.urdf").write_bytes(data)
    assert "nothing to repair" in run("repair", "sound.urdf", "-o", "copy.urdf").out
    assert (tmp_path / "copy.urdf").read_bytes() == data


def test_refusals(run: Run, tmp_path: Path) -> None:
    """The input is not overwritten; nothing is written where no repair exists."""
    (tmp_path / "a.urdf").write_text(SOUND)
    assert "another file" in run("repair", "a.urdf", "-o", "a.urdf").err
    bad = broken(put("joint lf_foot_joint/origin", xyz="1 2 z"))
    (tmp_path / "b.urdf").write_text(bad.text)
    done = run("repair", "b.urdf", "-o", "c.urdf")
    assert done.status == 2
    assert "nothing is written" in done.err
    assert "lf_foot_joint" in done.err
    assert not (tmp_path / "c.urdf").exists()


def test_meshes_are_found_from_another_folder(run: Run, tmp_path: Path) -> None:
    """A relative reference becomes one relative to the output's folder."""
    import trimesh

    (tmp_path / "in" / "meshes").mkdir(parents=True)
    (tmp_path / "out").mkdir()
    box = trimesh.creation.box((0.5, 0.2, 0.1))
    box.export(tmp_path / "in" / "meshes" / "trunk.stl")
    shape = '<visual><geometry><mesh filename="meshes/trunk.stl"/></geometry></visual>'
    file = broken(remove("link base_link/visual"), add("link base_link", shape))
    (tmp_path / "in" / "a.urdf").write_text(file.text)
    assert run("repair", "in/a.urdf", "-o", "out/a.urdf").status == 0
    written = read_urdf(tmp_path / "out" / "a.urdf")
    mesh = next(written.root.iter("mesh"))
    assert mesh.get("filename") == "../in/meshes/trunk.stl"
    assert find_all(written, ResourceFinder(tmp_path / "out" / "a.urdf")) == []
    masses = [link.mass or 0.0 for link in written.links]
    np.testing.assert_allclose(masses, [link.mass or 0.0 for link in file.links])
    assert ET.fromstring(written.text).tag == "robot"


def test_chains_are_counted_by_their_joints(tmp_path: Path) -> None:
    """Six legs of three joints and a head of one."""
    inertia = 'ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"'
    file = broken(
        add("", f'<link name="head"><inertial><mass value="0.1"/><inertia {inertia}/></inertial>'
            "</link>"),
        add("", '<joint name="neck" type="revolute"><parent link="base_link"/><child link="head"/>'
            '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="6"/></joint>'),
    )  # fmt: skip
    (tmp_path / "head.urdf").write_text(file.text)
    report = inspect(tmp_path / "head.urdf")
    assert sorted(report.chains) == [1, 3, 3, 3, 3, 3, 3]
    assert "chains of moved joints: 6 of 3, 1 of 1" in str(report)


@pytest.mark.parametrize("option", ["--mass", "--density", "--effort", "--velocity"])
def test_options_are_above_zero(run: Run, tmp_path: Path, option: str) -> None:
    (tmp_path / "a.urdf").write_text(SOUND)
    done = run("repair", "a.urdf", "-o", "b.urdf", option, "-1")
    assert done.status == 2
    assert option.removeprefix("--") in done.err
