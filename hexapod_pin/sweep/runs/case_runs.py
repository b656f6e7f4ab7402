"""Cases of a study on threads of the native core, made as they are needed."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from typing import TYPE_CHECKING

from hexapod_pin.simulation.batch_runs import BatchRuns
from hexapod_pin.simulation.case import Case
from hexapod_pin.sweep.runs.outcome import Outcome, outcome_of

if TYPE_CHECKING:
    from hexapod_pin.sweep.study import SweepStudy


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

    runs = BatchRuns(cases(), threads, record=False, texts=False)
    for place, result in runs.results():
        index, case = under_way.pop(place)
        yield outcome_of(index, case, result)


def _case(study: SweepStudy, index: int) -> Case | Exception:
    """Return a case, or why it cannot be: whatever that is, it concerns no other case."""
    try:
        return study.case(index)
    except Exception as error:
        return error.with_traceback(None)
