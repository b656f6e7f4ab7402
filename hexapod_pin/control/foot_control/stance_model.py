"""A standing robot is linearised under its servos, contacts and static forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.drive.drive_law import armature
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact import StickSlip
from hexapod_pin.robot.robot import once_per_robot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hexapod_pin.arrays import Array


@dataclass(frozen=True, eq=False)
class StanceModel:
    """M a + D v + K x = S^T (kp q_ref + kd v_ref): x small motions from the standing posture.

    The trunk is level, the ground a horizontal plane; N is the robot's degrees of freedom, n its
    joints, F its feet. x is the trunk's displacement and rotation in its own axes, then the joints.

    K holds the servos' stiffness, that of the contacts, and that of the weight and of the static
    foot forces (gravity stiffness is included). Contacts follow the scene's laws at the static
    load: normal slope and damping of the law; along the ground the spring and damper of a sticking
    `StickSlip`, or the viscous slope of a regularised law at rest. Left out: dry friction of
    joints, torque limits, payloads, patches of ground.

    Attributes:
        mass: with rotors. Shape (N, N).
        damping: Shape (N, N).
        stiffness: Shape (N, N).
        kp: of the servos [N m/rad]. Shape (n,).
        kd: [N m s/rad]. Shape (n,).
        contact_stiffness: of the feet, world axes [N/m]. Shape (F, 3, 3); 0 of one in the air.
        contact_damping: [N s/m]. Shape (F, 3, 3).
        jacobian: of the contact points, world axes. Shape (F, 3, N).
        load: static normal force of each foot [N]. Shape (F,).
        torque: static torque of each joint [N m]. Shape (n,).
        gravity: magnitude [m/s^2].
    """

    mass: Array
    damping: Array
    stiffness: Array
    kp: Array
    kd: Array
    contact_stiffness: Array
    contact_damping: Array
    jacobian: Array
    load: Array
    torque: Array
    gravity: float

    @classmethod
    def of(
        cls, scene: Any, feet: Sequence[str] | None = None, touch_speed: float = 0.0
    ) -> StanceModel:
        """Return the model of a scene's robot in its standing posture.

        Args:
            scene: a `Scene`; its terrain is not used.
            feet: names of the feet that stand; None: all. The weight is split between them by
                least squares.
            touch_speed: at which they came down [m/s]; only `Restitution` uses it.

        Raises:
            ParameterError: feet that cannot carry the weight: one would have to pull.
        """
        robot, servos = scene.robot, scene.servos
        gravity = float(np.linalg.norm(scene.gravity))
        still = standing_still(robot, gravity, None if feet is None else tuple(feet))
        slopes = [_slopes(scene.contact, force, touch_speed) for force in still.load]
        contact_stiffness, contact_damping = (np.array(part) for part in zip(*slopes, strict=True))
        kp, kd = servos.gains(robot)
        mass, viscous = still.mass.copy(), _viscous(scene)
        mass[6:, 6:] += np.diag(armature(robot, servos))
        stiffness = still.stiffness + _through(still.jacobian, contact_stiffness)
        stiffness[6:, 6:] += np.diag(kp)
        damping = _through(still.jacobian, contact_damping)
        damping[6:, 6:] += np.diag(kd + viscous)
        return cls(
            mass, damping, stiffness, kp, kd, contact_stiffness, contact_damping, still.jacobian,
            still.load, still.torque, gravity,
        )  # fmt: skip

    @property
    def size(self) -> int:
        """Degrees of freedom N."""
        return len(self.mass)

    @property
    def state_matrix(self) -> Array:
        """A of (x, v)' = A (x, v) + B (q_ref, v_ref). Shape (2N, 2N)."""
        n = self.size
        rates = -np.linalg.solve(self.mass, np.hstack([self.stiffness, self.damping]))
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), rates])

    @property
    def input_matrix(self) -> Array:
        """B. Shape (2N, 2n)."""
        n, joints = self.size, len(self.kp)
        torque = np.zeros((n, 2 * joints))
        torque[6:] = np.hstack([np.diag(self.kp), np.diag(self.kd)])
        return np.vstack([np.zeros_like(torque), np.linalg.solve(self.mass, torque)])

    @property
    def foot_forces(self) -> Array:
        """Change of the foot forces, world axes, by (x, v) [N]. Shape (3F, 2N)."""
        parts = (self.contact_stiffness, self.contact_damping)
        rows = [-(part @ self.jacobian).reshape(-1, self.size) for part in parts]
        return np.hstack(rows)

    def outputs(self) -> dict[str, tuple[Array, Array]]:
        """Return the readings of a robot, by the fields of `Measurement`: (C, E) each.

        Reading less its static value = C (x, v) + E (q_ref, v_ref). The rotation is a vector of
        small angles [rad]; the acceleration is that less gravity, trunk axes.
        """
        n, joints = self.size, len(self.kp)
        unit, none = np.eye(2 * n), np.zeros((3, 2 * joints))
        q, v = unit[6:n], unit[n + 6 :]
        still = np.zeros((joints, 2 * joints))
        drive = np.hstack([np.diag(self.kp), np.diag(self.kd)])
        spring = -self.kp[:, None] * q - self.kd[:, None] * v
        tilt = self.gravity * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        rotation = unit[3:6]
        force = self.foot_forces
        return {
            "q": (q, still),
            "v": (v, still),
            "torque": (spring, drive),
            "rotation": (rotation, none),
            "angular_velocity": (unit[n + 3 : n + 6], none),
            "acceleration": (
                self.state_matrix[n : n + 3] + tilt @ rotation,
                self.input_matrix[n : n + 3],
            ),
            "foot_force": (force, np.zeros((len(force), 2 * joints))),
        }


def _slopes(contact: Any, load: float, touch_speed: float) -> tuple[Array, Array]:
    """Return stiffness and damping of one contact under a load [N], world axes. (3, 3) each."""
    stiffness, damping = np.zeros((3, 3)), np.zeros((3, 3))
    if not load > 0.0:
        return stiffness, damping
    normal, friction = contact.normal.native(), contact.friction.native()
    depth = (load / contact.normal.stiffness) ** (1.0 / contact.normal.exponent)
    _, stiffness[2, 2], damping[2, 2], _ = normal(depth, 0.0, touch_speed)
    if isinstance(contact.friction, StickSlip):
        along, across = contact.friction.stiffness, contact.friction.damping
    else:
        along, across = 0.0, load * friction(0.0)[0]
    stiffness[:2, :2], damping[:2, :2] = along * np.eye(2), across * np.eye(2)
    return stiffness, damping


def _through(jacobian: Array, blocks: Array) -> Array:
    """Return the sum of J^T B J over the feet. Shape (N, N)."""
    found: Array = np.einsum("fin,fij,fjm->nm", jacobian, blocks, jacobian)
    return found


def _viscous(scene: Any) -> Array:
    """Return the viscous friction of the joints [N m s/rad]. Shape (n,)."""
    motors = scene.servos.motors(scene.robot)
    own = np.array([m.viscous_friction if m else 0.0 for m in motors])
    found: Array = np.array(scene.robot.damping) + own
    return found


# A robot that stands still: masses, contact points, static forces, and the stiffness of these.

NUDGE = 1e-6
"""Of a central difference [m, rad]."""


@dataclass(frozen=True, eq=False)
class Standing:
    """The part of a standing robot that does not depend on servos and contact.

    Attributes:
        mass: without the motors' rotors. Shape (N, N).
        stiffness: of the weight and of static foot forces alone. Shape (N, N).
        jacobian: of the feet's lowest points, world axes. Shape (F, 3, N).
        load: static normal force of each foot [N]. Shape (F,).
        torque: static torque of each joint [N m]. Shape (n,).
    """

    mass: Array
    stiffness: Array
    jacobian: Array
    load: Array
    torque: Array


@once_per_robot
def _known(robot: Any) -> dict[tuple[float, tuple[str, ...] | None], Standing]:
    return {}


def standing_still(robot: Any, gravity: float, feet: tuple[str, ...] | None) -> Standing:
    """Return a robot that stands in its posture on level ground, computed once.

    Args:
        robot: the robot.
        gravity: [m/s^2].
        feet: names of the feet that carry the weight, split by least squares; None: all.

    Raises:
        ParameterError: feet that cannot carry the weight.
    """
    import pinocchio as pin

    known = _known(robot)
    if (gravity, feet) not in known:
        data, q = robot.model.createData(), robot.stand().q
        stands = np.array([feet is None or foot.name in feet for foot in robot.feet])
        mass = np.triu(pin.crba(robot.model, data, q))
        jacobian, weight = _point_jacobians(robot, data, q), _weight(robot, data, q, gravity)
        load = _split(jacobian, weight, stands)
        known[gravity, feet] = Standing(
            mass=mass + np.triu(mass, 1).T,
            stiffness=_static_stiffness(robot, data, q, gravity, load),
            jacobian=jacobian,
            load=load,
            torque=(weight - np.einsum("fn,f->n", jacobian[:, 2], load))[6:],
        )
    return known[gravity, feet]


def _point_jacobians(robot: Any, data: Any, q: Array) -> Array:
    """Return the Jacobians of the feet's lowest points, world axes. Shape (F, 3, N)."""
    import pinocchio as pin

    model = robot.model
    pin.computeJointJacobians(model, data, q)
    found = np.empty((len(robot.feet), 3, model.nv))
    for k, foot in enumerate(robot.feet):
        joint = model.getJointId(foot.joint)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        own = pin.getJointJacobian(model, data, joint, frame)
        arm = data.oMi[joint].rotation @ np.asarray(foot.offset) - [0.0, 0.0, foot.radius]
        found[k] = own[:3] - pin.skew(arm) @ own[3:]
    return found


def _weight(robot: Any, data: Any, q: Array, gravity: float) -> Array:
    """Return the generalised forces that carry the weight, (N,) [N, N m]."""
    import pinocchio as pin

    per_unit = pin.computeGeneralizedGravity(robot.model, data, q)
    found: Array = np.array(per_unit) * (gravity / -robot.model.gravity.linear[2])
    return found


def _split(jacobian: Array, weight: Array, stands: Array) -> Array:
    """Return the normal forces of least squares that carry the weight [N]. Shape (F,).

    Raises:
        ParameterError: one would have to pull.
    """
    balance = jacobian[:, 2, :6].T * stands  # rows of z, pitch and roll alone are not 0
    load = np.linalg.lstsq(balance, weight[:6], rcond=None)[0]
    missing = np.abs(balance @ load - weight[:6]).max()
    if missing > 1e-6 * weight[2] or load.min() < 0.0:
        raise ParameterError(
            "StanceModel.feet", int(stands.sum()), "feet around the robot's centre of mass"
        )
    return np.asarray(load)


def _static_stiffness(robot: Any, data: Any, q: Array, gravity: float, load: Array) -> Array:
    """Return the stiffness of the weight and of constant foot forces: d/dx (weight - J^T f).

    Moving the trunk along the ground or turning it about the vertical changes neither.

    Returns:
        Shape (N, N).
    """
    import pinocchio as pin

    size = robot.model.nv
    found = np.zeros((size, size))

    def unbalanced(step: Array) -> Array:
        at = pin.integrate(robot.model, q, step)
        forces = np.einsum("fn,f->n", _point_jacobians(robot, data, at)[:, 2], load)
        balance: Array = _weight(robot, data, at, gravity) - forces
        return balance

    for k in (2, 3, 4, *range(6, size)):
        step = np.zeros(size)
        step[k] = NUDGE
        found[:, k] = (unbalanced(step) - unbalanced(-step)) / (2.0 * NUDGE)
    return found
