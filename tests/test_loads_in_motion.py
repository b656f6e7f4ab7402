"""Loads in a run: pushes against momentum, a lost leg, a trunk on the ground."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from method_settings import METHODS
from refusals import refused
from studies.cost.mujoco_twin import MujocoTwin

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot import trunk_points
from hexapod_pin.scene.loaded_model import native_loads
from hexapod_pin.scene.scene import loaded_model
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.validation.checks.maximal_checks import maximal_twin


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def floating(robot: hp.Robot, push: hp.Push, **how) -> hp.Trace:
    state = robot.stand()
    start = robot.check_state(state.q + np.eye(25)[2], state.v)
    scene = hp.Scene(robot, gravity=(0.0, 0.0, 0.0), loads=[push])
    return hp.simulate(scene, hp.HoldPosture(), duration=0.1, initial=start, **how)


def test_a_push_in_free_flight_changes_the_momentum_by_its_impulse(robot):
    """Gravity off, joints limp to 1e-12: what is left is the push."""
    force, torque = np.array([1.0, -2.0, 0.5]), np.array([0.01, 0.02, -0.03])
    push = hp.Push("lf_tibia", force=force, torque=torque, start=0.013, duration=0.05)
    trace = floating(robot, push, method="dop853", accuracy=1e-12, sample=1e-3)
    data = robot.model.createData()
    change = pin.computeCentroidalMomentum(robot.model, data, trace.q[-1], trace.v[-1]).vector
    assert change[:3] == pytest.approx(0.05 * force, abs=1e-12)
    # angular momentum about the origin: the moment of the force about it, by Simpson's rule
    frame = robot.model.getFrameId("lf_tibia")
    moments = []
    for k in range(13, 64):
        pin.framesForwardKinematics(robot.model, data, trace.q[k])
        moments.append(np.cross(data.oMf[frame].translation, force) + torque)
    weights = np.array([1.0] + [4.0, 2.0] * 24 + [4.0, 1.0]) * 1e-3 / 3.0
    about_origin = change[3:] + np.cross(trace.com[-1], change[:3])
    assert about_origin == pytest.approx(weights @ np.array(moments), abs=1e-9)
    assert np.abs(trace.energy_residual).max() < 1e-10
    assert trace.energy["push_work"][-1] > 1e-4


def test_the_push_is_felt_where_it_begins_and_ends(robot):
    push = hp.Push("base_link", force=(3.0, 0.0, 0.0), start=0.0123, duration=0.0345)
    for method, settings in METHODS.items():
        trace = floating(robot, push, method=method, sample=2e-3, **settings)
        acceleration = 3.0 / robot.total_mass
        pushed = np.clip(trace.time - 0.0123, 0.0, 0.0345)
        after = np.clip(trace.time - 0.0123 - 0.0345, 0.0, None)
        travel = acceleration * (0.5 * pushed**2 + 0.0345 * after)
        tolerance = 2e-5 if "step" in settings else 1e-7  # m; order 1: h v / 2
        assert trace.com[:, 0] - trace.com[0, 0] == pytest.approx(travel, abs=tolerance), method


def test_a_lost_leg_gives_no_torque(robot):
    lost = [robot.joint_index(joint) for joint in robot.leg("lm").joints]
    scene = hp.Scene(robot, loads=[hp.LostLeg("lm", start=0.4)])
    for method in ("extrapolated-euler", "ndf", "robust", "implicit-euler"):
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.5, method=method, sample=1e-3, **METHODS[method]
        )
        before, after = trace.time < 0.399, trace.time > 0.401
        assert np.abs(trace.torque[before][-1, lost]).max() > 1e-2, method
        assert not trace.torque[after][:, lost].any(), method
        assert np.abs(trace.torque[-1]).max() > 1e-2, method


def test_a_trunk_on_the_ground_stands_with_body_contact_and_is_reported_without(robot, tmp_path):
    q, trunk = robot.stand().q.copy(), trunk_points(robot)
    femora = [robot.joint_index(leg.joints[1]) for leg in robot.legs]
    q[7:][femora] = robot.lower[femora]  # feet high
    q[2] = 0.002 - np.min(np.asarray(trunk.points)[:, 2] - np.asarray(trunk.radius))
    start, hold = robot.check_state(q, np.zeros(robot.model.nv)), hp.HoldPosture(q[7:])
    scene = hp.Scene(robot, body_contact=True)
    trace = hp.simulate(scene, hold, duration=1.0, initial=start, accuracy=1e-5)
    feet = len(robot.feet)
    weight = robot.total_mass * 9.81
    assert trace.foot_force[-1, feet:].sum(axis=0)[2] == pytest.approx(weight, rel=1e-3)
    assert np.abs(trace.v[-1]).max() < 1e-3
    lowest = trace.q[0, 2] - 0.002
    assert trace.q[-1, 2] == pytest.approx(lowest, abs=1e-3)
    without = hp.simulate(
        hp.Scene(robot), hold, duration=0.05, initial=start, accuracy=1e-5, sample=5e-3
    )
    event = without.events[0]
    assert event.kind == "trunk-contact"
    fall = np.sqrt(2.0 * 0.002 / 9.81)
    assert event.time == pytest.approx(fall, abs=2e-6)  # by a cubic between two accepted states
    assert -0.01 < event.place[2] <= 0.0
    assert without.q[-1, 2] < lowest - 1e-3
    hp.view.write_html(trace, tmp_path / "trunk.html")  # it can be drawn


# loads as data: payloads as part of the model, pushes and lost legs in the core's terms

MOMENTS = (3e-4, 4e-4, 5e-4, 2e-5, -3e-5, 4e-5)
BOX = hp.Payload("base_link", mass=0.8, position=(0.05, -0.02, 0.06), inertia=MOMENTS)
TOOL = hp.Payload("lf_foot", 0.05, (0.01, 0.005, -0.01))  # a link fixed to the tibia


@pytest.fixture
def built(robot: hp.Robot, tmp_path: Path) -> hp.Robot:
    extra = ""
    for k, load in enumerate((BOX, TOOL)):
        xx, yy, zz, xy, xz, yz = load.inertia or (0.0,) * 6
        place = " ".join(map(repr, load.position))
        extra += (
            f'<link name="load{k}"><inertial><mass value="{load.mass!r}"/><inertia ixx="{xx}" '
            f'iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial></link>'
            f'<joint name="load{k}_fix" type="fixed"><parent link="{load.link}"/>'
            f'<child link="load{k}"/><origin xyz="{place}" rpy="0 0 0"/></joint>'
        )
    path = tmp_path / "loaded.urdf"
    path.write_text(robot.urdf.replace("</robot>", extra + "</robot>"))
    return hp.load_robot(path)


def test_a_payload_equals_the_robot_built_with_it(robot: hp.Robot, built: hp.Robot) -> None:
    scene = hp.Scene(robot, loads=[BOX, TOOL])
    theirs = hp.Scene(built, servo=scene.servo, stops=scene.stops)
    model = loaded_model(scene)
    rng = np.random.default_rng(3)
    for _ in range(3):
        q = np.concatenate([rng.normal(size=3) + [0, 0, 5], rng.normal(size=4), robot.posture])
        q[3:7] /= np.linalg.norm(q[3:7])
        q[7:] += 0.3 * rng.normal(size=18)
        v = rng.normal(size=24)
        data, other = model.createData(), built.model.createData()
        biases = (
            pin.nonLinearEffects(model, data, q, v),
            pin.nonLinearEffects(built.model, other, q, v),
        )
        np.testing.assert_allclose(*biases, rtol=1e-12, atol=1e-12)
        energies = [pin.computePotentialEnergy(m, m.createData(), q) for m in (model, built.model)]
        assert energies[0] == pytest.approx(energies[1], rel=1e-12)
        ours, wanted = (
            native.evaluate(native_plant(s), q, v, np.zeros(18)) for s in (scene, theirs)
        )
        for name in ("mass", "com"):
            np.testing.assert_allclose(ours[name], wanted[name], rtol=0, atol=1e-12)


def test_the_robots_own_model_is_left_alone(robot: hp.Robot) -> None:
    before = [body.mass for body in robot.model.inertias]
    scene = hp.Scene(robot, loads=[BOX])
    assert loaded_model(scene) is loaded_model(hp.Scene(robot, loads=[BOX]))  # built once
    assert loaded_model(hp.Scene(robot)) is robot.model
    assert [body.mass for body in robot.model.inertias] == before
    assert scene.total_mass == pytest.approx(robot.total_mass + 0.8, rel=1e-15)
    loads = [BOX, TOOL, hp.Push("lf_tibia", force=(0, 0, 1), start=0, duration=1)]
    scene = hp.Scene(robot, loads=[*loads, hp.LostLeg("lf", 0.5)], body_contact=True)
    again = hp.Scene.from_toml(scene.to_toml())
    assert (again.loads, again.body_contact) == (scene.loads, True)
    assert again.to_toml() == scene.to_toml()
    assert "body contact: the trunk is as large as it is drawn" in scene.assumed
    assert "payload of 0.05 kg on lf_foot: a point mass" in scene.assumed
    assert hp.Payload("base_link", 0.8, inertia=BOX.inertia_matrix).inertia == MOMENTS


def test_loads_in_the_cores_terms(robot: hp.Robot) -> None:
    push = hp.Push("rr_foot", (0.0, 0.01, 0.0), force=(1.0, 2.0, 3.0), start=0.1, duration=0.25)
    scene = hp.Scene(robot, loads=[push, BOX, hp.LostLeg("rm", 2.0)])
    found = native_loads(scene.robot, scene.settings)
    joint, point, force, torque, start, end = found.pushes[0]
    assert joint == robot.model.getJointId("rr_tibia_joint")
    np.testing.assert_allclose(point, [0.09879, 0.01, 0.0], atol=1e-15)
    assert (force.tolist(), torque.tolist()) == ([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    assert (start, end) == (0.1, 0.35)
    names = [robot.joint_names[k] for k in found.lost[0][0]]
    assert (names, found.lost[0][1]) == (list(robot.leg("rm").joints), 2.0)
    assert not found.body_points and len(found.trunk_points) == len(trunk_points(robot).names)


@pytest.mark.parametrize(
    ("build", "name"),
    [
        (lambda: hp.Payload("a", 0.0), "Payload.mass"),
        (lambda: hp.Payload("a", 1.0, inertia=np.diag([1.0, 1.0, 2.1])), "Payload.inertia"),
        (lambda: hp.Payload("a", 1.0, inertia=np.triu(np.ones((3, 3)))), "Payload.inertia"),
        (lambda: hp.Push("a", start=0.0, duration=1.0), "Push.force"),
        (lambda: hp.Push("a", force=(0, 0, 1), start=0.0, duration=0.0), "Push.duration"),
    ],
)
def test_impossible_numbers_are_refused_by_name(build, name: str) -> None:
    with refused(ParameterError, name):
        build()


def test_unknown_links_and_formulations_without_loads_are_refused(robot: hp.Robot) -> None:
    with refused(UnknownNameError, kind="link (Scene.loads[1].link)", name="luggage"):
        hp.Scene(robot, loads=[BOX, hp.Payload("luggage", 1.0)])
    with refused(UnknownNameError, kind="leg (Scene.loads[0].leg)", name="seventh"):
        hp.Scene(robot, loads=[hp.LostLeg("seventh", 1.0)])
    with refused(ParameterError, "Scene.loads[1].leg", "lf"):
        hp.Scene(robot, loads=[hp.LostLeg("lf", 1.0), hp.LostLeg("lf", 2.0)])
    for scene, name, value in (
        (hp.Scene(robot, loads=[BOX]), "Scene.loads", "payload"),
        (hp.Scene(robot, body_contact=True), "Scene.body_contact", True),
    ):
        with refused(ParameterError, name, value, about=("maximal",)):
            maximal_twin(scene)
        with refused(ParameterError, name, value, about=("MuJoCo",)):
            MujocoTwin(scene, None)  # type: ignore[arg-type]
