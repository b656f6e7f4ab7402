"""Advance a flow: RK4 at a fixed step, and SciPy's DOP853 whose steps end at touch-downs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.flow import Flow

LEAST = 1e-13  # s, a touch-down this soon after the start of a step is that start


class RungeKutta4:
    """The classical method.

    Attributes:
        steps: taken.
        events: none; kept for the same report as the adaptive method's.
    """

    def __init__(self, flow: Flow, y: Array, step: float) -> None:
        """Begin at y, t = 0."""
        self.steps, self.events = 0, 0
        self._flow, self._step, self._time = flow, step, 0.0
        self.y, self._rate = flow.accept(0.0, y)

    def advance(self, stop: float) -> bool:
        """Go to `stop` in equal steps, at most the step asked for; False where y is not finite."""
        count = max(1, round((stop - self._time) / self._step))
        h, begin = (stop - self._time) / count, self._time
        for k in range(count):
            t = begin + k * h
            k1 = self._rate
            k2 = self._flow(t + 0.5 * h, self.y + 0.5 * h * k1)
            k3 = self._flow(t + 0.5 * h, self.y + 0.5 * h * k2)
            k4 = self._flow(t + h, self.y + h * k3)
            y = self.y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            if not np.isfinite(y).all():
                return False
            self.y, self._rate = self._flow.accept(t + h, y)
            self.steps += 1
        self._time = stop
        return True


class Dop853:
    """SciPy's DOP853, order 8(5, 3), restarted from the accepted state after every step.

    Attributes:
        steps: accepted.
        events: touch-downs located.
    """

    def __init__(
        self, flow: Flow, y: Array, *, rtol: float, atol: float, max_step: float, end: float
    ) -> None:
        """Begin at y, t = 0; `end` is the last time that will be asked for [s]."""
        from scipy.integrate import DOP853

        self.steps, self.events = 0, 0
        self._flow = flow
        self.y, rate = flow.accept(0.0, y)
        self._solver: Any = DOP853(flow, 0.0, self.y, end, rtol=rtol, atol=atol, max_step=max_step)
        self._solver.f = rate

    def advance(self, stop: float) -> bool:
        """Go to `stop`; False where no step is good enough."""
        solver = self._solver
        solver.t_bound, solver.status = stop, "running"
        while solver.t < stop:
            usual = solver.h_abs
            solver.step()
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                return False
            if solver.t == stop:  # cut short by the sample, not by its error
                solver.h_abs = max(solver.h_abs, usual)
            self._land(*self._first_touch())
        return True

    def _land(self, time: float, y: Array, closing: int | None) -> None:
        """Accept y at a time within the last step, and go on from there."""
        self.y, rate = self._flow.accept(time, y, closing)
        solver = self._solver
        solver.t, solver.y, solver.f = time, self.y, rate
        solver.status = "running"
        self.steps += 1
        self.events += closing is not None

    def _first_touch(self) -> tuple[float, Array, int | None]:
        """Return where the last step ends, or where the first contact closes in it."""
        solver, flow = self._solver, self._flow
        closed = np.flatnonzero(flow.newly_closed(solver.t, solver.y) < 0.0)
        if not len(closed):
            return solver.t, solver.y, None
        path, begin, end = solver.dense_output(), solver.t_old, solver.t
        times = [
            _crossing(lambda t, c=c: flow.newly_closed(t, path(t))[c], begin, end) for c in closed
        ]
        first = int(np.argmin(times))
        time = times[first]
        if time >= end:
            return end, solver.y, int(closed[first])
        return time, path(time), int(closed[first])


def _crossing(gap: Any, begin: float, end: float) -> float:
    """Return when a gap that is negative at the end becomes zero [s]."""
    from scipy.optimize import brentq

    if gap(begin) <= 0.0:  # it closed at the very start of the step
        return min(begin + LEAST, end)
    return float(brentq(gap, begin, end, xtol=1e-15, rtol=1e-14))
