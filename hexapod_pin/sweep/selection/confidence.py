"""How sure it is that chosen motors pass: the walk that asks most of them, its inputs sampled."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.motor_selection import USES, Confidence, MotorCandidate
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.summary_verdict import summary_verdict
from hexapod_pin.simulation.batch import iterate_batch
from hexapod_pin.sweep.assumed_inputs import assumed_inputs
from hexapod_pin.sweep.selection.motor_cases import motor_loads, with_motors
from hexapod_pin.sweep.study.fields import table_at
from hexapod_pin.sweep.study.sweep_study import SweepStudy
from hexapod_pin.sweep.uncertainty import Uncertainty, uncertainty

if TYPE_CHECKING:
    from hexapod_pin.drive.derating import Derating
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.sweep.selection.evaluation import Evaluation
    from hexapod_pin.sweep.selection.motor_cases import Motors

SAMPLES = 64
"""Samples of the uncertain inputs where no study says how many; a power of two."""

DESIGN = "sobol-indices"
USE = "motor use"
LIMIT = 1.0


@dataclass(frozen=True)
class UncertainInputs:
    """What is sampled, and how.

    Attributes:
        vary: tables `[[vary]]` of a study file, each with a distribution.
        design: its table `[design]`.
        words: the inputs in words.
    """

    vary: Sequence[Mapping[str, Any]]
    design: Mapping[str, Any]
    words: tuple[str, ...]

    @classmethod
    def of(cls, tables: Mapping[str, Any], case: Case, samples: int | None) -> UncertainInputs:
        """Return those of a study file, *assumed* ones where it has none; checked on a case.

        Args:
            tables: of the study file.
            case: a walk.
            samples: rows of the design; None: as the study says, else 64.

        Raises:
            ParameterError: distributions or design are not usable.
        """
        vary = [x for x in tables.get("vary", []) if isinstance(x, Mapping)]
        given = [x for x in vary if "distribution" in x]
        default = {"kind": DESIGN, "samples": SAMPLES, "seed": 1}
        design = dict(table_at(tables.get("design", default), "design"))
        if samples is not None:
            design["samples"] = samples
        if given:
            words = tuple(_words(x) for x in given)
        else:
            assumed = assumed_inputs(case.scene.robot, prescribed=case.scene.prescribed)
            given, words = [dict(x.table) for x in assumed], tuple(x.text for x in assumed)
        SweepStudy.of_case(case, given, design)
        return cls(given, design, words)


def _words(table: Mapping[str, Any]) -> str:
    names = ("distribution", "input", "path")
    rest = ", ".join(f"{key} {value}" for key, value in table.items() if key not in names)
    return f"{table.get('input', table.get('path'))}: {table['distribution']}, {rest}"


def confidence_of(
    chosen: MotorCandidate,
    inputs: UncertainInputs,
    evaluation: Evaluation,
    progress: Callable[[float], None] | None = None,
) -> Confidence | None:
    """Sample the uncertain inputs of the walk that asks most of chosen motors.

    A sampled walk passes where the robot walks and no motor is used above 1: peak torque over the
    derated line at its speed and RMS torque over continuous torque, of accepted steps.

    Args:
        chosen: motors that pass.
        inputs: what is sampled.
        evaluation: walks, masses and derating.
        progress: called with the finished fraction (0..1).

    Returns:
        None after Ctrl-C.
    """
    walk = _hardest(chosen, evaluation)
    loads, _ = motor_loads(evaluation.robot, chosen.motors, evaluation.contained)
    case = with_motors(
        evaluation.walks[walk], chosen.motors, loads, evaluation.derating.voltage, line=True
    )
    study = SweepStudy.of_case(case, inputs.vary, inputs.design)
    values = np.full(len(study), np.nan)
    cases = [study.case(k) for k in range(len(study))]
    runs = iterate_batch(cases, threads=evaluation.threads, keep="summary")
    try:
        for done, (index, result) in enumerate(runs, start=1):
            if isinstance(result, Summary):
                values[index] = _use(result, chosen.motors, evaluation.derating)
            if progress is not None:
                progress(done / len(cases))
    except (KeyboardInterrupt, SimulationInterrupted):
        evaluation.interrupted = True
        return None
    found = uncertainty(study, {USE: values}, USE, LIMIT)
    return _confidence(chosen, walk, found, values, inputs.words)


def _hardest(chosen: MotorCandidate, evaluation: Evaluation) -> str:
    """Return the walk in which the largest use is reached."""
    use = max(chosen.uses, key=lambda item: item.worst)
    name = max(USES, key=lambda key: np.nan_to_num(getattr(use, key), nan=-1.0))
    return use.walk.get(name) or next(iter(evaluation.walks))


def _use(summary: Summary, motors: Motors, derating: Derating) -> float:
    """Return the largest use of any motor; NaN of a robot that does not walk."""
    if not summary_verdict(summary).walks:
        return math.nan
    kinds = joint_kinds(summary.joint_names, len(summary.foot_names), summary.meta)
    peak = np.asarray(summary.limit_use) / derating.peak
    found = []
    for j, kind in enumerate(kinds):
        if kind in motors:
            allowed = derating.continuous_torque(motors[kind])
            found += [float(peak[j]), float(summary.torque_rms[j]) / allowed]
    return max(found)


def _confidence(
    chosen: MotorCandidate, walk: str, found: Uncertainty, values: Any, words: tuple[str, ...]
) -> Confidence:
    low, high = found.interval or (math.nan, math.nan)
    indices = found.deciding
    totals = {} if indices is None else {
        indices.names[k]: float(indices.total[k]) for k in indices.order
    }  # fmt: skip
    return Confidence(
        sentence=f"{chosen.name} {found.sentence}.",
        walk=walk,
        share=found.share or 0.0,
        low=low,
        high=high,
        walks=found.walks,
        indices=totals,
        percentiles={f"{p} %": value for p, value in found.percentiles.items()},
        inputs=words,
        values=tuple(values[: found.walks].tolist()),
    )
