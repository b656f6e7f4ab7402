"""y' = f(t, y) of a scene on one piece of its laws: y = (q, v, stretches of the bristles)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.scene.loads import Push
from oracles.second_rhs.bodies import Bodies
from oracles.second_rhs.foot_contacts import NONE, SWITCHES, ContactMode, ContactState, FootContacts
from oracles.second_rhs.joint_drives import JointDrives, JointModes
from oracles.second_rhs.surface import Surface
from oracles.second_rhs.vectors import cross, length

if TYPE_CHECKING:
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene
    from oracles.second_rhs.set_point_curve import Curve


@dataclass(frozen=True, eq=False)
class Modes:
    """The piece of every law that a state is on."""

    contacts: tuple[ContactMode, ...]
    joints: JointModes

    def same(self, other: Modes) -> bool:
        """Whether all modes and memories are equal."""
        return self.contacts == other.contacts and self.joints.same(other.joints)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What one evaluation finds.

    Attributes:
        rate: y'.
        contacts: the contacts.
        joints: angles, rates, torques asked of the motors, and what acts on the joints but
            drives, stops and inertial forces, (n,) each [rad, rad/s, N m, N m].
        holding: torques that hold joints stuck by dry friction, or all torques of prescribed joints
            (n,) [N m].
    """

    rate: Array
    contacts: list[ContactState]
    joints: tuple[Array, Array, Array, Array]
    holding: Array


class RightHandSide:
    """The equations of motion of a scene.

    Attributes:
        set_points: what the servos follow on the present interval.
        pushes: those that act on it.
    """

    set_points: Curve
    pushes: list[Push]

    def __init__(self, scene: Scene) -> None:
        """Read the scene.

        Raises:
            ParameterError: something that is not written here.
        """
        self.bodies, self.drives = Bodies(scene), JointDrives(scene)
        self.laws = FootContacts(scene.contact, Surface(scene.terrain))
        self.nq, self.nv = self.bodies.model.nq, self.bodies.model.nv
        self.spheres = self.bodies.spheres
        self.bristles = 3 * len(self.spheres) if self.laws.bristle is not None else 0
        self.pushes = []

    def first(self, time: float, state: State) -> tuple[Array, Modes]:
        """Return y and the modes where a run starts."""
        y = np.concatenate([state.q, state.v, np.zeros(self.bristles)])
        angle, rate = state.q[7:], state.v[6:]
        demand = self.drives.demand(angle, rate, self.set_points(time))
        free = Modes(
            tuple(ContactMode() for _ in self.spheres), self.drives.modes(angle, rate, demand)
        )
        at = self(time, y, free)
        return y, replace(free, contacts=tuple(
            self.laws.next_mode(mode, found, found, [found.gap])
            for mode, found in zip(free.contacts, at.contacts, strict=True)
        ))  # fmt: skip

    def __call__(self, time: float, y: Array, modes: Modes) -> Evaluation:
        """Evaluate; the quaternion of y may be off unit norm by round-off."""
        q, v = y[: self.nq].copy(), y[self.nq : self.nq + self.nv]
        q[3:7] /= length(q[3:7])
        self.bodies.place(q, v)
        contacts = [self._contact(k, time, y, mode) for k, mode in enumerate(modes.contacts)]
        for push in self.pushes:
            self.bodies.add_push(push)
        acceleration, joints, holding = self.joint_motion(time, q, v, modes)
        stretch = [at.stretch_rate for at in contacts] if self.bristles else []
        whole = np.concatenate([configuration_rate(q, v), acceleration, *stretch])
        return Evaluation(whole, contacts, joints, holding)

    def joint_motion(
        self, time: float, q: Array, v: Array, modes: Modes
    ) -> tuple[Array, tuple[Array, Array, Array, Array], Array]:
        """Return v', the joints and the holding torques of an evaluation."""
        angle, rate = q[7:], v[6:]
        demand = self.drives.demand(angle, rate, self.set_points(time))
        outer = self.bodies.outer_torque(q, v) if self.drives.gears else np.zeros_like(angle)
        torque = self.drives.torque(modes.joints, angle, rate, demand, outer)
        locked = self.drives.stuck(modes.joints)
        acceleration, holding = self.bodies.acceleration(q, v, torque, locked)
        return acceleration, (angle, rate, demand, outer), holding

    def switches(self, modes: Modes, at: Evaluation) -> Array:
        """Return the switching functions: of all contacts, then of the joints; positive inside."""
        own: list[float] = []
        for mode, contact in zip(modes.contacts, at.contacts, strict=True):
            own += self.laws.switches(mode, contact)
        joints = self.drives.switches(modes.joints, *at.joints, at.holding)
        return np.concatenate([own, joints])

    def _contact(self, k: int, time: float, y: Array, mode: ContactMode) -> ContactState:
        sphere = self.spheres[k]
        centre, point, velocity = self.bodies.sphere_state(sphere, self.laws.surface.normal)
        begin = self.nq + self.nv + 3 * k
        stretch = y[begin : begin + 3] if self.bristles else NONE
        at = self.laws.state(mode, time, (centre, sphere.radius), velocity, stretch)
        if mode.touching:
            self.bodies.add_force(sphere.joint, point, at.force)
        return at

    def behind(
        self, y: Array, modes: Modes, at: Evaluation, behind: Evaluation
    ) -> tuple[Array, Modes]:
        """Return y and the modes behind a switch; the same modes where there is none.

        Args:
            y: at the switch.
            modes: before it.
            at: evaluated at the switch, in the modes before.
            behind: evaluated just behind it, in the modes before.
        """
        y, switches = y.copy(), self.switches(modes, behind)
        contacts = tuple(
            self.laws.next_mode(mode, at.contacts[k], behind.contacts[k],
                                switches[SWITCHES * k : SWITCHES * (k + 1)].tolist())
            for k, mode in enumerate(modes.contacts)
        )  # fmt: skip
        joints, stopped = self.drives.next_modes(
            modes.joints, switches[SWITCHES * len(contacts) :],
            self.drives.modes(*behind.joints[:3]), behind.holding,
        )  # fmt: skip
        y[self.nq + 6 : self.nq + self.nv][stopped] = 0.0
        for k, (old, new) in enumerate(zip(modes.contacts, contacts, strict=True)):
            if self.bristles and old.touching and not new.touching:
                y[self.nq + self.nv + 3 * k :][:3] = 0.0
        return y, Modes(contacts, joints)


def configuration_rate(q: Array, v: Array) -> Array:
    """Return q' (nq,): the base's velocities are in its own axes, its quaternion is x, y, z, w."""
    vector, scalar, linear, spin = q[3:6], float(q[6]), v[:3], v[3:6]
    turned = linear + 2.0 * cross(vector, cross(vector, linear) + scalar * linear)
    turning = 0.5 * (scalar * spin + cross(vector, spin))
    return np.concatenate([turned, turning, [-0.5 * float(vector @ spin)], v[6:]])
