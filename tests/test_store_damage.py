"""Stores on full disks, and stores whose rows or tables are damaged."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.errors import (
    StoreFullError,
    SweepStoreError,
)
from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.runs import runner as runner_module
from hexapod_pin.study.runs.outcome import Outcome
from hexapod_pin.study.runs.store_file import store_errors
from hexapod_pin.study.runs.store_reading import DAMAGED, NOT_RUN
from hexapod_pin.study.runs.store_schema import MetaTexts, checksum, stored_rows, study_sum
from hexapod_pin.study.runs.task import case_outcomes
from tests.sweep_studies import require_same_bits, small_study

STUDY = small_study(1)
PATIENCE = 60.0
"""Longest wait for anything: a process that waits for a pipe would wait for ever [s]."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """The undisturbed sweep of three cases."""
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=1)


@pytest.fixture(scope="module")
def outcomes() -> dict[int, Outcome]:
    """What becomes of its cases."""
    return {one.index: one for one in case_outcomes(STUDY, range(3), 1)}


# full disks


def _sqlite_error(text: str, code: int | None) -> sqlite3.OperationalError:
    error = sqlite3.OperationalError(text)
    if code is not None:
        error.sqlite_errorcode = code
    return error


@pytest.mark.parametrize(
    ("text", "code", "free", "files", "full"),
    [
        ("database or disk is full", 13, 1 << 30, 9, True),
        ("database or disk is full", None, 1 << 30, 9, True),
        ("disk I/O error", 10, 4096, 9, True),
        ("disk I/O error", 4874, 4096, 9, True),  # its shared memory
        ("disk I/O error", None, 4096, 9, True),
        ("unable to open database file", 14, 1 << 30, 0, True),  # no room for the name of a file
        ("disk I/O error", 10, 1 << 30, 9, False),
        ("unable to open database file", 14, 1 << 30, 9, False),
        ("full of something else", 1, 4096, 9, False),
    ],
)
def test_a_full_disk_is_called_full(
    tmp_path: Path, monkeypatch: Any, text: str, code: int | None, free: int, files: int, full: bool
) -> None:
    disk = SimpleNamespace(f_bavail=free // 4096, f_frsize=4096, f_files=10, f_favail=files)
    monkeypatch.setattr(os, "statvfs", lambda _: disk)
    with pytest.raises(SweepStoreError) as error, store_errors(tmp_path / "a.db", 7):
        raise _sqlite_error(text, code)
    assert isinstance(error.value, StoreFullError) is full
    assert error.value.kept == 7


SIZES = (0, 60, 5_000, 40_000, 60_000)
"""Of files, as large as they may be [bytes]: from the lock to the log, what cannot be written."""

SHORT_FILES = """
import resource, sys
from tests.sweep_studies import small_study
from hexapod_pin.study.runs import run_sweep
for most in map(int, sys.argv[1:]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    try: run_sweep(small_study(1), f"{most}/a.db", threads=1); print("done")
    except Exception as error: print(type(error).__name__)
"""


def test_a_file_that_may_not_grow_is_called_full_and_leaves_nothing(tmp_path: Path) -> None:
    """One process meets one limit after the other, each in a folder of its own."""
    sizes = [str(most) for most in SIZES]
    for size in sizes:
        (tmp_path / size).mkdir()
    root = str(Path(__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", SHORT_FILES, *sizes], check=True, text=True,
        capture_output=True, timeout=PATIENCE, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": root,
             "PYTHONDONTWRITEBYTECODE": "1"},  # else modules are cut off at that size
    )  # fmt: skip
    assert done.stdout.split() == ["StoreFullError"] * len(SIZES), done
    assert [list((tmp_path / size).iterdir()) for size in sizes] == [[]] * len(SIZES)


# damaged rows


TABLES = {
    "meta": ("key", "value"),
    "inputs": ("place", "about", "numbers", "texts"),
    "texts": ("id", "text"),
    "cases": ("number", "digest", "state", "reason", "verdict", "labels", "assumed", "counters",
              "numbers", "sum", "wall_time"),
}  # fmt: skip

VALUES = ("NULL", "5", "-9223372036854775808", "9223372036854775807", "2.5", "9e999", "'5'",
          "'text'", "''", "'[]'", "'{}'", "x''", "CAST(x'fffe' AS TEXT)", "zeroblob(8)",
          "char(0)")  # fmt: skip
"""A value of every type that SQLite knows, and some that are read as others."""


def _damages(table: str, *, apart: bool = True) -> Iterator[str]:
    """Yield what may be done to a table: to one row, to all of them, and to their keys.

    Unless `apart`, each of the three cases gets a value of its own.
    """
    yield f"DELETE FROM {table}"
    yield f"DELETE FROM {table} WHERE rowid = (SELECT max(rowid) FROM {table})" * (table != "meta")
    for column in TABLES[table]:
        keyed = apart or table != "cases" or column == "number"
        for value in VALUES if keyed else ():
            yield f"UPDATE OR IGNORE {table} SET {column} = {value}"
        for k in () if keyed else range(0, len(VALUES), 3):
            whens = " ".join(f"WHEN {row} THEN {x}" for row, x in enumerate(VALUES[k : k + 3]))
            yield f"UPDATE OR IGNORE cases SET {column} = CASE number {whens} ELSE {column} END"
        if table != "meta":
            yield f"UPDATE OR IGNORE {table} SET {column} = {column} || 'x' WHERE rowid = 1"
    if table == "meta":
        for key in MetaTexts.model_fields:
            yield f"DELETE FROM meta WHERE key = '{key}'"
            for value in VALUES if apart else VALUES[::6]:  # the sum over all of them is wrong
                yield f"UPDATE OR IGNORE meta SET value = {value} WHERE key = '{key}'"
        yield "INSERT INTO meta VALUES ('more', 'x')"
    if table == "inputs":
        yield "UPDATE inputs SET place = 7 - place"
        yield "INSERT INTO inputs SELECT place + 9, about, numbers, texts FROM inputs"
    if table == "cases":
        yield "UPDATE cases SET number = number + 1 WHERE number = 2"
        yield "UPDATE cases SET number = -1 - number"
        yield "UPDATE cases SET digest = (SELECT digest FROM cases WHERE number = 2)"


def _damage(path: Path, statement: str, *, forged: bool) -> bool:
    """Damage a store; where `forged`, with checksums that fit. Return whether SQLite took it."""
    connection = sqlite3.connect(path)
    connection.text_factory = lambda data: data.decode("utf-8", "replace")
    connection.execute("PRAGMA synchronous = OFF")
    try:
        with connection:
            connection.execute(statement)
            if forged and "cases" in statement:
                sums = [(checksum(*row), row.number) for row, _ in stored_rows(connection)]
                connection.executemany("UPDATE cases SET sum = ? WHERE number = ?", sums)
            elif forged:
                total = study_sum(connection)
                connection.execute("UPDATE meta SET value = ? WHERE key = 'sum'", (total,))
    except sqlite3.IntegrityError:
        return False
    finally:
        connection.close()
    return True


def _recorded(outcomes: dict[int, Outcome]) -> Callable[..., Any]:
    """Return what stands for `case_outcomes`: the cases have been run before."""

    def again(_study: Any, indices: Iterable[int], _threads: int) -> Iterator[Outcome]:
        yield from (outcomes[index] for index in indices)

    return again


def _require_right(found: SweepResult, whole: SweepResult) -> None:
    """Fail unless a store tells nothing wrong: cases are right, or named as damaged or not run."""
    assert list(found.dataset.coords) == list(whole.dataset.coords)
    for key in ("study", "study_digest", "study_name", "inputs", "versions"):
        assert found.dataset.attrs[key] == whole.dataset.attrs[key]
    reasons = found.dataset["reason"].values
    assert {*reasons} <= {"", DAMAGED, NOT_RUN}
    right = np.flatnonzero(reasons == "")
    for name, array in whole.dataset.variables.items():
        if right.size and (array.dtype.kind == "f" or name == "verdict"):
            got, wanted = (one.isel(case=right) for one in (found.dataset.variables[name], array))
            np.testing.assert_array_equal(got.values, wanted.values)


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES)
def test_damage_of_any_kind_is_refused_named_or_run_again(
    tmp_path: Path, whole: SweepResult, outcomes: Any, monkeypatch: Any, table: str
) -> None:
    """Every column of every table, with values of every type; rows that are gone."""
    monkeypatch.setattr(runner_module, "case_outcomes", _recorded(outcomes))
    path, repaired = tmp_path / "a.db", 0
    for statement in filter(None, _damages(table, apart=False)):
        path.write_bytes(whole.path.read_bytes())
        if not _damage(path, statement, forged=False):
            continue
        with contextlib.suppress(SweepStoreError):
            _require_right(hp.study.open_sweep(path), whole)
        with contextlib.suppress(SweepStoreError):
            require_same_bits(run_sweep(STUDY, path, resume=True).dataset, whole.dataset)
            repaired += 1
    assert repaired > (20 if table != "texts" else 5)


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES)
def test_rows_whose_checksums_were_made_to_fit_raise_typed_errors(
    tmp_path: Path, whole: SweepResult, outcomes: Any, monkeypatch: Any, table: str
) -> None:
    """The columns of a sweep that went on become a dataset as those of one that was opened do."""
    monkeypatch.setattr(runner_module, "case_outcomes", _recorded(outcomes))
    path = tmp_path / "a.db"
    for statement in filter(None, _damages(table)):
        path.write_bytes(whole.path.read_bytes())
        if not _damage(path, statement, forged=True):
            continue
        with contextlib.suppress(SweepStoreError):
            assert hp.study.open_sweep(path).dataset is not None
        with contextlib.suppress(SweepStoreError):
            assert run_sweep(STUDY, path, resume=True).columns is not None


def test_inputs_that_are_missing_are_refused_and_written_again(
    tmp_path: Path, whole: SweepResult
) -> None:
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    assert _damage(path, "DELETE FROM inputs", forged=False)
    with pytest.raises(SweepStoreError):
        hp.study.open_sweep(path)
    require_same_bits(run_sweep(STUDY, path, resume=True).dataset, whole.dataset)


@pytest.mark.parametrize(
    "statements",
    [
        "DROP TABLE cases; CREATE VIEW cases AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT "
        "k + 1 FROM n) SELECT k AS number FROM n",
        "CREATE TRIGGER t AFTER INSERT ON cases BEGIN DELETE FROM meta; END",
        "DROP TABLE inputs",
        "ALTER TABLE cases ADD COLUMN more",
    ],
)
def test_tables_of_another_make_are_refused(
    tmp_path: Path, whole: SweepResult, statements: str
) -> None:
    """Such as a view without end, which would be read for ever."""
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    connection = sqlite3.connect(path)
    connection.executescript(statements)
    connection.close()
    before = path.read_bytes()
    for call in (hp.study.open_sweep, lambda path: run_sweep(STUDY, path, resume=True)):
        with pytest.raises(SweepStoreError):
            call(path)
    assert path.read_bytes() == before


def test_a_view_or_an_index_of_ones_own_does_no_harm(tmp_path: Path, whole: SweepResult) -> None:
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    connection = sqlite3.connect(path)
    connection.executescript("CREATE VIEW mine AS SELECT number FROM cases; "
                             "CREATE INDEX own ON cases (state); ANALYZE")  # fmt: skip
    connection.close()
    require_same_bits(run_sweep(STUDY, path, resume=True).dataset, whole.dataset)
