"""Joints that follow a motion exactly: against SciPy and Pinocchio, by all methods."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.arrays import Array

MU, SLOPE, STIFFNESS, DISSIPATION = 0.6, 50.0, 3e5, 0.4
CONTACT = hp.Contact(
    normal=hp.contact.HuntCrossley(stiffness=STIFFNESS, exponent=1.5, dissipation=DISSIPATION),
    friction=hp.contact.TanhCoulomb(mu=MU, slope=SLOPE),
)
METHODS = {  # with the error that its setting leaves after 0.4 s [m and rad]
    "extrapolated-euler": ({"accuracy": 1e-7}, 1e-6),
    "ndf": ({"accuracy": 1e-9}, 1e-8),
    "dop853": ({"accuracy": 1e-11}, 1e-10),
    "robust": ({"step": 1e-4}, 2e-4),
    "implicit-euler": ({"step": 1e-4}, 2e-4),
    "rk4": ({"step": 5e-5}, 1e-7),
}


def moving_legs() -> hp.motion.JointMotion:
    """A foot lifted and set down again, another one swept, a third in oscillation."""
    lift = hp.motion.Step(start=0.05, end=0.15, initial=0.0, final=-0.15)
    down = hp.motion.Step(start=0.2, end=0.3, initial=0.0, final=0.15)
    return hp.motion.JointMotion(
        {
            "lf_femur_joint": hp.motion.Sum(terms=(lift, down)),
            "rm_coxa_joint": hp.motion.Step5(start=0.1, end=0.35, initial=0.0, final=0.2),
            "lr_femur_joint": hp.motion.Sine(amplitude=0.02, period=0.3),
            "rf_tibia_joint": hp.motion.Havsin(start=0.0, end=0.4, initial=np.pi / 2, final=1.6),
        }
    )


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def by_scipy(robot: hp.Robot, time: Array) -> tuple[Array, Array]:
    """Integrate the six equations of the base with Pinocchio and laws written here.

    Returns configurations (T, nq) and the torques of inverse dynamics (T, n) [N m].
    """
    motion, model, data = moving_legs(), robot.model, robot.model.createData()
    start = hp.simulate(hp.Scene(robot, contact=CONTACT), motion_start(robot), duration=0.0).q[0]
    standing = np.array(robot.posture)

    def joints(t: float) -> tuple[Array, Array, Array]:
        q, v, a = standing.copy(), np.zeros(len(standing)), np.zeros(len(standing))
        for name, function in motion.motion.items():
            k = robot.joint_index(name)
            one = np.array([t])
            value, rate = function.value_and_rate(one)
            q[k], v[k], a[k] = value[0], rate[0], function.acceleration(one, one)[0]
        return q, v, a

    def balance(t: float, y: Array) -> tuple[Array, Array]:
        angle, rate, acceleration = joints(t)
        quaternion = y[3:7] / np.linalg.norm(y[3:7])
        q, v = np.concatenate([y[:3], quaternion, angle]), np.concatenate([y[7:], rate])
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        force = np.zeros(model.nv)
        bias = pin.nonLinearEffects(model, data, q, v)
        pin.computeJointJacobians(model, data, q)
        for foot in robot.feet:
            joint = model.getJointId(foot.joint)
            place = data.oMi[joint].act(foot.offset)
            depth = foot.radius - place[2]
            if depth <= 0.0:
                continue
            jacobian = pin.getJointJacobian(
                model, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            lever = place - [0.0, 0.0, foot.radius] - data.oMi[joint].translation
            rows = jacobian[:3] - pin.skew(lever) @ jacobian[3:]
            u = rows @ v
            normal = max(0.0, STIFFNESS * depth**1.5 * (1.0 - 1.5 * DISSIPATION * u[2]))
            speed = np.hypot(u[0], u[1])
            ratio = np.tanh(SLOPE * speed) / speed if speed > 0.0 else SLOPE
            on_foot = np.array([-MU * normal * ratio * u[0], -MU * normal * ratio * u[1], normal])
            force += rows.T @ on_foot
        free = force[:6] - bias[:6] - mass[:6, 6:] @ acceleration
        base = np.linalg.solve(mass[:6, :6], free)
        torque = pin.rnea(model, data, q, v, np.concatenate([base, acceleration])) - force
        assert np.abs(torque[:6]).max() < 1e-9  # the base is in balance
        turn = pin.Quaternion(*quaternion[[3, 0, 1, 2]])
        spin = pin.Quaternion(0.0, *y[10:13])
        slope = np.concatenate([turn.matrix() @ y[7:10], 0.5 * (turn * spin).coeffs(), base])
        return slope, torque[6:]

    y0 = np.concatenate([start[:7], np.zeros(6)])
    rows, kinks = [y0], [0.0, 0.05, 0.15, 0.2, 0.3, 0.4]
    for begin, end in zip(kinks[:-1], kinks[1:], strict=True):
        inside = time[(time > begin + 1e-12) & (time <= end + 1e-12)]
        found = solve_ivp(
            lambda t, y: balance(t, y)[0], (begin, inside[-1]), rows[-1], t_eval=inside,
            method="DOP853", rtol=1e-11, atol=1e-12,
        )  # fmt: skip
        rows += list(found.y.T)
    q = [np.concatenate([y[:7], joints(t)[0]]) for y, t in zip(rows, time, strict=True)]
    return np.array(q), np.array([balance(t, y)[1] for y, t in zip(rows, time, strict=True)])


def motion_start(robot: hp.Robot) -> hp.HoldPosture:
    return hp.HoldPosture(moving_legs().plan(robot, 0.4).q[0])


def run(robot: hp.Robot, method: str, **settings: float) -> hp.Trace:
    scene = hp.Scene(robot, contact=CONTACT, prescribed=True)
    return hp.simulate(scene, moving_legs(), duration=0.4, method=method, sample=0.01, **settings)


@pytest.fixture(scope="module")
def reference(robot: hp.Robot) -> tuple[Array, Array]:
    return by_scipy(robot, 0.01 * np.arange(41))


@pytest.mark.parametrize("method", METHODS)
def test_equals_an_independent_integration_of_the_six_equations(
    robot: hp.Robot, reference: tuple[Array, Array], method: str
) -> None:
    settings, tolerance = METHODS[method]
    trace = run(robot, method, **settings)
    error = np.abs(trace.q - reference[0]).max(axis=0)
    assert error[:7].max() < tolerance
    assert error[7:].max() < 1e-12  # the joints are where their functions are, to rounding


def test_torque_is_the_reaction(robot: hp.Robot, reference: tuple[Array, Array]) -> None:
    """Errors of 1e-11 m in the base are 1e-6 N on feet of 1e5 N/m; where motions jump apart."""
    trace = run(robot, "dop853", accuracy=1e-11)
    jumps = np.isin(np.round(trace.time, 6), [0.05, 0.15, 0.2, 0.3, 0.4])
    error = np.abs(trace.torque - reference[1])[~jumps]
    assert error.max() < 1e-6
    assert np.abs(trace.torque).max() > 0.5


@pytest.mark.parametrize("method", METHODS)
def test_energy_is_accounted_for(robot: hp.Robot, method: str) -> None:
    trace = run(robot, method, **METHODS[method][0])
    work = np.abs(trace.energy["servo_work"]).max()
    first_order = method in ("robust", "implicit-euler")
    assert np.abs(trace.energy_residual).max() < (2e-2 if first_order else 1e-5) * work
    assert work > 1e-3
