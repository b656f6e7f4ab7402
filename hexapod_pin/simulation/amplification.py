"""How an error at t = 0 grows: two runs whose starts differ slightly.

Their later distance over that at the start is the growth of any error made so early, that of a
method included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.control.joint_trajectory import Controller
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.simulation.case import Case, run_case
from hexapod_pin.simulation.open_loop import open_loop_run
from hexapod_pin.simulation.session import set_up

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene

START_ERROR = 1e-6
"""Distance of the two starts in each position [m, rad]: far above the runs' own errors."""

STEP_ACCURACY = 1e-9
"""Of the steps of both runs [m, rad]."""

ROUND_OFF = 1e-15
"""Least error at t = 0 of a run in double precision [m, rad]."""


@dataclass(frozen=True, eq=False)
class Amplification(Immutable):
    """The growth of an error at t = 0.

    Attributes:
        time: of the samples [s]. Shape (T,).
        factor: largest distance of any position so far, over that at the start [-]. Shape (T,).
        runs: the two runs.
    """

    time: Array
    factor: Array
    runs: tuple[Trace, Trace]

    def at(self, time: float) -> float:
        """Return the factor up to a time [s]; NaN beyond the run."""
        if time > self.time[-1] + 1e-9:
            return math.nan
        return float(self.factor[np.searchsorted(self.time, time - 1e-9)])

    @property
    def rate(self) -> float:
        """Growth after the first second, per second, as of an exponential [1/s]; 0 where none."""
        late = self.time >= min(1.0, 0.5 * self.time[-1])
        if late.sum() < 3:
            return 0.0
        slope = np.polyfit(self.time[late], np.log(np.maximum(self.factor[late], 1e-300)), 1)[0]
        return max(0.0, float(slope))

    def horizon(self, accuracy: float) -> float:
        """Return the time at which round-off at t = 0 has grown to an accuracy [s].

        Beyond it no run in double precision is a prediction. Inf where nothing grows.

        Args:
            accuracy: error beyond which a trajectory means nothing [m, rad].
        """
        if self.rate < 1e-3:
            return math.inf
        last = math.log(accuracy / ROUND_OFF / max(float(self.factor[-1]), 1.0))
        return float(self.time[-1]) + last / self.rate


@checked
def amplification(
    scene: Scene,
    controller: Controller | FeedbackController,
    *,
    duration: float,
    sample: float | None = None,
    initial: State | None = None,
    seed: int = 1,
) -> Amplification:
    """Return how an error at t = 0 grows in a motion.

    Runs it twice with NDF at 1e-9, from starts that differ by up to 1e-6 m and rad in each
    position, in a random direction.

    Args:
        scene: robot, ground, contact, servos.
        controller: as of `simulate`.
        duration: simulated time [s], above 0.
        sample: time between samples [s]; default 2 ms.
        initial: state at t = 0; default standing at the controller's first set-point.
        seed: of the direction.

    Raises:
        ParameterError: no duration, or NDF cannot do this scene.
        GaitError, ReachError, StateError, DivergenceError, SimulationInterrupted: as `simulate`.
    """
    if not duration > 0.0:
        raise ParameterError("duration", duration, "above 0 s")
    if seed < 0:
        raise ParameterError("seed", seed, "0 or more")
    case = Case(
        scene, controller, initial, duration=duration, sample=sample, method="ndf",
        accuracy=STEP_ACCURACY, estimate=False, record=("torque",),
    )  # fmt: skip
    begin = set_up if isinstance(controller, FeedbackController) else open_loop_run
    start = begin(case, case.settings).start
    first, second = (
        run_case(replace(case, initial=scene.robot.check_state(q, start.v)))
        for q in (start.q, _moved(start.q, seed))
    )
    apart = ErrorEstimate.between({"q": first.q}, {"q": second.q}, 1.0).position
    return Amplification(read_only(first.time), read_only(apart / START_ERROR), (first, second))


def _moved(q: Array, seed: int) -> Array:
    """Return a configuration with every position off by up to `START_ERROR`."""
    import pinocchio as pin

    step = np.random.default_rng(seed).uniform(-1.0, 1.0, len(q) - 1)
    step *= START_ERROR / np.abs(step).max()
    moved = np.array(q)
    moved[:3] += step[:3]
    turn = pin.Quaternion(moved[3:7]) * pin.Quaternion(pin.exp3(step[3:6]))
    moved[3:7] = turn.coeffs()
    moved[7:] += step[6:]
    return moved
