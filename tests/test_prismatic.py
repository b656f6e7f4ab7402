"""Sliding joints: feet on springs and a slide on the trunk, against Pinocchio and closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from leg_robots import joint, legged, link, load

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.simulation.plant import native_plant

SPRING = 3000.0  # N/m
SHANK = 0.01  # mass on each foot spring [kg]
NO_STOPS = hp.JointStops(stiffness=0.0)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> hp.Robot:
    """Six legs of three joints with foot springs along their tibiae, and a slide on the trunk."""
    slide = joint("slide", "base_link", "sled", (0.02, 0.01, 0.04), axis="0.6 0 0.8", rpy="0.3 0 0",
                  kind="prismatic", limits=(-0.05, 0.05), effort=50.0)  # fmt: skip
    sled = link("sled", 0.3, 0.05, (0.01, 0.02, 0.0))
    arm = joint("arm", "sled", "hand", (0.05, 0.0, 0.0), axis="0 1 0")
    text = legged(spring=True).replace("</robot>", slide + sled + arm + link("hand", 0.1, 0.05))
    return load(text + "</robot>", tmp_path_factory.mktemp("robot"))


def servo(kp=400.0, kd=8.0, spring=SPRING, rate=10.0) -> hp.Servo:
    legs = ("coxa", "femur", "tibia", "held")
    return hp.Servo(kp={**dict.fromkeys(legs, kp), "slide": spring},
                    kd={**dict.fromkeys(legs, kd), "slide": rate})  # fmt: skip


def moving_state(robot: hp.Robot, seed: int, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a random state about the standing posture, its base at a height [m]."""
    rng = np.random.default_rng(seed)
    n = len(robot.joint_names)
    q = np.concatenate([[0.1, -0.2, height], pin.exp6_quat(np.zeros(6))[3:], robot.posture])
    q = pin.integrate(robot.model, q, 0.1 * np.concatenate([np.zeros(3), rng.normal(size=3 + n)]))
    q[7:] = np.where(robot.turning, q[7:], 0.01 * rng.normal(size=n))
    spread = np.concatenate([np.ones(6), np.where(robot.turning, 2.0, 0.3)])
    return q, rng.normal(size=6 + n) * spread


def test_jacobian_and_velocity_of_feet_are_pinocchios(robot: hp.Robot) -> None:
    names = zip(robot.joint_names, robot.turning, strict=True)
    slides = {name for name, turns in names if not turns}
    assert slides == {*(f"{leg.name}_spring_joint" for leg in robot.legs), "slide"}
    assert set(robot.held) == {*slides, "arm"}
    q, v = moving_state(robot, 1, 0.02)
    plant, none = native_plant(hp.Scene(robot, servo=servo())), np.zeros(len(v) - 6)
    found, data = native.evaluate(plant, q, v, none), robot.model.createData()
    pin.computeJointJacobians(robot.model, data, q)
    assert (found["foot_gap"] < 0.0).sum() >= 3
    for k in np.flatnonzero(found["foot_gap"] < 0.0):
        foot = robot.feet[k]
        number = robot.model.getJointId(foot.joint)
        jacobian = pin.getJointJacobian(robot.model, data, number, pin.LOCAL_WORLD_ALIGNED)
        arm = data.oMi[number].act(foot.offset) - [0, 0, foot.radius] - data.oMi[number].translation
        wanted = jacobian[:3] - pin.skew(arm) @ jacobian[3:]
        np.testing.assert_allclose(found["foot_jacobian"][3 * k : 3 * k + 3], wanted, atol=1e-13)
        np.testing.assert_allclose(found["foot_velocity"][k], wanted @ v, atol=1e-12)


def test_derivative_of_foot_velocity_by_positions(robot: hp.Robot) -> None:
    """Against central differences: 1e-6 of their step leaves 1e-8 of values of order 10."""
    q, v = moving_state(robot, 3, -0.15)
    plant, none = native_plant(hp.Scene(robot, servo=servo())), np.zeros(len(v) - 6)
    found = native.evaluate(plant, q, v, none)
    assert (found["foot_gap"] < 0.0).all()
    for k in range(3, len(v)):
        step = 1e-6 * np.eye(len(v))[k]
        places = (pin.integrate(robot.model, q, s * step) for s in (1.0, -1.0))
        ahead, behind = (native.evaluate(plant, p, v, none)["foot_velocity"] for p in places)
        slope = (ahead - behind).ravel() / 2e-6
        np.testing.assert_allclose(found["foot_drift"][:, k], slope, atol=1e-6)


def test_accelerations_with_ground_forces_are_those_of_pinocchios_aba(robot: hp.Robot) -> None:
    q, v = moving_state(robot, 4, 0.1)
    v *= -0.01  # slowly downwards: feet that leave fast have no force
    torque = np.random.default_rng(4).normal(size=len(v) - 6)
    scene = hp.Scene(robot, servo=servo(), stops=NO_STOPS)
    found = native.evaluate(native_plant(scene), q, v, torque)
    outer = found["foot_jacobian"].T @ found["foot_force"].ravel()
    outer[6:] += torque
    wanted = pin.aba(robot.model, robot.model.createData(), q, v, outer)
    assert np.abs(found["foot_force"]).max() > 1.0
    np.testing.assert_allclose(found["acceleration"], wanted, atol=1e-10 * np.abs(wanted).max())


def test_energy_of_a_flight_on_springs_is_conserved(robot: hp.Robot) -> None:
    gains = servo(40.0, 0.0, 300.0, 0.0)
    scene = hp.Scene(robot, servo=hp.Servo(kp=gains.kp, kd=gains.kd, limited=False), stops=NO_STOPS)
    q, v = moving_state(robot, 6, 3.0)
    run = hp.simulate(scene, hp.HoldPosture(), duration=0.3, method="dop853", accuracy=1e-11,
                      sample=0.02, initial=hp.State(q, 0.5 * v))  # fmt: skip
    data, kp = robot.model.createData(), gains.gains(robot)[0]
    energy = [
        pin.computeKineticEnergy(robot.model, data, q, v)
        + pin.computePotentialEnergy(robot.model, data, q)
        + 0.5 * kp @ (q[7:] - robot.posture) ** 2
        for q, v in zip(run.q, run.v, strict=True)
    ]
    assert np.ptp(energy) < 1e-8 * max(energy)
    moved = np.ptp(run.q[:, 7:][:, ~robot.turning], axis=0)
    assert moved.min() > 1e-3


def standing(tmp_path: Path) -> hp.Robot:
    path = tmp_path / "stand.urdf"
    path.write_text(legged(spring=True))
    legs = ("lf", "lm", "lr", "rf", "rm", "rr")
    return hp.load_robot(path, posture={f"{leg}_tibia_joint": np.pi / 2 + 0.3 for leg in legs})


def test_a_robot_on_springs_sinks_by_its_weight_over_their_stiffness(tmp_path: Path) -> None:
    """(W / 6 - m g) / k; legs of 2000 N m/rad turn the springs by less than 0.3 degrees."""
    robot = standing(tmp_path)
    scene = hp.Scene(
        robot, contact=hp.Contact.preset("accurate").with_mu(0.0), servo=servo(2000.0, 20.0)
    )
    run = hp.simulate(scene, hp.HoldPosture(), duration=1.5, accuracy=1e-8)
    columns = [robot.joint_index(f"{leg.name}_spring_joint") for leg in robot.legs]
    pressed = -run.q[-1, 7:][columns]
    weight = robot.total_mass * 9.81
    assert run.normal_force[-1].sum() == pytest.approx(weight, rel=1e-5)
    assert pressed.mean() == pytest.approx((weight / 6.0 - SHANK * 9.81) / SPRING, rel=1e-3)
    own = (run.normal_force[-1] - SHANK * 9.81) / SPRING
    np.testing.assert_allclose(pressed, own, rtol=1e-3)
    np.testing.assert_allclose(run.torque[-1, columns], SPRING * pressed, rtol=1e-6)
    budget = hp.torque_budget(run)
    assert budget.kind("slide").peak.effort_limit == 200.0 and "N for N m" in budget.table()


def test_stops_and_force_limits_of_sliding_joints_are_in_newtons_and_metres(tmp_path: Path) -> None:
    """Springs that give only their dampers: feet go to their stops and lean on them."""
    robot = standing(tmp_path)
    stops = hp.JointStops(stiffness=500.0, sliding_stiffness=8000.0, dissipation=0.3)
    scene = hp.Scene(robot, contact=hp.Contact.preset("accurate").with_mu(0.0),
                     servo=servo(2000.0, 20.0, spring=0.0, rate=20.0), stops=stops)  # fmt: skip
    run = hp.simulate(scene, hp.HoldPosture(), duration=2.0)
    columns = [robot.joint_index(f"{leg.name}_spring_joint") for leg in robot.legs]
    load = run.normal_force[-1] - SHANK * 9.81
    np.testing.assert_allclose(-run.q[-1, 7:][columns] - 0.02, load / 8000.0, rtol=2e-3)
    default = hp.JointStops.from_effort(robot)
    assert default.stiffness == pytest.approx(6.0 / 0.01)  # of joints that turn alone
    assert default.sliding_stiffness == pytest.approx(200.0 / 1e-3)
    assert hp.Servo.from_effort(robot).kp == pytest.approx(6.0 / 0.025)
