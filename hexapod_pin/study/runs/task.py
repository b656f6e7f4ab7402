"""A task is a piece of a study for a worker, whose cases run on threads of the native core."""

from __future__ import annotations

import json
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from hexapod_pin.simulation.batch import BatchRuns
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.case_data import case_from_dict, case_to_dict
from hexapod_pin.simulation.run_outcome import package_versions
from hexapod_pin.simulation.run_settings import WorkLimits
from hexapod_pin.study.runs.measure import Measure, measure_named, pack_error, unpack_error
from hexapod_pin.study.runs.outcome import Outcome, failure, outcome_of, to_bytes

if TYPE_CHECKING:
    from hexapod_pin.results.summary import Summary
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.study.sweep import SweepStudy


REFUSAL = b"!"
"""First byte of an answer without outcomes: the reason why the worker cannot do the task."""

KEPT_STUDIES = 4
"""Studies that a worker keeps ready."""

NO_ROW = "the measure failed"
"""`Outcome.verdict` of a case that was run, but whose row could not be made: a fault of the
study, which is raised and not stored."""


@dataclass(frozen=True)
class CaseList:
    """Cases that a study requests, each with its measure.

    Attributes:
        cases: what is run.
        measures: one for each case.
    """

    cases: Sequence[Case]
    measures: Sequence[Measure[Any]]

    @cached_property
    def keys(self) -> list[str]:
        """What identifies the row of each case.

        Raises:
            ParameterError: a controller cannot be written as data.
        """
        pairs = zip(self.cases, self.measures, strict=True)
        return [measure.key(case) for case, measure in pairs]

    @property
    def record(self) -> bool:
        """Whether a measure needs samples."""
        return any(measure.keep == "trace" for measure in self.measures)

    def case(self, index: int) -> Case:
        """Return a case."""
        return self.cases[index]

    def outcome(self, index: int, case: Case, result: Trace | Summary | Exception) -> Outcome:
        """Return what became of a case, as a store holds it."""
        measure, key = self.measures[index], self.keys[index]
        verdict = ""
        if not isinstance(result, Exception):
            try:
                text, numbers = measure.pack(measure.measured(case, result))
                time = result.run.wall_time or 0.0
                return Outcome(index, key, "", labels=text, numbers=numbers, wall_time=time)
            except Exception as error:
                result, verdict = error, NO_ROW
        return Outcome(index, key, failure(result), verdict, counters=pack_error(result))

    def row(self, index: int, outcome: Outcome) -> Any:
        """Return the row that an outcome holds, or the error that its run has failed with."""
        if outcome.reason:
            return unpack_error(outcome.counters)
        return self.measures[index].unpack(self.cases[index], outcome.labels, outcome.numbers)

    def to_text(self, indices: list[int]) -> str:
        """Return some of the cases as JSON text.

        Raises:
            ParameterError: a controller cannot be written as data.
        """
        found = []
        for k in indices:
            case, measure = self.cases[k], self.measures[k]
            limits = None if case.limits is None else case.limits.model_dump()
            found.append([case_to_dict(case), limits, measure.name, measure.settings, self.keys[k]])
        return json.dumps(found)

    @classmethod
    def from_text(cls, text: str) -> tuple[CaseList, list[str]]:
        """Return the cases of a text, and their keys where they were written."""
        cases, measures, keys = [], [], []
        for data, limits, name, settings, key in json.loads(text):
            case = case_from_dict(Case, data)
            cases.append(case if limits is None else replace(case, limits=WorkLimits(**limits)))
            measures.append(measure_named(name, settings))
            keys.append(key)
        return cls(cases, measures), keys


class Task(NamedTuple):
    """What a worker needs to run some cases; plain data."""

    text: str  # of the study
    folder: str  # where its paths start
    digest: str  # of the study
    versions: dict[str, str]  # of the packages that results depend on
    indices: list[int]  # of the cases
    threads: int  # of the native core
    cases: str = ""  # the cases themselves, where they are not those of a `SweepStudy`


def task_of(work: SweepStudy | CaseList, indices: list[int], threads: int) -> Task:
    """Return the task of running some cases."""
    if isinstance(work, CaseList):
        return Task("", "", "", package_versions(), indices, threads, work.to_text(indices))
    return Task(work.text, work.folder, work.digest, package_versions(), indices, threads)


def run_task(
    text: str,
    folder: str,
    digest: str,
    versions: dict[str, str],
    indices: list[int],
    threads: int = 1,
    cases: str = "",
) -> bytes:
    """Run some cases and return what became of them, in a worker; errors are returned too."""
    try:
        own = package_versions()
        if own != versions:
            return REFUSAL + f"it has {own}, the sweep {versions}".encode()
        if cases:
            return _run_list(cases, indices, threads)
        study = _study(text, folder)
        if study.digest != digest:
            words = f"the study has the digest {study.digest} there, {digest} here: the robot's or "
            return REFUSAL + (words + "the base case's file differs").encode()
        return to_bytes(sorted(case_outcomes(study, indices, threads), key=lambda o: o.index))
    except Exception as error:
        return REFUSAL + failure(error).encode()


def _run_list(text: str, indices: list[int], threads: int) -> bytes:
    """Run the cases of a text; they are numbered by `indices` where they come from."""
    listed, keys = CaseList.from_text(text)
    if listed.keys != keys:
        return REFUSAL + b"the cases have other digests there: a robot's file or the study differs"
    found = case_outcomes(listed, range(len(keys)), threads)
    numbered = [replace(one, index=indices[one.index]) for one in found]
    return to_bytes(sorted(numbered, key=lambda one: one.index))


@lru_cache(maxsize=KEPT_STUDIES)
def _study(text: str, folder: str) -> SweepStudy:
    """Return a study; it is read once in a process."""
    from hexapod_pin.study.sweep import SweepStudy

    return SweepStudy.from_toml(text, folder)


# Cases on threads of the native core, made as they are needed.


def case_outcomes(
    work: SweepStudy | CaseList, indices: Iterable[int], threads: int
) -> Generator[Outcome, None, None]:
    """Yield what becomes of cases, as they finish; a case that cannot be is an outcome too.

    Args:
        work: makes the cases.
        indices: of the cases to run.
        threads: of the native core.
    """
    listed = work if isinstance(work, CaseList) else None
    under_way: dict[int, tuple[int, Case | Exception]] = {}

    def cases() -> Iterator[Case | Exception]:
        for place, index in enumerate(indices):
            case = _case(work, index)
            under_way[place] = (index, case)
            yield case

    runs = BatchRuns(cases(), threads, record=listed is not None and listed.record)
    for place, result in runs.results():
        index, case = under_way.pop(place)
        if listed is not None and isinstance(case, Case):
            yield listed.outcome(index, case, result)
        else:
            yield outcome_of(index, case, result)


def _case(work: SweepStudy | CaseList, index: int) -> Case | Exception:
    """Return a case, or why it cannot be: whatever that is, it concerns no other case."""
    try:
        return work.case(index)
    except Exception as error:
        return error.with_traceback(None)
