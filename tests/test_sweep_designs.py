"""Designs fill the unit cube, distributions have their quantiles, costs of sweeps add up."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy import stats
from studies.sweeps.forecast import SweepCosts, forecast, line
from studies.sweeps.many_walks import many_walks, time_split
from studies.sweeps.measurements import store_rate, task_bytes
from studies.sweeps.scale_page import fed_table
from studies.sweeps.simulated_workers import simulated_task

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.study.runs.outcome import from_bytes
from hexapod_pin.study.runs.task import run_task, task_of
from hexapod_pin.study.sweep.design import KINDS, Design
from hexapod_pin.study.sweep.distributions import (
    Choice,
    Distribution,
    LogNormal,
    Normal,
    Triangular,
    Uniform,
)

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


def test_quasi_random_means_are_closer() -> None:
    def error(kind: str) -> float:
        cubes = [Design(kind=kind, samples=256, seed=k).cube(3) for k in range(8)]
        return float(np.sqrt(np.mean([(np.prod(c, axis=1).mean() - 0.125) ** 2 for c in cubes])))

    assert max(error("sobol"), error("halton")) < 0.2 * error("random")


WITHOUT_FILES = """
import resource, sys
import scipy.stats.qmc
from hexapod_pin.errors import ResourceError
from hexapod_pin.study.sweep.design import Design
Design(kind="random", samples=4).cube(2)  # loads what all kinds use
resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))
for kind in "sobol", "sobol-indices":
    try:
        Design(kind=kind, samples=4).cube(2)
    except ResourceError as error:
        print(error)
"""


def test_an_unreadable_table_of_directions_is_an_error() -> None:
    """SciPy continues without the table and draws the same point again and again."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_FILES], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    errors = done.stdout.splitlines()
    assert len(errors) == 2
    for text in errors:
        assert text.startswith("SciPy's table of Sobol's directions: it cannot be read")
        assert "Too many open files" in text and "ulimit -n" in text


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


def test_cores_fed_is_task_time_over_time_of_the_busier_one() -> None:
    """Scheduler 4 + 0.1 c ms, parent 1 + 0.4 c ms: they are equal at c = 10."""
    for chunk, cores, limit in (
        (4, 4 * 0.05 / 4.4e-3, "scheduler"),
        (64, 64 * 0.05 / 26.6e-3, "parent"),
    ):
        assert COSTS.cores_fed(chunk) == (pytest.approx(cores, rel=1e-4), limit)
    # a short study on a fast machine reads 0 for the scheduler: the parent alone counts
    idle = replace(COSTS, scheduler_task=0.0, scheduler_case=0.0)
    assert idle.cores_fed(4) == (pytest.approx(4 * 0.05 / 2.6e-3), "parent")
    assert len(fed_table(idle).rows) == len(fed_table(COSTS).rows)
    assert line((4, 64), (4.4e-3, 10.4e-3)) == pytest.approx((4e-3, 1e-4))
    assert COSTS.dataset_cases(8e9) == pytest.approx(7.9e9 / 3e4)


def test_forecasts_of_each_limit() -> None:
    """1e6 cases of 50 ms: 25000 s on 2 cores, 4.4 ms for each of 250000 tasks on any number."""
    found = forecast(COSTS, 1_000_000, 2, 4)
    assert found.limit == "cores"
    assert found.hours == pytest.approx(25_000 / 3600)
    assert found.core_hours == pytest.approx(1e6 * 0.05 / 3600)
    assert found.scheduler_load == pytest.approx(250_000 * 4.4e-3 / 25_000)
    assert found.parent_load == pytest.approx(250_000 * 2.6e-3 / 25_000)
    assert found.messages == pytest.approx(6 * 10.0)  # 40 cases/s in tasks of 4
    assert found.traffic == pytest.approx(40 * 5000.0)
    found = forecast(COSTS, 1_000_000, 1000, 4)
    assert found.limit == "scheduler"
    assert found.seconds == pytest.approx(0.2 + 1100.0)  # the first results come after a task
    parent = forecast(COSTS, 1_000_000, 1000, 250)  # 101 ms for each of 4000
    assert parent.limit == "parent" and parent.seconds == pytest.approx(12.5 + 404.0)


def test_time_of_a_case_is_split_without_a_rest(tmp_path) -> None:
    with refused(ParameterError, "cases", 41, allowed=(4,)):
        many_walks(41, 5.0, 3)
    study = many_walks(4, 0.3, 1)
    split = time_split(study, [0, 2])
    parts = (split.case, split.plan, split.core, split.result)
    assert min(parts) > 0.0
    assert split.total == pytest.approx(sum(parts))
    answer = run_task(*task_of(study, list(range(4)), 1))
    (tmp_path / "answer").write_bytes(answer)
    found = from_bytes(simulated_task(str(tmp_path / "answer"), 0.0, "", "", "", {}, [7, 8, 12], 1))
    assert [one.index for one in found] == [7, 8, 12]
    for one, true in zip(found, from_bytes(answer), strict=False):
        assert one.numbers == true.numbers and one.labels == true.labels
    assert store_rate(study, tmp_path, answer, 4) > 0.0
    assert hp.study.open_sweep(tmp_path / "rows4.db").done == 4
    text = len(study.text)
    one, many = task_bytes(study, 1), task_bytes(study, 101)
    assert text < one < text + 2000 and many > one
