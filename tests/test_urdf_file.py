"""Refusals: each broken URDF is refused by our own error, which names the culprit."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from refusals import refused

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.description.urdf_file import parse_urdf, read_urdf
from hexapod_pin.robot.repair.find_all import check_urdf
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.urdf_report import inspect

GOOD = KHARAGPUR.urdf()


def inside(tag: str, name: str, old: str, new: str) -> str:
    """Return the good file with `old` replaced by `new` inside one link or joint."""
    pattern = re.compile(rf'<{tag} name="{name}".*?</{tag}>', re.S)
    found = pattern.search(GOOD)
    assert found is not None
    changed = re.sub(old, new, found[0], count=1, flags=re.S)
    assert changed != found[0]
    return GOOD.replace(found[0], changed)


def link(name: str, old: str, new: str) -> str:
    return inside("link", name, old, new)


def joint(name: str, old: str, new: str) -> str:
    return inside("joint", name, old, new)


def refusal(tmp_path: Path, text: str) -> list[str]:
    """Return the findings, and check that a good file still loads afterwards."""
    path = tmp_path / "broken.urdf"
    path.write_text(text)
    with pytest.raises(UrdfError) as refused:
        load_robot(path)
    assert "broken.urdf" in str(refused.value)
    load_robot("kharagpur")
    return refused.value.findings


@pytest.mark.parametrize(
    ("text", "culprit", "value"),
    [
        (link("base_link", "<inertial>.*</inertial>", ""), "base_link", "floating base"),
        (link("rr_coxa", 'ixx="[^"]*"', 'ixx="0"'), "rr_coxa", "triangle inequality"),
        (link("rr_coxa", "<inertia .*?/>",
              '<inertia ixx="0" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'),
         "rr_coxa", "not positive definite"),
        (link("rr_coxa", 'iyz="0"', 'iyz="1e-3"'), "rr_coxa", "not positive definite"),
        (joint("rf_tibia_joint", 'parent link="rf_femur"', 'parent link="nowhere"'),
         "rf_tibia_joint", "parent link 'nowhere'"),
        (GOOD.replace('posture joint="lf_coxa_joint"', 'posture joint="nope"'), "nope", "posture"),
        (link("lf_foot", 'collision>.*?radius="0.01"',
              'collision><origin xyz="0 0 0"/><geometry><sphere radius="-0.01"'),
         "lf_foot", "radius -0.01"),
    ],
)  # fmt: skip
def test_refused_by_name(tmp_path: Path, text: str, culprit: str, value: str) -> None:
    """The finding names link or joint and what is wrong with it.

    More of them are in tests/test_repairs.py.
    """
    findings = refusal(tmp_path, text)
    assert any(culprit in finding and value in finding for finding in findings), findings


@pytest.mark.parametrize(
    ("text", "about"),
    [
        ("not xml at all", "line 1"),
        (GOOD[:2000], "not XML"),
        ("<sdf/>", "<sdf>"),
        ('<robot name="empty"/>', "no <link>"),
    ],
)
def test_no_urdf_at_all(tmp_path: Path, text: str, about: str) -> None:
    """Refused before any parser of a library sees the file, with the place where it breaks."""
    assert about in refusal(tmp_path, text)[0]


def test_all_findings_at_once(tmp_path: Path) -> None:
    """Three faults give three findings in one error."""
    text = joint("rf_tibia_joint", "0 1 0", "0 0 0")
    text = text.replace('<mass value="0.041"/>', '<mass value="-1"/>', 2)
    findings = refusal(tmp_path, text)
    assert len(findings) == 3
    assert [name in str(findings) for name in ("rf_tibia_joint", "lf_femur", "lm_femur")] == [
        True, True, True,
    ]  # fmt: skip


def test_unreadable_files(tmp_path: Path) -> None:
    """Missing, a folder, too large."""
    missing = tmp_path / "missing.urdf"
    for path, cause in ((missing, FileNotFoundError), (tmp_path, IsADirectoryError)):
        about = ("folder", "URDF") if path is tmp_path else ()
        with refused(UrdfError, source=str(path), about=about) as caught:
            load_robot(path)
        assert isinstance(caught.value.__cause__, cause)
    big = tmp_path / "big.urdf"
    big.write_text(GOOD)
    size = big.stat().st_size
    with refused(UrdfError, source=str(big), about=(str(size), "1000")):
        read_urdf(big, max_bytes=1000)


def test_long_chain_is_refused(tmp_path: Path) -> None:
    """1500 joints would need gigabytes for the mass matrix's workspace."""
    mass = (
        '<inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    parts = [f'<link name="l{k}">{mass}</link>' for k in range(1501)]
    parts += [
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(1500)
    ]
    findings = refusal(tmp_path, f'<robot name="chain">{"".join(parts)}</robot>')
    assert len(findings) == 1
    assert "1500 moved joints; at most 300 are simulated" in findings[0]


def notes(text: str) -> str:
    findings, found, _ = check_urdf(parse_urdf(text.encode(), "test"))
    assert findings == []
    return "\n".join(found)


def test_suspicious_is_noted_not_refused() -> None:
    """An inertia in kg mm^2 taken as kg m^2, a long axis."""
    large = '<inertia ixx="70.8" iyy="108.4" izz="56.7" ixy="0" ixz="0" iyz="0"/>'
    unit_slip = link("rr_coxa", "<inertia .*?/>", large)
    assert "rr_coxa" in notes(unit_slip)
    assert "unit of its inertia" in notes(unit_slip)
    assert "rf_tibia_joint': axis not of unit length: axis 0 10 0" in notes(
        joint("rf_tibia_joint", "0 1 0", "0 10 0")
    )
    assert notes(GOOD) == ""


def test_mass_may_come_from_a_fixed_link() -> None:
    """A moved link without inertial is fine when a link fixed to it has mass."""
    found = re.search('<link name="rm_tibia">\\s*(<inertial>.*?</inertial>)', GOOD, re.S)
    assert found is not None
    text = GOOD.replace(found[0], '<link name="rm_tibia">')
    text = text.replace('<link name="rm_foot">', f'<link name="rm_foot">{found[1]}')
    assert notes(text) == ""


@pytest.mark.parametrize("change", [lambda text: text, lambda text: text.replace("0 1 0", "0 0 0")])
def test_inspection_reports(tmp_path: Path, change: Callable[[str], str]) -> None:
    """`inspect` reports instead of raising: content, then accepted or every refusal."""
    path = tmp_path / "robot.urdf"
    path.write_text(change(GOOD))
    report = inspect(path)
    assert report.ok == (change("0 1 0") == "0 1 0")
    assert (report.links, report.joints, report.moved_joints) == (25, 24, 18)
    assert report.chains == (3,) * 6
    assert report.total_mass == pytest.approx(3.08746, rel=1e-12)
    text = str(report)
    assert ("accepted" in text) == report.ok
    assert ("REFUSED: zero axis" in text) == (not report.ok)
    assert ("12 joints: 'lf_femur_joint', " in text) == (not report.ok)
    assert len(report.legs) == (6 if report.ok else 0)
