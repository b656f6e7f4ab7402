"""Runs a command as a process of its own, with the streams, limits and signals that were drawn."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from fuzz.command_input import CommandInput
from fuzz.watched_folder import WatchedFolder

PATIENCE = 5.0
"""Processor time that an input may use [s]."""

LONGEST_WAIT = 30.0
"""Time that a command may take, whether it computes or not [s]."""

POLL = 0.005
"""Time between two looks at a process [s]."""

SLOW = 0.001
"""Time that a slow reader takes for each byte [s]."""


class Ending(NamedTuple):
    """How a process ended: `status` is -n where signal n killed it.

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
    """One of stdout and stderr: what the process is given, and who reads it."""

    def __init__(self, kind: str, after: int) -> None:
        self.kind, self.after = kind, after
        self.given, self._mine = -1, -1
        self.text, self._next = bytearray(), 0.0
        if kind == "full":
            self.given = os.open("/dev/full", os.O_WRONLY)
        elif kind == "terminal":
            self._mine, self.given = pty.openpty()
        elif kind != "closed":
            self._mine, self.given = os.pipe()
            if kind == "slow":
                fcntl.fcntl(self.given, fcntl.F_SETPIPE_SZ, 4096)
        if self._mine >= 0:
            os.set_blocking(self._mine, False)

    def read(self, *, hurry: bool = False) -> None:
        """Take what is there, as its kind of reader does."""
        if self._mine < 0:
            return
        now, size = time.monotonic(), 65536
        if self.kind == "leaves":
            size = self.after - len(self.text)
        elif self.kind == "slow" and len(self.text) < self.after and not hurry:
            if now < self._next:
                return
            size, self._next = 1, now + SLOW
        try:
            piece = os.read(self._mine, size) if size else b""
        except BlockingIOError:
            return
        except OSError:  # the last end of a terminal was closed
            piece = b""
        self.text += piece
        if not piece:
            os.close(self._mine)
            self._mine = -1

    def rest(self) -> bytes:
        """Take all that is left, and close it."""
        end = time.monotonic() + 0.5
        while self._mine >= 0 and time.monotonic() < end:
            before = len(self.text)
            self.read(hurry=True)
            if len(self.text) == before:
                time.sleep(POLL)
        if self._mine >= 0:
            os.close(self._mine)
        return bytes(self.text)


def run(given: CommandInput, tree: WatchedFolder) -> Ending:
    """Run a command in a tree until it has ended, and look at what it leaves behind."""
    out, err = (_Stream(kind, given.after) for kind in given.streams[1:])
    stdin, kept = _stdin(given.streams[0])
    folder = tree.work
    if given.gone:
        folder = tree.root.with_name("gone")
        folder.mkdir()
    process = subprocess.Popen(
        _program(given), cwd=folder, env=_environment(given, tree), start_new_session=True,
        stdin=stdin, stdout=out.given if out.given >= 0 else subprocess.DEVNULL,
        stderr=err.given if err.given >= 0 else subprocess.DEVNULL,
        preexec_fn=_before(given, folder),  # noqa: PLW1509  # it only makes calls of the system
    )  # fmt: skip
    for one in (out.given, err.given):
        if one >= 0:
            os.close(one)
    try:
        status, seconds, sent, late = _watched(process, given, (out, err))
    finally:
        lives = _kill_group(process.pid)
        for one in (stdin, *kept):
            os.close(one)
    return Ending(status, out.rest(), err.rest(), seconds, frozenset(sent), late, lives)


def _watched(
    process: subprocess.Popen[bytes], given: CommandInput, streams: tuple[_Stream, _Stream]
) -> tuple[int, float, set[int], bool]:
    """Read, and send signals, until the process has ended; one that is late is killed."""
    begin, waiting, sent, late = time.monotonic(), list(given.signals), set[int](), False
    while True:
        for stream in streams:
            stream.read()
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
        time.sleep(SLOW if "slow" in given.streams else POLL)


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
    found = tuple(_alive_in_group(pid))
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)
    return found


def _alive_in_group(group: int) -> Iterator[str]:
    """Yield the command lines of a group's processes that are no zombies."""
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            state, _, own = (folder / "stat").read_text("utf-8").rpartition(")")[2].split()[:3]
            if int(own) == group and state not in "ZX":
                words = (folder / "cmdline").read_bytes().replace(b"\0", b" ")
                yield words.decode("utf-8", "replace").strip()


def _stdin(kind: str) -> tuple[int, list[int]]:
    """Return the process' stdin, and what else is to be closed at its end."""
    if kind == "waiting":
        mine, other = os.pipe()
        return mine, [other]
    if kind == "terminal":
        mine, other = pty.openpty()
        return other, [mine]
    return os.open("/dev/zero" if kind == "endless" else os.devnull, os.O_RDONLY), []


def _before(given: CommandInput, folder: Path) -> Callable[[], None]:
    """Return what the process does before it becomes the command."""

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
    """Return the variables of a plain environment with the changes that were drawn."""
    kept = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "VIRTUAL_ENV")
    plain = {name: os.environ[name] for name in kept if name in os.environ}
    plain |= {"LANG": "C.UTF-8", "HOME": str(tree.home), "TMPDIR": str(tree.temporary)}
    plain |= {"MPLCONFIGDIR": font_cache()}
    plain |= {"PYTHONDONTWRITEBYTECODE": "1"}  # else a limit of file sizes truncates that of others
    changed = {**plain, **given.environment}
    return {name: value for name, value in changed.items() if value is not None}


@cache
def font_cache() -> str:
    """Return the folder with matplotlib's list of fonts: making one takes seconds."""
    import matplotlib.font_manager

    return matplotlib.get_cachedir()
