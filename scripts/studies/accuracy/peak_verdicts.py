"""Which peak torques of walks hold when they are computed again, and what moves the others."""

from __future__ import annotations

import math
import sys
from itertools import product

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import feasible_gait
from hexapod_pin.errors import GaitError
from hexapod_pin.results.peak_verdict import ACCURACY, CONTACT, SERVO, PeakVerdict, PeakVerdicts
from hexapod_pin.text_table import Table
from studies.study import StudyReport

ROBOTS = ("kharagpur", "athena")
GAITS = {
    "tripod": ("tripod", {}),
    "ripple": ("ripple", {}),
    "tetrapod": ("tetrapod", {}),
    "wave-3/4": ("wave", {"duty": 3 / 4}),
    "wave-5/6": ("wave", {"duty": 5 / 6}),
}
"""Name on the page: name of the gait, and its fields."""

START_UP = 2
"""Cycles before the window."""

CYCLE_STEP = 0.24
"""Cycle times that are too short become a multiple of it [s]: a whole number of all samples."""


def peak_verdicts(
    *,
    accuracy: float = 1e-4,
    cycle_time: float = 2.4,
    cycles: int = 3,
    robots: str = ",".join(ROBOTS),
    gaits: str = ",".join(GAITS),
    contacts: str = "accurate,s1,s2",
    threads: int = 1,
) -> StudyReport:
    """Verdicts on the largest peak of each kind of joint, for every gait of both robots."""
    rows = []
    walks = product(contacts.split(","), robots.split(","), gaits.split(","))
    for contact, robot, gait in walks:
        print("...", contact, robot, gait, file=sys.stderr, flush=True)
        case, stride = _walk(robot, gait, contact, cycle_time, cycles, accuracy)
        found = hp.study.judge_peaks(case, threads=threads)
        walk = [contact, robot, gait, f"{stride:.3g}"]
        rows += [[*walk, *_cells(row, found)] for row in found.kinds]
    head = [
        "contact",
        "robot",
        "gait",
        "cycle [s]",
        "kind",
        "verdict",
        "torque [N m]",
        "accuracy [%]",
    ]
    head += ["contact [%]", "servo [%]", "p99, spread [%]", "RMS, spread [%]"]
    head += ["joints that hold", "impulse, largest spread [%]"]
    return StudyReport(
        "Peaks of torque with a verdict",
        [
            f"Walks of {START_UP} + {cycles} cycles at accuracy {accuracy:g} with "
            f"default servos, stroke 0.14 m or 80 % of the longest. Peaks of the "
            f"last {cycles} cycles, at ten times the accuracy, with doubled contact and doubled "
            "servo stiffness: a peak holds within 5 %, else it is a range. Columns in % say how "
            "far each change moved it; spreads are from the least to the largest of all.",
            Table("", head, rows),
        ],
    )


def _walk(
    robot_name: str, gait_name: str, contact: str, cycle: float, cycles: int, accuracy: float
) -> tuple[hp.Case, float]:
    """Return the walk, and its cycle time [s]: the fastest that the joints can follow."""
    robot = hp.load_robot(robot_name)
    name, fields = GAITS[gait_name]
    try:
        gait, _ = feasible_gait(robot, name, None, cycle_time=cycle, **fields)
    except GaitError as error:
        if error.quantity != "cycle_time" or not error.limit or error.limit <= cycle:
            raise
        slower = CYCLE_STEP * math.ceil(error.limit / CYCLE_STEP)
        return _walk(robot_name, gait_name, contact, slower, cycles, accuracy)
    scene = hp.Scene(robot, contact=hp.Contact.preset(contact))
    duration = (START_UP + cycles) * cycle
    return hp.Case(scene, hp.KinematicControl(gait), duration=duration, accuracy=accuracy), cycle


def _cells(row: PeakVerdict, found: PeakVerdicts) -> list[str]:
    """Return what the table tells of one kind."""
    span = f"{row.torque_peak.low:.3g} to {row.torque_peak.high:.3g}"
    joints = [joint for joint in found.joints if joint.kind == row.kind]
    changes = [row.changes.get(name, math.nan) for name in (ACCURACY, CONTACT, SERVO)]
    return [
        row.name,
        row.verdict,
        f"{row.torque_peak.value:.3g}" if row.holds else span,
        *(f"{100.0 * change:+.1f}" for change in changes),
        f"{100.0 * row.torque_p99.share:.0f}",
        f"{100.0 * row.torque_rms.share:.0f}",
        f"{sum(joint.holds for joint in joints)} of {len(joints)}",
        f"{100.0 * max(foot.impulse.share for foot in found.feet):.1f}",
    ]
