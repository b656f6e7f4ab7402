"""Which motors carry a robot on its walks, ranked; the lightest of them; and how sure it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.results.motor_selection import MotorCandidate, MotorSelection
from hexapod_pin.sweep.selection.confidence import UncertainInputs, confidence_of
from hexapod_pin.sweep.selection.evaluation import Evaluation
from hexapod_pin.sweep.selection.lightest import LightestChoice, lightest_choice
from hexapod_pin.sweep.selection.motor_places import (
    MOTOR_SHARE,
    assumed_motor_mass,
    motor_counts,
)
from hexapod_pin.sweep.selection.motor_study import candidates, read_motor_study
from hexapod_pin.sweep.selection.required_walks import required_walks
from hexapod_pin.user_file import read_text, user_path

if TYPE_CHECKING:
    from hexapod_pin.simulation.case import Case

Stage = Callable[[str], Callable[[float], None]]
"""Begins a stage of the work by its title, and returns what is told its finished fraction."""


@checked
def select_motors(
    text: str,
    folder: str | Path | None = None,
    *,
    threads: int = 2,
    samples: int | None = None,
    stage: Stage | None = None,
) -> MotorSelection:
    """Rank the motors of a catalogue for a robot and its walks.

    Every motor is put on all joints, with its mass, its rotor's inertia and its torque-speed line,
    and all walks are simulated; where a line acts, again without it, for what the walk asks for.
    From all of them the lightest motor for each kind of joint follows, with the masses fed back,
    and for it the uncertain inputs are sampled.

    Args:
        text: of the study: a sweep study (`base`, `vary`, `design`) with the tables `motors` and
            `derating`. Inputs on a grid are the walks that must be carried; those with a
            distribution are uncertain. Without any, *assumed* ones are taken.
        folder: where its relative paths start, if not here.
        threads: as in `simulate_batch`.
        samples: of the uncertain inputs, 0 for none; None: as the study says, else 64.
        stage: called with the title of each stage, and returns what takes its progress.

    Raises:
        ParameterError: the study is not usable; names the place in it.
        CatalogError: the catalogue is not.
        UrdfError, UnknownNameError, GaitError: its robot, a motor or a gait is not.
        SimulationInterrupted: Ctrl-C before any motor was done. Later, the result holds what was
            done, and `interrupted` says so.

    Example:
        >>> found = select_motors(*load_motor_study("study.toml"))
        >>> print(found.table())
    """
    file, place = read_motor_study(text), user_path(folder or ".").absolute()
    begin = stage or (lambda title: lambda fraction: None)
    motors = candidates(file.choice, place)
    walks = required_walks(file.sweep, place)
    first = next(iter(walks.values()))
    robot = first.scene.robot
    inputs = None if samples == 0 else UncertainInputs.of(file.sweep, first, samples)
    contained = file.choice.motor_mass
    if contained is None:
        contained = assumed_motor_mass(robot)
    evaluation = Evaluation(walks, contained, file.derating, threads)
    kinds = tuple(motor_counts(robot))
    sets = [dict.fromkeys(kinds, record) for record in motors.records]
    ranked = ranked_candidates(evaluation.of(sets, begin(f"{len(sets)} motors")))
    if not ranked:
        raise SimulationInterrupted("interrupted before any motor was done", None)
    begin("lightest motors")
    search, others = lightest_choice(evaluation, motors.records, kinds)
    selection = MotorSelection(
        robot=robot.name, mass=robot.total_mass, contained=contained, walks=tuple(walks),
        candidates=ranked, unusable=motors.unusable, choice=search.choice,
        iterations=tuple(search.steps), confidence=None, derating=file.derating,
        catalog=motors.source, assumed=_assumed(walks, file.choice.motor_mass, contained, ranked),
        notes=(*others, *_notes(search, ranked)), interrupted=evaluation.interrupted,
    )  # fmt: skip
    if evaluation.interrupted:
        return selection
    best = selection.best
    selection = replace(selection, demands=evaluation.demands(best.motors))
    if inputs is None or not best.passes:
        return selection
    found = confidence_of(best, inputs, evaluation, begin("uncertain inputs"))
    return replace(selection, confidence=found, interrupted=evaluation.interrupted)


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
    return tuple(dict.fromkeys([*found, *(note for c in ranked[:1] for note in c.notes)]))
