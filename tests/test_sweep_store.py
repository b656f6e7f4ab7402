"""The store of a sweep: what a row holds, how the file can be unusable; designs; costs."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy import stats
from studies.sweeps.forecast import SweepCosts, forecast

import hexapod_pin as hp
from hexapod_pin.errors import (
    OtherStudyError,
    StoreExistsError,
    StoreFullError,
    StoreLockedError,
    SweepStoreError,
)
from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.runs import runner as runner_module
from hexapod_pin.study.runs.outcome import from_bytes, to_bytes
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.store_file import store_errors
from hexapod_pin.study.runs.store_reading import DAMAGED, NOT_RUN
from hexapod_pin.study.runs.store_schema import checksum, stored_rows, study_sum
from hexapod_pin.study.runs.task import case_outcomes
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.study.sweep.design import KINDS, Design
from hexapod_pin.study.sweep.distributions import (
    Choice,
    Distribution,
    LogNormal,
    Normal,
    Triangular,
    Uniform,
)
from tests.sweep_studies import adaptive_study, require_same_bits, small_study, study_text

STUDY = small_study(1)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=1)


@pytest.fixture
def done(tmp_path: Path, whole: SweepResult) -> Path:
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    return path


def _edit(path: Path, statement: str) -> None:
    with contextlib.closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(statement)


def test_numbers_of_a_case_are_those_of_its_summary(tmp_path: Path) -> None:
    study = adaptive_study()
    outcomes = list(case_outcomes(study, range(3), 1))
    assert from_bytes(to_bytes(outcomes)) == outcomes  # as workers send them
    dataset = run_sweep(study, tmp_path / "a.db", threads=1).dataset
    with contextlib.closing(sqlite3.connect(tmp_path / "a.db")) as file:
        own_digests = [row[0] for row in file.execute("SELECT digest FROM cases ORDER BY number")]
        assert file.execute("PRAGMA journal_mode").fetchone() == ("delete",)
    assert [path.name for path in tmp_path.iterdir()] == ["a.db"]  # and no log beside it
    for index in range(3):
        case = study.case(index)
        summary = hp.simulate_batch([case], keep="summary")[0]
        own = dataset.isel(case=index)
        for name, value in summary.data.items():
            if name == "path":
                np.testing.assert_array_equal(own["path"], summary.path)
            elif value is not None:
                np.testing.assert_array_equal(own[name], np.array(value, dtype=float))
        assert case.digest == own_digests[index]
        budget = hp.torque_budget(summary)
        assert float(own["measured_speed"]) == budget.measured_speed
        assert float(own["cost_of_transport"]) == pytest.approx(budget.cost_of_transport, rel=1e-12)
        assert float(own["total_mass"]) == case.scene.total_mass
        row, of_kind = budget.kind("tibia"), own.sel(kind="tibia")
        assert float(of_kind["kind_torque_peak"]) == row.peak.torque_peak
        assert float(of_kind["kind_torque_rms"]) == row.rms.torque_rms


def test_while_it_is_written_the_log_is_synchronous_and_readers_see_commits(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY) as store:
        with refused(StoreLockedError, path=str(path)) as caught:
            run_sweep(STUDY, path, resume=True)
        assert caught.value.__cause__ is None  # this process knows: the system is not asked
        assert store.connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert store.connection.execute("PRAGMA synchronous").fetchone() == (2,)  # FULL
        first = next(case_outcomes(STUDY, [1], 1))
        assert store.add([first]) == [1]
        assert store.add([first]) == []  # the first stays
        seen = hp.study.open_sweep(path)
        assert (seen.done, seen.pending) == (1, [0, 2])
        assert seen.dataset["reason"].values.tolist() == ["not run", "", "not run"]
        points = [STUDY.point(k) for k in range(3)]  # inputs of all cases are kept from the start
        assert seen.dataset["payload"].values.tolist() == [point["payload"] for point in points]
        assert seen.dataset["mu"].values.tolist() == [point["mu"] for point in points]
        assert seen.dataset["payload"].attrs["units"] == "kg"
        about = json.loads(seen.dataset.attrs["inputs"])
        assert [(x["name"], x["grid"]) for x in about] == [("payload", True), ("mu", False)]


def test_other_cases_are_not_mixed(done: Path) -> None:
    """Those of another study, another release, or of a file that has changed since."""
    with refused(StoreExistsError, path=str(done), kept=3, about=("3", "--resume", "resume=True")):
        run_sweep(STUDY, done)
    other = small_study(1, seed=8)
    digests = STUDY.digest, other.digest
    with refused(OtherStudyError, stored=digests[0], given=digests[1], about=digests):
        run_sweep(other, done, resume=True)
    changed = done.with_name("changed.db")
    with SweepStore(changed, STUDY) as store:
        store.add([replace(one, digest="x") for one in case_outcomes(STUDY, [0], 1)])
    with refused(OtherStudyError, stored="x", given=STUDY.case(0).digest):
        run_sweep(STUDY, changed, resume=True)
    value = '{"pin": "1"}'
    _edit(done, f"UPDATE meta SET value = '{value}' WHERE key = 'versions'")
    with refused(OtherStudyError, path=str(done), stored=value):
        run_sweep(STUDY, done, resume=True)


def test_a_newer_schema_and_other_databases_are_refused(done: Path) -> None:
    _edit(done, "PRAGMA user_version = 9")
    for open_it in (hp.study.open_sweep, lambda path: run_sweep(STUDY, path, resume=True)):
        with refused(SweepStoreError, path=str(done), about=("9", "1")):
            open_it(done)
    other = done.with_name("other.db")
    _edit(other, "CREATE TABLE mine (a)")
    with refused(SweepStoreError, path=str(other), about=("SQLite",)) as caught:
        run_sweep(STUDY, other, resume=True)
    assert ".recover" not in str(caught.value)  # it is not damaged


def test_a_damaged_file_is_refused(done: Path) -> None:
    whole = done.read_bytes()
    for content in (whole[: len(whole) // 2], b"no database at all" * 99):
        done.write_bytes(content)
        for open_it in (hp.study.open_sweep, lambda path: run_sweep(STUDY, path, resume=True)):
            with refused(SweepStoreError, path=str(done), about=("sqlite3 FILE .recover",)):
                open_it(done)
        assert done.read_bytes() == content  # left as it was
    none = done.with_name("none.db")
    with refused(SweepStoreError, path=str(none)) as caught:
        hp.study.open_sweep(none)
    assert isinstance(caught.value.__cause__, FileNotFoundError)
    none.touch()
    with refused(SweepStoreError, path=str(none), kept=None, about=("nothing",)):
        hp.study.open_sweep(none)
    assert run_sweep(STUDY, none, threads=1).done == 3


@pytest.mark.parametrize("draws", [0, 1])
def test_who_goes_on_takes_the_drawn_values_from_the_store(
    draws: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The library that draws takes a second to read; texts do not tell kinds apart: drawn again."""
    gaits = '[[vary]]\ninput = "gait"\ndistribution = "choice"\nvalues = ["tripod"]\n'
    text, drawn = study_text(2, more=gaits * draws), []
    study = SweepStudy.from_toml(text)
    path = run_sweep(study, tmp_path / "a.db").path
    whole, cube = hp.study.open_sweep(path).dataset, Design.cube
    _edit(path, "DELETE FROM cases WHERE number IN (1, 4)")
    monkeypatch.setattr(Design, "cube", lambda *given: drawn.append(1) or cube(*given))
    again = SweepStudy.from_toml(text)
    require_same_bits(run_sweep(again, path, resume=True, threads=1).dataset, whole)
    assert len(drawn) == draws
    assert [again.point(k) for k in range(6)] == [study.point(k) for k in range(6)]


def test_a_full_disk_keeps_what_was_committed(tmp_path: Path) -> None:
    study, path = small_study(2), tmp_path / "a.db"
    with SweepStore(path, study) as store:
        outcomes = list(case_outcomes(study, range(6), 1))
        pages = store.connection.execute("PRAGMA page_count").fetchone()[0]
        store.connection.execute(f"PRAGMA max_page_count = {pages + 6}")
        with refused(StoreFullError, path=str(path), about=("--resume",)) as caught:
            for outcome in outcomes:
                store.add([outcome])
        kept = len(store.finished)
        assert 0 < kept < 6 and caught.value.kept == kept
    assert hp.study.open_sweep(path).done == kept
    whole = run_sweep(study, tmp_path / "b.db")
    require_same_bits(run_sweep(study, path, resume=True).dataset, whole.dataset)


def test_a_full_disk_is_called_full(tmp_path: Path, monkeypatch: Any) -> None:
    for text, code, free, files, most, full in (
        ("database or disk is full", 13, 1 << 30, 9, -1, True),
        ("disk I/O error", None, 4096, 9, -1, True),
        ("unable to open database file", 14, 1 << 30, 0, -1, True),  # no room for a name
        ("disk I/O error", 10, 1 << 30, 9, -1, False),
        ("disk I/O error", 10, 1 << 30, 9, 60_000, True),  # no file may grow
    ):
        monkeypatch.setattr(resource, "getrlimit", lambda _, most=most: (most, most))
        disk = SimpleNamespace(f_bavail=free // 4096, f_frsize=4096, f_files=10, f_favail=files)
        monkeypatch.setattr(os, "statvfs", lambda _, disk=disk: disk)
        fault = sqlite3.OperationalError(text)
        if code is not None:
            fault.sqlite_errorcode = code
        with pytest.raises(SweepStoreError) as error, store_errors(tmp_path / "a.db", 7):
            raise fault
        assert isinstance(error.value, StoreFullError) is full and error.value.kept == 7


DAMAGES = (
    *(f"DELETE FROM {table}" for table in ("meta", "inputs", "texts", "cases")),
    *(f"UPDATE meta SET value = {value} WHERE key = '{key}'"
      for key in ("cases", "digest", "quantities", "study") for value in ("5", "'[]'")),
    *(f"UPDATE inputs SET {one}" for one in ("place = 7 - place", "about = '{}'", "numbers = x''")),
    "UPDATE texts SET text = text || 'x'",
    "UPDATE cases SET number = -1 - number",
    "UPDATE cases SET digest = (SELECT digest FROM cases WHERE number = 2)",
    *(f"UPDATE cases SET {column} = {value} WHERE number = 1"
      for column in ("state", "reason", "labels", "counters", "numbers", "wall_time")
      for value in ("NULL", "'text'", "zeroblob(8)")),
)  # fmt: skip


def _damage(path: Path, statement: str, *, forged: bool) -> bool:
    """Damage a store; where `forged`, with checksums that fit. Return whether SQLite took it."""
    with contextlib.closing(sqlite3.connect(path)) as connection:
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
    return True


def _require_right(found: SweepResult, whole: SweepResult) -> None:
    """Fail unless a store tells nothing wrong: cases are right, or named as damaged or not run."""
    assert found.dataset.attrs["study_digest"] == whole.dataset.attrs["study_digest"]
    reasons = found.dataset["reason"].values
    assert {*reasons} <= {"", DAMAGED, NOT_RUN}
    right = np.flatnonzero(reasons == "")
    for name in ("torque_peak", "path", "mu", "verdict") if right.size else ():
        assert found.dataset[name][right].equals(whole.dataset[name][right])


@pytest.mark.slow
@pytest.mark.parametrize("forged", [False, True])
def test_damage_of_any_kind_is_refused_named_or_run_again(
    done: Path, whole: SweepResult, monkeypatch: Any, forged: bool
) -> None:
    """Rows whose checksums were made to fit raise typed errors, or are read."""
    outcomes = {one.index: one for one in case_outcomes(STUDY, range(3), 1)}  # not run each time
    monkeypatch.setattr(
        runner_module, "case_outcomes", lambda _, wanted, __: (outcomes[k] for k in wanted)
    )
    named = repaired = 0
    for statement in DAMAGES:
        done.write_bytes(whole.path.read_bytes())
        if not _damage(done, statement, forged=forged):
            continue
        with contextlib.suppress(SweepStoreError):
            found = hp.study.open_sweep(done)
            assert found.dataset is not None
            if not forged:
                _require_right(found, whole)
                named += DAMAGED in {*found.dataset["reason"].values}
        with contextlib.suppress(SweepStoreError):
            again = run_sweep(STUDY, done, resume=True)
            assert again.columns is not None
            if not forged:
                require_same_bits(again.dataset, whole.dataset)
                repaired += 1
    assert forged or (repaired > 20 and named > 10)


def test_tables_of_another_make_are_refused(done: Path) -> None:
    with contextlib.closing(sqlite3.connect(done)) as connection:
        connection.executescript(  # a view without end, which would be read for ever
            "DROP TABLE cases; CREATE VIEW cases AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL "
            "SELECT k + 1 FROM n) SELECT k AS number FROM n"
        )
    before = done.read_bytes()
    for call in (hp.study.open_sweep, lambda path: run_sweep(STUDY, path, resume=True)):
        with pytest.raises(SweepStoreError):
            call(done)
    assert done.read_bytes() == before


SHARES = np.linspace(0.001, 0.999, 41)


@pytest.mark.parametrize(
    ("ours", "reference"),
    [
        (Uniform(low=0.4, high=0.9), stats.uniform(0.4, 0.5)),
        (Triangular(low=-1.0, mode=0.5, high=2.0), stats.triang(0.5, -1.0, 3.0)),
        (Normal(mean=3.0, deviation=0.5), stats.norm(3.0, 0.5)),
        (Normal(mean=3.0, deviation=0.5, low=2.8, high=4.0), stats.truncnorm(-0.4, 2.0, 3.0, 0.5)),
        (LogNormal(median=2.0, factor=1.5), stats.lognorm(np.log(1.5), scale=2.0)),
    ],
)
def test_quantiles_are_those_of_scipy(ours: Distribution, reference: Any) -> None:
    np.testing.assert_allclose(ours.draw(SHARES), reference.ppf(SHARES), rtol=1e-10)


def test_a_truncated_lognormal() -> None:
    """Between its ends it keeps the shape of the whole one, in the logarithm."""
    found = LogNormal(median=1.0, factor=2.0, low=0.5, high=4.0)
    z = stats.truncnorm(-1.0, 2.0).ppf(SHARES)
    np.testing.assert_allclose(found.draw(SHARES), 2.0**z, rtol=1e-10)


def test_ends_of_the_interval_have_values() -> None:
    ends = np.array([0.0, 1.0])
    assert np.isfinite(np.array(Normal(mean=0.0, deviation=1.0).draw(ends), dtype=float)).all()
    low, high = Uniform(low=1.0 / 3.0, high=2.0 / 3.0).draw(ends)
    assert 1.0 / 3.0 <= float(low) < float(high) <= 2.0 / 3.0
    found = Choice(values=("wave", "tripod", "ripple")).draw((np.arange(300) + 0.5) / 300)
    assert [found.count(name) for name in ("wave", "tripod", "ripple")] == [100] * 3


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_repeats_a_design(kind: str) -> None:
    cubes = [Design(kind=kind, samples=16, seed=seed).cube(3) for seed in (5, 5, 6)]
    assert np.array_equal(cubes[0], cubes[1])
    assert not np.array_equal(cubes[0], cubes[2])
    rows = 16 * (3 + 2) if kind == "sobol-indices" else 16
    assert cubes[0].shape == (rows, 3) == (Design(kind=kind, samples=16).rows(3), 3)
    assert (cubes[0] >= 0.0).all() and (cubes[0] <= 1.0).all()
    if kind in ("sobol", "latin-hypercube"):  # one point in each of n equal parts of every axis
        for column in cubes[0].T:
            assert sorted(np.floor(16 * column).astype(int)) == list(range(16))


def test_an_unreadable_table_of_directions_is_an_error() -> None:
    """SciPy continues without the table and draws the same point again and again."""
    code = (
        "import resource, scipy.stats.qmc; from hexapod_pin.study.sweep.design import Design\n"
        "Design(kind='random', samples=4).cube(2)  # loads what all kinds use\n"
        "resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))\n"
        "Design(kind='sobol', samples=4).cube(2)"
    )
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    said = "ResourceError: SciPy's table of Sobol's directions: it cannot be read"
    assert said in done.stderr and "Too many open files" in done.stderr


def test_saltelli_matrices() -> None:
    """AB_i is A but for column i, which is that of B; A and B share no point."""
    n, d = 8, 3
    blocks = Design(kind="sobol-indices", samples=n, seed=1).cube(d).reshape(d + 2, n, d)
    a, b, mixed = blocks[0], blocks[1], blocks[2:]
    assert not (a == b).any()
    for i in range(d):
        others = [k for k in range(d) if k != i]
        assert np.array_equal(mixed[i][:, others], a[:, others])
        assert np.array_equal(mixed[i][:, i], b[:, i])


COSTS = SweepCosts(
    case=0.05, worker_memory=2e8, task_bytes=2000.0, task_case_bytes=5.0, result_bytes=5000.0,
    store_bytes=5500.0, scheduler_task=4e-3, scheduler_case=1e-4, parent_task=1e-3,
    parent_case=4e-4, parent_memory=1e8, dataset_memory=3e4,
)  # fmt: skip


def test_forecasts_of_each_limit() -> None:
    """1e6 cases of 50 ms: 25000 s on 2 cores, 4.4 ms for each of 250000 tasks on any number."""
    found = forecast(COSTS, 1_000_000, 2, 4)
    assert found.limit == "cores"
    assert found.core_hours == pytest.approx(1e6 * 0.05 / 3600)
    assert found.scheduler_load == pytest.approx(250_000 * 4.4e-3 / 25_000)
    assert found.parent_load == pytest.approx(250_000 * 2.6e-3 / 25_000)
    assert found.messages == pytest.approx(6 * 10.0)  # 40 cases/s in tasks of 4
    found = forecast(COSTS, 1_000_000, 1000, 4)
    assert found.limit == "scheduler"
    assert found.seconds == pytest.approx(0.2 + 1100.0)  # the first results come after a task
    parent = forecast(COSTS, 1_000_000, 1000, 250)  # 101 ms for each of 4000
    assert parent.limit == "parent" and parent.seconds == pytest.approx(12.5 + 404.0)
