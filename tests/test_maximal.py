"""S1's equations in maximal coordinates: against the core, differences, dense algebra, statics."""

from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest
import vehicles
from contact_formulas import FRICTION, NORMAL
from refusals import refused
from scipy.spatial.transform import Rotation

import hexapod_pin as hp
from hexapod_pin.formulations import maximal
from hexapod_pin.formulations.maximal import MaximalState, initial_state
from hexapod_pin.formulations.maximal import model as equations
from hexapod_pin.robot.rotations import quaternion_products, rotations, turned_quaternions
from hexapod_pin.validation.checks.maximal_checks import (
    compare_accelerations,
    maximal_twin,
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


def robot_of(name: str) -> hp.Robot:
    return vehicles.hexa_ref() if name == "hexa_ref" else hp.load_robot(name)


# --- against the core ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "contact"), [("kharagpur", "s1"), ("athena", "s2"), ("hexa_ref", "s1")]
)
def test_accelerations_equal_the_core(name: str, contact: str) -> None:
    """200 random states with contacts over the six combinations.

    1e-9 is wanted; both sides are sums of some 1e3 terms of rounding 1e-16 and condition 1e1 to
    1e2, so 1e-12 is what a right formula keeps.
    """
    scene = hp.Scene(robot_of(name), contact=hp.Contact.preset(contact))
    states = pressed_states(scene, 34)
    assert compare_accelerations(scene, states) < 1e-12
    twin = maximal_twin(scene)
    q, v, _ = states[0]
    state = initial_state(twin.model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
    assert (twin.model.gaps(0.0, state) < 0.0).sum() >= 5  # the states do press on the ground


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
    """Joints beyond their limits, moving outwards and inwards."""
    robot = vehicles.hexa_ref()
    scene = hp.Scene(robot, contact=hp.Contact.s1())
    states = [(q.copy(), v, torque) for q, v, torque in pressed_states(scene, 4)]
    for k, (q, _, _) in enumerate(states):
        q[7:] = (robot.upper if k % 2 else robot.lower) + 0.01 * (1 if k % 2 else -1)
    assert compare_accelerations(scene, states) < 1e-12


# --- planted errors -----------------------------------------------------------------------------


def minus(function):
    return lambda *given: -function(*given)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("gamma_row_1", minus(equations.gamma_row_1)),
        ("world_inertia", lambda turn, inertia: turn.transpose(0, 2, 1) @ inertia @ turn),
    ],
    ids=["sign of row 1", "transposed axes"],
)
def test_planted_error_is_seen(monkeypatch, name, wrong) -> None:
    """A hundred times the 1e-9 that is allowed, although contacts make the largest part of v'.

    Others are planted in the checks of `verify`.
    """
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1())
    states = pressed_states(scene, 3)
    monkeypatch.setattr(equations, name, wrong)
    assert compare_accelerations(scene, states) > 1e-7


def test_swapped_inertia_axes_are_seen(monkeypatch) -> None:
    """The tibia's moments about x and y exchanged in the URDF that one side reads."""
    scene = hp.Scene(vehicles.hexa_ref(), contact=hp.Contact.s1())
    states = pressed_states(scene, 3)
    old, new = '"9.8446e-05"', '"8.7515e-05"'
    text = scene.robot.urdf
    assert text.count(old) == 6
    swapped = text.replace(old, "OLD").replace(new, old).replace("OLD", new)
    object.__setattr__(scene.robot, "urdf", swapped)
    assert compare_accelerations(scene, states) > 1e-7


# --- nothing shared -----------------------------------------------------------------------------


def test_flat_ground_needs_neither_pinocchio_nor_the_core() -> None:
    """One evaluation with contacts in a fresh interpreter: neither is loaded."""
    script = """
import sys
from pathlib import Path
import numpy as np
from hexapod_pin.ground.contact import Contact
from hexapod_pin.formulations import maximal
from hexapod_pin.ground.terrain import Flat
bodies = maximal.read_bodies(Path(sys.argv[1]).read_text(), ["lf_foot"])
model = maximal.MaximalModel(bodies, contact=maximal.GroundContact(bodies, Contact.s1(), Flat()))
state = maximal.initial_state(model, np.r_[np.zeros(6), 1.0, np.zeros(18)], np.zeros(24))
found = maximal.derivative(model, state, np.zeros(18))
assert np.isfinite(found.acceleration).all()
print([name for name in ("pinocchio", "hexapod_pin.native") if name in sys.modules])
"""
    path = str(hp.urdf_path("kharagpur"))
    done = subprocess.run(
        [sys.executable, "-c", script, path], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


# by themselves --------------------------------------------------------------------------------


def pendulum(*, com: str = "0.1 0.03 0", damping: float = 0.0) -> str:
    """A base and one link of 2 kg on an axis along y."""
    inertia = '<inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/>'
    return (
        f'<robot name="p"><link name="base"><inertial><mass value="1"/>{inertia}</inertial></link>'
        f'<link name="arm"><inertial><origin xyz="{com}"/><mass value="2"/>{inertia}</inertial>'
        '</link><joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/>'
        f'<origin xyz="0 0 0.5"/><axis xyz="0 3 0"/><dynamics damping="{damping}"/></joint></robot>'
    )


# --- the equations themselves -------------------------------------------------------------------


def test_constraint_acceleration_equals_second_differences() -> None:
    """Phi'' = D v' - gamma for bodies that move at random, joints open or not."""
    rng = np.random.default_rng(1)
    bodies = maximal.read_bodies(hp.load_robot("kharagpur").urdf)
    model, n = maximal.MaximalModel(bodies), len(bodies.mass)
    closed = initial_state(model, np.r_[np.zeros(6), 1.0, rng.normal(size=18)], np.zeros(24))
    quaternion = turned_quaternions(closed.quaternion, 0.1 * rng.normal(size=(n, 3)))
    velocity, rate = rng.normal(size=(2, n, 6))

    def violation(h: float) -> np.ndarray:
        """Phi at t = h: the commutator of w and w' enters only with h^3, and cancels."""
        shift = h * velocity + 0.5 * h * h * rate
        state = MaximalState(
            closed.position + shift[:, :3], turned_quaternions(quaternion, shift[:, 3:]), velocity
        )
        return model.constraints(state, model.kinematics(state)).violation

    h = 1e-4
    state = MaximalState(closed.position, quaternion, velocity)
    found = model.constraints(state, model.kinematics(state))
    along = np.einsum("nij,nj->ni", found.on_child, rate[1:])
    along += np.einsum("nij,nj->ni", found.on_parent, rate[bodies.parent])
    second = (violation(h) - 2.0 * violation(0.0) + violation(-h)) / h**2
    assert np.abs(second - (along - found.gamma)).max() < 1e-6  # h^2 and 1e-16/h^2
    first = (violation(h) - violation(-h)) / (2.0 * h)
    assert np.abs(first - found.rate).max() < 1e-7


@pytest.mark.parametrize(
    "root",
    [
        maximal.RootConstraint.free(),
        maximal.RootConstraint.fixed(),
        maximal.RootConstraint.spherical((0.1, 0.2, 0.3), (0, 0, 0)),
    ],
    ids=["free", "fixed", "held at a point"],
)
def test_elimination_equals_the_dense_system(root: maximal.RootConstraint) -> None:
    """All 204 (210) equations at once by LU, at a state with open joints and Baumgarte's terms."""
    rng = np.random.default_rng(2)
    bodies = maximal.read_bodies(hp.load_robot("athena").urdf)
    model = maximal.MaximalModel(bodies, root=root, baumgarte=maximal.Baumgarte.critical(20.0))
    state = initial_state(model, np.r_[np.zeros(6), 1.0, rng.normal(size=18)], rng.normal(size=24))
    state = MaximalState(
        state.position + 1e-3 * rng.normal(size=(19, 3)), state.quaternion, state.velocity
    )
    at = model.kinematics(state)
    joints = model.constraints(state, at)
    force = rng.normal(size=(19, 6))
    wanted, hold = rng.normal(size=(18, 5)), rng.normal(size=root.size)
    found = model.solve_kkt(at.mass, force, joints, wanted, hold)
    across = np.zeros((90 + root.size, 114))
    for j, parent in enumerate(bodies.parent):
        across[5 * j : 5 * j + 5, 6 * parent : 6 * parent + 6] = joints.on_parent[j]
        across[5 * j : 5 * j + 5, 6 * j + 6 : 6 * j + 12] = joints.on_child[j]
    across[90:, :6] = joints.root.rows
    mass = np.zeros((114, 114))
    for k in range(19):
        mass[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = at.mass[k]
    full = np.block([[mass, -across.T], [across, np.zeros((len(across),) * 2)]])
    answer = np.linalg.solve(full, np.r_[force.ravel(), wanted.ravel(), hold])
    parts = np.concatenate([part.ravel() for part in found])
    assert np.abs(parts - answer).max() < 1e-9 * np.abs(answer).max()  # condition 1e6 of the whole


def test_rotation_algebra() -> None:
    """Matrices, products and turns against SciPy's; a turn of the world's axes from the left."""
    rng = np.random.default_rng(3)
    q = rng.normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    q[:3] = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]
    known, other = Rotation.from_quat(q), Rotation.from_quat(q[::-1])
    assert np.abs(rotations(3.0 * q) - known.as_matrix()).max() < 1e-14
    assert np.abs(quaternion_products(q, q[::-1]) - (known * other).as_quat()).max() < 1e-14
    quarter = turned_quaternions(np.array([[0.0, 0, 0, 1]]), np.array([[0, 0, np.pi / 2]]))
    assert np.abs(rotations(quarter)[0] @ [1, 0, 0] - [0, 1, 0]).max() < 1e-15


# --- bodies and reactions -----------------------------------------------------------------------


def test_bodies_of_a_hexapod() -> None:
    """19 bodies, three levels of six joints, the weight of the robot; presets of Baumgarte."""
    robot = hp.load_robot("kharagpur")
    bodies = maximal.read_bodies(robot.urdf, [foot.name for foot in robot.feet])
    assert len(bodies.mass) == 19 and sorted(bodies.joint_names) == sorted(robot.joint_names)
    assert [level.stop - level.start for level in bodies.levels] == [6, 6, 6]
    assert bodies.mass.sum() == pytest.approx(robot.total_mass, rel=1e-14)
    assert [foot.radius for foot in bodies.feet] == [foot.radius for foot in robot.feet]
    assert (maximal.Baumgarte.off().alpha, maximal.Baumgarte.off().beta) == (0.0, 0.0)
    assert maximal.Baumgarte.by_step(1e-3).alpha == pytest.approx(1e3)
    assert maximal.Baumgarte.by_step(1e-3).beta == pytest.approx(np.sqrt(2.0) * 1e3)
    assert maximal.Baumgarte.constant() == maximal.Baumgarte.critical(5.0)
    with refused(hp.errors.ParameterError, "step", 0.0):
        maximal.Baumgarte.by_step(0.0)


def test_what_cannot_be_computed_is_refused() -> None:
    """By its URDF, or by its laws and ground."""
    slides = pendulum().replace("continuous", "prismatic")
    with refused(hp.errors.UrdfError, source="p", about=("'hinge'", "prismatic")):
        maximal.read_bodies(slides)
    with refused(hp.errors.UrdfError, source="maximal coordinates", about=("'arm'", "mass 0")):
        maximal.read_bodies(pendulum().replace('<mass value="2"/>', '<mass value="0"/>'))
    with refused(hp.errors.UnknownNameError, kind="foot link", name="nofoot"):
        maximal.read_bodies(pendulum(), ["nofoot"])
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


@pytest.mark.parametrize("kind", ["continuous", "fixed"])
def test_an_origin_that_is_left_out_is_the_identity(kind: str) -> None:
    """As URDF's specification says, of joints that turn and of fixed ones."""
    text = pendulum().replace("continuous", kind)
    given = text.replace('<origin xyz="0 0 0.5"/>', '<origin xyz="0 0 0" rpy="0 0 0"/>')
    left_out = text.replace('<origin xyz="0 0 0.5"/>', "")
    assert given.count("<origin") == left_out.count("<origin") + 1
    one, two = maximal.read_bodies(given), maximal.read_bodies(left_out)
    for name in ("mass", "inertia", "root_origin", "place", "attitude", "child_place"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_bearing_of_a_hanging_arm() -> None:
    """Hanging still under its hinge, 3 cm aside along the axis: m g up, and m g 0.03 of tilting.

    The arm's centre hangs at rest where x = 0.1 points down: angle 90 degrees about y.
    """
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
    """Newton and Euler for each tibia alone, about its centre, on a moving robot in contact."""
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
