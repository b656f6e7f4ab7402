"""How far the peak torque of a run depends on the stiffness of its servos: two more runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, SimulationInterrupted
from hexapod_pin.results.steady_window import summary_window
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_verdict import LEAST_SHARE
from hexapod_pin.simulation.batch import simulate_batch
from hexapod_pin.simulation.case import Case
from hexapod_pin.sweep.peak_variants import with_servos

FACTORS = (0.5, 2.0)
"""Stiffness over that of the run; kd / kp stays."""

WORDS = ("halved", "doubled")


@dataclass(frozen=True)
class StiffnessEffect:
    """Relative changes of a run's torques with servos of half and of twice the stiffness.

    Attributes:
        peak: of the largest torque of any joint [-]; NaN where that run has none.
        p99: of the largest torque not exceeded for 99 % of the time [-]; likewise.
        speed: speed over the nominal one in both runs [-]; NaN where none is planned.
        failures: why a run has no numbers, one for each; empty where it has.
    """

    peak: tuple[float, float]
    p99: tuple[float, float]
    speed: tuple[float, float]
    failures: tuple[str, str]

    @property
    def line(self) -> str:
        """The changes in one line."""
        text = (
            f"peak torque changes by {_pair(self.peak)} (p99 by {_pair(self.p99)}) when the "
            "assumed servo stiffness is halved/doubled"
        )
        for word, failure, speed in zip(WORDS, self.failures, self.speed, strict=True):
            if failure:
                text += f"; {word} it {failure}"
            elif speed < LEAST_SHARE:
                text += f"; {word} it makes {speed:.0%} of the nominal speed"
        return text


def servo_stiffness(
    case: Case,
    trace: Trace,
    *,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> StiffnessEffect:
    """Run a case twice more, with half and with twice the servo stiffness.

    Args:
        case: what was run.
        trace: what came of it.
        threads: as in `simulate_batch`.
        progress: called with the finished fraction (0..1) as runs finish.

    Raises:
        ParameterError: the run has no whole cycle, or no servo stiffness to change.
        SimulationInterrupted: Ctrl-C.
    """
    base = trace.summary
    summary_window(base)
    if case.scene.prescribed or not case.scene.servos.gains(case.scene.robot)[0].any():
        raise ParameterError("case", "no servo stiffness", "one whose servos have a stiffness")
    cases = [with_servos(case, factor) for factor in FACTORS]
    try:
        results = simulate_batch(cases, threads=threads, keep="summary", progress=progress)
    except SimulationInterrupted as error:
        text = f"the stiffness of the servos was not varied: {error}"
        raise SimulationInterrupted(text, None, error.results) from None
    rows = [_changes(base, result) for result in results]
    peak, p99, speed, failures = zip(*rows, strict=True)
    return StiffnessEffect(peak, p99, speed, failures)


def _changes(base: Summary, result: object) -> tuple[float, float, float, str]:
    """Return relative change of peak and p99, speed over the nominal one, and a failure."""
    if not isinstance(result, Summary):
        return math.nan, math.nan, math.nan, f"ends early ({type(result).__name__})"
    nominal = float(result.meta.get("nominal_speed") or 0.0)
    speed = (result.speed or 0.0) / nominal if nominal and result.cycles else math.nan
    peak, p99 = (
        _largest(getattr(result, name)) / _largest(getattr(base, name)) - 1.0
        for name in ("torque_peak", "torque_p99")
    )
    return peak, p99, speed, ""


def _largest(values: Array) -> float:
    size = float(np.max(np.abs(values), initial=0.0))
    return size if size > 0.0 else math.nan


def _pair(values: tuple[float, float]) -> str:
    return "/".join("-" if math.isnan(value) else f"{value:+.0%}" for value in values)
