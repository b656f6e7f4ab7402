"""Joints that follow a motion exactly: against SciPy and Pinocchio, by all methods; runs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.plant import motion_at
from hexapod_pin.validation.checks.maximal_checks import maximal_twin

ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
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


ROBOT = hp.load_robot("kharagpur")


def moving_legs() -> hp.motion.JointMotion:
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


@cache
def by_scipy() -> tuple[Array, Array]:
    """Integrate the six equations of the base with Pinocchio and laws written here."""
    robot, time = ROBOT, 0.01 * np.arange(41)
    motion, model, data = moving_legs(), robot.model, robot.model.createData()
    hold = hp.HoldPosture(motion.plan(robot, 0.4).q[0])
    start = hp.simulate(hp.Scene(robot, contact=CONTACT), hold, duration=0.0).q[0]
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
            jacobian = pin.getJointJacobian(model, data, joint, ALIGNED)
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
            method="DOP853", rtol=3e-10, atol=3e-11,
        )  # fmt: skip
        rows += list(found.y.T)
    q = [np.concatenate([y[:7], joints(t)[0]]) for y, t in zip(rows, time, strict=True)]
    return np.array(q), np.array([balance(t, y)[1] for y, t in zip(rows, time, strict=True)])


@cache
def run(method: str) -> hp.Trace:
    scene, how = hp.Scene(ROBOT, contact=CONTACT, prescribed=True), METHODS[method][0]
    return hp.simulate(scene, moving_legs(), duration=0.4, method=method, sample=0.01, **how)


@pytest.mark.parametrize("method", METHODS)
def test_equals_an_independent_integration_of_the_six_equations(method: str) -> None:
    trace, tolerance = run(method), METHODS[method][1]
    error = np.abs(trace.q - by_scipy()[0]).max(axis=0)
    assert error[:7].max() < tolerance
    assert error[7:].max() < 1e-12  # the joints are where their functions are, to rounding
    work = np.abs(trace.energy["servo_work"]).max()
    first_order = method in ("robust", "implicit-euler")
    assert np.abs(trace.energy_residual).max() < (2e-2 if first_order else 1e-5) * work
    assert work > 1e-3


def test_torque_is_the_reaction() -> None:
    """Errors of 1e-11 m in the base are 1e-6 N on feet of 1e5 N/m; where motions jump apart."""
    trace = run("dop853")
    jumps = np.isin(np.round(trace.time, 6), [0.05, 0.15, 0.2, 0.3, 0.4])
    error = np.abs(trace.torque - by_scipy()[1])[~jumps]
    assert error.max() < 1e-6
    assert np.abs(trace.torque).max() > 0.5


def waving() -> hp.motion.JointMotion:
    turns = {
        name: hp.motion.Sine(amplitude=0.1, period=0.2 + 0.01 * k, phase=0.7 * k, mean=angle)
        for k, (name, angle) in enumerate(zip(ROBOT.joint_names, ROBOT.posture, strict=True))
    }
    return hp.motion.JointMotion(turns)


def test_a_push_on_a_falling_robot_that_moves_its_legs() -> None:
    """The centre of mass in closed form, torques by Pinocchio: the push in them where it acts."""
    force, torque = np.array([3.0, -2.0, 1.0]), np.array([0.02, 0.05, -0.03])
    robot, motion, link, model = ROBOT, waving(), "lf_tibia", ROBOT.model
    angle, rate = motion_at(motion.plan(robot, 1.0), 0.0)
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.9)).coeffs()
    v = np.concatenate([[0.1, -0.2, 0.3, 0.8, -0.5, 1.2], rate])
    begin = robot.check_state(np.concatenate([[0.0, 0.0, 5.0], turn, angle]), v)
    push = hp.Push(link, force=force, torque=torque, start=0.0, duration=1.0)
    how = {"method": "dop853", "accuracy": 1e-12, "sample": 1e-3, "initial": begin}
    trace = hp.simulate(hp.Scene(robot, prescribed=True, loads=[push]), motion, duration=0.3, **how)
    found = pin.computeCentroidalMomentum(model, model.createData(), trace.q[0], trace.v[0])
    start = found.linear / robot.total_mass
    t = trace.time[:, None]
    fall = np.array([0.0, 0.0, -9.81]) + force / robot.total_mass
    assert trace.com == pytest.approx(trace.com[0] + start * t + 0.5 * fall * t**2, abs=1e-9)
    for k in range(10, len(trace.time) - 1, 30):
        wanted = reaction(trace, k, link, np.concatenate([force, torque]))
        assert trace.torque[k] == pytest.approx(wanted, abs=1e-6)
    assert np.abs(trace.torque).max() > 0.1


def reaction(trace: hp.Trace, k: int, link: str, wrench: Array) -> Array:
    robot, model, data = ROBOT, ROBOT.model, ROBOT.model.createData()
    q, v, at, functions = trace.q[k], trace.v[k], trace.time[k : k + 1], waving().motion
    joints = [functions[name].acceleration(at, at)[0] for name in robot.joint_names]
    jacobian = pin.computeFrameJacobian(model, data, q, model.getFrameId(link), ALIGNED)
    a = np.concatenate([np.zeros(6), joints])
    pushed = jacobian.T @ wrench
    lacking = pin.rnea(model, data, q, v, a) - pushed
    mass = pin.crba(model, data, q)
    a[:6] = np.linalg.solve(np.triu(mass[:6, :6]) + np.triu(mass[:6, :6], 1).T, -lacking[:6])
    return np.asarray(pin.rnea(model, data, q, v, a) - pushed)[6:]


def test_motor_turns_its_rotor_and_its_friction() -> None:
    robot = ROBOT
    motion = hp.motion.JointMotion(
        {"lf_femur_joint": hp.motion.Sum(terms=(-0.6, hp.motion.Sine(amplitude=0.1, period=0.5)))}
    )
    taken = {"dry_friction": 0.1, "viscous_friction": 0.02}
    turned = {"rotor_inertia": 1e-7, "gear_ratio": 200.0}
    motor, runs = hp.Motor(stall_torque=5.0, no_load_speed=6.0, **taken, **turned), []
    for motors in (None, {"lf_femur_joint": motor}):
        scene = hp.Scene(robot, servo=hp.Servo(kp=1e2, kd=2.0, motor=motors), prescribed=True)
        runs.append(hp.simulate(scene, motion, duration=0.5, accuracy=1e-7))
    k, t, rate = robot.joint_index("lf_femur_joint"), runs[0].time, 2.0 * np.pi / 0.5
    v, a = 0.1 * rate * np.cos(rate * t), -0.1 * rate**2 * np.sin(rate * t)
    added = 1e-7 * 200.0**2 * a + 0.02 * v + 0.1 * np.sign(v)
    moving = np.abs(v) > 1e-6
    difference = (runs[1].torque - runs[0].torque)[moving, k]
    # the rotor's reaction turns the trunk, on springs, by some 1e-4 rad: the leg feels it
    assert np.abs(difference - added[moving]).max() < 0.02 * np.abs(added).max()


def test_what_cannot_be_prescribed_is_refused() -> None:
    robot = ROBOT
    scene = hp.Scene(robot, prescribed=True)
    jumps = hp.motion.SampledTrajectory([0.0, 0.1], np.tile(robot.posture, (2, 1)), limited=False)
    with refused(ParameterError, "Scene.prescribed", True, about=("set-points",)):
        hp.simulate(scene, jumps, duration=0.2)
    with refused(ParameterError, "Scene.prescribed", True, about=("commanded",)):
        hp.simulate(scene, hp.FootControl(hp.Gait.tetrapod()), duration=0.2)
    with refused(ParameterError, "Scene.prescribed", True, about=("LostLeg",)):
        hp.Scene(robot, prescribed=True, loads=[hp.LostLeg(leg="lf", start=1.0)])
    with refused(ParameterError, "Scene.prescribed", True, about=("maximal",)):
        maximal_twin(scene)
    beside = robot.stand()
    q = beside.q.copy()
    q[7] += 0.01
    about = (robot.joint_names[0], "0.01", "Scene.prescribed")
    with refused(hp.errors.StateError, about=about):
        hp.simulate(scene, hp.HoldPosture(), duration=0.1, initial=hp.State(q, beside.v))


def test_gains_beside_a_prescribed_motion_are_refused(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["walk", "kharagpur", "--prescribed", "--kp", "10", "--duration", "1"])
    message = " ".join(capsys.readouterr().err.split())
    assert "--kp, --kd = 10" in message and "left out with --prescribed" in message
