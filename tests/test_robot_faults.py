"""Files of robots, also in xacro: expanded with files near them, or refused with what is wrong."""

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
from hexapod_pin.robot.description.urdf_file import parse_urdf, read_urdf
from hexapod_pin.robot.reading.resources import FOLDER_VARIABLES, SHARE_VARIABLES, ResourceFinder
from hexapod_pin.robot.reading.robot_text import read_robot_text

BASE = hp.urdf_path("kharagpur").read_text(encoding="utf-8")
XACRO = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'

REFUSED = {
    "a million levels": ("<a>" * 1_000_000 + "</a>" * 1_000_000, ("nested", "100")),
    "entity bomb": ('<!DOCTYPE r [<!ENTITY a "aa">]><robot name="&a;"/>', ("<!DOCTYPE",)),
    "reserved joint": (BASE.replace('"lf_coxa_joint"', '"universe"'), ("joint 'universe'",)),
    "reserved link": (BASE.replace('"base_link"', '"universe"'), ("link 'universe'",)),
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


ROBOT = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="spider">{}</robot>'
MESH = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
LINK = '<link name="base"/>'
CODE = '<xacro:property name="code" value="{}"/><link name="$(eval ${{code}})"/>'


@pytest.fixture(autouse=True)
def no_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in FOLDER_VARIABLES + SHARE_VARIABLES:
        monkeypatch.delenv(name, raising=False)


def write(path: Path, inside: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(ROBOT.format(inside) if not inside.startswith("<?") else inside)
    return path


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    write(
        tmp_path / "spider/urdf/leg.xacro",
        '<xacro:macro name="leg" params="name length"><link name="${name}_${length * 2}">'
        f"{MESH.format('$(find spider)/meshes/leg.stl')}</link></xacro:macro>",
    )
    (tmp_path / "spider/meshes").mkdir()
    (tmp_path / "spider/meshes/leg.stl").write_text("x")
    (tmp_path / "spider/package.xml").write_text("<package><name>spider</name></package>")
    return write(
        tmp_path / "spider/urdf/spider.urdf.xacro",
        '<xacro:arg name="length" default="1.5"/>'
        '<xacro:include filename="$(find spider)/urdf/leg.xacro"/>'
        '<xacro:leg name="front" length="$(arg length)"/>',
    )


def findings(path: Path, **options: object) -> str:
    with pytest.raises(UrdfError) as caught:
        read_robot_text(path, **options)  # type: ignore[arg-type]
    assert caught.value.source == str(path)
    return "; ".join(caught.value.findings)


def test_a_file_is_expanded(robot: Path, capfd: pytest.CaptureFixture[str]) -> None:
    found = read_robot_text(robot)
    file = parse_urdf(found.text.encode(), str(robot))
    assert found.expanded and [link.name for link in file.links] == ["front_3.0"]
    assert found.notes == ("xacro argument length = 1.5 (default)",)
    assert capfd.readouterr() == ("", "")


def test_arguments_override_defaults_and_a_package_may_lie_anywhere(
    robot: Path, tmp_path: Path
) -> None:
    """$(find package) stays a package in the text, and its mesh is found."""
    found = read_robot_text(robot, xacro_args={"length": "2"})
    assert 'name="front_4"' in found.text
    assert found.notes == ("xacro argument length = 2 (given)",)
    before = read_robot_text(robot).text
    assert 'name="front_3.0"' in before  # nothing is left of the argument
    os.rename(tmp_path / "spider", tmp_path / "moved")
    moved = tmp_path / "moved/urdf/spider.urdf.xacro"
    assert read_robot_text(moved).text == before and str(tmp_path) not in before
    found = ResourceFinder(moved).find("package://spider/meshes/leg.stl")
    assert "package://spider/meshes/leg.stl" in before and found is not None


def test_a_missing_argument_is_named(robot: Path) -> None:
    robot.write_text(robot.read_text().replace(' default="1.5"', ""))
    text = findings(robot)
    assert "'length'" in text and "xacro_args=[...] (length=VALUE)" in text
    assert 'name="front_4"' in read_robot_text(robot, xacro_args={"length": "2"}).text


def test_an_argument_that_is_not_used_is_refused(robot: Path, tmp_path: Path) -> None:
    text = findings(robot, xacro_args={"lenght": "2"})
    assert "'lenght'" in text and "file uses: length" in text
    urdf = write(tmp_path / "plain.urdf", LINK)
    assert "takes no xacro argument (length)" in findings(urdf, xacro_args={"length": "2"})


def test_an_include_of_a_missing_package(robot: Path, tmp_path: Path) -> None:
    robot.write_text(robot.read_text().replace("$(find spider)/urdf/", "$(find parts)/xacro/"))
    os.makedirs(tmp_path / "far/parts/xacro")
    os.rename(robot.parent / "leg.xacro", tmp_path / "far/parts/xacro/leg.xacro")
    text = findings(robot)
    assert "$(find parts)/xacro/leg.xacro" in text and "package_path=[...]" in text
    assert "front_3.0" in read_robot_text(robot, package_path=[tmp_path / "far"]).text


def test_an_include_that_lies_elsewhere_is_noted(robot: Path) -> None:
    robot.write_text(robot.read_text().replace("$(find spider)", "$(find foreign)"))
    found = read_robot_text(robot)
    assert "front_3.0" in found.text
    robot.write_text(robot.read_text().replace("$(find foreign)/urdf", "/home/me/x/urdf"))
    notes = read_robot_text(robot).notes
    assert any("/home/me/x/urdf/leg.xacro: taken from" in note for note in notes)


def test_a_missing_file_of_a_package_that_is_there(robot: Path) -> None:
    os.remove(robot.parent / "leg.xacro")
    text = findings(robot)
    assert "spider/urdf/leg.xacro cannot be read" in text and "package_path=[...]" in text
    optional = robot.read_text().replace('leg.xacro"', 'leg.xacro" optional="true"')
    robot.write_text(optional.replace('<xacro:leg name="front" length="$(arg length)"/>', LINK))
    assert 'name="base"' in read_robot_text(robot).text


@pytest.mark.parametrize(
    ("inside", "about"),
    [
        ('<xacro:include filename="robot.xacro"/>', ("include",)),
        ('<link name="${1 / 0}"/>', ("'1 / 0'", "zero")),
        ('<link name="${unknown}"/>', ("'unknown'",)),
        ("<xacro:unknown/>", ("xacro:unknown",)),
        ('<xacro:include filename="broken.xacro"/>', ("broken.xacro", "XML", "1")),
        ('<xacro:include filename="bomb.xacro"/>', ("bomb.xacro", "<!DOCTYPE")),
        ('<include filename="x.xacro"/>' + LINK, ("<include>", "xacro:")),
        ('<xacro:macro name="leg" params=""/>', ("(leg)",)),
        (CODE.format("open('made', 'w')"), ("'open'",)),
        ("<link name=\"${xacro.load_yaml('none.yaml')}\"/>", ("none.yaml", "package_path")),
    ],
)
def test_what_cannot_be_expanded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, inside: str, about: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.xacro").write_text("<robot")
    (tmp_path / "bomb.xacro").write_text("<!DOCTYPE robot [<!ENTITY a 'b'>]><robot>&a;</robot>")
    path = write(tmp_path / "robot.xacro", f'<xacro:property name="x" value="1"/>{inside}')
    with refused(UrdfError, source=str(path), about=about):
        read_robot_text(path)
    assert not (tmp_path / "made").exists()


def test_expressions_that_are_allowed(tmp_path: Path) -> None:
    (tmp_path / "config").mkdir()
    (tmp_path / "config/sizes.yaml").write_text("femur: {length: 0.25}\nangle: !degrees 180\n")
    inside = (
        "<xacro:property name='s' value=\"${xacro.load_yaml('config/sizes.yaml')}\"/>"
        "<xacro:property name='c' value=\"max(1, int('5')) + arg('n')\"/>"
        '<link name="$(eval 3 + n)"/><link name="$(eval ${c})"/>'
        '<link name="${s.femur.length} ${s.angle}"/>'
    )
    path = write(tmp_path / "robot.xacro", f"<xacro:arg name='n' default='4'/>{inside}")
    text = read_robot_text(path).text
    assert 'name="7"' in text and 'name="9"' in text and 'name="0.25 3.14159' in text


def test_a_urdf_stays_as_it_is(tmp_path: Path) -> None:
    """Also with the namespace of xacro, as expanded files keep it; elements of xacro expand it."""
    path = write(tmp_path / "robot.urdf", LINK + "<!-- <xacro:leg/> ${x} -->")
    found = read_robot_text(path)
    assert found.text == path.read_text() == read_urdf(path).text and not found.expanded
    write(path, '<xacro:property name="n" value="trunk"/><link name="${n}"/>')
    assert 'name="trunk"' in read_robot_text(path).text


def test_sizes_are_limited(tmp_path: Path) -> None:
    path = write(tmp_path / "robot.xacro", '<link name="${list(map(str, [1] * 1000))}"/>')
    assert "expands to more than 900 bytes" in findings(path, max_bytes=900)
    assert "no more than 20 bytes" in findings(path, max_bytes=20)


@pytest.mark.parametrize(
    ("text", "about"),
    [
        ("<sdf version='1.6'><model name='m'/></sdf>", ("<sdf>", "SDF", "pysdf")),
        ("<launch/>", ("<launch>", "robot_description", "xacro_args")),
        ("<all><robot name='a'/><robot name='b'/></all>", ("<all>", "2", "'a', 'b'")),
        ("<mujoco model='m'/>", ("<mujoco>", "MJCF", "name it .xml")),
    ],
)
def test_other_kinds_of_files_are_named(tmp_path: Path, text: str, about: tuple[str, ...]) -> None:
    path = tmp_path / ("file.urdf" if "<sdf" in text else "file.xacro")
    path.write_text(text)
    with refused(UrdfError, source=str(path), about=about):
        parse_urdf(read_robot_text(path).text.encode(), str(path))


def test_xacro_without_its_prefix(tmp_path: Path) -> None:
    """A xacro file must declare it; left-overs in a URDF are no reason to expand it."""
    for name in ("left.urdf", "file.xacro"):
        (tmp_path / name).write_text("<robot><xacro:leg/></robot>")
    path = tmp_path / "file.xacro"
    with refused(UrdfError, source=str(path), about=("xmlns:xacro=",)):
        read_robot_text(path)
    assert not read_robot_text(tmp_path / "left.urdf").expanded
