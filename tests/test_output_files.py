"""Files that a command writes: none of its inputs, through no link, none lost with another."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.commands.output_files import PAGE_BYTES, least_sizes, require_room, written_files
from hexapod_pin.errors import MissingPackageError, TraceFileError

Run = Callable[..., SimpleNamespace]

WALK = ("--duration", "0.02", "--quick", "--no-estimate")

BASE = 'schema = 1\nbase = {robot = "kharagpur", duration = 10.0, accuracy = 1e-3}\n'
STUDY = BASE + 'vary = [{input = "mu", values = [0.5, 0.6]}]\n'
MOTORS = 'schema = 1\nbase = {robot = "kharagpur"}\nmotors = {catalog = "m.csv"}\n'


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "r.urdf").write_bytes(hp.urdf_path("kharagpur").read_bytes())
    scene = hp.Scene(hp.load_robot(folder / "r.urdf"))
    gait = hp.Gait.tripod(stroke=0.08, cycle_time=1.2)
    hp.Case(scene, hp.KinematicControl(gait), duration=0.02).save(folder / "c.toml")
    (folder / "c.json").write_bytes((folder / "c.toml").read_bytes())
    (folder / "r.hints.toml").write_text("foot_radius = 0.01\n")
    (folder / "s.toml").write_text(STUDY)
    (folder / "m.csv").write_text("model\n")
    (folder / "m.toml").write_text(MOTORS)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def inputs(tmp_path: Path, written: dict[str, bytes]) -> dict[str, bytes]:
    for name, content in written.items():
        (tmp_path / name).write_bytes(content)
    return written


OVERWRITING = [
    ("walk", "r.urdf", *WALK, "--no-html", "--save-case", "r.hints.toml"),
    ("run", "c.toml", "--out", "same.nc", "--html", "same.nc"),
    ("compare", "c.json", "c.toml", "--json", "c.json"),
    ("repair", "r.urdf", "-o", "r.urdf"),
    ("sweep", "s.toml", "--store", "s.toml"),
    ("select", "kharagpur", "m.toml", "--no-html", "--csv", "m.csv"),
]


@pytest.mark.parametrize("line", OVERWRITING, ids=" ".join)
def test_no_output_is_an_input(line: tuple[str, ...], inputs: dict[str, bytes], run: Run) -> None:
    """A page took the place of the robot's file, and the status was 0."""
    done = run(*line)
    assert done.status == 2 and done.err.startswith("hexapod-pin: "), done.err
    assert {name: Path(name).read_bytes() for name in done.left} == inputs


OUTPUTS = {
    "walk --out": ("walk", "kharagpur", *WALK, "--no-html", "--out", "x.nc"),
    "walk --save-case": ("walk", "kharagpur", *WALK, "--no-html", "--save-case", "x.toml"),
    "run --out": ("run", "c.toml", "--no-html", "--out", "x.csv"),
    "repair": ("repair", "r.urdf", "-o", "x.urdf"),
    "export": ("export", "--gait", "none", "kharagpur", "x.xml"),
    "contact": ("contact", "s1", "--out", "x.png"),
    "sweep --store": ("sweep", "s.toml", "--store", "x.db"),
    "sweep --plot": ("sweep", "s.toml", "--plot", "x.png"),
    "compare --json": ("compare", "c.toml", "--json", "x.json"),
    "select --html": ("select", "kharagpur", "--html", "x.html"),
    "verify": ("verify", "--only", "none", "--out", "x.md"),
    "bench": ("bench", "walk", "--out", "x.md"),
}
KINDS = ("link", "dangling link", "folder", "device")


@pytest.mark.parametrize(
    ("output", "kind"), [(output, KINDS[k % 4]) for k, output in enumerate(OUTPUTS)]
)
def test_an_output_is_a_file_of_its_own(output, kind, inputs, run, tmp_path) -> None:
    line, precious = OUTPUTS[output], tmp_path / "precious"
    place = tmp_path / line[-1]
    if kind == "link":
        precious.write_text("keys")
    if kind == "folder":
        place.mkdir()
    else:
        place.symlink_to("/dev/full" if kind == "device" else precious)
    before = place.lstat()
    done = run(*line)
    assert done.status == 2 and line[-1] in done.err, done.err
    assert place.lstat().st_ino == before.st_ino
    assert precious.exists() == (kind == "link")
    assert kind != "link" or precious.read_text() == "keys"
    assert set(done.left) <= {*inputs, place.name, "precious"}


@pytest.mark.parametrize("output", ["walk --out", "sweep --store", "sweep --plot"])
def test_a_hard_link_is_left_with_its_content(output, inputs, run, tmp_path) -> None:
    line, precious = OUTPUTS[output], tmp_path / "precious"
    precious.write_text("keys")
    os.link(precious, tmp_path / line[-1])
    done = run(*line)
    assert precious.read_text() == "keys"
    if output == "sweep --store":  # SQLite writes into a file: only into one that is a store
        assert done.status == 2 and precious.stat().st_nlink == 2
    else:
        assert done.status in (0, 3) and precious.stat().st_nlink == 1


def test_hints_take_the_place_of_nothing(inputs: dict[str, bytes], run: Run) -> None:
    Path("r.hints.toml").unlink()
    Path("r.hints.toml").symlink_to("nowhere")
    assert run("check", "r.urdf", "--write").status == 2 and not Path("nowhere").exists()


@pytest.mark.parametrize(
    "line", [OUTPUTS["select --html"], ("bench", "walk", "--plot", "x.png")], ids=" ".join
)
def test_a_missing_package_is_said_before_anything_runs(line, inputs, run, monkeypatch) -> None:
    """`select` ran for two minutes, and ended in a ModuleNotFoundError."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = run(*line)
    assert done.status == 2 and "hexapod-pin[plot]" in done.err and done.err.count("\n") == 1
    assert done.out == "" and done.left == sorted(inputs)
    with pytest.raises(MissingPackageError) as caught:
        hp.view.write_joint_torque_figure(synthetic_trace(duration=0.1), "a.png")
    assert (caught.value.name, caught.value.extra) == ("matplotlib", "plot")


def test_the_table_is_printed_though_no_file_can_be_written(run: Run, monkeypatch) -> None:
    """A trace that finds the disk full lost the torque table, too."""

    def full(*_: object) -> None:
        raise TraceFileError("the disk is full")

    monkeypatch.setattr(hp.Trace, "save", full)
    walk = ("walk", "kharagpur", "--cycle-time", "0.5", "--stroke", "0.02", "--duration", "1.6")
    done = run(*walk, "--quick", "--no-estimate", "--no-html", "--out", "walk.nc")
    assert done.status == 2 and "N m" in done.out and "the disk is full" in done.err


def test_a_page_is_left_where_the_trace_is_refused(inputs: dict[str, bytes], run: Run) -> None:
    with pytest.raises(TraceFileError) as caught, written_files() as files:
        for name in ("none/a", "b", "none/c"):
            files(lambda name=name: hp.load_case("c.toml").save(name))
    assert Path("b").exists() and str(caught.value).count("\n") == 1


def test_too_little_room_is_refused_before_the_run(tmp_path: Path, monkeypatch) -> None:
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=2.0)
    trace = case.run()
    files = (trace.save(tmp_path / "a.nc"), hp.view.write_html(trace, tmp_path / "a.html"))
    least = least_sizes(case, *files)
    assert all(0.0 < least[path] <= path.stat().st_size for path in files), least
    disk = SimpleNamespace(free=1.5 * PAGE_BYTES)
    monkeypatch.setattr("hexapod_pin.commands.output_files.shutil.disk_usage", lambda _: disk)
    require_room({tmp_path / "a": PAGE_BYTES})
    with refused(TraceFileError, about=(str(tmp_path / "b"), f"{2 * PAGE_BYTES}", f"{disk.free}")):
        require_room({tmp_path / "a": PAGE_BYTES, tmp_path / "b": PAGE_BYTES})


WRITING = {  # what users name, stores with their locks, and the null device for closed streams
    "atomic_file.py", "study/runs/store_guard.py", "study/runs/store_file.py",
    "study/runs/store_lock.py", "commands/process.py", "commands/resources.py",
    "user_file.py",  # reads, without waiting for a pipe
}  # fmt: skip

WRITES = re.compile(
    r"""\bopen\([^)\n]*["'](?:[wax]|r\+)|\bos\.(?:open|replace|link|rename|remove|symlink)\("""
    r"""|sqlite3\.connect\(|\.(?:write_text|write_bytes|mkdir|touch|symlink_to|hardlink_to)\("""
    r"""|\b(?:unlink|to_netcdf|mkfifo|rmtree|savez|mkstemp|mkdtemp)\("""
)


def test_files_are_opened_for_writing_in_these_places_alone() -> None:
    """What the hard cases and other engines write is in folders of their own making."""
    package = Path(hp.__file__).parent
    paths = {str(path.relative_to(package)): path for path in package.rglob("*.py")}
    found = {name for name, path in paths.items() if WRITES.search(path.read_text())}
    found = {name for name in found if not name.startswith(("benchmark/", "validation/"))}
    assert found == WRITING
