"""Joints that follow a motion exactly: momentum, loads, grounds, other trees, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.commands.app import main
from hexapod_pin.robot import trunk_points
from hexapod_pin.scene.scene import loaded_model
from hexapod_pin.simulation.plant import motion_at

EXACT = {"method": "dop853", "accuracy": 1e-12}
STRAIGHT_DOWN = (0.0, 0.0, -9.81)


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def waving(robot: hp.Robot) -> hp.motion.JointMotion:
    """Every joint in oscillation about its standing angle, each at its own period."""
    turns = {
        name: hp.motion.Sine(amplitude=0.1, period=0.2 + 0.01 * k, phase=0.7 * k, mean=angle)
        for k, (name, angle) in enumerate(zip(robot.joint_names, robot.posture, strict=True))
    }
    return hp.motion.JointMotion(turns)


def tumbling(robot: hp.Robot, motion: hp.motion.JointMotion) -> hp.State:
    """Return the robot 5 m up, tilted and turning, its joints where the motion has them."""
    angle, rate = motion_at(motion.plan(robot, 1.0), 0.0)
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.9)).coeffs()
    twist = [0.1, -0.2, 0.3, 0.8, -0.5, 1.2]
    return robot.check_state(
        np.concatenate([[0.0, 0.0, 5.0], turn, angle]), np.concatenate([twist, rate])
    )


def flight(
    robot: hp.Robot, loads: tuple[hp.Payload | hp.Push, ...] = (), gravity: float = 0.0
) -> hp.Trace:
    motion = waving(robot)
    scene = hp.Scene(robot, prescribed=True, loads=loads, gravity=(0.0, 0.0, gravity))
    return hp.simulate(
        scene, motion, duration=0.3, sample=1e-3, initial=tumbling(robot, motion), **EXACT
    )


def momentum(model: pin.Model, trace: hp.Trace) -> Array:
    """Return linear momentum, and angular momentum about the centre of mass (T, 6), world axes."""
    data = model.createData()
    rows = zip(trace.q, trace.v, strict=True)
    return np.array([pin.computeCentroidalMomentum(model, data, q, v).vector for q, v in rows])


@pytest.mark.parametrize("carried", [0.0, 0.5])
def test_legs_that_move_in_free_flight_keep_the_momentum(robot: hp.Robot, carried: float) -> None:
    """No gravity, no ground: whatever the legs do, all six stay; 1e-9 of N s and N m s."""
    loads = (hp.Payload("lf_tibia", carried, (0.01, 0.0, -0.02)),) if carried else ()
    trace = flight(robot, loads)
    model = loaded_model(hp.Scene(robot, loads=loads))
    found = momentum(model, trace)
    assert np.abs(found - found[0]).max() < 1e-9
    assert np.abs(found[0]).min() > 1e-3
    turning = trace.v[:, 3:6] - trace.v[0, 3:6]
    assert np.abs(turning).max() > 0.1  # the trunk does not: the legs turn it
    kinetic = trace.energy["kinetic"] - trace.energy["kinetic"][0]
    assert kinetic == pytest.approx(trace.energy["servo_work"], abs=1e-8)


@pytest.mark.parametrize("link", ["base_link", "lf_tibia"])
def test_a_push_on_a_falling_robot_that_moves_its_legs(robot: hp.Robot, link: str) -> None:
    """The centre of mass in closed form, torques by Pinocchio: the push in them where it acts."""
    force, torque = np.array([3.0, -2.0, 1.0]), np.array([0.02, 0.05, -0.03])
    push = hp.Push(link, force=force, torque=torque, start=0.0, duration=1.0)
    trace = flight(robot, (push,), gravity=-9.81)
    start = momentum(robot.model, trace)[0, :3] / robot.total_mass
    t = trace.time[:, None]
    fall = np.array(STRAIGHT_DOWN) + force / robot.total_mass
    assert trace.com == pytest.approx(trace.com[0] + start * t + 0.5 * fall * t**2, abs=1e-9)
    wanted = [
        reaction(robot, trace, k, link, np.concatenate([force, torque]))
        for k in range(10, len(trace.time) - 1, 10)
    ]
    assert trace.torque[10:-1:10] == pytest.approx(np.array(wanted), abs=1e-6)
    assert np.abs(trace.torque).max() > 0.1


def reaction(robot: hp.Robot, trace: hp.Trace, k: int, link: str, wrench: Array) -> Array:
    """Return torques by inverse dynamics, the base's acceleration from its own six equations."""
    model, data = robot.model, robot.model.createData()
    q, v, t = trace.q[k], trace.v[k], trace.time[k]
    functions = waving(robot).motion
    at = np.array([t])
    joints = [functions[name].acceleration(at, at)[0] for name in robot.joint_names]
    jacobian = pin.computeFrameJacobian(
        model, data, q, model.getFrameId(link), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    a = np.concatenate([np.zeros(6), joints])
    pushed = jacobian.T @ wrench
    lacking = pin.rnea(model, data, q, v, a) - pushed
    mass = pin.crba(model, data, q)
    a[:6] = np.linalg.solve(np.triu(mass[:6, :6]) + np.triu(mass[:6, :6], 1).T, -lacking[:6])
    found: Array = (pin.rnea(model, data, q, v, a) - pushed)[6:]
    return found


def test_a_payload_is_carried_by_feet_and_joints(robot: hp.Robot) -> None:
    scene = hp.Scene(robot, prescribed=True, loads=[hp.Payload("base_link", mass=0.4)])
    bare = hp.Scene(robot, prescribed=True)
    loaded, empty = (
        hp.simulate(s, hp.HoldPosture(), duration=1.5, accuracy=1e-7, sample=0.01)
        for s in (scene, bare)
    )
    weight = (robot.total_mass + 0.4) * 9.81
    assert loaded.foot_force[-1].sum(axis=0)[2] == pytest.approx(weight, rel=1e-5)
    femora = [robot.joint_index(f"{leg}_femur_joint") for leg in ("lf", "lm", "lr")]
    assert np.abs(loaded.torque[-1, femora]).sum() > 1.1 * np.abs(empty.torque[-1, femora]).sum()


def test_a_trunk_that_lies_on_the_ground_carries_the_weight(robot: hp.Robot) -> None:
    """Feet high, body contact: what the legs feel is their own weight, in closed form."""
    posture = np.array(robot.posture)
    for leg in robot.legs:
        k = robot.joint_index(leg.joints[1])
        posture[k] = robot.lower[k]
    trunk = trunk_points(robot)
    q = robot.stand().q.copy()
    q[7:] = posture
    q[2] = 0.001 - np.min(np.asarray(trunk.points)[:, 2] - np.asarray(trunk.radius))
    start = robot.check_state(q, np.zeros(robot.model.nv))
    scene = hp.Scene(robot, prescribed=True, body_contact=True)
    hold = hp.HoldPosture(posture)
    trace = hp.simulate(scene, hold, duration=2.0, initial=start, accuracy=1e-7, sample=0.01)
    feet = len(robot.feet)
    on_trunk = trace.foot_force[-1, feet:].sum(axis=0)[2]
    assert on_trunk == pytest.approx(robot.total_mass * 9.81, rel=1e-4)
    assert not trace.foot_force[-1, :feet].any()
    data = robot.model.createData()
    held = pin.computeGeneralizedGravity(robot.model, data, trace.q[-1])[6:]
    assert trace.torque[-1] == pytest.approx(held, abs=1e-4 * np.abs(held).max())


def walk() -> hp.KinematicControl:
    return hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=0.8))


def test_a_slope_is_level_ground_with_tilted_gravity(robot: hp.Robot) -> None:
    """The same walk seen from the slope: torques and normal forces, to the runs' accuracy."""
    angle = 0.15
    tilted = (-9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle))
    slope = hp.Scene(robot, prescribed=True, terrain=hp.Slope(angle=angle))
    level = hp.Scene(robot, prescribed=True, gravity=tilted)
    uphill, wanted = (
        hp.simulate(s, walk(), duration=0.8, accuracy=1e-9, method="ndf", sample=0.01)
        for s in (slope, level)
    )
    assert uphill.torque == pytest.approx(wanted.torque, abs=1e-3)
    assert np.abs(wanted.torque).max() > 0.5
    along = uphill.q[:, :3] @ [np.cos(angle), 0.0, np.sin(angle)]
    assert along == pytest.approx(wanted.q[:, 0], abs=1e-7)


def test_shaken_ground_shakes_by_its_impulses(robot: hp.Robot) -> None:
    """Impulses of weight and feet are the change of momentum; it does shake."""
    ground = hp.terrain.ShakingGround(amplitude=0.002, frequency=5.0)
    scene = hp.Scene(robot, prescribed=True, terrain=ground, contact=hp.Contact.preset("s1"))
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=0.4, accuracy=1e-9, method="ndf", sample=1e-3
    )
    impulse = trace.foot_impulse.sum(axis=(0, 1))
    impulse[2] -= robot.total_mass * 9.81 * 0.4
    found = momentum(robot.model, trace)
    assert found[-1, :3] - found[0, :3] == pytest.approx(impulse, abs=1e-7)
    assert np.abs(impulse[2]) > 0.1
    lift = ground.lift_at(trace.time)
    assert np.corrcoef(trace.q[:, 2], lift)[0, 1] > 0.9


def four_joint_robot(folder: Path) -> hp.Robot:
    """A trunk on four legs of four joints each; point feet."""
    solid = (
        '<link name="{0}"><inertial><origin xyz="{1}"/><mass value="{2}"/>'
        '<inertia ixx="{3}" iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    joint = (
        '<joint name="{1}_joint" type="revolute"><parent link="{0}"/><child link="{1}"/>'
        '<origin xyz="{2}"/><axis xyz="{3}"/>'
        '<limit lower="-2" upper="2" effort="10" velocity="100"/></joint>'
    )
    text = solid.format("base", "0.01 0 0", 2.0, 0.02)
    for name, x, y in (("lf", 1, 1), ("lr", -1, 1), ("rf", 1, -1), ("rr", -1, -1)):
        parent, place = "base", f"{0.2 * x} {0.1 * y} 0"
        for part, axis in (("a", "0 0 1"), ("b", "1 0 0"), ("c", "0 1 0"), ("d", "0 1 0")):
            link = f"{name}_{part}"
            text += solid.format(link, "0 0 -0.03", 0.1, 1e-4)
            text += joint.format(parent, link, place, axis)
            parent, place = link, "0 0 -0.06"
        text += f'<link name="{name}_foot"/><joint name="{name}_fix" type="fixed"><parent '
        text += f'link="{parent}"/><child link="{name}_foot"/><origin xyz="{place}"/></joint>'
    path = folder / "four.urdf"
    path.write_text(f'<robot name="four">{text}</robot>')
    feet = [f"{name}_foot" for name in ("lf", "lr", "rf", "rr")]
    return hp.load_robot(path, feet=feet, posture=[0.0, 0.1, 0.3, -0.6] * 4)


def test_legs_of_four_joints(tmp_path: Path) -> None:
    """Momentum in flight; on the ground the weight, and torques that balance the feet's forces."""
    robot = four_joint_robot(tmp_path)
    found = momentum(robot.model, flight(robot))
    assert np.abs(found - found[0]).max() < 1e-9
    scene = hp.Scene(robot, prescribed=True)
    for settings in ({"accuracy": 1e-8}, {"method": "robust", "step": 1e-3}):
        trace = hp.simulate(scene, hp.HoldPosture(), duration=2.0, sample=0.01, **settings)
        assert trace.normal_force[-1].sum() == pytest.approx(robot.total_mass * 9.81, rel=1e-4)
        model, data = robot.model, robot.model.createData()
        balance = pin.computeGeneralizedGravity(model, data, trace.q[-1])
        for foot, force in zip(robot.feet, trace.foot_force[-1], strict=True):
            frame = model.getFrameId(foot.name)
            jacobian = pin.computeFrameJacobian(
                model, data, trace.q[-1], frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            balance -= jacobian[:3].T @ force
        assert trace.torque[-1] == pytest.approx(balance[6:], abs=1e-4)
        assert np.abs(balance[:6]).max() < 1e-3


def test_what_does_not_act_is_not_taken(
    robot: hp.Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    """Gains on the command line; other engines and formulations."""
    monkeypatch.chdir(tmp_path)
    for option in ("--kp", "--kd"):
        with pytest.raises(SystemExit) as stopped:
            main(["walk", "kharagpur", "--prescribed", option, "10", "--duration", "1"])
        assert stopped.value.code != 0
        message = " ".join(capsys.readouterr().err.split())
        assert "--kp, --kd = 10" in message and "left out with --prescribed" in message
        assert not list(tmp_path.iterdir())
    from hexapod_pin.validation.checks.maximal_checks import maximal_twin

    with refused(hp.errors.ParameterError, "Scene.prescribed", True, about=("maximal",)):
        maximal_twin(hp.Scene(robot, prescribed=True))
