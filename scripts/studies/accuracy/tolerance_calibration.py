"""Does an accuracy mean what it says? True errors over random drops and walks."""

from __future__ import annotations

from dataclasses import replace

from hexapod_pin.benchmark.hard_suite import (
    ACCURACIES,
    SEED,
    calibrate,
    calibration_table,
    largest_cost_ratio,
    random_tasks,
)
from hexapod_pin.text_table import Table
from studies.study import StudyReport

METHOD_ACCURACIES = {"extrapolated-euler": ACCURACIES, "ndf": (1e-5, 1e-6, 1e-7)}


def tolerance_calibration(
    *, methods: str = ",".join(METHOD_ACCURACIES), seed: int = SEED, drops: int = 18
) -> StudyReport:
    """The accuracy asked for and the error made, over random drops and as many walks."""
    parts: list[str | Table] = [f"Seed {seed}."]
    broken = 0
    for method in methods.split(","):
        tasks = random_tasks(seed, drops, drops)
        rows = calibrate(tasks, method=method, accuracies=METHOD_ACCURACIES[method])
        bad = [row for row in rows if not row.kept]
        broken += len(bad)
        parts += [
            replace(calibration_table(rows), title=method),
            f"A looser run costs at most {largest_cost_ratio(rows):.2f} times a tighter one. "
            f"Beyond the promise: {len(bad)} of {len(rows)}.",
            *(f"- {row.scene} at {row.accuracy:.0e}: {row.factor:.2f} times" for row in bad),
        ]
    return StudyReport("Accuracy asked for, error made", parts, met=broken == 0)
