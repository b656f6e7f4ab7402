"""Sweeps on threads, processes and executors: the same bits; the command and its figures."""

from __future__ import annotations

import csv
import json
import math
import os
import signal
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ParameterError, StudyInterrupted, TraceFileError, WorkersError
from hexapod_pin.results.summary_verdict import summary_verdict
from hexapod_pin.results.travelled_path import push_offset
from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.task import run_task, task_of
from hexapod_pin.study.runs.workers import PoolWorkers
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.text_table import WIDTH
from hexapod_pin.view.study_figures import draw_sweep, write_sweep_figure
from tests.sweep_studies import (
    BASE,
    FRICTIONS,
    PAYLOADS,
    durations,
    partly_impossible,
    require_same_bits,
    small_study,
    write_study_file,
)

STUDY = small_study(2)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=1)


def test_threads_processes_and_any_executor_change_no_bit(
    whole: SweepResult, tmp_path: Path
) -> None:
    seen: list[float] = []
    found = run_sweep(STUDY, tmp_path / "a.db", threads=3, progress=seen.append)
    assert seen == [k / 6 for k in range(7)]
    assert (found.done, found.failed, found.pending, len(found)) == (6, [], [], 6)
    require_same_bits(found.dataset, whole.dataset)
    with ThreadPoolExecutor(2) as pool:
        for k, how in enumerate(({"processes": 2, "chunk": 3}, {"executor": pool, "chunk": 4})):
            found = run_sweep(STUDY, tmp_path / f"{k}.db", **how)
            require_same_bits(found.dataset, whole.dataset)


class Breaking(ThreadPoolExecutor):
    """Threads that end like a process pool whose worker was killed: by some cases, some times."""

    killers: dict[int, int] = {}
    broken = False

    def submit(self, fn: Any, *args: Any) -> Any:
        from concurrent.futures.process import BrokenProcessPool

        def job() -> Any:
            for index in args[4]:
                if self.killers.get(index, 0) > 0:
                    self.killers[index] -= 1
                    self.broken = True
            if self.broken:
                raise BrokenProcessPool("A process in the process pool was terminated abruptly")
            return fn(*args)

        if self.broken:
            raise BrokenProcessPool("the pool is not usable anymore")
        return super().submit(job)


def test_a_case_that_kills_its_worker_fails_alone(whole: SweepResult, tmp_path: Path) -> None:
    """Once or twice is no reason: case 2 is done in the end. Case 4 always kills."""
    Breaking.killers = {2: 2, 4: 1000}
    found = run_sweep(STUDY, tmp_path / "a.db", executor=lambda: Breaking(2), chunk=3)
    ((index, reason),) = found.failed
    assert index == 4 and "ended its worker 3 times" in reason and found.done == 5
    others = [k for k in range(6) if k != 4]
    require_same_bits(found.dataset.isel(case=others), whole.dataset.isel(case=others))
    Breaking.killers = {}
    again = run_sweep(STUDY, tmp_path / "a.db", executor=lambda: Breaking(2), retry_failed=True)
    require_same_bits(again.dataset, whole.dataset)
    Breaking.killers = {k: 1000 for k in range(6)}
    with refused(WorkersError, kept=0, about=("BrokenProcessPool",)):
        run_sweep(STUDY, tmp_path / "b.db", executor=lambda: Breaking(1))


def test_a_broken_process_pool_is_made_anew(whole: SweepResult, tmp_path: Path) -> None:
    """A real one, whose workers are killed once; the pool given is not the one that ends it."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        workers = PoolWorkers(pool)
        pool.submit(os.getpid).result()
        with SweepStore(tmp_path / "a.db", STUDY) as store:
            cases = Distribution(STUDY, store, workers, chunk=4, threads=1, progress=lambda: None)
            os.kill(pool.submit(os.getpid).result(), signal.SIGKILL)
            cases.run(range(6))
        assert workers.executor is not pool and cases.deaths > 0
        workers.close()
    require_same_bits(hp.study.open_sweep(tmp_path / "a.db").dataset, whole.dataset)


def test_a_failing_case_is_a_row_with_its_reason(tmp_path: Path) -> None:
    study = partly_impossible()
    found = run_sweep(study, tmp_path / "a.db")
    ((index, reason),) = found.failed
    assert index == 2 and reason.startswith("ParameterError: duration = -1.0: must be")
    dataset = found.dataset
    assert dataset["reason"].values.tolist() == ["", "", reason, ""]
    assert np.isnan(dataset["torque_rms"].values[2]).all()
    assert np.isfinite(dataset["torque_rms"].values[[0, 1, 3]]).all()
    seen: list[float] = []
    run_sweep(study, tmp_path / "a.db", retry_failed=True, progress=seen.append)
    assert seen == [0.75, 1.0]  # the failed one alone was run again

    made: list[int] = []

    class Odd(type(STUDY)):
        count = 0

        def case(self, index: int) -> hp.Case:
            Odd.count += 1
            if index == 4:
                raise ZeroDivisionError("a bug in a controller")
            return super().case(index)

    found = run_sweep(
        Odd(STUDY.text, STUDY.folder), tmp_path / "c.db", threads=1,
        progress=lambda done: made.append(Odd.count - round(6 * done)),
    )  # fmt: skip
    assert found.failed == [(4, "ZeroDivisionError: a bug in a controller")] and found.done == 5
    assert max(made) <= 3  # cases are made as they are needed: 10 000 never stand in memory


def test_ctrl_c_keeps_what_is_done_and_resume_gives_the_same_bits(
    whole: SweepResult, tmp_path: Path
) -> None:
    for how in ({"threads": 2}, {"executor": lambda: ThreadPoolExecutor(1), "chunk": 1}):
        path = tmp_path / f"{len(how)}.db"

        def interrupt(fraction: float) -> None:
            if fraction >= 0.4:
                signal.raise_signal(signal.SIGINT)

        with refused(StudyInterrupted, about=("6", str(path), "--resume")) as caught:
            run_sweep(STUDY, path, progress=interrupt, **how)
        kept = caught.value.result.done
        assert 3 <= kept < 6 and hp.study.open_sweep(path).done == kept
        seen: list[float] = []
        found = run_sweep(STUDY, path, resume=True, progress=seen.append)
        assert len(seen) == 7 - kept  # none is run twice
        require_same_bits(found.dataset, whole.dataset)


def test_workers_refuse_what_would_give_other_bits() -> None:
    task = task_of(STUDY, [0], 1)
    assert run_task(*task._replace(versions={"pin": "1"})).startswith(b"!it has {")
    assert b"digest" in run_task(*task._replace(digest="x"))
    assert run_task(*task._replace(text="no = toml = ")).startswith(b"!ParameterError")
    assert not run_task(*task).startswith(b"!")
    with refused(ParameterError, "chunk", 2**70, allowed=(1, 100_000)):
        run_sweep(STUDY, "none.db", chunk=2**70)


def test_files_hold_the_dataset(whole: SweepResult, tmp_path: Path) -> None:
    dataset = whole.dataset
    opened = xarray.open_dataset(whole.save(tmp_path / "a.nc"), engine="h5netcdf")
    for name in dataset.variables:
        if dataset[name].dtype.kind == "f":
            assert opened[name].values.tobytes() == dataset[name].values.tobytes(), name
            assert opened[name].attrs == dataset[name].attrs
    opened.close()
    with open(whole.save(tmp_path / "a.csv"), newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["mu"]) for row in rows] == dataset["mu"].values.tolist()
    for wrong in ("a.txt", "none/a.nc"):
        with pytest.raises(TraceFileError):
            whole.save(tmp_path / wrong)


@pytest.mark.parametrize(
    ("settings", "duration", "push", "walks"),
    [
        ({}, 1.2, None, True),
        ({"contact": hp.Contact.accurate().with_mu(0.02)}, 1.2, None, False),  # slips
        ({}, 0.5, None, None),  # no whole cycle
        ({}, 1.5, 20.0, True),
        ({}, 1.5, 130.0, False),  # thrown, and walks on there
    ],
)
def test_the_verdict_of_a_summary_is_that_of_its_trace(
    settings: dict[str, Any], duration: float, push: float | None, walks: bool | None
) -> None:
    if push is not None:
        force = (0.0, push, 0.0)
        settings = {"loads": [hp.Push("base_link", force=force, start=0.2, duration=0.1)]}
    scene = hp.Scene(hp.load_robot("kharagpur"), **settings)
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))
    trace = hp.simulate(scene, gait, duration=duration, accuracy=1e-3)
    verdict = hp.walk_verdict(trace)
    found = summary_verdict(trace.summary, math.nan if push is None else verdict.push.stance)
    assert found.walks is walks and bool(found.reason) is not bool(walks)
    if push is not None:  # of the mass at half cycles, not of the trunk at samples
        assert push_offset(trace.summary) == pytest.approx(verdict.push.offset, rel=0.01, abs=1e-3)
    if walks is not None:
        assert verdict.walks is walks
    if walks:
        assert found.speed_share == pytest.approx(verdict.travel.speed_share, rel=1e-12)


def _run(*words: object) -> int:
    with pytest.raises(SystemExit) as end:
        main(["sweep", *map(str, words)])
    return int(end.value.code or 0)


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_study_file(tmp_path, 2)


def test_it_leaves_store_dataset_and_figure(study: Path, capsys: Any, monkeypatch: Any) -> None:
    assert _run(study, "--out", "a.nc", "--plot", "a.svg", "--threads", 2) == 0
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert lines[0] == "short walks: 6 of 6 cases done, all walk" and not err
    assert lines[1].split() == ["slip", "per", "coxa", "femur", "tibia"]
    assert lines[2].split() == ["payload", "speed", "cycle", "peak", "peak", "peak"]
    assert lines[3].split()[:4] == ["case", "[kg]", "mu", "[m/s]"] and len(lines) <= 15
    assert "6 cases run in " in out and "store: " in out
    found = hp.study.open_sweep("study.db")
    with xarray.open_dataset("a.nc", engine="h5netcdf") as opened:
        np.testing.assert_array_equal(opened["torque_peak"], found.dataset["torque_peak"])
    assert Path("a.svg").read_text().lstrip().startswith("<?xml")
    monkeypatch.setitem(sys.modules, "xarray", None)  # with it comes dask.array: 1.5 s
    assert _run(study) == 2  # it exists
    assert "6 cases of it finished: continue it with --resume" in capsys.readouterr().err
    assert _run(study, "--resume", "--out", "a.csv") == 0
    out = capsys.readouterr().out
    assert "cases run in" not in out and "wrote a.csv" in out.replace(f"{Path.cwd()}/", "")


def test_csv_files_have_the_columns_that_are_named(study: Path, capsys: Any) -> None:
    """A file had 572 columns; the largest torques stand in the table."""
    assert _run(study, "--out", "a.csv", "--columns", "walks,kind_torque_peak") == 0
    assert max(len(x) for x in capsys.readouterr().out.splitlines() if "/" not in x) <= WIDTH
    head, *rows = Path("a.csv").read_text().splitlines()
    kinds = [f"kind_torque_peak.{kind} [N m]" for kind in ("coxa", "femur", "tibia")]
    assert head.split(",") == ["case", "payload [kg]", "mu", "walks", *kinds] and len(rows) == 6
    found = hp.study.open_sweep("study.db")
    peak = found.columns["kind_torque_peak"].values.max(axis=1)
    largest = sorted(np.argsort(-peak, kind="stable")[:2].tolist())
    assert [int(cells[0]) for cells in found.table(2).rows] == largest
    assert _run(study, "--resume", "--json") == 0
    assert json.loads(capsys.readouterr().out)["columns"]["payload"] == [0, 0, 0.5, 0.5, 1, 1]
    assert _run(study, "--resume", "--columns", "walks") == 2


def test_ctrl_c_ends_with_130_and_says_what_is_kept(
    study: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    add = SweepStore.add

    def interrupted(self: Any, outcomes: Any) -> Any:
        new = add(self, outcomes)
        if len(self.finished) == 2:
            signal.raise_signal(signal.SIGINT)
        return new

    monkeypatch.setattr(SweepStore, "add", interrupted)
    assert _run(study) == 130
    assert "interrupted: 2 of 6 cases are kept in" in capsys.readouterr().err
    monkeypatch.undo()
    monkeypatch.chdir(study.parent)
    assert _run(study, "--resume") == 0
    assert "4 cases run in" in capsys.readouterr().out
    study.write_text(BASE + durations(0.9, -1.0))
    assert _run(study, "--store", "b.db") == 0
    out = capsys.readouterr().out
    assert "1 of 2 cases done, 1 failed" in out and "\n1 x ParameterError\ncase 1: " in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.toml"], "none.toml"),
        (["study.toml", "--out", "a.txt"], "--out a.txt"),
        (["study.toml", "--store", "none/a.db"], "there is no folder"),
        (["study.toml", "--chunk", "0"], "--chunk = 0: must be a whole number"),
        (["study.toml", "--processes", "1", "--scheduler", "tcp://x"], "one of them"),
        (["study.toml", "--out", "a.csv", "--columns", "walks,peak"], "no column named 'peak'"),
    ],
)
def test_refusals_are_one_message(study: Path, capsys: Any, words: list[str], said: str) -> None:
    assert _run(*words) == 2
    err = capsys.readouterr().err
    assert err.startswith("hexapod-pin: ") and said in err and err.count("\n") == 1
    assert sorted(path.name for path in study.parent.iterdir()) == ["study.toml"]


STIFF = '\n[[vary]]\ninput = "servo_stiffness"\nvalues = [1.0, 2.0]\n'


@pytest.mark.parametrize(
    ("inputs", "panels", "words"),
    [
        (PAYLOADS, 3, ["coxa", "payload [kg]", "torque of the worst joint [N m]"]),
        (PAYLOADS + STIFF, 3, ["tibia", "servo_stiffness"]),
        (FRICTIONS.format(samples=4, seed=1), 4, ["peak torque [N m]", "mu"]),
    ],
)
def test_the_figure_follows_what_varies(
    tmp_path: Path, inputs: str, panels: int, words: list[str]
) -> None:
    found = run_sweep(SweepStudy.from_toml(BASE + inputs), tmp_path / "a.db")
    figure = draw_sweep(found)
    drawn = [axes for axes in figure.axes if axes.axison and axes.get_label() != "<colorbar>"]
    assert len(drawn) == panels
    text = " ".join(
        part for axes in drawn for part in (axes.get_title(), axes.get_xlabel(), axes.get_ylabel())
    )
    assert all(word in text for word in words)
    if inputs is PAYLOADS:
        peak = found.dataset["kind_torque_peak"].sel(kind="femur").values
        line = drawn[1].get_lines()[0]
        np.testing.assert_array_equal(line.get_xdata(), [0.0, 0.5, 1.0])
        np.testing.assert_allclose(line.get_ydata(), peak, rtol=1e-15)
        with SweepStore(tmp_path / "b.db", small_study(1)):
            pass
        with refused(ParameterError, "found", "not run"):
            write_sweep_figure(hp.study.open_sweep(tmp_path / "b.db"), tmp_path / "a.png")
