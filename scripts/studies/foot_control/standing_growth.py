"""How fast a small motion of a standing robot grows under foot control, by simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_control.controller import FootControl, ready_law
from hexapod_pin.simulation.session import lock_step_runs

STAND = hp.Gait.tripod(stroke=0.0, lift=0.0, cycle_time=100.0)
"""No foot leaves its place; loads are shared anew only every 50 s."""

SETTLED, WATCHED = 6.0, 3.0
"""Time to settle with low gains, and with the gains in question [s]."""

ACCURACY = 1e-8
"""[m and rad]"""

PUSH, PUSHED = 0.01, 0.05
"""Of each foot and of the trunk: standard deviation of the force's components over the weight
that a foot carries, and duration [s]."""

BEGIN, WINDOW = 0.6, 0.2
"""What other motions need to decay, and the windows of which the growth is taken [s]."""

SMALL = 0.2
"""Change of a foot's force over its static load up to which the motion counts as small."""

REST = 1e-9
"""Joint rates below this are rounding [rad/s]."""

BISECTIONS = 5
"""Of the interval from 0.9 to 1.1 times the predicted border: found to 0.3 %."""


class UnrefusedFootControl(FootControl):
    """Foot control that may be unstable."""

    def start(self, scene: Any, batch: int) -> dict[str, Any]:
        """Return the memory before the first tick."""
        key = self.start_key(scene)
        if key not in self._ready:
            self._ready[key] = ready_law(self, scene, refuse=False)
        return super().start(scene, batch)


@dataclass(frozen=True)
class Stand:
    """A robot that stands under a controller, and what disturbs it.

    Attributes:
        scene: the robot, its ground, and random pushes of the trunk and of all feet.
        start: at rest, the controller settled.
        force: of the ground on the feet at rest [N]. Shape (F, 3).
    """

    scene: hp.Scene
    start: Any
    force: Array

    @classmethod
    def settled(cls, scene: hp.Scene, calm: FootControl) -> Stand:
        """Return a robot that has come to rest under a controller with low gains."""
        run = _run(scene, calm, None, SETTLED)
        force, random = run.trace().foot_force[-1], np.random.default_rng(0)
        links = [scene.robot.model.frames[2].name, *(foot.name for foot in scene.robot.feet)]
        pushes = [
            hp.Push(
                link, force=PUSH * force[:, 2].mean() * random.standard_normal(3), start=run.time,
                duration=PUSHED,
            )
            for link in links
        ]  # fmt: skip
        return cls(replace(scene, loads=pushes), run.checkpoint(), force)

    def growth(self, control: FootControl) -> float:
        """Return the rate at which the disturbance grows under a controller [1/s].

        It must have the period and delays of the one that the robot settled with. -inf: at rest
        before the growth could be watched; inf: too fast to be watched.
        """
        trace = _run(self.scene, control, self.start, BEGIN).trace()
        end = self._large_at(trace)
        if not math.isfinite(end):
            trace = _run(self.scene, control, self.start, WATCHED).trace()
            end = self._large_at(trace)
        if end < BEGIN + 3.0 * WINDOW:  # soon
            begin, window = max(PUSHED, 0.5 * end), 4.0 * control.period
        else:
            begin, window = BEGIN, WINDOW
        time = trace.time - trace.time[0]
        size = np.abs(trace.v[:, 6:]).max(axis=1)
        middles, levels = [], []
        for low in np.arange(begin, min(end, time[-1]) - 0.5 * window, window):
            level = size[(time >= low) & (time < low + window)].max(initial=0.0)
            if level > REST:
                middles.append(low + 0.5 * window)
                levels.append(math.log(level))
        if len(levels) < 2:
            return -math.inf if math.isinf(end) else math.inf
        late = len(levels) // 2 if math.isinf(end) else 0
        return float(np.polyfit(middles[late:], levels[late:], 1)[0])

    def _large_at(self, trace: hp.Trace) -> float:
        """Return when the motion is no longer small [s] after the start; inf: at no time."""
        change = np.abs(trace.foot_force - self.force).max(axis=(1, 2))
        large = np.flatnonzero(change > SMALL * self.force[:, 2].min())
        return float(trace.time[large[0]] - trace.time[0]) if large.size else math.inf


def _run(scene: hp.Scene, control: FootControl, start: Any, duration: float) -> Any:
    """Return a run, sampled at every tick."""
    case = hp.Case(
        scene, control, start, duration=duration, sample=control.period, accuracy=ACCURACY
    )
    return lock_step_runs([case], case.settings)[0]


def border(grows: Callable[[float], bool], low: float, high: float) -> float:
    """Return where growth begins or ends between two values; nan where it does not.

    Args:
        grows: whether a disturbance grows with a value.
        low: one value.
        high: a larger one.
    """
    at_low = grows(low)
    if grows(high) == at_low:
        return math.nan
    for _ in range(BISECTIONS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if grows(middle) == at_low else (low, middle)
    return math.sqrt(low * high)
