"""A run of a maximal-coordinate model, sampled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import DivergenceError, ParameterError
from hexapod_pin.formulations.maximal import reduced
from hexapod_pin.formulations.maximal.flow import Flow
from hexapod_pin.formulations.maximal.steppers import Dop853, RungeKutta4

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.flow import SetPoints
    from hexapod_pin.formulations.maximal.model import MaximalModel
    from hexapod_pin.formulations.maximal.motion import BodyState


@dataclass(frozen=True, eq=False)
class Run:
    """T samples.

    Attributes:
        time: (T,) [s].
        q: (T, 7 + nj) root link's pose and joint angles, as `MaximalModel.state` takes them.
        v: (T, 6 + nj) its velocity and the joint rates.
        states: of all bodies.
        drift: largest |Phi| over all steps [m, rad].
        drift_rate: largest |Phi'| [m/s, rad/s].
        counters: "steps", "evaluations", "events" (touch-downs located).
    """

    time: Array
    q: Array
    v: Array
    states: tuple[BodyState, ...]
    drift: float
    drift_rate: float
    counters: dict[str, int]


def integrate(
    model: MaximalModel,
    q: ArrayLike,
    v: ArrayLike,
    *,
    duration: float,
    set_points: SetPoints | None = None,
    sample: float | None = None,
    step: float | None = None,
    rtol: float = 1e-10,
    atol: float = 1e-12,
    max_step: float = math.inf,
    projected: bool = True,
) -> Run:
    """Integrate from a base pose and joint angles.

    Args:
        model: the model.
        q: (7 + nj,) see `MaximalModel.state`.
        v: (6 + nj,).
        duration: [s].
        set_points: wanted angles and rates of the servos; none: zero.
        sample: time between samples [s], dividing the duration; none: its end only.
        step: RK4 with this step [s]; none: DOP853, whose steps end at touch-downs.
        rtol: of DOP853, on all numbers of the state.
        atol: of DOP853 [SI units].
        max_step: of DOP853 [s].
        projected: whether positions and velocities are projected onto the joints after every
            step; Baumgarte's terms are the model's.

    Raises:
        ParameterError: a time that is not positive, or samples that do not divide the duration.
        DivergenceError: the state left the finite world; its trace is the run so far.
    """
    count = _samples(duration, duration if sample is None else sample)
    if step is not None:
        _samples(duration, step)
    angles = np.array(q, dtype=float)[7:]
    none = np.zeros((2, len(angles)))
    wanted = set_points or (lambda _time: (none[0], none[1]))
    flow = Flow(model, wanted, model.fresh_memory(angles), projected=projected)
    y = flow.joined(model.state(q, v))
    method: RungeKutta4 | Dop853
    if step is None:
        method = Dop853(flow, y, rtol=rtol, atol=atol, max_step=max_step, end=duration)
    else:
        method = RungeKutta4(flow, y, step)
    kept = [_seen(flow, method.y)]
    times = duration * np.arange(count + 1) / count
    for k in range(count):
        if not method.advance(float(times[k + 1])):
            run = _run(times, kept, flow, method)
            raise DivergenceError(f"no finite state after t = {times[k]:g} s", run)
        kept.append(_seen(flow, method.y))
    return _run(times, kept, flow, method)


Seen = tuple["Array", "Array", "BodyState"]


def _seen(flow: Flow, y: Array) -> Seen:
    """Return q, v and the bodies of a sample."""
    state, bodies = flow.split(y)[0], flow.model.bodies
    q = reduced.configuration(bodies, state, flow.memory.angles)
    return q, reduced.velocity(bodies, state), state


def _run(times: Array, kept: list[Seen], flow: Flow, method: RungeKutta4 | Dop853) -> Run:
    """Return what was sampled."""
    return Run(
        time=times[: len(kept)],
        q=np.array([q for q, _, _ in kept]),
        v=np.array([v for _, v, _ in kept]),
        states=tuple(state for _, _, state in kept),
        drift=flow.drift[0],
        drift_rate=flow.drift[1],
        counters={
            "steps": method.steps,
            "evaluations": flow.evaluations,
            "events": method.events,
        },
    )


def _samples(duration: float, part: float) -> int:
    """Return how often a part fits into the duration."""
    for name, value in (("duration", duration), ("sample or step", part)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "positive and finite [s]")
    count = round(duration / part)
    if count < 1 or not math.isclose(count * part, duration, rel_tol=1e-9):
        raise ParameterError("sample or step", part, f"a whole share of the duration {duration} s")
    return count
