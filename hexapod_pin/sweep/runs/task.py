"""A task is a piece of a sweep for a worker, whose cases run on threads of the native core."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from hexapod_pin.simulation.batch import BatchRuns
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.run_outcome import package_versions
from hexapod_pin.sweep.runs.outcome import Outcome, failure, outcome_of, to_bytes

if TYPE_CHECKING:
    from hexapod_pin.sweep.study import SweepStudy


REFUSAL = b"!"
"""First byte of an answer that is no outcome but says why the worker cannot do the task."""

KEPT_STUDIES = 4
"""Studies that a worker keeps ready."""


class Task(NamedTuple):
    """What a worker needs to run some cases; plain data."""

    text: str  # of the study
    folder: str  # where its paths start
    digest: str  # of the study
    versions: dict[str, str]  # of the packages that results depend on
    indices: list[int]  # of the cases
    threads: int  # of the native core


def task_of(study: SweepStudy, indices: list[int], threads: int) -> Task:
    """Return the task of running some cases of a study."""
    return Task(study.text, study.folder, study.digest, package_versions(), indices, threads)


def run_task(
    text: str,
    folder: str,
    digest: str,
    versions: dict[str, str],
    indices: list[int],
    threads: int = 1,
) -> bytes:
    """Run some cases and return what became of them, in a worker; errors are returned too."""
    try:
        own = package_versions()
        if own != versions:
            return REFUSAL + f"it has {own}, the sweep {versions}".encode()
        study = _study(text, folder)
        if study.digest != digest:
            words = f"the study has the digest {study.digest} there, {digest} here: the robot's or "
            return REFUSAL + (words + "the base case's file differs").encode()
        return to_bytes(sorted(case_outcomes(study, indices, threads), key=lambda o: o.index))
    except Exception as error:
        return REFUSAL + failure(error).encode()


@lru_cache(maxsize=KEPT_STUDIES)
def _study(text: str, folder: str) -> SweepStudy:
    """Return a study; it is read once in a process."""
    from hexapod_pin.sweep.study import SweepStudy

    return SweepStudy.from_toml(text, folder)


# Cases of a study on threads of the native core, made as they are needed.


def case_outcomes(
    study: SweepStudy, indices: Iterable[int], threads: int
) -> Generator[Outcome, None, None]:
    """Yield what becomes of cases, as they finish; a case that cannot be is an outcome too.

    Args:
        study: makes the cases.
        indices: of the cases to run.
        threads: of the native core.
    """
    under_way: dict[int, tuple[int, Case | Exception]] = {}

    def cases() -> Iterator[Case | Exception]:
        for place, index in enumerate(indices):
            case = _case(study, index)
            under_way[place] = (index, case)
            yield case

    runs = BatchRuns(cases(), threads, record=False)
    for place, result in runs.results():
        index, case = under_way.pop(place)
        yield outcome_of(index, case, result)


def _case(study: SweepStudy, index: int) -> Case | Exception:
    """Return a case, or why it cannot be: whatever that is, it concerns no other case."""
    try:
        return study.case(index)
    except Exception as error:
        return error.with_traceback(None)
