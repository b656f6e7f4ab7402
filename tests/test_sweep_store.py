"""The store of a sweep: what a row holds, and every way in which the file can be unusable."""

from __future__ import annotations

import errno
import json
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import (
    OtherStudyError,
    StoreExistsError,
    StoreFullError,
    StoreLockedError,
    SweepStoreError,
    TraceFileError,
)
from hexapod_pin.study.runs import run_sweep
from hexapod_pin.study.runs.outcome import from_bytes, to_bytes
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.store_reading import DAMAGED
from hexapod_pin.study.runs.task import case_outcomes
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.study.sweep.design import Design
from tests.sweep_studies import adaptive_study, require_same_bits, small_study, study_text

STUDY = small_study(1)


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A store with all three cases, as it is on the disk."""
    return run_sweep(STUDY, tmp_path_factory.mktemp("done") / "a.db", threads=1).path.read_bytes()


@pytest.fixture
def done(tmp_path: Path, content: bytes) -> Path:
    """A store with all three cases."""
    path = tmp_path / "a.db"
    path.write_bytes(content)
    return path


def _edit(path: Path, *statements: str) -> None:
    connection = sqlite3.connect(path)
    with connection:
        for statement in statements:
            connection.execute(statement)
    connection.close()


def test_numbers_of_a_case_are_those_of_its_summary(tmp_path: Path) -> None:
    """Every array of the summary, to the bit, and what is found from it."""
    study = adaptive_study()
    dataset = run_sweep(study, tmp_path / "a.db", threads=1).dataset
    for index in range(3):
        case = study.case(index)
        summary = hp.simulate_batch([case], keep="summary")[0]
        own = dataset.isel(case=index)
        for name, value in summary.data.items():
            if name == "path":
                np.testing.assert_array_equal(own["path"], summary.path)
            elif value is not None:
                np.testing.assert_array_equal(own[name], np.array(value, dtype=float))
        budget = hp.torque_budget(summary)
        assert float(own["measured_speed"]) == budget.measured_speed
        assert float(own["cost_of_transport"]) == pytest.approx(budget.cost_of_transport, rel=1e-12)
        assert float(own["total_mass"]) == case.scene.total_mass
        for kind in ("coxa", "femur", "tibia"):
            row, of_kind = budget.kind(kind), own.sel(kind=kind)
            assert float(of_kind["kind_torque_peak"]) == row.peak.torque_peak
            assert float(of_kind["kind_torque_rms"]) == row.rms.torque_rms
            assert float(of_kind["kind_positive_energy"]) == pytest.approx(
                row.positive_energy, rel=1e-12
            )


def test_rows_hold_the_digests_of_their_cases_and_one_file_is_left(done: Path) -> None:
    connection = sqlite3.connect(done)
    rows = connection.execute("SELECT number, digest, state, wall_time FROM cases").fetchall()
    assert [row[:3] for row in rows] == [(k, STUDY.case(k).digest, 1) for k in range(3)]
    assert all(row[3] > 0.0 for row in rows)
    assert connection.execute("PRAGMA journal_mode").fetchone() == ("delete",)
    connection.close()
    assert [path.name for path in done.parent.iterdir()] == ["a.db"]


def test_while_it_is_written_the_log_is_synchronous_and_readers_see_commits(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY) as store:
        assert store.connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert store.connection.execute("PRAGMA synchronous").fetchone() == (2,)  # FULL
        first = next(case_outcomes(STUDY, [1], 1))
        assert store.add([first]) == [1]
        assert store.add([first]) == []  # the first stays
        seen = hp.study.open_sweep(path)
        assert (seen.done, seen.pending) == (1, [0, 2])
        assert seen.dataset["reason"].values.tolist() == ["not run", "", "not run"]


def test_messages_of_workers_keep_every_bit() -> None:
    outcomes = list(case_outcomes(STUDY, range(3), 1))
    assert from_bytes(to_bytes(outcomes)) == outcomes
    assert len(to_bytes(outcomes)) < 3 * 6000 + 3000  # numbers, and texts once


def test_an_existing_store_is_refused_and_says_how_to_go_on(done: Path) -> None:
    with refused(StoreExistsError, path=str(done), kept=3, about=("3", "--resume", "resume=True")):
        run_sweep(STUDY, done)
    assert run_sweep(STUDY, done, resume=True).done == 3


def test_the_store_of_another_study_is_refused_with_both_digests(done: Path) -> None:
    other = small_study(1, seed=8)
    digests = STUDY.digest, other.digest
    with refused(OtherStudyError, stored=digests[0], given=digests[1], about=digests):
        run_sweep(other, done, resume=True)


@pytest.mark.parametrize(("key", "value"), [("versions", '{"pin": "1"}'), ("quantities", "[]")])
def test_cases_of_other_bits_are_not_mixed(done: Path, key: str, value: str) -> None:
    connection = sqlite3.connect(done)
    (own,) = connection.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
    connection.close()
    _edit(done, f"UPDATE meta SET value = '{value}' WHERE key = '{key}'")
    with refused(OtherStudyError, path=str(done), stored=value, given=own):
        run_sweep(STUDY, done, resume=True)


def test_cases_of_a_file_that_has_changed_are_not_mixed(tmp_path: Path) -> None:
    """A digest that was written as it stands there, and not one that is damaged."""
    path, study = tmp_path / "a.db", SweepStudy.from_toml(study_text(1))
    with SweepStore(path, study) as store:
        store.add([replace(one, digest="x") for one in case_outcomes(study, [0], 1)])
    with refused(OtherStudyError, stored="x", given=study.case(0).digest):
        run_sweep(study, path, resume=True)


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
    for content in (whole[: len(whole) // 2], b"no database at all" * 99, whole[:50]):
        done.write_bytes(content)
        for open_it in (hp.study.open_sweep, lambda path: run_sweep(STUDY, path, resume=True)):
            with refused(SweepStoreError, path=str(done), about=("sqlite3 FILE .recover",)):
                open_it(done)
        assert done.read_bytes() == content  # left as it was
    none = done.with_name("none.db")
    with refused(SweepStoreError, path=str(none)) as caught:
        hp.study.open_sweep(none)
    assert isinstance(caught.value.__cause__, FileNotFoundError)


def test_an_empty_file_is_a_sweep_that_did_not_begin(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    with refused(SweepStoreError, path=str(path), kept=None, about=("nothing",)):
        hp.study.open_sweep(path)
    assert run_sweep(STUDY, path, threads=1).done == 3


def test_a_damaged_row_is_told_and_run_again(done: Path) -> None:
    whole = hp.study.open_sweep(done).dataset
    connection = sqlite3.connect(done)
    (numbers,) = connection.execute("SELECT numbers FROM cases WHERE number = 1").fetchone()
    changed = bytes([numbers[0] ^ 1]) + numbers[1:]
    connection.execute("UPDATE cases SET numbers = ? WHERE number = 1", (changed,))
    connection.commit()
    connection.close()
    found = hp.study.open_sweep(done)
    assert found.failed == [(1, DAMAGED)] and found.done == 2
    assert np.isnan(found.dataset["torque_peak"].values[1]).all()
    require_same_bits(run_sweep(STUDY, done, resume=True).dataset, whole)


GAIT = '[[vary]]\ninput = "gait"\n{}values = ["tripod"]\n'


@pytest.mark.parametrize(
    ("more", "draws"),
    [("", 0), (GAIT.format(""), 0), (GAIT.format('distribution = "choice"\n'), 1)],
)
def test_who_goes_on_takes_the_drawn_values_from_the_store(
    more: str, draws: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The library that draws takes a second to read; texts do not tell kinds apart: drawn again."""
    study, drawn = SweepStudy.from_toml(study_text(2, more=more)), []
    path = run_sweep(study, tmp_path / "a.db").path
    whole, cube = hp.study.open_sweep(path).dataset, Design.cube
    _edit(path, "DELETE FROM cases WHERE number IN (1, 4)")
    monkeypatch.setattr(Design, "cube", lambda *given: drawn.append(1) or cube(*given))
    again = SweepStudy.from_toml(study_text(2, more=more))
    require_same_bits(run_sweep(again, path, resume=True, threads=1).dataset, whole)
    assert len(drawn) == draws
    assert [again.point(k) for k in range(6)] == [study.point(k) for k in range(6)]


def test_a_full_disk_keeps_what_was_committed(tmp_path: Path) -> None:
    """SQLite's own limit of pages; later, with room, the sweep goes on to the same bits."""
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


HOLD = """
import sys
from pathlib import Path
from hexapod_pin.study.runs.store_lock import StoreLock
lock = StoreLock(Path(sys.argv[1]))
print("locked", flush=True)
sys.stdin.read()
"""


def test_one_writer_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY), refused(StoreLockedError, path=str(path)) as caught:
        run_sweep(STUDY, path, resume=True)
    assert caught.value.__cause__ is None  # this process knows: the system is not asked
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert holder.stdout is not None and holder.stdout.readline() == b"locked\n"
    with refused(StoreLockedError, path=str(path)) as caught:
        run_sweep(STUDY, path, resume=True)
    assert caught.value.__cause__.errno in (errno.EACCES, errno.EAGAIN)  # another process has it
    holder.kill()
    holder.communicate()
    assert run_sweep(STUDY, path, resume=True).done == 3  # the lock went with its owner


@pytest.mark.parametrize("place", ["none/a.db", "file/a.db", "/proc/a.db"])
def test_a_folder_that_cannot_be_written_to(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("no folder")
    with refused(SweepStoreError, path=str(tmp_path / place)) as caught:
        run_sweep(STUDY, tmp_path / place)
    assert isinstance(caught.value.__cause__, OSError | TraceFileError)  # what the system says


def test_inputs_of_all_cases_are_kept_from_the_start(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY):
        pass
    dataset = hp.study.open_sweep(path).dataset
    points = [STUDY.point(k) for k in range(3)]
    assert dataset["payload"].values.tolist() == [point["payload"] for point in points]
    assert dataset["mu"].values.tolist() == [point["mu"] for point in points]
    assert dataset["payload"].attrs["units"] == "kg"
    about = json.loads(dataset.attrs["inputs"])
    assert [(item["name"], item["grid"]) for item in about] == [
        ("payload", True), ("mu", False)
    ]  # fmt: skip
