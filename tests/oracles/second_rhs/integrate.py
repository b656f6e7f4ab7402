"""A scene by SciPy's DOP853, restarted where a piece of a law ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp

from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError, ParameterError
from hexapod_pin.scene.loads import LostLeg, Push
from oracles.second_rhs.prescribed_side import PrescribedSide
from oracles.second_rhs.right_hand_side import Evaluation, Modes, RightHandSide
from oracles.second_rhs.set_point_curve import curve_between, knots_within
from oracles.second_rhs.switch import SecondRun, Switch, changes
from oracles.second_rhs.within_steps import first_within

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene

PROBE_TIME = 1e-10
"""How far behind a switch the modes are looked at [s]; a hundred times more in every new try."""

MOST_TRIES = 4
"""Tries at one time without a change of modes."""

MOST_CHANGES = 60
"""Changes of modes at one time: contacts and joints may switch together."""

FIRST_STEP = 1e-7
"""First step behind a switch [s]."""

Observer = Callable[[float, Evaluation], None]
"""Called with the time [s] and the evaluation at every accepted step."""

ATOL_SHARE = 1e-2
"""atol over rtol, y in SI units."""


class _Interval:
    """The equations between two times with the same set-point curve, pushes and lost legs."""

    def __init__(
        self, right: RightHandSide, tolerance: float, longest_step: float, observe: Observer | None
    ) -> None:
        self.right, self.tolerance, self.longest = right, tolerance, longest_step
        self.observe = observe
        self.switched: list[Switch] = []
        self._last: tuple[float, bytes, Modes, Evaluation] | None = None
        self._switches: tuple[Evaluation, Array] | None = None

    def evaluate(self, time: float, y: Array, modes: Modes) -> Evaluation:
        """Evaluate, or return what the last call has found at the same place."""
        key, last = y.tobytes(), self._last
        if last is not None and last[0] == time and last[2] is modes and last[1] == key:
            return last[3]
        found = self.right(time, y, modes)
        self._last = (time, key, modes, found)
        return found

    def switches(self, time: float, y: Array, modes: Modes) -> Array:
        """Return the switching functions."""
        at, last = self.evaluate(time, y, modes), self._switches
        if last is not None and last[0] is at:
            return last[1]
        found = self.right.switches(modes, at)
        self._switches = (at, found)
        return found

    def settle(self, time: float, y: Array, modes: Modes, ahead: float) -> tuple[Array, Modes]:
        """Return y and the modes that hold from `time` on, looked at `ahead` [s] later."""
        for _ in range(MOST_CHANGES):
            at = self.evaluate(time, y, modes)
            behind = self.right(time + ahead, y + ahead * at.rate, modes)
            y, found = self.right.behind(y, modes, at, behind)
            if found.same(modes):
                return y, modes
            self.switched += changes(time, modes, found)
            modes = found
        raise DivergenceError(f"the modes at t = {time!r} s do not settle", None)

    def run(self, t: float, end: float, y: Array, modes: Modes, times: Array) -> tuple[Any, ...]:
        """Return y and the modes at `end`, and the rows of y at `times` in (t, end]."""
        rows: list[Array] = []
        tries = 0
        y, modes = self.settle(t, y, modes, PROBE_TIME)
        while t < end:
            solution, t_new = self._to_switch(t, end, y, modes)
            rows += [solution(s) for s in times[(times > t) & (times <= t_new)]]
            if self.observe is not None:
                for s in solution.ts[solution.ts <= t_new]:
                    self.observe(float(s), self.evaluate(float(s), solution(s), modes))
            y = solution(t_new)
            if t_new == end:
                return y, modes, rows
            y, settled = self.settle(t_new, y, modes, PROBE_TIME * 100.0**tries)
            tries = 0 if not settled.same(modes) else tries + 1
            if tries > MOST_TRIES:
                raise DivergenceError(f"a switch at t = {t_new!r} s changes nothing", None)
            t, modes = t_new, settled
        return y, modes, rows

    def _to_switch(self, t: float, end: float, y: Array, modes: Modes) -> tuple[Any, float]:
        """Return the solution from t on and the time of the first switch, or the end [s]."""
        events = self._events(t, y, modes)
        found = solve_ivp(
            lambda s, x: self.evaluate(s, x, modes).rate, (t, end), y, method="DOP853",
            rtol=self.tolerance, atol=ATOL_SHARE * self.tolerance, max_step=self.longest,
            first_step=min(FIRST_STEP, end - t), events=events, dense_output=True,
        )  # fmt: skip
        if found.status < 0:
            raise DivergenceError(f"SciPy at t = {t:g} s: {found.message}", None)
        within = first_within(found.sol, events)
        return found.sol, float(found.t[-1]) if within is None else within

    def _events(self, time: float, y: Array, modes: Modes) -> list[Callable[..., float]]:
        """Return a terminal event for every switching function, not below 0 at the start."""
        start = self.switches(time, y, modes)
        lift = np.where(start < 0.0, -2.0 * start, 0.0)

        def event(k: int) -> Callable[..., float]:
            def switch(t: float, x: Array) -> float:
                return float(self.switches(t, x, modes)[k] + lift[k])

            switch.terminal, switch.direction = True, -1.0  # type: ignore[attr-defined]
            return switch

        return [event(k) for k in np.flatnonzero(start < 1e299).tolist()]


def integrate(
    scene: Scene, controller: Controller, *, duration: float, initial: State,
    tolerance: float = 1e-10, sample: float = 1e-2, longest_step: float = 2e-3,
    start: float = 0.0, observe: Observer | None = None,
) -> SecondRun:  # fmt: skip
    """Return a run: configurations at its samples, both ends among them, and its switches.

    Args:
        scene: what is simulated; planes (patched, shaken), all contact laws, drives and stops,
            payloads, pushes and lost legs.
        controller: of set-points known before the run.
        duration: a whole number of samples [s].
        initial: where it starts.
        tolerance: rtol of SciPy's DOP853; atol is a hundredth of it in SI units.
        sample: [s].
        longest_step: of the integrator [s]: switches there and back within a quarter of one may be
            missed.
        start: time of `initial` [s]; laws with a memory of their own start without it.
        observe: called at every accepted step.

    Raises:
        ParameterError: something in the scene that is not written here, or a duration that is not
            a whole number of samples.
        DivergenceError: the integrator gives up, or laws switch without an end.
    """
    count = round(duration / sample)
    if count < 1 or abs(count * sample - duration) > 1e-9 * duration:
        raise ParameterError("duration", duration, f"a whole number of samples of {sample:g} s")
    right = PrescribedSide(scene) if scene.prescribed else RightHandSide(scene)
    end_time = start + duration
    plan = controller.plan(scene.robot, end_time)
    times = np.linspace(start, end_time, count + 1)[1:]
    borders = _borders(scene, knots_within(plan, end_time), start, end_time)
    y, modes = np.zeros(0), None
    rows: list[Array] = []
    switched: list[Switch] = []
    for begin, end in zip(borders, borders[1:], strict=False):
        right.set_points = curve_between(plan, begin, end)
        _load(scene, right, 0.5 * (begin + end))
        pieces = _Interval(right, tolerance, longest_step, observe)
        if modes is None:
            y, modes = right.first(begin, initial)
        y, modes, found = pieces.run(begin, end, y, modes, times)
        rows += found
        switched += pieces.switched
    q = np.array([initial.q, *(row[: right.nq] for row in rows)])
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    return SecondRun(q, tuple(switched))


def _borders(scene: Scene, knots: list[float], start: float, end_time: float) -> list[float]:
    """Return all times at which the equations change by themselves, both ends among them."""
    changes = {start, end_time, *knots}
    for load in scene.loads:
        if isinstance(load, Push):
            changes |= {load.start, load.end}
        elif isinstance(load, LostLeg):
            changes.add(load.start)
    return sorted(t for t in changes if start <= t <= end_time)


def _load(scene: Scene, right: RightHandSide, time: float) -> None:
    """Let the pushes act and the legs be lost that are so at a time between two borders [s]."""
    right.pushes = [
        load for load in scene.loads if isinstance(load, Push) and load.start < time < load.end
    ]
    for load in scene.loads:
        if isinstance(load, LostLeg) and load.start < time:
            leg = scene.robot.leg(load.leg)
            right.drives.lose([scene.robot.joint_index(name) for name in leg.joints])
