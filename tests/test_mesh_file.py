"""Meshes are read in metres, with their colour, or refused by name."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.errors import MeshError, ParameterError
from hexapod_pin.robot.reading import Mesh, mesh_file, read_mesh
from hexapod_pin.robot.reading.mesh_file import MeshCache

# A tetrahedron with edges 1, 2, 3 from the origin; faces anticlockwise from outside: volume 1.
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
FILES = ["ascii.stl", "binary.STL", "plain.obj", "plain.dae", "plain.ply", "plain.glb"]


def binary_stl(bits: list[int], header: bytes = b"", corners: np.ndarray = CORNERS) -> bytes:
    rows = [
        struct.pack("<12fH", 0, 0, 0, *corners[face].ravel(), bit)
        for face, bit in zip(FACES, bits, strict=True)
    ]
    return header.ljust(80) + struct.pack("<I", len(rows)) + b"".join(rows)


def collada(unit: str = "", up: str = "Z_UP", color: str = "0.2 0.4 0.6 1") -> str:
    numbers = " ".join(map(str, CORNERS.ravel()))
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01</created><modified>2020-01-01</modified>{unit}
<up_axis>{up}</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert><diffuse>
<color>{color}</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="12">{numbers}</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4" material="s"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{" ".join(map(str, FACES.ravel()))}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><translate>0 0 10</translate>
<instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry>
</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#w"/></scene></COLLADA>"""


def write(folder: Path, name: str) -> Path:
    path = folder / name
    if name == "binary.STL":
        path.write_bytes(binary_stl([0] * 4, b"solid part"))
    elif name == "plain.dae":
        path.write_text(collada().replace("<translate>0 0 10</translate>", ""))
    elif name == "plain.obj":
        lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
        path.write_text("\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]))
    else:
        import trimesh

        kind = "stl_ascii" if name == "ascii.stl" else path.suffix[1:]
        trimesh.Trimesh(CORNERS, FACES, process=False).export(path, file_type=kind)
    return path


def volume(mesh: Mesh) -> float:
    """Positive where the faces look outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_body(tmp_path: Path, name: str) -> None:
    """A negative scale mirrors, and faces still look outwards."""
    mesh = read_mesh(write(tmp_path, name))
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [1, 2, 3]], atol=1e-7)
    assert volume(mesh) == pytest.approx(1.0, abs=1e-6)
    assert np.array_equal(np.unique(mesh.vertices, axis=0), np.unique(CORNERS, axis=0))
    assert mesh.vertices.shape[1:] == mesh.faces.shape[1:] == (3,) and mesh.note == ""
    mesh = read_mesh(write(tmp_path, name), (0.001, -0.002, 0.003))
    np.testing.assert_allclose(mesh.bounds, [[0, -0.004, 0], [0.001, 0, 0.009]], atol=1e-9)
    assert volume(mesh) == pytest.approx(6e-9, rel=1e-6)
    twice = read_mesh(tmp_path / name, (-1.0, -1.0, 1.0))
    assert volume(twice) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("unit", "up", "length"),
    [
        ('<unit name="meter" meter="1"/>', "Y_UP", 1.0),
        ("<unit meter='1e-3' name='mm'/>", "Y_UP", 0.001),
        ('<unit name="inch" meter="0.0254"/>', "X_UP", 0.0254),
    ],
)
def test_collada_has_its_unit_applied_and_keeps_its_axes(tmp_path, unit, up, length):
    """As RViz and Gazebo show it: <up_axis> turns nothing. The node's place is in the unit too."""
    path = tmp_path / "part.dae"
    path.write_text(collada(unit, up))
    mesh = read_mesh(path)
    np.testing.assert_allclose(mesh.bounds, np.array([[0, 0, 10], [1, 2, 13]]) * length, rtol=1e-6)
    assert mesh.color == pytest.approx((0.2, 0.4, 0.6, 1.0), abs=0.5 / 255)
    assert (mesh.note == "") == (length == 1.0)


def test_colors_of_materials_are_weighed_by_area_and_a_texture_counts_with_its_mean(
    tmp_path: Path,
) -> None:
    """One face green, three red and blue in half: over the area, as one sees it."""
    from PIL import Image

    image = Image.new("RGB", (2, 1), (255, 0, 0))
    image.putpixel((1, 0), (0, 0, 255))
    image.save(tmp_path / "skin.png")
    skin = "newmtl skin\nKd 1 1 1\nmap_Kd skin.png\n"
    (tmp_path / "part.mtl").write_text(f"newmtl green\nKd 0 1 0\nd 0.5\n{skin}")
    lines = ["mtllib part.mtl", *(f"v {x} {y} {z}" for x, y, z in CORNERS), "usemtl green"]
    lines += ["vt 0 0", "vt 1 0", "vt 0 1"]
    for number, (a, b, c) in enumerate(FACES):
        lines += ["usemtl skin"] if number == 1 else []
        lines.append(f"f {a + 1}/1 {b + 1}/2 {c + 1}/3")
    path = tmp_path / "part.obj"
    path.write_text("\n".join(lines))
    color = read_mesh(path).color
    assert color is not None
    assert color[:3] == pytest.approx((4.0 / 9.0, 1.0 / 9.0, 4.0 / 9.0), abs=0.01)


RED_5, BLUE_5 = 31, 31 << 10


@pytest.mark.parametrize(
    ("bits", "header", "color"),
    [
        ([0] * 4, b"", None),
        ([0x8000 | BLUE_5] * 4, b"", (1.0, 0.0, 0.0)),  # VisCAM: red in the highest bits
        ([0x8000 | RED_5, 0, 0, 0], b"", (0.0, 0.0, 1.0)),  # only marked triangles count
        ([RED_5] * 4, b"COLOR=\x00\xff\x00\xff", (1.0, 0.0, 0.0)),  # Magics: red in the lowest
        ([RED_5, 0x8000, 0x8000, 0x8000], b"COLOR=\x00\xff\x00\xff", (1 / 9, 8 / 9, 0.0)),
        ([0] * 4, b"COLOR=\x33\x33\x33 MATERIAL=", (0.2, 0.2, 0.2)),
    ],
)
def test_colors_of_binary_stl(tmp_path, bits, header, color):
    path = tmp_path / "part.stl"
    path.write_bytes(binary_stl(bits, header))
    found = read_mesh(path).color
    assert found == (None if color is None else pytest.approx((*color, 1.0), abs=1e-6))


@pytest.mark.parametrize(
    ("name", "data", "about"),
    [
        ("none.stl", None, ("opened",)),
        ("empty.stl", b"", ("triangles", "STL")),  # which of the two is trimesh's affair
        ("short.stl", binary_stl([0] * 4)[:-7], ("triangles", "STL")),
        ("wide.dae", "<!DOCTYPE x [<!ENTITY a 'b'>]><COLLADA/>".encode("utf-16"), ("DOCTYPE",)),
        ("unit.dae", collada('<unit meter="0"/>').encode(), ("<unit meter",)),
        ("none.obj", b"v 0 0 0\n", ("triangles", "OBJ")),
        ("nan.stl", binary_stl([0] * 4, corners=CORNERS * np.nan), ("(nan, nan, nan)",)),
        ("part.step", b"ISO-10303-21;", (".stl, .dae",)),
    ],
)
def test_unusable_files_are_refused_by_name(tmp_path, name, data, about):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with refused(MeshError, file=str(tmp_path / name), about=(name,)) as caught:
        read_mesh(tmp_path / name)
    assert any(text in caught.value.reason for text in about)


def test_limits_of_size_and_scale(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, "binary.STL")
    monkeypatch.setattr(mesh_file, "MAX_MESH_FACES", 3)
    with refused(MeshError, file=str(path), about=("4", "triangles", "3")):
        read_mesh(path)
    for scale in ((1, 1), (1, 0, 1), (1, np.nan, 1)):
        with refused(ParameterError, "mesh scale", scale):
            read_mesh(path, scale)
    monkeypatch.setattr("hexapod_pin.robot.reading.mesh_file.MAX_MESH_BYTES", 100)
    with refused(MeshError, file=str(path), about=("284", "100")):
        read_mesh(path)


def test_a_file_is_read_again_when_it_changes(tmp_path: Path) -> None:
    path = write(tmp_path, "binary.STL")
    first = read_mesh(path)
    assert read_mesh(str(path)) is first and not first.vertices.flags.writeable
    assert read_mesh(path, (2, 2, 2)) is not first
    path.write_bytes(binary_stl([0] * 4, corners=2.0 * CORNERS))
    os.utime(path, ns=(1, 1))
    assert read_mesh(path).bounds[1] == pytest.approx([2, 4, 6])
    cache, made = MeshCache[str](max_bytes=10), []
    for key in ("a", "b", "a", "c", "a", "b"):
        cache.get(key, lambda key=key: made.append(key) or key, lambda value: 4)
    assert made == ["a", "b", "c", "b"] and cache.bytes == 8  # "b" went, least lately used
    assert cache.get("big", lambda: "big", lambda value: 11) == "big" and cache.bytes == 8
