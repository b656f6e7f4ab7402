"""A maximal-coordinate model is integrated over time, with projection onto its joints."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import DivergenceError, ParameterError, UserCodeError
from hexapod_pin.formulations.maximal.derivative import derivative
from hexapod_pin.formulations.maximal.state import RunMemory
from hexapod_pin.robot.rotations import quaternion_rates, rotations, turned_quaternions
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.bodies import Bodies
    from hexapod_pin.formulations.maximal.derivative import MaximalDerivative
    from hexapod_pin.formulations.maximal.model import (
        ConstraintEquations,
        MaximalModel,
    )
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


# S1 eq. 1 as y' = f(t, y), with what is remembered from one accepted state to the next.

JointReference = Callable[[float], "tuple[Array, Array]"]
"""Wanted joint angles [rad] and rates [rad/s], (nj,) each, at a time [s]."""


class OdeSystem:
    """y' = f(t, y), y = [positions, quaternions, velocities, bristles].

    Attributes:
        model: the model.
        state: the last accepted one.
        memory: of joints and contacts at that state.
        evaluations: of the model so far.
        drift: largest |Phi| [m, rad] and |Phi'| [m/s, rad/s] at accepted states.
    """

    def __init__(
        self, model: MaximalModel, set_points: JointReference, start: MaximalState, *,
        projected: bool,
    ) -> None:  # fmt: skip
        """Begin at a state; `projected`: close the joints after every step."""
        self.model = model
        none = np.zeros(len(model.bodies.joint_names))
        self.memory = start.memory or RunMemory.fresh(none, model.contact_count)
        self.state = replace(start, memory=self.memory)
        if model.has_bristles and start.bristles is None:
            self.state = replace(self.state, bristles=np.zeros((model.contact_count, 3)))
        self.evaluations, self.drift = 0, (0.0, 0.0)
        self._set_points, self._projected = set_points, projected

    def __call__(self, time: float, y: Array) -> Array:
        """Return y'."""
        return self._rate(time, self.state.with_flat(y))[0]

    def _rate(self, time: float, state: MaximalState) -> tuple[Array, MaximalDerivative]:
        """Return y' at a state, and the solution it is made of."""
        self.evaluations += 1
        wanted, wanted_rate = self._set_points(time)
        servo = self.model.actuators.servo_torque
        found = derivative(self.model, state, lambda q, v: servo(q, v, wanted, wanted_rate), time)
        turning = quaternion_rates(state.quaternion, state.velocity[:, 3:])
        parts = [state.velocity[:, :3].ravel(), turning.ravel(), found.acceleration.ravel()]
        if state.bristles is not None and found.contacts is not None:
            parts.append(found.contacts.bristle_rate.ravel())
        return np.concatenate(parts), found

    def accept(self, time: float, y: Array, closing: int | None = None) -> tuple[Array, Array]:
        """Take y as the state reached: close joints, update the memory.

        Args:
            time: [s].
            y: the end of a step.
            closing: contact that closes at just this moment.

        Returns:
            y after the step, and y' there.
        """
        state = self.state.with_flat(y)
        state = project(self.model, state) if self._projected else state.with_unit_quaternions()
        rate, found = self._rate(time, state)
        self.drift = _larger(self.drift, found.constraints)
        memory = replace(self.memory, angles=self.memory.unwrapped(found.kinematics.angle))
        if found.contacts is not None:
            memory = memory.after_step(found.contacts)
            if closing is not None:
                memory = memory.after_touch_down(closing, found.contacts)
            if state.bristles is not None:
                state = replace(state, bristles=found.contacts.released(state.bristles))
        self.memory, self.state = memory, replace(state, memory=memory)
        if self.model.contact is not None and self.model.contact.has_memory:
            rate, _ = self._rate(time, self.state)
        return self.state.flat(), rate

    def opening_gaps(self, time: float, y: Array) -> Array:
        """Return the gaps (C,) [m] of contacts not yet touching; infinite for the others."""
        gaps = self.model.gaps(time, self.state.with_flat(y))
        return np.where(self.memory.touching, np.inf, gaps)


def _larger(old: tuple[float, float], d: ConstraintEquations) -> tuple[float, float]:
    size, rate = np.abs(d.violation), np.abs(d.rate)
    return max(old[0], float(size.max(initial=0.0))), max(old[1], float(rate.max(initial=0.0)))


# Time steps of an ODE system: RK4, or SciPy's DOP853 with steps that end at touch-downs.

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
        """Begin at the system's state, t = 0; `end` is the last time of the run [s]."""
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
        """Accept y at a time within the last step, and continue from there."""
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


# Projection of positions and velocities onto the joints: the alternative to Baumgarte's terms.
#
# Positions: the step delta of least kinetic energy norm with D delta = -Phi, repeated (Newton).
# Velocities: the impulse D' mu that ends Phi' = 0. Both are the system of S1 eq. 1 with other right
# sides, and cost one elimination each; both leave the momentum of a free system as it is.

CLOSED_JOINT_M_RAD = 1e-13
"""Largest |Phi| of a closed joint [m, rad]."""

MAX_NEWTON_STEPS = 8
"""Newton steps on the positions."""


def project(model: MaximalModel, state: MaximalState) -> MaximalState:
    """Return the nearest state whose joints are closed and do not open."""
    return project_velocities(model, project_positions(model, state))


def project_positions(model: MaximalModel, state: MaximalState) -> MaximalState:
    """Return the state with positions and attitudes moved until its joints are closed."""
    state = state.with_unit_quaternions()
    for _ in range(MAX_NEWTON_STEPS):
        at = model.kinematics(state)
        d = model.constraints(state, at)
        if d.largest_violation <= CLOSED_JOINT_M_RAD:
            break
        none = np.zeros_like(state.velocity)
        step, _, _ = model.solve_kkt(at.mass, none, d, -d.violation, -d.root.violation)
        state = replace(
            state,
            position=state.position + step[:, :3],
            quaternion=turned_quaternions(state.quaternion, step[:, 3:]),
        )
    return state


def project_velocities(model: MaximalModel, state: MaximalState) -> MaximalState:
    """Return the state with velocities that keep Phi."""
    at = model.kinematics(state)
    d = model.constraints(state, at)
    none = np.zeros_like(state.velocity)
    change, _, _ = model.solve_kkt(at.mass, none, d, -d.rate, -d.root.rate)
    return replace(state, velocity=state.velocity + change)


# Motion of the bodies in the robot's coordinates again: base pose, joint angles, their rates.


def configuration(bodies: Bodies, state: MaximalState, angles: Array) -> Array:
    """Return (7 + nj,): root link's origin [m], quaternion x, y, z, w, joint angles [rad]."""
    rotation = rotations(state.quaternion[:1])[0]
    origin = state.position[0] + rotation @ bodies.root_origin
    return np.concatenate([origin, state.quaternion[0], angles])


def velocity(bodies: Bodies, state: MaximalState) -> Array:
    """Return (6 + nj,): root link's velocity in its own axes [m/s], [rad/s]; joint rates."""
    rotation = rotations(state.quaternion[:1])[0]
    linear, spin = state.velocity[0, :3], state.velocity[0, 3:]
    at_origin = linear + np.cross(spin, rotation @ bodies.root_origin)
    joints = _along_axes(bodies, state, state.velocity)
    return np.concatenate([rotation.T @ at_origin, rotation.T @ spin, joints])


def reduced_acceleration(bodies: Bodies, state: MaximalState, rates: Array) -> Array:
    """Return (6 + nj,): the time derivative of `velocity` for body accelerations (nb, 6).

    The root link's part is the derivative of its components in its own, turning axes.
    """
    rotation = rotations(state.quaternion[:1])[0]
    arm, spin = rotation @ bodies.root_origin, state.velocity[0, 3:]
    at_origin = rates[0, :3] + np.cross(rates[0, 3:], arm) + np.cross(spin, np.cross(spin, arm))
    at_origin -= np.cross(spin, state.velocity[0, :3] + np.cross(spin, arm))
    joints = _along_axes(bodies, state, rates)
    return np.concatenate([rotation.T @ at_origin, rotation.T @ rates[0, 3:], joints])


def _along_axes(bodies: Bodies, state: MaximalState, six: Array) -> Array:
    """Return the difference of the angular parts across each joint, along its axis (nj,)."""
    if not len(bodies.parent):
        return np.empty(0)
    axis = np.einsum("nij,nj->ni", rotations(state.quaternion[1:]), bodies.axis)
    across = six[1:, 3:] - six[bodies.parent, 3:]
    return np.asarray(np.einsum("ni,ni->n", axis, across))
