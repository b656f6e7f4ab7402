"""What goes wrong where motors are chosen without their mass, or without their line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.drive.catalog import MotorRecord, load_catalog
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.study.selection.evaluation import Evaluation, LightestChoice
from hexapod_pin.study.selection.motor_cases import motor_counts
from hexapod_pin.study.selection.selecting import required_walks
from hexapod_pin.text_table import Table
from studies.study import StudyReport

if TYPE_CHECKING:
    from hexapod_pin.results.motor_candidate import MotorCandidate
    from hexapod_pin.results.sizing import JointDemand

PAYLOADS = (0.0, 0.5, 1.0, 2.0)
"""Payloads of the walks [kg]; *assumed*, as are the cycle times."""

CYCLES = (2.4, 1.2, 0.8, 0.6)
"""Cycle times of a tripod with a stroke of 0.1 m [s]."""


def motor_feedback(*, voltage: float = 12.0, walks: int = 16) -> StudyReport:
    """Choose motors three ways for walks of kharagpur, and simulate what was chosen."""
    rows, wrong = [], {"mass": 0, "line": 0}
    records = [r for r in load_catalog() if r.unusable is None and r.voltage == voltage]
    for cycle, payload in list(product(CYCLES, PAYLOADS))[:walks]:
        found = _one(cycle, payload, records)
        rows.append(found.pop("row"))
        for name in wrong:
            wrong[name] += bool(found[name])
    head = [
        "walk", "mass fed back", "iterations", "without mass", "what comes of it", "without line",
        "what comes of it",
    ]  # fmt: skip
    return StudyReport(
        "Motors chosen without their mass, and without their torque-speed line",
        [
            "kharagpur without motors (each of the 18 adds its own mass at its joint), tripod, "
            "stroke 0.1 m, accuracy 1e-4. Each kind of joint gets the lightest motor of the "
            f"catalogue at {voltage:g} V that carries it, default derating. *Without mass*: "
            "torques of the robot without motors. *Without line*: masses are fed back, but the "
            "largest torque is held against the derated stall torque at any speed. What was chosen "
            "is then simulated with masses, rotors and lines.",
            Table("", head, rows),
            f"The choice without mass fails in {wrong['mass']} of {len(rows)} walks, the choice "
            f"without the line fails by its line or its speed in {wrong['line']}.",
        ],
        data={"wrong": wrong},
        met=all(wrong.values()),
    )


def _one(cycle: float, payload: float, records: Sequence[MotorRecord]) -> dict[str, Any]:
    """Return the row of one walk, and which simpler choices fail."""
    base = {
        "robot": "kharagpur", "accuracy": 1e-4, "duration": 3.0 * cycle,
        "gait": {"name": "tripod", "stroke": 0.1, "cycle_time": cycle},
    }  # fmt: skip
    vary = [{"input": "payload", "values": [payload]}]
    walks = required_walks({"schema": 1, "base": base, "vary": vary}, Path())
    evaluation = Evaluation(walks, 0.0, Derating())
    kinds = tuple(motor_counts(evaluation.robot))
    full = LightestChoice(evaluation, records)
    full.run(kinds, evaluation.demands(None))
    naive = full.steps[0] if full.steps else None
    lineless = _without_line(evaluation, records, kinds)
    row = [
        f"cycle {cycle:g} s, payload {payload:g} kg",
        _name(full.choice), str(len(full.steps)), _name(naive), _outcome(naive),
        _name(lineless), _outcome(lineless),
    ]  # fmt: skip
    return {
        "row": row,
        "mass": naive is not None and not naive.passes,
        "line": lineless is not None
        and any(u.peak_use > 1.0 or u.speed_use > 1.0 for u in lineless.uses),
    }


def _without_line(
    evaluation: Evaluation, records: Sequence[MotorRecord], kinds: tuple[str, ...]
) -> MotorCandidate | None:
    """Return what is chosen by torques alone, masses fed back until the choice repeats."""
    motors: Mapping[str, MotorRecord] | None = None
    seen: list[tuple[str, ...]] = []
    while True:
        chosen = _by_torque(evaluation.demands(motors), records, kinds, evaluation.derating)
        if chosen is None:
            return None
        key = tuple(record.name for record in chosen.values())
        if key in seen:
            return evaluation.of([chosen])[0]
        seen.append(key)
        motors = chosen


def _by_torque(
    demands: Mapping[str, JointDemand],
    records: Sequence[MotorRecord],
    kinds: tuple[str, ...],
    derating: Derating,
) -> dict[str, MotorRecord] | None:
    chosen: dict[str, MotorRecord] = {}
    for kind in kinds:
        parts = [demand.of_kinds((kind,)) for demand in demands.values()]
        peak = max(float(np.max(part.torque_peak)) for part in parts)
        rms = max(float(np.max(part.torque_rms)) for part in parts)
        held = max(float(np.max(part.holding)) for part in parts)
        rest = max(float(np.max(part.standing)) for part in parts)
        good = [
            r for r in records
            if max(peak, held) <= derating.peak * derating.voltage * r.stall_torque
            and max(rms, rest) <= derating.continuous_torque(r)
        ]  # fmt: skip
        if not good:
            return None
        chosen[kind] = min(good, key=lambda r: (r.mass or 0.0, r.stall_torque))
    return chosen


def _name(candidate: MotorCandidate | None) -> str:
    if candidate is None:
        return "none"
    names = [f"{kind} {record.model}" for kind, record in candidate.motors.items()]
    return f"{', '.join(names)} ({candidate.total_mass:.2f} kg)"


def _outcome(candidate: MotorCandidate | None) -> str:
    if candidate is None:
        return ""
    return "passes" if candidate.passes else f"does not pass: {candidate.reasons[0]}"
