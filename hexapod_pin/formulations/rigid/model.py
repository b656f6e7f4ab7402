"""S2 appendix eq. 1: mass matrix M, bias h and contact rows J of a robot on rigid ground.

All terms come from Pinocchio; nothing here reaches the native core, which is compared with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid.ground import RigidGround

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Foot, Robot

CONTACT_FRAME = "LOCAL_WORLD_ALIGNED"
"""Pinocchio's name of the frame of the contact rows: world axes, at the foot."""


@dataclass(frozen=True)
class EquationTerms:
    """The terms of S2 appendix eq. 1 at one state; nv velocities, F feet.

    Attributes:
        mass: M. Shape (nv, nv).
        bias: h, Coriolis, centrifugal and gravity forces, and joint damping. Shape (nv,).
        rows: J; velocity of each contact point is rows @ v, world axes. Shape (F, 3, nv).
        drift: J' v, acceleration of the contact points at v' = 0 [m/s^2]. Shape (F, 3).
        gap: lowest point of each foot above the ground [m]. Shape (F,).
        place: contact points, world axes [m]. Shape (F, 3).
    """

    mass: Array
    bias: Array
    rows: Array
    drift: Array
    gap: Array
    place: Array


class RigidModel:
    """A robot, gravity and rigid ground; a foot is a sphere that may roll, or a point.

    Attributes:
        robot: the robot.
        ground: the ground.
        gravity: acceleration [m/s^2], world axes. Shape (3,).
        normal: of the ground. Shape (3,).
        model: Pinocchio's model, with this gravity.
        data: Pinocchio's workspace.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        ground: RigidGround | None = None,
        gravity: ArrayLike = (0.0, 0.0, -9.81),
    ) -> None:
        """Copy the robot's model, with this gravity.

        Raises:
            ParameterError: gravity is not three finite numbers.
        """
        import pinocchio as pin

        self.robot = robot
        self.ground = ground or RigidGround()
        self.gravity = np.array(gravity, dtype=float)
        if self.gravity.shape != (3,) or not np.isfinite(self.gravity).all():
            raise ParameterError("gravity", gravity, "three finite numbers [m/s^2]")
        self.normal = np.array(self.ground.normal)
        self.model = pin.Model(robot.model)
        self.model.gravity.linear = self.gravity
        self.data = self.model.createData()
        joints = [self.model.getJointId(foot.joint) for foot in robot.feet]
        self._feet: list[tuple[int, Foot]] = list(zip(joints, robot.feet, strict=True))

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet, in the order of every (F, ...) array."""
        return tuple(foot.name for foot in self.robot.feet)

    def terms(self, q: Array, v: Array) -> EquationTerms:
        """Return the terms at a state q (nq,), v (nv,)."""
        mass, rows, gap, place = self.positions(q)
        return EquationTerms(mass, self.bias(q, v), rows, self.drift(q, v), gap, place)

    def positions(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Return the terms that depend on q alone: mass, rows, gap, place."""
        import pinocchio as pin

        upper = np.triu(pin.crba(self.model, self.data, q))
        mass = upper + np.triu(upper, 1).T
        pin.computeJointJacobians(self.model, self.data, q)
        rows = np.array([self._contact_rows(j, foot) for j, foot in self._feet])
        place = self._contact_points()
        return mass, rows.reshape(-1, 3, self.model.nv), self._gap(place), place

    def gaps(self, q: Array) -> Array:
        """Return the lowest point of each foot above the ground [m]. Shape (F,)."""
        import pinocchio as pin

        pin.forwardKinematics(self.model, self.data, q)
        return self._gap(self._contact_points())

    def bias(self, q: Array, v: Array) -> Array:
        """Return h (nv,), the joints' viscous damping included."""
        import pinocchio as pin

        return self._damped(pin.nonLinearEffects(self.model, self.data, q, v), v)

    def inverse_dynamics(
        self, q: Array, v: Array, acceleration: Array, external: Any = None
    ) -> Array:
        """Return M a + h less external forces (nv,) by RNEA: what base and joints must deliver.

        Args:
            q: configuration. Shape (nq,).
            v: velocity. Shape (nv,).
            acceleration: of base (body axes) and joints [m/s^2, rad/s^2]. Shape (nv,).
            external: Pinocchio's forces on the bodies, joint frames; None: none.
        """
        import pinocchio as pin

        outside = () if external is None else (external,)
        return self._damped(pin.rnea(self.model, self.data, q, v, acceleration, *outside), v)

    def drift(self, q: Array, v: Array) -> Array:
        """Return J' v, d/dt (rows @ v) at v' = 0, spheres rolling (F, 3) [m/s^2]."""
        import pinocchio as pin

        model, data, frame = self.model, self.data, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        if not self._feet:
            return np.zeros((0, 3))
        joints = [joint for joint, _ in self._feet]
        spin = np.array([pin.getVelocity(model, data, j, frame).angular for j in joints])
        bodies = [pin.getClassicalAcceleration(model, data, j, frame) for j in joints]
        linear = np.array([body.linear for body in bodies])
        angular = np.array([body.angular for body in bodies])
        centre = np.array([data.oMi[j].rotation @ foot.offset for j, foot in self._feet])
        contact = np.array([self._contact_arm(j, foot) for j, foot in self._feet])
        found: Array = linear + np.cross(angular, contact)
        return found + np.cross(spin, np.cross(spin, centre))

    def _damped(self, force: Any, v: Array) -> Array:
        """Return generalised forces (nv,) with the joints' viscous damping added."""
        found = np.array(force)
        found[6:] += self.robot.damping * v[6:]
        return found

    def _contact_arm(self, joint: int, foot: Foot) -> Array:
        """Return the contact point from the joint's origin (3,) [m], world axes."""
        arm: Array = self.data.oMi[joint].rotation @ foot.offset - foot.radius * self.normal
        return arm

    def _contact_points(self) -> Array:
        """Return the contact points (F, 3) [m] at the pose held by `data`."""
        points = [self.data.oMi[j].translation + self._contact_arm(j, f) for j, f in self._feet]
        return np.array(points).reshape(-1, 3)

    def _gap(self, place: Array) -> Array:
        return np.asarray((place - np.array(self.ground.point)) @ self.normal)

    def _contact_rows(self, joint: int, foot: Foot) -> Array:
        """Return the velocity rows (3, nv) of a contact point."""
        import pinocchio as pin

        frame = getattr(pin.ReferenceFrame, CONTACT_FRAME)
        columns = pin.getJointJacobian(self.model, self.data, joint, frame)
        rows: Array = columns[:3] - pin.skew(self._contact_arm(joint, foot)) @ columns[3:]
        return rows
