"""Robots' files that would hang, crash or poison: refused at once, with what is wrong."""

from __future__ import annotations

import errno
import html
import os
import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import HexapodError, ParameterError, UrdfError
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.reading.robot_text import read_robot_text

BASE = hp.urdf_path("kharagpur").read_text(encoding="utf-8")
XACRO = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'

REFUSED = {
    "a million levels": ("<a>" * 1_000_000 + "</a>" * 1_000_000, ("nested", "100")),
    "entity bomb": ('<!DOCTYPE r [<!ENTITY a "aa">]><robot name="&a;"/>', ("<!DOCTYPE",)),
    "reserved joint": (BASE.replace('"lf_coxa_joint"', '"universe"'), ("joint 'universe'",)),
    "huge mass": (
        re.sub('mass value="[^"]*"', 'mass value="1e308"', BASE),
        ("link 'base_link'", "link 'lf_tibia'", "mass '1e308' kg"),
    ),
    "huge place": (
        re.sub('xyz="[^"]*"', 'xyz="1e308 0 0"', BASE),
        ("joint 'lf_coxa_joint'", "origin xyz '1e308 0 0'"),
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_is_refused_with_what_is_wrong(name: str, tmp_path: Path):
    text, about = REFUSED[name]
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    with refused(UrdfError, source=str(path), about=about):
        hp.load_robot(path)


def test_text_that_is_not_utf8_is_refused_with_its_byte(tmp_path: Path):
    path, data = tmp_path / "robot.urdf", BASE.encode().replace(b"S2", b"S\xe9", 1)
    path.write_bytes(data)
    with refused(UrdfError, source=str(path), about=("UTF-8", f"(byte {data.index(0xE9)})")):
        hp.load_robot(path)


def test_names_that_no_file_has(tmp_path: Path):
    long = tmp_path / ("a" * 300 + ".urdf")
    reason = os.strerror(errno.ENAMETOOLONG)[1:]  # it may begin with a small letter
    with refused(UrdfError, source=str(long), about=(reason,)):
        hp.load_robot(long)
    with refused(ParameterError, "load_robot.source", "a\u0000b.urdf"):
        hp.load_robot("a\0b.urdf")


def test_foot_radii_out_of_range():
    for radius, name, allowed in (
        (1e308, "LoadOptions.foot_radius", 1e30),
        (100.1, "foot_radius", 0.365),  # half of what the joints span
        (-1e-3, "foot_radius", 0.0),
    ):
        with refused(ParameterError, name, radius, allowed=(allowed,)):
            hp.load_robot("kharagpur", foot_radius=radius)


@pytest.mark.parametrize("name", ["effort", "lower"])
def test_huge_limits_end_in_a_result_or_a_refusal(name: str, tmp_path: Path):
    path = tmp_path / "robot.urdf"
    path.write_text(re.sub(f'{name}="[^"]*"', f'{name}="1e308"', BASE), encoding="utf-8")
    try:
        scene = hp.Scene(hp.load_robot(path))
        trace = hp.simulate(scene, hp.HoldPosture(), duration=0.004)
    except HexapodError:
        return
    assert np.isfinite(trace.q).all() and np.isfinite(trace.torque).all()


@pytest.mark.parametrize(
    ("expression", "about"),
    [("${9**9**9}", "4096"), ("${1 &lt;&lt; 10**9}", "4096"), ("${len.__self__}", "'__self__'"),
     ("${__import__('os').getcwd()}", "'__import__'"), ("${'a'*10**10}", "100000"),
     ("${len(list(range(10**9)))}", "100000"), ("${math.factorial(10**6)}", "'factorial'"),
     ("${'%999999999d' % 1}", "width"), ("${'a'.format(1)}", "'format'"),
     ("${('a'*99999).replace('a', 'b'*99999)}", "100000"),
     ("${('a'*99999).join(['b']*99999)}", "100000"), ("${(lambda: 1)()}", "Lambda"),
     ("${[[x for x in range(9999)] for y in range(9999)]}", "200000")],
)  # fmt: skip
def test_endless_and_unsafe_expressions_are_refused(expression: str, about: str, tmp_path: Path):
    path = tmp_path / "robot.xacro"
    path.write_text(XACRO.format(f'<link name="{expression}"/>'), encoding="utf-8")
    with refused(UrdfError, source=str(path), about=(about, html.unescape(expression[2:-1]))):
        hp.load_robot(path)


def test_values_of_expressions_are_those_of_python(tmp_path: Path):
    path = tmp_path / "robot.xacro"
    values = {
        "2*pi": "6.283185307179586", "radians(90)": "1.5707963267948966", "-2**2": "-4",
        "1 if 3 > 2 > 1 and not False else 0": "1", "'a' + 'b'*2": "abb", "[1, 2, 3][-1]": "3",
        "dict(a=4)['a']": "4", "python.sum([k*k for k in range(4) if k != 2])": "10",
        "'%s_%d' % ('leg', 3)": "leg_3", "'A-b'.lower().split('-')[1]": "b", "math.sqrt(16)": "4.0",
        "7 // 2 + 7 % 4": "6", "max(1, 2, 3) if 'x' in 'xyz' else 0": "3", "'abc'[0:2]": "ab",
    }  # fmt: skip
    links = [f'<link name="{html.escape("${" + one + "}")}"/>' for one in values]
    path.write_text(XACRO.format("".join(links)), encoding="utf-8")
    assert re.findall('link name="(.*?)"', read_robot_text(path).text) == list(values.values())


def test_a_package_is_not_left(tmp_path: Path):
    """The file exists: it is beside the package, not in it."""
    package = tmp_path / "robots" / "legs"
    (package / "urdf").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>legs</name></package>", encoding="utf-8")
    for path in (tmp_path / "secret.stl", package / "own.stl"):
        path.write_text("solid", encoding="utf-8")
    finder = ResourceFinder(package / "urdf" / "legs.urdf")
    assert finder.find("package://legs/urdf/../own.stl") is not None
    for path in ("legs/../../secret.stl", "../secret.stl", "legs/%2e%2e/%2e%2e/secret.stl"):
        assert finder.find(f"package://{path}") is None
    assert "leads out of its package" in finder.why("package://legs/../../secret.stl")


def test_macros_that_call_each_other_ten_times_each_are_ended(tmp_path: Path):
    macros = "".join(
        f'<xacro:macro name="m{k}">{f"<xacro:m{k + 1}/>" * 10}</xacro:macro>' for k in range(8)
    )
    path = tmp_path / "robot.xacro"
    last = '<xacro:macro name="m8"/>'
    path.write_text(XACRO.format(macros + last + "<xacro:m0/>"), encoding="utf-8")
    with refused(UrdfError, source=str(path), about=("5000", "macros")):
        hp.load_robot(path)


def test_a_yaml_file_that_repeats_itself_or_never_ends_is_not_written_out(tmp_path: Path):
    rows = [f"- &a{k} [{', '.join([f'*a{k - 1}'] * 10) if k else '1'}]" for k in range(12)]
    (tmp_path / "y.yaml").write_text("\n".join(rows), encoding="utf-8")
    loaded = '<xacro:property name="y" value="${xacro.load_yaml(\'y.yaml\')}"/>'
    path = tmp_path / "robot.xacro"
    path.write_text(XACRO.format(loaded + '<link name="${len(str(y))}"/>'), encoding="utf-8")
    with refused(UrdfError, source=str(path), about=("100000", "'y.yaml'")):
        hp.load_robot(path)
    loaded = "<link name=\"${xacro.load_yaml('/dev/zero')}\"/>"
    path.write_text(XACRO.format(loaded), encoding="utf-8")
    with refused(UrdfError, source=str(path), about=("/dev/zero", "regular")):
        hp.load_robot(path)
