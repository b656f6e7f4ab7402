"""Motors are selected for a robot on its required walks.

The walk that requires most is sampled, for a confidence in the choice.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.control.body_path import TRANSIENT_CYCLES
from hexapod_pin.errors import StudyInterrupted
from hexapod_pin.results.motor_candidate import USES, MotorCandidate
from hexapod_pin.results.motor_selection import Confidence, MotorSelection
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.assumed_inputs import assumed_inputs
from hexapod_pin.study.runs.runner import Runner, RunOptions, run_study
from hexapod_pin.study.selection.evaluation import (
    LARGEST_USE,
    Evaluation,
    LightestChoice,
    lightest_choice,
    motor_settings,
)
from hexapod_pin.study.selection.motor_cases import (
    MOTOR_SHARE,
    assumed_motor_mass,
    motor_counts,
    motor_loads,
    with_motors,
)
from hexapod_pin.study.selection.motor_study import candidates, read_motor_study
from hexapod_pin.study.sweep.base_case import base_case, gait_of
from hexapod_pin.study.sweep.fields import table_at
from hexapod_pin.study.sweep.sweep_study import SweepStudy
from hexapod_pin.study.uncertainty import Uncertainty, uncertainty
from hexapod_pin.user_file import read_text, user_path

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from hexapod_pin.study.selection.motor_study import Candidates, MotorStudyFile


Stage = Callable[[str], Callable[[float], None]]
"""Begins a stage of the work by its title, and returns what receives its finished fraction."""

STAGES = 3
"""Motors, the lightest ones, uncertain inputs."""


@checked
def select_motors(
    text: str,
    folder: str | Path | None = None,
    *,
    samples: int | None = None,
    stage: Stage | None = None,
    **how: Unpack[RunOptions],
) -> MotorSelection:
    """Rank the motors of a catalogue for a robot and its walks.

    Every motor is put on all joints, with its mass, its rotor's inertia and its torque-speed line,
    and all walks are simulated; where a line acts, again without it, for what the walk requires.
    From all of them the lightest motor for each kind of joint follows, with the masses fed back,
    and for it the uncertain inputs are sampled.

    Args:
        text: of the study: a sweep study (`base`, `vary`, `design`) with the tables `motors` and
            `derating`. Inputs on a grid are the walks that must be carried; those with a
            distribution are uncertain. Without any, *assumed* ones are taken.
        folder: where its relative paths start, if not here.
        samples: of the uncertain inputs, 0 for none; None: as in the study, else 64.
        stage: called with the title of each stage, and returns what takes its progress.
        **how: store, threads, workers, progress (where no `stage` is given): see `RunOptions`.

    Raises:
        ParameterError: the study is not usable; names the place in it.
        CatalogError: the catalogue is not.
        UrdfError, UnknownNameError, GaitError: its robot, a motor or a gait is not.
        StudyInterrupted: Ctrl-C; `.result` holds what was done, None before any motor was.
        HexapodError: as of `run_study`.

    Example:
        >>> found = select_motors(*load_motor_study("study.toml"))
        >>> print(found.table())
    """
    file, place = read_motor_study(text), user_path(folder or ".").absolute()
    motors = candidates(file.choice, place)
    walks = required_walks(file.sweep, place)
    first = next(iter(walks.values()))
    inputs = None if samples == 0 else UncertainInputs.of(file.sweep, first, samples)
    return run_study(selected, file, motors, walks, inputs, stage, **how)


def selected(
    run: Runner, file: MotorStudyFile, motors: Candidates, walks: Mapping[str, Case],
    inputs: UncertainInputs | None, stage: Stage | None,
) -> MotorSelection:  # fmt: skip
    """Rank motors and choose the lightest; the study behind `select_motors`."""
    begin = _stages(run, stage)
    first = next(iter(walks.values()))
    robot = first.scene.robot
    contained = file.choice.motor_mass
    if contained is None:
        contained = assumed_motor_mass(robot)
    evaluation = Evaluation(walks, contained, file.derating, run)
    kinds = tuple(motor_counts(robot))
    sets = [dict.fromkeys(kinds, record) for record in motors.records]
    begin(f"{len(sets)} motors")
    ranked = ranked_candidates(evaluation.of(sets, report=True))
    if not ranked:
        raise StudyInterrupted("interrupted before any motor was done", None)
    begin("lightest motors")
    search, others = lightest_choice(evaluation, motors.records, kinds)
    selection = MotorSelection(
        robot_name=robot.name, total_mass=robot.total_mass, contained=contained, walks=tuple(walks),
        candidates=ranked, unusable=motors.unusable, choice=search.choice,
        iterations=tuple(search.steps), confidence=None, derating=file.derating,
        catalog=motors.source, assumed=_assumed(walks, file.choice.motor_mass, contained, ranked),
        notes=(*others, *_notes(search, ranked)), interrupted=run.interrupted,
        contact=first.scene.contact.describe(),
        accuracy=first.settings.accuracy_text,
    )  # fmt: skip
    if run.interrupted:
        return selection
    best = selection.best
    selection = replace(selection, demands=evaluation.demands(best.motors))
    if inputs is None or not best.passes:
        return selection
    begin("uncertain inputs")
    found = confidence_of(best, inputs, evaluation)
    return replace(selection, confidence=found, interrupted=run.interrupted)


def _stages(run: Runner, stage: Stage | None) -> Callable[[str], None]:
    """Return what begins a stage by its title: from then on its progress is reported."""
    whole, begun = run.progress, itertools.count()

    def begin(title: str) -> None:
        number = next(begun)
        if stage is not None:
            run.progress = stage(title)
        elif whole is not None:
            run.progress = lambda fraction: whole((number + fraction) / STAGES)

    return begin


def load_motor_study(path: str | Path) -> tuple[str, Path]:
    """Return the text of a study file and its folder, for `select_motors`.

    Raises:
        ParameterError: no such file.
    """
    return read_text(path, "study file"), user_path(path).absolute().parent


def ranked_candidates(found: Sequence[MotorCandidate]) -> tuple[MotorCandidate, ...]:
    """Return candidates in their order: those that pass by mass, then the others by their use."""
    passing = [c for c in found if c.passes]
    others = [c for c in found if not c.passes]
    return (
        *sorted(passing, key=lambda c: (c.motor_mass, c.worst)),
        *sorted(others, key=lambda c: (sum(not u.passes for u in c.uses), c.worst)),
    )


def _assumed(
    walks: Mapping[str, Case],
    given: float | None,
    contained: float,
    ranked: Sequence[MotorCandidate],
) -> tuple[str, ...]:
    """Return what no source gives: of the scenes, of the masses, of the motors."""
    found = [line for case in walks.values() for line in case.scene.assumed]
    if given is None:
        found.append(
            f"the robot's file contains motors of {1e3 * contained:.3g} g each: "
            f"{100 * MOTOR_SHARE:g} % of its mass in all (motors.motor_mass gives it)"
        )
    records = {record.name: record for c in ranked for record in c.motors.values()}
    found += [f"{name}: {line}" for name, r in records.items() for line in r.assumed]
    return tuple(dict.fromkeys(found))


def _notes(search: LightestChoice, ranked: Sequence[MotorCandidate]) -> tuple[str, ...]:
    found = [f"no motor of the catalogue carries the {kind} joints" for kind in search.missing]
    if search.choice is not None:
        found += [*_doubted(search.choice, ranked), *search.choice.mixed]
    return tuple(dict.fromkeys([*found, *(note for c in ranked[:1] for note in c.notes)]))


def _doubted(choice: MotorCandidate, ranked: Sequence[MotorCandidate]) -> list[str]:
    """Return a note on the lightest motor on all joints that only heat may rule out."""
    lighter = [
        c for c in ranked if not c.passes and c.doubtful and c.motor_mass < choice.motor_mass
    ]
    if not lighter:
        return []
    one = min(lighter, key=lambda c: (c.motor_mass, c.worst))
    cool, hot = (max(u.winding[k] for u in one.uses) for k in (0, 1))
    return [
        f"lighter, but doubtful: {one.name}, windings at {cool:.0f} to {hot:.0f} deg C by assumed "
        f"thermal constants, use {one.worst:.2f}"
    ]


# Confidence that chosen motors pass: inputs of the walk that requires most are sampled.

SAMPLES = 64
"""Samples of the uncertain inputs where the study gives no number; a power of two."""

DESIGN = "sobol-indices"
USE = "motor use"
LIMIT = 1.0


@dataclass(frozen=True)
class UncertainInputs:
    """What is sampled, and how.

    Attributes:
        vary: tables `[[vary]]` of a study file, each with a distribution.
        design: its table `[design]`.
        words: the inputs as text.
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
            samples: rows of the design; None: as in the study, else 64.

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
    chosen: MotorCandidate, inputs: UncertainInputs, evaluation: Evaluation
) -> Confidence | None:
    """Sample the uncertain inputs of the walk that requires most of chosen motors.

    A sampled walk passes where the robot walks and no motor is used above 1: peak torque over the
    derated line at its speed and RMS torque over continuous torque, of accepted steps.

    Args:
        chosen: motors that pass.
        inputs: what is sampled.
        evaluation: walks, masses and derating.

    Returns:
        None after Ctrl-C.
    """
    walk = _hardest(chosen, evaluation)
    loads, _ = motor_loads(evaluation.robot, chosen.motors, evaluation.contained)
    case = with_motors(
        evaluation.walks[walk], chosen.motors, loads, evaluation.derating.voltage, line=True
    )
    study = SweepStudy.of_case(case, inputs.vary, inputs.design)
    settings = motor_settings(chosen.motors, evaluation.derating)
    rows = evaluation.run.rows(
        [study.case(k) for k in range(len(study))], LARGEST_USE.with_settings(**settings)
    )
    if not rows.complete:
        return None
    values = np.array([row if isinstance(row, float) else math.nan for row in rows])
    found = uncertainty(study, {USE: values}, USE, LIMIT)
    return _confidence(chosen, walk, found, values, inputs.words)


def _hardest(chosen: MotorCandidate, evaluation: Evaluation) -> str:
    """Return the walk in which the largest use is reached."""
    use = max(chosen.uses, key=lambda item: item.worst)
    name = max(USES, key=lambda key: np.nan_to_num(getattr(use, key), nan=-1.0))
    return use.walk.get(name) or next(iter(evaluation.walks))


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


# The walks that motors must carry: the grid of a study, each with its name.

STEADY_CYCLES = 1
"""Whole cycles of steady walking that a budget is taken over, at least: they repeat."""


SAMPLE = 2e-3
"""Time between samples where the study gives none [s]: lines are compared with samples."""


def required_walks(tables: Mapping[str, Any], folder: Path) -> dict[str, Case]:
    """Return the cases of a study's grid; without a grid, its base.

    Each lasts as long as in the study, or as its start-up and one more cycle where that is
    longer.

    Args:
        tables: of the study file; uncertain inputs are left out.
        folder: where its relative paths start.

    Raises:
        ParameterError: the file is not usable; names the place in it.
        UrdfError, UnknownNameError, GaitError: its robot or gait is not.
    """
    import tomli_w

    base = tables.get("base", {})
    if isinstance(base, Mapping) and "case" not in base and "duration" in base:
        tables = {**tables, "base": {"sample": SAMPLE, **base}}
    vary = tables.get("vary", [])
    grid = [x for x in vary if not (isinstance(x, Mapping) and "distribution" in x)]
    if not grid:
        return {"walk": long_enough(base_case(tables.get("base", {}), folder))}
    kept = {key: value for key, value in tables.items() if key != "design"}
    study = SweepStudy(tomli_w.dumps({**kept, "vary": grid}), folder)
    names = [_name(study, k) for k in range(len(study))]
    return {name: long_enough(study.case(k)) for k, name in enumerate(names)}


def long_enough(case: Case) -> Case:
    """Return a case that holds a steady cycle."""
    gait = gait_of(case.controller)
    if gait is None or case.duration is None:
        return case
    least = (TRANSIENT_CYCLES + STEADY_CYCLES) * gait.cycle_time
    return case if case.duration >= least else replace(case, duration=least)


def _name(study: SweepStudy, index: int) -> str:
    """Return what a walk is called: the values of its inputs."""
    parts = []
    for item in study.inputs:
        value = study.point(index)[item.name]
        unit = "" if item.unit in ("", "-") else f" {item.unit}"
        parts.append(value if isinstance(value, str) else f"{item.name} {value:g}{unit}")
    return ", ".join(parts)
