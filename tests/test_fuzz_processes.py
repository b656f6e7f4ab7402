"""Commands as processes: a few odd ones, and faults planted for the campaign to find."""

from __future__ import annotations

import random
import signal
import sys
from pathlib import Path

import pytest
from fuzz import attempt, command_input, command_process
from fuzz.command_input import (
    COMMANDS,
    DEFAULT_OUTPUTS,
    CommandInput,
    draw,
    lay_down,
)
from fuzz.values import ESCAPE, FaultFound
from fuzz.watched_folder import HAZARDS, WatchedFolder

from hexapod_pin.errors import HexapodError

SEEDS = (4, 8, 13, 14)
"""Of a small sample; `make fuzz` takes them from the clock."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_odd_commands_end_as_documented_and_leave_others_files_alone(seed, monkeypatch):
    """However long they compute: a busy machine makes them slow, and the campaign looks at that."""
    monkeypatch.setattr(command_process, "PATIENCE", 300.0)
    monkeypatch.setattr(command_process, "LONGEST_WAIT", 600.0)
    outcome = attempt("command_process", seed)
    assert outcome.kind in ("used", "refused"), outcome.fault


def test_all_that_is_to_be_drawn_is_drawn_and_the_same_for_one_seed(tmp_path: Path):
    """Streams, environments, limits, folders, signals, taken names, hostile content, traps."""
    tree = WatchedFolder(tmp_path)
    found = [draw(random.Random(seed), tree) for seed in range(600)]
    again = [draw(random.Random(seed), tree) for seed in range(40)]
    assert [one.words for one in again] == [one.words for one in found[:40]]
    assert {one.words[0] for one in found} >= {command[0] for command in COMMANDS}
    assert {kind for one in found for kind in one.streams[1:]} > {"closed", "full", "terminal"}
    assert {name for one in found for name, _ in one.limits} >= {"FSIZE", "NOFILE", "AS"}
    assert {number for one in found for _, number, _ in one.signals} == {
        signal.SIGINT, signal.SIGTERM, signal.SIGHUP}  # fmt: skip
    words = {word for one in found for word in one.words}
    assert ESCAPE in "".join(words) and "/dev/zero" in words and set(HAZARDS) & words
    assert any(one.gone for one in found) and any(one.umask == 0o777 for one in found)
    assert sum(len(one.plants) for one in found) > 300
    assert {name for name, *_ in COMMANDS} >= set(DEFAULT_OUTPUTS)


def test_nothing_is_written_to_the_home_of_who_runs_the_campaign():
    """Without HOME, or with another, `~` is no folder of the tree."""
    for seed in range(300):
        one = CommandInput(["verify", "--out=~/x.md"])
        command_input._odd_process(one, random.Random(seed))
        assert "HOME" not in one.environment


def judged(script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, **given: object) -> str:
    """Return what is found of a script that runs in the place of a command; empty: nothing."""
    monkeypatch.setattr(command_process, "_program", lambda one: [sys.executable, "-c", script])
    monkeypatch.setattr("fuzz.command_input.sound_files", dict)
    tree = WatchedFolder(tmp_path / "tree")
    one = CommandInput(["walk"], **given)  # type: ignore[arg-type]
    one.named = {tree.work / name for name in ("out.nc", "out.csv", "hard.nc", "linked.nc")}
    if one.promised:
        one.promised = {tree.work / "out.nc"}
    lay_down(one, tree)
    try:
        command_process.judge(one, command_process.run(one, tree), tree)
    except FaultFound as fault:
        return str(fault)
    except HexapodError:
        return "refused"
    return ""


SOUND = {
    "a named file": ("open('out.nc', 'w').write('a')", ""),
    "a named file that is one of two names": (
        "import os; open('.a', 'w').write('a'); os.replace('.a', 'hard.nc')", ""),
    "a refusal": ("import sys; sys.exit(2)", "refused"),
}  # fmt: skip


@pytest.mark.parametrize(("script", "wanted"), SOUND.values(), ids=list(SOUND))
def test_what_is_sound_is_no_fault(script, wanted, tmp_path, monkeypatch):
    assert judged(script, tmp_path, monkeypatch) == wanted


PLANTED = {
    "overwrites": (
        "open('../foreign/precious', 'w').write('1234')",
        "foreign/precious (size, modified, content)",
    ),
    "through a link that it was to write": (
        "open('linked.nc', 'w').write('a')", "foreign/precious.nc ("),
    "in place of a link": (
        "import os; os.unlink('linked.nc'); open('linked.nc', 'w')", "work/linked.nc ("),
    "removes": ("import os; os.unlink('../home/.profile')", "home/.profile (is gone)"),
    "changes a mode": ("import os; os.chmod('notes.txt', 0o777)", "work/notes.txt (mode)"),
    "a temporary file elsewhere": (
        "import os; open(os.environ['TMPDIR'] + '/a', 'w')",
        "leaves files that nobody named: tmp/a",
    ),
    "a file that nobody named": ("open('more', 'w')", "leaves files that nobody named: work/more"),
    "runs the folder's own": ("import struct_", "work/RUN"),
    "a traceback": ("1 / 0", "prints a traceback, ZeroDivisionError"),
    "the status of a traceback": ("import sys; sys.exit(1)", "ends with status 1"),
    "dies": ("import os; os.abort()", "ends with status -6"),
    "a title": ("print('\\x1b]0;owned\\x07')", "sets the title"),
    "a colour": ("import sys; sys.stderr.write('\\x1b[31mred')", "control character '\\x1b'"),
    "nan": ("print('RMS nan N m')", "shows 'nan'"),
    "computes": ("import time\nwhile time.process_time() < 0.4: pass", "computes for 0."),
    "waits": ("import time; time.sleep(60)", "does not end"),
    "leaves a process": (
        "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time;"
        "time.sleep(60)'])", "leaves processes"),
}  # fmt: skip


@pytest.mark.parametrize(("script", "reported"), PLANTED.values(), ids=list(PLANTED))
def test_a_planted_fault_is_found(script, reported, tmp_path, monkeypatch):
    monkeypatch.setattr(command_process, "LONGEST_WAIT", 1.5)
    monkeypatch.setattr(command_process, "PATIENCE", 0.15)
    plants = [command_input._file("struct_.py", b'open("RUN", "w")')]
    assert reported in judged(script, tmp_path, monkeypatch, plants=plants)


@pytest.mark.parametrize(("more", "allowed"), [((), 5.0), (("--processes", "2"), 15.0)])
def test_a_command_has_5_s_and_as_much_in_each_of_its_processes(more, allowed):
    for seconds in (allowed - 0.1, allowed + 0.1):
        ending = command_process.Ending(0, b"", b"", seconds, frozenset(), False, ())
        slow = command_process.is_slow(CommandInput(["sweep", *more]), ending)
        assert slow is (seconds > allowed)


def test_a_file_that_was_promised_must_be_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    found = judged("pass", tmp_path, monkeypatch, promised={Path("out.nc")})
    assert "status 0, and there is no 'out.nc'" in found


@pytest.mark.parametrize(
    ("kind", "said", "size"),
    [
        ("closed", b"9False", 0), ("full", b"28False", 0), ("leaves", b"32False", 10),
        ("slow", b"False", 6000), ("terminal", b"True", 6000),
    ],
)  # fmt: skip
def test_streams_are_what_they_are_called(kind, said, size, tmp_path, monkeypatch):
    """The script tells how writing went."""
    script = """import os, time
try: os.write(1, b'x' * 3000); time.sleep(0.1); os.write(1, b'x' * 3000)
except OSError as error: os.write(2, str(error.errno).encode())
os.write(2, str(os.isatty(1)).encode())
"""
    monkeypatch.setattr(command_process, "_program", lambda one: [sys.executable, "-c", script])
    given = CommandInput(["walk"], streams=["", kind, ""], after=10)
    ending = command_process.run(given, WatchedFolder(tmp_path / "tree"))
    assert (ending.err, len(ending.out)) == (said, size)


def test_signals_arrive_and_may_be_what_the_process_ends_with(tmp_path, monkeypatch):
    script = "import time\nwhile time.process_time() < 2: pass"
    signals = [(0.1, signal.SIGTERM, True)]
    assert judged(script, tmp_path, monkeypatch, signals=signals) == "refused"
