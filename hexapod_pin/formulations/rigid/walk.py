"""A walk on rigid ground: phases with feet that stick (S2 eqs. 1-4), plastic impacts (eq. 5).

Within a phase the grounded feet are held. When the normal force of a foot reaches zero its cone has
closed: it loses its friction first, slides, and is let go when the normal force is zero again. A
foot that comes down ends the phase with an impact of it and the grounded feet. So ground forces and
torques come without any contact stiffness, and they are determined: 3k rows are independent as
long as no grounded leg is singular, because the servos give way.

The feet are assumed to stick. What that asks of friction is in `RigidWalk.use`, foot by foot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid.constrained_step import Drive
from hexapod_pin.formulations.rigid.contact_events import TouchDown, Walker
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.formulations.rigid.set_points import SetPoints
from hexapod_pin.formulations.rigid.walk_trace import FootUse, Recorder, foot_use

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.robot import State

STEP = 2e-3
"""Default step [s]."""


@dataclass(frozen=True)
class RigidWalk:
    """A walk on rigid ground.

    Attributes:
        trace: its samples; forces are multipliers, `normal_loss` is what impacts took.
        impacts: all touch-downs.
        releases: how often a foot was let go.
        use: what sticking asked of each foot.
    """

    trace: Trace
    impacts: tuple[TouchDown, ...]
    releases: int
    use: tuple[FootUse, ...]


def rigid_walk(
    model: RigidModel,
    controller: Controller,
    *,
    duration: float,
    servo: Servo | None = None,
    step: float = STEP,
    sample: float = STEP,
    initial: State | None = None,
    progress: Callable[[float], None] | None = None,
) -> RigidWalk:
    """Run a controller on rigid ground.

    Args:
        model: robot and ground.
        controller: gives the set-points.
        duration: simulated time [s].
        servo: gains; default `Servo.from_effort(robot)`, *assumed*.
        step: integration step [s], cut short at events.
        sample: time between samples [s].
        initial: state at t = 0; default standing on level ground at the first set-point.
        progress: called with the finished fraction (0..1) at every sample.

    Raises:
        ParameterError: a duration, step or sample that is not positive, or no initial state on
            ground that is not level at z = 0.
        GaitError, ReachError: the controller cannot do this on this robot.
        DivergenceError: feet come and go without end.
    """
    from hexapod_pin.drive.servo import Servo

    for name, value in (("duration", duration), ("step", step), ("sample", sample)):
        if not (np.isfinite(value) and value > 0.0):
            raise ParameterError(name, value, "finite and above 0 s")
    plan = controller.plan(model.robot, duration + sample)
    drive = Drive(model, servo or Servo.from_effort(model.robot), SetPoints(plan))
    walker = Walker(drive, _standing(model, plan.q[0]) if initial is None else initial)
    recorder = Recorder(drive, controller, duration, step, sample)
    count = int(np.floor(duration / sample + 1e-9))
    recorder.take(walker.now, walker.energy)
    for k in range(1, count + 1):
        walker.advance(k * sample, step)
        recorder.take(walker.now, walker.energy)
        if progress is not None:
            progress(k / count)
    counters = {"steps": walker.steps, "impacts": len(walker.impacts), "releases": walker.releases}
    trace = recorder.trace(counters)
    return RigidWalk(trace, tuple(walker.impacts), walker.releases, foot_use(trace, model))


def _standing(model: RigidModel, posture: Array) -> State:
    ground = model.ground
    if ground.normal != (0.0, 0.0, 1.0) or ground.point[2] != 0.0:
        raise ParameterError("initial", None, "given where the ground is not level at z = 0")
    return model.robot.stand(posture)
