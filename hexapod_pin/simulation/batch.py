"""Many cases at once, over threads of the native core."""

from __future__ import annotations

import time
from collections.abc import Sequence

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.run_settings import RunSettings


def simulate_batch(
    cases: Sequence[Case],
    *,
    duration: float,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
) -> list[Trace]:
    """Run independent cases over threads; the bits do not depend on the number of threads.

    Args:
        cases: what to run.
        duration: simulated time [s], of every case.
        accuracy: as in `simulate` [m and rad].
        method: as in `simulate`.
        step: as in `simulate` [s].
        sample: as in `simulate` [s].
        threads: how many run at a time.

    Returns:
        One trace per case, in order.

    Raises:
        DivergenceError: of the first case that diverged, after all have been run.
        ParameterError, GaitError, ReachError, StateError: as in `simulate`, before anything runs.
    """
    from hexapod_pin import native as _native

    if threads < 1:
        raise ParameterError("threads", threads, "at least 1")
    how = RunSettings.of(duration, method, accuracy, step, sample)
    runs = [NativeRun(case, how) for case in cases]
    begin = time.perf_counter()
    samples = [how.grid.samples] * len(runs)
    good = _native.advance_all([run.rollout for run in runs], samples, threads)
    wall_time = time.perf_counter() - begin
    for run, fine in zip(runs, good, strict=True):
        run.good, run.wall_time = bool(fine), wall_time / max(len(runs), 1)
    return [run.require_good() for run in runs]
