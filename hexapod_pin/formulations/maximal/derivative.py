"""Newton-Euler equations of bodies with joints as constraints (S1 eq. 1).

    [M  -D'] [v'    ]   [f                                  ]
    [D   0 ] [lambda] = [gamma - 2 alpha Phi' - beta^2 Phi  ]

v stacks velocities of centres of mass and angular velocities, world axes; f gravity, -w x I w,
foot forces and joint torques; D' lambda are the joint reactions on the bodies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.formulations.maximal.contact_memory import ContactEvaluation, RunMemory
from hexapod_pin.formulations.maximal.joint_vectors import AXIS
from hexapod_pin.formulations.maximal.rotation import cross

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.constraints import ConstraintEquations
    from hexapod_pin.formulations.maximal.kinematics import BodyKinematics
    from hexapod_pin.formulations.maximal.model import MaximalModel
    from hexapod_pin.formulations.maximal.state import MaximalState

TorqueOfJoints = Callable[["Array", "Array"], "Array"]
"""Servo torques (nj,) [N m] of joint angles [rad] and rates [rad/s]."""


@dataclass(frozen=True, eq=False)
class MaximalDerivative:
    """v' and the multipliers at one state.

    Attributes:
        acceleration: v', world axes [m/s^2, rad/s^2]. Shape (nb, 6).
        multipliers: lambda of the joints [N, N, N, N m, N m]. Shape (nj, 5).
        support: multipliers of the root's constraint [N, N m]. Shape (h,).
        torque: of the servos [N m]. Shape (nj,).
        passive: torque of damping and stops [N m]. Shape (nj,).
        kinematics: of the bodies.
        constraints: of joints and root.
        contacts: with the ground; None without feet.
    """

    acceleration: Array
    multipliers: Array
    support: Array
    torque: Array
    passive: Array
    kinematics: BodyKinematics
    constraints: ConstraintEquations
    contacts: ContactEvaluation | None


def derivative(
    model: MaximalModel, state: MaximalState, torque: Array | TorqueOfJoints, time: float = 0.0
) -> MaximalDerivative:
    """Return accelerations and multipliers under given servo torques (S1 eq. 1).

    Args:
        model: bodies and ground.
        state: of the bodies and contacts.
        torque: of the servos (nj,) [N m], or a function of angles and rates.
        time: [s]; only shaken ground depends on it.
    """
    at = model.kinematics(state)
    memory = state.memory or RunMemory.fresh(np.zeros(len(at.angle)), model.contact_count)
    angle = memory.unwrapped(at.angle)
    servo = torque(angle, at.rate) if callable(torque) else torque
    passive = model.actuators.passive_torque(angle, at.rate)
    force, contacts = _applied_forces(model, state, at, servo + passive), None
    if model.contact is not None:
        on_feet, contacts = model.contact.forces(time, state, at.rotation, memory)
        force += on_feet
    d, stabilised = model.constraints(state, at), model.baumgarte.right_side
    rates, multipliers, support = model.solve_kkt(
        at.mass, force, d, stabilised(d.gamma, d.rate, d.violation),
        stabilised(d.root.gamma, d.root.rate, d.root.violation),
    )  # fmt: skip
    return MaximalDerivative(rates, multipliers, support, servo, passive, at, d, contacts)


def _applied_forces(
    model: MaximalModel, state: MaximalState, at: BodyKinematics, torque: Array
) -> Array:
    """Return f (nb, 6) without the ground: weight, -w x I w, torques on child and parent."""
    bodies = model.bodies
    weight = bodies.mass[:, None] * model.gravity
    force = np.concatenate([weight, gyroscopic_moment(at.inertia, state.velocity[:, 3:])], axis=1)
    if len(torque):
        moment = torque[:, None] * at.on_parent.value[:, :, AXIS]
        force[1:, 3:] += moment
        force[:, 3:] -= bodies.joints_on_body @ moment
    return force


def gyroscopic_moment(inertia: Array, spin: Array) -> Array:
    """Return -w x I w (nb, 3) [N m]."""
    momentum = np.matmul(inertia, spin[:, :, None])[:, :, 0]
    return -cross(spin, momentum)
