"""Reference answers of the hard-case catalogue, each through the simulator's front door."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from vehicles import HARD_CASES

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.simulation.plant import native_plant

ELASTIC = hp.HuntCrossley(stiffness=1e6, dissipation=0.0)
TANH = hp.TanhCoulomb(mu=0.5, slope=1000.0)
G = 9.81


def resting_particle(tmp_path, tangent: float) -> tuple[hp.Scene, hp.State]:
    """A particle of 1 kg at its static depth on a slope (tilted gravity; x downhill)."""
    robot = vehicles.particle(tmp_path)
    cosine = 1.0 / np.hypot(1.0, tangent)
    contact = hp.Contact(normal=ELASTIC, friction=TANH)
    gravity = (G * tangent * cosine, 0.0, -G * cosine)
    depth = (G * cosine / ELASTIC.stiffness) ** (2.0 / 3.0)
    scene = hp.Scene(robot, contact=contact, servo=vehicles.LIMP, gravity=gravity)
    return scene, vehicles.state(robot, -depth)


@pytest.mark.parametrize("tangent", ["0.25", "0.49", "0.4999"])
def test_hc06_creep_on_a_slope(tangent: str, tmp_path) -> None:
    """HC06: a linearly implicit step at 1 ms has the exact creep speed as its fixed point.

    Near the friction angle the speed settles slowly: 0.5 s time constant at tan = 0.4999.
    """
    scene, start = resting_particle(tmp_path, float(tangent))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=15.0, sample=1.0, initial=start)
    expected = float(HARD_CASES["HC06_slope_tanh"]["ref"]["below_mu"][tangent]["creep_speed"])
    assert trace.v[-1, 0] == pytest.approx(expected, rel=1e-6)
    assert abs(trace.v[-1, 1]) < 1e-15


@pytest.mark.parametrize(("tangent", "key"), [(0.5, "at_mu_v(1s)"), (0.51, "tan=0.51_v(1s)")])
def test_hc06_at_and_above_the_friction_angle(tangent: float, key: str, tmp_path) -> None:
    scene, start = resting_particle(tmp_path, tangent)
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=1.0, method="rk4", step=5e-5, sample=1.0, initial=start
    )
    assert trace.v[-1, 0] == pytest.approx(
        float(HARD_CASES["HC06_slope_tanh"]["ref"][key]), rel=1e-6
    )


@pytest.mark.parametrize("heading", [(1.0, 0.0), (0.6, 0.8)])
def test_hc07_sliding_stop(heading: tuple[float, float], tmp_path) -> None:
    """HC07: stop from 1 m/s; the same path along any heading, and a straight one."""
    scene, start = resting_particle(tmp_path, 0.0)
    start = vehicles.state(scene.robot, start.q[2], (*heading, 0.0))
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=0.21, method="rk4", step=2e-5, sample=5e-3, initial=start
    )
    reference = HARD_CASES["HC07_sliding_stop"]["ref"]
    along = trace.q[:, :2] @ np.array(heading)
    across = trace.q[:, :2] @ np.array([-heading[1], heading[0]])
    speed = trace.v[:, :2] @ np.array(heading)
    # at 0.21 s the mass still has 4e-17 m/s: it has stopped
    assert along[-1] == pytest.approx(float(reference["x_stop"]), rel=1e-7)
    assert np.abs(across).max() < 1e-10
    for key, time in [("v(0.1)", 0.1), ("v(0.2)", 0.2)]:
        at = int(np.argmin(np.abs(trace.time - time)))
        assert speed[at] == pytest.approx(float(reference[key]), rel=1e-7)


def test_hc14b_free_flight() -> None:
    """HC14b: 0.5 s of 24-DoF flight; energy, angular momentum, parabola and full state."""
    robot = vehicles.hexa_ref()
    case = HARD_CASES["HC14b_hexapod_flight"]
    reference = case["ref"]
    q = pin.neutral(robot.model)
    q[2] = 1.0
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*np.radians([4.0, -3.0, 0.0]))).coeffs()
    q[7:] = np.tile([0.0, -0.3, 0.3], 6)
    v = np.r_[0.3, -0.2, 1.0, 2.0, -1.0, 3.0, reference["v0_joints"]]
    scene = hp.Scene(robot, servo=vehicles.LIMP, stops=vehicles.FREE)
    trace = hp.simulate(
        scene,
        hp.HoldPosture(),
        duration=0.5,
        method="rk4",
        step=2e-4,
        sample=0.5,
        initial=robot.check_state(q, v),
    )
    assert tuple(robot.joint_names) == tuple(reference["joint_order"])
    energy = trace.energy["kinetic"] + trace.energy["potential"]
    assert energy == pytest.approx(reference["energy"], rel=1e-10)
    data = robot.model.createData()
    momentum = pin.computeCentroidalMomentum(robot.model, data, trace.q[-1], trace.v[-1])
    assert momentum.angular == pytest.approx(reference["angular_momentum_about_com"], rel=1e-9)
    assert trace.com[-1] == pytest.approx(reference["com_0.5s"], abs=1e-10)
    final = np.r_[
        reference["base_xyz_0.5s"], reference["quat_xyzw_0.5s"], reference["q_joints_0.5s"]
    ]
    assert np.abs(pin.difference(robot.model, final, trace.q[-1])).max() < 1e-7


@pytest.mark.parametrize(
    ("case", "names"), [("tripod L1,L3,R2", "L1 L3 R2"), ("tripod L2,R1,R3", "L2 R1 R3")]
)
def test_hc15_static_tripod(case: str, names: str, tmp_path) -> None:
    """HC15: three compliant feet under an off-centre mass carry what statics say, at rest."""
    places = {
        "L1": (0.2475, 0.16),
        "L2": (0.0, 0.19),
        "L3": (-0.2475, 0.16),
        "R1": (0.2475, -0.16),
        "R2": (0.0, -0.19),
        "R3": (-0.2475, -0.16),
    }
    feet = {name: (*places[name], 0.0) for name in names.split()}
    robot = vehicles.block(
        tmp_path, feet, m=3.08746, com=(0.013, -0.007, 0.0), inertia=(0.05, 0.07, 0.1)
    )
    # much dissipation so that the rest comes soon; forces on level ground have no shear
    normal = hp.HuntCrossley(stiffness=1e9, dissipation=300.0)
    contact = hp.Contact(normal=normal, friction=TANH)
    scene = hp.Scene(robot, contact=contact, servo=vehicles.LIMP)
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=2.0, sample=2.0, initial=vehicles.state(robot, 0.1)
    )
    expected = [float(n) for n in HARD_CASES["HC15_static_stance"]["ref"][case]]
    # feet at the height of the mass: the tilt of 1e-5 rad changes the arms by its square only
    assert trace.foot_force[-1, :, 2] == pytest.approx(expected, rel=1e-9)
    assert trace.foot_force[-1, :, 2].sum() == pytest.approx(3.08746 * G, rel=1e-9)


@pytest.mark.parametrize("case", ["tripod_L1_L3_R2", "six_min_norm"])
def test_hc16_static_joint_torques(case: str) -> None:
    """HC16: tau = bias - sum J^T f of the native plant, base rows in balance, to 1e-10."""
    robot = vehicles.hexa_ref()
    reference = HARD_CASES["HC16_hexapod_static_torques"]["ref"]
    load = reference[case]["N"]
    standing = {"tripod_L1_L3_R2": ["L1", "L3", "R2"], "six_min_norm": reference["foot_order"]}[
        case
    ]
    # in contact just so that the Jacobians are evaluated
    q = robot.stand(np.tile([0.0, -0.3, 0.3], 6)).q.copy()
    assert q[2] == pytest.approx(reference["base_z"], rel=1e-12)
    q[2] -= 1e-13
    found = _native.evaluate(native_plant(hp.Scene(robot)), q, np.zeros(24), np.zeros(18))
    order = [foot.name.removesuffix("_foot") for foot in robot.feet]
    tau = found["bias"].copy()
    for name, force in zip(standing, load, strict=True):
        tau -= force * found["foot_jacobian"][3 * order.index(name) + 2]
    assert np.abs(tau[:6]).max() < 1e-9
    expected = dict(zip(reference["joint_order"], reference[case]["tau"], strict=True))
    for joint, value in zip(robot.joint_names, tau[6:], strict=True):
        assert value == pytest.approx(expected[joint], rel=1e-10, abs=1e-11)


def test_hc16_standing_servos_carry_the_static_torque() -> None:
    """The torque a simulated stand settles to is the one statics give for its own foot forces."""
    robot = vehicles.hexa_ref()
    scene = hp.Scene(robot, contact=hp.Contact.s1(), servo=hp.Servo(kp=200.0, kd=4.0))
    hold = hp.HoldPosture(np.tile([0.0, -0.3, 0.3], 6))
    trace = hp.simulate(scene, hold, duration=4.0)
    found = _native.evaluate(native_plant(scene), trace.q[-1], trace.v[-1], trace.torque[-1])
    statics = found["bias"] - found["foot_jacobian"].T @ trace.foot_force[-1].ravel()
    assert trace.torque[-1] == pytest.approx(statics[6:], abs=1e-4)  # what still moves after 4 s
    assert trace.torque[-1, 1::3] == pytest.approx(np.full(6, 0.31), abs=0.03)


def test_hc40_soft_drop() -> None:
    """HC40 soft: a full drop on six feet, 49 numbers."""
    robot = vehicles.hexa_ref()
    scene, start, posture = vehicles.drop(robot)
    trace = hp.simulate(
        scene,
        hp.HoldPosture(posture),
        duration=0.25,
        method="rk4",
        step=1e-5,
        sample=0.05,
        initial=start,
    )
    reference = HARD_CASES["HC40_hexapod_drop_soft"]["ref"]
    final = np.r_[reference["base_xyz"], reference["quat_xyzw"], reference["q_joints_pin_order"]]
    assert np.abs(pin.difference(robot.model, final, trace.q[-1])).max() < 1e-6
    speed = np.r_[reference["base_v_local"], reference["v_joints"]]
    assert np.abs(trace.v[-1] - speed).max() < 1e-4
    assert trace.com[-1] == pytest.approx(reference["com"], abs=1e-6)


@pytest.mark.parametrize(("step", "error"), [(1e-3, 3e-3), (1e-4, 5e-4)])
def test_hc40_soft_drop_by_large_implicit_steps(step: float, error: float) -> None:
    """The linearly implicit step is first order: 2.7e-3 at 1 ms, 3.8e-4 at 0.1 ms."""
    robot = vehicles.hexa_ref()
    scene, start, posture = vehicles.drop(robot)
    trace = hp.simulate(
        scene, hp.HoldPosture(posture), duration=0.25, step=step, sample=0.05, initial=start
    )
    reference = HARD_CASES["HC40_hexapod_drop_soft"]["ref"]
    final = np.r_[reference["base_xyz"], reference["quat_xyzw"], reference["q_joints_pin_order"]]
    assert np.abs(pin.difference(robot.model, final, trace.q[-1])).max() < error


def test_energy_account_of_the_drop_closes() -> None:
    """Kinetic + potential + elastic - servo work + losses stays put; losses only grow."""
    robot = vehicles.hexa_ref()
    scene, start, posture = vehicles.drop(robot)
    trace = hp.simulate(
        scene,
        hp.HoldPosture(posture),
        duration=0.25,
        method="rk4",
        step=2e-5,
        sample=0.01,
        initial=start,
    )
    throughput = trace.energy["normal_loss"][-1] + trace.energy["friction_loss"][-1]
    assert throughput > 0.01
    assert np.abs(trace.energy_residual).max() < 1e-6 * throughput
    for loss in ("normal_loss", "friction_loss", "joint_damping_loss"):
        assert np.all(np.diff(trace.energy[loss]) >= 0.0)
