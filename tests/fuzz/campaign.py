"""Many inputs through the doors, in processes that are watched: what hangs or dies is counted."""

from __future__ import annotations

import contextlib
import faulthandler
import multiprocessing
import os
import random
import re
import shutil
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

from fuzz import material
from fuzz.command_process import LONGEST_WAIT as LONGEST_COMMAND
from fuzz.command_process import PATIENCE, processor_time
from fuzz.doors import DOORS, SELDOM
from fuzz.values import FaultFound, described, is_wrong_call
from hexapod_pin.errors import HexapodError, UserCodeError

LONGEST_WAIT = LONGEST_COMMAND + 60.0
"""An input that takes longer hangs, whether it computes or not [s]."""

LONGEST_START = 240.0
"""Of a process that tries inputs [s]."""

TRIALS = 5
"""Times that an input may take too long before that is a fault.

It is tried again after all others: on a busy machine processor time doubles for minutes.
"""

MEMORY = 6 * 2**30
"""Address space of a process that tries inputs [bytes]."""

_OWN = re.compile(r"'[^']*'|\"[^\"]*\"|\d[\d.]*(?:e[+-]?\d+)?|b'.*'")
"""What faults of one cause differ in: what was given, and numbers."""

USED, REFUSED, FAULT = "used", "refused", "FAULT"


@dataclass(frozen=True)
class Outcome:
    """What became of an input: `kind` is `USED`, `REFUSED` or `FAULT`.

    `seconds` is the processor time that it took [s]; `slow` tells that the fault is only that.
    """

    door: str
    seed: int
    kind: str
    fault: str = ""
    seconds: float = 0.0
    slow: bool = False

    @property
    def cause(self) -> str:
        """The fault without the numbers and names of this one input."""
        return _OWN.sub("..", self.fault)


def attempt(door: str, seed: int) -> Outcome:
    """Try one input in this process, and look at the files of others."""
    tree, begin = material.watched(), _spent()
    kind, fault, slow = USED, "", False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            DOORS[door](random.Random(f"{door}/{seed}"))
    except UserCodeError as error:
        fault = _of_control(error.__cause__)
        kind = FAULT if fault else REFUSED
    except HexapodError:
        kind = REFUSED
    except FaultFound as found:
        kind, fault, slow = FAULT, str(found), found.slow
    except Exception as error:
        kind = REFUSED if is_wrong_call(error) else FAULT
        fault = described(error) if kind == FAULT else ""
    spent, changed = _spent() - begin, tree.changes(tree.hard_links)
    if changed or tree.changes():
        tree.accept()
    if changed:
        kind, slow = FAULT, False
        fault = f"changes a file of others: {'; '.join(changed)}{f'; {fault}' if fault else ''}"
    return Outcome(door, seed, kind, fault, spent, slow)


def _of_control(cause: BaseException | None) -> str:
    """Return a bare exception of a controller of the package, which is no user's code; or none."""
    if not isinstance(cause, Exception) or isinstance(cause, HexapodError):
        return ""
    fault = described(cause)
    return fault if " at control/" in fault else ""


def _spent() -> float:
    """Return the processor time of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])


def run_campaign(
    inputs: Sequence[tuple[str, int]],
    processes: int = 2,
    report: Callable[[Outcome], None] = lambda outcome: None,
) -> list[Outcome]:
    """Try inputs, door and seed of each, in processes; those done before Ctrl-C are returned."""
    waiting, found = list(reversed(inputs)), list[Outcome]()
    trials = Counter[tuple[str, int]]()
    doors = {door for door, _ in inputs} - set(SELDOM)
    workers, folder = list[_Worker](), tempfile.mkdtemp(prefix="hexapod-campaign-")
    try:
        workers += [_Worker(doors, folder) for _ in range(processes)]
        while waiting or any(worker.task for worker in workers):
            for k, worker in enumerate(workers):
                if worker.task is None and waiting:
                    worker.begin(waiting.pop())
                outcome = worker.outcome()
                if outcome is None:
                    continue
                if worker.lost:
                    workers[k] = _Worker(doors, folder)
                task = outcome.door, outcome.seed
                trials[task] += outcome.slow
                if outcome.slow and trials[task] < TRIALS:
                    waiting.insert(0, task)
                    continue
                found.append(outcome)
                report(outcome)
    except KeyboardInterrupt:
        pass
    for worker in workers:
        worker.end()
    shutil.rmtree(folder, ignore_errors=True)
    return found


class _Worker:
    """A process that tries one input after the other."""

    def __init__(self, doors: Collection[str], folder: str) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, doors, folder), daemon=True)
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
        self._computed = processor_time(self._process.pid)
        with contextlib.suppress(OSError):  # of one that has died since: `outcome` sees that
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
            spent = processor_time(self._process.pid) - self._computed
            if spent > PATIENCE or waited > LONGEST_WAIT:
                return self._lose(f"hangs for more than {PATIENCE:g} s", slow=True)
        return None

    def _lose(self, fault: str, *, slow: bool = False) -> Outcome:
        door, seed = self.task or ("", 0)
        self.end()
        self.task, self.lost = None, True
        return Outcome(door, seed, FAULT, fault, PATIENCE, slow)

    def end(self) -> None:
        self._process.kill()
        self._process.join()


def _serve(pipe: Any, doors: Collection[str], folder: str) -> None:
    """Try what comes through the pipe; all files are made in a folder that the campaign removes."""
    import resource

    os.setpgid(0, 0)  # a Ctrl-C at the terminal is for the campaign
    faulthandler.disable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    tempfile.tempdir = folder
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    os.chdir(material.watched().work)
    for door in doors:
        attempt(door, -1)  # makes what doors are made from
    pipe.send("ready")
    while True:
        pipe.send(attempt(*pipe.recv()))
