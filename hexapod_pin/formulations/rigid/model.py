"""S2 appendix eq. 1 has a mass matrix, a bias and contact rows; state and energy go with them.

All terms come from Pinocchio; nothing here reaches the native core, which is compared with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.conserved import ConservedQuantities

if TYPE_CHECKING:
    from hexapod_pin.robot.loading.pin_model import Foot
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State


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


# Rigid ground: a plane with Coulomb friction, on which S2's feet stick.

UNIT_LENGTH_TOLERANCE = 1e-9
"""Largest | |normal| - 1 | of a unit normal [-]."""


@dataclass(frozen=True)
class RigidGround:
    """A plane that does not deform.

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
        if not abs(math.hypot(*self.normal) - 1.0) < UNIT_LENGTH_TOLERANCE:
            raise ParameterError("RigidGround.normal", self.normal, "of unit length")


# State of the rigid formulation: q = [base pose, joint angles], v = [base twist, joint rates].
#
# S2's appendix writes the equations for these coordinates; they are those of `hexapod_pin.State`.


def initial_state(model: RigidModel, q: ArrayLike, v: ArrayLike) -> State:
    """Return the checked state of a base pose, joint angles and velocities.

    Args:
        model: robot and ground.
        q: base origin in the world [m], quaternion x, y, z, w, joint angles [rad]. Shape (nq,).
        v: base velocity in base axes [m/s, rad/s], joint rates [rad/s]. Shape (nv,).

    Raises:
        StateError: wrong shape, a value that is not finite, or a quaternion off unit length.
    """
    return model.robot.check_state(q, v)


def standing_state(model: RigidModel, angles: Array | None = None) -> State:
    """Return the robot at rest, standing with these joint angles (n,) [rad] or its posture.

    Raises:
        ParameterError: the ground is not level at z = 0.
    """
    ground = model.ground
    if ground.normal != (0.0, 0.0, 1.0) or ground.point[2] != 0.0:
        raise ParameterError("initial", None, "given where the ground is not level at z = 0")
    return model.robot.stand(angles)


def configuration_rate(q: Array, v: Array) -> Array:
    """Return q' (nq,) of a base twist in body axes and joint rates v (nv,)."""
    axis, w, spin = q[3:6], q[6], v[3:6]
    turn = np.append(0.5 * (w * spin + np.cross(axis, spin)), -0.5 * (axis @ spin))
    across = 2.0 * np.cross(axis, v[:3])
    move = v[:3] + w * across + np.cross(axis, across)
    return np.concatenate([move, turn, v[6:]])


def with_unit_quaternion(q: Array) -> Array:
    """Return q (nq,) with its quaternion scaled to unit length."""
    unit = q.copy()
    unit[3:7] /= np.linalg.norm(q[3:7])
    return unit


# Energy and momentum in the robot's coordinates: 1/2 v.M v, the weight, centroidal momentum.


def energy(model: RigidModel, state: State) -> ConservedQuantities:
    """Return energy and momentum of a state, by Pinocchio."""
    import pinocchio as pin

    kinetic = float(pin.computeKineticEnergy(model.model, model.data, state.q, state.v))
    momentum = pin.computeCentroidalMomentum(model.model, model.data, state.q, state.v)
    center = np.array(pin.centerOfMass(model.model, model.data, state.q))
    return ConservedQuantities(
        kinetic=kinetic,
        potential=-model.robot.total_mass * float(model.gravity @ center),
        momentum=np.array(momentum.linear),
        angular_momentum=np.array(momentum.angular),
        center_of_mass=center,
    )
