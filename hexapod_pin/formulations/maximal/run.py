"""A run of a maximal-coordinate model, sampled: S1 eq. 1 over time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import DivergenceError, ParameterError, UserCodeError
from hexapod_pin.formulations.maximal.ode_system import OdeSystem
from hexapod_pin.formulations.maximal.reduced import configuration, velocity
from hexapod_pin.formulations.maximal.steppers import Dop853Stepper, Rk4Stepper
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.contact_memory import RunMemory
    from hexapod_pin.formulations.maximal.model import MaximalModel
    from hexapod_pin.formulations.maximal.ode_system import JointReference
    from hexapod_pin.formulations.maximal.state import MaximalState


@dataclass(frozen=True, eq=False)
class MaximalRun:
    """T samples.

    Attributes:
        time: [s]. Shape (T,).
        q: root link's pose and joint angles, as `initial_state` takes them. Shape (T, 7 + nj).
        v: its velocity and the joint rates. Shape (T, 6 + nj).
        states: of all bodies.
        drift: largest |Phi| over all steps [m, rad].
        drift_rate: largest |Phi'| [m/s, rad/s].
        counters: "steps", "evaluations", "events" (touch-downs located).
    """

    time: Array
    q: Array
    v: Array
    states: tuple[MaximalState, ...]
    drift: float
    drift_rate: float
    counters: dict[str, int]


def integrate(
    model: MaximalModel,
    start: MaximalState,
    duration: float,
    *,
    set_points: JointReference | None = None,
    sample: float | None = None,
    step: float | None = None,
    rtol: float = 1e-10,
    atol: float = 1e-12,
    projected: bool = True,
) -> MaximalRun:
    """Integrate S1 eq. 1 from a state.

    Args:
        model: the model.
        start: the state at t = 0, see `initial_state`.
        duration: [s].
        set_points: wanted angles and rates of the servos; none: zero.
        sample: time between samples [s], dividing the duration; none: its end only.
        step: RK4 with this step [s]; none: DOP853, whose steps end at touch-downs.
        rtol: of DOP853, on all numbers of the state.
        atol: of DOP853 [SI units].
        projected: whether positions and velocities are projected onto the joints after every
            step; Baumgarte's terms are the model's.

    Raises:
        ParameterError: a time that is not positive, or samples that do not divide the duration.
        DivergenceError: the state is no longer finite; its trace is the run so far.
        UserCodeError: `set_points` has raised; its trace, too.
    """
    count = _share_count(duration, duration if sample is None else sample)
    if step is not None:
        _share_count(duration, step)
    none = np.zeros(len(model.bodies.joint_names))

    def reference(time: float) -> tuple[Array, Array]:
        """Return what the servos are to reach."""
        if set_points is None:
            return none, none
        with UserCode("set_points", time):
            return set_points(time)

    system = OdeSystem(model, reference, start, projected=projected)
    stepper: Rk4Stepper | Dop853Stepper
    if step is None:
        stepper = Dop853Stepper(system, rtol=rtol, atol=atol, end=duration)
    else:
        stepper = Rk4Stepper(system, step)
    kept = [(system.state, system.memory)]
    times = duration * np.arange(count + 1) / count
    try:
        for k in range(count):
            if not stepper.advance(float(times[k + 1])):
                raise DivergenceError(f"no finite state after t = {times[k]:g} s", None)
            kept.append((system.state, system.memory))
    except (DivergenceError, UserCodeError) as error:
        error.trace = _run(times, kept, system, stepper)
        raise
    return _run(times, kept, system, stepper)


def _run(
    times: Array,
    kept: list[tuple[MaximalState, RunMemory]],
    system: OdeSystem,
    stepper: Rk4Stepper | Dop853Stepper,
) -> MaximalRun:
    """Return the samples."""
    bodies = system.model.bodies
    return MaximalRun(
        time=times[: len(kept)],
        q=np.array([configuration(bodies, state, memory.angles) for state, memory in kept]),
        v=np.array([velocity(bodies, state) for state, _ in kept]),
        states=tuple(state for state, _ in kept),
        drift=system.drift[0],
        drift_rate=system.drift[1],
        counters={
            "steps": stepper.steps,
            "evaluations": system.evaluations,
            "events": stepper.events,
        },
    )


def _share_count(duration: float, part: float) -> int:
    """Return how often a part fits into the duration."""
    for name, value in (("duration", duration), ("sample or step", part)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "positive and finite [s]")
    count = round(duration / part)
    if count < 1 or not math.isclose(count * part, duration, rel_tol=1e-9):
        raise ParameterError("sample or step", part, f"a whole share of the duration {duration} s")
    return count
