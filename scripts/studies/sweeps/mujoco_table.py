"""MuJoCo beside a sweep: what its cases would take at the same trunk error."""

from __future__ import annotations

from collections.abc import Sequence

from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.text_table import Table
from studies.sweeps.mujoco import SampledCase, geometric_mean, sampled_case

CORES = 2
"""Over which MuJoCo's time is divided: as good as threads could do."""

ERRORS = (1e-4, 1e-3)
"""Trunk errors besides our own [m]."""


def mujoco_parts(
    study: SweepStudy, indices: Sequence[int], fine: float, rounds: int, cases: int, wall: float
) -> list[str | Table]:
    """Run cases of a study by both engines and return what the page says of it.

    Args:
        study: whose cases.
        indices: of those that are run.
        fine: step of MuJoCo's references [s].
        rounds: timed runs.
        cases: of the sweep that times are multiplied to.
        wall: time of a case in our own sweep on two threads [s].
    """
    found = [sampled_case(study.case(index), index, fine, rounds) for index in indices]
    text = (
        f"MuJoCo runs {len(found)} random cases: {_numbers(found)}. Errors are the largest "
        "distance of the trunk from the engine's own reference (ours at accuracy 1e-8, MuJoCo's "
        f"RK4 at {1e6 * fine:g} us with its solver run to the end); the contact models differ, so "
        "the references do. Its time is that of its loop in C, without Python, set-points or a "
        "summary; ours has planning and summary in it. The last column is a multiplication: its "
        f"time of a case times {cases} over {CORES} cores, not a measured sweep. Ours is the "
        f"measured time of a case in the sweep on two threads, times {cases}."
    )
    return [text, *comparison_tables(found, cases, wall)]


def _numbers(found: Sequence[SampledCase]) -> str:
    return ", ".join(str(case.index) for case in found)


def comparison_tables(found: Sequence[SampledCase], cases: int, wall: float) -> list[Table]:
    """Return the table of each case, and that of all of them at each trunk error."""
    return [
        Table("Random cases by both engines",
              ["case", "trunk error allowed [m]", "engine and setting", "trunk error [m]",
               "time of a case [ms]", "MuJoCo's reference good to [m]"],
              [row for case in found for row in _case_rows(case)]),
        Table(f"{cases} such cases on {CORES} cores",
              ["trunk error allowed [m]", "ours alone [ms]", "MuJoCo [ms]", "MuJoCo over ours",
               f"ours, {cases} cases [s]", f"MuJoCo, {cases} cases [s], by multiplication"],
              _total_rows(found, cases, wall)),
    ]  # fmt: skip


def _case_rows(case: SampledCase) -> list[list[str]]:
    name = str(case.index)
    rows = [[name, "", "hexapod_pin, accuracy 1e-4", f"{case.own_error:.1e}",
             f"{1e3 * case.own_time:.1f}", ""]]  # fmt: skip
    for error in (case.own_error, *ERRORS):
        best, doubt = case.cheapest(error), f"{case.doubt:.1e}"
        if best is None:
            rows.append([name, f"{error:.1e}", "MuJoCo: none of the settings tried", "", "", doubt])
            continue
        setting, own, taken = best
        rows.append([name, f"{error:.1e}", f"MuJoCo, {setting}", f"{own:.1e}",
                     f"{1e3 * taken:.1f}", doubt])  # fmt: skip
    return rows


def _total_rows(found: Sequence[SampledCase], cases: int, wall: float) -> list[list[str]]:
    ours = geometric_mean([case.own_time for case in found])
    rows = []
    for error in (None, *ERRORS):
        best = [case.cheapest(case.own_error if error is None else error) for case in found]
        times = [run[2] for run in best if run is not None]
        said = "as ours" if error is None else f"{error:g}"
        if len(times) < len(found):
            lacking = f"none within it for {len(found) - len(times)} of {len(found)} cases"
            rows.append([said, f"{1e3 * ours:.1f}", lacking, "", f"{cases * wall:.0f}", ""])
            continue
        mean = geometric_mean(times)
        rows.append([said, f"{1e3 * ours:.1f}", f"{1e3 * mean:.1f}", f"{mean / ours:.2f}",
                     f"{cases * wall:.0f}", f"{cases * mean / CORES:.0f}"])  # fmt: skip
    return rows
