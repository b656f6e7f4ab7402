"""MuJoCo's time for walks of a sweep at the trunk error that ours have."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.interchange.mjcf_text import MjcfOptions
from hexapod_pin.validation.position_error import trunk_error
from studies.cost.mujoco_twin import SAMPLE, MujocoTwin
from studies.cost.native_motion import NativeMotion

REFERENCE_ACCURACY = 1e-8
"""Accuracy of our own reference runs [m and rad]."""

STEPS = (2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5)
"""Steps that MuJoCo is run at, the largest first [s]; each divides the samples' spacing."""

METHODS = (("implicitfast", "pyramidal"), ("RK4", "pyramidal"))
"""The cheapest at coarse and at fine errors (docs/results/speed_against_error.md)."""


@dataclass(frozen=True)
class SampledCase:
    """A case of the sweep run by both engines.

    Attributes:
        index: of the case.
        own_error: largest distance of our trunk from our own reference [m].
        own_time: wall time of our run alone, planning and summary included [s].
        doubt: distance of MuJoCo's reference from one with twice the step [m].
        runs: MuJoCo's settings with trunk error [m] and wall time [s] of its loop in C.
    """

    index: int
    own_error: float
    own_time: float
    doubt: float
    runs: tuple[tuple[str, float, float], ...]

    def cheapest(self, error: float) -> tuple[str, float, float] | None:
        """Return the quickest setting of MuJoCo with at most a trunk error [m]; None: none."""
        good = [run for run in self.runs if run[1] <= error]
        return min(good, key=lambda run: run[2]) if good else None


def sampled_case(case: hp.Case, index: int, fine: float, rounds: int) -> SampledCase:
    """Run one case by both engines.

    Args:
        case: without loads, on flat ground: what MuJoCo can be given.
        index: its number.
        fine: step of MuJoCo's reference [s].
        rounds: timed runs, of which the median is taken.
    """
    assert case.duration is not None
    motion = NativeMotion.of(case.scene, case.controller, case.duration)  # type: ignore[arg-type]
    ours = replace(case, sample=SAMPLE)
    path = ours.run().q[:, :3]
    exact = replace(ours, accuracy=REFERENCE_ACCURACY).run().q[:, :3]
    own_time = median(_timed(case) for _ in range(rounds))
    runs: list[tuple[str, float, float]] = []
    doubts: list[float] = []
    for cone in dict.fromkeys(cone for _, cone in METHODS):
        best = _path(motion, MjcfOptions(fine, "RK4", cone, exact=True), case.duration)
        other = _path(motion, MjcfOptions(2 * fine, "RK4", cone, exact=True), case.duration)
        doubts.append(trunk_error(best, other))
        for integrator in (name for name, own in METHODS if own == cone):
            runs += _ladder(motion, integrator, cone, best, case.duration, rounds)
    return SampledCase(index, trunk_error(path, exact), own_time, max(doubts), tuple(runs))


def _timed(case: hp.Case) -> float:
    begin = time.perf_counter()
    (found,) = hp.simulate_batch([case], threads=1, keep="summary")
    if isinstance(found, Exception):
        raise found
    return time.perf_counter() - begin


def _path(motion: NativeMotion, settings: MjcfOptions, duration: float) -> Array:
    twin: Any = MujocoTwin(motion.scene, settings)
    found: Array = twin.path(motion.state, motion.set_points, duration).positions
    return found


def _ladder(
    motion: NativeMotion, integrator: str, cone: str, best: Array, duration: float, rounds: int
) -> list[tuple[str, float, float]]:
    """Return error and time of each step; those that diverge are left out."""
    found = []
    for step in STEPS:
        settings = MjcfOptions(step, integrator, cone)
        error = trunk_error(_path(motion, settings, duration), best)
        if not np.isfinite(error) or error > 1.0:
            continue
        twin = MujocoTwin(motion.scene, settings)
        steps = round(duration / step)
        run = twin.timed_run(motion.state, motion.set_points, steps)
        taken = median(run() for _ in range(rounds if step >= 1e-4 else 1))
        found.append((f"{integrator} {cone}, step {1e3 * step:g} ms", error, taken))
    return found


def geometric_mean(values: Sequence[float]) -> float:
    """Return the geometric mean of positive numbers."""
    return float(np.exp(np.mean(np.log(values))))
