"""SIGINT, SIGTERM and SIGHUP end a command with what is done saved, status 128 + n and one line."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import hexapod_pin as hp

ROOT = Path(hp.__file__).parents[1]
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]

PLAIN = """
import os, signal, sys, time
from hexapod_pin import stop_signals as s
number = int(sys.argv[1])
def send(): os.kill(os.getpid(), number)
signal.signal(signal.SIGINT, signal.default_int_handler)
for each in (signal.SIGTERM, signal.SIGHUP):  # which this process may ignore
    signal.signal(each, signal.SIG_DFL)
"""

WALK = """
import os, signal, sys
from contextlib import contextmanager
number, times = int(sys.argv[1]), int(sys.argv[2])
for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(each, signal.SIG_DFL)
import hexapod_pin.commands.progress as bars
whole = bars.progress_bar
@contextmanager
def interrupting(title):
    with whole(title) as bar:
        def progress(fraction):
            for _ in range(times if fraction > 0.0 else 0):
                os.kill(os.getpid(), number)
            bar(fraction)
        progress.stage = bar.stage
        yield progress
bars.progress_bar = interrupting
from hexapod_pin.__main__ import main
main(["walk", "kharagpur", "--gait", "tripod", "--stroke", "0.04", "--cycle-time", "0.3",
      "--duration", "3", "--quick", "--no-html"])
"""


def run(
    code: str, *options: object, folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, options)], capture_output=True, text=True,
        cwd=folder or ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, check=False, timeout=120,
    )  # fmt: skip


@pytest.mark.parametrize("number", SIGNALS)
def test_before_a_command_begins_the_process_ends_at_once(number: int) -> None:
    done = run(PLAIN + "s.install(); send(); time.sleep(5)", number)
    assert (done.returncode, done.stderr) == (
        128 + number, "hexapod-pin: interrupted before anything was run\n",
    )  # fmt: skip


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_is_a_keyboard_interrupt_that_knows_its_number(number: int) -> None:
    code = """
s.install(); s.begin()
try:
    send(); time.sleep(5)
except KeyboardInterrupt as stop:
    print(stop.number, s.received(), stop)
"""
    expected = f"{number} {number} {signal.Signals(number).name}\n"
    assert run(PLAIN + code, number).stdout == expected


def test_a_section_is_not_cut_and_a_second_signal_does_nothing() -> None:
    code = """
s.install(); s.begin()
try:
    with s.unbroken():
        send(); send()
        print("whole")
    print("not reached")
except KeyboardInterrupt:
    print("stopped")
    send()
    print("saved")
"""
    assert run(PLAIN + code, signal.SIGTERM).stdout == "whole\nstopped\nsaved\n"


def test_a_section_checks_for_a_signal_where_it_may_end() -> None:
    code = """
s.install(); s.begin()
with s.unbroken():
    s.check_stop()
    send()
    try:
        s.check_stop()
    except s.StopSignal as stop:
        print("requested", stop.number)
"""
    assert run(PLAIN + code, signal.SIGHUP).stdout == f"requested {int(signal.SIGHUP)}\n"


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
    done = run(PLAIN + code, signal.SIGTERM)
    assert (done.stdout, done.stderr) == (f"again {int(signal.SIGTERM)}\n", "")


def test_a_library_leaves_handlers_alone() -> None:
    code = """
before = [signal.getsignal(n) for n in s.SIGNALS]
import hexapod_pin.commands.app
with s.unbroken():
    s.begin(); s.end(); s.check_stop()
print(before == [signal.getsignal(n) for n in s.SIGNALS], s.received())
"""
    assert run(PLAIN + code, 0).stdout == "True None\n"


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    code = "signal.signal(number, signal.SIG_IGN); s.install(); send(); print('here')"
    assert run(PLAIN + code, signal.SIGHUP).stdout == "here\n"


@pytest.mark.parametrize(("number", "times"), [(signal.SIGTERM, 1), (signal.SIGHUP, 2)])
def test_a_walk_keeps_what_was_done(tmp_path: Path, number: int, times: int) -> None:
    done = run(WALK, number, times, folder=tmp_path)
    assert done.returncode == 128 + number
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("hexapod-pin: interrupted after ")
    assert "done so far are in" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["walk.nc"]
    assert 0.0 < hp.load_trace(tmp_path / "walk.nc").time[-1] < 3.0


def test_a_reader_that_goes_away_leaves_a_command_to_its_end(tmp_path: Path) -> None:
    """As of `hexapod-pin walk ... | head -1`."""
    options = ["walk", "kharagpur", "--gait", "tripod", "--stroke", "0.04", "--cycle-time", "0.3",
             "--duration", "0.9", "--quick", "--no-html", "--no-estimate"]  # fmt: skip
    with subprocess.Popen(
        [sys.executable, "-m", "hexapod_pin", *options], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline().startswith("kharagpur")
        process.stdout.close()
        err = process.stderr.read()
        assert (process.wait(), err) == (0, "")
    assert hp.load_trace(tmp_path / "walk.nc").time[-1] == pytest.approx(0.9)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_under_the_standard_output_is_one_line() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "hexapod_pin", "--version"], stdout=full, cwd=ROOT, check=False,
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == "hexapod-pin: <stdout>: cannot be written (No space left on device).\n"


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
    done = run(PLAIN + code, signal.SIGTERM)
    assert done.returncode == 128 + signal.SIGTERM
    assert (
        done.stderr == "hexapod-pin: stop requested at the end of the command; its work is done\n"
    )
    assert (run(PLAIN + code, signal.SIGINT).returncode, done.stdout) == (0, "")


def test_a_signal_while_a_command_ends_is_one_line() -> None:
    code = """
from hexapod_pin.commands import process
process.main, process._end = (lambda argv: sys.exit(0)), (lambda status: send())
s.install(); s.begin()
process.run_process([])
"""
    done = run(PLAIN + code, signal.SIGHUP)
    assert done.returncode == 128 + signal.SIGHUP
    assert (
        done.stderr == "hexapod-pin: stop requested at the end of the command; its work is done\n"
    )


def test_nothing_cuts_the_end() -> None:
    """Neither the last message nor the end of the interpreter."""
    code = """
s.install(); s.begin()
import atexit
atexit.register(send)
s.end(); send()
sys.exit(3)
"""
    done = run(PLAIN + code, signal.SIGTERM)
    assert (done.returncode, done.stderr) == (3, "")
