"""Motion on rigid ground over time: one contact phase to rounding, or a walk of many.

`integrate` runs S2 eqs. 1-4 under DOP853 with a fixed set of feet. `simulate` walks: within a phase
the grounded feet are held (eqs. 1-4), a foot that comes down ends it with a plastic impact (eq. 5).
Ground forces and torques come without any contact stiffness, and they are determined: 3k rows are
independent as long as no grounded leg is singular, because the servos yield. The feet are
assumed to stick; the friction that this needs is in `RigidRun.friction_demand`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.plain_drives import check_plain_drives
from hexapod_pin.errors import DivergenceError, HexapodError, ParameterError
from hexapod_pin.formulations.rigid.constrained_step import ConstrainedStepper
from hexapod_pin.formulations.rigid.constraints import ContactSet
from hexapod_pin.formulations.rigid.contact_events import ContactEventLoop, TouchDownImpact
from hexapod_pin.formulations.rigid.derivative import constrained_derivative
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.state import (
    configuration_rate,
    initial_state,
    standing_state,
    with_unit_quaternion,
)
from hexapod_pin.formulations.rigid.trace import FrictionDemand, RigidRecorder, friction_demand
from hexapod_pin.formulations.set_points import SetPoints

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.robot import State

TorqueLaw = Callable[[float, Array, Array], Array]
"""Servo torques (n,) [N m] of time [s], q and v."""

DEFAULT_STEP_S = 2e-3
"""Default step and sampling time of `simulate` [s]."""


def integrate(
    model: RigidModel,
    start: State,
    duration: float,
    *,
    feet: Sequence[int] = (),
    torque: TorqueLaw | None = None,
    accuracy: float = 1e-12,
) -> State:
    """Return the state after a phase in which these feet stick and no other touches.

    Args:
        model: robot and ground.
        start: a state in which the feet are at rest.
        duration: [s].
        feet: indices of the feet that stick, whatever their forces; none is free flight.
        torque: of the servos; None: none.
        accuracy: relative error asked of DOP853 per step.

    Raises:
        DivergenceError: the integration failed.
    """
    from scipy.integrate import solve_ivp

    nq, none = model.model.nq, np.zeros(model.model.nv - 6)
    contacts = ContactSet(tuple(feet))

    def rate(time: float, y: Array) -> Array:
        """Return the derivative of base position, quaternion, joints and velocities."""
        q, v = with_unit_quaternion(y[:nq]), y[nq:]
        tau = none if torque is None else torque(time, q, v)
        found = constrained_derivative(model, model.terms(q, v), tau, contacts).acceleration
        return np.concatenate([configuration_rate(q, v), found])

    y0 = np.concatenate([start.q, start.v])
    found = solve_ivp(
        rate, (0.0, duration), y0, method="DOP853", rtol=accuracy, atol=1e-2 * accuracy
    )
    if not found.success:
        raise DivergenceError(f"motion on {len(contacts.feet)} feet failed: {found.message}", None)
    y = found.y[:, -1]
    return initial_state(model, with_unit_quaternion(y[:nq]), y[nq:])


@dataclass(frozen=True)
class RigidRun:
    """A walk on rigid ground.

    Attributes:
        trace: its samples; forces are multipliers, `normal_loss` is the loss in impacts.
        impacts: all touch-downs.
        friction_demand: the friction that sticking needed, foot by foot.
    """

    trace: Trace
    impacts: tuple[TouchDownImpact, ...]
    friction_demand: tuple[FrictionDemand, ...]


def simulate(
    model: RigidModel,
    controller: Controller,
    *,
    duration: float,
    servo: Servo | None = None,
    step: float = DEFAULT_STEP_S,
    sample: float = DEFAULT_STEP_S,
    initial: State | None = None,
) -> RigidRun:
    """Run a controller on rigid ground.

    Args:
        model: robot and ground.
        controller: gives the set-points.
        duration: simulated time [s].
        servo: gains; default `Servo.for_robot(robot)`, *assumed*.
        step: integration step [s], cut short at events.
        sample: time between samples [s].
        initial: state at t = 0; default standing on level ground at the first set-point.

    Raises:
        ParameterError: a duration, step or sample that is not positive, no initial state on
            ground that is not level at z = 0, motors or dry friction.
        GaitError, ReachError: the controller cannot do this on this robot.
        DivergenceError: feet come and go without end; `.trace` holds the samples before.
    """
    from hexapod_pin.drive.servo import Servo

    for name, value in (("duration", duration), ("step", step), ("sample", sample)):
        if not (np.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "finite and above 0 s")
    plan = controller.plan(model.robot, duration + sample)
    servo = servo or Servo.for_robot(model.robot)
    check_plain_drives(model.robot, servo, "rigid contact")
    stepper = ConstrainedStepper(model, servo, SetPoints(plan))
    start = standing_state(model, plan.q[0]) if initial is None else initial
    loop, recorder = ContactEventLoop(stepper, start), RigidRecorder(stepper)
    recorder.add(loop.now, loop.energy)

    def samples() -> Trace:
        """Return those so far."""
        counters = {"steps": loop.steps, "impacts": len(loop.impacts), "releases": loop.releases}
        return recorder.trace(controller, counters, step, sample)

    try:
        for k in range(1, int(np.floor(duration / sample + 1e-9)) + 1):
            loop.advance(k * sample, step)
            recorder.add(loop.now, loop.energy)
    except HexapodError as error:
        error.trace = samples()
        raise
    trace = samples()
    return RigidRun(trace, tuple(loop.impacts), friction_demand(trace, model))
