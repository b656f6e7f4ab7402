"""Joints that follow a motion exactly: against SciPy and Pinocchio, by all methods; runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
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
            method="DOP853", rtol=3e-10, atol=3e-11,
        )  # fmt: skip
        rows += list(found.y.T)
    q = [np.concatenate([y[:7], joints(t)[0]]) for y, t in zip(rows, time, strict=True)]
    return np.array(q), np.array([balance(t, y)[1] for y, t in zip(rows, time, strict=True)])


def motion_start(robot: hp.Robot) -> hp.HoldPosture:
    return hp.HoldPosture(moving_legs().plan(robot, 0.4).q[0])


@pytest.fixture(scope="module")
def run(robot: hp.Robot) -> Callable[[str], hp.Trace]:
    """Run a method with its setting, once."""
    scene = hp.Scene(robot, contact=CONTACT, prescribed=True)

    @cache
    def one(method: str) -> hp.Trace:
        return hp.simulate(
            scene, moving_legs(), duration=0.4, method=method, sample=0.01, **METHODS[method][0]
        )

    return one


@pytest.fixture(scope="module")
def reference(robot: hp.Robot) -> tuple[Array, Array]:
    return by_scipy(robot, 0.01 * np.arange(41))


@pytest.mark.parametrize("method", METHODS)
def test_equals_an_independent_integration_of_the_six_equations(
    run: Callable[[str], hp.Trace], reference: tuple[Array, Array], method: str
) -> None:
    trace, tolerance = run(method), METHODS[method][1]
    error = np.abs(trace.q - reference[0]).max(axis=0)
    assert error[:7].max() < tolerance
    assert error[7:].max() < 1e-12  # the joints are where their functions are, to rounding


def test_torque_is_the_reaction(
    run: Callable[[str], hp.Trace], reference: tuple[Array, Array]
) -> None:
    """Errors of 1e-11 m in the base are 1e-6 N on feet of 1e5 N/m; where motions jump apart."""
    trace = run("dop853")
    jumps = np.isin(np.round(trace.time, 6), [0.05, 0.15, 0.2, 0.3, 0.4])
    error = np.abs(trace.torque - reference[1])[~jumps]
    assert error.max() < 1e-6
    assert np.abs(trace.torque).max() > 0.5


@pytest.mark.parametrize("method", METHODS)
def test_energy_is_accounted_for(run: Callable[[str], hp.Trace], method: str) -> None:
    trace = run(method)
    work = np.abs(trace.energy["servo_work"]).max()
    first_order = method in ("robust", "implicit-euler")
    assert np.abs(trace.energy_residual).max() < (2e-2 if first_order else 1e-5) * work
    assert work > 1e-3


# Restart, batch, beside servos, drives, and what is refused.


def walk() -> hp.KinematicControl:
    return hp.KinematicControl(hp.Gait.tetrapod(cycle_time=1.2))


def test_run_goes_on_from_its_checkpoint(robot: hp.Robot) -> None:
    """To the same bits, or within the accuracy where the whole run steps over the cut."""
    scene = hp.Scene(robot, prescribed=True)
    single = {"accuracy": 1e-5, "estimate": False}  # both halves at one resolution
    for settings in (single, {"method": "robust", "step": 5e-4}):
        whole = hp.simulate(scene, walk(), duration=0.4, sample=0.01, **settings)
        first = hp.simulate(scene, walk(), duration=0.2, sample=0.01, **settings)
        rest = hp.simulate(
            scene, walk(), duration=0.2, sample=0.01, initial=first.checkpoint, **settings
        )
        apart = np.abs(rest.q - whole.q[20:]).max()
        assert apart < 1e-5 if settings is single else apart == 0.0


def test_batch_and_case_text_give_the_same_bits(robot: hp.Robot) -> None:
    scene = hp.Scene(robot, prescribed=True)
    case = hp.Case(scene, walk(), duration=0.3, accuracy=1e-5)
    again = hp.Case.from_toml(case.to_toml())
    assert again == case
    assert case != hp.Case(hp.Scene(robot), walk(), duration=0.3, accuracy=1e-5)
    first, second = hp.simulate_batch([case, again], threads=2)
    assert np.array_equal(first.q, second.q)
    assert np.array_equal(first.q, case.run().q)


def test_servos_that_stiffen_come_to_it(robot: hp.Robot) -> None:
    """RMS torque of each kind of joint within 2 %, the difference falling with the stiffness."""
    contact, kp = hp.Contact.preset("s1"), 240.0  # N m/rad, the default gain of kharagpur
    paper = hp.motion.ArcWalk(hp.Gait.tetrapod(cycle_time=1.2), profile="step")

    def rms(**settings: Any) -> Array:
        scene = hp.Scene(robot, contact=contact, **settings)
        trace = hp.simulate(scene, paper, duration=3.6, accuracy=1e-4)
        return np.array([kind.rms.torque_rms for kind in hp.torque_budget(trace).kinds])

    def servo(factor: float) -> hp.Servo:
        return hp.Servo(kp=factor * kp, kd=0.02 * factor * kp, limited=False)

    exact = rms(prescribed=True)
    off = [np.abs(rms(servo=servo(factor)) / exact - 1.0).max() for factor in (1.0, 4.0, 64.0)]
    assert off[2] < 0.02
    assert off[2] < off[1] < off[0]


def test_servos_receive_the_same_motion(robot: hp.Robot) -> None:
    """Quintics between knots carry a sine to 1e-11 of its amplitude, into the core too."""
    motion = {"rm_coxa_joint": hp.motion.Sine(amplitude=0.1, period=0.5)}
    trace = hp.simulate(hp.Scene(robot), hp.motion.JointMotion(motion), duration=0.6, sample=0.01)
    value, rate = motion["rm_coxa_joint"].value_and_rate(trace.time)
    joint = robot.joint_index("rm_coxa_joint")
    assert np.abs(trace.q_ref[:, joint] - value).max() < 2e-12
    assert np.abs(trace.v_ref[:, joint] - rate).max() < 1e-9


def test_motor_turns_its_rotor_and_its_friction(robot: hp.Robot) -> None:
    """Torque of a joint in the air: what a rotor and friction add, in closed form."""
    motion = hp.motion.JointMotion(
        {"lf_femur_joint": hp.motion.Sum(terms=(-0.6, hp.motion.Sine(amplitude=0.1, period=0.5)))}
    )
    motor = hp.Motor(
        stall_torque=5.0, no_load_speed=6.0, dry_friction=0.1, viscous_friction=0.02,
        rotor_inertia=1e-7, gear_ratio=200.0,
    )  # fmt: skip
    with_motor = hp.Servo(kp=100.0, kd=2.0, motor={"lf_femur_joint": motor})
    runs = [
        hp.simulate(
            hp.Scene(robot, servo=servo, prescribed=True), motion, duration=0.5, accuracy=1e-7
        )
        for servo in (hp.Servo(kp=100.0, kd=2.0), with_motor)
    ]
    k, t, rate = robot.joint_index("lf_femur_joint"), runs[0].time, 2.0 * np.pi / 0.5
    v, a = 0.1 * rate * np.cos(rate * t), -0.1 * rate**2 * np.sin(rate * t)
    added = 1e-7 * 200.0**2 * a + 0.02 * v + 0.1 * np.sign(v)
    moving = np.abs(v) > 1e-6
    difference = (runs[1].torque - runs[0].torque)[moving, k]
    # the rotor's reaction turns the trunk, on springs, by some 1e-4 rad: the leg feels it
    assert np.abs(difference - added[moving]).max() < 0.02 * np.abs(added).max()


def test_standing_carries_the_weight_without_servos() -> None:
    """No servo sags: the joints stay, and the base comes to rest on its feet."""
    robot = hp.load_robot("athena")
    trace = hp.simulate(
        hp.Scene(robot, prescribed=True), hp.HoldPosture(), duration=2.0, accuracy=1e-7
    )
    assert np.array_equal(trace.q[:, 7:], np.broadcast_to(robot.posture, trace.q[:, 7:].shape))
    assert trace.normal_force[-1].sum() == pytest.approx(robot.total_mass * 9.81, rel=1e-5)
    moments = hp.results.joint_moments(trace)
    assert np.abs(moments.axis_residual[-1]).max() < 1e-6


def test_what_cannot_be_prescribed_is_refused(robot: hp.Robot) -> None:
    scene = hp.Scene(robot, prescribed=True)
    jumps = hp.motion.SampledTrajectory([0.0, 0.1], np.tile(robot.posture, (2, 1)), limited=False)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("set-points",)):
        hp.simulate(scene, jumps, duration=0.2)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("commanded",)):
        hp.Session(scene)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("commanded",)):
        hp.simulate(scene, hp.FootControl(hp.Gait.tetrapod()), duration=0.2)
    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("LostLeg",)):
        hp.Scene(robot, prescribed=True, loads=[hp.LostLeg(leg="lf", start=1.0)])
    with refused(hp.errors.ParameterError, "Scene.prescribed", 1):
        hp.Scene(robot, prescribed=1)  # type: ignore[arg-type]
    beside = robot.stand()
    q = beside.q.copy()
    q[7] += 0.01
    about = (robot.joint_names[0], "0.01", "Scene.prescribed")
    with refused(hp.errors.StateError, about=about):
        hp.simulate(scene, hp.HoldPosture(), duration=0.1, initial=hp.State(q, beside.v))
