"""Files that a user names to be read: regular, of a stated size, read once, never waited for."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import (
    CatalogError,
    FileConflictError,
    HexapodError,
    ParameterError,
    UrdfError,
)
from hexapod_pin.robot.reading import read_mesh
from hexapod_pin.study.selection import load_motor_study
from hexapod_pin.user_file import declare_output, outputs_of_command, read_bytes, read_text

pytestmark = pytest.mark.timeout(60)

READERS: dict[str, tuple[Callable[[Path], object], str]] = {
    "robot": (hp.load_robot, ".urdf"), "xacro": (hp.load_robot, ".xacro"),
    "case": (hp.load_case, ".toml"), "study": (hp.load_sweep, ".toml"),
    "motor study": (load_motor_study, ".toml"), "catalogue": (hp.load_catalog, ".csv"),
    "trace": (hp.load_trace, ".nc"), "summary": (hp.load_summary, ".json"),
    "torque map": (hp.study.load_torque_map, ".nc"), "grids": (hp.study.load_study, ".nc"),
    "gait energy": (hp.study.load_gait_energy, ".nc"), "store": (hp.study.open_sweep, ".db"),
    "heights": (lambda path: hp.HeightField.from_csv(path, 0.1), ".csv"),
    "image": (lambda path: hp.HeightField.from_image(path, 0.1, 0.1), ".png"),
    "mesh": (read_mesh, ".stl"), "mesh of trimesh": (read_mesh, ".ply"),
}  # fmt: skip

KINDS: dict[str, Callable[[Path], object]] = {
    "pipe": os.mkfifo, "device": lambda path: path.symlink_to("/dev/zero"), "folder": Path.mkdir,
    "huge": lambda path: (path.touch(), os.truncate(path, 5_000_000_000)),
}  # fmt: skip


@pytest.mark.parametrize(
    ("reader", "kind"),
    [*((reader, "device") for reader in READERS), *(("robot", kind) for kind in KINDS)],
)
def test_what_is_no_regular_file_of_its_size_is_refused(reader, kind, tmp_path):
    """A device without end filled 22 GB of memory, and a pipe was waited for for ever."""
    read, ending = READERS[reader]
    path = tmp_path / f"x{ending}"
    KINDS[kind](path)
    with refused(HexapodError, about=(str(path),)):
        read(path)


def test_files_named_in_other_files(tmp_path: Path) -> None:
    """A study or a robot of a stranger names them; also those that are looked for unasked."""
    urdf = tmp_path / "r.urdf"
    urdf.write_text(hp.urdf_path("kharagpur").read_text(encoding="utf-8"))
    os.mkfifo(tmp_path / "r.hints.toml")
    with refused(ParameterError, "hints file", str(tmp_path / "r.hints.toml")):
        hp.load_robot(urdf)
    os.mkfifo(tmp_path / "package.xml")  # of the folder: looked at for the name of a package
    (tmp_path / "r.hints.toml").unlink()
    assert hp.load_robot(urdf).name == "kharagpur"
    os.mkfifo(tmp_path / "c.csv")
    text = f'schema = 1\n[base]\nrobot = "kharagpur"\n[motors]\ncatalog = "{tmp_path}/c.csv"\n'
    with refused(CatalogError, source=str(tmp_path / "c.csv"), line=0):
        hp.select_motors(text, tmp_path)
    xacro = tmp_path / "a.xacro"
    os.mkfifo(tmp_path / "b.xacro")
    xacro.write_text(
        '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="b.xacro"/></robot>'
    )
    with refused(UrdfError, source=str(xacro), about=(str(tmp_path / "b.xacro"),)):
        hp.load_robot(xacro)


def test_a_mesh_names_no_file_outside_its_folder(tmp_path: Path) -> None:
    """The buffer of a glTF file: a device, a pipe, a file elsewhere."""
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.bin").write_bytes(b"\0" * 4096)
    os.mkfifo(tmp_path / "in" / "pipe.bin")
    for uri in ("/dev/zero", "../secret.bin", "pipe.bin"):
        data = {
            "asset": {"version": "2.0"}, "buffers": [{"uri": uri, "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}], "scenes": [{"nodes": [0]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}],
        }  # fmt: skip
        (tmp_path / "in" / "a.gltf").write_text(json.dumps(data))
        with pytest.raises(hp.errors.MeshError):
            read_mesh(tmp_path / "in" / "a.gltf")


def test_the_size_is_bounded_whatever_size_a_file_claims(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x" * 100)
    assert read_bytes(path, 100) == b"x" * 100
    with refused(OSError, errno=errno.EFBIG, filename=str(path), about=("100", "99")):
        read_bytes(path, 99)
    with refused(OSError, errno=errno.EFBIG, filename="/proc/self/maps", about=("10",)):
        read_bytes("/proc/self/maps", 10)  # its stated size is 0
    with refused(ParameterError, "case file", str(path)):
        read_text(path, "case file", 99)


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.HoldPosture(), duration=0.01)


def test_a_file_that_its_writer_still_holds_is_read(trace: hp.Trace, tmp_path: Path) -> None:
    """The writer's lock outlives the rename by a moment: HDF5 refused such a file as damaged."""
    path = trace.save(tmp_path / "a.nc")
    with open(path, "rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert hp.load_trace(path).digest == trace.digest


SAVE_FOR_EVER = """
import sys, hexapod_pin as hp
trace = hp.load_trace(sys.argv[1])
print("begun", flush=True)
while True:
    trace.save(sys.argv[1])
"""


def test_a_trace_is_whole_while_another_process_saves_it(trace: hp.Trace, tmp_path: Path) -> None:
    """Of 945 reads beside a writer 8 were called damaged."""
    path = trace.save(tmp_path / "a.nc")
    with subprocess.Popen(
        [sys.executable, "-c", SAVE_FOR_EVER, str(path)], stdout=subprocess.PIPE
    ) as writer:
        assert writer.stdout is not None and writer.stdout.readline() == b"begun\n"
        try:
            assert {hp.load_trace(path).digest for _ in range(30)} == {trace.digest}
        finally:
            writer.kill()


def test_what_a_command_writes_it_does_not_read(tmp_path: Path) -> None:
    """Outside of a command nothing is kept in mind: `load_trace(p).save(p)` is a use."""
    path, other = tmp_path / "a", tmp_path / "b"
    path.write_text("x")
    os.link(path, other)
    declare_output("--out", path)
    assert read_bytes(path, 10) == b"x"
    with outputs_of_command():
        declare_output("--out", path)
        for name in (path, other):
            with pytest.raises(FileConflictError) as caught:
                read_bytes(name, 10)
            assert (caught.value.name, caught.value.value) == ("--out", str(path))
        with pytest.raises(FileConflictError):
            declare_output("--html", tmp_path / "." / "a")
    assert read_bytes(path, 10) == b"x"
