"""Refusals: each broken URDF is refused by our own error, which names the culprit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from broken_urdfs import SOUND, broken, every, put, remove
from refusals import refused

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import parse_urdf, read_urdf
from hexapod_pin.robot.repair.find_all import check_urdf
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.urdf_report import inspect

MASS = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>' \
       '</inertial>'  # fmt: skip


def refusal(tmp_path: Path, text: str) -> list[str]:
    """Return the findings with which a file is refused."""
    path = tmp_path / "broken.urdf"
    path.write_text(text)
    with refused(UrdfError, source=str(path)) as caught:
        load_robot(path)
    return caught.value.findings


@pytest.mark.parametrize(
    ("text", "culprit", "value"),
    [
        (broken(remove("link base_link/inertial")).text, "base_link", "floating base"),
        (broken(put("link rr_coxa/inertial/inertia", iyz="1e-3")).text, "rr_coxa",
         "not positive definite"),
        (SOUND.replace('posture joint="lf_coxa_joint"', 'posture joint="nope"'), "nope", "posture"),
        (broken(put("link lf_foot/collision/geometry/sphere", radius="-0.01")).text, "lf_foot",
         "radius -0.01"),
        ("not xml at all", "line 1", "not XML"),
        ('<robot name="empty"/>', "robot", "no <link>"),
    ],
)  # fmt: skip
def test_refused_by_name(tmp_path: Path, text: str, culprit: str, value: str) -> None:
    """The finding names link or joint and what is wrong; more of them are in test_repairs.py."""
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
    """A moved link without inertial is fine when a link fixed to it has mass."""
    found = re.search('<link name="rm_tibia">\\s*(<inertial>.*?</inertial>)', SOUND, re.S)
    assert found is not None
    text = SOUND.replace(found[0], '<link name="rm_tibia">')
    text = text.replace('<link name="rm_foot">', f'<link name="rm_foot">{found[1]}')
    checked = check_urdf(parse_urdf(text.encode(), "test"))
    assert (checked[0], checked[1]) == ([], [])


@pytest.mark.parametrize("ok", [True, False])
def test_inspection_reports(tmp_path: Path, ok: bool) -> None:
    """`inspect` reports instead of raising: content, then accepted or every refusal."""
    path = tmp_path / "robot.urdf"
    path.write_text(SOUND if ok else broken(every("joint", "axis", xyz="0 0 0")).text)
    report = inspect(path)
    assert report.ok == ok
    assert (report.links, report.joints, report.moved_joints) == (25, 24, 18)
    assert report.chains == (3,) * 6
    assert report.total_mass == pytest.approx(3.08746, rel=1e-12)
    text = str(report)
    assert ("accepted" in text) == ok
    assert ("REFUSED: zero axis" in text) == (not ok)
    assert ("18 joints: 'lf_coxa_joint', " in text) == (not ok)
    assert len(report.legs) == (6 if ok else 0)
