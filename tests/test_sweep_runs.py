"""Sweeps on threads, processes and executors: the same bits, whatever ran and was interrupted."""

from __future__ import annotations

import csv
import math
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, StudyInterrupted, TraceFileError, WorkersError
from hexapod_pin.results.summary_verdict import summary_verdict
from hexapod_pin.results.travelled_path import push_offset
from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.task import run_task, task_of
from hexapod_pin.study.runs.workers import PoolWorkers
from tests.sweep_studies import partly_impossible, require_same_bits, small_study

STUDY = small_study(2)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """The undisturbed sweep on one thread."""
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=1)


def test_threads_change_no_bit(whole: SweepResult, tmp_path: Path) -> None:
    seen: list[float] = []
    found = run_sweep(STUDY, tmp_path / "a.db", threads=3, progress=seen.append)
    assert seen == [k / 6 for k in range(7)]
    assert (found.done, found.failed, found.pending, len(found)) == (6, [], [], 6)
    require_same_bits(found.dataset, whole.dataset)


def test_worker_processes_and_any_executor_change_no_bit(
    whole: SweepResult, tmp_path: Path
) -> None:
    with ThreadPoolExecutor(2) as pool:
        for k, how in enumerate(({"processes": 2, "chunk": 3}, {"executor": pool, "chunk": 4})):
            found = run_sweep(STUDY, tmp_path / f"{k}.db", **how)
            require_same_bits(found.dataset, whole.dataset)


class Breaking(ThreadPoolExecutor):
    """Threads that end like a process pool whose worker was killed: by some cases, some times."""

    killers: dict[int, int] = {}
    broken = False

    def submit(self, fn: Any, *args: Any) -> Any:
        """Run, unless broken."""
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


def test_a_pool_that_never_answers_is_given_up(tmp_path: Path) -> None:
    Breaking.killers = {k: 1000 for k in range(6)}
    with refused(WorkersError, kept=0, about=("BrokenProcessPool",)):
        run_sweep(STUDY, tmp_path / "a.db", executor=lambda: Breaking(1))


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
    assert found.reasons == {"ParameterError": 1}
    dataset = found.dataset
    assert dataset["reason"].values.tolist() == ["", "", reason, ""]
    assert np.isnan(dataset["torque_rms"].values[2]).all()
    assert np.isfinite(dataset["torque_rms"].values[[0, 1, 3]]).all()
    elsewhere = run_sweep(study, tmp_path / "b.db", executor=ThreadPoolExecutor(1))
    require_same_bits(elsewhere.dataset, dataset)
    seen: list[float] = []
    run_sweep(study, tmp_path / "a.db", retry_failed=True, progress=seen.append)
    assert seen == [0.75, 1.0]  # the failed one alone was run again


def test_a_case_that_raises_anything_concerns_no_other(tmp_path: Path) -> None:
    class Odd(type(STUDY)):
        def case(self, index: int) -> hp.Case:
            if index == 4:
                raise ZeroDivisionError("a bug in a controller")
            return super().case(index)

    found = run_sweep(Odd(STUDY.text, STUDY.folder), tmp_path / "a.db")
    assert found.failed == [(4, "ZeroDivisionError: a bug in a controller")] and found.done == 5


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


def test_cases_are_made_as_they_are_needed(tmp_path: Path) -> None:
    """Not all at once: a study of 10 000 cases never stands in memory."""

    class Counting(type(STUDY)):
        made = 0

        def case(self, index: int) -> hp.Case:
            Counting.made += 1
            return super().case(index)

    ahead = []
    study = Counting(STUDY.text, STUDY.folder)
    run_sweep(
        study, tmp_path / "a.db", threads=1,
        progress=lambda done: ahead.append(Counting.made - round(6 * done)),
    )  # fmt: skip
    assert max(ahead) <= 3  # AHEAD + 1 of a thread


def test_workers_refuse_what_would_give_other_bits() -> None:
    task = task_of(STUDY, [0], 1)
    assert run_task(*task._replace(versions={"pin": "1"})).startswith(b"!it has {")
    assert b"digest" in run_task(*task._replace(digest="x"))
    assert run_task(*task._replace(text="no = toml = ")).startswith(b"!ParameterError")
    assert not run_task(*task).startswith(b"!")


@pytest.mark.parametrize(
    ("wrong", "name", "value", "allowed"),
    [
        ({"threads": 0}, "threads", 0, (1, 1024)),
        ({"threads": 2**70}, "threads", 2**70, (1, 1024)),
        ({"chunk": True}, "run_sweep.chunk", True, ()),
        ({"chunk": 2**70}, "chunk", 2**70, (1, 100_000)),
        ({"processes": -1}, "processes", -1, (1, 1024)),
        ({"processes": 2**70}, "processes", 2**70, (1, 1024)),
        ({"processes": 1, "scheduler": "tcp://x"}, "processes and scheduler", "both", ()),
    ],
)
def test_arguments_out_of_range(
    tmp_path: Path, wrong: dict[str, Any], name: str, value: Any, allowed: tuple[int, ...]
) -> None:
    with refused(ParameterError, name, value, allowed=allowed):
        run_sweep(STUDY, tmp_path / "a.db", **wrong)
    assert not list(tmp_path.iterdir())


def test_files_hold_the_dataset(whole: SweepResult, tmp_path: Path) -> None:
    """NetCDF to the bit through xarray; CSV with a column for every number and its unit."""
    dataset = whole.dataset
    opened = xarray.open_dataset(whole.save(tmp_path / "a.nc"), engine="h5netcdf")
    assert set(opened.coords) == set(dataset.coords)
    for name in dataset.variables:
        if dataset[name].dtype.kind == "f":
            assert opened[name].values.tobytes() == dataset[name].values.tobytes(), name
            assert opened[name].attrs == dataset[name].attrs
    opened.close()
    with open(whole.save(tmp_path / "a.csv"), newline="") as stream:
        rows = list(csv.DictReader(stream))
    peak = dataset["torque_peak"].sel(joint="lf_femur_joint").values
    assert [float(row["torque_peak.lf_femur_joint [N m]"]) for row in rows] == peak.tolist()
    assert [float(row["mu"]) for row in rows] == dataset["mu"].values.tolist()
    for wrong in ("a.txt", "none/a.nc"):
        with pytest.raises(TraceFileError):
            whole.save(tmp_path / wrong)


def _walks(duration: float, **settings: Any) -> Iterator[Any]:
    scene = hp.Scene(hp.load_robot("kharagpur"), **settings)
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))
    yield hp.simulate(scene, gait, duration=duration, accuracy=1e-3)


def _pushed(force: float) -> dict[str, Any]:
    return {"loads": [hp.Push("base_link", force=(0.0, force, 0.0), start=0.2, duration=0.1)]}


@pytest.mark.parametrize(
    ("settings", "duration", "walks"),
    [
        ({}, 1.2, True),
        ({"contact": hp.Contact.accurate().with_mu(0.02)}, 1.2, False),  # slips
        ({"servo": hp.Servo(kp=0.3, kd=0.01)}, 1.2, False),  # sinks
        ({}, 0.5, None),  # no whole cycle
        (_pushed(20.0), 1.5, True),
        (_pushed(130.0), 1.5, False),  # thrown, and walks on there
    ],
)
def test_the_verdict_of_a_summary_is_that_of_its_trace(
    settings: dict[str, Any], duration: float, walks: bool | None
) -> None:
    (trace,) = _walks(duration, **settings)
    push = hp.walk_verdict(trace).push
    found = summary_verdict(trace.summary, math.nan if push is None else push.stance)
    assert found.walks is walks
    if push is not None:  # of the mass at half cycles, not of the trunk at samples
        assert push_offset(trace.summary) == pytest.approx(push.offset, rel=0.01, abs=1e-3)
    if walks is not None:
        assert hp.walk_verdict(trace).walks is walks
    share = hp.walk_verdict(trace).travel.speed_share
    if walks:
        assert found.speed_share == pytest.approx(share, rel=1e-12) and not math.isnan(share)
    assert bool(found.reason) is not bool(walks)
    assert isinstance(found.reason, str)
