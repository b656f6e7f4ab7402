"""Runs a command as a process of its own, with the streams, limits and signals that were drawn."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import pty
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fuzz.command_input import CommandInput
from fuzz.watched_folder import WatchedFolder

PATIENCE = 5.0
"""Processor time that an input may use [s]."""

LONGEST_WAIT = 30.0
"""Time that a command may take, whether it computes or not [s]."""

LONGEST_TEXT = 1_000_000
"""Read of a stream [bytes]."""

POLL = 0.005
"""Time between two looks at a process [s]."""

SLOW = 0.001
"""Time that a slow reader takes for each byte [s]."""


@dataclass(frozen=True)
class Ending:
    """How a process ended.

    Attributes:
        status: its exit status; -n: killed by signal n.
        out: what was read of its stdout.
        err: what was read of its stderr.
        seconds: processor time of it and of the processes that it waited for [s].
        sent: signals that it was sent.
        late: whether it was killed because it went on for longer than `LONGEST_WAIT`.
        lives: processes that it started and that live on, by their command lines.
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

    def __init__(self, kind: str, after: int, scratch: Path) -> None:
        self.kind, self.after = kind, after
        self.given: int | None = None
        self._mine: int | None = None
        self.text, self._next = bytearray(), 0.0
        if kind == "full":
            self.given = os.open("/dev/full", os.O_WRONLY)
        elif kind == "read-only":
            self.given = os.open(os.devnull, os.O_RDONLY)
        elif kind == "file":
            self.given = os.open(scratch, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600)
            self._mine = os.open(scratch, os.O_RDONLY)
        elif kind == "terminal":
            self._mine, self.given = pty.openpty()
        elif kind != "closed":
            self._mine, self.given = os.pipe()
            if kind in ("slow", "never ready"):
                fcntl.fcntl(self.given, fcntl.F_SETPIPE_SZ, 4096)
            if kind == "never ready":
                os.set_blocking(self.given, False)
        if self._mine is not None:
            os.set_blocking(self._mine, False)

    def started(self) -> None:
        """Leave the process' end to it."""
        if self.given is not None:
            os.close(self.given)

    def read(self, *, hurry: bool = False) -> None:
        """Take what is there, as its kind of reader does."""
        if self._mine is None:
            return
        now, size = time.monotonic(), 65536
        if self.kind == "leaves":
            size = self.after - len(self.text)
        elif self.kind in ("slow", "never ready") and len(self.text) < self.after and not hurry:
            size = 1 if now >= self._next else 0
            self._next = now + SLOW
        if size == 0 and self.kind != "leaves":
            return
        try:
            piece = os.read(self._mine, size) if size else b""
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK):
                return
            piece = b""  # the last end of a terminal was closed
        if not piece and self.kind != "file":
            self.close()
        if len(self.text) < LONGEST_TEXT:
            self.text += piece

    def rest(self) -> bytes:
        """Take all that is left, and close it."""
        end = time.monotonic() + 0.5
        while self._mine is not None and time.monotonic() < end:
            before = len(self.text)
            self.read(hurry=True)
            if len(self.text) == before:
                break
        self.close()
        return bytes(self.text)

    def close(self) -> None:
        """Close this end."""
        if self._mine is not None:
            os.close(self._mine)
            self._mine = None


def run(given: CommandInput, tree: WatchedFolder) -> Ending:
    """Run a command in a tree to its end."""
    scratch = tree.root.with_name("streams")
    scratch.mkdir()
    streams = [
        _Stream(kind, given.after, scratch / name)
        for name, kind in zip(("out", "err"), given.streams[1:], strict=True)
    ]
    stdin, kept = _stdin(given.streams[0])
    folder = tree.work
    if given.gone:
        folder = tree.root.with_name("gone")
        folder.mkdir()
    process = subprocess.Popen(
        _program(given), cwd=folder, env=_environment(given, tree), start_new_session=True,
        stdin=stdin, stdout=streams[0].given or subprocess.DEVNULL,
        stderr=streams[1].given or subprocess.DEVNULL,
        preexec_fn=_before(given, folder),  # noqa: PLW1509  # it only makes calls of the system
    )  # fmt: skip
    for stream in streams:
        stream.started()
    try:
        status, seconds, sent, late = _watched(process, given, streams)
    finally:
        lives = _kill_group(process.pid)
        for one in (stdin, *kept):
            if one >= 0:
                os.close(one)
    out, err = (stream.rest() for stream in streams)
    return Ending(status, out, err, seconds, frozenset(sent), late, lives)


def _watched(
    process: subprocess.Popen[bytes], given: CommandInput, streams: list[_Stream]
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
        time.sleep(POLL if all(stream.kind != "slow" for stream in streams) else SLOW)


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
    if kind == "endless":
        return os.open("/dev/zero", os.O_RDONLY), []
    return os.open(os.devnull, os.O_RDONLY), []


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
            kind = getattr(resource, f"RLIMIT_{name}")
            resource.setrlimit(kind, (value, value))
        for stream, kind_of_stream in enumerate(given.streams):
            if kind_of_stream == "closed":
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
    for name, value in given.environment.items():
        if value is None:
            plain.pop(name, None)
        else:
            plain[name] = value
    return plain


@cache
def font_cache() -> str:
    """Return the folder with matplotlib's list of fonts: making one takes seconds."""
    try:
        import matplotlib.font_manager
    except ImportError:
        return ""
    return matplotlib.get_cachedir()
