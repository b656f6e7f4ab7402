"""A command as a process of its own that is stopped, and what it leaves."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.errors import HexapodError

PATIENCE = 120.0
"""Longest wait for an end [s]."""

POLL = 0.002
"""Time between two looks at a process [s]."""

START = ("env", "--default-signal=INT,TERM,HUP")
"""What a command is started by, so that no signal is ignored that this process ignores."""

MARK = "HEXAPOD_PIN_KILLED_PROCESS"
"""Variable of the environment that a process and its children are known by."""


@dataclass(frozen=True)
class Ending:
    """How a process ended.

    Attributes:
        status: its exit status; -n: killed by signal n.
        err: what it printed on stderr.
        time: from when its handlers were there to its end [s].
    """

    status: int
    err: str
    time: float


class KilledProcess:
    """`hexapod-pin` with some words in a folder."""

    def __init__(self, words: Sequence[str], folder: Path) -> None:
        """Start it; Ctrl-C reaches it even where this process ignores it."""
        self.mark = uuid.uuid4().hex
        self.out, self.err = folder / ".out", folder / ".err"
        paths = os.pathsep.join(path for path in sys.path if path)
        with self.out.open("w") as out, self.err.open("w") as err:
            self.process = subprocess.Popen(
                [*START, sys.executable, "-m", "hexapod_pin", *words],
                cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                env={**os.environ, "PYTHONPATH": paths, MARK: self.mark},
            )  # fmt: skip
        self.begin = time.perf_counter()

    def wait_for_handlers(self) -> None:
        """Wait until it handles signals itself, or has ended."""
        while self.running and not _handles(self.process.pid, signal.SIGHUP):
            time.sleep(POLL)
        self.begin = time.perf_counter()

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self.process.poll() is None

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self.process.send_signal(number)

    def wait(self, longest: float = PATIENCE) -> Ending:
        """Wait for its end, no longer than so many seconds; what stays for `PATIENCE` is killed."""
        try:
            self.process.wait(longest)
        except subprocess.TimeoutExpired:
            if longest >= PATIENCE:
                self.process.kill()
                self.process.wait()
        taken = time.perf_counter() - self.begin
        text = self.err.read_text(encoding="utf-8", errors="replace")
        return Ending(self.process.poll() or 0, text, taken)

    def left_alive(self, patience: float = 5.0) -> int:
        """Return how many of its children live on after a while; they are killed."""
        end = time.perf_counter() + patience
        while (found := _marked(self.mark)) and time.perf_counter() < end:
            time.sleep(0.05)
        for pid in found:
            os.kill(pid, signal.SIGKILL)
        return len(found)


def _handles(pid: int, number: signal.Signals) -> bool:
    """Tell whether a process has a handler for a signal."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return False
    caught = next((int(line.split()[1], 16) for line in lines if line.startswith("SigCgt")), 0)
    return bool(caught >> (number - 1) & 1)


def _marked(mark: str) -> list[int]:
    """Return the processes with a mark in their environment."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if f"{MARK}={mark}".encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def broken_file(path: Path) -> str | None:
    """Return why a file cannot be read; None where it can."""
    from hexapod_pin.results.result_files import read_netcdf
    from hexapod_pin.results.trace_file import load_trace
    from hexapod_pin.simulation.case import load_case
    from hexapod_pin.study.runs import open_sweep

    try:
        if path.suffix == ".nc":
            read_netcdf(path) if path.stem == "study" else load_trace(path)
        elif path.suffix == ".db":
            open_sweep(path)
        elif path.name == "case.toml":
            load_case(path)
        elif path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))
        elif path.suffix == ".html" and not path.read_text().rstrip().endswith("</html>"):
            return f"{path.name}: ends early"
        elif path.suffix == ".md" and not path.read_text().endswith("\n"):
            return f"{path.name}: ends early"
    except (HexapodError, ValueError, OSError) as error:
        return None if "nothing yet" in str(error) else f"{path.name}: {error}"
    return None


def left_over(folder: Path) -> list[str]:
    """Return the temporary files in a folder."""
    return sorted(path.name for path in folder.glob(".*.tmp"))
