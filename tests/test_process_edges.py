"""A command as a process: closed streams, little memory, no threads, no folder."""

from __future__ import annotations

import errno
import fcntl
import itertools
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.commands import resources
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ResourceError, ViewerError
from hexapod_pin.view.html import view

ROOT = Path(hp.__file__).parents[1]

WALK = ["walk", "kharagpur", "--duration", "0.1", "--quick", "--no-html", "--no-estimate"]


def process(
    words: list[str], folder: Path, shell: str = "", code: str = "", **how: object
) -> subprocess.CompletedProcess[str]:
    """Run a command, or code, as a process of its own; `shell` changes what it is started with."""
    start = ["-c", code] if code else ["-m", "hexapod_pin"]
    if code:
        start[1] = f"import sys\nfrom hexapod_pin.__main__ import main\n{code}"
    return subprocess.run(
        ["bash", "-c", f'{shell}\nexec "$@"', "-", sys.executable, *start, *words],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True, check=False,
        timeout=120, **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **how},
    )  # type: ignore[call-overload, no-any-return]  # fmt: skip


def one_line(done: subprocess.CompletedProcess[str]) -> bool:
    """Tell whether stderr holds the one message of a command and nothing else."""
    return done.stderr.count("\n") == 1 and done.stderr.startswith("hexapod-pin: ")


def test_closed_streams_are_no_matter(tmp_path: Path) -> None:
    """The command is run, its files are written, its status is right."""
    words = ["repair", str(hp.urdf_path("kharagpur")), "--out", "repaired.urdf"]
    done = process(words, tmp_path, "exec 2>&-")
    assert done.returncode == 0 and "repaired.urdf" in done.stdout
    assert hp.load_robot(tmp_path / "repaired.urdf").legs == hp.load_robot("kharagpur").legs
    done = process(["check", "none"], tmp_path, "exec <&- >&-")
    assert (done.returncode, done.stdout) == (2, "") and one_line(done)


def test_a_walk_without_streams_is_written(tmp_path: Path) -> None:
    assert process(WALK, tmp_path, "exec <&- >&- 2>&-").returncode == 0
    assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.1)


def test_no_file_gets_the_number_of_a_closed_stream(tmp_path: Path) -> None:
    """Else what a library prints would go into a result."""
    code = """
import os
import hexapod_pin.commands.process as process
def writes(argv):
    with open("result", "w") as file:
        file.write("whole")
        for number in (1, 2):
            os.write(number, b"noise")
    sys.exit(0)
process.main = writes
main([])
"""
    done = process([], tmp_path, "exec <&- >&- 2>&-", code)
    assert (done.returncode, (tmp_path / "result").read_text()) == (0, "whole")


needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")


@needs_full
@pytest.mark.parametrize(("stream", "status"), [("stdout", 2), ("stderr", 0)])
def test_a_full_stream_costs_no_file(stream: str, status: int, tmp_path: Path) -> None:
    """What is computed is written; what is printed on a full stderr is lost."""
    with open("/dev/full", "w") as full:
        done = process(WALK, tmp_path, **{stream: full})
    assert done.returncode == status
    assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.1)
    if stream == "stdout":
        assert done.stderr.endswith("<stdout>: cannot be written (No space left on device).\n")


def test_a_slow_reader_of_a_pipe_that_does_not_wait(tmp_path: Path) -> None:
    """All reaches it, however little the pipe holds at a time."""
    code = """
import hexapod_pin.commands.process as process
from hexapod_pin.commands.terminal import echo
def prints(argv):
    for number in range(3):
        echo(str(number) * 100_000)
    sys.exit(0)
process.main = prints
main([])
"""
    reads, writes = os.pipe()
    fcntl.fcntl(writes, fcntl.F_SETFL, os.O_NONBLOCK)
    found: list[bytes] = []

    def read() -> None:
        while piece := os.read(reads, 30_000):
            found.append(piece)
            time.sleep(0.01)

    reader = threading.Thread(target=read)
    reader.start()
    done = process([], tmp_path, code=code, stdout=writes)
    os.close(writes)
    reader.join()
    os.close(reads)
    assert (done.returncode, done.stderr) == (0, "")
    assert b"".join(found) == b"".join(b"%d" % k * 100_000 + b"\n" for k in range(3))


def test_characters_that_an_encoding_lacks_are_escapes(tmp_path: Path) -> None:
    done = process(
        [], tmp_path, "export PYTHONIOENCODING=latin-1",
        "import hexapod_pin.commands.process as process\n"
        "from hexapod_pin.commands.terminal import echo\n"
        "process.main = lambda argv: (echo('\u6c49'), sys.exit(0))\n"
        "main([])",
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "\\u6c49\n", "")


COMMANDS = {
    "walk": ["walk", "kharagpur", "--duration", "0.1"],
    "run": ["run", "/case.toml"],
    "compare": ["compare", "/case.toml", "/case.toml"],
    "sweep": ["sweep", "study.toml"],
    "view": ["view", "walk.nc"],
    "budget": ["budget", "walk.nc"],
    "select": ["select", "kharagpur"],
    "stability": ["stability", "walk.nc"],
    "check": ["check", "kharagpur"],
    "repair": ["repair", "kharagpur", "--out", "repaired.urdf"],
    "export": ["export", "kharagpur", "x.xml"],
    "contact": ["contact", "kelvin-voigt"],
    "bench": ["bench", "stand"],
    "verify": ["verify", "--only", "gait-form"],
}


@pytest.fixture
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder that has been removed."""
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()


@pytest.mark.usefixtures("nowhere")
@pytest.mark.parametrize("name", list(COMMANDS))
def test_a_working_folder_that_is_gone(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(COMMANDS[name])
    out, err = capsys.readouterr()
    assert (left.value.code, out) == (2, "")
    assert err.startswith("hexapod-pin: working folder") and err.count("\n") == 1


def test_every_command_is_tried_there(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    listed = capsys.readouterr().out.partition("Commands:")[2].splitlines()
    assert {line.split()[0] for line in listed if line[2:3].strip()} == set(COMMANDS)


@pytest.mark.usefixtures("nowhere")
@pytest.mark.parametrize("words", [["--help"], ["walk", "--help"], ["--version"]])
def test_help_needs_no_folder(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(words)
    assert left.value.code == 0
    assert capsys.readouterr().out


def test_without_a_folder_a_process_says_one_line(tmp_path: Path) -> None:
    done = process(WALK, tmp_path, "mkdir gone; cd gone; rmdir ../gone")
    assert done.returncode == 2 and one_line(done)


def _refuse(*_: object) -> None:
    raise RuntimeError("can't start new thread")


def test_a_run_without_a_second_thread_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """The two runs whose difference is the error go one after the other."""
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.1)
    alone = case.run()
    monkeypatch.setattr(threading.Thread, "start", _refuse)
    again = case.run()
    assert again.summary.error_estimate == alone.summary.error_estimate is not None
    assert (again.q == alone.q).all()


def test_the_viewer_needs_a_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading.Thread, "start", _refuse)
    with refused(ViewerError, about=("thread",)):
        view(synthetic_trace(duration=0.1), duration=0.0, open_browser=False)


def test_a_process_without_threads_says_one_line(tmp_path: Path) -> None:
    """Before it loads the library that would send itself SIGINT, and afterwards."""
    code = """
import threading
from hexapod_pin.commands import resources
resources._workers = lambda: {}
def refuse(self):
    raise RuntimeError("can't start new thread")
threading.Thread.start = refuse
main(sys.argv[1:])
"""
    done = process(WALK, tmp_path, code=code.format(1))
    assert done.returncode == 2 and one_line(done) and "threads" in done.stderr
    sweep = tmp_path / "study.toml"
    sweep.write_text(STUDY)
    done = process(["sweep", "study.toml", "--processes", "2"], tmp_path, code=code.format(0))
    assert done.returncode == 2 and one_line(done) and "threads" in done.stderr


STUDY = """
schema = 1
[base]
robot = "kharagpur"
gait = "tripod"
duration = 0.1
[[vary]]
input = "mu"
values = [0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
"""


def test_threads_are_looked_for_before_libraries_are_loaded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "numpy")
    monkeypatch.setattr(resources, "_workers", lambda: 3)
    resources.require_resources()
    monkeypatch.setattr(threading.Thread, "start", _refuse)
    with refused(ResourceError, "threads"):
        resources.require_resources()


@pytest.mark.parametrize(("given", "most"), [("1", 0), ("3", 2), ("0", 63), ("x", 63), ("", 63)])
def test_as_many_threads_as_linear_algebra_starts(
    given: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(128), raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 128)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert resources._workers() == most


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are the system's own")
@pytest.mark.parametrize("size", [100_000, 400_000, 800_000])
def test_too_little_memory_is_one_line(size: int, tmp_path: Path) -> None:
    """Whatever the libraries do where they find too little; none of it costs a result."""
    done = process(WALK, tmp_path, f"ulimit -v {size}")
    if size > 500_000 and not done.returncode:
        assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.1)
        return
    assert done.returncode == 2 and one_line(done) and "memory" in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are the system's own")
@pytest.mark.parametrize("size", [200_000, 490_000])
def test_no_library_asks_for_memory_for_ever(size: int, tmp_path: Path) -> None:
    """Copies of OpenBLAS did, while they were loaded, and let no signal through."""
    limits = f"ulimit -v {size}; ulimit -t 20"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = process(["verify", "--only", "gait-form"], tmp_path, limits)
    assert done.returncode == 0 or (done.returncode == 2 and one_line(done))
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < 7.0  # 20 or 10 else


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are the system's own")
def test_help_needs_little_memory(tmp_path: Path) -> None:
    done = process(["walk", "--help"], tmp_path, "ulimit -v 200000")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("error", "name"),
    [
        (MemoryError(), "memory"),
        (OSError(errno.ENOMEM, "x"), "memory"),
        (ImportError("a.so: failed to map segment from shared object"), "memory"),
        (RuntimeError("can't start new thread"), "threads"),
        (OSError(errno.EMFILE, "x"), "open files"),
    ],
)
def test_what_is_lacking_has_a_name(error: Exception, name: str) -> None:
    found = resources.lack_of(error)
    assert found is not None and found.name == name


@pytest.mark.parametrize(
    "error", [OSError(errno.ENOENT, "x"), ImportError("no module"), RuntimeError("x"), KeyError(1)]
)
def test_other_errors_are_no_lack(error: Exception) -> None:
    assert resources.lack_of(error) is None


def test_memory_that_runs_out_is_one_line(tmp_path: Path) -> None:
    """In the middle of a command, and while its code is loaded."""
    late = "import hexapod_pin.commands.process as process\ndef none(argv): raise MemoryError\n"
    done = process([], tmp_path, code=f"{late}process.main = none\nmain([])")
    assert done.returncode == 2 and one_line(done) and "memory" in done.stderr
    early = (
        "class Finder:\n"
        "    def find_spec(name, *_):\n"
        "        if name == 'hexapod_pin.commands.process': raise MemoryError\n"
        "sys.meta_path.insert(0, Finder)\n"
    )
    done = process([], tmp_path, code=f"{early}main([])")
    assert done.returncode == 2 and one_line(done) and "memory" in done.stderr


SIGNALLED = """
import os, signal
from contextlib import contextmanager
for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(each, signal.SIG_DFL)
number, least = int(sys.argv.pop(1)), 0.43 if "motors.csv" in sys.argv else 0.0
import hexapod_pin.commands.progress as bars
def interrupting(whole):
    @contextmanager
    def bar(title, **how):
        with whole(title, **how) as found:
            def progress(fraction):
                if fraction >= least:
                    os.kill(os.getpid(), number)
                found(fraction)
            progress.stage = found.stage if "walk" in sys.argv else lambda title: progress
            progress.moved = 0.0
            yield progress
    return bar
bars.progress_bar, bars.time_left_bar = map(interrupting, (bars.progress_bar, bars.time_left_bar))
main(sys.argv[1:])
"""

MOTORS = """
model,voltage_V,stall_torque_Nm,no_load_speed_rad_s,mass_kg
A,12,4,6,0.08
B,12,6,6,0.1
""".lstrip()

LONG = {
    "select, one motor done": ["select", "kharagpur", "--no-html", "--catalog", "motors.csv"],
    "bench": ["bench", "stand", "--quick", "--rounds", "1", "--duration", "0.05"],
    "verify": ["verify", "--only", "gait-form,drift"],
    "compare": ["compare", "case.toml", "other.toml"],
    "sweep": ["sweep", "study.toml"],
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "number"),
    list(zip(LONG, itertools.cycle((signal.SIGTERM, signal.SIGINT, signal.SIGHUP)))),  # noqa: B905
)
def test_every_command_has_the_status_of_its_signal(name: str, number: int, tmp_path: Path) -> None:
    """Commands share what waits for signals: each is sent one of them.

    Walks are in tests/test_stop_signals.py.
    """
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.1)
    for path in ("case.toml", "other.toml"):
        case.save(tmp_path / path)
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "motors.csv").write_text(MOTORS)
    done = process([str(int(number)), *LONG[name]], tmp_path, code=SIGNALLED)
    assert done.returncode == 128 + number
    assert one_line(done)


def test_tests_have_ctrl_c_where_it_is_ignored() -> None:
    """As in background jobs and under `nohup`."""
    one = "tests/test_cli.py::test_ctrl_c_before_the_simulation"
    code = "import pytest; sys.exit(pytest.main(sys.argv[1:]))"
    done = process(["-q", "-p", "no:xdist", one], ROOT, "trap '' INT", code)
    assert done.returncode == 0, done.stdout
