"""The runner: every study killed and resumed, stores of rows, errors, a pool of the user's."""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import signal
import sqlite3
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import (
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
    counts: list[int] = []
    write = Store._write

    def counted(self: Store, rows: Any) -> None:
        counts.append(len(rows))
        write(self, rows)

    monkeypatch.setattr(Store, "_write", counted)
    return counts


@cache
def without_a_store(name: str) -> str:
    return STUDIES[name](threads=2)


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_a_study_that_is_killed_twice_goes_on_with_the_same_bits(
    name: str, processes: Any, tmp_path: Path, written: list[int]
) -> None:
    """Right after its first row, and in the middle of a later one; no case is run again."""
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
    posture = np.array(scene().robot.posture)
    return [hp.Case(scene(), hp.HoldPosture(posture + x), **ROBUST) for x in strokes]


def heights(run: Runner, cases: list[hp.Case]) -> list[Any]:
    rows = run.rows(cases, SUMMARY).require_complete()
    return [row if isinstance(row, Exception) else row.height_mean for row in rows]


def longest(case: hp.Case, trace: hp.Trace, factor: float) -> dict[str, Any]:
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
    assert run_study(heights, walks(0.01, 0.02), store=path, resume=True)[0] == expected[1]
    assert written == [1, 1, 1]  # another study, one new case


def test_a_measure_with_other_settings_is_another_row(tmp_path: Path, written: list[int]) -> None:
    cases, path = walks(0.0), tmp_path / "a.db"

    def ends(run: Runner, factor: float) -> Any:
        return run.rows(cases, LONGEST.with_settings(factor=factor))[0]

    for factor in (1.0, 2.0, 1.0):
        row = run_study(ends, factor, store=path, resume=True)
        assert row == {"end": pytest.approx(0.04 * factor), "none": None}
    assert len(written) == 2
    for how in ({"store": tmp_path / "b.db"}, {"executor": lambda: ThreadPoolExecutor(1)}):
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
def test_a_row_belongs_to_the_source_of_the_users_code(tmp_path: Path, monkeypatch) -> None:
    """Another method or function, another row; the file's name and what else it holds do not."""
    monkeypatch.syspath_prepend(tmp_path)
    texts = {"a": OWN, "b": OWN + "\nx = 1\n", "c": OWN.replace("1.0", "2.0")}
    case, keys = walks(0.0)[0], {}
    for name, text in texts.items():
        (tmp_path / f"own_{name}.py").write_text(text)
        control = importlib.import_module(f"own_{name}").Own()
        keys[name] = SUMMARY.key(replace(case, controller=control))
    assert keys["a"] == keys["b"] != keys["c"]
    same, other = replace(LONGEST, of=longest), replace(LONGEST, of=lambda *_: {})
    assert LONGEST.key(case) == same.key(case) != other.key(case)


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


def test_ctrl_c_gives_what_was_done(tmp_path: Path, written: list[int]) -> None:
    path, seen = tmp_path / "a.db", []

    def after_three(progress: Any) -> None:
        seen.append(progress)
        if len(seen) == 3:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(StudyInterrupted) as caught:
        hp.torque_map(
            scene(), "straight", gait=GAIT, strokes=[0.03, 0.05], cycle_times=[0.02, 0.4], check=1,
            accuracy=1e-2, threads=1, progress=after_three, store=path,
        )  # fmt: skip
    reasons = Counter(text.split(":")[0] for text in caught.value.result.reason.ravel())
    assert reasons == {"GaitError": 2, "": 1, "not run": 1}
    assert "--resume" in str(caught.value)
    assert mapped(store=path, resume=True) == without_a_store("mapped") and sum(written) == 5
    stop = {"progress": lambda _: signal.raise_signal(signal.SIGINT), "threads": 1}
    with refused(StudyInterrupted, about=("1", "3")) as caught:
        run_study(heights, walks(0.0, 0.01, 0.02), **stop)
    rows = caught.value.result
    assert len(rows) == 3 and not rows.complete and rows[0].height_mean > 0.0
    with refused(StudyInterrupted, result=None):
        run_study(lambda run: signal.raise_signal(signal.SIGINT))


def test_options_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    for how, name in (
        ({"resume": True}, "resume"), ({"threads": 0}, "threads"),
        ({"processes": 2**70}, "processes"), ({"scheduler": " "}, "scheduler"),
        ({"processes": 1, "scheduler": "tcp://a"}, "processes and scheduler"),
    ):  # fmt: skip
        with refused(ParameterError, name):
            run_study(heights, [], **how)
    with refused(UserCodeError):
        run_study(heights, walks(0.0), progress=lambda fraction: 1 / 0)

    class Unwritten:
        """A controller that no case file can hold: it runs on threads without a store only."""

        def plan(self, robot: hp.Robot, duration: float) -> Any:
            return hp.HoldPosture().plan(robot, duration)

    cases = [hp.Case(scene(), Unwritten(), **ROBUST)]
    assert np.isfinite(run_study(heights, cases)).all()
    for how in ({"store": tmp_path / "a.db"}, {"executor": lambda: ThreadPoolExecutor(1)}):
        with refused(ParameterError, about=("Unwritten",)):
            run_study(heights, cases, **how)
    assert list(tmp_path.iterdir()) == []  # a store that stays empty goes


@pytest.mark.slow
def test_worker_processes_give_the_same_bits() -> None:
    assert STUDIES["mapped"](processes=1) == without_a_store("mapped")
    lost = replace(LONGEST, name="tests.test_runner:NONE")  # no worker finds it
    with refused(WorkersError, about=("tests.test_runner", "in PYTHONPATH. No case was finished.")):
        run_study(lambda run: run.rows(walks(0.0), lost), processes=1)


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
    with refused(ParameterError, "row"):
        LONGEST.unpack(case, *SUMMARY.pack(summary))
    with refused(ParameterError, "measure"):
        measure_named("tests.test_runner:NONE", {})


def test_errors_come_back() -> None:
    """Those of a worker, too: of a limit of a case, and of a user's own type."""
    few = replace(walks(0.0)[0], limits=hp.simulation.WorkLimits(evaluations=3.0))
    for how in ({}, {"executor": lambda: ThreadPoolExecutor(1)}):
        rows = run_study(lambda run: list(run.rows([few, *walks(0.0)], SUMMARY)), **how)
        assert isinstance(rows[0], WorkLimitError) and rows[0].limit == "evaluations"
    back = unpack_error(pack_error(ParameterError("a.b", 3, "less")))
    assert (type(back), back.name, back.value) == (ParameterError, "a.b", 3)

    class OwnError(Exception):
        """Of a user."""

    back = unpack_error(pack_error(OwnError("mine")))
    assert type(back).__name__ == "OwnError" and str(back) == "mine"


def walked(hills: hp.Scene) -> tuple[hp.Case, hp.Trace]:
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))
    case = hp.Case(hills, control, duration=0.2, accuracy=1e-3)
    return case, case.run()


def test_a_pool_of_the_users_computes_the_same_bits() -> None:
    """Scenes, cases and traces go both ways, and a run is continued there."""
    ground = hp.HeightField.random(3, amplitude=5e-3)
    loads = [hp.Payload("base_link", mass=0.3)]
    case, trace = walked(hp.Scene(hp.load_robot("kharagpur"), terrain=ground, loads=loads))
    how = {"duration": 0.3, "initial": trace.checkpoint}
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        found, there = pool.submit(walked, case.scene).result(PATIENCE)
        rest = pool.submit(partial(hp.simulate, **how), found.scene, found.controller).result()
    assert rest.digest == hp.simulate(case.scene, case.controller, **how).digest
    assert found == case and there == trace and there.digest == trace.digest
    assert there.summary.data == trace.summary.data and hp.load_case(there) == case
