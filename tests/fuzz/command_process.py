"""The door of command processes: how they are run, and what they may do to streams and files."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import matplotlib

from fuzz.command_input import CommandInput, draw, lay_down
from fuzz.values import ESCAPE, FaultFound, require_finite
from fuzz.watched_folder import WatchedFolder
from hexapod_pin.errors import HexapodError

PATIENCE = 5.0
"""Processor time that an input may use [s]."""

LONGEST_WAIT = 30.0
"""Time that a command may take, whether it computes or not [s]."""

LONGEST_TEXT = 1_000_000
"""Read of a stream [bytes]."""

POLL = 0.005
"""Time between two looks at a process [s]."""

READERS = {"": "cat", "terminal": "cat", "leaves": "head -c {}", "slow": "sleep 0.3; cat"}
"""What reads stdout and stderr, by their kinds; of others nobody reads what there may be."""


class Ending(NamedTuple):
    """How a process ended; `status` is -n where signal n killed it.

    `seconds` is the processor time of it and of the processes that it waited for [s]. It is `late`
    where it was killed after `LONGEST_WAIT`; `lives` are processes that it has left.
    """

    status: int
    out: bytes
    err: bytes
    seconds: float
    sent: frozenset[int]
    late: bool
    lives: tuple[str, ...]


class _Stream:
    """One of stdout and stderr: what the process is given, and what a reader of it has read."""

    def __init__(self, kind: str, after: int) -> None:
        self.text, self._read = b"", tempfile.TemporaryFile()
        self._reader: subprocess.Popen[bytes] | None = None
        if kind not in READERS:
            self.given = os.open("/dev/full" if kind == "full" else os.devnull, os.O_WRONLY)
            return
        mine, self.given = pty.openpty() if kind == "terminal" else os.pipe()
        if kind == "slow":
            fcntl.fcntl(self.given, fcntl.F_SETPIPE_SZ, 4096)
        words = ["sh", "-c", READERS[kind].format(after)]
        self._reader = subprocess.Popen(
            words, stdin=mine, stdout=self._read, stderr=subprocess.DEVNULL
        )
        os.close(mine)

    def __enter__(self) -> _Stream:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self.given)
        if self._reader:
            with contextlib.suppress(subprocess.TimeoutExpired):  # something keeps it open
                self._reader.wait(2.0)
            self._reader.kill()
            self._reader.wait()
        self._read.seek(0)
        self.text = self._read.read(LONGEST_TEXT)
        self._read.close()


def run(given: CommandInput, tree: WatchedFolder) -> Ending:
    stdin = os.open("/dev/zero" if given.streams[0] == "endless" else os.devnull, os.O_RDONLY)
    folder = tree.work
    if given.gone:
        folder = tree.root.with_name("gone")
        folder.mkdir()
    with (
        _Stream(given.streams[1], given.after) as out,
        _Stream(given.streams[2], given.after) as err,
    ):
        process = subprocess.Popen(
            _program(given), cwd=folder, env=_environment(given, tree), start_new_session=True,
            stdin=stdin, stdout=out.given, stderr=err.given,
            preexec_fn=_before(given, folder),  # noqa: PLW1509  # it only makes calls of the system
        )  # fmt: skip
        try:
            status, seconds, sent, late = _watched(process, given)
        finally:
            lives = _kill_group(process.pid)
            os.close(stdin)
    return Ending(status, out.text, err.text, seconds, frozenset(sent), late, lives)


def _watched(
    process: subprocess.Popen[bytes], given: CommandInput
) -> tuple[int, float, set[int], bool]:
    """Send signals until the process has ended; one that is late is killed."""
    begin, waiting, sent, late = time.monotonic(), list(given.signals), set[int](), False
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_utime + usage.ru_stime, sent, late
        if waiting and processor_time(process.pid) >= waiting[0][0]:
            _, number, everyone = waiting.pop(0)
            sent.add(number)
            with contextlib.suppress(ProcessLookupError):
                (os.killpg if everyone else os.kill)(process.pid, number)
        if not late and time.monotonic() - begin > LONGEST_WAIT:
            late = True
            os.killpg(process.pid, signal.SIGKILL)
        time.sleep(POLL)


def processor_time(pid: int | None) -> float:
    """Return the processor time of a process so far [s]; wall time where that is not known."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return time.monotonic()


def _kill_group(pid: int) -> tuple[str, ...]:
    """End what a process has left behind; return what there was after a while, dead ones apart."""
    for _ in range(200):
        try:
            os.killpg(pid, 0)
        except ProcessLookupError:
            return ()
        time.sleep(POLL)
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            state, _, group = (folder / "stat").read_text("utf-8").rpartition(")")[2].split()[:3]
            if int(group) == pid and state not in "ZX":
                found.append((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode())
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)
    return tuple(found)


def _before(given: CommandInput, folder: Path) -> Callable[[], None]:
    def prepare() -> None:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
            signal.signal(number, signal.SIG_DFL)
        if given.ignored:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        if given.gone:
            os.rmdir(folder)
        if given.umask is not None:
            os.umask(given.umask)
        seconds = int(LONGEST_WAIT) + 3  # what takes less is judged by `PATIENCE`
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
        for name, value in given.limits:
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))
        for stream, kind in enumerate(given.streams):
            if kind == "closed":
                os.close(stream)

    return prepare


def _program(given: CommandInput) -> list[str]:
    program = [sys.executable, "-m", "hexapod_pin"]
    if given.script:
        program = [str(Path(sys.executable).with_name("hexapod-pin"))]
        if not os.access(program[0], os.X_OK):  # not installed: what the script does
            program = [sys.executable, "-c", "from hexapod_pin.__main__ import main; main()"]
    return [*program, *(word.replace("\0", "") for word in given.words)]


def _environment(given: CommandInput, tree: WatchedFolder) -> dict[str, str]:
    kept = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "VIRTUAL_ENV")
    plain = {name: os.environ[name] for name in kept if name in os.environ}
    plain |= {"LANG": "C.UTF-8", "HOME": str(tree.home), "TMPDIR": str(tree.temporary)}
    plain |= {"MPLCONFIGDIR": matplotlib.get_cachedir()}  # making a list of fonts takes seconds
    plain |= {"PYTHONDONTWRITEBYTECODE": "1"}  # else a limit of file sizes truncates that of others
    changed = {**plain, **given.environment}
    return {name: value for name, value in changed.items() if value is not None}


# what is judged -------------------------------------------------------------------------------

STATUSES = {0, 2, 3}
"""Done, refused or failed, does not walk."""

MISSED = 1
"""Of `verify` and `bench`, whose rows may miss their numbers."""

_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
"""What no text may hold that is not for a terminal; tabs and ends of lines may stand in it."""


def command_process(rng: random.Random) -> None:
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
    """Tell whether it took too much processor time, with all processes that it started."""
    asked = re.search(r"--processes[ =](\d)\b", " ".join(given.words))
    return ending.seconds > PATIENCE * (1 + int(asked[1]) if asked else 1)


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


def _is_log(name: str, ending: Ending) -> bool:
    """Tell whether it is the log of a store that could not be finished: `--resume` needs it."""
    return name.endswith(("-wal", "-shm")) and b"continue with --resume" in ending.err
