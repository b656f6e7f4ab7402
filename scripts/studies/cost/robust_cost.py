"""What a robust step costs standing and walking, beside Pinocchio's calls and MuJoCo's step."""

from __future__ import annotations

import numpy as np

from hexapod_pin.text_table import Table
from studies.cost.step_entries import (
    PINOCCHIO,
    QUICK_SIZE,
    STEP,
    StepRow,
    StepStudySize,
    measure_steps,
    own_step,
    rows_data,
    standing_and_walking,
    yardsticks,
)
from studies.cost.timing import Quartiles
from studies.study import StudyReport, verdict

METHODS = ("robust", "robust-reference", "implicit-euler")
MAX_OF_PINOCCHIO, MAX_OF_MUJOCO = 9.0 / 4.0, 0.8
"""Targets: a robust step in Pinocchio's two calls, and in MuJoCo's cheapest step."""


def robust_cost(*, quick: bool = False) -> StudyReport:
    """Cost of a robust step beside its error; quick: a few seconds, rough figures."""
    size = QUICK_SIZE if quick else StepStudySize()
    entries = {
        name: {
            **{method: own_step(motion, size, method, reference="robust") for method in METHODS},
            **yardsticks(motion, size),
        }
        for name, motion in standing_and_walking(size.duration).items()
    }
    rows = measure_steps(entries, size)
    shown = [row for row in rows if row.entry != PINOCCHIO]
    kept = [_met(row) for row in rows if row.entry == "robust"]
    head = (
        "motion / contact", "entry", "us per step", "of Pinocchio's calls", "of MuJoCo's cheapest",
        "error [m]", "result",
    )  # fmt: skip
    return StudyReport(
        "Cost of a robust step",
        [
            f"Kharagpur, steps of {STEP * 1e3:g} ms, {size.rounds} interleaved rounds, sampled at "
            "the end of the run only. Six feet are loaded while standing. Pinocchio: crba and "
            "nonLinearEffects in C++, same process, same round. MuJoCo: implicitfast through "
            "`mujoco.rollout`, its cheaper cone. Error: trunk against the robust step at the "
            "reference step (ours) or MuJoCo's own (MuJoCo), whole run.",
            Table("", head, [_cells(row) for row in shown]),
            f"Wanted of the robust step: at most {MAX_OF_PINOCCHIO:.2f} of Pinocchio's calls and "
            f"{MAX_OF_MUJOCO:.1f} of MuJoCo's cheapest step. Met in {sum(kept)} of {len(kept)} "
            "motions.",
        ],
        {"step": STEP, "rows": rows_data(rows)},
    )


def _met(row: StepRow) -> bool:
    """Tell whether a robust step costs as little as wanted."""
    pinocchio, mujoco = np.median(row.of_pinocchio), np.median(row.of_mujoco)
    return bool(pinocchio <= MAX_OF_PINOCCHIO and mujoco <= MAX_OF_MUJOCO)


def _cells(row: StepRow) -> list[str]:
    error = "-" if row.error is None else f"{row.error.whole:.1e}"
    ratios = (f"{np.median(ratio):.2f}" for ratio in (row.of_pinocchio, row.of_mujoco))
    return [row.motion, row.entry, Quartiles.of(row.samples).text(), *ratios, error,
            verdict(_met(row)) if row.entry == METHODS[0] else "-"]  # fmt: skip
