"""A controller's parameters are tuned for an objective over several scenes, reproducibly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import (
    HexapodError,
    ParameterError,
    SimulationInterrupted,
    StudyInterrupted,
    UserCodeError,
)
from hexapod_pin.results.summary import Summary
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.runs.measure import SUMMARY
from hexapod_pin.study.runs.runner import Runner, RunOptions, run_study
from hexapod_pin.study.tuning_result import Candidate, Objective, Scores, TuningResult

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from hexapod_pin.arrays import Array
    from hexapod_pin.scene.scene import Scene


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
    **how: Unpack[RunOptions],
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
        **how: store, threads, workers, progress (the share of the budget that is used): see
            `RunOptions`.

    Raises:
        ParameterError: what is given does not fit together, or is out of range.
        StudyInterrupted: Ctrl-C; `.result` holds the best so far, None if not even the baseline
            was run.
        HexapodError: a run of the baseline failed: its error; or as of `run_study`.
    """
    space = SearchSpace.of(start, bounds)
    size = CANDIDATES_PER_PARAMETER * len(space.names) if population is None else population
    size = max(size, SMALLEST_POPULATION) if population is None else size
    _check(scenes, held_out, size, budget, penalty, seed)
    settings = {"duration": duration, "accuracy": accuracy, "method": method, "step": step}
    reference = make_controller(dict(start)) if baseline is None else baseline
    search = CandidateRuns(space, make_controller, scenes, objective, settings, penalty, budget)
    other = CandidateRuns(space, make_controller, held_out, objective, settings, penalty)
    return run_study(tuned, search, other, reference, start, bounds, size, seed, **how)


def tuned(
    run: Runner, search: CandidateRuns, other: CandidateRuns, reference: Any, start: Values,
    bounds: Mapping[str, tuple[float, float]], size: int, seed: int,
) -> TuningResult:  # fmt: skip
    """Search, then run start and best on the other scenes; the study behind `tune`."""
    search.run = other.run = run
    space = search.space

    def result(others: Scores | None) -> TuningResult:
        return TuningResult(
            start=dict(start), best=search.best.values, bounds=dict(bounds),
            logarithmic=space.logarithmic, tuned=search.scores(), held_out=others,
            history=tuple(search.history), penalty=search.penalty, seed=seed,
            robot=", ".join(dict.fromkeys(one.robot.name for one in search.scenes.values())),
            walk=_walk(reference),
        )  # fmt: skip

    try:
        for one in (search, other):
            one.run_baseline(reference)
        _evolve(search, size, search.budget // size - 1, seed)
        other.try_all([dict(start), search.best.values])
    except (KeyboardInterrupt, SimulationInterrupted):
        done = result(None) if search.history else None
        text = f"tuning interrupted after {len(search.history)} of {search.budget} candidates"
        raise StudyInterrupted(text, done) from None
    return result(other.scores(best=1))


def _walk(controller: Any) -> str:
    """Return the gait of a controller with its numbers; else the kind of controller."""
    gait = getattr(getattr(controller, "walk", controller), "gait", None)
    if not isinstance(gait, Gait):
        return type(controller).__name__
    return f"{gait.name}, stroke {gait.stroke:g} m, cycle {gait.cycle_time:g} s"


def _evolve(search: CandidateRuns, size: int, generations: int, seed: int) -> None:
    """Run differential evolution on the unit cube, beginning with the start."""
    from scipy.optimize import differential_evolution

    space, rng = search.space, np.random.default_rng(seed)
    cells = rng.permuted(np.tile(np.arange(size), (len(space.names), 1)), axis=1).T
    first = (cells + rng.random(cells.shape)) / size  # a Latin hypercube
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


# Candidates of tuning: where they may lie, how they are run, and what they score.

Values = Mapping[str, float]
MakeController = Callable[[Values], Any]

LOGARITHMIC_RATIO = 10.0
"""Bounds above 0 that span this ratio or more are searched on a logarithmic scale."""


@dataclass(frozen=True)
class SearchSpace:
    """Parameters with bounds, mapped to 0..1.

    Attributes:
        names: of the parameters.
        first: their values at the start.
        low: (N,).
        high: (N,).
        logarithmic: names of those on a logarithmic scale.
    """

    names: tuple[str, ...]
    first: Array
    low: Array
    high: Array
    logarithmic: tuple[str, ...]

    @staticmethod
    def of(start: Values, bounds: Mapping[str, tuple[float, float]]) -> SearchSpace:
        """Check start and bounds.

        Raises:
            ParameterError: names differ, bounds are not ordered, or the start is not inside.
        """
        if not start or set(start) != set(bounds):
            raise ParameterError("bounds", sorted(bounds), f"for each of {sorted(start)}")
        for name, value in start.items():
            low, high = bounds[name]
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise ParameterError(f"bounds[{name}]", (low, high), "finite and ascending")
            if not low <= value <= high:
                raise ParameterError(f"start[{name}]", value, f"{low:g} to {high:g}")
        lowest, highest = (np.array([float(bounds[x][k]) for x in start]) for k in (0, 1))
        wide = tuple(name for name in start if _spans_decade(*bounds[name]))
        first = np.array([float(value) for value in start.values()])
        return SearchSpace(tuple(start), first, lowest, highest, wide)

    def values(self, unit: Array) -> dict[str, float]:
        """Return the parameters at a point (N,) of the unit cube."""
        found = {}
        for name, x, low, high in zip(self.names, unit, self.low, self.high, strict=True):
            if name in self.logarithmic:
                value = math.exp(math.log(low) + float(x) * math.log(high / low))
            else:
                value = low + float(x) * (high - low)
            found[name] = float(min(max(value, low), high))  # rounding only
        return found

    def unit(self, values: Array) -> Array:
        """Return the point of the unit cube of some parameters (N,)."""
        found = (values - self.low) / (self.high - self.low)
        for k, name in enumerate(self.names):
            if name in self.logarithmic:
                found[k] = math.log(values[k] / self.low[k]) / math.log(self.high[k] / self.low[k])
        return np.clip(found, 0.0, 1.0)


@dataclass
class CandidateRuns:
    """Candidates on a set of scenes, with the runs of the baseline and of the best so far."""

    space: SearchSpace
    make_controller: MakeController
    scenes: Mapping[str, Scene]
    objective: Objective
    settings: Mapping[str, Any]
    penalty: float
    budget: int = 0  # 0: no progress is reported
    run: Runner = field(default_factory=Runner)
    baseline: list[Summary] = field(default_factory=list)
    history: list[Candidate] = field(default_factory=list)
    generation: int = 0
    error: BaseException | None = None
    _by_scene: list[dict[str, float]] = field(default_factory=list)
    _failures: list[dict[str, str]] = field(default_factory=list)

    @property
    def best(self) -> Candidate:
        """The candidate with the smallest score, the first of equal ones; failed ones last."""
        return min(self.history, key=lambda one: (bool(one.failure), one.score))

    def run_baseline(self, controller: Any) -> None:
        """Run and score the baseline; its first error is raised.

        Raises:
            ParameterError: the objective of the baseline is not finite.
        """
        cases = [Case(scene, controller, **self.settings) for scene in self.scenes.values()]
        runs = self.run.rows(cases, SUMMARY, span=None).require_complete()
        for error in runs:
            if isinstance(error, Exception):
                raise error
        self.baseline = [run for run in runs if isinstance(run, Summary)]
        score = self.objective(self.baseline, self.baseline)
        if not math.isfinite(score):
            raise ParameterError("objective", score, "finite for the baseline")

    def __call__(self, points: Array) -> Array:
        """Return the scores of points of the unit cube: (N, S) -> (S,)."""
        first = points[:, 0] if not self.history else None
        values = [self.space.values(point) for point in points.T]
        if first is not None:  # to the bit, not mapped to the unit cube and back
            values[0] = dict(zip(self.space.names, self.space.first.tolist(), strict=True))
        try:
            return np.array(self.try_all(values))
        except (TypeError, ValueError) as error:  # SciPy would take it for its own
            self.error = error
            raise

    def try_all(self, values: Sequence[Values]) -> list[float]:
        """Run candidates on all scenes in one batch, note what they come to, return the scores."""
        made: list[Any] = []
        for one in values:
            try:
                made.append(self.make_controller(dict(one)))
            except HexapodError as error:
                made.append(error)
        alive = [controller for controller in made if not isinstance(controller, HexapodError)]
        cases = [
            Case(scene, one, **self.settings) for one in alive for scene in self.scenes.values()
        ]
        runs = self.run.rows(cases, SUMMARY, span=self._span(len(values)))
        queue, count = iter(runs), len(self.scenes)
        for one, controller in zip(values, made, strict=True):
            if isinstance(controller, HexapodError):
                found: list[Any] = [controller] * count
            else:
                found = [next(queue, None) for _ in range(count)]
            if all(run is not None for run in found):
                self._note(one, found)
            elif not self.history:
                break  # without the start there is nothing to compare with
        runs.require_complete()
        self.generation += 1
        return [one.score for one in self.history[len(self.history) - len(values) :]]

    def _span(self, count: int) -> tuple[float, float] | None:
        """Return the shares of the budget that are used before and after so many candidates."""
        if not self.budget:
            return None
        before = len(self.history)
        return before / self.budget, min(1.0, (before + count) / self.budget)

    def _note(self, values: Values, found: Sequence[Any]) -> None:
        """Score one candidate from the summaries or errors of its runs."""
        failures: dict[str, str] = {}
        single: dict[str, float] = {}
        for (name, run), reference in zip(
            zip(self.scenes, found, strict=True), self.baseline, strict=True
        ):
            if isinstance(run, UserCodeError) or (
                isinstance(run, Exception) and not isinstance(run, HexapodError)
            ):
                raise run
            score = math.nan if isinstance(run, Exception) else self.objective([run], [reference])
            if isinstance(run, Exception):
                failures[name] = f"{type(run).__name__}: {run}"
            elif not math.isfinite(score):
                failures[name] = f"the objective is {score}"
            single[name] = score if math.isfinite(score) else self.penalty
        score = self.penalty if failures else float(self.objective(found, self.baseline))
        self._by_scene.append(single)
        self._failures.append(failures)
        text = "; ".join(f"{name}: {why}" for name, why in failures.items())
        self.history.append(Candidate(dict(values), score, text, self.generation))

    def scores(self, best: int | None = None) -> Scores:
        """Return the scores of baseline, start (the first candidate) and best."""
        row = self.history.index(self.best) if best is None else best
        alone = {
            name: float(self.objective([run], [run]))
            for name, run in zip(self.scenes, self.baseline, strict=True)
        }
        return Scores(
            baseline=float(self.objective(self.baseline, self.baseline)),
            start=self.history[0].score,
            best=self.history[row].score,
            by_scene={
                name: (alone[name], self._by_scene[0][name], self._by_scene[row][name])
                for name in self.scenes
            },
            failures={**self._failures[0], **self._failures[row]},
        )


def _spans_decade(low: float, high: float) -> bool:
    return low > 0.0 and high / low >= LOGARITHMIC_RATIO
