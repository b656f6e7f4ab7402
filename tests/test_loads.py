"""Loads as data: payloads as part of the model, pushes and lost legs in the core's terms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from studies.cost.mujoco_twin import MujocoTwin

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.link_shapes import trunk_points
from hexapod_pin.scene.loaded_model import native_loads
from hexapod_pin.scene.scene import loaded_model
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.validation.checks.maximal_checks import maximal_twin

MOMENTS = (3e-4, 4e-4, 5e-4, 2e-5, -3e-5, 4e-5)
BOX = hp.Payload("base_link", mass=0.8, position=(0.05, -0.02, 0.06), inertia=MOMENTS)
TOOL = hp.Payload("lf_foot", 0.05, (0.01, 0.005, -0.01))  # a link fixed to the tibia


@pytest.fixture
def built(robot: hp.Robot, tmp_path: Path) -> hp.Robot:
    """The robot whose URDF has each payload as a link of its own on a fixed joint."""
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


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def test_a_payload_equals_the_robot_built_with_it(robot: hp.Robot, built: hp.Robot) -> None:
    """M, bias and potential energy, by Pinocchio and in the core; 1e-12 is rounding."""
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
        np.testing.assert_allclose(
            pin.crba(model, data, q), pin.crba(built.model, other, q), rtol=0, atol=1e-12
        )
        np.testing.assert_allclose(
            pin.nonLinearEffects(model, data, q, v),
            pin.nonLinearEffects(built.model, other, q, v),
            rtol=1e-12, atol=1e-12,
        )  # fmt: skip
        energies = [pin.computePotentialEnergy(m, m.createData(), q) for m in (model, built.model)]
        assert energies[0] == pytest.approx(energies[1], rel=1e-12)
        ours, wanted = (
            native.evaluate(native_plant(s), q, v, np.zeros(18)) for s in (scene, theirs)
        )
        np.testing.assert_allclose(ours["mass"], wanted["mass"], rtol=0, atol=1e-12)
        np.testing.assert_allclose(ours["com"], wanted["com"], rtol=0, atol=1e-12)


def test_the_robots_own_model_is_left_alone(robot: hp.Robot) -> None:
    """Loads survive the text; a scene without them is written as it always was."""
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
    assert not {"loads", "body_contact"} & set(hp.Scene(robot).to_dict())
    assert "body contact: the trunk is as large as it is drawn" in scene.assumed
    assert "payload of 0.05 kg on lf_foot: a point mass" in scene.assumed
    assert hp.Payload("base_link", 0.8, inertia=BOX.inertia_matrix).inertia == MOMENTS


def test_loads_in_the_cores_terms(robot: hp.Robot) -> None:
    """A push on a link fixed to the tibia acts on the tibia's joint, 98.79 mm down its x axis."""
    push = hp.Push("rr_foot", (0.0, 0.01, 0.0), force=(1.0, 2.0, 3.0), start=0.1, duration=0.25)
    twist = hp.Push("base_link", torque=(0.0, 0.0, 0.5), start=0.0, duration=1.0)
    scene = hp.Scene(robot, loads=[push, BOX, twist, hp.LostLeg("rm", 2.0)])
    found = native_loads(scene.robot, scene.settings)
    joint, point, force, torque, start, end = found.pushes[0]
    assert joint == robot.model.getJointId("rr_tibia_joint")
    np.testing.assert_allclose(point, [0.09879, 0.01, 0.0], atol=1e-15)
    assert (force.tolist(), torque.tolist()) == ([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    assert (start, end) == (0.1, 0.35)
    assert found.pushes[1][0] == 1
    assert found.pushes[1][3].tolist() == [0.0, 0.0, 0.5]
    names = [robot.joint_names[k] for k in found.lost[0][0]]
    assert (names, found.lost[0][1]) == (list(robot.leg("rm").joints), 2.0)
    assert not found.body_points
    trunk = trunk_points(robot)
    assert [name for *_, name in found.trunk_points] == list(trunk.names)
    np.testing.assert_array_equal([place for _, place, _, _ in found.trunk_points], trunk.points)
    touching = native_loads(robot, hp.Scene(robot, body_contact=True).settings)
    assert [name for *_, name in touching.body_points] == list(trunk.names)


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
def test_impossible_numbers_are_refused_by_name(build: Callable[[], object], name: str) -> None:
    with refused(ParameterError, name):
        build()


def test_unknown_links_and_legs_are_refused(robot: hp.Robot) -> None:
    with refused(UnknownNameError, kind="link (Scene.loads[1].link)", name="luggage"):
        hp.Scene(robot, loads=[BOX, hp.Payload("luggage", 1.0)])
    with refused(UnknownNameError, kind="leg (Scene.loads[0].leg)", name="seventh"):
        hp.Scene(robot, loads=[hp.LostLeg("seventh", 1.0)])
    with refused(ParameterError, "Scene.loads[1].leg", "lf"):
        hp.Scene(robot, loads=[hp.LostLeg("lf", 1.0), hp.LostLeg("lf", 2.0)])
    with refused(ParameterError, "Scene.loads"):
        hp.Scene(robot, loads=BOX)  # type: ignore[arg-type]


def test_formulations_without_loads_refuse_them(robot: hp.Robot) -> None:
    for scene, name, value in (
        (hp.Scene(robot, loads=[BOX]), "Scene.loads", "payload"),
        (hp.Scene(robot, body_contact=True), "Scene.body_contact", True),
    ):
        with refused(ParameterError, name, value, about=("maximal",)):
            maximal_twin(scene)
        with refused(ParameterError, name, value, about=("MuJoCo",)):
            MujocoTwin(scene, None)  # type: ignore[arg-type]
