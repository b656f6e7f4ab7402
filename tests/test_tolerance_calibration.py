"""What an accuracy promises, over a few of the random scenes of the calibrate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hexapod_pin.benchmark.hard_suite import (
    Calibration,
    calibrate,
    calibration_table,
    largest_cost_ratio,
    random_tasks,
)
from hexapod_pin.benchmark.work_precision.measure import ReferenceSolution
from hexapod_pin.benchmark.work_precision.own_entry import run_task
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting


def explicit(task: Task) -> ReferenceSolution:
    """A reference that shares no Jacobian with the default method; a full run checks it."""
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


def test_scenes_are_those_of_the_seed() -> None:
    first, again, other = random_tasks(7, 1, 1), random_tasks(7, 1, 1), random_tasks(8, 1, 1)
    for a, b in zip(first, again, strict=True):
        assert a.scene.contact == b.scene.contact
        assert np.array_equal(a.initial.q, b.initial.q)
        assert np.array_equal(a.initial.v, b.initial.v)
    assert first[0].scene.contact != other[0].scene.contact
    assert first[0].scene.contact == random_tasks(7, 3, 0)[0].scene.contact
    assert first[1].scene.contact == random_tasks(7, 0, 1)[0].scene.contact


def test_scenes_are_within_their_ranges() -> None:
    tasks = random_tasks()
    assert len(tasks) == 36
    for task in tasks:
        normal, friction = task.scene.contact.normal, task.scene.contact.friction
        is_drop = task.name.startswith("drop")
        assert 1e5 <= normal.stiffness <= (1e8 if is_drop else 1e7)
        assert (1e2 if is_drop else 2e2) <= friction.slope <= (1e4 if is_drop else 3e3)
        assert 0.1 <= normal.dissipation <= 0.6 and 0.2 <= friction.mu <= 1.0


def test_costs_and_table() -> None:
    def row(accuracy: float, error: float, evaluations: int) -> Calibration:
        return Calibration("drop", "drop 1", accuracy, error, evaluations, 1e-9)

    rows = [row(1e-3, 2e-3, 150), row(1e-5, 1.5e-5, 100)]
    assert rows[0].kept and not rows[1].kept
    assert largest_cost_ratio(rows) == 1.5
    [loose, tight] = calibration_table(rows).rows
    assert loose[:2] == ("1 drops", "1e-03") and "2.00" in loose
    assert tight[6] == "1"
