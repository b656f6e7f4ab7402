"""The native right-hand side against Pinocchio's Python `aba` with NumPy feet."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from contact_formulas import numpy_friction, numpy_normal

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.validation.checks.maximal_checks import pressed_states


def numpy_acceleration(
    scene: hp.Scene, q: np.ndarray, v: np.ndarray, torque: np.ndarray
) -> tuple[np.ndarray, int]:
    robot, model = scene.robot, scene.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    external = [pin.Force.Zero() for _ in range(model.njoints)]
    touching = 0
    for foot in robot.feet:
        joint = model.getJointId(foot.joint)
        center = data.oMi[joint].act(foot.offset)
        depth = foot.radius - center[2]
        twist = data.oMi[joint].act(data.v[joint])  # at the world's origin
        point = center - [0.0, 0.0, foot.radius]
        u = twist.linear + np.cross(twist.angular, point)
        normal = numpy_normal(scene.contact.normal, depth, -u[2])
        touching += normal > 0.0
        slip = np.hypot(u[0], u[1])
        friction = normal * numpy_friction(scene.contact.friction, slip) / slip
        force = np.array([-friction * u[0], -friction * u[1], normal])
        wrench = pin.Force(force, np.cross(point, force))
        external[joint] = external[joint] + data.oMi[joint].actInv(wrench)
    tau = np.zeros(model.nv)
    tau[6:] = torque - robot.damping * v[6:]
    return pin.aba(model, data, q, v, tau, external), touching


@pytest.mark.parametrize(
    ("contact", "name"), [("s1", "kharagpur"), ("s2", "athena"), ("s2", "hexa_ref")]
)
def test_right_hand_side_equals_aba_with_numpy_feet(contact: str, name: str) -> None:
    robot = vehicles.hexa_ref() if name == "hexa_ref" else hp.load_robot(name)
    scene = hp.Scene(robot, contact=hp.Contact.preset(contact))
    arrow, dense = native_plant(scene), native_plant(scene, dense=True)
    assert arrow.arrow and not dense.arrow
    touched = 0
    for q, v, torque in pressed_states(scene, 34):
        expected, touching = numpy_acceleration(scene, q, v, torque)
        touched += touching
        for plant in (arrow, dense):
            found = _native.evaluate(plant, q, v, torque)["acceleration"]
            assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()
    assert touched > 34  # the states do press on the ground
