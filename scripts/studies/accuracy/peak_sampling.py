"""By how much a sampling grid misses the peaks of joint torques, and whether summaries do."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.feasible_gait import feasible_gait
from hexapod_pin.control.gait import GAITS
from hexapod_pin.errors import GaitError
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.results.joint_budget import KINDS, joint_kinds
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

ROBOTS = ("kharagpur", "athena")
GRID = 2e-3
"""Samples of a default run [s]."""

FINE_GRID = 1e-4
"""Samples of the reference [s]."""

WANTED = 0.03
"""Largest difference between the peaks of accepted steps and those of the reference."""

CYCLE_STEP = 0.24
"""Cycle times that are too short become a multiple of it [s]: a whole number of all samples."""

WHAT = ("grid", "steps", "finer")
"""What is compared with the reference."""

CYCLES_BEFORE = 2
"""Whole cycles before the one that is looked at."""


@dataclass(frozen=True)
class Peaks:
    """Largest |torque| of each joint in one cycle (n,) [N m]."""

    grid: Array  # of samples every 2 ms, at the accuracy
    steps: Array  # of the accepted steps of the same run
    finer: Array  # of the accepted steps at a tenth of the accuracy
    reference: Array  # of samples every 0.1 ms, at the tight accuracy


def peak_sampling(
    *,
    accuracy: float = 1e-4,
    tight: float = 1e-8,
    cycle_time: float = 2.4,
    robots: str = ",".join(ROBOTS),
    gaits: str = ",".join(GAITS),
    contacts: str = ",".join(PRESETS),
) -> StudyReport:
    """Peaks on the grid and at accepted steps, for every gait and contact, against a reference."""
    rows, worst, missed = [], 0.0, 0.0
    for robot in robots.split(","):
        for gait in gaits.split(","):
            for contact in contacts.split(","):
                row, steps, grid = _row(robot, gait, contact, cycle_time, (accuracy, tight))
                rows.append(row)
                worst, missed = max(worst, steps), max(missed, grid)
    head = ["robot", "gait", "contact", "cycle [s]"]
    head += [f"{what}, {kind} [%]" for what in WHAT for kind in KINDS]
    head += [*(f"{what}, worst joint [%]" for what in WHAT), "steps, kinds"]
    return StudyReport(
        "Peaks of torque between samples",
        [
            f"The third cycle of walks at accuracy {accuracy:g}: the largest |torque| of the "
            f"samples every {1e3 * GRID:g} ms (grid) and of all accepted steps, as summaries have "
            f"it (steps), of those at {0.1 * accuracy:g} too (finer), "
            f"each less that of a run at accuracy {tight:g} sampled every "
            f"{1e3 * FINE_GRID:g} ms, as a share of the latter. Per kind: the largest of its six "
            "joints. Negative: missed.",
            f"Largest difference of the kinds: grid {100 * missed:.1f} %, accepted steps "
            f"{100 * worst:.1f} % (wanted: {100 * WANTED:g} %).",
            Table("", head, rows),
        ],
        met=worst <= WANTED,
    )


def _row(
    robot_name: str, gait_name: str, contact: str, cycle: float, accuracies: tuple[float, float]
) -> tuple[list[str], float, float]:
    """Return a row of the table, and the largest differences of steps and grid over the kinds."""
    robot = hp.load_robot(robot_name)
    scene = hp.Scene(robot, contact=hp.Contact.preset(contact))
    name = [robot_name, gait_name, contact, f"{cycle:.3g}"]
    print("...", *name, file=sys.stderr, flush=True)
    try:
        gait, _ = feasible_gait(robot, gait_name, None, cycle_time=cycle)
        found = peaks_of(scene, hp.KinematicControl(gait), cycle, *accuracies)
    except GaitError as error:  # the fastest cycle that the joints can follow
        if error.quantity != "cycle_time" or not error.limit or error.limit <= cycle:
            raise
        slower = CYCLE_STEP * math.ceil(error.limit / CYCLE_STEP)
        return _row(robot_name, gait_name, contact, slower, accuracies)
    kinds = np.array(joint_kinds(robot.joint_names, len(robot.feet)))
    kind_errors = [
        relative(getattr(found, what), found.reference, kinds == kind)
        for what in WHAT
        for kind in KINDS
    ]
    joint_errors = [
        max((getattr(found, what) / found.reference - 1.0).tolist(), key=abs) for what in WHAT
    ]
    row = [*name, *(f"{100.0 * x:+.1f}" for x in (*kind_errors, *joint_errors))]
    grid, steps = (max(map(abs, kind_errors[k : k + 3])) for k in (0, 3))
    return [*row, verdict(steps <= WANTED)], steps, grid


def relative(peaks: Array, reference: Array, chosen: Array) -> float:
    """Return by how much the largest of some peaks differs from that of the reference [-]."""
    return float(peaks[chosen].max() / reference[chosen].max() - 1.0)


def peaks_of(
    scene: hp.Scene, control: hp.KinematicControl, cycle: float, accuracy: float, tight: float
) -> Peaks:
    """Walk three cycles at the accuracy and at the tight one; return the peaks of the third."""
    end = (CYCLES_BEFORE + 1) * cycle
    trace = hp.simulate(scene, control, duration=end, accuracy=accuracy, sample=GRID)
    third = trace.time >= CYCLES_BEFORE * cycle - 1e-9
    start = hp.simulate(
        scene, control, duration=CYCLES_BEFORE * cycle, accuracy=tight, sample=cycle / 24
    )
    fine = hp.simulate(
        scene, control, duration=cycle, accuracy=tight, sample=FINE_GRID, initial=start.checkpoint
    )
    finer = hp.simulate(scene, control, duration=end, accuracy=0.1 * accuracy, sample=0.1 * cycle)
    return Peaks(
        np.abs(trace.torque[third]).max(axis=0),
        np.abs(trace.summary.torque_peak),
        np.abs(finer.summary.torque_peak),
        np.abs(fine.torque).max(axis=0),
    )
