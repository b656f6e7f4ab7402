"""Many cases at once, over threads of the native core."""

from __future__ import annotations

import time
from collections.abc import Sequence

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.native_run import open_loop_run
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
        ParameterError, GaitError, ReachError, StateError: as in `simulate`; what runs is abandoned.
    """
    from hexapod_pin import native as _native

    if threads < 1:
        raise ParameterError("threads", threads, "at least 1")
    how = RunSettings.of(duration, method, accuracy, step, sample)
    batch, runs = _native.Batch(min(threads, max(len(cases), 1))), []
    begin = time.perf_counter()
    for case in cases:  # the first ones run while the next are planned
        runs.append(open_loop_run(case, how))
        batch.add(runs[-1].rollout, how.grid.samples)
    traces: list[Trace | None] = [None] * len(runs)
    for done in range(1, len(runs) + 1):  # traces are made while others run
        index, good = batch.next_done()
        runs[index].good = good
        runs[index].wall_time = (time.perf_counter() - begin) / done
        traces[index] = runs[index].trace()
    return [run.require_good(trace) for run, trace in zip(runs, traces, strict=True)]
