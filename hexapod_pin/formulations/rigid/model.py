"""A robot on rigid ground: mass matrix, bias, and the velocity rows of its feet, from Pinocchio.

Nothing here touches the native core: this is the other side of every comparison with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid.contact_set import Grip

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Foot, Robot

FRAME = "LOCAL_WORLD_ALIGNED"
"""Pinocchio's name of the frame the rows are in: world axes, at the foot."""

UNIT = 1e-9
"""A normal may be this far from unit length."""


@dataclass(frozen=True)
class RigidGround:
    """A plane that does not give way.

    Attributes:
        mu: coefficient of friction [-], against which sticking is checked; *assumed* by default.
        normal: unit normal, pointing up, world axes.
        point: a point of the plane [m].
    """

    mu: float = 0.7
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ParameterError: mu is negative or not finite, or the normal is no unit vector.
        """
        if not (math.isfinite(self.mu) and self.mu >= 0.0):
            raise ParameterError("RigidGround.mu", self.mu, "finite and not negative")
        if not abs(math.hypot(*self.normal) - 1.0) < UNIT:
            raise ParameterError("RigidGround.normal", self.normal, "of unit length")


@dataclass(frozen=True)
class Terms:
    """The terms of S2 appendix eq. 1 at one state; nv velocities, F feet.

    Attributes:
        mass: M. Shape (nv, nv).
        bias: h, Coriolis, centrifugal and gravity forces, and joint damping. Shape (nv,).
        rows: velocity of each contact point is rows @ v, world axes. Shape (F, 3, nv).
        drift: what d/dt (rows @ v) has beyond rows @ a [m/s^2]. Shape (F, 3).
        gap: lowest point of each foot above the ground [m]. Shape (F,).
        place: contact points, world axes [m]. Shape (F, 3).
    """

    mass: Array
    bias: Array
    rows: Array
    drift: Array
    gap: Array
    place: Array

    def held(self, grip: Grip, normal: Array) -> tuple[Array, Array]:
        """Return rows (3k + l, nv) and drift of k feet that stick and l that only stay down."""
        rows = grip.rows(self.rows, normal)
        drift = self.drift[list(grip.stuck)].ravel(), self.drift[list(grip.smooth)] @ normal
        return rows, np.concatenate(drift)


class RigidModel:
    """A robot, gravity and rigid ground; a foot is a sphere that may roll, or a point.

    Attributes:
        robot: the robot.
        ground: the ground.
        gravity: acceleration [m/s^2], world axes. Shape (3,).
        normal: of the ground. Shape (3,).
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
        self._joints = [self.model.getJointId(foot.joint) for foot in robot.feet]
        self._radius = np.array([foot.radius for foot in robot.feet])

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet, in the order of every (F, ...) array."""
        return tuple(foot.name for foot in self.robot.feet)

    def terms(self, q: Array, v: Array) -> Terms:
        """Return the terms at a state q (nq,), v (nv,)."""
        mass, rows, gap, place = self.positions(q)
        return Terms(mass, self.bias(q, v), rows, self.drift(q, v), gap, place)

    def positions(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Return what depends on q alone: mass, rows, gap, place; see `Terms`."""
        import pinocchio as pin

        upper = np.triu(pin.crba(self.model, self.data, q))
        mass = upper + np.triu(upper, 1).T
        pin.computeJointJacobians(self.model, self.data, q)
        found = [self._foot(joint, foot) for joint, foot in self._feet()]
        rows = np.array([rows for rows, _ in found]).reshape(-1, 3, self.model.nv)
        place = np.array([place for _, place in found]).reshape(-1, 3)
        gap = (place - np.array(self.ground.point)) @ self.normal
        return mass, rows, gap, place

    def bias(self, q: Array, v: Array) -> Array:
        """Return h (nv,) with the joints' viscous damping in it."""
        import pinocchio as pin

        bias = np.array(pin.nonLinearEffects(self.model, self.data, q, v))
        bias[6:] += self.robot.damping * v[6:]
        return bias

    def drift(self, q: Array, v: Array) -> Array:
        """Return d/dt (rows @ v) at zero acceleration, spheres rolling (F, 3) [m/s^2]."""
        import pinocchio as pin

        model, data, frame = self.model, self.data, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        if not self._joints:
            return np.zeros((0, 3))
        spin = np.array([pin.getVelocity(model, data, j, frame).angular for j in self._joints])
        bodies = [pin.getClassicalAcceleration(model, data, j, frame) for j in self._joints]
        linear = np.array([body.linear for body in bodies])
        turn = np.array([body.angular for body in bodies])
        arm = np.array([data.oMi[j].rotation @ foot.offset for j, foot in self._feet()])
        rolling = arm - self._radius[:, None] * self.normal
        found: Array = linear + np.cross(turn, rolling) + np.cross(spin, np.cross(spin, arm))
        return found

    def gaps(self, q: Array) -> Array:
        """Return the lowest point of each foot above the ground [m]. Shape (F,)."""
        import pinocchio as pin

        pin.forwardKinematics(self.model, self.data, q)
        low = [self.data.oMi[j].act(f.offset) - f.radius * self.normal for j, f in self._feet()]
        gap: Array = (np.array(low).reshape(-1, 3) - np.array(self.ground.point)) @ self.normal
        return gap

    def kinetic_energy(self, q: Array, v: Array) -> float:
        """Return 1/2 v.M v [J]."""
        import pinocchio as pin

        return float(pin.computeKineticEnergy(self.model, self.data, q, v))

    def _feet(self) -> list[tuple[int, Foot]]:
        return list(zip(self._joints, self.robot.feet, strict=True))

    def _foot(self, joint: int, foot: Foot) -> tuple[Array, Array]:
        """Return velocity rows (3, nv) and place (3,) of a contact point."""
        import pinocchio as pin

        frame = getattr(pin.ReferenceFrame, FRAME)
        columns = pin.getJointJacobian(self.model, self.data, joint, frame)
        pose = self.data.oMi[joint]
        arm = pose.rotation @ foot.offset - foot.radius * self.normal
        return columns[:3] - pin.skew(arm) @ columns[3:], pose.translation + arm
