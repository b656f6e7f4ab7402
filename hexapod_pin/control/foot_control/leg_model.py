"""A robot's legs and centre of mass as foot control needs them, from its model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.six_legs import six_legs
from hexapod_pin.drive.drive_law import armature

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.native import LegChain
    from hexapod_pin.robot.robot import Robot


def leg_chains(scene: Any, *, dry_friction: bool = True) -> list[LegChain]:
    """Return the legs in gait order, with masses (payloads aside), rotors and friction."""
    from hexapod_pin.native import LegChain

    robot = scene.robot
    rotors = armature(robot, scene.servos) + np.asarray(robot.model.armature)[6:]
    motors = scene.servos.motors(robot)
    viscous = np.array(robot.damping) + [m.viscous_friction if m else 0.0 for m in motors]
    dry = np.array(robot.friction) + [m.dry_friction if m else 0.0 for m in motors]
    dry *= dry_friction
    return [
        LegChain(
            np.ascontiguousarray(
                [
                    [*_link(robot, joint), rotors[index], viscous[index], dry[index]]
                    for joint, index in zip(leg.joints, row, strict=True)
                ]
            ),
            leg.foot,
        )
        for leg, row in zip(six_legs(robot).legs, six_legs(robot).joint_index, strict=True)
    ]


def _link(robot: Robot, joint: str) -> list[float]:
    """Return axis, origin, mass, centre and inertia of a joint's link, base frame, angles of 0."""
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    number = model.getJointId(joint)
    place, body = data.oMi[number], model.inertias[number]
    inertia = place.rotation @ body.inertia @ place.rotation.T
    axis = data.J[3:, model.idx_vs[number]]
    return [*axis, *place.translation, body.mass, *place.act(body.lever), *inertia.ravel()]


def standing_centre(robot: Robot) -> Array:
    """Return the centre of mass of the standing posture in the base frame [m]. Shape (3,)."""
    import pinocchio as pin

    q = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], robot.posture])
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), q))


def foot_stiffness(scene: Any) -> Array:
    """Return the stiffness of each standing foot that its servos give it, base axes [N/m].

    (J diag(1 / kp) J^T)^-1 in the standing posture, the contact's own compliance aside.

    Returns:
        Shape (6, 3, 3).
    """
    six = six_legs(scene.robot)
    jacobian = six.kinematics.jacobian(six.kinematics.posture[:, None])[:, 0]
    kp = scene.servos.gains(scene.robot)[0][six.joint_index]
    compliance = jacobian @ (np.swapaxes(jacobian, 1, 2) / kp[..., None])
    return np.asarray(np.linalg.inv(compliance))
