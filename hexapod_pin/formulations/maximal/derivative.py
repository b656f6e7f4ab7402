"""Newton-Euler equations with joint constraints (S1 eq. 1) give accelerations and bearing loads.

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

from hexapod_pin.errors import UnknownNameError
from hexapod_pin.formulations.conserved import ConservedQuantities
from hexapod_pin.formulations.maximal.model import AXIS, world_inertia
from hexapod_pin.formulations.maximal.state import ContactEvaluation, RunMemory
from hexapod_pin.robot.rotations import crosses, rotations

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.model import (
        BodyKinematics,
        ConstraintEquations,
        MaximalModel,
    )
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
    return -crosses(spin, momentum)


# The multipliers of S1 eq. 1 as bearing loads: force and moment of every joint.

FRAMES = ("world", "parent", "child")


@dataclass(frozen=True, eq=False)
class JointReaction:
    """Load that the parent's side of a joint puts on the child's, about the joint's origin.

    Attributes:
        joint: its name.
        frame: "world"; "parent" or "child": axes of that link.
        axis: (3,) unit axis of the joint in that frame.
        force: (3,) [N].
        moment: (3,) of the bearing, across the axis [N m].
        drive: torque of servo, damping and stops along the axis [N m].
    """

    joint: str
    frame: str
    axis: Array
    force: Array
    moment: Array
    drive: float

    @property
    def axial(self) -> float:
        """Force along the axis [N]."""
        return float(self.axis @ self.force)

    @property
    def radial(self) -> float:
        """Size of the force across the axis [N]."""
        return float(np.linalg.norm(self.force - self.axial * self.axis))

    @property
    def tilting(self) -> float:
        """Size of the moment across the axis [N m]."""
        return float(np.linalg.norm(self.moment))


def joint_reactions(
    model: MaximalModel, found: MaximalDerivative, frame: str = "child"
) -> dict[str, JointReaction]:
    """Return the reaction of every joint by name.

    With Baumgarte's terms and open joints the multipliers also hold what closes the joints again:
    use a projected state where reactions matter.

    Args:
        model: the model.
        found: its derivative at a state.
        frame: axes of the vectors: "world", "parent" or "child" link.

    Raises:
        UnknownNameError: another frame.
    """
    if frame not in FRAMES:
        raise UnknownNameError("frame", frame, list(FRAMES))
    bodies, at = model.bodies, found.kinematics
    across = found.constraints.on_child[:, 3:, 3:].transpose(0, 2, 1)
    world = (
        at.on_parent.value[:, :, AXIS],
        found.multipliers[:, :3],
        np.matmul(across, found.multipliers[:, 3:, None])[:, :, 0],
    )
    turn = {
        "world": np.eye(3)[None],
        "parent": at.rotation[bodies.parent],
        "child": at.rotation[1:],
    }[frame]
    axis, force, moment = (np.matmul(x[:, None, :], turn)[:, 0] for x in world)
    drive = found.torque + found.passive
    return {
        name: JointReaction(name, frame, axis[j], force[j], moment[j], float(drive[j]))
        for j, name in enumerate(bodies.joint_names)
    }


# Energy and momentum of all bodies together, each body with its own velocity (S1).


def energy(model: MaximalModel, state: MaximalState) -> ConservedQuantities:
    """Return energy and momentum of a state."""
    bodies, linear, spin = model.bodies, state.velocity[:, :3], state.velocity[:, 3:]
    inertia = world_inertia(rotations(state.quaternion), bodies.inertia)
    own_momentum = np.matmul(inertia, spin[:, :, None])[:, :, 0]
    mass, total = bodies.mass, bodies.mass.sum()
    center = mass @ state.position / total
    about_center = np.cross(state.position - center, mass[:, None] * linear)
    return ConservedQuantities(
        kinetic=0.5 * float(mass @ (linear**2).sum(axis=1) + (spin * own_momentum).sum()),
        potential=-float(total * (model.gravity @ center)),
        momentum=mass @ linear,
        angular_momentum=(own_momentum + about_center).sum(axis=0),
        center_of_mass=center,
    )
