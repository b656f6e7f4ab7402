"""xacro files are expanded with files found near them, or refused by what is missing."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from refusals import refused

from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import parse_urdf, read_urdf
from hexapod_pin.robot.reading import ResourceFinder, read_robot_text
from hexapod_pin.robot.reading.resources import FOLDER_VARIABLES, SHARE_VARIABLES

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
    """A package with an argument, an include, a macro and a mesh."""
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
    """It names package and file; --package-path is the remedy; so are ROS's variables."""
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
    """More of their values are in test_robot_faults.py."""
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
    path = tmp_path / "file.xacro"
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
