"""What prescribed motion costs beside servos at the same accuracy, with the errors of both."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from hexapod_pin.text_table import Table
from studies.cost.prescribed_rows import (
    HEAD,
    MAX_COST_RATIO,
    TIGHTER,
    CostRow,
    measure,
)
from studies.cost.prescribed_torque import CYCLE, torque_table
from studies.study import StudyReport

WIDE, DEFAULT = 0.1, 2e-3
"""Sampling that does not set the steps, and the default, which does [s]."""

NARROW_ACCURACY = 1e-4
"""Accuracy of the runs with the default sampling [m and rad]."""


def prescribed_cost(
    *,
    rounds: int = 5,
    cycles: int = 3,
    robots: str = "kharagpur,athena",
    contacts: str = "accurate,s1,s2",
    walks: str = "tetrapod,arc constant,arc step",
    accuracies: str = "1e-3,1e-4,1e-5,1e-6",
    factors: str = "1,4,16,64,256",
) -> StudyReport:
    """Cost and torques of prescribed motion beside servos, with errors; stiffer servos too."""
    ways: list[dict[str, Any]] = [
        {"accuracy": float(a), "method": "extrapolated-euler"} for a in accuracies.split(",")
    ]
    ways.append({"accuracy": ways[-1]["accuracy"], "method": "ndf"})
    scenes = [
        (robot, contact, walk)
        for robot, contact, walk in product(
            robots.split(","), contacts.split(","), walks.split(",")
        )
        if robot == "kharagpur" or walk == "tetrapod"
    ]
    wide, narrow = [], []
    for scene in scenes:
        print("...", *scene, file=sys.stderr, flush=True)
        wide += [measure(scene, how, WIDE, cycles, rounds) for how in ways]
        if scene[2] == scenes[0][2]:
            narrow.append(
                measure(
                    scene,
                    {"accuracy": NARROW_ACCURACY, "method": "extrapolated-euler"},
                    DEFAULT,
                    cycles,
                    rounds,
                )
            )
    torques, torques_met = torque_table(scenes, cycles, [float(f) for f in factors.split(",")])
    return StudyReport(
        "What prescribed motion costs, and what servos come to",
        [
            _about(cycles, rounds),
            Table("Cost, samples every 0.1 s", HEAD, [row.cells() for row in wide]),
            _verdict(wide),
            _at_equal_errors(wide),
            Table("Cost, samples every 2 ms (the default)", HEAD, [r.cells() for r in narrow]),
            _verdict(narrow),
            torques,
        ],
        met=torques_met and all(row.met for row in (*wide, *narrow)),
    )


def _verdict(rows: Sequence[CostRow]) -> str:
    ratios = np.array([row.core_ratio for row in rows])
    calls = np.array([row.call_ratio for row in rows])
    missed = int(sum(not row.met for row in rows))
    beyond = [sum(row.base[k] > row.accuracy for row in rows) for k in (0, 1)]
    worst = [max(row.base[k] / row.accuracy for row in rows) for k in (0, 1)]
    return (
        f"Integration: ratio {np.median(ratios):.2f} (median; {ratios.min():.2f} to "
        f"{ratios.max():.2f}), {missed} of {len(rows)} rows above {MAX_COST_RATIO:g}. Whole call: "
        f"{np.median(calls):.2f} ({calls.min():.2f} to {calls.max():.2f}), "
        f"{int((calls > MAX_COST_RATIO).sum())} of {len(rows)} above it. Errors of the base "
        f"above the accuracy asked for: servos {beyond[0]} rows (most {worst[0]:.2g} times), "
        f"prescribed {beyond[1]} (most {worst[1]:.2g} times)."
    )


def _about(cycles: int, rounds: int) -> str:
    return (
        f"Walks of {cycles} cycles of {CYCLE:g} s, stroke 0.14 m or 80 % of the longest (arcs: "
        f"20 degrees); default servos. One core, {rounds} interleaved rounds: medians, and medians "
        "of the ratios of each round. Cells with a comma: servo, prescribed. The verdict is on the "
        "time in the core, from the first step to the last sample; the whole call also plans the "
        "walk and builds the trace, alike for both. Errors: largest distance of the base and "
        "largest differences of a joint's torque RMS (samples behind the first cycle; of itself, "
        f"and in N m), each from a run of its own kind with ndf at {TIGHTER:g} of the accuracy. "
        "Torques of servos and of prescribed motion differ by more than that: last table, of the "
        "joint of each kind with the largest RMS in the steady cycles."
    )


def _at_equal_errors(rows: Sequence[CostRow]) -> Table:
    """Return the cost of prescribed motion over that of servos where both make the same error."""
    lines = []
    for scene in dict.fromkeys(row.scene for row in rows):
        own = [row for row in rows if row.scene == scene and row.method == rows[0].method]
        lines.append([*scene, _ratios(own, "base"), _ratios(own, "torque")])
    head = ["robot", "contact", "walk", "same error of the base", "same error of torque RMS [N m]"]
    title = f"Cost ratios at the same error made, {rows[0].method}, times of servos interpolated"
    return Table(title, head, lines)


def _ratios(rows: Sequence[CostRow], quantity: str) -> str:
    """Return the median ratio and its range over accuracies whose error servos make too."""
    errors = np.log([getattr(row, quantity) for row in rows])
    times = np.log([row.core for row in rows])
    order = np.argsort(errors[:, 0])
    within = (errors[:, 1] >= errors[:, 0].min()) & (errors[:, 1] <= errors[:, 0].max())
    if not within.any():
        return "- (errors do not overlap)"
    servo = np.interp(errors[within, 1], errors[order, 0], times[order, 0])
    found = np.exp(times[within, 1] - servo)
    return f"{np.median(found):.2f} ({found.min():.2f} to {found.max():.2f})"
