"""Runs in maximal coordinates: invariants, hard cases with known answers, HC40 against the core."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import vehicles
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.formulations import maximal
from hexapod_pin.formulations.maximal.run import configuration
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.robot.rotations import rotations
from hexapod_pin.validation.checks.maximal_checks import maximal_twin, position_difference

CASES = vehicles.HARD_CASES
SPACE = (0.0, 0.0, 0.0)


def link(name: str, mass: float, moments: tuple[float, ...], com: str = "0 0 0") -> str:
    ixx, iyy, izz = moments
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def largest(values: np.ndarray) -> float:
    """Return the largest |value|; 0 of none."""
    return float(np.abs(values).max(initial=0.0))


def one_body(moments: tuple[float, ...], mass: float = 1.0) -> maximal.Bodies:
    return maximal.read_bodies(f'<robot name="body">{link("body", mass, moments)}</robot>')


def drift_of(
    model: maximal.MaximalModel, run: maximal.MaximalRun
) -> tuple[float, float, float, float]:
    """Largest relative changes of energy, linear (per total mass) and angular momentum, path."""
    found = [maximal.energy(model, s) for s in run.states]
    first, t = found[0], run.time[:, None]
    energy = max(abs(f.total - first.total) for f in found) / abs(first.kinetic)
    total = model.bodies.mass.sum()
    fall = first.momentum + total * t * model.gravity
    linear = largest(np.array([f.momentum for f in found]) - fall) / total
    spin = largest(np.array([f.angular_momentum for f in found]) - first.angular_momentum)
    path = first.center_of_mass + t * first.momentum / total + 0.5 * t**2 * model.gravity
    path_error = largest(np.array([f.center_of_mass for f in found]) - path)
    return energy, linear, spin / float(np.linalg.norm(first.angular_momentum)), path_error


# --- free flight --------------------------------------------------------------------------------


def flight() -> tuple[maximal.MaximalModel, np.ndarray, np.ndarray, np.ndarray]:
    """HC14b: model, q, v in its own joint order, and that order in the case's."""
    robot, case = vehicles.hexa_ref(), CASES["HC14b_hexapod_flight"]["ref"]
    model = maximal.MaximalModel(maximal.read_bodies(robot.urdf))
    order = np.array([case["joint_order"].index(name) for name in model.bodies.joint_names])
    roll, pitch = np.radians([4.0, -3.0]) / 2
    turn = [
        np.sin(roll) * np.cos(pitch), np.cos(roll) * np.sin(pitch), -np.sin(roll) * np.sin(pitch),
        np.cos(roll) * np.cos(pitch),
    ]  # fmt: skip
    angles = np.tile([0.0, -0.3, 0.3], 6)[order]
    rates = np.array(case["v0_joints"])[order]
    return (
        model, np.r_[0.0, 0.0, 1.0, turn, angles], np.r_[0.3, -0.2, 1.0, 2.0, -1.0, 3.0, rates],
        order,
    )  # fmt: skip


def test_limp_hexapod_in_flight() -> None:
    """HC14b: its 0.5 s state; energy, momentum and path to 1e-10, joints closed."""
    model, q, v, order = flight()
    case = CASES["HC14b_hexapod_flight"]["ref"]
    run = maximal.integrate(
        model, maximal.initial_state(model, q, v), 0.5, sample=0.25, rtol=3e-10, atol=3e-12
    )
    assert max(drift_of(model, run)) < 1e-10
    assert run.drift < 1e-12 and run.drift_rate < 1e-12
    end = run.states[-1]
    found = maximal.energy(model, end)
    assert found.total == pytest.approx(case["energy"], rel=1e-10)
    known = np.array(case["angular_momentum_about_com"])
    assert np.linalg.norm(found.angular_momentum - known) < 1e-10 * np.linalg.norm(known)
    assert found.center_of_mass == pytest.approx(case["com_0.5s"], abs=1e-10)
    assert run.q[-1, :3] == pytest.approx(case["base_xyz_0.5s"], abs=1e-8)
    sign = np.sign(run.q[-1, 6] * case["quat_xyzw_0.5s"][3])
    assert sign * run.q[-1, 3:7] == pytest.approx(case["quat_xyzw_0.5s"], abs=1e-8)
    # beyond half a turn too: the angles are counted on
    assert run.q[-1, 7:] == pytest.approx(np.array(case["q_joints_0.5s"])[order], abs=1e-8)


def test_middle_axis_flip() -> None:
    """HC11, I = 1, 2, 3: one second near the middle axis, and the first flip's known period.

    Half a period turns the body over: the middle rate has changed its sign and kept its size.
    """
    case = CASES["HC11_torque_free_dzhanibekov"]["ref"]["I=(1,2,3),w=(0.01,1,0)"]
    model = maximal.MaximalModel(one_body((1.0, 2.0, 3.0)), gravity=SPACE)
    q, v = np.r_[np.zeros(6), 1.0], np.r_[np.zeros(3), [float(x) for x in case["omega0"]]]
    period = float(case["period"])
    run = maximal.integrate(
        model, maximal.initial_state(model, q, v), period, sample=period / 2, rtol=1e-12, atol=1e-14
    )
    assert max(drift_of(model, run)[:3]) < 1e-10
    # at t = 0 the third rate is zero, and so it is after half a period
    assert run.v[1, 3:] == pytest.approx(v[3:] * [1, -1, 1], abs=1e-8)
    assert run.v[2, 3:] == pytest.approx(v[3:], abs=1e-8)


def test_constant_turning() -> None:
    """HC19 for 10 s: 100 rad about (1, 2, 2)/3, attitude to 1e-10 rad, norm to rounding."""
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    model = maximal.MaximalModel(one_body((0.01, 0.01, 0.01)), gravity=SPACE)
    q, v = np.r_[np.zeros(6), 1.0], np.r_[np.zeros(3), 10.0 * axis]
    start = maximal.initial_state(model, q, v)
    run = maximal.integrate(model, start, 10.0, rtol=1e-12, atol=1e-14)
    found, wanted = run.q[-1, 3:7], np.r_[np.sin(50.0) * axis, np.cos(50.0)]
    assert 2.0 * min(np.linalg.norm(found - s * wanted) for s in (1, -1)) < 1e-10
    assert abs(np.linalg.norm(found) - 1.0) < 1e-15


# --- supported ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_heavy_top() -> None:
    """HC20: a root held at a point, 2 s at 150 rad/s."""
    case = CASES["HC20_heavy_top"]["ref"]
    model = maximal.MaximalModel(
        one_body((0.234375, 0.46875, 0.234375), 15.0),
        root=maximal.RootConstraint.spherical((0.0, -1.0, 0.0), (0.0, 0.0, 0.0)),
    )
    spin = np.array([0.0, 150.0, -4.61538])
    v = np.r_[np.cross(spin, [0.0, 1.0, 0.0]), spin]
    q = np.r_[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    start = maximal.initial_state(model, q, v)
    run = maximal.integrate(model, start, 2.0, rtol=1e-10, atol=1e-12)
    known = [float(x) for x in case["com_position(2s)"]]
    assert run.states[-1].position[0] == pytest.approx(known, abs=1e-7)
    energy = [maximal.energy(model, s).total for s in run.states]
    assert energy[1] == pytest.approx(energy[0], rel=1e-10)
    at = model.kinematics(run.states[-1])
    assert largest(model.constraints(run.states[-1], at).root.violation) < 1e-12


def double_pendulum() -> maximal.MaximalModel:
    """HC13: femur and tibia on a fixed trunk, both along x at zero angles, axes along -y."""
    m1, c1, l1, j1, m2, c2, j2 = (
        float(x)
        for x in CASES["HC13_double_pendulum"]["ref"]["seed_leg_femur_tibia"][
            "params_m1,c1,l1,J1,m2,c2,J2"
        ]
    )
    joint = (
        '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/>'
        '<origin xyz="{3} 0 0"/><axis xyz="0 -1 0"/></joint>'
    )
    text = (
        f'<robot name="leg">{link("trunk", 1.0, (1.0, 1.0, 1.0))}'
        f"{link('femur', m1, (j1, j1, j1), f'{c1} 0 0')}"
        f"{link('tibia', m2, (j2, j2, j2), f'{c2} 0 0')}"
        f"{joint.format('hip', 'trunk', 'femur', 0.0)}{joint.format('knee', 'femur', 'tibia', l1)}"
        "</robot>"
    )
    return maximal.MaximalModel(maximal.read_bodies(text), root=maximal.RootConstraint.fixed())


def test_double_pendulum() -> None:
    """HC13: released level; absolute angles from the downward vertical after 1 s to 1e-8."""
    model = double_pendulum()
    start = maximal.initial_state(model, np.r_[np.zeros(6), 1.0, 0.0, 0.0], np.zeros(8))
    run = maximal.integrate(model, start, 1.0, rtol=1e-11, atol=1e-13)
    known = [
        float(x)
        for x in CASES["HC13_double_pendulum"]["ref"]["seed_leg_femur_tibia"][
            "theta1,theta2,dtheta1,dtheta2 at 1s"
        ]
    ]
    first, rate = run.q[-1, 7] + np.pi / 2, run.v[-1, 6]
    found = [first, first + run.q[-1, 8], rate, rate + run.v[-1, 7]]
    assert found == pytest.approx(known, abs=1e-8)
    assert np.abs(run.q[-1, :7] - np.r_[np.zeros(6), 1.0]).max() < 1e-15


# --- contact ------------------------------------------------------------------------------------


def compare_motion(
    scene: hp.Scene, posture: np.ndarray, start: hp.State, duration: float, rtol: float,
    accuracy: float = 1e-10,
) -> float:  # fmt: skip
    """Return the largest difference of the last positions [m, rad] from the core's DOP853."""
    twin, control = maximal_twin(scene), hp.HoldPosture(posture)
    plan = SetPoints(control.plan(scene.robot, duration))

    def wanted(time: float) -> tuple[np.ndarray, np.ndarray]:
        q, v, _ = plan(time)
        return q[twin.order], v[twin.order]

    q, v = twin.bodies_order(start.q, 7), twin.bodies_order(start.v, 6)
    run = maximal.integrate(
        twin.model, maximal.initial_state(twin.model, q, v), duration, set_points=wanted,
        rtol=rtol, atol=1e-2 * rtol,
    )  # fmt: skip
    trace = hp.simulate(
        scene, control, duration=duration, sample=duration, initial=start, method="dop853",
        accuracy=accuracy,
    )  # fmt: skip
    return position_difference(twin.robot_order(run.q, 7), trace.q)


@pytest.mark.slow
def test_drop_equals_the_core() -> None:
    """HC40 soft until all feet have touched: positions of the core's DOP853 at 1e-10.

    The last touches at 0.09 s. The touch-downs are located and the rest is smooth.
    """
    scene, start, posture = vehicles.drop(vehicles.hexa_ref())
    apart = compare_motion(scene, posture, start, duration=0.1, rtol=5e-6)
    assert apart < 1e-7


def test_laws_with_memory_equal_the_core() -> None:
    """Restitution and bristles through touch-downs: touch speeds at the very moment, slip, lift.

    1e-7: rtol 1e-7 leaves some 1e-8 here, the core is asked for 1e-9.
    """
    scene, start, posture = vehicles.drop(vehicles.hexa_ref())
    contact = hp.Contact(
        normal=hp.contact.Restitution(stiffness=1e5, restitution=0.5),
        friction=hp.contact.StickSlip(mu=0.5, stiffness=5e3, damping=20.0),
    )
    scene = hp.Scene(scene.robot, contact=contact, servo=scene.servos, stops=scene.joint_stops)
    twin, q, v = maximal_twin(scene), start.q.copy(), start.v.copy()
    v[2] -= 0.3
    state = maximal.initial_state(twin.model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
    q[2] -= twin.model.gaps(0.0, state).min() - 2e-4
    start = scene.robot.check_state(q, v)
    apart = compare_motion(scene, posture, start, duration=0.06, rtol=1e-7, accuracy=1e-9)
    assert apart < 1e-7


# Joints that drift apart, and what brings them back.


@cache
def drifting(
    baumgarte: maximal.Baumgarte, projected: bool, step: float = 2e-3
) -> maximal.MaximalRun:
    """HC14b for 0.2 s by RK4."""
    model, q, v, _ = flight()
    model.baumgarte = baumgarte
    return maximal.integrate(
        model, maximal.initial_state(model, q, v), 0.2, step=step, projected=projected
    )


def test_joints_stay_closed_by_baumgarte_and_by_projection() -> None:
    """Constant terms hold the drift down; projection ends it; without, it is of the fourth order.

    Terms of size 1/h do not go with RK4: its inner stages leave the joints open by O(h^2), which
    1/h^2 turns into accelerations of O(1). They are of order 2 then.
    """
    preset = maximal.Baumgarte
    off = drifting(preset.off(), False)
    assert drifting(preset.constant(), False).drift < 0.9 * off.drift
    assert drifting(preset.by_step(2e-3), False).drift > 100.0 * off.drift
    projected = drifting(preset.off(), True)
    assert projected.drift < 1e-12 and projected.drift_rate < 1e-12
    off = maximal.Baumgarte.off()
    coarse, fine = (drifting(off, False, step).drift for step in (4e-3, 2e-3))
    assert np.log2(coarse / fine) == pytest.approx(4.0, abs=0.5)


def test_what_cannot_be_integrated_is_refused() -> None:
    """Alpha = beta = 4/h is beyond RK4's 2.78/h; times that do not fit."""
    with refused(hp.errors.DivergenceError, about=("finite",)):
        with np.errstate(all="ignore"):
            drifting(maximal.Baumgarte.critical(4.0 / 2e-3), False)
    model, q, v, _ = flight()
    start = maximal.initial_state(model, q, v)
    with refused(hp.errors.ParameterError, "sample or step", 0.3):
        maximal.integrate(model, start, 1.0, step=0.3)
    with refused(hp.errors.ParameterError, "duration", -1.0):
        maximal.integrate(model, start, -1.0)


def test_projection_keeps_momentum_and_returns_to_the_joints() -> None:
    """A state opened by 1 mm: closed to 1e-13; momentum moves by rounding alone."""
    model, q, v, _ = flight()
    state, rng = maximal.initial_state(model, q, v), np.random.default_rng(4)
    opened = type(state)(
        state.position + 1e-3 * rng.normal(size=state.position.shape),
        state.quaternion,
        state.velocity + 0.1 * rng.normal(size=state.velocity.shape),
    )
    closed = maximal.project(model, opened)
    joints = model.constraints(closed, model.kinematics(closed))
    assert largest(joints.violation) < 1e-13 and largest(joints.rate) < 1e-12
    before, after = (maximal.energy(model, s) for s in (opened, closed))
    assert np.abs(after.momentum - before.momentum).max() < 1e-12
    assert np.abs(after.center_of_mass - before.center_of_mass).max() < 1e-9  # Newton's second step
    again = maximal.project(model, closed)
    assert largest(again.position - closed.position) < 1e-13


def test_state_goes_round() -> None:
    """Base pose and joint angles to bodies and back, one joint beyond half a turn."""
    model, q, v, _ = flight()
    q[9] = 4.0
    state = maximal.initial_state(model, q, v)
    angles = state.memory.unwrapped(model.kinematics(state).angle)
    back = configuration(model.bodies, state, angles)
    assert back == pytest.approx(q, abs=1e-14)
    turn = rotations(state.quaternion[:1])[0]
    assert state.velocity[0, 3:] == pytest.approx(turn @ v[3:6], abs=1e-14)
