"""Run the cases of a study and keep each in the store as soon as it is finished."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, SimulationInterrupted, SweepInterrupted
from hexapod_pin.simulation.batch import check_threads
from hexapod_pin.sweep.runs.case_runs import case_outcomes
from hexapod_pin.sweep.runs.distribution import Distribution
from hexapod_pin.sweep.runs.executors import DaskWorkers, PoolWorkers, Workers
from hexapod_pin.sweep.runs.store import SweepStore
from hexapod_pin.sweep.runs.sweep_result import SweepResult, open_sweep
from hexapod_pin.sweep.runs.worker_processes import WorkerProcesses
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.sweep.study import SweepStudy

THREADS = 2
"""Threads of the native core where cases run in this process."""

CHUNK = 4
"""Cases of a task for a worker: the most that the death of one worker loses."""

MOST_PROCESSES = 1024
"""Worker processes of one machine [-]."""

MOST_CHUNK = 100_000
"""Cases of one task [-]."""


@checked
def run_sweep(
    study: SweepStudy,
    store: str | Path = "study.db",
    *,
    threads: int | None = None,
    processes: int | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
    scheduler: str | None = None,
    chunk: int = CHUNK,
    resume: bool = False,
    retry_failed: bool = False,
    progress: Callable[[float], None] | None = None,
) -> SweepResult:
    """Run all cases of a study; each is on the disk as soon as it is finished.

    Cases run on threads of this process, unless one of `processes`, `executor` and `scheduler` is
    given. The results are the same to the bit. A case that fails is a row with its reason.

    Args:
        study: whose cases to run.
        store: the SQLite file that keeps them.
        threads: of the native core; None: 2 in this process, 1 in each worker.
        processes: worker processes of this machine.
        executor: of `concurrent.futures`, or a function that makes one (and, where it breaks,
            another). A broken `ProcessPoolExecutor` is made anew.
        scheduler: address of a Dask scheduler, such as "tcp://10.0.0.1:8786".
        chunk: cases that a worker is given at a time.
        resume: go on with a store that exists: what is finished is not run again.
        retry_failed: go on, and run failed cases again.
        progress: called with the finished fraction (0..1).

    Raises:
        ParameterError: an argument is out of range, or two ways of running were given.
        StoreExistsError: the store exists, and `resume` is not set.
        StoreLockedError, OtherStudyError, StoreFullError, SweepStoreError: the store cannot be
            used; all that was finished is kept.
        WorkersError: workers are gone or cannot run the study; all that was finished is kept.
        SweepInterrupted: Ctrl-C; `.result` holds what was done, all of it is kept.

    Example:
        >>> sweep = run_sweep(load_sweep("study.toml"), "study.db", resume=True)
        >>> sweep.save("study.nc")
    """
    _check(threads, processes, chunk)
    elsewhere = {"processes": processes, "executor": executor, "scheduler": scheduler}
    given = [name for name, value in elsewhere.items() if value is not None]
    if len(given) > 1:
        raise ParameterError(" and ".join(given), "both", "one of them")
    if scheduler is not None and not scheduler.strip():
        allowed = "the address of a Dask scheduler, such as 'tcp://10.0.0.1:8786'"
        raise ParameterError("scheduler", scheduler, allowed, "Leave it out to run here.")
    path, begun = user_path(store), False
    workers = _workers(processes, executor, scheduler)
    try:
        with SweepStore(path, study, resume=resume or retry_failed, retry=retry_failed) as kept:
            begun = True
            report = _Report(len(study), kept, progress)
            if workers is not None:
                _run_elsewhere(study, kept, workers, chunk, threads or 1, report)
            else:
                _run_here(study, kept, threads or THREADS, report)
    except (KeyboardInterrupt, SimulationInterrupted):
        if not begun:
            raise
        result = open_sweep(path)
        text = (
            f"interrupted: {len(result) - len(result.pending)} of {len(result)} cases are kept in "
            f"{path}; go on with --resume (resume=True)"
        )
        raise SweepInterrupted(text, result) from None
    finally:
        if workers is not None:
            workers.close()
    return open_sweep(path)


class _Report:
    """Tells how far a sweep is."""

    def __init__(
        self, total: int, store: SweepStore, progress: Callable[[float], None] | None
    ) -> None:
        self.total, self.store, self.progress = total, store, progress
        self()

    def __call__(self) -> None:
        if self.progress is not None:
            self.progress(len(self.store.finished) / self.total)


def _check(threads: int | None, processes: int | None, chunk: int) -> None:
    if threads is not None:
        check_threads(threads)
    for name, value, most in (
        ("processes", processes, MOST_PROCESSES), ("chunk", chunk, MOST_CHUNK)
    ):  # fmt: skip
        whole = isinstance(value, int) and not isinstance(value, bool)
        if value is not None and not (whole and 1 <= value <= most):
            raise ParameterError(name, value, f"a whole number from 1 to {most}")


def _run_here(study: SweepStudy, store: SweepStore, threads: int, report: _Report) -> None:
    """Run on threads of this process."""
    outcomes = case_outcomes(study, _open(study, store), threads)
    try:
        for outcome in outcomes:
            store.add([outcome])
            report()
    finally:
        outcomes.close()


def _run_elsewhere(
    study: SweepStudy, store: SweepStore, workers: Workers, chunk: int, threads: int,
    report: _Report,
) -> None:  # fmt: skip
    """Run on workers."""
    cases = Distribution(study, store, workers, chunk=chunk, threads=threads, progress=report)
    try:
        cases.run(_open(study, store))
    except KeyboardInterrupt:
        cases.keep_finished()
        raise


def _workers(
    processes: int | None,
    executor: Executor | Callable[[], Executor] | None,
    scheduler: str | None,
) -> Workers | None:
    """Return what runs cases elsewhere, checked before a store is begun; None: they run here."""
    if scheduler is not None:
        return DaskWorkers(scheduler)
    if executor is not None:
        return PoolWorkers(executor)
    return None if processes is None else WorkerProcesses(processes)


def _open(study: SweepStudy, store: SweepStore) -> list[int]:
    """Return the cases that are to be run."""
    return [index for index in range(len(study)) if index not in store.finished]
