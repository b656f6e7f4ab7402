"""Stores for one writer: new or resumed, every case on the disk at once.

`RowStore` holds rows of any studies by what identifies them; `SweepStore` the cases of one sweep by
their place in it. Both are files of the same kind.
"""

from __future__ import annotations

import json
import os
import sqlite3
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from hexapod_pin.errors import (
    OtherStudyError,
    ParameterError,
    SimulationInterrupted,
    StoreExistsError,
)
from hexapod_pin.simulation.run_outcome import package_versions
from hexapod_pin.stop_signals import unbroken
from hexapod_pin.study.runs.outcome import Outcome, quantities
from hexapod_pin.study.runs.store_file import (
    DONE,
    FAILED,
    connect,
    damaged,
    make_single,
    store_errors,
)
from hexapod_pin.study.runs.store_guard import create, remove, require_own_file
from hexapod_pin.study.runs.store_lock import StoreLock
from hexapod_pin.study.runs.store_schema import (
    ROWS,
    CaseRow,
    input_columns,
    is_of_rows,
    read_inputs,
    read_meta,
    row_of,
    stored_rows,
    study_sum,
    write_meta,
    write_rows,
)
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.study.sweep import SweepStudy

CHECKED_CASES = 3
"""Cases whose digests are compared before a sweep is resumed."""

Kind = TypeVar("Kind", bound="Store")
"""A kind of store."""


class Store(ABC):
    """A store, open for writing; a context that closes it.

    Attributes:
        path: of the file.
        finished: what identifies the cases that it holds.
    """

    finished: Collection[Any]
    noun = "rows of studies"

    def __init__(self, path: str | Path, *, resume: bool = False, retry: bool = False) -> None:
        """Begin a store, or resume one.

        Args:
            path: of the file.
            resume: whether an existing store of the same study is resumed.
            retry: whether failed cases are forgotten, so that they are run again.

        Raises:
            StoreExistsError: there is a store, and `resume` is False.
            StoreLockedError: another process writes to it.
            OtherStudyError: it is the store of another study, or of other versions.
            StoreFullError: the disk is full.
            SweepStoreError: it is damaged, no store, of a newer schema, or cannot be written.
        """
        self.path = user_path(path).absolute()
        if os.path.lexists(self.path):
            require_own_file(self.path, write=True)
        self.lock = StoreLock(self.path)
        self.texts: dict[str, int] = {}
        self.created: os.stat_result | None = None
        try:
            with unbroken():
                self.created = create(self.path)
            self._open(resume, retry)
        except BaseException:
            self._remove_new()
            self.lock.release()
            raise

    def _open(self, resume: bool, retry: bool) -> None:
        self.connection = connect(self.path, write=True)
        try:
            with store_errors(self.path):
                if not self._count("meta") + self._count("inputs") + self._count("cases"):
                    self._begin()
                elif self._count("cases") and not resume:
                    raise self._exists()
                else:
                    self._go_on()
                if retry:
                    self.connection.execute("DELETE FROM cases WHERE state = ?", (FAILED,))
            self._read_finished()
        except BaseException:
            self.connection.close()
            raise

    def _remove_new(self) -> None:
        """Remove a store that was created here, so that the same study may be begun again."""
        if self.created is not None:
            remove(self.path, self.created)

    def _exists(self) -> StoreExistsError:
        kept = self._count()
        return StoreExistsError(
            str(self.path), f"holds {self.noun} already, {kept} cases of it finished: continue "
            "it with --resume (resume=True), or remove it, or name another store.", kept,
        )  # fmt: skip

    def _count(self, table: str = "cases") -> int:
        return int(self.connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])

    @abstractmethod
    def _begin(self) -> None:
        """Write down what a new store is for."""

    @abstractmethod
    def _go_on(self) -> None:
        """Refuse a store that is for something else."""

    @abstractmethod
    def _read_finished(self) -> None:
        """Find which cases need not be run."""

    def _intact_rows(self, check: Callable[[list[CaseRow]], None] | None = None) -> list[CaseRow]:
        """Return the rows without their numbers; damaged ones are forgotten, and run again.

        Args:
            check: refuses the store by its rows, before anything is forgotten.
        """
        with store_errors(self.path):
            rows = [(row._replace(numbers=b""), intact)
                    for row, intact in stored_rows(self.connection)]  # fmt: skip
            good = [row for row, intact in rows if intact]
            if check is not None:
                check(good)
            bad = [(row.number,) for row, intact in rows if not intact]
            with self.connection:
                self.connection.execute("BEGIN IMMEDIATE")
                self.connection.executemany("DELETE FROM cases WHERE number = ?", bad)
            return good

    def _write(self, rows: list[CaseRow]) -> None:
        """Put rows on the disk, all or none."""
        with store_errors(self.path, len(self.finished)), self.connection:
            self.connection.execute("BEGIN IMMEDIATE")
            known = dict(self.texts)
            write_rows(self.connection, rows, known)
        self.texts = known

    def __enter__(self: Kind) -> Kind:
        """Return the store."""
        return self

    def __exit__(
        self, kind: object, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close the file and give the lock back; a store that an error leaves empty is removed."""
        stopped = isinstance(error, KeyboardInterrupt | SimulationInterrupted)
        try:
            make_single(self.connection, self.path)
            self.connection.close()
        except sqlite3.Error:
            pass  # all that was committed is in the file or its log
        finally:
            if error is not None and not stopped and not self.finished:
                self._remove_new()
            self.lock.release()


class SweepStore(Store):
    """The store of a sweep, by the places of its cases."""

    finished: set[int]
    noun = "a sweep"

    def __init__(
        self, path: str | Path, study: SweepStudy, *, resume: bool = False, retry: bool = False
    ) -> None:
        """Begin or resume; see `Store`. `study`: whose cases it holds."""
        self.study = study
        super().__init__(path, resume=resume, retry=retry)

    def _begin(self) -> None:
        """Write down what is swept."""
        study = self.study
        meta = {
            "name": study.name,
            "study": study.text,
            "folder": str(study.folder or ""),
            "digest": study.digest,
            "cases": str(len(study)),
            "versions": json.dumps(package_versions()),
            "quantities": _quantities_text(),
        }
        write_meta(self.connection, meta, input_columns(study))

    def _go_on(self) -> None:
        """Refuse to mix cases of two studies; write a damaged description of the study again."""
        study = self.study
        meta = read_meta(self.connection)
        self._require_same(meta, study)
        try:
            intact = meta.get("sum") == study_sum(self.connection)
            columns = read_inputs(self.connection, len(study)) if intact else []
        except ParameterError:
            intact, columns = False, []
        if not intact:
            self._begin()
            return
        names = {item.name for item in study.uncertain}
        drawn = {one.about["name"]: one.values for one in columns if one.about["name"] in names}
        kinds_known = all(
            values.dtype == float for values in drawn.values()
        )  # texts do not show it
        if kinds_known and names == drawn.keys():
            study._take_drawn({name: drawn[name][: study.rows].tolist() for name in drawn})

    def _require_same(self, meta: Mapping[str, str], study: SweepStudy) -> None:
        """Refuse to mix cases that are not of one study, or whose bits would differ."""
        given = {"digest": study.digest, "versions": json.dumps(package_versions()),
                 "quantities": _quantities_text()}  # fmt: skip
        if is_of_rows(meta):
            raise OtherStudyError(
                str(self.path), "holds rows of other studies, no sweep: name another store.",
                "", study.digest,
            )  # fmt: skip
        for key in given:
            if not isinstance(meta.get(key), str):
                raise damaged(self.path, f"meta.{key} is missing")
        if meta["digest"] != study.digest:
            raise OtherStudyError(
                str(self.path), f"holds the study {meta.get('name')!r} with the digest "
                f"{meta['digest']}, not {study.name!r} with {study.digest}: the study file, or a "
                "file it names, is another. Name another store.", meta["digest"], study.digest,
            )  # fmt: skip
        for key in ("versions", "quantities"):
            if meta[key] != given[key]:
                two = f"{meta[key]}, not {given[key]}"
                what = two if key == "versions" else "other quantities"
                raise OtherStudyError(
                    str(self.path), f"was begun by another release ({what}), whose cases may "
                    "differ in their bits: continue with that one, or name another store.",
                    meta[key], given[key],
                )  # fmt: skip

    def _read_finished(self) -> None:
        self.finished = {row.number for row in self._intact_rows(self._require_same_cases)}

    def _require_same_cases(self, rows: list[CaseRow]) -> None:
        """Refuse to resume where some cases have changed."""
        for row in [one for one in rows if one.state == DONE][:CHECKED_CASES]:
            now = self.study.case(row.number).digest
            if now != row.digest:
                raise OtherStudyError(
                    str(self.path), f"case {row.number} had the digest {row.digest} when it was "
                    f"run, now it has {now}: a file that the study uses has changed. Name another "
                    "store.", row.digest, now,
                )  # fmt: skip

    def add(self, outcomes: Iterable[Outcome]) -> list[int]:
        """Keep outcomes, on the disk when this returns; of a case that is there, the first stays.

        Returns:
            The indices of those that were new.

        Raises:
            StoreFullError: the disk is full; none of these is kept, all before are.
            SweepStoreError: the file cannot be written.
        """
        new = [one for one in outcomes if one.index not in self.finished]
        self._write([row_of(one) for one in new])
        self.finished.update(one.index for one in new)
        return [one.index for one in new]


def _quantities_text() -> str:
    return json.dumps(
        [[name, one.axes, one.unit, one.meaning] for name, one in quantities().items()]
    )


class RowStore(Store):
    """Rows of any studies, by what identifies them (`Measure.key`); column `digest` holds that."""

    finished: dict[str, int]

    def _begin(self) -> None:
        write_meta(self.connection, dict(ROWS))

    def _go_on(self) -> None:
        meta = read_meta(self.connection)
        if meta and not is_of_rows(meta):
            raise OtherStudyError(
                str(self.path), f"holds the sweep {meta.get('name')!r}, not rows of other studies: "
                "name another store.", str(meta.get("digest")), "",
            )  # fmt: skip
        if meta.get("sum") != study_sum(self.connection):
            self._begin()

    def _read_finished(self) -> None:
        self.finished = {row.digest: row.number for row in self._intact_rows()}

    def get(self, key: str) -> Outcome:
        """Return what became of a case that is `finished`."""
        with store_errors(self.path):
            row, intact = next(stored_rows(self.connection, self.finished[key]))
        if not intact:
            raise damaged(self.path, f"row {row.number} was changed while the store was open")
        return Outcome(
            row.number, row.digest, row.reason, labels=row.labels or "", counters=row.counters,
            numbers=row.numbers, wall_time=row.wall_time,
        )  # fmt: skip

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Keep outcomes, on the disk when this returns; of a case that is there, the first stays.

        Raises:
            StoreFullError: the disk is full; none of these is kept, all before are.
            SweepStoreError: the file cannot be written.
        """
        new = {one.digest: one for one in outcomes if one.digest not in self.finished}
        first = 1 + max(self.finished.values(), default=-1)
        self._write([row_of(replace(one, index=first + k)) for k, one in enumerate(new.values())])
        self.finished |= {key: first + k for k, key in enumerate(new)}
