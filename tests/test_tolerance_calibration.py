"""What an accuracy promises, over a few of the random scenes of the calibrate."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hexapod_pin.benchmark.hard_suite import (
    Calibration,
    calibrate,
    largest_cost_ratio,
    random_tasks,
)
from hexapod_pin.benchmark.work_precision.measure import ReferenceSolution
from hexapod_pin.benchmark.work_precision.own_entry import run_task
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting


def explicit(task: Task) -> ReferenceSolution:
    outcome = run_task(task, SolverSetting("dop853", 1e-7))
    assert outcome.ended, outcome.note
    return ReferenceSolution(outcome, "dop853 1e-7", PositionError(1e-7, 1e-7), "-")


@pytest.fixture(scope="module")
def rows() -> list[Calibration]:
    # 0.15 s: set down, and a step begun
    tasks = [replace(task, duration=0.15) for task in random_tasks(drops=3, walks=3)]
    return calibrate(tasks, reference=explicit)


def test_extrapolated_euler_keeps_its_accuracy(rows: list[Calibration]) -> None:
    """Within 5 times what was asked at 1e-3 and 1e-4, within it at 1e-5 and 1e-6."""
    assert len(rows) == 6 * 4
    broken = [(row.scene, row.accuracy, row.factor) for row in rows if not row.kept]
    assert not broken


def test_tighter_is_better_and_looser_never_dearer(rows: list[Calibration]) -> None:
    assert largest_cost_ratio(rows) <= 1.2
    for scene in {row.scene for row in rows}:
        errors = [row.error for row in rows if row.scene == scene]  # from loose to tight
        assert errors[-1] < 0.1 * errors[0]


def test_what_is_kept_and_what_is_dear() -> None:
    loose, tight = (
        Calibration("drop", "drop 1", accuracy, error, evaluations, 1e-9)
        for accuracy, error, evaluations in ((1e-3, 2e-3, 150), (1e-5, 1.5e-5, 100))
    )
    assert loose.kept and not tight.kept and largest_cost_ratio([loose, tight]) == 1.5
