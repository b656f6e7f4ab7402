"""Many cases at once, over threads of the native core."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.errors import HexapodError, ParameterError, SimulationInterrupted
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.batch_plan import BatchPlan, Outcome, group_key
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.closed_loop import lock_step_runs
from hexapod_pin.simulation.native_run import PROGRESS_INTERVAL, NativeRun, open_loop_run

BatchResult = Trace | Summary | Exception
"""What a case comes to."""

PATIENCE = 0.1
"""Time between two looks at the keyboard [s]."""

LOCK_STEP = 64
"""Most runs of one feedback controller side by side."""

SLICES = 16
"""Parts of a run that threads share, at least: so they end together."""


def simulate_batch(
    cases: Iterable[Case],
    *,
    duration: float | None = None,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
    keep: str = "trace",
    errors: str = "keep",
    progress: Callable[[float], None] | None = None,
) -> list[BatchResult]:
    """Run independent cases over threads; the bits do not depend on the number of threads.

    Args:
        cases: what to run. Settings below are for those that have none of their own.
        duration: simulated time [s].
        accuracy: as in `simulate` [m and rad].
        method: as in `simulate`.
        step: as in `simulate` [s].
        sample: as in `simulate` [s].
        threads: how many run at a time; fewer where the system gives no more. Controllers that
            take part in the run are Python and share one.
        keep: "trace", or "summary": no samples are kept, so that thousands fit into memory.
        errors: "keep": a case that fails is an entry of the result; "raise": the error of the first
            case that failed is raised, after all have been run.
        progress: called with the finished fraction (0..1) as cases finish.

    Returns:
        In the order of the cases, of each its `Trace` or `Summary`, or its error: a
        `DivergenceError`, what `simulate` refuses it with, or what its controller raised.

    Raises:
        ParameterError: threads, keep or errors out of range.
        SimulationInterrupted: Ctrl-C; `.results` holds what was done, None for the rest.
    """
    if errors not in ("keep", "raise"):
        raise ParameterError("errors", errors, '"keep" or "raise"')
    chosen = list(cases)
    results: list[BatchResult | None] = [None] * len(chosen)
    settings: dict[str, Any] = dict(
        duration=duration, accuracy=accuracy, method=method, step=step, sample=sample
    )
    try:
        done = iterate_batch(chosen, threads=threads, keep=keep, **settings)
        for count, (index, result) in enumerate(done, start=1):
            results[index] = result
            if progress is not None:
                progress(count / len(chosen))
    except KeyboardInterrupt:
        kept = sum(result is not None for result in results)
        text = f"interrupted after {kept} of {len(chosen)} cases"
        raise SimulationInterrupted(text, None, results) from None
    found = [result for result in results if result is not None]
    if errors == "raise":
        for result in found:
            if isinstance(result, Exception):
                raise result
    return found


def iterate_batch(
    cases: Sequence[Case],
    *,
    duration: float | None = None,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
    keep: str = "trace",
) -> Iterator[tuple[int, BatchResult]]:
    """Yield the index and the result of each case as it finishes; arguments as `simulate_batch`.

    Whoever stops taking them abandons the rest.

    Raises:
        ParameterError: threads or keep out of range.
    """
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ParameterError("threads", threads, "a whole number of at least 1")
    if keep not in ("trace", "summary"):
        raise ParameterError("keep", keep, '"trace" or "summary"')
    plan = BatchPlan(duration, accuracy, method, step, sample, keep == "trace")
    return _outcomes(list(cases), plan, threads)
