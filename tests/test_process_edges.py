"""A command as a process: closed streams, little memory, no threads, no folder, signals."""

from __future__ import annotations

import errno
import itertools
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.commands import resources
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ResourceError, ViewerError
from hexapod_pin.view.html import view
from tests.sweep_studies import write_study_file

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
    return done.stderr.count("\n") == 1 and done.stderr.startswith("hexapod-pin: ")


def test_closed_streams_are_no_matter(tmp_path: Path) -> None:
    """No file gets the number of a closed one: what a library prints would go into a result."""
    assert process(WALK, tmp_path, "exec <&- >&- 2>&-").returncode == 0
    assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.1)
    done = process(["check", "none"], tmp_path, "exec <&- >&-")
    assert (done.returncode, done.stdout) == (2, "") and one_line(done)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_stream_costs_no_file(tmp_path: Path) -> None:
    with open("/dev/full", "w") as full:
        done = process(WALK, tmp_path, stdout=full)
    assert done.returncode == 2
    assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.1)
    assert done.stderr.endswith("<stdout>: cannot be written (No space left on device).\n")


def test_a_working_folder_that_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Help needs none."""
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    for words in (["walk", "kharagpur"], ["compare", "/a.toml"], ["budget", "walk.nc"]):
        with pytest.raises(SystemExit) as left:
            main(words)
        out, err = capsys.readouterr()
        assert (left.value.code, out) == (2, "")
        assert err.startswith("hexapod-pin: working folder") and err.count("\n") == 1
    with pytest.raises(SystemExit) as left:
        main(["walk", "--help"])
    assert left.value.code == 0 and capsys.readouterr().out


def _refuse(*_: object) -> None:
    raise RuntimeError("can't start new thread")


def test_threads_are_looked_for_before_libraries_are_loaded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with monkeypatch.context() as lacking:
        lacking.setattr(threading.Thread, "start", _refuse)
        with refused(ViewerError, about=("thread",)):
            view(synthetic_trace(duration=0.1), duration=0.0, open_browser=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(128), raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 128)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    for given, most in (("x", 63), ("3", 2)):  # as many as linear algebra starts
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
        assert resources._workers() == most
    monkeypatch.delitem(sys.modules, "numpy")
    resources.require_resources()
    monkeypatch.setattr(threading.Thread, "start", _refuse)
    with refused(ResourceError, "threads"):
        resources.require_resources()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are the system's own")
def test_what_is_lacking_has_a_name(tmp_path: Path) -> None:
    """In the middle of a command, too: one line."""
    for error, name in (
        (OSError(errno.ENOMEM, "x"), "memory"),
        (ImportError("a.so: failed to map segment from shared object"), "memory"),
        (RuntimeError("can't start new thread"), "threads"),
        (OSError(errno.EMFILE, "x"), "open files"),
        (OSError(errno.ENOENT, "x"), None),
        (ImportError("no module"), None),
    ):
        found = resources.lack_of(error)
        assert (None if found is None else found.name) == name
    late = "import hexapod_pin.commands.process as process\ndef none(argv): raise MemoryError\n"
    done = process([], tmp_path, code=f"{late}process.main = none\nmain([])")
    assert done.returncode == 2 and one_line(done) and "memory" in done.stderr
    done = process(WALK, tmp_path, "ulimit -v 100000")
    assert done.returncode == 2 and one_line(done) and "memory" in done.stderr
    assert not list(tmp_path.iterdir())
    # copies of OpenBLAS asked for memory for ever while they were loaded
    done = process(["verify", "--only", "gait-form"], tmp_path, "ulimit -v 490000; ulimit -t 20")
    assert done.returncode == 0 or (done.returncode == 2 and one_line(done))


SIGNALLED = """
import os, signal
from contextlib import contextmanager
for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(each, signal.SIG_DFL)
number, least = int(sys.argv.pop(1)), 0.1 if "walk" in sys.argv else 0.0
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


LONG = {
    "walk": ["walk", "kharagpur", "--gait", "tripod", "--duration", "3", "--quick", "--no-html"],
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
    """Each is sent one of them; what was done of a walk is kept."""
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=0.1)
    for path in ("case.toml", "other.toml"):
        case.save(tmp_path / path)
    write_study_file(tmp_path, 2)
    done = process([str(int(number)), *LONG[name]], tmp_path, code=SIGNALLED)
    assert done.returncode == 128 + number and one_line(done)
    if name == "walk":
        assert "done so far are in" in done.stderr
        assert 0.0 < hp.load_trace(tmp_path / "walk.nc").time[-1] < 3.0


PLAIN = """
import os, signal, time
from hexapod_pin import stop_signals as s
number = int(sys.argv[1])
def send(): os.kill(os.getpid(), number)
signal.signal(signal.SIGINT, signal.default_int_handler)
for each in (signal.SIGTERM, signal.SIGHUP):  # which this process may ignore
    signal.signal(each, signal.SIG_DFL)
"""


def run(code: str, number: int) -> subprocess.CompletedProcess[str]:
    return process([str(int(number))], ROOT, code=PLAIN + code)


def test_before_a_command_begins_the_process_ends_at_once() -> None:
    done = run("s.install(); send(); time.sleep(5)", signal.SIGINT)
    assert (done.returncode, done.stderr) == (
        128 + signal.SIGINT, "hexapod-pin: interrupted before anything was run\n",
    )  # fmt: skip
    code = "signal.signal(number, signal.SIG_IGN); s.install(); send(); print('here')"
    assert run(code, signal.SIGHUP).stdout == "here\n"  # one that is ignored stays ignored


def test_a_section_is_not_cut_and_a_second_signal_does_nothing() -> None:
    code = """
s.install(); s.begin()
try:
    with s.unbroken():
        s.check_stop()
        send(); send()
        print("whole")
    print("not reached")
except KeyboardInterrupt:
    print("stopped")
    send()
    print("saved")
"""
    assert run(code, signal.SIGTERM).stdout == "whole\nstopped\nsaved\n"


def test_a_signal_that_is_swallowed_comes_again() -> None:
    code = """
s.install(); s.begin()
class Swallows:
    def __del__(self): send(); time.sleep(0.01)
try:
    Swallows()
    time.sleep(5)
except KeyboardInterrupt as stop:
    print("again", stop.number)
"""
    done = run(code, signal.SIGTERM)
    assert (done.stdout, done.stderr) == (f"again {int(signal.SIGTERM)}\n", "")


def test_a_library_leaves_handlers_alone() -> None:
    code = """
before = [signal.getsignal(n) for n in s.SIGNALS]
import hexapod_pin.commands.app
with s.unbroken():
    s.begin(); s.end(); s.check_stop()
print(before == [signal.getsignal(n) for n in s.SIGNALS], s.received())
"""
    assert run(code, 0).stdout == "True None\n"


def test_a_reader_that_goes_away_leaves_a_command_to_its_end(tmp_path: Path) -> None:
    """As of `hexapod-pin walk ... | head -1`."""
    with subprocess.Popen(
        [sys.executable, "-m", "hexapod_pin", *WALK], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:  # fmt: skip
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline()
        process.stdout.close()
        err = process.stderr.read()
        assert (process.wait(), err) == (0, "")
    assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.1)


def test_a_signal_that_is_taken_for_the_end_is_reported() -> None:
    """As by `view`, or where a destructor swallows it and the command is done before it is back."""
    code = """
from hexapod_pin.commands import process
def all_but_done(argv):
    s.begin()
    try:
        send()
    except KeyboardInterrupt:
        sys.exit(0)
process.main = all_but_done
s.install()
process.run_process([])
"""
    done = run(code, signal.SIGTERM)
    assert done.returncode == 128 + signal.SIGTERM
    said = "stop requested at the end of the command; its work is done"
    assert done.stderr == f"hexapod-pin: {said}\n"
    assert (run(code, signal.SIGINT).returncode, done.stdout) == (0, "")


def test_nothing_cuts_the_end() -> None:
    """Neither the last message nor the end of the interpreter."""
    code = """
s.install(); s.begin()
import atexit
atexit.register(send)
s.end(); send()
sys.exit(3)
"""
    done = run(code, signal.SIGTERM)
    assert (done.returncode, done.stderr) == (3, "")
