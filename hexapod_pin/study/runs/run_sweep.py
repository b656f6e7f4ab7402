"""The cases of a study run here or on workers, and each is stored when it is finished."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, cast

from hexapod_pin.arguments import checked
from hexapod_pin.errors import SimulationInterrupted, StudyInterrupted
from hexapod_pin.study.runs.runner import CHUNK, check_count, open_runner
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.sweep_result import SweepResult, open_sweep
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.study.sweep import SweepStudy


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
        threads: of the native core; see `RunOptions`, also for the options below.
        processes: worker processes of this machine.
        executor: of `concurrent.futures`.
        scheduler: address of a Dask scheduler.
        chunk: cases that a worker is given at a time.
        resume: continue a store that exists: finished cases are not run again.
        retry_failed: continue, and run failed cases again.
        progress: called with the finished fraction (0..1).

    Raises:
        ParameterError: an argument is out of range, or two ways of running were given.
        StoreExistsError: the store exists, and `resume` is not set.
        StoreLockedError, OtherStudyError, StoreFullError, SweepStoreError: the store cannot be
            used; all that was finished is kept.
        WorkersError: workers are gone or cannot run the study; all that was finished is kept.
        StudyInterrupted: Ctrl-C; `.result` holds what was done, all of it is kept.

    Example:
        >>> sweep = run_sweep(load_sweep("study.toml"), "study.db", resume=True)
        >>> sweep.save("study.nc")
    """
    check_count("chunk", chunk, MOST_CHUNK)
    path, run = user_path(store), None
    begin = partial(SweepStore, path, study, resume=resume or retry_failed, retry=retry_failed)
    try:
        with open_runner(
            begin, threads=threads, processes=processes, executor=executor, scheduler=scheduler,
            progress=progress,
        ) as run:  # fmt: skip
            kept = cast("SweepStore", run.store)

            def report() -> None:
                if progress is not None:
                    progress(len(kept.finished) / len(study))

            report()
            missing = [index for index in range(len(study)) if index not in kept.finished]
            run.run(study, missing, kept, report, chunk)
    except (KeyboardInterrupt, SimulationInterrupted):
        if run is None:
            raise
        result = open_sweep(path)
        text = (
            f"interrupted: {len(result) - len(result.pending)} of {len(result)} cases are kept in "
            f"{path}; continue with --resume (resume=True)"
        )
        raise StudyInterrupted(text, result) from None
    return open_sweep(path)
