"""Time steps of an ODE system: RK4, or SciPy's DOP853 with steps that end at touch-downs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.ode_system import OdeSystem

MIN_EVENT_DELAY_S = 1e-13
"""A contact already closed at the start of a step is taken to close this much later [s]."""


class Rk4Stepper:
    """The classical method.

    Attributes:
        steps: taken.
        events: always 0; the adaptive method counts here.
    """

    def __init__(self, system: OdeSystem, step: float) -> None:
        """Begin at the system's state, t = 0."""
        self.steps, self.events = 0, 0
        self._system, self._step, self._time = system, step, 0.0
        self._y, self._rate = system.accept(0.0, system.state.flat())

    def advance(self, stop: float) -> bool:
        """Go to `stop` [s] in equal steps of about the given size; False where y is not finite."""
        count = max(1, round((stop - self._time) / self._step))
        h, begin = (stop - self._time) / count, self._time
        for k in range(count):
            t = begin + k * h
            k1 = self._rate
            k2 = self._system(t + 0.5 * h, self._y + 0.5 * h * k1)
            k3 = self._system(t + 0.5 * h, self._y + 0.5 * h * k2)
            k4 = self._system(t + h, self._y + h * k3)
            y = self._y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            if not np.isfinite(y).all():
                return False
            self._y, self._rate = self._system.accept(t + h, y)
            self.steps += 1
        self._time = stop
        return True


class Dop853Stepper:
    """SciPy's DOP853, order 8(5, 3), restarted from the accepted state after every step.

    Attributes:
        steps: accepted.
        events: touch-downs located.
    """

    def __init__(self, system: OdeSystem, *, rtol: float, atol: float, end: float) -> None:
        """Begin at the system's state, t = 0; `end` is the last time asked for [s]."""
        from scipy.integrate import DOP853

        self.steps, self.events = 0, 0
        self._system = system
        y, rate = system.accept(0.0, system.state.flat())
        self._solver: Any = DOP853(system, 0.0, y, end, rtol=rtol, atol=atol)
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
        y, rate = self._system.accept(time, y, closing)
        solver = self._solver
        solver.t, solver.y, solver.f = time, y, rate
        solver.status = "running"
        self.steps += 1
        self.events += closing is not None

    def _first_touch(self) -> tuple[float, Array, int | None]:
        """Return where the last step ends, or where the first contact closes in it."""
        solver, system = self._solver, self._system
        closed = np.flatnonzero(system.opening_gaps(solver.t, solver.y) < 0.0)
        if not len(closed):
            return solver.t, solver.y, None
        path, begin, end = solver.dense_output(), solver.t_old, solver.t
        times = [
            _crossing(lambda t, c=c: system.opening_gaps(t, path(t))[c], begin, end) for c in closed
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
        return min(begin + MIN_EVENT_DELAY_S, end)
    return float(brentq(gap, begin, end, xtol=1e-15, rtol=1e-14))
