"""kill -9 of workers and of the whole sweep: what was finished stays, the rest gives the same bits.

`python scripts/studies sweep_kills` does this at a hundred random moments.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hexapod_pin as hp
from hexapod_pin.errors import SweepStoreError
from hexapod_pin.study.runs import SweepResult, run_sweep
from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.workers import WorkerProcesses
from tests.sweep_studies import require_same_bits, small_study, write_study_file

pytestmark = pytest.mark.slow
STUDY = small_study(4)
PATIENCE = 60.0
"""Longest wait for a process [s]."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """The undisturbed sweep."""
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=2)


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


def test_workers_that_are_killed_lose_nothing(whole: SweepResult, tmp_path: Path) -> None:
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
    require_same_bits(found.dataset, whole.dataset)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("how", [["--threads", "1"], ["--processes", "1", "--chunk", "1"]])
def test_a_sweep_that_is_killed_goes_on(whole: SweepResult, tmp_path: Path, how: list[str]) -> None:
    """After it has begun, and after it has gone on; no worker outlives its parent, no lock does."""
    study, path = write_study_file(tmp_path, 4), tmp_path / "a.db"
    command = [sys.executable, "-m", "hexapod_pin", "sweep", str(study), "--store", str(path)]
    kept = 0
    for _ in range(2 if how[0] == "--threads" else 1):
        sweep = subprocess.Popen(
            [*command, *how, "--resume"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        end = time.monotonic() + PATIENCE
        while _finished(path) <= kept and sweep.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        workers = _children(sweep.pid) if sweep.poll() is None else []
        sweep.kill()
        sweep.wait()
        assert _finished(path) > kept  # nothing that was seen is lost
        kept = _finished(path)
        while any(map(_alive, workers)) and time.monotonic() < end:
            time.sleep(0.01)
        assert not any(map(_alive, workers))
    seen: list[float] = []
    found = run_sweep(STUDY, path, resume=True, progress=seen.append)
    assert len(seen) == 13 - kept
    require_same_bits(found.dataset, whole.dataset)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.db", "study.toml"]
