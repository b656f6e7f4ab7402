"""Files that a URDF names are found, whatever scheme, system or workspace the name comes from."""

from __future__ import annotations

from pathlib import Path

import pytest

from hexapod_pin.robot.reading import ResourceFinder
from hexapod_pin.robot.reading.folder_index import FolderIndex
from hexapod_pin.robot.reading.resources import FOLDER_VARIABLES, SHARE_VARIABLES


@pytest.fixture(autouse=True)
def no_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in FOLDER_VARIABLES + SHARE_VARIABLES:
        monkeypatch.delenv(name, raising=False)


def write(path: Path, text: str = "x") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def package(folder: Path, name: str) -> Path:
    write(folder / "package.xml", f"<package format='2'>\n <name> {name} </name></package>")
    return folder


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A workspace: a package in a folder of another name, its URDF and a mesh."""
    folder = package(tmp_path / "src/folder", "spider")
    write(folder / "meshes/leg one.stl")
    return write(folder / "urdf/spider.urdf")


@pytest.mark.parametrize(
    "uri",
    [
        "package://spider/meshes/leg one.stl",
        "package://spider/meshes/leg%20one.stl",
        "PACKAGE://spider/meshes/LEG ONE.STL",
        "package:\\\\spider\\meshes\\leg one.stl",
        "$(find spider)/meshes/leg one.stl",
        "file://$(find spider)/meshes/leg one.stl",
        "model://folder/meshes/leg one.stl",
        "../meshes/leg one.stl",
        "..\\meshes\\leg one.stl",
        "meshes/leg one.stl",
        "./meshes//leg one.stl",
        "file://../meshes/leg one.stl",
        "file:///home/somebody/ws/src/spider/meshes/leg%20one.stl",
        "/home/somebody/ws/src/spider/meshes/leg one.stl",
        "C:\\Users\\somebody\\spider\\meshes\\Leg One.STL",
        "file:///C:/Users/somebody/spider/meshes/leg%20one.stl",
        "file://D:\\spider\\meshes\\leg one.stl",
        "package://another/meshes/leg one.stl",
        "https://example.org/spider/meshes/leg one.stl",
        "package://spider/meshes/leg one.dae",
    ],
)
def test_every_form_of_a_name(robot: Path, uri: str) -> None:
    found = ResourceFinder(robot).find(uri)
    assert found is not None, ResourceFinder(robot).why(uri)
    assert found.samefile(robot.parents[1] / "meshes/leg one.stl")


def test_an_absolute_path_is_taken_as_it_is(robot: Path, tmp_path: Path) -> None:
    mesh = write(tmp_path / "elsewhere/a#b.stl")
    finder = ResourceFinder(robot)
    assert finder.find(str(mesh)) == mesh
    assert finder.find(mesh.as_uri()) == mesh
    assert finder.note(str(mesh)) == ""


def test_what_was_assumed_is_noted(robot: Path) -> None:
    finder = ResourceFinder(robot)
    assert finder.note("package://spider/meshes/leg one.stl") == ""
    assert "end of its path" in finder.note("C:\\x\\meshes\\leg one.stl")
    assert "in place of leg one.dae" in finder.note("package://spider/meshes/leg one.dae")


def test_a_named_file_comes_before_a_stand_in(robot: Path) -> None:
    other = write(robot.parents[1] / "meshes/leg one.dae")
    found = ResourceFinder(robot).find("package://spider/meshes/leg one.dae")
    assert found is not None and found.samefile(other)


def test_packages_beside_and_above(robot: Path, tmp_path: Path) -> None:
    """By folder, and by the name in package.xml where the folder is called otherwise."""
    beside = write(tmp_path / "src/parts/meshes/foot.stl")
    renamed = write(package(tmp_path / "src/checkout-2", "claws") / "meshes/claw.stl")
    finder = ResourceFinder(robot)
    assert finder.find("package://parts/meshes/foot.stl") == beside
    assert finder.find("package://claws/meshes/claw.stl") == renamed
    assert finder.package("spider") == robot.parents[1]
    assert finder.package("nothing") is None


@pytest.mark.parametrize("given", ["", "group", "group/parts", "group/parts/meshes/.."])
def test_package_path(robot: Path, tmp_path: Path, given: str) -> None:
    """A workspace, a folder of packages, or the package itself."""
    mesh = write(package(tmp_path / "far/group/parts", "parts") / "meshes/foot.stl")
    uri = "package://parts/meshes/foot.stl"
    assert ResourceFinder(robot).find(uri) is None
    found = ResourceFinder(robot, [tmp_path / "far" / given]).find(uri)
    assert found is not None and found.samefile(mesh)


@pytest.mark.parametrize(
    ("variable", "folder", "uri"),
    [
        ("ROS_PACKAGE_PATH", "opt", "package://parts/meshes/foot.stl"),
        ("AMENT_PREFIX_PATH", "prefix", "package://parts/meshes/foot.stl"),
        ("GAZEBO_MODEL_PATH", "opt", "model://parts/meshes/foot.stl"),
        ("GZ_SIM_RESOURCE_PATH", "opt", "package://parts/meshes/foot.stl"),
        ("IGN_GAZEBO_RESOURCE_PATH", "opt/parts", "model://parts/meshes/foot.stl"),
    ],
)
def test_variables_of_ros_and_gazebo(
    robot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    variable: str, folder: str, uri: str,
) -> None:  # fmt: skip
    mesh = write(tmp_path / "far/opt/parts/meshes/foot.stl")
    installed = write(tmp_path / "far/prefix/share/parts/meshes/foot.stl")
    monkeypatch.setenv(variable, f"/nowhere:{tmp_path / 'far' / folder}")
    expected = installed if variable == "AMENT_PREFIX_PATH" else mesh
    assert ResourceFinder(robot).find(uri) == expected


def test_given_folders_come_before_variables(
    robot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "ros/parts/foot.stl")
    given = write(tmp_path / "given/parts/foot.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    finder = ResourceFinder(robot, [str(tmp_path / "given")])
    assert finder.find("package://parts/foot.stl") == given


def test_the_longest_end_of_a_path_wins(tmp_path: Path) -> None:
    urdf = write(tmp_path / "robot.urdf")
    write(tmp_path / "a/b/meshes/leg.stl")
    right = write(tmp_path / "a/deep/down/spider/meshes/leg.stl")
    assert ResourceFinder(urdf).find("package://spider/meshes/leg.stl") == right


def test_the_folder_with_the_robots_name_is_preferred(tmp_path: Path) -> None:
    """Several robots in one folder do not take each other's meshes."""
    urdf = write(tmp_path / "spider.urdf")
    write(tmp_path / "beetle.urdf")
    write(tmp_path / "meshes/beetle/pkg/meshes/shell.stl")
    write(tmp_path / "meshes/aaa/pkg/meshes/leg.stl")
    right = write(tmp_path / "meshes/spider/pkg/meshes/leg.stl")
    finder = ResourceFinder(urdf)
    assert finder.find("package://pkg/meshes/LEG.STL") == right
    assert finder.find("package://pkg/meshes/shell.stl") is None
    found = ResourceFinder(tmp_path / "beetle.urdf").find("package://pkg/meshes/shell.stl")
    assert found == tmp_path / "meshes/beetle/pkg/meshes/shell.stl"


def test_a_mere_file_name_must_be_the_only_one(tmp_path: Path) -> None:
    urdf = write(tmp_path / "robot.urdf")
    only = write(tmp_path / "x/shell.stl")
    write(tmp_path / "x/leg.stl"), write(tmp_path / "y/leg.stl")
    finder = ResourceFinder(urdf)
    assert finder.find("package://p/meshes/shell.stl") == only
    assert finder.find("package://p/meshes/leg.stl") is None


@pytest.mark.parametrize(
    "uri",
    ["", "  ", "\0", "a\0b.stl", "file:///%00", "x" * 100_000, "a/" * 2000 + "b.stl", "..", "/",
     "package://", "package:///", "package://../x", "$(find )", "$(find x", "://", "\udcff.stl",
     "http://[::1/x.stl", "file://%zz", "C:", "~", "*", "package://" + "n" * 300 + "/m.stl"],
)  # fmt: skip
def test_odd_names_are_not_found_with_a_reason(robot: Path, uri: str) -> None:
    finder = ResourceFinder(robot)
    assert finder.find(uri) is None
    assert len(finder.why(uri)) > 20 and len(finder.why(uri)) < 20_000


def test_why_names_what_was_tried_and_a_remedy(robot: Path) -> None:
    why = ResourceFinder(robot).why("package://claws/meshes/claw.stl")
    assert "package 'claws'" in why and "package_path=[...]" in why
    assert str(robot.parents[1] / "meshes/claw.stl") in why
    assert "network" in ResourceFinder(robot).why("https://example.org/claw.stl")


def test_links_without_end_and_large_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Links of folders are not followed; the number of entries read is limited, nearest first."""
    urdf = write(tmp_path / "robot.urdf")
    (tmp_path / "loop").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "self.stl").symlink_to(tmp_path / "self.stl")
    finder = ResourceFinder(urdf)
    assert finder.find("package://p/loop/loop/none.stl") is None
    assert finder.find("self.stl") is None
    for number in range(30):
        write(tmp_path / f"folder/file{number}.stl")
    near = write(tmp_path / "folder/near.stl")
    write(tmp_path / "folder/further/far.stl")
    monkeypatch.setattr("hexapod_pin.robot.reading.folder_index.MAX_INDEX_ENTRIES", 36)
    paths = FolderIndex(tmp_path).paths
    assert ("folder", near.name) in paths and len(paths) <= 36
    assert ("folder", "further", "far.stl") not in paths
