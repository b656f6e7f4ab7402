"""S1's equations in maximal coordinates, and runs in them: the core, statics, known answers."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
import vehicles
from contact_formulas import FRICTION, NORMAL
from refusals import refused
from scipy.spatial.transform import Rotation

import hexapod_pin as hp
from hexapod_pin.formulations import maximal
from hexapod_pin.formulations.maximal import initial_state
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.robot.rotations import quaternion_products, rotations, turned_quaternions
from hexapod_pin.validation.checks.maximal_checks import (
    compare_accelerations,
    maximal_twin,
    position_difference,
    pressed_states,
)

TERRAINS = {
    "slope": hp.Slope(angle=0.2, heading=0.7),
    "stairs": hp.Stairs(rise=0.03, run=0.15, count=4, start=-0.3),
    "groove": hp.terrain.Groove(angle_left=0.4, angle_right=0.3, depth=0.04),
    "hills": hp.HeightField.random(3, amplitude=0.01),
    "patched": hp.terrain.PatchedGround(
        ground=hp.Slope(angle=0.1),
        patches=(hp.terrain.Patch(low=(-9, 0), high=(9, 9), friction=0.5, stiffness=2),),
    ),
    "shaken": hp.terrain.ShakingGround(amplitude=2e-3, frequency=12.0),
}


FRICTIONS = {**FRICTION, "stick-slip": hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)}


@pytest.mark.parametrize(
    ("normal", "friction"),
    [pair for k, pair in enumerate(itertools.product(NORMAL, FRICTIONS)) if k % 4 == 0],
)
def test_every_law_equals_the_core(normal: str, friction: str) -> None:
    """First touch: touch speed that of the state, bristles at rest."""
    contact = hp.Contact(normal=NORMAL[normal], friction=FRICTIONS[friction])
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact)
    assert compare_accelerations(scene, pressed_states(scene, 2)) < 1e-11


@pytest.mark.parametrize("terrain", TERRAINS)
def test_every_ground_equals_the_core(terrain: str) -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1(), terrain=TERRAINS[terrain])
    assert compare_accelerations(scene, pressed_states(scene, 4)) < 1e-11


def test_joint_stops_and_damping_equal_the_core() -> None:
    robot = vehicles.hexa_ref()
    scene = hp.Scene(robot, contact=hp.Contact.s1())
    states = [(q.copy(), v, torque) for q, v, torque in pressed_states(scene, 4)]
    for k, (q, _, _) in enumerate(states):
        q[7:] = (robot.upper if k % 2 else robot.lower) + 0.01 * (1 if k % 2 else -1)
    assert compare_accelerations(scene, states) < 1e-12


def pendulum() -> str:
    inertia = '<inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/>'
    return (
        f'<robot name="p"><link name="base"><inertial><mass value="1"/>{inertia}</inertial></link>'
        '<link name="arm"><inertial><origin xyz="0.1 0.03 0"/><mass value="2"/>'
        f'{inertia}</inertial></link><joint name="hinge" type="continuous"><parent link="base"/>'
        '<child link="arm"/><origin xyz="0 0 0.5"/><axis xyz="0 3 0"/></joint></robot>'
    )


def test_rotation_algebra() -> None:
    rng = np.random.default_rng(3)
    q = rng.normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    q[:3] = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]
    known, other = Rotation.from_quat(q), Rotation.from_quat(q[::-1])
    assert np.abs(rotations(3.0 * q) - known.as_matrix()).max() < 1e-14
    assert np.abs(quaternion_products(q, q[::-1]) - (known * other).as_quat()).max() < 1e-14
    quarter = turned_quaternions(np.array([[0.0, 0, 0, 1]]), np.array([[0, 0, np.pi / 2]]))
    assert np.abs(rotations(quarter)[0] @ [1, 0, 0] - [0, 1, 0]).max() < 1e-15


def test_what_cannot_be_computed_is_refused() -> None:
    slides = pendulum().replace("continuous", "prismatic")
    with refused(hp.errors.UrdfError, source="p", about=("'hinge'", "prismatic")):
        maximal.read_bodies(slides)
    with refused(hp.errors.UrdfError, source="maximal coordinates", about=("'arm'", "mass 0")):
        maximal.read_bodies(pendulum().replace('<mass value="2"/>', '<mass value="0"/>'))
    with refused(hp.errors.UnknownNameError, kind="foot link", name="nofoot"):
        maximal.read_bodies(pendulum(), ["nofoot"])
    by_step = maximal.Baumgarte.by_step(1e-3)
    assert (by_step.alpha, by_step.beta) == pytest.approx((1e3, np.sqrt(2.0) * 1e3))
    with refused(hp.errors.ParameterError, "step", 0.0):
        maximal.Baumgarte.by_step(0.0)
    bodies = maximal.read_bodies(pendulum(), ["arm"])
    stiff = hp.Contact(
        normal=hp.contact.HuntCrossley(stiffness=1e5),
        friction=hp.contact.StickSlip(mu=0.5, stiffness=1e4, damping=0),
    )
    with refused(hp.errors.ParameterError, "StickSlip.damping", 0.0):
        maximal.GroundContact(bodies, stiff, hp.Flat())
    with refused(hp.errors.ParameterError, "contact", "Stairs"):
        maximal.GroundContact(
            bodies, hp.Contact.accurate(), hp.Stairs(rise=0.03, run=0.15, count=4)
        )


def test_an_origin_that_is_left_out_is_the_identity() -> None:
    text = pendulum()
    given = text.replace('<origin xyz="0 0 0.5"/>', '<origin xyz="0 0 0" rpy="0 0 0"/>')
    left_out = text.replace('<origin xyz="0 0 0.5"/>', "")
    assert given.count("<origin") == left_out.count("<origin") + 1
    one, two = maximal.read_bodies(given), maximal.read_bodies(left_out)
    for name in ("mass", "inertia", "root_origin", "place", "attitude", "child_place"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_bearing_of_a_hanging_arm() -> None:
    """Hanging still under its hinge, 3 cm aside along the axis: m g up, and m g 0.03 of tilting."""
    bodies = maximal.read_bodies(pendulum())
    model = maximal.MaximalModel(bodies, root=maximal.RootConstraint.fixed())
    state = initial_state(model, np.r_[np.zeros(6), 1.0, np.pi / 2], np.zeros(7))
    found = maximal.derivative(model, state, np.zeros(1))
    assert np.abs(found.acceleration).max() < 1e-13
    load = 2.0 * 9.81
    world = maximal.joint_reactions(model, found, "world")["hinge"]
    assert world.force == pytest.approx([0, 0, load], abs=1e-12)
    assert world.moment == pytest.approx([0.03 * load, 0, 0], abs=1e-12)  # the arm pulls -x
    child = maximal.joint_reactions(model, found, "child")["hinge"]
    assert child.force == pytest.approx([-load, 0, 0], abs=1e-12)  # its x axis points down
    assert (child.axial, child.radial, child.tilting) == pytest.approx((0, load, 0.03 * load))
    assert found.support[:3] == pytest.approx([0, 0, 3.0 * 9.81], abs=1e-12)
    with refused(hp.errors.UnknownNameError, kind="frame", name="hinge"):
        maximal.joint_reactions(model, found, "hinge")


def test_reactions_balance_the_last_link() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1())
    twin, (q, v, torque) = maximal_twin(scene), pressed_states(scene, 1)[0]
    model = twin.model
    state = initial_state(model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
    found = maximal.derivative(model, state, torque[twin.order])
    reactions = maximal.joint_reactions(model, found, "world")
    turn = rotations(state.quaternion)
    for k, foot in enumerate(model.bodies.feet):
        b, mass = foot.body, model.bodies.mass[foot.body]
        joint = reactions[model.bodies.joint_names[b - 1]]
        push, inertia = found.contacts.force[k], turn[b] @ model.bodies.inertia[b] @ turn[b].T
        rest = mass * (found.acceleration[b, :3] - model.gravity) - push - joint.force
        assert np.abs(rest).max() < 1e-9
        spin, arm = state.velocity[b, 3:], turn[b] @ model.bodies.child_place[b - 1]
        point = turn[b] @ foot.offset - [0.0, 0.0, foot.radius]
        moment = joint.moment + joint.drive * joint.axis + np.cross(arm, joint.force)
        moment += np.cross(point, push) - np.cross(spin, inertia @ spin)
        assert np.abs(moment - inertia @ found.acceleration[b, 3:]).max() < 1e-9


CASES = vehicles.HARD_CASES


def flight() -> tuple[maximal.MaximalModel, np.ndarray, np.ndarray, np.ndarray]:
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
    """HC14b: its 0.5 s state; energy and momentum to 1e-10, joints closed."""
    model, q, v, order = flight()
    case = CASES["HC14b_hexapod_flight"]["ref"]
    run = maximal.integrate(
        model, maximal.initial_state(model, q, v), 0.5, sample=0.25, rtol=3e-10, atol=3e-12
    )
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


def test_laws_with_memory_equal_the_core() -> None:
    """Restitution and bristles through touch-downs: touch speeds at the very moment, slip, lift."""
    duration, rtol = 0.06, 1e-7
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
    start, control = scene.robot.check_state(q, v), hp.HoldPosture(posture)
    plan = SetPoints(control.plan(scene.robot, duration))

    def wanted(time: float) -> tuple[np.ndarray, np.ndarray]:
        q, v, _ = plan(time)
        return q[twin.order], v[twin.order]

    state = maximal.initial_state(twin.model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
    run = maximal.integrate(
        twin.model, state, duration, set_points=wanted, rtol=rtol, atol=1e-2 * rtol
    )
    trace = hp.simulate(
        scene, control, duration=duration, sample=duration, initial=start, method="dop853",
        accuracy=1e-9,
    )  # fmt: skip
    assert position_difference(twin.robot_order(run.q, 7), trace.q) < 1e-7


@cache
def drifting(
    baumgarte: maximal.Baumgarte, projected: bool, step: float = 2e-3
) -> maximal.MaximalRun:
    model, q, v, _ = flight()
    model.baumgarte = baumgarte
    return maximal.integrate(
        model, maximal.initial_state(model, q, v), 0.2, step=step, projected=projected
    )


def test_joints_drift_apart_and_are_closed_by_projection() -> None:
    """Projection ends the drift; without, it is of the fourth order."""
    preset = maximal.Baumgarte
    off = drifting(preset.off(), False)
    assert drifting(preset.by_step(2e-3), False).drift > 100.0 * off.drift
    projected = drifting(preset.off(), True)
    assert projected.drift < 1e-12 and projected.drift_rate < 1e-12
    model = flight()[0]
    first, last = (maximal.energy(model, projected.states[k]) for k in (0, -1))
    turning = np.abs(last.angular_momentum - first.angular_momentum).max()
    assert turning < 1e-8 * np.abs(first.angular_momentum).max()
    coarse, fine = (drifting(preset.off(), False, step).drift for step in (4e-3, 2e-3))
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
