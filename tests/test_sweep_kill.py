"""kill -9 of workers and of the whole sweep: what was finished stays, the rest gives the same bits.

`python scripts/studies sweep_kills` does this at a hundred random moments.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from refusals import refused
from studies.sweeps.loopback_cluster import free_port, loopback_cluster

import hexapod_pin as hp
from hexapod_pin.errors import SweepStoreError, WorkersError
from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.runs import workers as executors
from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.workers import DaskWorkers, WorkerProcesses
from tests.runner_studies import STUDIES
from tests.sweep_studies import require_same_bits, small_study, write_study_file

pytestmark = pytest.mark.slow
STUDY = small_study(4)
PATIENCE = 60.0
"""Longest wait for a process [s]."""


def _finished(path: Path) -> int:
    """Return how many cases a store holds, which may not be there yet."""
    with contextlib.suppress(SweepStoreError):
        found = hp.study.open_sweep(path)
        return len(found) - len(found.pending)
    return 0


def _alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def _children(pid: int) -> list[int]:
    words = Path(f"/proc/{pid}/task/{pid}/children")
    found = [int(word) for word in words.read_text().split()]
    for task in Path(f"/proc/{pid}/task").iterdir():
        found += [int(word) for word in (task / "children").read_text().split()]
    return sorted(set(found))


def test_workers_that_are_killed_lose_nothing(tmp_path: Path) -> None:
    """After the first and the fourth answer, with a task under way."""
    workers = WorkerProcesses(1)
    answers = 0

    def kill() -> None:
        nonlocal answers
        answers += 1
        if answers in (1, 4):
            process = workers.workers[0].process
            if process is not None:
                os.kill(process.pid, signal.SIGKILL)

    with SweepStore(tmp_path / "a.db", STUDY) as store:
        cases = Distribution(STUDY, store, workers, chunk=2, threads=1, progress=kill)
        try:
            cases.run(range(12))
        finally:
            workers.close()
        assert cases.deaths == 2
    found = hp.study.open_sweep(tmp_path / "a.db")
    assert found.failed == []
    require_same_bits(found.dataset, run_sweep(STUDY, tmp_path / "b.db", threads=2).dataset)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_sweep_that_is_killed_goes_on(tmp_path: Path) -> None:
    """No worker outlives its parent, no lock does.

    On threads, and killed twice: `swept` in tests/test_runner.py.
    """
    study, path = write_study_file(tmp_path, 4), tmp_path / "a.db"
    command = [sys.executable, "-m", "hexapod_pin", "sweep", str(study), "--store", str(path)]
    sweep = subprocess.Popen(
        [*command, "--processes", "1", "--chunk", "1", "--resume"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    end = time.monotonic() + PATIENCE
    while not _finished(path) and sweep.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    workers = _children(sweep.pid)
    sweep.kill()
    sweep.wait()
    kept = _finished(path)
    assert workers and 0 < kept < 12  # nothing that was seen is lost
    while any(map(_alive, workers)) and time.monotonic() < end:
        time.sleep(0.01)
    assert not any(map(_alive, workers))
    seen: list[float] = []
    found = run_sweep(STUDY, path, resume=True, progress=seen.append)
    assert len(seen) == 13 - kept
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.db", "study.toml"]
    require_same_bits(found.dataset, run_sweep(STUDY, tmp_path / "b.db", threads=2).dataset)


# A sweep on a real Dask scheduler with two worker processes on the loopback.

SMALL = small_study(2)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """The small sweep on two threads."""
    return run_sweep(SMALL, tmp_path_factory.mktemp("small") / "a.db", threads=2)


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of a scheduler in a process of its own, with two workers in theirs."""
    pytest.importorskip("distributed")
    with loopback_cluster(2) as address:
        yield address


def test_two_workers_give_the_same_bits(cluster: str, small: SweepResult, tmp_path: Path) -> None:
    import distributed

    seen: list[float] = []
    found = run_sweep(SMALL, tmp_path / "b.db", scheduler=cluster, chunk=1, progress=seen.append)
    require_same_bits(found.dataset, small.dataset)
    assert seen[0] == 0.0 and seen[-1] == 1.0
    assert len(seen) <= 7 and all(before < after for before, after in itertools.pairwise(seen))
    with distributed.Client(cluster, set_as_default=False) as client:
        again = run_sweep(SMALL, tmp_path / "c.db", executor=client.get_executor())
    require_same_bits(again.dataset, small.dataset)


def test_studies_on_the_workers_give_the_same_bits(cluster: str, tmp_path: Path) -> None:
    """Also an adaptive one, and one that goes on here."""
    for name in ("mapped", "tuned"):
        store = tmp_path / f"{name}.db"
        expected = STUDIES[name]()
        assert STUDIES[name](scheduler=cluster, store=store) == expected
        assert STUDIES[name](store=store, resume=True) == expected


def test_a_worker_that_is_killed_loses_nothing(
    cluster: str, small: SweepResult, tmp_path: Path
) -> None:
    """The scheduler gives its tasks to the other."""
    workers = DaskWorkers(cluster)
    assert workers.slots == 2
    processes = list(workers.client.run(os.getpid).values())

    def kill() -> None:
        if processes:
            os.kill(processes.pop(), signal.SIGKILL)
            processes.clear()

    with SweepStore(tmp_path / "b.db", SMALL) as store:
        try:
            Distribution(SMALL, store, workers, chunk=1, threads=1, progress=kill).run(range(6))
        finally:
            workers.close()
    require_same_bits(hp.study.open_sweep(tmp_path / "b.db").dataset, small.dataset)


def test_no_scheduler_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "PATIENCE", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    begin = time.monotonic()
    with refused(WorkersError, kept=0, about=("Dask", address)):
        run_sweep(SMALL, tmp_path / "a.db", scheduler=address)
    assert time.monotonic() - begin < PATIENCE
