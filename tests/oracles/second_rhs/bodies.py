"""The bodies of a scene by Pinocchio's Python algorithms: kinematics of contacts, accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.scene.loads import Payload, Push
from oracles.second_rhs.vectors import cross

if TYPE_CHECKING:
    from hexapod_pin.scene.scene import Scene

NO_BASE = np.zeros(6)
ABOVE = np.triu(np.ones((6, 6), dtype=bool))


class Sphere(NamedTuple):
    """A sphere that may touch the ground: joint, centre in its frame (3,) [m], radius [m]."""

    joint: int
    offset: Array
    radius: float


class Bodies:
    """Pinocchio's model with the scene's payloads and rotors, and its spheres.

    Attributes:
        model: a copy of the robot's.
        spheres: the feet, then the trunk's points where the ground pushes them.
    """

    def __init__(self, scene: Scene) -> None:
        """Build the model.

        Raises:
            ParameterError: a load of mass that is not a payload.
        """
        robot = scene.robot
        self.model = robot.model.copy()
        self.model.gravity.linear = np.array(scene.gravity)
        for load in scene.mass_loads:
            if not isinstance(load, Payload):
                raise ParameterError("Scene.loads", load.kind, "payloads, pushes and lost legs")
            self._carry(load)
        rotors = [
            0.0 if motor is None else motor.rotor_inertia * motor.gear_ratio**2
            for motor in scene.servos.motors(robot)
        ]
        self.model.armature = self.model.armature + np.concatenate([np.zeros(6), rotors])
        self._data = self.model.createData()
        self.spheres = [
            Sphere(self.model.getJointId(foot.joint), np.array(foot.offset), foot.radius)
            for foot in robot.feet
        ]
        if scene.body_contact:
            from hexapod_pin.robot.link_shapes import trunk_points

            trunk = trunk_points(robot)
            pairs = zip(trunk.points, trunk.radius, strict=True)
            self.spheres += [Sphere(1, np.array(place), float(size)) for place, size in pairs]
        self._none, self._loaded = pin.Force.Zero(), set[int]()
        self._outer = pin.StdVec_Force()
        self._outer.extend([pin.Force.Zero() for _ in range(self.model.njoints)])

    def frame(self, link: str) -> tuple[int, pin.SE3]:
        """Return the joint that moves a link, and the link's place in the joint's frame."""
        frame = self.model.frames[self.model.getFrameId(link, pin.FrameType.BODY)]
        return frame.parentJoint, frame.placement

    def _carry(self, load: Payload) -> None:
        joint, placement = self.frame(load.link)
        own = np.zeros((3, 3)) if load.inertia is None else _matrix(load.inertia)
        carried = pin.Inertia(load.mass, np.array(load.position), own)
        self.model.inertias[joint] = self.model.inertias[joint] + placement.act(carried)

    def place(self, q: Array, v: Array) -> None:
        """Compute the placements and velocities of a state; forces start at zero."""
        pin.forwardKinematics(self.model, self._data, q, v)
        for joint in self._loaded:
            self._outer[joint] = self._none
        self._loaded.clear()

    def sphere_state(self, sphere: Sphere, normal: Array) -> tuple[Array, Array, Array]:
        """Return centre, contact point and the velocity of its material point, world axes."""
        here, twist = self._data.oMi[sphere.joint], self._data.v[sphere.joint]
        rotation = here.rotation
        arm = rotation @ sphere.offset
        centre, reach = here.translation + arm, -sphere.radius * normal
        spin = rotation @ twist.angular
        return centre, centre + reach, rotation @ twist.linear + cross(spin, arm + reach)

    def add_force(self, joint: int, point: Array, force: Array) -> None:
        """Add a force at a point, both in world axes."""
        self._loaded.add(joint)
        wrench = pin.Force(force, cross(point, force))
        self._outer[joint] = self._outer[joint] + self._data.oMi[joint].actInv(wrench)

    def add_push(self, push: Push) -> None:
        """Add a wrench of constant components in world axes on a point of a link."""
        joint, placement = self.frame(push.link)
        here = self._data.oMi[joint]
        point = here.act(placement.act(np.array(push.position)))
        self.add_force(joint, point, np.array(push.force))
        turning = pin.Force(np.zeros(3), here.rotation.T @ np.array(push.torque))
        self._outer[joint] = self._outer[joint] + turning

    def acceleration(self, q: Array, v: Array, torque: Array, locked: Array) -> tuple[Array, Array]:
        """Return v' (nv,), and the torques that hold the locked joints (n,) [N m], else 0.

        Args:
            q: configuration (nq,).
            v: velocity (nv,).
            torque: of the joints (n,) [N m].
            locked: which joints do not accelerate (n,).
        """
        load, holding = np.concatenate([np.zeros(6), torque]), np.zeros(len(torque))
        if not locked.any():
            return pin.aba(self.model, self._data, q, v, load, self._outer).copy(), holding
        mass = pin.crba(self.model, self._data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        rest = load - pin.rnea(self.model, self._data, q, v, np.zeros(len(v)), self._outer)
        free = np.concatenate([np.full(6, True), np.logical_not(locked)])
        out = np.zeros(len(v))
        out[free] = np.linalg.solve(mass[np.ix_(free, free)], rest[free])
        holding[locked] = (mass @ out - rest)[6:][locked]
        return out, holding

    def outer_torque(self, q: Array, v: Array) -> Array:
        """Return what gravity, velocity forces and outer forces give the joints (n,) [N m]."""
        still = pin.rnea(self.model, self._data, q, v, np.zeros(len(v)), self._outer)
        return np.asarray(-still[6:])

    def driven(self, q: Array, v: Array, acceleration: Array) -> tuple[Array, Array]:
        """Return v' (nv,) and the torques (n,) [N m] of joints with given accelerations.

        Args:
            q: configuration (nq,).
            v: velocity (nv,).
            acceleration: of the joints (n,) [rad/s^2].
        """
        rows = pin.crba(self.model, self._data, q)[:6]  # whose part above the diagonal is filled
        base = np.where(ABOVE, rows[:, :6], rows[:, :6].T)
        out = np.concatenate([NO_BASE, acceleration])
        still = pin.rnea(self.model, self._data, q, v, out, self._outer).copy()
        out[:6] = -np.linalg.solve(base, still[:6])
        return out, still[6:] + out[:6] @ rows[:, 6:]


def _matrix(moments: tuple[float, ...]) -> Array:
    """Return the inertia of ixx, iyy, izz, ixy, ixz, iyz [kg m^2]."""
    xx, yy, zz, xy, xz, yz = moments
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
