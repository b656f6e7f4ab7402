"""The door of command processes: what a command does to its streams and to files."""

from __future__ import annotations

import csv
import os
import random
import re
import shutil
import signal
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import hexapod_pin
from fuzz.command_input import CommandInput, draw, lay_down
from fuzz.command_run import PATIENCE, Ending, run
from fuzz.shown import FaultFound, require_finite
from fuzz.values import ESCAPE
from fuzz.watched_folder import WatchedFolder, mark_of
from hexapod_pin.errors import HexapodError

LONGER = 1.5
"""Largest ratio of an input's processor time to that of the sound command, where that is long too.

Two runs of one command differ by up to a quarter on a busy machine (4.6 and 5.7 s).
"""

STATUSES = {0, 2, 3}
"""Done, refused or failed, does not walk."""

MISSED = 1
"""Of `verify` and `bench`, whose rows may miss their numbers."""

DEAD_PYTHON = (1, 120)
"""Of a Python that died of an exception, as of Ctrl-C before it has begun the command; 120 where it
could not print that either."""

EARLY = 0.2
"""Processor time that Python has used at most when its own start is met by Ctrl-C [s]."""

_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
"""What no text may hold that is not for a terminal; tabs and ends of lines may stand in it."""

_FORMULA = re.compile(r"^(?:[=@\t\r]|[+-](?!\.?\d|inf|nan))", re.IGNORECASE)
"""How a cell begins that a spreadsheet would compute; a number with a sign is none."""


_PACKAGE = os.fsencode(f"{Path(hexapod_pin.__file__).resolve().parent}{os.sep}")
"""Folder of the package; what finds it for Python, in an editable installation, is outside."""

_FIRST = (b"hexapod_pin/__init__.py", b"hexapod_pin/__main__.py", b"hexapod_pin/stop_signals.py")
"""Modules that are read before signals are taken over."""


def command_process(rng: random.Random) -> None:
    """A command as a process of its own."""
    error = run_one(rng).error
    if error is not None:
        raise error


@dataclass(frozen=True)
class CommandRun:
    """One input that was run.

    Attributes:
        given: the input.
        ending: how the process ended.
        folder: where it ran.
        error: `FaultFound`, or `HexapodError` where it was refused or ended by a signal.
    """

    given: CommandInput
    ending: Ending
    folder: Path
    error: FaultFound | HexapodError | None = None


def run_one(rng: random.Random, *, keep: bool = False) -> CommandRun:
    """Draw an input, run and judge it; `keep` leaves its folder."""
    root = Path(tempfile.mkdtemp(prefix="hexapod-command-"))
    try:
        tree = WatchedFolder(root / "tree")
        given = draw(rng, tree)
        lay_down(given, tree)
        ending = run(given, tree)
        try:
            judge(given, ending, tree)
        except (FaultFound, HexapodError) as error:
            return CommandRun(given, ending, root, error)
        return CommandRun(given, ending, root)
    finally:
        if not keep:
            tree.work.chmod(0o755)
            shutil.rmtree(root, ignore_errors=True)


def judge(given: CommandInput, ending: Ending, tree: WatchedFolder) -> None:
    """Refuse what no command may do.

    Raises:
        FaultFound: it was done; `changed` lists files of others.
        HexapodError: nothing was, and the command was refused.
    """
    changed = tree.changes(frozenset(given.named))
    slow = ending.late or _is_slow(given, ending)
    faults = [*(f"changes a file of others: {one}" for one in changed)]
    faults += [*_faults_of_end(given, ending, slow), *_faults_of_text(given, ending)]
    faults += [*_faults_of_files(given, ending, tree)]
    if faults:
        repeat = f"{given.as_shell()} -> status {ending.status}"
        only = slow and len(faults) == 1
        raise FaultFound(f"{given.words[0]}: {'; '.join(faults)}", repeat, changed, slow=only)
    if ending.status:
        raise HexapodError(f"status {ending.status}")


def _faults_of_end(given: CommandInput, ending: Ending, slow: bool) -> Iterator[str]:
    if ending.late:
        yield "does not end"
    elif slow:
        yield f"computes for {ending.seconds:.1f} s"
    elif ending.status not in _allowed(given, ending):
        yield f"ends with status {ending.status}"
    if ending.lives:
        yield f"leaves processes that live on: {'; '.join(ending.lives)}"
    traceback = b"Traceback (most recent call last)" in ending.err + ending.out
    if traceback and not _is_early(given, ending):
        yield f"prints a traceback, {_last_line(ending.err)}"


def _is_slow(given: CommandInput, ending: Ending) -> bool:
    """Tell whether it took too much processor time, with all processes that it started.

    On a slow machine a sound command may take more than `PATIENCE`, most of it to import
    libraries. It is run right after the input then, and the ratio shows what the oddity costs.
    """
    words = " ".join(given.words)
    asked = re.search(r"--processes[ =](\d)\b", words)
    if ending.seconds <= PATIENCE * (1 + int(asked[1]) if asked else 1):
        return False
    return ending.seconds > LONGER * sound_seconds(given)


def sound_seconds(given: CommandInput) -> float:
    """Return the processor time of the sound command that an input was made from [s].

    Its streams, limits and environment are plain, so that all that is odd counts.
    """
    plain = CommandInput(given.sound, script=given.script)
    with tempfile.TemporaryDirectory(prefix="hexapod-command-") as root:
        tree = WatchedFolder(Path(root) / "tree")
        lay_down(plain, tree)
        return run(plain, tree).seconds


def _allowed(given: CommandInput, ending: Ending) -> set[int]:
    """Return the statuses that the command may end with."""
    found = set(STATUSES)
    if given.words[0] in ("verify", "bench"):
        found.add(MISSED)
    for number in ending.sent:
        found |= {128 + number, -number}
    if _is_early(given, ending):
        found.update(DEAD_PYTHON)
    return found


def _is_early(given: CommandInput, ending: Ending) -> bool:
    """Tell whether Ctrl-C has met Python itself, before the package had taken signals over."""
    frames = [one for one in re.findall(rb'File "([^"]*)"', ending.err) if one.startswith(_PACKAGE)]
    early = any(at <= EARLY and number == signal.SIGINT for at, number, _ in given.signals)
    return early and signal.SIGINT in ending.sent and all(one.endswith(_FIRST) for one in frames)


def _last_line(err: bytes) -> str:
    lines = err.decode("utf-8", "replace").strip().splitlines() or [""]
    return lines[-1][:120]


def _faults_of_text(given: CommandInput, ending: Ending) -> Iterator[str]:
    words = given.words if given.exact else [*given.words, "nan"]  # a file may hold some
    for name, kind, content in zip(
        ("stdout", "stderr"), given.streams[1:], (ending.out, ending.err), strict=True
    ):
        text = content.decode("utf-8", "surrogateescape")
        if ESCAPE in text:
            yield f"sets the title of the terminal ({name})"
        forced = "FORCE_COLOR" in given.environment  # as for a terminal
        found = _CONTROLS.search(text) if kind != "terminal" and not forced else None
        if found:
            near = text[max(0, found.start() - 30) : found.end() + 10]
            yield f"prints the control character {found[0]!r} on {name} near {near!r}"
        try:
            require_finite(text, *words)
        except FaultFound as error:
            yield str(error)


def _faults_of_files(given: CommandInput, ending: Ending, tree: WatchedFolder) -> Iterator[str]:
    named = frozenset(given.named)
    if ending.status < 0:  # killed: what is left then is for the next command
        return
    new = tree.new_files(named) if given.exact else tree.left_over(named)
    new = [name for name in new if not _is_of_python(name) and not _is_log(name, ending)]
    if new:
        yield f"leaves files that nobody named: {', '.join(new)}"
    if ending.status == 0:
        asked = not {"--help", "--version"} & set(given.words)
        missing = [path.name for path in given.promised if asked and not os.path.exists(path)]
        if missing and len(missing) == len(given.promised):
            yield f"ends with status 0, and there is no {ascii(sorted(missing)[0])}"
    for path in named:
        before = tree.before.get(path)
        if before is not None and before == mark_of(path):
            continue
        if path.suffix == ".csv" and os.path.isfile(path) and not os.path.islink(path):
            yield from _formulas(path)


def _is_of_python(name: str) -> bool:
    """Tell whether Python itself leaves such a file, beside a module of the user's."""
    return "__pycache__" in name


def _is_log(name: str, ending: Ending) -> bool:
    """Tell whether it is the log of a store that could not be finished: `--resume` needs it."""
    return name.endswith(("-wal", "-shm")) and b"continue with --resume" in ending.err


def _formulas(path: Path) -> Iterator[str]:
    with path.open(encoding="utf-8", errors="replace", newline="") as stream:
        for row in csv.reader(stream):
            for cell in row:
                if _FORMULA.match(cell):
                    yield f"writes a formula, {cell[:40]!r}, into a table"
                    return
