"""Many cases at once, over threads of the native core."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, SimulationInterrupted, UserCodeError
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.batch_runs import BatchRuns
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.run_settings import RunSettings
from hexapod_pin.simulation.work_limits import WorkLimits, chosen_limits
from hexapod_pin.user_code import user_callback

MOST_THREADS = 1024
"""More than the processors of any machine that this is for."""

BatchResult = Trace | Summary | Exception
"""What a case comes to."""


@checked
def simulate_batch(
    cases: Iterable[Case],
    *,
    duration: float | None = None,
    accuracy: float | None = None,
    estimate: bool | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
    keep: str = "trace",
    errors: str = "keep",
    limits: WorkLimits | None = None,
    allow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[BatchResult]:
    """Run independent cases over threads; the bits do not depend on the number of threads.

    Args:
        cases: what to run. Settings below are for those that have none of their own.
        duration: simulated time [s].
        accuracy: as in `simulate` [m and rad].
        estimate: as in `simulate`; None: each case as it says itself.
        method: as in `simulate`.
        step: as in `simulate` [s].
        sample: as in `simulate` [s].
        threads: how many run at a time, no more than there are cases. Controllers that
            take part in the run are Python and share one; their runs advance on all between ticks.
        keep: "trace", or "summary": no samples are kept, so that thousands fit into memory.
        errors: "keep": a case that fails is an entry of the result; "raise": the error of the first
            case that failed is raised, after all have been run.
        limits: as in `simulate`, of each case.
        allow: as in `simulate`.
        progress: called with the finished fraction (0..1) as cases finish.

    Returns:
        In the order of the cases, of each its `Trace` or `Summary`, or its error: a
        `DivergenceError`, a `UserCodeError` of its controller, or what `simulate` refuses it with.

    Raises:
        ParameterError: threads, keep, errors or a setting out of range; or the system starts no
            more threads.
        SimulationInterrupted: Ctrl-C; `.results` holds what was done, None for the rest.
        UserCodeError: `progress` has raised; `.results` too.
    """
    if errors not in ("keep", "raise"):
        raise ParameterError("errors", errors, '"keep" or "raise"')
    chosen = list(cases)
    results: list[BatchResult | None] = [None] * len(chosen)
    done = iterate_batch(
        chosen, duration=duration, accuracy=accuracy, estimate=estimate, method=method, step=step,
        sample=sample, threads=threads, keep=keep, limits=limits, allow=allow,
    )  # fmt: skip
    tell = user_callback("progress", progress)
    try:
        for count, (index, result) in enumerate(done, start=1):
            results[index] = result
            if tell is not None:
                tell(count / len(chosen))
    except UserCodeError as error:
        error.results = results
        raise
    except (KeyboardInterrupt, SimulationInterrupted):
        kept = sum(result is not None for result in results)
        text = f"interrupted after {kept} of {len(chosen)} cases"
        raise SimulationInterrupted(text, None, results) from None
    found = [result for result in results if result is not None]
    if errors == "raise":
        for result in found:
            if isinstance(result, Exception):
                raise result
    return found


@checked
def iterate_batch(
    cases: Iterable[Case | Exception],
    *,
    duration: float | None = None,
    accuracy: float | None = None,
    estimate: bool | None = None,
    method: str | None = None,
    step: float | None = None,
    sample: float | None = None,
    threads: int = 1,
    keep: str = "trace",
    limits: WorkLimits | None = None,
    allow: bool = False,
) -> Iterator[tuple[int, BatchResult]]:
    """Yield the index and the result of each case as it finishes; arguments as `simulate_batch`.

    Cases are taken as threads need them, so that an iterator may make more than fit into memory.
    An exception among them is the result of its place. Whoever stops taking results abandons the
    rest.

    Raises:
        ParameterError: threads, keep or a setting out of range.
    """
    check_threads(threads)
    if keep not in ("trace", "summary"):
        raise ParameterError("keep", keep, '"trace" or "summary"')
    RunSettings.of(0.0 if duration is None else duration, method, accuracy, step, sample)
    settings: dict[str, Any] = dict(
        duration=duration, accuracy=accuracy, estimate=estimate, method=method, step=step,
        sample=sample, limits=chosen_limits(limits, allow) if limits or allow else None,
    )  # fmt: skip
    if isinstance(cases, Sized):
        threads = max(1, min(threads, len(cases)))
    settled = (_settled(case, settings) for case in cases)
    return BatchRuns(settled, threads, keep == "trace").results()


def check_threads(threads: object) -> None:
    """Refuse what is no number of threads.

    Raises:
        ParameterError: no whole number, or none between 1 and `MOST_THREADS`.
    """
    whole = isinstance(threads, int) and not isinstance(threads, bool)
    if not (whole and 1 <= threads <= MOST_THREADS):  # type: ignore[operator]  # whole
        raise ParameterError("threads", threads, f"a whole number from 1 to {MOST_THREADS}")


def _settled(case: Case | Exception, settings: Mapping[str, Any]) -> Case | Exception:
    """Return the case with the batch's settings for those that it leaves open."""
    if isinstance(case, Exception):
        return case
    if not isinstance(case, Case):  # of a generator, which no call looks into
        raise ParameterError("cases", case, "several of Case")
    try:
        return case.with_defaults(**settings)
    except ParameterError as error:  # they do not fit this case's own
        return error
