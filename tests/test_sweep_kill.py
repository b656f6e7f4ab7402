"""kill -9 of workers and of whole sweeps: what was finished stays; what workers may import."""

from __future__ import annotations

import contextlib
import gc
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
from hexapod_pin.study.runs import workers as worker_processes
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
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return [int(word) for task in tasks for word in (task / "children").read_text().split()]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_sweep_that_is_killed_goes_on(tmp_path: Path) -> None:
    """No worker outlives its parent, no lock does; on threads: tests/test_runner.py."""
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


SMALL = small_study(2)


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of a scheduler in a process of its own, with two workers in theirs."""
    pytest.importorskip("distributed")
    with loopback_cluster(2) as address:
        yield address


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    return run_sweep(SMALL, tmp_path_factory.mktemp("small") / "a.db", threads=2)


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
    store, tuned = tmp_path / "tuned.db", STUDIES["tuned"]  # an adaptive study, gone on with here
    expected = tuned()
    assert tuned(scheduler=cluster, store=store) == expected
    assert tuned(store=store, resume=True) == expected


@pytest.mark.parametrize("kind", ["own", "dask"])
def test_a_worker_that_is_killed_loses_nothing(
    kind: str, cluster: str, small: SweepResult, tmp_path: Path
) -> None:
    """After the first and the fourth answer, with a task under way."""
    workers = WorkerProcesses(1) if kind == "own" else DaskWorkers(cluster)
    answers = 0

    def kill() -> None:
        nonlocal answers
        answers += 1
        if answers == 1 or (kind == "own" and answers == 4):
            if kind == "own":
                process = workers.workers[0].process.pid
            else:
                process = next(iter(workers.client.run(os.getpid).values()))
            os.kill(process, signal.SIGKILL)

    with SweepStore(tmp_path / "b.db", SMALL) as store:
        cases = Distribution(SMALL, store, workers, chunk=1, threads=1, progress=kill)
        try:
            cases.run(range(6))
        finally:
            workers.close()
        assert cases.deaths == 2 or kind == "dask"
    found = hp.study.open_sweep(tmp_path / "b.db")
    assert found.failed == []
    require_same_bits(found.dataset, small.dataset)


def test_no_scheduler_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_processes, "PATIENCE", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    with refused(WorkersError, kept=0, about=("Dask", address)):
        run_sweep(SMALL, tmp_path / "a.db", scheduler=address)
    distributed = pytest.importorskip("distributed")
    assert not any(  # it would close itself when it is collected, in the midst of anything
        isinstance(one, distributed.Client) and one.status == "connecting"
        for one in gc.get_objects()
    )


MODULE = """
import os
with open({marker!r}, "a") as marker:
    marker.write(f"{{os.getpid()}}\\n")
exec((__import__("pathlib").Path(os.__file__).parent / "{name}.py").read_text())
"""


def test_modules_that_the_command_itself_runs_are_not_run_by_workers(tmp_path: Path) -> None:
    """Python gives the command the current folder; it is not handed on.

    Nor is an empty entry of the path: `PYTHONPATH=$PYTHONPATH:/somewhere` has one.
    """
    write_study_file(tmp_path, 1)
    marker = tmp_path / "marker"
    for name in ("struct", "random", "queue"):  # which Python, a worker or its imports ask for
        (tmp_path / f"{name}.py").write_text(MODULE.format(marker=str(marker), name=name))
    words = ["-m", "hexapod_pin", "sweep", "study.toml", "--processes", "1", "--chunk", "1"]
    process = subprocess.Popen(
        [sys.executable, *words], cwd=tmp_path, stdout=subprocess.PIPE, text=True,
        stderr=subprocess.STDOUT, env={**os.environ, "PYTHONPATH": f"{os.pathsep}/none"},
    )  # fmt: skip
    shown, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0 and "3 of 3 cases done, all walk" in shown, shown
    assert set(marker.read_text().split()) == {str(process.pid)}


def test_folders_that_are_handed_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that were named, and that of a checkout that is used in place."""
    home, gone = Path(worker_processes.__file__).parents[3], tmp_path / "gone"
    gone.mkdir()
    for folder, named, path, expected in (
        (tmp_path, "", ["", str(tmp_path), "/one", tmp_path / "no text"], ["/one"]),
        (tmp_path, str(tmp_path), ["", str(tmp_path), "/one"], [str(tmp_path), "/one"]),
        (home, "", ["", str(home), "/one"], [str(home), "/one"]),
        (gone, "", ["", "here", "/one"], ["/one"]),
    ):
        monkeypatch.chdir(folder)
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", named]))
        monkeypatch.setattr(sys, "path", path)
        if folder == gone:
            gone.rmdir()
        assert worker_processes._import_folders() == expected
    monkeypatch.chdir(tmp_path)
