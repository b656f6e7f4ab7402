"""The store of a sweep for its one writer: begun, or gone on with; every case durable at once."""

from __future__ import annotations

import json
import os
import sqlite3
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.errors import OtherStudyError, StoreExistsError, SweepStoreError
from hexapod_pin.simulation.run_meta import package_versions
from hexapod_pin.sweep.runs.case_numbers import quantities
from hexapod_pin.sweep.runs.outcome import Outcome
from hexapod_pin.sweep.runs.store_file import DONE, FAILED, connect, make_single, store_errors
from hexapod_pin.sweep.runs.store_inputs import write_inputs
from hexapod_pin.sweep.runs.store_lock import StoreLock
from hexapod_pin.sweep.runs.store_schema import checked_meta
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.sweep.study import SweepStudy

CHECKED_CASES = 3
"""Cases whose digests are compared before a sweep goes on."""


def crc(outcome: Outcome) -> int:
    """Return the CRC-32 of what of a case must not change unseen."""
    return row_sum(outcome.digest, outcome.counters, outcome.numbers)


def row_sum(digest: str, counters: str, numbers: bytes) -> int:
    """Return the CRC-32 of a row."""
    return zlib.crc32(numbers, zlib.crc32(f"{digest} {counters}".encode()))


class SweepStore:
    """The store of a sweep, open for writing; a context that closes it."""

    def __init__(
        self, path: str | Path, study: SweepStudy, *, resume: bool = False, retry: bool = False
    ) -> None:
        """Begin a store, or go on with one.

        Args:
            path: of the file.
            study: whose cases it holds.
            resume: whether an existing store of the same study is gone on with.
            retry: whether failed cases are forgotten, so that they are run again.

        Raises:
            StoreExistsError: there is a store, and `resume` was not asked for.
            StoreLockedError: another process writes to it.
            OtherStudyError: it is the store of another study, or of other versions.
            StoreFullError: the disk is full.
            SweepStoreError: it is damaged, no store, of a newer schema, or cannot be written.
        """
        self.path = user_path(path)
        if os.path.isdir(self.path):
            raise SweepStoreError(str(self.path), "is a folder; name a file in it.")
        self.lock = StoreLock(self.path)
        self.texts: dict[str, int] = {}
        try:
            self._open(study, resume, retry)
        except BaseException:
            self.lock.release()
            raise

    def _open(self, study: SweepStudy, resume: bool, retry: bool) -> None:
        there = os.path.exists(self.path) and os.path.getsize(self.path) > 0
        self.connection = connect(self.path, write=True)
        try:
            with store_errors(self.path):
                begun = self.connection.execute("SELECT count(*) FROM meta").fetchone()[0] > 0
                if begun and not resume:
                    raise self._exists()
                if begun:
                    self._require_same(study)
                else:
                    self._begin(study)
                if retry:
                    self.connection.execute("DELETE FROM cases WHERE state = ?", (FAILED,))
            self.finished = self._finished(study)
        except BaseException:
            self.connection.close()
            if not there and not self.path.with_name(self.path.name + "-wal").exists():
                self.path.unlink(missing_ok=True)
            raise

    def _exists(self) -> StoreExistsError:
        kept = self._count()
        return StoreExistsError(
            str(self.path), f"holds a sweep already, {kept} cases of it finished: go on with it by "
            "--resume (resume=True), or remove it, or name another store.", kept,
        )  # fmt: skip

    def _begin(self, study: SweepStudy) -> None:
        """Write down what is swept, wholly or not at all."""
        meta = {
            "name": study.name,
            "study": study.text,
            "folder": str(study.folder or ""),
            "digest": study.digest,
            "cases": str(len(study)),
            "versions": json.dumps(package_versions()),
            "quantities": _quantities_text(),
        }
        with self.connection:
            self.connection.execute("BEGIN IMMEDIATE")
            write_inputs(self.connection, study)
            self.connection.executemany("INSERT INTO meta VALUES (?, ?)", meta.items())

    def _require_same(self, study: SweepStudy) -> None:
        """Refuse to mix cases that are not of one study, or whose bits would differ."""
        meta = dict(self.connection.execute("SELECT key, value FROM meta"))
        checked_meta(meta)
        if meta["digest"] != study.digest:
            raise OtherStudyError(
                str(self.path), f"holds the study {meta['name']!r} with the digest "
                f"{meta['digest']}, not {study.name!r} with {study.digest}: the study file, or a "
                "file it names, is another. Name another store.", meta["digest"], study.digest,
            )  # fmt: skip
        now = json.dumps(package_versions())
        for key, given in (("versions", now), ("quantities", _quantities_text())):
            if meta[key] != given:
                what = f"{meta[key]}, not {given}" if key == "versions" else "other quantities"
                raise OtherStudyError(
                    str(self.path), f"was begun by another release ({what}), whose cases may "
                    "differ in their bits: go on with that one, or name another store.",
                    meta[key], given,
                )  # fmt: skip

    def _finished(self, study: SweepStudy) -> set[int]:
        """Return which cases need not be run; damaged rows are forgotten, and run again."""
        with store_errors(self.path):
            sample = self.connection.execute(
                "SELECT number, digest FROM cases WHERE state = ? ORDER BY number LIMIT ?",
                (DONE, CHECKED_CASES),
            ).fetchall()
            for number, digest in sample:
                now = study.case(number).digest
                if now != digest:
                    raise OtherStudyError(
                        str(self.path), f"case {number} had the digest {digest} when it was run, "
                        f"now it has {now}: a file that the study uses has changed. Name another "
                        "store.", digest, now,
                    )  # fmt: skip
            rows = self.connection.execute(
                "SELECT number, digest, counters, numbers, sum FROM cases"
            )
            bad = [row[0] for row in rows if row_sum(*row[1:4]) != row[4]]
            with self.connection:
                self.connection.execute("BEGIN IMMEDIATE")
                self.connection.executemany(
                    "DELETE FROM cases WHERE number = ?", [(number,) for number in bad]
                )
            return {row[0] for row in self.connection.execute("SELECT number FROM cases")}

    def _count(self) -> int:
        return int(self.connection.execute("SELECT count(*) FROM cases").fetchone()[0])

    def add(self, outcomes: Iterable[Outcome]) -> list[int]:
        """Keep outcomes, on the disk when this returns; of a case that is there, the first stays.

        Returns:
            The indices of those that were new.

        Raises:
            StoreFullError: the disk is full; none of these is kept, all before are.
            SweepStoreError: the file cannot be written.
        """
        new = [one for one in outcomes if one.index not in self.finished]
        with store_errors(self.path, len(self.finished)), self.connection:
            self.connection.execute("BEGIN IMMEDIATE")
            known = dict(self.texts)
            self.connection.executemany(
                f"INSERT INTO cases VALUES ({', '.join('?' * 11)})",
                [self._row(one, known) for one in new],
            )
        self.texts = known
        self.finished.update(one.index for one in new)
        return [one.index for one in new]

    def _row(self, one: Outcome, known: dict[str, int]) -> tuple[object, ...]:
        labels, assumed = (self._text(text, known) for text in (one.labels, one.assumed))
        return (
            one.index, one.digest, FAILED if one.reason else DONE, one.reason, one.verdict,
            labels, assumed, one.counters, one.numbers, crc(one), one.wall_time,
        )  # fmt: skip

    def _text(self, text: str, known: dict[str, int]) -> int | None:
        """Return the number of a text that many cases share."""
        if not text:
            return None
        if text not in known:
            self.connection.execute("INSERT OR IGNORE INTO texts (text) VALUES (?)", (text,))
            row = self.connection.execute("SELECT id FROM texts WHERE text = ?", (text,))
            known[text] = int(row.fetchone()[0])
        return known[text]

    def __enter__(self) -> SweepStore:
        """Return the store."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the file and give the lock back."""
        try:
            make_single(self.connection)
            self.connection.close()
        except sqlite3.Error:
            pass  # all that was committed is in the file or its log
        finally:
            self.lock.release()


def _quantities_text() -> str:
    return json.dumps([[name, *entry] for name, entry in quantities().items()])
