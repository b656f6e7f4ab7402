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


@pytest.mark.parametrize("contact", CONTACTS)
def test_contact_blocks_equal_central_differences(contact: str, tmp_path) -> None:
    """W = -df/du and -df/dz of one foot, nonsymmetric coupling included."""
    robot = vehicles.particle(tmp_path)
    plant = native_plant(hp.Scene(robot, contact=CONTACTS[contact], servo=vehicles.LIMP))

    def force(z: float, u: np.ndarray) -> np.ndarray:
        q = pin.neutral(robot.model)
        q[2] = z
        return _native.evaluate(plant, q, np.r_[u, 0, 0, 0], np.zeros(0))["foot_force"][0]

    z, u = -2e-5, np.array([3e-4, -7e-4, -2e-3])
    q = pin.neutral(robot.model)
    q[2] = z
    found = _native.evaluate(plant, q, np.r_[u, 0, 0, 0], np.zeros(0))
    h = 1e-8
    by_u = np.column_stack(
        [(force(z, u + h * e) - force(z, u - h * e)) / (2 * h) for e in np.eye(3)]
    )
    scale = np.abs(by_u).max()
    assert np.abs(found["foot_damping"] + by_u).max() < 1e-6 * scale
    assert np.abs(found["foot_damping"] - found["foot_damping"].T).max() > 1e-3 * scale
    by_z = (force(z + h * 1e-2, u) - force(z - h * 1e-2, u)) / (2e-2 * h)
    assert found["foot_stiffness"][0] == pytest.approx(
        -by_z, rel=1e-5, abs=1e-7 * np.abs(by_z).max()
    )


@pytest.mark.parametrize("method", ["implicit-euler", "rk4"])
def test_method_converges_at_its_order_before_touch_down(method: str) -> None:
    """HC39: contact-free flight with servos; slope of log error over three halvings."""
    robot = vehicles.hexa_ref()
    scene, start, posture = vehicles.drop(robot)
    target = posture + np.tile([0.2, -0.1, 0.15], 6)
    duration, order = 0.016, {"implicit-euler": 1.0, "rk4": 4.0}[method]
    # kd/I = 1400 1/s: the asymptotic range begins below 1e-4 s
    steps = {"implicit-euler": (4e-5, 2e-5, 1e-5), "rk4": (2e-4, 1e-4, 5e-5)}[method]

    def final(kind: str, step: float) -> np.ndarray:
        return hp.simulate(
            scene,
            hp.HoldPosture(target),
            duration=duration,
            method=kind,
            step=step,
            sample=duration,
            initial=start,
        ).q[-1]

    truth = final("rk4", 4e-6)
    errors = [np.abs(final(method, step) - truth).max() for step in steps]
    measured = np.log2(np.array(errors[:-1]) / errors[1:])
    assert measured[-1] == pytest.approx(order, abs=0.2)


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
