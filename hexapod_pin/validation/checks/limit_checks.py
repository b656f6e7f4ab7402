"""Compliant contact of the core must approach rigid contact in the limit of stiff ground."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.formulations import rigid as rigid_contact
from hexapod_pin.formulations.rigid import RigidModel, plastic_impact
from hexapod_pin.ground.contact import Contact, KelvinVoigt, StickSlip
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import simulate
from hexapod_pin.validation.cases.bodies import NO_JOINT_STOPS, ZERO_GAIN_SERVO
from hexapod_pin.validation.checks.samples import SEED
from hexapod_pin.validation.hard_case import Check

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.trace import Trace


# Compliant contact against rigid contact as it stiffens: runs of the core, and their limit.

NO_SLIP_MU = 50.0
"""Coefficient of friction of the runs whose limit is a foot that sticks."""

TRIPOD_FEET = (0, 2, 4)
"""Feet lf, lr, rm."""

BEDDING_STIFFNESS = 1e5
"""Springs beside the dampers of an impact [N/m]."""

DAMPING_RATIO = 0.7
MATCHED_MASS = 1.0
"""Mass that a foot's damper is matched to [kg]: a third of the robot."""


def damped_impact(damping: float) -> float:
    """Return |v+ of the core - v+ of eq. 5| over the fastest speed before; dampers c [N s/m].

    The dampers stop three feet of a limp kharagpur within 20 of their slowest time constant; the
    springs hardly push meanwhile, but keep the cones open to the end. What is left falls like 1/c,
    as the path that the feet give.
    """
    model, feet = RigidModel(load_robot("kharagpur", foot_radius=0.0)), TRIPOD_FEET
    q = model.robot.stand(_tripod_posture().q).q
    before, rate = _even_arrival(model, q)
    wanted = plastic_impact(model, q, before, (), feet).velocity
    contact = Contact(
        normal=KelvinVoigt(stiffness=BEDDING_STIFFNESS, damping=damping),
        friction=StickSlip(mu=NO_SLIP_MU, stiffness=BEDDING_STIFFNESS, damping=damping),
    )
    scene = Scene(
        model.robot,
        contact=contact,
        servo=ZERO_GAIN_SERVO,
        stops=NO_JOINT_STOPS,
        gravity=(0.0, 0.0, 0.0),
    )
    time = 20.0 / (damping * rate)
    trace = simulate(
        scene, HoldPosture(), duration=time, sample=time, method="dop853", accuracy=1e-12,
        initial=model.robot.check_state(q, before),
    )  # fmt: skip
    return float(np.abs(trace.v[-1] - wanted).max() / np.abs(before).max())


def _even_arrival(model: RigidModel, q: Array) -> tuple[Array, float]:
    """Return a velocity that dampers bring to rest with all feet pressed on to the end.

    The feet arrive along an eigenvector of J M^-1 J^T, so that all forces die away together (any
    other arrival would make some foot pull before the last has stopped); what the impact leaves
    untouched is random.

    Returns:
        Velocity (nv,), and how fast a damper of 1 N s/m stops it [1/s].
    """
    mass, rows, _, _ = model.positions(q)
    jacobian = rows[list(TRIPOD_FEET)].reshape(-1, len(mass))
    answer = np.linalg.solve(mass, jacobian.T)
    rates, modes = np.linalg.eigh(jacobian @ answer)
    push = modes[2::3] * np.sign(modes[2::3].sum(axis=0))
    best = int(push.min(axis=0).argmax())
    impulse = modes[:, best] * np.sign(modes[2::3, best].sum())
    free = 0.2 * np.random.default_rng(SEED).normal(size=len(mass))
    free -= answer @ np.linalg.solve(jacobian @ answer, jacobian @ free)
    return free - answer @ impulse * (0.3 / rates[best]), float(rates[best])


@dataclass(frozen=True)
class RigidLimit:
    """A compliant run beside the rigid one.

    Attributes:
        force: largest difference of a foot force at the compared times, over the weight [-].
        torque: largest difference of a torque there [N m].
        evaluations: of the compliant run.
        wall: of the compliant run [s].
    """

    force: float
    torque: float
    evaluations: int
    wall: float


def stiff_scene(stiffness: float) -> Scene:
    """Return kharagpur on point feet with linear springs [N/m] that never slip."""
    damping = 2.0 * DAMPING_RATIO * math.sqrt(stiffness * MATCHED_MASS)
    contact = Contact(
        normal=KelvinVoigt(stiffness=stiffness, damping=damping),
        friction=StickSlip(mu=NO_SLIP_MU, stiffness=stiffness, damping=damping),
    )
    robot = load_robot("kharagpur", foot_radius=0.0)
    return Scene(robot, contact=contact, servo=Servo.from_effort(robot))


def tripod(stiffness: float) -> RigidLimit:
    """Return a stance on three legs, 0.5 s after it was put down, against rigid contact."""
    control, duration = _tripod_posture(), 0.5
    trace = _compliant(stiffness, control, duration, 1e-7)
    return _apart(trace, _rigid(control, duration, 1e-3), np.array([len(trace.time) - 1]))


def slow_gait(stiffness: float, accuracy: float = 1e-6) -> RigidLimit:
    """Return half a cycle of a slow tripod gait against the rigid walk, in mid-stance."""
    control, duration = KinematicControl(SLOW_TRIPOD), 0.5 * SLOW_TRIPOD.cycle_time
    trace = _compliant(stiffness, control, duration, accuracy)
    mid_stance = np.flatnonzero(
        np.abs(trace.time / SLOW_TRIPOD.cycle_time - 0.25) < MID_STANCE_HALF_WIDTH
    )
    return _apart(trace, _rigid(control, duration, 2e-3), mid_stance)


SLOW_TRIPOD = Gait.tripod(stroke=0.04, cycle_time=4.0)
MID_STANCE_HALF_WIDTH = 0.1
"""Share of the cycle about mid-stance that is compared: impacts and lift-offs are elsewhere."""


def _tripod_posture() -> HoldPosture:
    robot = load_robot("kharagpur", foot_radius=0.0)
    lifted = {"lm", "rf", "rr"}
    angles = dict(zip(robot.joint_names, robot.posture, strict=True))
    for leg in robot.legs:
        if leg.name in lifted:
            angles[leg.joints[1]] -= 0.3
    return HoldPosture(np.array([angles[name] for name in robot.joint_names]))


def _compliant(stiffness: float, control: Controller, duration: float, accuracy: float) -> Trace:
    return simulate(
        stiff_scene(stiffness), control, duration=duration, sample=0.01, accuracy=accuracy
    )


@lru_cache(maxsize=4)
def _rigid(control: Controller, duration: float, step: float) -> Trace:
    model = RigidModel(load_robot("kharagpur", foot_radius=0.0))
    return rigid_contact.simulate(model, control, duration=duration, step=step, sample=0.01).trace


def _apart(trace: Trace, rigid: Trace, samples: NDArray[np.intp]) -> RigidLimit:
    weight = trace.run.robot.mass * 9.81
    force = np.abs(trace.foot_force[samples] - rigid.foot_force[samples]).max() / weight
    torque = np.abs(trace.torque[samples] - rigid.torque[samples]).max()
    count = int(trace.counters["evaluations"])
    return RigidLimit(float(force), float(torque), count, (trace.run.wall_time or 0.0))


# Compliant contact of the core against rigid contact as it stiffens.


def tripod_force() -> float:
    """Return the difference of foot forces over the weight at 1e8 N/m."""
    return tripod(1e8).force


def tripod_order() -> float:
    """Return how far the differences at 1e6 and 1e8 N/m are from falling like 1/K."""
    return abs(tripod(1e6).force / tripod(1e8).force / 100.0 - 1.0)


def gait_torque() -> float:
    """Return the difference of torques [N m] in mid-stance of a slow tripod gait at 1e8 N/m."""
    return slow_gait(1e8).torque


def impact() -> float:
    """Return the difference of v+ on dampers of 1e7 N s/m, over the largest speed before."""
    return damped_impact(1e7)


CHECKS = (
    Check("tripod-limit", "feet of a tripod: core at 1e8 N/m against rigid, per weight",
          tripod_force, 1e-4, source="S2 app. eq. 4"),
    Check("tripod-order", "the same falls like 1/K from 1e6 to 1e8 N/m", tripod_order, 0.05,
          source="S2 app. eq. 4"),
    Check("gait-limit", "torques of a slow gait: core at 1e8 N/m against the rigid walk",
          gait_torque, 2e-4, "N m", "S2 app. eqs. 4, 5"),
    Check("impact-limit", "core on dampers of 1e7 N s/m against eq. 5", impact, 1e-4,
          source="S2 app. eq. 5"),
)  # fmt: skip
