"""Workers behind an executor: any of `concurrent.futures`, or a Dask scheduler."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import suppress
from typing import Any, Protocol

from hexapod_pin.errors import ParameterError, WorkersError
from hexapod_pin.sweep.runs.task import Task, run_task

PATIENCE = 30.0
"""Longest wait for a scheduler and its first worker [s]."""

LOOK = 2.0
"""Time between two looks at how many workers a scheduler has [s]."""


class Workers(Protocol):
    """What runs tasks elsewhere.

    Attributes:
        isolates: whether the death of a worker fails the tasks of that worker alone.
        strikes: deaths of its worker after which a case that ran alone there has failed.
    """

    isolates: bool
    strikes: int

    @property
    def slots(self) -> int:
        """Tasks that run at a time."""

    def submit(self, task: Task) -> Future[bytes]:
        """Run a task."""

    def renew(self) -> None:
        """Begin anew after a pool has broken."""

    def close(self) -> None:
        """End what was started here."""


class PoolWorkers:
    """An executor of `concurrent.futures`. A broken process pool breaks all its tasks."""

    isolates = False
    strikes = 3

    def __init__(self, executor: Executor | Callable[[], Executor]) -> None:
        """Take an executor, which stays its owner's, or a callable that makes them."""
        self.made: Executor | None = None
        if isinstance(executor, Executor):
            self.executor = executor
            self.make = _maker(executor)
        else:
            self.make, self.executor = executor, executor()
            self.made = self.executor
        self.isolates = type(self.executor).__name__ == "ClientExecutor"
        self.strikes = 1 if self.isolates else 3  # Dask has tried several times itself
        self.slots = int(getattr(self.executor, "_max_workers", None) or os.cpu_count() or 1)

    def submit(self, task: Task) -> Future[bytes]:
        """Run a task."""
        return self.executor.submit(run_task, *task)

    def renew(self) -> None:
        """Make a new pool in place of a broken one."""
        self.close()
        self.executor = self.made = self.make()

    def close(self) -> None:
        """Shut down a pool that was made here."""
        if self.made is not None:
            self.made.shutdown(wait=True, cancel_futures=True)


def _maker(executor: Executor) -> Callable[[], Executor]:
    """Return what makes an executor like this one.

    How the processes of a pool are started is Python's affair: those of a "spawn" or "forkserver"
    context begin with the current folder first on `sys.path`, unless `PYTHONSAFEPATH` is set.
    """
    if not isinstance(executor, ProcessPoolExecutor):

        def none() -> Executor:
            hint = "give a function that makes one: executor=lambda: ..."
            raise WorkersError(f"{type(executor).__name__} is broken, and cannot be made anew; "
                               f"{hint}", 0)  # fmt: skip

        return none
    given: Any = executor
    return lambda: ProcessPoolExecutor(
        given._max_workers, given._mp_context, given._initializer, given._initargs
    )


class DaskWorkers:
    """The workers of a Dask scheduler, through `Client.get_executor`."""

    isolates = True
    strikes = 1  # the scheduler has tried several times itself

    def __init__(self, address: str) -> None:
        """Connect.

        Raises:
            ParameterError: `distributed` is not installed.
            WorkersError: there is no scheduler, or it has no worker.
        """
        try:
            import distributed
        except ImportError as error:
            hint = "pip install 'hexapod-pin[cluster]'"
            raise ParameterError("scheduler", address, "left out without Dask", hint) from error
        client: Any = distributed.Client.__new__(distributed.Client)
        try:
            client.__init__(address, timeout=PATIENCE, set_as_default=False)
            client.wait_for_workers(1, timeout=PATIENCE)
        except Exception as error:  # a scheme that lacks something ends in a TypeError
            # One that is left to the garbage collector closes itself whenever that runs. While
            # another client starts, in the same thread, it would wait for ever for Dask's lock.
            with suppress(Exception):
                client.__del__()
            text = f"no Dask scheduler with a worker at {address} ({' '.join(str(error).split())})"
            raise WorkersError(
                f"{text}; start them with `dask scheduler`, `dask worker`.", 0
            ) from error
        self.client = client
        self.executor: Any = self.client.get_executor()
        self.looked, self.known = -LOOK, 1

    @property
    def slots(self) -> int:
        """Threads of all workers of now; they may come and go."""
        if time.monotonic() - self.looked > LOOK:
            self.looked = time.monotonic()
            self.known = max(1, sum(self.client.nthreads().values()))
        return self.known

    def submit(self, task: Task) -> Future[bytes]:
        """Run a task."""
        found: Future[bytes] = self.executor.submit(run_task, *task)
        return found

    def renew(self) -> None:
        """Do nothing: the scheduler looks after its workers."""

    def close(self) -> None:
        """Take back what has not begun, and leave the scheduler as it was."""
        self.executor.shutdown(wait=False)
        self.client.close()
