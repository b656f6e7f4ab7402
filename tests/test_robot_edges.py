"""Meshes and URDFs at the edges: no file crashes the interpreter, none takes cubic time."""

from __future__ import annotations

import cProfile
import inspect
import pstats
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from broken_urdfs import SOUND, NoMeshes, add, broken, put
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control import leg_clearance
from hexapod_pin.errors import MeshError, ParameterError, UrdfError
from hexapod_pin.robot.description.urdf_file import MAX_LINKS, parse_urdf, read_urdf
from hexapod_pin.robot.reading import read_mesh
from hexapod_pin.robot.reading.mesh_file import LARGEST_MESH
from hexapod_pin.robot.repair import find_all, repair_urdf
from hexapod_pin.robot.repair.measures import mesh_solid

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0], [1, 1, 1]])


def write_ply(path: Path, vertices: np.ndarray, faces: int | None = None) -> Path:
    count = max(len(vertices) - 2, 1) if faces is None else faces
    head = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    last = len(vertices) - 1
    rows = [" ".join(repr(float(x)) for x in row) for row in vertices]
    rows += [f"3 {min(k, last)} {min(k + 1, last)} {min(k + 2, last)}" for k in range(count)]
    path.write_text(head + "\n".join(rows) + "\n")
    return path


ODD_SETS = {
    "one point": (CORNERS[:1], "refused flat"),
    "three points": (CORNERS[:3], "read flat"),
    "four points": (CORNERS[:4], "read solid"),
    "in a plane": (np.c_[CORNERS[:, :2], np.zeros(5)], "read flat"),
    "nearly in a plane": (CORNERS * [1, 1, 1e-17], "read flat"),
    "denormal": (5e-324 * CORNERS, "refused flat"),
    "ten micrometres": (1e-5 * CORNERS, "read solid"),
    "largest": (LARGEST_MESH * CORNERS, "read solid"),
    "small and far away": (1e-3 * CORNERS + LARGEST_MESH / 2, "read solid"),
    "not a number": (CORNERS * [1, 1, np.nan], "refused flat"),
    "infinite": (np.where(CORNERS == 1, np.inf, 0.0), "refused flat"),
}


def judged(path: Path, scale: float) -> str:
    solid = "flat" if mesh_solid(path, np.full(3, scale)) is None else "solid"
    try:
        read_mesh(path, (scale,) * 3)
    except MeshError as error:
        assert error.file == str(path) and error.reason
        return f"refused {solid}"
    return f"read {solid}"


def test_odd_sets_of_points_are_refused_or_flat_and_crash_nothing(tmp_path: Path) -> None:
    """Flat sets have corners but no volume; sets without a size, or too large, are refused.

    Denormal coordinates beside ordinary ones, scaled by 1e300, ended in a segmentation fault.
    """
    for points, expected in ODD_SETS.values():
        assert judged(write_ply(tmp_path / "a.ply", points), 1.0) == expected
    for seed in range(100, 108):  # half of these crashed
        rng = np.random.default_rng(seed)
        powers = rng.uniform(-323, 0, (int(rng.integers(4, 60)), 3))
        path = write_ply(tmp_path / f"{seed}.ply", rng.standard_normal(powers.shape) * 10.0**powers)
        assert judged(path, 1e300) == "refused flat"


def test_no_vertices_and_scales_that_are_absurd_or_mirror(tmp_path: Path) -> None:
    """The product of small negative factors underflows; the faces are turned all the same."""
    with pytest.raises(MeshError):
        read_mesh(write_ply(tmp_path / "none.ply", CORNERS[:0], 0))
    path = write_ply(tmp_path / "a.ply", CORNERS)
    for factor in (-1e308, 1e-12):
        with refused(MeshError, file=str(path)) as caught:
            read_mesh(path, (factor,) * 3)
        assert "scale" in caught.value.reason and f"{LARGEST_MESH:g}" in caught.value.reason
        assert mesh_solid(path, np.full(3, factor)) is None
    path = write_ply(tmp_path / "b.ply", 1e150 * CORNERS)
    plain, mirrored = (read_mesh(path, (sign * 1e-150,) * 3) for sign in (1, -1))
    assert np.array_equal(mirrored.faces, plain.faces[:, ::-1])


@pytest.mark.parametrize("function", ["clearance", "lift"])
def test_clearance_as_far_as_a_ground_reaches_and_beyond(function: str) -> None:
    """On stairs the result was 1e9 m for a place at 1e12 m, or the minimum of an empty sequence."""
    for ground in (
        hp.Slope(angle=0.2),
        hp.Stairs(rise=0.1, run=0.3, count=5),
        hp.terrain.Ledge(height=0.1),
    ):
        measure = getattr(ground, function)
        for axis, value in enumerate((1e12, -1e12, 1.7e308)):
            point = np.zeros((1, 3))
            point[0, axis] = value
            with refused(ParameterError, f"points[0, {axis}]", value, about=("1e+06 m",)):
                measure(point, 0.1)
            with refused(ParameterError, "radii[1]", abs(value)):
                measure([[0, 0, 0], [0, 0, 1]], [0.1, abs(value)])
        for corner in np.array(np.meshgrid(*[(-1e6, 1e6)] * 3)).reshape(3, -1).T:
            assert np.isfinite(ground.clearance(corner, 0.1))
            up = ground.lift(corner, 0.1)
            assert ground.clearance(corner + [0, 0, up], 0.1) == pytest.approx(0.0, abs=1e-6)


WALK = hp.Gait.tripod(stroke=0.05, cycle_time=2.0)


@pytest.fixture(scope="module")
def plain() -> hp.Robot:
    return hp.load_robot("kharagpur")


@pytest.mark.parametrize(
    "shape",
    ['<box size="0.1 0.1 1e9"/>', '<cylinder radius="1e12" length="0.1"/>',
     '<sphere radius="1e300"/>'],
)  # fmt: skip
def test_shapes_of_absurd_size_are_dropped(tmp_path: Path, plain: hp.Robot, shape: str) -> None:
    """A cylinder of 1e12 m ended loading in a LinAlgError, a sphere of 1e300 m in "no limbs"."""
    geometry = f"<geometry>{shape}</geometry>"
    text = f"<visual>{geometry}</visual><collision>{geometry}</collision></link>"
    file = tmp_path / "a.urdf"
    file.write_text(SOUND.replace("</link>", text))
    robot = hp.load_robot(file)
    assert robot.legs == plain.legs
    assert {x.what for x in hp.robot.inspect(file).found} == {"unreadable shape"}
    distance = leg_clearance(plain, WALK).distance
    assert leg_clearance(robot, WALK).distance == pytest.approx(distance)
    assert find_all(repair_urdf(parse_urdf(file.read_bytes(), "a")).file, None) == []


def test_joints_at_absurd_places_are_refused_by_name() -> None:
    """At 1e12 m a foot was reported to lie 6e-05 m outside the reach of its leg."""
    for value in ("1e9", "nan"):
        file = broken(put("joint lf_femur_joint/origin", xyz=f"0 0 {value}"))
        (found,) = [x for x in find_all(file, None) if x.severity == "refused"]
        assert (found.what, found.where) == ("unreadable origin", "joint 'lf_femur_joint'")
        assert value in found.value and "1e+06 m" in found.rule


MASS = '<inertial><mass value="1e-3"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" ' \
       'iyz="0"/></inertial>'  # fmt: skip
MOVES = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="6"/>'
LONG: dict[str, tuple[Callable[[int], str], str]] = {
    "fixed in a row on a leg": (lambda k: f"x{k - 1}" if k else "lf_tibia", "fixed"),
    "fixed around the trunk": (lambda k: "base_link", "fixed"),
    "moved in a row": (lambda k: f"x{k - 1}" if k else "base_link", "revolute"),
    "on a loop": (lambda k: f"x{k - 1}" if k else "x9", "fixed"),
}


def long_file(kind: str, number: int) -> str:
    (parent, joint), parts = LONG[kind], []
    for k in range(number):
        parts.append(f'<link name="x{k}">{MASS}</link><joint name="jx{k}" type="{joint}">')
        parts.append(f'<parent link="{parent(k)}"/><child link="x{k}"/>')
        parts.append(f"{MOVES if joint == 'revolute' else ''}</joint>")
    return SOUND.replace("</robot>", "".join(parts) + "</robot>")


def load_check_repair(path: Path) -> None:
    with suppress(UrdfError):
        hp.load_robot(path)
    assert str(hp.robot.inspect(path))
    repair_urdf(read_urdf(path), NoMeshes())


@pytest.mark.slow
@pytest.mark.parametrize("kind", LONG)
def test_work_grows_with_the_number_of_links(tmp_path: Path, kind: str) -> None:
    """1000 links fixed in a row took 7.4 s: the work grew with the cube of their number."""
    work, path = [], tmp_path / "a.urdf"
    path.write_text(long_file(kind, 10))
    load_check_repair(path)  # imports do not count
    for number in (10, 20, 40):
        path.write_text(long_file(kind, number))
        with cProfile.Profile() as profile:
            load_check_repair(path)
        work.append(pstats.Stats(profile).total_calls)  # type: ignore[attr-defined]
    assert work[2] - work[1] < 2.02 * (work[1] - work[0]), work


@pytest.mark.parametrize("kind", ["fixed in a row on a leg", "moved in a row"])
def test_no_work_recurses_per_link(tmp_path: Path, kind: str) -> None:
    path, depth, number = tmp_path / "a.urdf", sys.getrecursionlimit(), 250
    path.write_text(long_file(kind, 10))
    load_check_repair(path)  # imports need more depth
    path.write_text(long_file(kind, number))
    sys.setrecursionlimit(min(depth, len(inspect.stack(0)) + number // 2))
    try:
        load_check_repair(path)
    finally:
        sys.setrecursionlimit(depth)


def test_as_many_links_as_are_read_and_more(tmp_path: Path, plain: hp.Robot) -> None:
    path = tmp_path / "a.urdf"
    path.write_text(long_file("fixed in a row on a leg", MAX_LINKS - 25))
    long = hp.load_robot(path)
    assert long.legs == plain.legs  # fixed links change nothing but the mass
    assert long.total_mass == pytest.approx(plain.total_mass + 1e-3 * (MAX_LINKS - 25))
    path.write_text(long_file("fixed in a row on a leg", MAX_LINKS + 1))
    with refused(UrdfError, source=str(path), about=(f"{MAX_LINKS}",)):
        hp.load_robot(path)


def test_limbs_on_a_link_fixed_to_the_root(tmp_path: Path) -> None:
    """Six limbs that are no six alike: refused by name; it ended in a KeyError."""
    top = (
        '<joint name="top_joint" type="fixed"><parent link="top"/><child link="base_link"/></joint>'
    )
    fixed = [put(f"joint {leg}_tibia_joint", type="fixed") for leg in ("lf", "lm", "lr")]
    file = broken(add("", '<link name="top"/>'), add("", top), *fixed)
    file.root.remove(file.root.find("hexapod_pin"))  # type: ignore[arg-type]
    path = tmp_path / "a.urdf"
    path.write_bytes(ET.tostring(file.root))
    limbs = ("rf_coxa_joint", "rm_coxa_joint", "rr_coxa_joint", "'top'")
    with refused(UrdfError, source=str(path), about=(*limbs, "4", "8", "legs=[...]")):
        hp.load_robot(path)
