"""Tune a controller's parameters for a stated objective over several scenes, reproducibly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import (
    ParameterError,
    SimulationInterrupted,
    TuningInterrupted,
)
from hexapod_pin.sweep.objective import Objective
from hexapod_pin.sweep.tuning_result import Scores, TuningResult
from hexapod_pin.sweep.tuning_search import CandidateRuns, MakeController, SearchSpace, Values

if TYPE_CHECKING:
    from hexapod_pin.simulation.scene import Scene

SMALLEST_POPULATION = 5
"""SciPy's differential evolution needs so many candidates in a generation."""

CANDIDATES_PER_PARAMETER = 8


@checked
def tune(
    make_controller: MakeController,
    start: Values,
    bounds: Mapping[str, tuple[float, float]],
    scenes: Mapping[str, Scene],
    objective: Objective,
    *,
    held_out: Mapping[str, Scene],
    duration: float,
    seed: int,
    budget: int,
    baseline: Any = None,
    population: int | None = None,
    penalty: float = 1e3,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> TuningResult:
    """Return the parameters with the smallest objective, and what they are worth elsewhere.

    Differential evolution (Storn & Price 1997, SciPy's best1bin, whole generations at a time): each
    generation is one batch of runs that keep summaries only. The scenes of a candidate run in
    lock-step where its controller takes part in the run. The same arguments give the same bits,
    for any number of threads.

    Args:
        make_controller: makes a controller from the parameters by name. A `HexapodError` that it
            raises counts as a failed candidate.
        start: where the search begins; it is the first candidate.
        bounds: smallest and largest value of each parameter. Bounds above 0 that span a decade or
            more are searched on a logarithmic scale.
        scenes: to tune on, by name.
        objective: see `Objective`; `RelativeObjective` is one.
        held_out: scenes by name that the search does not see; start and best are run on them.
        duration: of each run [s].
        seed: of the search.
        budget: largest number of candidates, at least two generations.
        baseline: controller that scores are relative to; None: the one of `start`.
        population: candidates in a generation; None: eight for each parameter.
        penalty: score of a candidate of which a run fails, or whose objective is not finite; choose
            it above those to be expected. The best is never one that failed, unless all did.
        accuracy: as in `simulate` [m and rad].
        method: as in `simulate`.
        step: as in `simulate` [s].
        threads: as in `simulate_batch`.
        progress: called with the share of the budget that is used (0..1).

    Raises:
        ParameterError: what is given does not fit together, or is out of range.
        TuningInterrupted: Ctrl-C; `.result` holds the best so far.
        HexapodError: a run of the baseline failed: its error.
    """
    space = SearchSpace.of(start, bounds)
    size = CANDIDATES_PER_PARAMETER * len(space.names) if population is None else population
    size = max(size, SMALLEST_POPULATION) if population is None else size
    _check(scenes, held_out, size, budget, penalty, seed)
    settings = {
        "duration": duration, "accuracy": accuracy, "method": method, "step": step,
        "threads": threads,
    }  # fmt: skip
    reference = make_controller(dict(start)) if baseline is None else baseline
    search = CandidateRuns(
        space, make_controller, scenes, objective, settings, penalty, budget, progress
    )
    other = CandidateRuns(space, make_controller, held_out, objective, settings, penalty, 2, None)

    def result(others: Scores | None) -> TuningResult:
        return TuningResult(
            start=dict(start), best=search.best.values, bounds=dict(bounds),
            logarithmic=space.logarithmic, tuned=search.scores(), held_out=others,
            history=tuple(search.history), penalty=penalty, seed=seed,
        )  # fmt: skip

    try:
        for one in (search, other):
            one.run_baseline(reference)
        _evolve(search, size, budget // size - 1, seed)
        other.try_all([dict(start), search.best.values])
    except (KeyboardInterrupt, SimulationInterrupted):
        done = result(None) if search.history else None
        text = f"tuning interrupted after {len(search.history)} of {budget} candidates"
        raise TuningInterrupted(text, done) from None
    return result(other.scores(best=1))


def _evolve(search: CandidateRuns, size: int, generations: int, seed: int) -> None:
    """Run differential evolution on the unit cube, beginning with the start."""
    from scipy.optimize import differential_evolution

    space, dice = search.space, np.random.default_rng(seed)
    cells = dice.permuted(np.tile(np.arange(size), (len(space.names), 1)), axis=1).T
    first = (cells + dice.random(cells.shape)) / size  # a Latin hypercube
    first[0] = space.unit(space.first)
    try:
        differential_evolution(
            search, [(0.0, 1.0)] * len(space.names), init=first, maxiter=generations, seed=seed,
            polish=False, updating="deferred", vectorized=True,
        )  # fmt: skip
    except RuntimeError:
        if search.error is not None:
            raise search.error from None
        raise


def _check(
    scenes: Mapping[str, Scene],
    held_out: Mapping[str, Scene],
    size: int,
    budget: int,
    penalty: float,
    seed: int,
) -> None:
    """Refuse sets of scenes that are empty or overlap, and numbers out of range."""
    for name, given in (("scenes", scenes), ("held_out", held_out)):
        if not isinstance(given, Mapping) or not given:
            raise ParameterError(name, given, "a mapping from names to scenes, not empty")
    tuned = list(scenes.values())
    both = [name for name, scene in held_out.items() if any(scene is one for one in tuned)]
    both += [name for name in held_out if name in scenes]
    if both:
        raise ParameterError("held_out", both, "scenes and names that are not tuned on")
    if size < SMALLEST_POPULATION:
        raise ParameterError("population", size, f"at least {SMALLEST_POPULATION}")
    if budget < 2 * size:
        raise ParameterError("budget", budget, f"at least two generations, {2 * size}")
    if not math.isfinite(penalty):
        raise ParameterError("penalty", penalty, "finite")
    if not 0 <= seed < 2**32:
        raise ParameterError("seed", seed, "from 0 to 2**32 - 1")
