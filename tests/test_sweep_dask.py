"""A sweep on a real Dask scheduler with two worker processes on the loopback."""

from __future__ import annotations

import itertools
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from refusals import refused
from studies.sweeps.loopback_cluster import free_port, loopback_cluster

import hexapod_pin as hp
from hexapod_pin.errors import WorkersError
from hexapod_pin.study.runs import run_sweep
from hexapod_pin.study.runs import workers as executors
from hexapod_pin.study.runs.distribution import Distribution
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.workers import DaskWorkers
from tests.runner_studies import STUDIES
from tests.sweep_studies import require_same_bits, small_study

pytestmark = pytest.mark.slow
distributed = pytest.importorskip("distributed")
STUDY = small_study(2)
PATIENCE = 60.0
"""Longest wait for a process [s]."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of a scheduler in a process of its own, with two workers in theirs."""
    with loopback_cluster(2) as address:
        yield address


def test_two_workers_give_the_same_bits(cluster: str, tmp_path: Path) -> None:
    here = run_sweep(STUDY, tmp_path / "a.db", threads=2)
    seen: list[float] = []
    found = run_sweep(STUDY, tmp_path / "b.db", scheduler=cluster, chunk=1, progress=seen.append)
    require_same_bits(found.dataset, here.dataset)
    assert seen[0] == 0.0 and seen[-1] == 1.0
    assert len(seen) <= 7 and all(before < after for before, after in itertools.pairwise(seen))
    with distributed.Client(cluster, set_as_default=False) as client:
        again = run_sweep(STUDY, tmp_path / "c.db", executor=client.get_executor())
    require_same_bits(again.dataset, here.dataset)


def test_studies_on_the_workers_give_the_same_bits(cluster: str, tmp_path: Path) -> None:
    """Also an adaptive one, and one that goes on here."""
    for name in ("mapped", "tuned"):
        store = tmp_path / f"{name}.db"
        expected = STUDIES[name]()
        assert STUDIES[name](scheduler=cluster, store=store) == expected
        assert STUDIES[name](store=store, resume=True) == expected


def test_a_worker_that_is_killed_loses_nothing(cluster: str, tmp_path: Path) -> None:
    """The scheduler gives its tasks to the other."""
    here = run_sweep(STUDY, tmp_path / "a.db", threads=2)
    workers = DaskWorkers(cluster)
    assert workers.slots == 2
    processes = list(workers.client.run(os.getpid).values())

    def kill() -> None:
        if processes:
            os.kill(processes.pop(), signal.SIGKILL)
            processes.clear()

    with SweepStore(tmp_path / "b.db", STUDY) as store:
        try:
            Distribution(STUDY, store, workers, chunk=1, threads=1, progress=kill).run(range(6))
        finally:
            workers.close()
    require_same_bits(hp.study.open_sweep(tmp_path / "b.db").dataset, here.dataset)


def test_no_scheduler_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "PATIENCE", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    begin = time.monotonic()
    with refused(WorkersError, kept=0, about=("Dask", address)):
        run_sweep(STUDY, tmp_path / "a.db", scheduler=address)
    assert time.monotonic() - begin < PATIENCE
