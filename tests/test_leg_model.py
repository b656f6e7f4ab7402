"""A leg as foot control knows it: kinematics, its own weight and motion, forces from torques."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from foot_control_runs import Recorded, foot_order, robot

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.foot_control.leg_model import foot_stiffness, leg_chains, standing_centre

NAMES = ("kharagpur", "athena")
every_robot = pytest.mark.parametrize("name", NAMES)
ROTOR = hp.Motor(stall_torque=20.0, no_load_speed=30.0, rotor_inertia=2e-7, gear_ratio=150.0)
VISCOUS = hp.Motor(stall_torque=20.0, no_load_speed=30.0, viscous_friction=0.05)
WORN = hp.Motor(stall_torque=20.0, no_load_speed=30.0, viscous_friction=0.05, dry_friction=0.3)


def random_states(name: str, count: int = 20):
    """Yield q, v, a of the whole tree: free base, trunk without angular acceleration."""
    rng = np.random.default_rng(7)
    model = robot(name).model
    for _ in range(count):
        q = np.concatenate([rng.normal(size=7), robot(name).posture + rng.normal(size=18)])
        q[3:7] /= np.linalg.norm(q[3:7])
        v, a = 2.0 * rng.normal(size=model.nv), 10.0 * rng.normal(size=model.nv)
        a[3:6] = 0.0
        yield q, v, a


@every_robot
def test_feet_and_jacobians_are_those_of_the_leg(name):
    """Of LegKinematics, which test_leg_set.py holds against Pinocchio."""
    six = leg_group(robot(name))
    for q, _, _ in random_states(name):
        for leg, index, chain in zip(six.legs, six.joint_index, chains_of(name), strict=True):
            foot, jacobian = chain.foot_and_jacobian(q[7:][index])
            assert foot == pytest.approx(leg.forward(q[7:][index]), abs=1e-12)
            assert np.allclose(jacobian, leg.jacobian(q[7:][index]), atol=1e-12)


@cache
def chains_of(name: str):
    return leg_chains(hp.Scene(robot(name)))


@every_robot
@pytest.mark.parametrize("rotor", [None, ROTOR])
def test_own_torques_are_those_of_newton_and_euler_for_the_whole_tree(name, rotor):
    """The accelerometer reads R^T (a - g); the trunk turns, but not ever faster."""
    scene = hp.Scene(robot(name), servo=hp.Servo(kp=50.0, kd=1.0, motor=rotor))
    model, index = robot(name).model, leg_group(robot(name)).joint_index
    data, chains = model.createData(), leg_chains(scene)
    heavier = 0.0 if rotor is None else 2e-7 * 150.0**2
    assert not np.any(model.armature)
    for q, v, a in random_states(name):
        rotation = pin.XYZQUATToSE3(q[:7]).rotation
        felt = a[:3] + np.cross(v[3:6], v[:3]) - rotation.T @ model.gravity.linear
        torque = pin.rnea(model, data, q, v, a)[6:] + heavier * a[6:]
        for chain, j in zip(chains, index, strict=True):
            own = chain.own_torque(q[7:][j], v[6:][j], a[6:][j], v[3:6], felt)
            assert own == pytest.approx(torque[j], rel=1e-10, abs=1e-10)


@every_robot
def test_the_standing_centre_and_the_give_of_feet(name):
    """The centre by sums over the links; feet by statics: J^T f turns the joints by J^T f / kp."""
    model = robot(name).model
    data = model.createData()
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], robot(name).posture])
    pin.forwardKinematics(model, data, q)
    moment = sum(
        body.mass * data.oMi[k].act(body.lever) for k, body in enumerate(model.inertias) if k
    )
    assert standing_centre(robot(name)) == pytest.approx(moment / robot(name).total_mass, abs=1e-12)
    kp = np.linspace(20.0, 60.0, 18)
    scene = hp.Scene(robot(name), servo=hp.Servo(kp=list(kp), kd=1.0))
    six, stiffness = leg_group(robot(name)), foot_stiffness(scene.robot, scene.servos)
    for leg, index, matrix in zip(six.legs, six.joint_index, stiffness, strict=True):
        force = np.array([1e-4, 2e-4, -3e-4])
        q = np.asarray(robot(name).posture)[index]
        bent = q + leg.jacobian(q).T @ force / kp[index]
        assert matrix @ (leg.forward(bent) - leg.forward(q)) == pytest.approx(force, rel=1e-3)


def walked(name: str, source: str, motor: hp.Motor | None = None) -> tuple[Recorded, np.ndarray]:
    """Return the recorded run of a walk, and the true forces at its ticks, trunk axes (K, 6, 3)."""
    scene = hp.Scene(robot(name), servo=hp.Servo(kp=100.0, kd=1.0, motor=motor))
    force = hp.foot_control.FootForceSensing(source=source)
    run = Recorded(hp.FootControl(hp.Gait.tripod(), force=force))
    hp.simulate(scene, run, duration=3.0, sample=0.01)
    return run, np.array([m.foot_force[0, foot_order(name)] @ m.rotation[0] for m in run.measured])


def sole_jacobian(name: str, leg: int, q: np.ndarray) -> np.ndarray:
    """Return the Jacobian of a foot's lowest point over level ground by Pinocchio, trunk axes."""
    six, model = leg_group(robot(name)), robot(name).model
    whole = pin.neutral(model)
    whole[7:][six.joint_index[leg]] = q
    spatial = pin.computeJointJacobians(model, model.createData(), whole)[
        :, 6 + six.joint_index[leg]
    ]
    sole = six.legs[leg].forward(q) - [0.0, 0.0, six.radius[leg]]
    return spatial[:3] + np.cross(spatial[3:].T, sole).T


@pytest.mark.parametrize(("name", "source"), [("kharagpur", "current"), ("athena", "torque")])
def test_forces_estimated_in_a_walk_are_the_true_ones(name, source):
    """Off by joint accelerations, those of half a tick before, which jump at touch-downs."""
    run, true = walked(name, source)
    estimate, weight = run.recalled("force"), 9.81 * robot(name).total_mass
    assert estimate[0] == pytest.approx(true[0], abs=1e-6 * weight)  # at rest
    error = np.linalg.norm(estimate - true, axis=2)
    assert true[..., 2].max() > 0.3 * weight  # three feet carry it
    assert np.median(error) < 2e-3 * weight and np.quantile(error, 0.95) < 0.02 * weight


@pytest.mark.parametrize(("name", "motor"), [("kharagpur", VISCOUS), ("athena", WORN)])
def test_motor_currents_know_nothing_of_friction(name, motor):
    """Legs in the air: "torque" finds no force, "current" -J^-T (damping v + dry sign v).

    Joints that dry friction holds are left out: no formula tells what it holds there.
    """
    six, weight = leg_group(robot(name)), 9.81 * robot(name).total_mass
    damping = motor.viscous_friction + np.asarray(robot(name).damping)[six.joint_index]
    dry = motor.dry_friction + np.asarray(robot(name).friction)[six.joint_index]
    for source in ("torque", "current"):
        run, true = walked(name, source, motor)
        estimate, wrong, size = run.recalled("force"), [], []
        for m, felt, force in zip(run.measured, estimate, true, strict=True):
            q, v = m.q[0][six.joint_index], m.v[0][six.joint_index]
            for leg in np.flatnonzero((np.abs(v) > 0.02).all(axis=1) & ~force.any(axis=1)):
                taken = damping[leg] * v[leg] + dry[leg] * np.sign(v[leg])
                unseen = -np.linalg.solve(sole_jacobian(name, leg, q[leg]).T, taken)
                wrong.append(felt[leg] - (unseen if source == "current" else 0.0))
                size.append(np.linalg.norm(unseen))
        assert len(wrong) > 100
        assert np.median(np.linalg.norm(wrong, axis=1)) < 2e-3 * weight < np.median(size)
