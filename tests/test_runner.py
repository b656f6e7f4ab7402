"""The runner: every study killed and resumed, stores of rows, what rows and errors survive."""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import signal
import sqlite3
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import (
    DivergenceError,
    OtherStudyError,
    ParameterError,
    StoreExistsError,
    StoreLockedError,
    StudyInterrupted,
    SweepStoreError,
    UserCodeError,
    WorkersError,
    WorkLimitError,
)
from hexapod_pin.results.sizing import joint_demand
from hexapod_pin.study import SUMMARY, Measure, Runner, run_study
from hexapod_pin.study.runs.measure import measure_named, pack_error, unpack_error
from hexapod_pin.study.runs.store import RowStore, Store, SweepStore
from hexapod_pin.study.selection.evaluation import JOINT_DEMAND
from tests.runner_studies import GAIT, ROBUST, STUDIES, kill, mapped, scene
from tests.sweep_studies import small_study

PATIENCE = 60.0
"""Longest wait for a process [s]."""


@pytest.fixture(scope="module")
def processes() -> Any:
    """Starts processes that have imported the studies."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.runner_studies"])
    return context


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many rows were put on the disk at a time."""
    counts: list[int] = []
    write = Store._write

    def counted(self: Store, rows: Any) -> None:
        counts.append(len(rows))
        write(self, rows)

    monkeypatch.setattr(Store, "_write", counted)
    return counts


@cache
def without_a_store(name: str) -> str:
    """Return a study on two threads."""
    return STUDIES[name](threads=2)


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_a_study_that_is_killed_twice_goes_on_with_the_same_bits(
    name: str, processes: Any, tmp_path: Path, written: list[int]
) -> None:
    """Right after its first row, and in the middle of a later one.

    It goes on with another number of threads, and runs no case again. Without a store it has the
    same bits.
    """
    study, path = STUDIES[name], tmp_path / "a.db"
    wanted = without_a_store(name) if name != "swept" else study(store=tmp_path / "b.db", threads=2)
    kept = 0
    for after, inside in ((1, False), (0 if name == "stiffness" else 1, True)):
        victim = processes.Process(target=kill, args=(name, str(path), after, inside))
        victim.start()
        victim.join(PATIENCE)
        assert victim.exitcode == -signal.SIGKILL
        kept += after
    written.clear()
    assert study(store=path, resume=True, threads=1) == wanted
    with contextlib.closing(sqlite3.connect(path)) as file:
        [total] = file.execute("SELECT count(*) FROM cases").fetchone()
    assert sum(written) == total - kept > 0
    written.clear()
    assert study(store=path, resume=True) == wanted and not any(written)
    (tmp_path / "b.db").unlink(missing_ok=True)
    assert [one.name for one in tmp_path.iterdir()] == ["a.db"]


def walks(*strokes: float) -> list[hp.Case]:
    """Postures that are held for a moment."""
    posture = np.array(scene().robot.posture)
    return [hp.Case(scene(), hp.HoldPosture(posture + x), **ROBUST) for x in strokes]


def heights(run: Runner, cases: list[hp.Case]) -> list[Any]:
    """Return the mean heights."""
    rows = run.rows(cases, SUMMARY).require_complete()
    return [row if isinstance(row, Exception) else row.height_mean for row in rows]


def longest(case: hp.Case, trace: hp.Trace, factor: float) -> dict[str, Any]:
    """Return a number of a trace, or fail."""
    if factor < 0.0:
        raise ParameterError("factor", factor, "not negative")
    return {"end": factor * float(trace.time[-1]), "none": None}


LONGEST = Measure("tests.test_runner:LONGEST", 1, "trace", dict, longest)


def test_rows_are_those_of_the_batch_and_remembered_by_content(
    tmp_path: Path, written: list[int]
) -> None:
    cases = walks(0.0, 0.01, 0.0)
    path = tmp_path / "a.db"
    expected = [run.height_mean for run in hp.simulate_batch(cases, keep="summary")]
    assert run_study(heights, cases, store=path) == expected
    assert written == [1, 1]  # two of the cases are the same
    with refused(StoreExistsError, path=str(path), kept=2):
        run_study(heights, cases, store=path)
    more = walks(0.01, 0.02)
    assert run_study(heights, more, store=path, resume=True)[0] == expected[1]
    assert written == [1, 1, 1]  # another study, one new case
    longer = [replace(case, duration=0.05) for case in cases]
    run_study(heights, longer, store=path, resume=True)
    assert len(written) == 5


def test_a_measure_with_other_settings_is_another_row(tmp_path: Path, written: list[int]) -> None:
    cases, path = walks(0.0), tmp_path / "a.db"

    def ends(run: Runner, factor: float) -> Any:
        return run.rows(cases, LONGEST.with_settings(factor=factor))[0]

    for factor in (1.0, 2.0, 1.0):
        row = run_study(ends, factor, store=path, resume=True)
        assert row == {"end": pytest.approx(0.04 * factor), "none": None}
    assert len(written) == 2
    for how in ({}, {"store": tmp_path / "b.db"}, {"executor": lambda: ThreadPoolExecutor(1)}):
        with refused(ParameterError, "factor", -1.0):  # a fault of the study: raised, not kept
            run_study(ends, -1.0, **how)
    assert len(written) == 2 or written[2:] == [0]


OWN = """
import hexapod_pin as hp
class Own(hp.HoldPosture):
    def to_dict(self):
        return {"kind": "hold"}
    def gain(self):
        return 1.0
"""


@pytest.mark.usefixtures("own_modules")
def test_a_row_belongs_to_the_source_of_the_users_controller(tmp_path: Path, monkeypatch) -> None:
    """Another method, another row; the file's name and what else it holds do not matter."""
    monkeypatch.syspath_prepend(tmp_path)
    texts = {"a": OWN, "b": OWN + "\nx = 1\n", "c": OWN.replace("1.0", "2.0")}
    keys = {}
    for name, text in texts.items():
        (tmp_path / f"own_{name}.py").write_text(text)
        control = importlib.import_module(f"own_{name}").Own()
        keys[name] = SUMMARY.key(replace(walks(0.0)[0], controller=control))
    assert keys["a"] == keys["b"] != keys["c"]


def test_a_row_belongs_to_the_source_of_the_users_measure() -> None:
    """Another function under the same name and version is another row."""

    def other(case: hp.Case, trace: hp.Trace, factor: float) -> dict[str, Any]:
        return longest(case, trace, 2.0 * factor)

    case, same = walks(0.0)[0], replace(LONGEST, of=longest)
    assert LONGEST.key(case) == same.key(case) != replace(LONGEST, of=other).key(case)


def test_failures_are_rows_and_are_tried_again_when_asked(
    tmp_path: Path, written: list[int]
) -> None:
    far = hp.KinematicControl(GAIT.model_copy(update={"stroke": 2.0}))
    cases, path = [hp.Case(scene(), far, duration=0.9), *walks(0.0)], tmp_path / "a.db"
    direct = run_study(heights, cases)
    for how in ({}, {"resume": True}):
        row, _ = run_study(heights, cases, store=path, **how)
        assert type(row) is type(direct[0]) and str(row) == str(direct[0])
        assert vars(row)["limit"] == vars(direct[0])["limit"]
    assert len(written) == 2
    run_study(heights, cases, store=path, retry_failed=True)
    assert len(written) == 3


def test_damaged_rows_are_run_again(tmp_path: Path, written: list[int]) -> None:
    cases, path = walks(0.0, 0.01, 0.02), tmp_path / "a.db"
    expected = run_study(heights, cases, store=path)
    with contextlib.closing(sqlite3.connect(path)) as file, file:
        file.execute("UPDATE cases SET numbers = zeroblob(8) WHERE number = 1")
    written.clear()
    assert run_study(heights, cases, store=path, resume=True) == expected
    assert written == [1]


def test_stores_of_rows_and_of_sweeps_are_not_mixed(tmp_path: Path) -> None:
    rows, sweep, cases = tmp_path / "rows.db", tmp_path / "sweep.db", walks(0.0)
    run_study(heights, cases, store=rows)
    hp.run_sweep(small_study(1), sweep)
    with refused(OtherStudyError, path=str(sweep)):
        run_study(heights, cases, store=sweep, resume=True)
    with refused(OtherStudyError, path=str(rows)):
        hp.run_sweep(small_study(1), rows, resume=True)
    with refused(SweepStoreError, path=str(rows), about=("no sweep",)):
        hp.study.open_sweep(rows)
    assert hp.study.open_sweep(sweep).done == 3
    with SweepStore(sweep, small_study(1), resume=True), refused(StoreLockedError):
        RowStore(sweep)


class Unwritten:
    """A controller that no case file can hold."""

    def plan(self, robot: hp.Robot, duration: float) -> Any:
        """Hold the posture."""
        return hp.HoldPosture().plan(robot, duration)


def test_what_cannot_be_written_runs_on_threads_without_a_store_only(tmp_path: Path) -> None:
    cases = [hp.Case(scene(), Unwritten(), **ROBUST)]
    [height] = run_study(heights, cases)
    assert np.isfinite(height)
    for how in ({"store": tmp_path / "a.db"}, {"executor": lambda: ThreadPoolExecutor(1)}):
        with pytest.raises(ParameterError) as caught:
            run_study(heights, cases, **how)
        assert "Unwritten" in str(caught.value)
    assert list(tmp_path.iterdir()) == []  # a store that stays empty goes


@pytest.mark.parametrize("kept", [False, True])
def test_ctrl_c_gives_what_was_done(kept: bool, tmp_path: Path, written: list[int]) -> None:
    """A static study runs to its end with what is there; a store goes on from there."""
    how: dict[str, Any] = {"store": tmp_path / "a.db"} if kept else {}
    seen: list[Any] = []

    def after_three(progress: Any) -> None:
        seen.append(progress)
        if len(seen) == 3:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(StudyInterrupted) as caught:
        hp.torque_map(
            scene(), "straight", gait=GAIT, strokes=[0.03, 0.05], cycle_times=[0.02, 0.4], check=1,
            accuracy=1e-2, threads=1, progress=after_three, **how,
        )  # fmt: skip
    reasons = Counter(text.split(":")[0] for text in caught.value.result.reason.ravel())
    assert reasons == {"GaitError": 2, "": 1, "not run": 1}
    assert ("--resume" in str(caught.value)) is kept
    if kept:
        assert mapped(**how, resume=True) == without_a_store("mapped") and sum(written) == 5


def test_ctrl_c_ends_a_study_that_needs_all_rows() -> None:
    stop = {"progress": lambda _: signal.raise_signal(signal.SIGINT), "threads": 1}
    with refused(StudyInterrupted, about=("1", "3")) as caught:
        run_study(heights, walks(0.0, 0.01, 0.02), **stop)
    rows = caught.value.result
    assert len(rows) == 3 and not rows.complete and rows[0].height_mean > 0.0
    with pytest.raises(StudyInterrupted) as caught:
        run_study(lambda run: signal.raise_signal(signal.SIGINT))
    assert caught.value.result is None


def test_options_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    for how, name in (
        ({"resume": True}, "resume"), ({"retry_failed": True}, "retry_failed"),
        ({"threads": 0}, "threads"), ({"processes": 0}, "processes"),
        ({"processes": 1, "scheduler": "tcp://a"}, "processes and scheduler"),
        ({"scheduler": " "}, "scheduler"),
    ):  # fmt: skip
        with refused(ParameterError, name):
            run_study(heights, [], **how)
    with refused(UserCodeError):
        run_study(heights, walks(0.0), progress=lambda fraction: 1 / 0)
    with pytest.raises(TypeError):
        run_study(heights, [], thread=2)
    assert run_study(heights, [], store=tmp_path / "a.db") == []


@pytest.mark.slow
def test_worker_processes_give_the_same_bits() -> None:
    assert STUDIES["mapped"](processes=1) == without_a_store("mapped")
    with refused(WorkersError, about=("tests.test_runner", "in PYTHONPATH. No case was finished.")):
        # no worker finds this module
        run_study(
            lambda run: run.rows(walks(0.0), replace(LONGEST, name="tests.test_runner:NONE")),
            processes=1,
        )


def test_limits_of_a_case_hold_on_workers_too() -> None:
    few = replace(walks(0.0)[0], limits=hp.simulation.WorkLimits(evaluations=3.0))
    for how in ({}, {"executor": lambda: ThreadPoolExecutor(1)}):
        rows = run_study(lambda run: list(run.rows([few, *walks(0.0)], SUMMARY)), **how)
        assert isinstance(rows[0], WorkLimitError) and rows[0].limit == "evaluations"
        assert isinstance(rows[1], hp.Summary)


def test_a_row_comes_back_to_the_bit() -> None:
    case = hp.Case(scene(), hp.KinematicControl(GAIT), duration=0.9)
    trace = case.run()
    summary = trace.summary
    back = SUMMARY.unpack(case, *SUMMARY.pack(summary))
    assert back.to_json() == summary.to_json()
    assert {name: back.error_of(name).tobytes() for name in summary.errors} == {
        name: summary.error_of(name).tobytes() for name in summary.errors
    }
    demand = joint_demand(trace, postures=4)
    again = JOINT_DEMAND.unpack(case, *JOINT_DEMAND.pack(demand))
    assert again.to_dict() == demand.to_dict() and again.notes == demand.notes
    assert again.torque.tobytes() == np.ascontiguousarray(demand.torque).tobytes()
    value: dict[str, Any] = {
        "floats": (0.1, -0.0, float("inf")), "whole": [1, 2**60], "mixed": (1, 2.0, "a", None),
        "flag": True, "text": "-", "inner": {"array": np.arange(6.0).reshape(2, 3)}, "no": [],
    }  # fmt: skip
    found = LONGEST.unpack(case, *LONGEST.pack(value))
    assert found["inner"]["array"].tobytes() == value["inner"].pop("array").tobytes()
    found["inner"].clear()
    assert repr(found) == repr(value)
    with pytest.raises(TypeError):
        LONGEST.pack({"set": {1}})
    with refused(ParameterError, "row"):
        LONGEST.unpack(case, *SUMMARY.pack(summary))
    with refused(ParameterError, "measure"):
        measure_named("tests.test_runner:NONE", {})


def test_an_error_comes_back() -> None:
    for error in (
        ParameterError("a.b", 3, "less"), DivergenceError("far", object()), RuntimeError("x", 2),
    ):  # fmt: skip
        back = unpack_error(pack_error(error))
        assert type(back) is type(error) and str(back) == str(error)
    assert unpack_error(pack_error(ParameterError("a.b", 3, "less"))).value == 3

    class OwnError(Exception):
        """Of a user."""

    back = unpack_error(pack_error(OwnError("mine")))
    assert type(back).__name__ == "OwnError" and str(back) == "mine"
