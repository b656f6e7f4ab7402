"""Worker processes of this machine, each on its own: the death of one concerns no other."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from hexapod_pin.errors import ResourceError
from hexapod_pin.sweep.runs.task import Task
from hexapod_pin.sweep.runs.worker_main import read_frame, write_frame

START = (
    "import sys; sys.path[:] = [path for path in sys.path if path]; "
    "from hexapod_pin.sweep.runs.worker_main import main; main()"
)
"""What a worker runs. Python puts the current folder, as '', first on the path of such a command:
it goes before anything but the built-in `sys` is imported (`-P` is known from Python 3.11 on)."""

PATIENCE = 5.0
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
        return process.wait(PATIENCE)
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
