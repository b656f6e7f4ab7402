"""The door of command processes: what a command does to its streams and to files."""

from __future__ import annotations

import csv
import os
import random
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from fuzz.command_input import CommandInput, draw, lay_down
from fuzz.command_run import PATIENCE, Ending, run
from fuzz.shown import FaultFound, require_finite
from fuzz.values import ESCAPE
from fuzz.watched_folder import WatchedFolder, mark_of
from hexapod_pin.errors import HexapodError

STATUSES = {0, 2, 3}
"""Done, refused or failed, does not walk."""

MISSED = 1
"""Of `verify` and `bench`, whose rows may miss their numbers."""

_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
"""What no text may hold that is not for a terminal; tabs and ends of lines may stand in it."""

_FORMULA = re.compile(r"^(?:[=@\t\r]|[+-](?!\.?\d|inf|nan))", re.IGNORECASE)
"""How a cell begins that a spreadsheet would compute; a number with a sign is none."""


def command_process(rng: random.Random) -> None:
    """A command as a process of its own."""
    error = run_one(rng).error
    if error is not None:
        raise error


class CommandRun(NamedTuple):
    """One input that was run; an error is `HexapodError` where it was refused or killed."""

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
    """Refuse what no command may do; a `HexapodError` tells that the command was refused."""
    slow = ending.late or is_slow(given, ending)
    changed = tree.changes(frozenset(given.named))
    faults = [*(f"changes a file of others: {one}" for one in changed)]
    faults += [*_faults_of_end(given, ending, slow), *_faults_of_text(given, ending)]
    faults += [*_faults_of_files(given, ending, tree)]
    if faults:
        only = slow and len(faults) == 1
        text = f"{given.words[0]}: {'; '.join(faults)}; {given.words} with status {ending.status}"
        raise FaultFound(text, slow=only)
    if ending.status:
        raise HexapodError(f"status {ending.status}")


def _faults_of_end(given: CommandInput, ending: Ending, slow: bool) -> Iterator[str]:
    allowed = {*STATUSES, *(MISSED for name in ("verify", "bench") if given.words[0] == name)}
    allowed |= {one for number in ending.sent for one in (128 + number, -number)}
    if ending.late:
        yield "does not end"
    elif slow:
        yield f"computes for {ending.seconds:.1f} s"
    elif ending.status not in allowed:
        yield f"ends with status {ending.status}"
    if ending.lives:
        yield f"leaves processes that live on: {'; '.join(ending.lives)}"
    if b"Traceback (most recent call last)" in ending.err + ending.out:
        last = ending.err.decode("utf-8", "replace").strip().splitlines()[-1:]
        yield f"prints a traceback, {''.join(last)[:120]}"


def is_slow(given: CommandInput, ending: Ending) -> bool:
    """Tell whether it took too much processor time, with all processes that it started.

    Importing libraries takes a sound command up to `PATIENCE` on a slow machine: that is granted
    besides.
    """
    asked = re.search(r"--processes[ =](\d)\b", " ".join(given.words))
    return ending.seconds > PATIENCE * (1 + int(asked[1]) if asked else 2)


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
    new = [name for name in new if "__pycache__" not in name and not _is_log(name, ending)]
    if new:
        yield f"leaves files that nobody named: {', '.join(new)}"
    if ending.status == 0 and not {"--help", "--version"} & set(given.words):
        missing = [path.name for path in given.promised if not os.path.exists(path)]
        if missing and len(missing) == len(given.promised):
            yield f"ends with status 0, and there is no {ascii(sorted(missing)[0])}"
    for path in named:
        before = tree.before.get(path)
        if before is not None and before == mark_of(path):
            continue
        if path.suffix == ".csv" and os.path.isfile(path) and not os.path.islink(path):
            yield from _formulas(path)


def _is_log(name: str, ending: Ending) -> bool:
    """Tell whether it is the log of a store that could not be finished: `--resume` needs it."""
    return name.endswith(("-wal", "-shm")) and b"continue with --resume" in ending.err


def _formulas(path: Path) -> Iterator[str]:
    with path.open(encoding="utf-8", errors="replace", newline="") as stream:
        cells = [cell for row in csv.reader(stream) for cell in row if _FORMULA.match(cell)]
    for cell in cells[:1]:
        yield f"writes a formula, {cell[:40]!r}, into a table"
