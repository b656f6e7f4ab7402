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
        "package://spider/meshes/leg%20one.stl",
        "PACKAGE://spider/meshes/LEG ONE.STL",
        "package:\\\\spider\\meshes\\leg one.stl",
        "file://$(find spider)/meshes/leg one.stl",
        "model://folder/meshes/leg one.stl",
        "..\\meshes\\leg one.stl",
        "./meshes//leg one.stl",
        "file:///home/somebody/ws/src/spider/meshes/leg%20one.stl",
        "C:\\Users\\somebody\\spider\\meshes\\Leg One.STL",
        "package://another/meshes/leg one.stl",
        "package://spider/meshes/leg one.dae",
    ],
)
def test_every_form_of_a_name(robot: Path, uri: str) -> None:
    found = ResourceFinder(robot).find(uri)
    assert found is not None, ResourceFinder(robot).why(uri)
    assert found.samefile(robot.parents[1] / "meshes/leg one.stl")


def test_what_was_assumed_is_noted(robot: Path, tmp_path: Path) -> None:
    mesh = write(tmp_path / "elsewhere/a#b.stl")
    finder = ResourceFinder(robot)
    assert finder.find(str(mesh)) == finder.find(mesh.as_uri()) == mesh
    assert finder.note(str(mesh)) == ""
    assert "end of its path" in finder.note("C:\\x\\meshes\\leg one.stl")
    assert "in place of leg one.dae" in finder.note("package://spider/meshes/leg one.dae")
    other = write(robot.parents[1] / "meshes/leg one.dae")  # itself comes before a stand-in
    assert ResourceFinder(robot).find("package://spider/meshes/leg one.dae").samefile(other)


def test_packages_beside_and_above(robot: Path, tmp_path: Path) -> None:
    beside = write(tmp_path / "src/parts/meshes/foot.stl")
    renamed = write(package(tmp_path / "src/checkout-2", "claws") / "meshes/claw.stl")
    finder = ResourceFinder(robot)
    assert finder.find("package://parts/meshes/foot.stl") == beside
    assert finder.find("package://claws/meshes/claw.stl") == renamed
    assert finder.package("nothing") is None
    elsewhere = ResourceFinder(write(tmp_path / "other/a.urdf"), [tmp_path])  # a workspace
    assert elsewhere.find("package://claws/meshes/claw.stl") == renamed


@pytest.mark.parametrize(
    ("variable", "folder", "scheme"),
    [
        ("", "opt", "package"),  # a folder of packages that is given
        ("", "opt/parts", "package"),  # the package itself
        ("ROS_PACKAGE_PATH", "opt", "package"),
        ("AMENT_PREFIX_PATH", "prefix", "package"),
        ("IGN_GAZEBO_RESOURCE_PATH", "opt/parts", "model"),
    ],
)
def test_packages_elsewhere(
    robot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable, folder, scheme
) -> None:
    mesh = write(tmp_path / "far/opt/parts/meshes/foot.stl")
    installed = write(tmp_path / "far/prefix/share/parts/meshes/foot.stl")
    expected, uri = installed if folder == "prefix" else mesh, f"{scheme}://parts/meshes/foot.stl"
    assert ResourceFinder(robot).find(uri) is None
    if variable:
        monkeypatch.setenv(variable, f"/nowhere:{tmp_path / 'far' / folder}")
        assert ResourceFinder(robot).find(uri) == expected
        folder, expected = "given", write(tmp_path / "far/given/parts/meshes/foot.stl")
    assert ResourceFinder(robot, [tmp_path / "far" / folder]).find(uri) == expected  # comes first


def test_a_mere_file_name_must_be_the_only_one(tmp_path: Path) -> None:
    urdf = write(tmp_path / "robot.urdf")
    only = write(tmp_path / "x/shell.stl")
    write(tmp_path / "x/leg.stl"), write(tmp_path / "y/leg.stl")
    finder = ResourceFinder(urdf)
    assert finder.find("package://p/meshes/shell.stl") == only
    assert finder.find("package://p/meshes/leg.stl") is None
    right = write(tmp_path / "z/deep/p/meshes/leg.stl")  # the longest end of the path
    assert ResourceFinder(urdf).find("package://p/meshes/leg.stl") == right


@pytest.mark.parametrize(
    "uri", ["", "a\0b.stl", "file:///%00", "x" * 100_000, "/", "package://../x", "$(find x", "~"]
)
def test_odd_names_are_not_found_with_a_reason(robot: Path, uri: str) -> None:
    finder = ResourceFinder(robot)
    assert finder.find(uri) is None and 20 < len(finder.why(uri)) < 20_000
    why = finder.why("package://claws/meshes/claw.stl")
    assert "package 'claws'" in why and "package_path=[...]" in why


def test_several_robots_in_one_folder_and_links_without_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They do not take each other's meshes; entries are limited, nearest first."""
    urdf = write(tmp_path / "spider.urdf")
    write(tmp_path / "beetle.urdf")
    write(tmp_path / "meshes/beetle/pkg/meshes/shell.stl")
    right = write(tmp_path / "meshes/spider/pkg/meshes/leg.stl")
    (tmp_path / "loop").symlink_to(tmp_path, target_is_directory=True)
    finder = ResourceFinder(urdf)
    assert finder.find("package://pkg/meshes/LEG.STL") == right
    assert finder.find("package://pkg/meshes/shell.stl") is None
    assert finder.find("package://p/loop/loop/none.stl") is None
    for number in range(30):
        write(tmp_path / f"meshes/file{number}.stl")
    monkeypatch.setattr("hexapod_pin.robot.reading.folder_index.MAX_INDEX_ENTRIES", 36)
    paths = FolderIndex(tmp_path).paths
    assert len(paths) <= 36 and ("meshes", "spider", "pkg", "meshes", "leg.stl") not in paths
