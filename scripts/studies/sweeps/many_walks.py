"""The study that the cost of sweeps is measured with, and where the time of its cases goes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.case import case_runs
from hexapod_pin.study.runs.outcome import outcome_of
from hexapod_pin.study.sweep import SweepStudy

STROKES = (0.06, 0.08, 0.1, 0.12)
"""Grid axis of the study [m]."""

TEXT = """
schema = 1
name = "many walks"

[base]
robot = "kharagpur"
gait = {{ name = "tripod", stroke = 0.1, cycle_time = 1.0 }}
{duration}
accuracy = 1e-4

[[vary]]
input = "stroke"
values = {strokes}

[[vary]]
input = "mu"
distribution = "uniform"
low = 0.4
high = 0.9

[[vary]]
input = "contact_stiffness"
distribution = "lognormal"
median = 1.0
factor = 1.5

[[vary]]
input = "servo_stiffness"
distribution = "lognormal"
median = 1.0
factor = 1.2

[design]
kind = "latin-hypercube"
samples = {samples}
seed = {seed}
"""
"""Inputs that MuJoCo can be given too; no payload."""


def many_walks(cases: int, duration: float, seed: int) -> SweepStudy:
    """Return a study of so many walks: a grid of strokes crossed with samples.

    Each lasts `duration` [s]; 0: until a cycle repeats.

    Raises:
        ParameterError: `cases` is no multiple of the number of strokes.
    """
    samples, rest = divmod(cases, len(STROKES))
    if rest or samples < 1:
        raise ParameterError("cases", cases, f"a positive multiple of {len(STROKES)}")
    line = f"duration = {duration}" if duration else ""
    text = TEXT.format(duration=line, strokes=list(STROKES), samples=samples, seed=seed)
    return SweepStudy.from_toml(text)


@dataclass(frozen=True)
class TimeSplit:
    """Processor time of a case by what it is spent on, means over some cases [s]."""

    case: float  # made from the study's inputs
    plan: float  # trajectory, checks, plant; the gait was planned before
    core: float  # integration and summary, in C++
    result: float  # summary and verdict in Python, digest, numbers as bytes

    @property
    def total(self) -> float:
        """All of it [s]."""
        return self.case + self.plan + self.core + self.result


def time_split(study: SweepStudy, indices: Sequence[int]) -> TimeSplit:
    """Run cases one after the other in this thread and say where its time went.

    Cases that cannot be planned, or diverge, are left out; nan where no case is left.
    """
    for index in dict.fromkeys(k // study.rows * study.rows for k in indices):
        _times(study, index)  # plans the gait
    rows = [times for index in indices if (times := _times(study, index)) is not None]
    means = np.mean(rows, axis=0) if rows else np.full(4, np.nan)
    return TimeSplit(*(float(mean) for mean in means))


def _times(study: SweepStudy, index: int) -> tuple[float, ...] | None:
    """Return the four times of a case [s]; None of one that fails."""
    begin = time.thread_time()
    plan = core = 0.0
    try:
        case = study.case(index)
        made = last = time.thread_time()
        runs = case_runs(case, record=False)
        while True:
            try:
                run = next(runs)
            except StopIteration as end:
                outcome_of(index, case, end.value)
                break
            begun = time.thread_time()
            run.good = run.rollout.advance(run.settings.grid.samples)
            plan, core = plan + begun - last, core + time.thread_time() - begun
            last = time.thread_time()
    except Exception:
        return None
    return made - begin, plan, core, time.thread_time() - last
