"""The native right-hand side against Pinocchio's Python `aba` with NumPy feet; its Jacobians."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from test_contact import numpy_friction, numpy_normal

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.simulation.plant import native_plant

CONTACTS = {"s1": hp.Contact.s1(), "s2": hp.Contact.s2()}


def random_state(robot: hp.Robot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A state near standing, low enough that most feet press a little into the ground."""
    q = pin.neutral(robot.model)
    q[7:] = robot.posture + rng.normal(size=len(robot.posture)) * 0.1
    tilt = rng.normal(size=3) * 0.1
    q[3:7] = pin.Quaternion(pin.exp3(tilt)).coeffs()
    q[:2] = rng.normal(size=2)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    heights = [foot_center(robot, data, foot)[2] - foot.radius for foot in robot.feet]
    q[2] -= np.sort(heights)[4] + 1e-4
    return q, rng.normal(size=robot.model.nv)


def foot_center(robot: hp.Robot, data: pin.Data, foot: hp.Foot) -> np.ndarray:
    """Sphere centre in the world, by Pinocchio's forward kinematics."""
    return data.oMi[robot.model.getJointId(foot.joint)].act(foot.offset)


def numpy_acceleration(
    scene: hp.Scene, q: np.ndarray, v: np.ndarray, torque: np.ndarray
) -> tuple[np.ndarray, int]:
    """V' by Pinocchio's `aba` with one external force per foot, all of it in Python."""
    robot, model = scene.robot, scene.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    external = [pin.Force.Zero() for _ in range(model.njoints)]
    touching = 0
    for foot in robot.feet:
        joint = model.getJointId(foot.joint)
        center = foot_center(robot, data, foot)
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


@pytest.mark.parametrize("name", ["kharagpur", "athena", "hexa_ref"])
@pytest.mark.parametrize("contact", CONTACTS)
def test_right_hand_side_equals_aba_with_numpy_feet(name: str, contact: str) -> None:
    """200 random states with contacts (over the six combinations): 1e-10 relative."""
    robot = vehicles.hexa_ref() if name == "hexa_ref" else hp.load_robot(name)
    scene = hp.Scene(robot, contact=CONTACTS[contact])
    plant = native_plant(scene)
    assert plant.arrow
    rng = np.random.default_rng(7)
    touched = 0
    for _ in range(34):
        q, v = random_state(robot, rng)
        torque = rng.normal(size=len(robot.joint_names))
        expected, touching = numpy_acceleration(scene, q, v, torque)
        touched += touching
        found = _native.evaluate(plant, q, v, torque)["acceleration"]
        assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()
    assert touched > 34  # the states do press on the ground


def test_dense_and_arrow_solvers_agree() -> None:
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot)
    rng = np.random.default_rng(3)
    arrow, dense = native_plant(scene), native_plant(scene, dense=True)
    assert arrow.arrow and not dense.arrow
    for _ in range(20):
        q, v = random_state(robot, rng)
        torque = rng.normal(size=18)
        one = _native.evaluate(arrow, q, v, torque)["acceleration"]
        other = _native.evaluate(dense, q, v, torque)["acceleration"]
        assert np.abs(one - other).max() < 1e-11 * np.abs(one).max()


def test_foot_jacobian_and_drift_equal_central_differences() -> None:
    """du/dv = J and du/dxi = Q, to 1e-8 of their size (h = 1e-6: h^2 and eps/h)."""
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot)
    plant = native_plant(scene)
    rng = np.random.default_rng(5)
    q, v = random_state(robot, rng)
    q[2] -= 5e-2  # all six feet well inside
    zero = np.zeros(18)
    found = _native.evaluate(plant, q, v, zero)
    h = 1e-6
    for k in range(24):
        dv = np.zeros(24)
        dv[k] = h
        up, down = (_native.evaluate(plant, q, v + s * dv, zero) for s in (1, -1))
        by_v = (up["foot_velocity"] - down["foot_velocity"]).ravel() / (2 * h)
        assert np.abs(by_v - found["foot_jacobian"][:, k]).max() < 1e-8
        up, down = (
            _native.evaluate(plant, pin.integrate(robot.model, q, s * dv), v, zero) for s in (1, -1)
        )
        by_q = (up["foot_velocity"] - down["foot_velocity"]).ravel() / (2 * h)
        assert np.abs(by_q - found["foot_drift"][:, k]).max() < 2e-8
        by_gap = (up["foot_gap"] - down["foot_gap"]) / (2 * h)
        assert np.abs(by_gap - found["foot_jacobian"][2::3, k]).max() < 1e-8


@pytest.mark.parametrize("name", ["kharagpur", "hexa_ref"])
def test_bias_equals_pinocchio(name: str) -> None:
    """The bias from CRBA's leftovers against `nonLinearEffects`, 100 fast random states."""
    robot = vehicles.hexa_ref() if name == "hexa_ref" else hp.load_robot(name)
    plant, data = native_plant(hp.Scene(robot)), robot.model.createData()
    rng = np.random.default_rng(11)
    for _ in range(100):
        q = pin.randomConfiguration(robot.model, -np.ones(25), np.ones(25))
        v = 5.0 * rng.normal(size=robot.model.nv)
        expected = pin.nonLinearEffects(robot.model, data, q, v)
        found = _native.evaluate(plant, q, v, np.zeros(18))["bias"]
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
