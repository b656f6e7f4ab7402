"""Motion on rigid ground is computed over time and stored as a `Trace`.

`integrate` runs S2 eqs. 1-4 under DOP853 with a fixed set of feet. `simulate` walks: within a phase
the grounded feet are held (eqs. 1-4), a foot that comes down ends it with a plastic impact (eq. 5).
Ground forces and torques come without any contact stiffness, and they are determined: 3k rows are
independent as long as no grounded leg is singular, because the servos yield. The feet are
assumed to stick; the friction that this needs is in `RigidRun.friction_demand`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.servo import check_plain_drives
from hexapod_pin.errors import DivergenceError, HexapodError, ParameterError
from hexapod_pin.formulations.rigid.constrained_step import ConstrainedStepper
from hexapod_pin.formulations.rigid.contact_events import ContactEventLoop, TouchDownImpact
from hexapod_pin.formulations.rigid.derivative import ContactSet, constrained_derivative
from hexapod_pin.formulations.rigid.model import (
    RigidModel,
    configuration_rate,
    energy,
    initial_state,
    standing_state,
    with_unit_quaternion,
)
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.results.run_record import Numerics, RobotFacts, RunCase, RunRecord, WalkFacts
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.state import State

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.formulations.rigid.constrained_step import Snapshot


# Samples of a walk on rigid ground (S2 eqs. 1-5) as a `Trace`, and the friction it needed.

METHOD = "rigid contact: S2 eqs. 1-5, extrapolated linearly implicit Euler, order 2"
ENERGIES = ("kinetic", "potential", "servo_work", "joint_damping_loss", "normal_loss")


@dataclass(frozen=True)
class FrictionDemand:
    """Friction that sticking needed of one foot over a walk.

    Attributes:
        foot: its name.
        down: share of the samples on the ground [-].
        sliding: share of those with a force outside the cone [-]: a real foot would have slid.
        median_ratio: half of the samples on the ground need less friction than this [-].
    """

    foot: str
    down: float
    sliding: float
    median_ratio: float


def friction_demand(trace: Trace, model: RigidModel) -> tuple[FrictionDemand, ...]:
    """Return one row per foot."""
    found = []
    for k, name in enumerate(trace.foot_names):
        held = trace.contact[:, k]
        normal = trace.normal_force[held, k]
        ratio = np.linalg.norm(trace.tangential_force[held, k], axis=1) / normal
        sliding = float((ratio > model.ground.mu).mean()) if len(ratio) else 0.0
        median = float(np.median(ratio)) if len(ratio) else 0.0
        found.append(FrictionDemand(name, float(held.mean()), sliding, median))
    return tuple(found)


class RigidRecorder:
    """Collects the samples of a walk."""

    def __init__(self, stepper: ConstrainedStepper) -> None:
        """Begin without samples."""
        self._stepper = stepper
        self._rows: list[dict[str, float | Array]] = []

    def add(self, now: Snapshot, work: Mapping[str, float]) -> None:
        """Add a sample; `work` is what was done and lost since the start [J]."""
        model = self._stepper.model
        wanted, rate, _ = self._stepper.set_points(now.time)
        conserved = energy(model, State(now.q, now.v))
        radius = np.array([[foot.radius] for foot in model.robot.feet])
        self._rows.append({
            "time": now.time, "q": now.q, "v": now.v, "torque": now.solution.torque,
            "q_ref": wanted, "v_ref": rate, "com": conserved.center_of_mass,
            "foot_position": now.terms.place + radius * model.normal,
            "foot_force": now.solution.force, "foot_gap": now.terms.gap,
            "kinetic": conserved.kinetic, "potential": conserved.potential, **work,
        })  # fmt: skip

    def trace(
        self, controller: Controller, counters: Mapping[str, int], step: float, sample: float
    ) -> Trace:
        """Return the samples as a trace of a controller's run; step and sample in [s]."""
        model = self._stepper.model
        columns: dict[str, Any] = {
            name: np.array([row[name] for row in self._rows], dtype=float) for name in self._rows[0]
        }
        none = np.zeros(len(self._rows))
        energies = {name: columns.pop(name) for name in ENERGIES}
        return Trace(
            **columns,
            energy={**energies, "elastic": none, "friction_loss": none},
            counters=dict(counters),
            joint_names=model.robot.joint_names,
            foot_names=model.foot_names,
            run=self._record(controller, step, sample),
            foot_normal=model.normal,
            error=None,
        )

    def _record(self, controller: Controller, step: float, sample: float) -> RunRecord:
        model, plan, servo = self._stepper.model, self._stepper.set_points.plan, self._stepper.servo
        robot, settings = model.robot, controller.to_dict()
        return RunRecord(
            robot=RobotFacts(
                name=robot.name,
                provenance=robot.provenance,
                digest=robot.digest,
                urdf=robot.urdf,
                total_mass=robot.total_mass,
                effort_limit=tuple(robot.effort_limit.tolist()),
                velocity_limit=tuple(robot.velocity_limit.tolist()),
                foot_radius=tuple(float(foot.radius) for foot in robot.feet),
                doubts=robot.doubts,
            ),
            numerics=Numerics(method=METHOD, step=step, sample=sample),
            walk=WalkFacts.of(plan, settings),
            gravity=tuple(model.gravity.tolist()),
            assumed=(
                *robot.assumed,
                f"servo gains: {servo.describe()}",
                f"rigid ground on which feet stick; checked against mu {model.ground.mu:g}",
            ),
            case=RunCase(controller_data=settings),
        )


# Motion on rigid ground over time: one contact phase to rounding, or a walk of many.

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
        accuracy: relative error of DOP853 per step.

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
