"""What sweeps cost: forecasts in closed form, tables, simulated results, the split of a time."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from studies.sweeps.forecast import SweepCosts, forecast, line
from studies.sweeps.many_walks import STROKES, many_walks, time_split
from studies.sweeps.measurements import store_rate, task_bytes
from studies.sweeps.mujoco import SampledCase
from studies.sweeps.mujoco_table import comparison_tables
from studies.sweeps.scale_page import check_table, fed_table
from studies.sweeps.simulated_workers import SimulatedSweep, simulated_task

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.study.runs.outcome import from_bytes, to_bytes
from hexapod_pin.study.runs.task import run_task, task_of

COSTS = SweepCosts(
    case=0.05, worker_memory=2e8, task_bytes=2000.0, task_case_bytes=5.0, result_bytes=5000.0,
    store_bytes=5500.0, scheduler_task=4e-3, scheduler_case=1e-4, parent_task=1e-3,
    parent_case=4e-4, parent_memory=1e8, dataset_memory=3e4,
)  # fmt: skip


@pytest.fixture(scope="module")
def answer() -> bytes:
    """The answer of a worker that ran one walk of each stroke."""
    study = many_walks(4, 0.1, 1)
    return run_task(*task_of(study, list(range(4)), 1))


@pytest.mark.parametrize(
    ("chunk", "cores", "limit"),
    [
        # scheduler 4 + 0.1 c ms, parent 1 + 0.4 c ms: they are equal at c = 10
        (1, 0.05 / 4.1e-3, "scheduler"),
        (4, 4 * 0.05 / 4.4e-3, "scheduler"),
        (10, 10 * 0.05 / 5e-3, None),
        (64, 64 * 0.05 / 26.6e-3, "parent"),
        (100_000, 0.05 / 4e-4, "parent"),  # to 0.025 %: no more however large the tasks are
    ],
)
def test_cores_fed_is_task_time_over_time_of_the_busier_one(
    chunk: int, cores: float, limit: str | None
) -> None:
    found, said = COSTS.cores_fed(chunk)
    assert found == pytest.approx(cores, rel=1e-4)
    assert limit in (None, said)


def test_a_server_whose_time_is_below_the_tick_of_the_clock_is_no_limit() -> None:
    """A short study on a fast machine reads 0 for the scheduler: the parent alone counts."""
    idle = replace(COSTS, scheduler_task=0.0, scheduler_case=0.0)
    assert idle.cores_fed(4) == (pytest.approx(4 * 0.05 / 2.6e-3), "parent")
    assert forecast(idle, 1_000_000, 1000, 4).scheduler_load == 0.0
    assert len(fed_table(idle).rows) == len(fed_table(COSTS).rows)
    never = replace(idle, parent_task=0.0, parent_case=0.0)
    assert never.cores_fed(4)[0] == math.inf
    assert forecast(never, 1_000_000, 1000, 4).limit == "cores"
    assert fed_table(never).rows


def test_forecast_where_cores_are_the_limit() -> None:
    """2 cores, 1e6 cases of 50 ms: 25000 s; the rest are shares of it."""
    found = forecast(COSTS, 1_000_000, 2, 4)
    assert found.limit == "cores"
    assert found.hours == pytest.approx(25_000 / 3600)
    assert found.core_hours == pytest.approx(1e6 * 0.05 / 3600)
    assert found.scheduler_load == pytest.approx(250_000 * 4.4e-3 / 25_000)
    assert found.parent_load == pytest.approx(250_000 * 2.6e-3 / 25_000)
    assert found.messages == pytest.approx(6 * 10.0)  # 40 cases/s in tasks of 4
    assert found.traffic == pytest.approx(40 * 5000.0)


def test_forecast_where_the_scheduler_is_the_limit() -> None:
    """The first results come after a task; then 4.4 ms for each of 250000, whatever the cores."""
    found = forecast(COSTS, 1_000_000, 1000, 4)
    assert found.limit == "scheduler"
    assert found.seconds == pytest.approx(0.2 + 1100.0)
    assert found.scheduler_load == pytest.approx(1.0, abs=2e-4)
    assert found.core_hours == pytest.approx(1000 * 1100.2 / 3600)
    assert forecast(COSTS, 1_000_000, 2000, 4).seconds == found.seconds
    parent = forecast(COSTS, 1_000_000, 1000, 250)  # 101 ms for each of 4000
    assert parent.limit == "parent"
    assert parent.seconds == pytest.approx(12.5 + 404.0)


def test_forecast_is_continuous_where_the_limit_changes() -> None:
    """Just above and below the cores that are fed, times differ by the first task alone."""
    cores = math.floor(COSTS.cores_fed(64)[0])
    below, above = forecast(COSTS, 10**7, cores, 64), forecast(COSTS, 10**7, cores + 1, 64)
    assert (below.limit, above.limit) == ("cores", "parent")
    assert above.seconds == pytest.approx(below.seconds, rel=1.0 / cores)


def test_line_through_two_chunks_and_cases_within_a_memory() -> None:
    assert line((4, 64), (4.4e-3, 10.4e-3)) == pytest.approx((4e-3, 1e-4))
    assert line((4, 64), (5e-3, 4e-3)) == (5e-3, 0.0)  # noise: nothing grows downwards
    assert COSTS.dataset_cases(8e9) == pytest.approx(7.9e9 / 3e4)
    assert COSTS.dataset_cases(1e7) == 0.0


def test_a_saturated_check_is_set_against_its_forecast() -> None:
    """1000 tasks of 4 on 1000 cores: 0.2 + 4.4 s; measured 9.2 s is half as fast."""
    run = SimulatedSweep(cases=4000, chunk=4, cores=1000, wall=9.2, parent=2.76, scheduler=4.6)
    (row,) = check_table([(run, COSTS)]).rows
    assert row[3:6] == ["870", "435", "-50%"]
    assert row[6:] == ["96%, 50%", "57%, 30%", "scheduler"]
    assert [r[3] for r in fed_table(COSTS).rows[:3]] == ["scheduler", "scheduler", "parent"]


def test_study_is_a_grid_of_strokes_that_mujoco_can_be_given() -> None:
    study = many_walks(40, 5.0, 3)
    assert len(study) == 40 and study.rows == 10
    assert [study.point(k)["stroke"] for k in (0, 10, 20, 30)] == list(STROKES)
    case = study.case(17)
    assert not case.scene.loads
    assert case.duration == 5.0 and case.settings.method_settings.accuracy == 1e-4
    mu = [study.point(k)["mu"] for k in range(10)]
    # a latin hypercube has one sample in each tenth of the range
    assert sorted(int((value - 0.4) / 0.05) for value in mu) == list(range(10))
    assert study.point(7) != many_walks(40, 5.0, 4).point(7)
    with refused(ParameterError, "cases", 41, allowed=(4,)):
        many_walks(41, 5.0, 3)


def test_time_of_a_case_is_split_without_a_rest() -> None:
    split = time_split(many_walks(4, 0.3, 1), [0, 2])
    parts = (split.case, split.plan, split.core, split.result)
    assert min(parts) > 0.0
    assert split.total == pytest.approx(sum(parts))


def test_simulated_results_are_real_ones_of_other_cases(answer: bytes, tmp_path) -> None:
    (tmp_path / "answer").write_bytes(answer)
    real = from_bytes(answer)
    found = from_bytes(simulated_task(str(tmp_path / "answer"), 0.0, "", "", "", {}, [7, 8, 12], 1))
    assert [one.index for one in found] == [7, 8, 12]
    for one, true in zip(found, real, strict=False):
        assert one.numbers == true.numbers and one.labels == true.labels
        extra = {**json.loads(true.counters), "simulated": one.index}
        assert json.loads(one.counters) == extra
    assert len({one.digest for one in found}) == 3
    assert len(to_bytes(found)) / 3 == pytest.approx(len(answer) / 4, rel=0.1)


def test_store_and_task_are_measured(answer: bytes, tmp_path) -> None:
    study = many_walks(8, 0.1, 1)
    assert store_rate(study, tmp_path, answer, 4) > 0.0
    stored = hp.study.open_sweep(tmp_path / "rows4.db")
    assert stored.done == 8
    peaks = stored.dataset["torque_peak"].values
    np.testing.assert_array_equal(peaks[4:], peaks[:4])  # four real results, twice
    text = len(study.text)
    one, many = task_bytes(study, 1), task_bytes(study, 101)
    assert text < one < text + 2000
    assert 2.0 < (many - one) / 100 < 12.0  # an index is pickled in 5 bytes


def test_mujoco_times_are_multiplied_and_divided_by_cores() -> None:
    """Ours 10 and 40 ms: mean 20; MuJoCo 100 and 400 ms: mean 200 ms, 10 times ours."""
    runs = (("coarse", 5e-4, 0.02), ("fine", 5e-6, 0.1))
    first = SampledCase(3, 1e-5, 0.01, 1e-8, runs)
    second = SampledCase(9, 1e-5, 0.04, 1e-8, (("coarse", 5e-3, 0.03), ("fine", 5e-6, 0.4)))
    each, total = comparison_tables([first, second], 10_000, 0.03)
    as_ours, _, loose = total.rows
    assert as_ours == ["as ours", "20.0", "200.0", "10.00", "300", "1000"]
    assert loose[2] == f"{1e3 * math.sqrt(0.02 * 0.4):.1f}"
    assert [row[2] for row in each.rows[:4]] == [
        "hexapod_pin, accuracy 1e-4", "MuJoCo, fine", "MuJoCo, fine", "MuJoCo, coarse",
    ]  # fmt: skip
    tight = SampledCase(5, 1e-7, 0.01, 1e-8, runs)
    _, total = comparison_tables([first, tight], 10_000, 0.03)
    assert total.rows[0][2] == "none within it for 1 of 2 cases"
