"""Many inputs through the doors, in processes that are watched: what hangs or dies is counted."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import random
import re
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hexapod_pin.errors import HexapodError
from hexapod_pin.fuzz.doors import DOORS

PATIENCE = 5.0
"""An input that computes for longer hangs [s]: on a busy machine waiting is no fault."""

LONGEST_WAIT = 60.0
"""An input that takes longer hangs, whether it computes or not [s]."""

LONGEST_START = 120.0
"""Of a process that tries inputs [s]."""

MEMORY = 6 * 2**30
"""Address space of a process that tries inputs [bytes]."""

_WRONG_CALL = re.compile(
    r"missing \d+ required|unexpected keyword|takes .* positional|multiple values for|"
    r"missing a required|too many positional"
)
"""Python's own words where an argument is missing or there is no such keyword."""

USED, REFUSED, FAULT = "used", "refused", "FAULT"


@dataclass(frozen=True)
class Outcome:
    """What became of an input.

    Attributes:
        door: which it went through.
        seed: that it was drawn from.
        kind: `USED`, `REFUSED` or `FAULT`.
        told: of a fault: the exception and where it was raised.
        seconds: that it took [s].
    """

    door: str
    seed: int
    kind: str
    told: str = ""
    seconds: float = 0.0


def attempt(door: str, seed: int) -> Outcome:
    """Try one input in this process."""
    begin = time.perf_counter()
    kind, told = USED, ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            DOORS[door](random.Random(f"{door}/{seed}"))
    except HexapodError:
        kind = REFUSED
    except Exception as error:
        kind, told = FAULT, _described(error)
        if isinstance(error, TypeError) and _WRONG_CALL.search(str(error)):
            kind = REFUSED
    return Outcome(door, seed, kind, told, time.perf_counter() - begin)


def _described(error: Exception) -> str:
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "hexapod_pin" in f.filename]
    place = f"{frames[-1].filename.rpartition('hexapod_pin/')[2]}:{frames[-1].lineno}"
    return f"{type(error).__name__}: {str(error)[:100]} at {place}"


def run_campaign(
    inputs: Sequence[tuple[str, int]],
    processes: int = 2,
    tell: Callable[[Outcome], None] = lambda outcome: None,
) -> list[Outcome]:
    """Try inputs, each in one of so many processes; those done before Ctrl-C are returned.

    Args:
        inputs: door and seed of each.
        processes: at a time.
        tell: called with each outcome.
    """
    waiting, found = list(reversed(inputs)), list[Outcome]()
    workers = [_Worker() for _ in range(processes)]
    try:
        while waiting or any(worker.task for worker in workers):
            for k, worker in enumerate(workers):
                if worker.task is None and waiting:
                    worker.begin(waiting.pop())
                outcome = worker.outcome()
                if outcome is not None:
                    found.append(outcome)
                    tell(outcome)
                    if worker.lost:
                        workers[k] = _Worker()
    except KeyboardInterrupt:
        pass
    for worker in workers:
        worker.end()
    return found


class _Worker:
    """A process that tries one input after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other,), daemon=True)
        self._process.start()
        other.close()
        if not self._pipe.poll(LONGEST_START):
            self.end()
            raise TimeoutError(f"a process did not start in {LONGEST_START:g} s")
        self._pipe.recv()  # it has imported what it needs
        self.task: tuple[str, int] | None = None
        self.lost, self._since, self._computed = False, 0.0, 0.0

    def begin(self, task: tuple[str, int]) -> None:
        self.task, self._since = task, time.monotonic()
        self._computed = _computed(self._process.pid)
        self._pipe.send(task)

    def outcome(self) -> Outcome | None:
        """Return what became of the input, waiting a moment; None where it goes on."""
        if self.task is None:
            return None
        try:
            if self._pipe.poll(0.002):
                outcome: Outcome = self._pipe.recv()
                self.task = None
                return outcome
        except (EOFError, OSError):
            return self._lose("the process died")
        waited = time.monotonic() - self._since
        if waited > PATIENCE:
            spent = _computed(self._process.pid) - self._computed
            if spent > PATIENCE or waited > LONGEST_WAIT:
                return self._lose(f"hangs for more than {PATIENCE:g} s")
        return None

    def _lose(self, told: str) -> Outcome:
        door, seed = self.task or ("", 0)
        self.end()
        self.task, self.lost = None, True
        return Outcome(door, seed, FAULT, told, PATIENCE)

    def end(self) -> None:
        self._process.kill()
        self._process.join()


def _computed(pid: int | None) -> float:
    """Return the processor time of a process [s]; wall time where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return time.monotonic()


def _serve(pipe: Any) -> None:
    """Try what comes through the pipe."""
    import resource

    faulthandler.disable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    for door in DOORS:
        attempt(door, -1)  # makes what doors are made from
    pipe.send("ready")
    while True:
        pipe.send(attempt(*pipe.recv()))
