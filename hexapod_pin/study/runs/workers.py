"""Workers run tasks behind an executor, a Dask scheduler, or as processes of this machine."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from hexapod_pin.errors import ParameterError, ResourceError, WorkersError
from hexapod_pin.log import LOG
from hexapod_pin.study.runs.task import Task, run_task
from hexapod_pin.study.runs.worker_main import read_frame, write_frame

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
        """Start again after a pool has broken."""

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
            raise WorkersError(f"{type(executor).__name__} is broken, and cannot be replaced; "
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


# Worker processes of this machine, each on its own: the death of one concerns no other.

START = (
    "import sys; sys.path[:] = [path for path in sys.path if path]; "
    "from hexapod_pin.study.runs.worker_main import main; main()"
)
"""What a worker runs. Python puts the current folder, as '', first on the path of such a command:
it goes before anything but the built-in `sys` is imported (`-P` is known from Python 3.11 on)."""

PROCESS_PATIENCE = 5.0
"""Longest wait for a process to end that has closed its pipes [s]."""


def _import_folders() -> list[str]:
    """Return where a worker finds its modules: where this process does, but for the current folder.

    Python itself puts that folder there for `python -m`, for a script in it and for an empty entry
    of PYTHONPATH. A worker runs none of the user's modules: it needs nothing from the folder, and
    would run whatever has the name of a module there. The folder stays where PYTHONPATH names it,
    and where this package lies in it.
    """
    found = [path for path in sys.path if isinstance(path, str) and path]
    try:
        here = os.path.realpath(os.getcwd())
    except OSError:  # the folder was removed
        return [path for path in found if os.path.isabs(path)]
    named = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    if here in [os.path.realpath(path) for path in (*named, str(Path(__file__).parents[3]))]:
        return found
    return [path for path in found if os.path.realpath(path) != here]


class WorkerDied(Exception):
    """A worker process ended in the middle of its task."""


class WorkerProcess:
    """One process, started when it is needed, and again after it has died."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self.process: subprocess.Popen[bytes] | None = None

    def run(self, task: Task) -> bytes:
        """Run a task there.

        Raises:
            WorkerDied: the process ended before it answered.
        """
        process = self.process or self._start()
        assert process.stdin is not None and process.stdout is not None
        try:
            write_frame(process.stdin, json.dumps(task).encode())
            answer = read_frame(process.stdout)
        except OSError:
            answer = None
        if answer is None:
            self.process = None
            LOG.warning("worker process %d has ended; the next task starts another", process.pid)
            raise WorkerDied(f"its worker process ended with status {_ended(process)}")
        return answer

    def _start(self) -> subprocess.Popen[bytes]:
        self.process = subprocess.Popen(
            [sys.executable, "-c", START], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(_import_folders())},
            start_new_session=True,  # Ctrl-C is for the parent, which ends its workers
        )  # fmt: skip
        return self.process

    def kill(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()

    def let_go(self) -> None:
        """Close what is left of a process that was killed."""
        if self.process is not None:
            _ended(self.process)
            self.process = None


def _ended(process: subprocess.Popen[bytes]) -> int:
    """Close the pipes of a process and return its exit status; what does not end is killed."""
    for stream in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            if stream is not None:
                stream.close()
    try:
        return process.wait(PROCESS_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


class WorkerProcesses:
    """Some worker processes."""

    isolates = True
    strikes = 3

    def __init__(self, count: int) -> None:
        """Start nothing yet."""
        self.slots = count
        self.workers = [WorkerProcess() for _ in range(count)]
        self.idle: queue.SimpleQueue[WorkerProcess] = queue.SimpleQueue()
        for worker in self.workers:
            self.idle.put(worker)
        self.threads = ThreadPoolExecutor(count, thread_name_prefix="sweep-worker")
        self.closed = False

    def submit(self, task: Task) -> Future[bytes]:
        """Run a task on the next worker that is free.

        Raises:
            ResourceError: the system starts no thread that waits for its answer.
        """
        try:
            return self.threads.submit(self._run, task)
        except RuntimeError as error:
            reason = f"the system does not start one for each of {self.slots} processes"
            raise ResourceError("threads", reason, "Give fewer of them.") from error

    def _run(self, task: Task) -> bytes:
        worker = self.idle.get()
        try:
            if self.closed:
                raise WorkerDied("the sweep has ended")
            return worker.run(task)
        finally:
            self.idle.put(worker)

    def renew(self) -> None:
        """Do nothing: a worker that has died is started again by its next task."""

    def close(self) -> None:
        """End all workers at once."""
        self.closed = True
        for worker in self.workers:
            worker.kill()
        self.threads.shutdown(wait=True, cancel_futures=True)
        for worker in self.workers:
            worker.kill()  # started in the meantime
            worker.let_go()


def workers_of(
    processes: int | None,
    executor: Executor | Callable[[], Executor] | None,
    scheduler: str | None,
) -> Workers:
    """Return what runs cases elsewhere; one of the three is given.

    Raises:
        ParameterError, WorkersError: as of `DaskWorkers`.
    """
    if scheduler is not None:
        return DaskWorkers(scheduler)
    if executor is not None:
        return PoolWorkers(executor)
    return WorkerProcesses(processes or 1)
