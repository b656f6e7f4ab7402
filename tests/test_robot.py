"""Loading robots: names, limits, feet, states; other parsers; loads that change masses."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, StateError, UnknownNameError, UrdfError
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.robot.description.leg_names import LEG_NAMES, joint_role, leg_of_chain
from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.description.solids import body_inertia
from hexapod_pin.robot.description.urdf_file import read_urdf
from hexapod_pin.robot.loading.pin_model import RemovedPoint, _without, placement
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.robot.rotations import rotation, rotations, trunk_vertical
from hexapod_pin.scene.scene import loaded_model
from hexapod_pin.validation.cases.robots import references, robot_file

TEXT = KHARAGPUR.urdf()


@pytest.fixture(scope="module")
def kharagpur() -> Robot:
    return load_robot("kharagpur")


def saved(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return path


def foot_points(robot: Robot, q: np.ndarray) -> np.ndarray:
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    numbers = [robot.model.getJointId(foot.joint) for foot in robot.feet]
    return np.array([data.oMi[k].act(f.offset) for k, f in zip(numbers, robot.feet, strict=True)])


def test_names_order_and_limits_are_pinocchios(kharagpur: Robot) -> None:
    """Legs in our order; joint k of joint_names is q[7 + k] and v[6 + k] of Pinocchio."""
    assert tuple(leg.name for leg in kharagpur.legs) == LEG_NAMES
    assert kharagpur.leg("rm").joints == ("rm_coxa_joint", "rm_femur_joint", "rm_tibia_joint")
    assert [foot.name for foot in kharagpur.feet] == [f"{leg}_foot" for leg in LEG_NAMES]
    assert (kharagpur.model.nq, kharagpur.model.nv) == (25, 24)
    for k, name in enumerate(kharagpur.joint_names):
        joint = kharagpur.model.joints[kharagpur.model.getJointId(name)]
        assert (joint.idx_q, joint.idx_v) == (7 + k, 6 + k)
        assert kharagpur.joint_index(name) == k
    model = kharagpur.model
    np.testing.assert_array_equal(kharagpur.lower, model.lowerPositionLimit[7:])
    np.testing.assert_array_equal(kharagpur.upper, model.upperPositionLimit[7:])
    np.testing.assert_array_equal(kharagpur.velocity_limit, model.upperVelocityLimit[6:])
    np.testing.assert_array_equal(kharagpur.effort_limit, model.upperEffortLimit[6:])
    np.testing.assert_array_equal(kharagpur.damping, np.zeros(18))


def test_pinocchio_reads_what_was_checked(tmp_path: Path) -> None:
    """Lumped masses and inertias of our own check equal Pinocchio's bodies, also when rotated."""
    turned = TEXT.replace('<origin xyz="0.05967 0 0" rpy="0 0 0"/>\n      <mass',
                          '<origin xyz="0.06 0.01 0" rpy="0.1 0.2 0.3"/>\n      <mass')  # fmt: skip
    weight = (
        '<link name="rr_foot"><inertial><origin xyz="0 0 0.01" rpy="0 0 1"/><mass value="0.02"/>'
        '<inertia ixx="1e-6" iyy="2e-6" izz="2e-6" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    path = saved(tmp_path, turned.replace('<link name="rr_foot">', weight))
    robot, file = load_robot(path), read_urdf(path)
    for joint in (j for j in file.joints if j.moves):
        theirs = robot.model.inertias[robot.model.getJointId(joint.name)].inertia
        ours = body_inertia(file, file.rigid_group(joint.child))
        assert ours == pytest.approx(theirs, abs=1e-15)
    assert rotation((0.1, 0.2, 0.3)) == pytest.approx(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3))


def test_standing_pose(kharagpur: Robot) -> None:
    """Femurs level, tibias down: each foot 202.84 mm straight out from its hip, touching z = 0."""
    state = kharagpur.stand()
    x, y = np.array([0.2, 0.0, -0.2] * 2), 0.1025 + 0.0835 + 0.11934
    expected = np.column_stack([x, np.repeat([y, -y], 3), np.full(6, 0.010)])
    assert foot_points(kharagpur, state.q) == pytest.approx(expected, abs=1e-15)
    assert not state.v.any()


def test_stand_reference() -> None:
    case = references()["HC16_hexapod_static_torques"]
    robot, ref, tol = load_robot(robot_file("hexa_ref")), case["ref"], case["tol_rel"]
    q = robot.stand([0.0, -0.3, 0.3] * 6).q
    assert robot.total_mass == pytest.approx(ref["total_mass"], rel=tol)
    assert q[2] == pytest.approx(ref["base_z"], rel=tol)
    assert foot_points(robot, q) == pytest.approx(np.array(ref["feet"]), abs=1e-12)
    com = pin.centerOfMass(robot.model, robot.model.createData(), q)
    assert com == pytest.approx(np.array(ref["com"]), abs=1e-12)
    assert list(robot.joint_names) == ref["joint_order"]
    assert [foot.radius for foot in robot.feet] == [0.0] * 6
    assert "point feet" in "".join(robot.notes)


def test_a_change_of_a_robots_model_is_no_other_robots() -> None:
    """The package's robots are loaded once; each call has a model of its own."""
    first, second = load_robot("kharagpur"), load_robot("kharagpur")
    first.model.armature[6] = 1.0
    assert first.urdf is second.urdf
    assert second.model.armature[6] == load_robot("kharagpur").model.armature[6] == 0.0
    assert load_robot("kharagpur", posture={"lf_coxa_joint": 0.1}).posture[0] == 0.1


def test_other_naming_habits(tmp_path: Path) -> None:
    assert leg_of_chain(("j_c1_rm", "j_thigh_rm", "j_tibia_rm")) == "rm"
    assert leg_of_chain(("AR_coxa_joint", "AR_femur_joint", "AR_tibia_joint")) == "rf"
    assert leg_of_chain(("L3_1", "L3_2", "L3_3")) == "lr"
    assert leg_of_chain(("leg4_j1", "leg4_j2", "leg4_j3")) == "rm"
    assert leg_of_chain(("lf_coxa_joint", "lm_femur_joint", "lf_tibia_joint")) is None
    assert leg_of_chain(("lf_femur_joint", "lf_coxa_joint", "lf_tibia_joint")) is None
    assert joint_role("elbow") is None
    text = TEXT
    for leg in LEG_NAMES:
        for segment, name in (("coxa", "c1"), ("femur", "thigh"), ("tibia", "tibia")):
            text = text.replace(f"{leg}_{segment}_joint", f"j_{name}_{leg}")
    for leg in load_robot(saved(tmp_path, text)).legs:
        assert leg.joints == (f"j_c1_{leg.name}", f"j_thigh_{leg.name}", f"j_tibia_{leg.name}")
        assert leg.foot == f"{leg.name}_foot"


def test_feet_by_name(tmp_path: Path) -> None:
    """Explicit feet are assigned to legs by the tree, whatever their order; else spheres are."""
    text = TEXT.replace("_foot", "_end")
    path = saved(tmp_path, text)
    assert [foot.name for foot in load_robot(path).feet] == [f"{leg}_end" for leg in LEG_NAMES]
    feet = [f"{leg}_end" for leg in reversed(LEG_NAMES)]
    robot = load_robot(path, feet=feet, foot_radius=0.015)
    assert [foot.name for foot in robot.feet] == [f"{leg}_end" for leg in LEG_NAMES]
    assert {foot.radius for foot in robot.feet} == {0.015}
    with refused(UrdfError, source=str(path), about=("leg rr", "rr_end")):
        load_robot(path, feet=["lf_end", "lm_end", "lr_end", "rf_end", "rm_end", "base_link"])
    with refused(UrdfError, source=str(path), about=("7", "6")):
        load_robot(path, feet=[*feet, "base_link"])
    with refused(UrdfError, source=str(path), about=("feet: lf_end",)):
        load_robot(path, feet=["lf_end", "lf_end"])
    with refused(UnknownNameError, kind="foot link", name="lf_foot"):
        load_robot(path, feet=["lf_foot"])


EXAMPLES = Path(
    sys.prefix, "lib", f"python3.{sys.version_info.minor}", "site-packages",
    "cmeel.prefix/share/example-robot-data/robots",
)  # fmt: skip


@pytest.mark.skipif(not EXAMPLES.is_dir(), reason="example-robot-data is not installed")
def test_quadrupeds() -> None:
    for file, legs, mass, radius in (
        ("solo_description/robots/solo12.urdf", ("FL", "FR", "HL", "HR"), 2.50000279, 0.0),
        ("anymal_b_simple_description/robots/anymal.urdf", ("LF", "RF", "LH", "RH"), 30.475397462,
         0.031),
    ):  # fmt: skip
        found = load_robot(EXAMPLES / file)
        assert [leg.name for leg in found.legs] == ["lf", "lr", "rf", "rr"]
        robot = load_robot(EXAMPLES / file, feet=[f"{leg}_FOOT" for leg in legs])
        assert robot.total_mass == pytest.approx(mass, rel=1e-9)
        assert [leg.joints for leg in robot.legs] == [leg.joints for leg in found.legs]
        heights = foot_points(robot, robot.stand().q)[:, 2]
        assert [foot.radius for foot in robot.feet] == [radius] * 4
        assert heights == pytest.approx([radius] * 4, abs=1e-12)


def test_unknown_names(kharagpur: Robot) -> None:
    for call, kind, known in (
        (load_robot, "robot", "kharagpur"),
        (urdf_path, "packaged robot", "kharagpur"),
        (kharagpur.leg, "leg", "lf"),
        (kharagpur.foot, "foot", "lf_foot"),
        (kharagpur.joint_index, "joint", "lf_coxa_joint"),
        (lambda name: kharagpur.stand({name: 0.1}), "joint", "lf_coxa_joint"),
        (lambda name: placement(kharagpur.model, name), "link", "lf_coxa"),
    ):
        with refused(UnknownNameError, kind=kind, name="nobody", about=(known,)) as caught:
            call("nobody")  # type: ignore[operator]
        assert known in caught.value.known


def test_bad_arguments() -> None:
    with refused(ParameterError, "load_robot.foot_radius", float("nan")):
        load_robot("kharagpur", foot_radius=float("nan"))
    with refused(ParameterError, "posture[rr_tibia_joint]", -0.1, allowed=(0.0,)):
        load_robot("kharagpur", posture={"rr_tibia_joint": -0.1})
    with refused(StateError, about=("posture", "(2,)", "(18,)")):
        load_robot("kharagpur", posture=[0.0, 1.0])
    robot = load_robot("kharagpur", posture={"rr_tibia_joint": 1.2})
    assert robot.posture[17] == 1.2
    assert robot.posture[16] == 0.0


def test_states_are_checked(kharagpur: Robot) -> None:
    q, v = kharagpur.stand().q.copy(), np.zeros(24)
    for index, value, about in (
        (6, 1 + 2e-6, ("q[3:7]", "1.000002")), (6, 0.0, ("q[3:7]", "0")), (9, np.inf, ("q[9]",)),
    ):  # fmt: skip
        with refused(StateError, about=about):
            kharagpur.check_state(np.where(np.arange(25) == index, value, q), v)
    with refused(StateError, about=("q", "(24,)", "(25,)")):
        kharagpur.check_state(q[:-1], v)
    with refused(StateError, about=("v", "(23,)", "(24,)")):
        kharagpur.check_state(q, v[:-1])
    with refused(StateError, about=("v[3]", "nan")):
        kharagpur.check_state(q, np.where(np.arange(24) == 3, np.nan, v))
    with refused(ParameterError, "Robot.check_state.q", "upright"):
        kharagpur.check_state("upright", v)
    q[3:7] = np.array([0.5, 0.5, 0.5, 0.5]) * (1 + 5e-7)
    checked = kharagpur.check_state(list(q), list(v))
    assert np.linalg.norm(checked.q[3:7]) == pytest.approx(1, abs=1e-15)
    assert q[3] != 0.5  # the argument is not touched


def test_frozen_and_with_its_provenance(kharagpur: Robot) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        kharagpur.name = "other"  # type: ignore[misc]
    state = kharagpur.stand()
    for array in (kharagpur.lower, kharagpur.posture, kharagpur.feet[0].offset, state.q, state.v):
        with refused(ValueError, about=("read-only",)):
            array[0] = 1.0
    assert "S2 Table 1" in kharagpur.provenance
    assert any("hips at" in text for text in kharagpur.assumed) and kharagpur.notes == ()
    assert kharagpur.digest == load_robot(urdf_path("kharagpur")).digest


def test_the_vertical_in_the_trunk_s_axes() -> None:
    """It leans backwards where the trunk pitches down; a quaternion need not have unit length."""
    pitch = 0.3
    q = np.array([0.0, 0.0, 0.1, 0.0, 2.0 * np.sin(0.5 * pitch), 0.0, 2.0 * np.cos(0.5 * pitch)])
    assert trunk_vertical(q) == pytest.approx([-np.sin(pitch), 0.0, np.cos(pitch)], abs=1e-15)
    drawn = np.random.default_rng(3).normal(size=(20, 7))
    rows = rotations(drawn[:, 3:7])[:, 2]
    assert np.array([trunk_vertical(one) for one in drawn]) == pytest.approx(rows, abs=1e-14)


# Both codes do the same sums in another order on matrices of condition number 1e4 to 1e5:
# 1e-12 of the largest entry leaves a factor of ten and more over what is seen.
TOL = 1e-12


class Twin(NamedTuple):
    """The same robot in Pinocchio and MuJoCo; index of each of our joints in MuJoCo's arrays."""

    robot: Robot
    model: mujoco.MjModel
    qpos: np.ndarray
    dof: np.ndarray


@pytest.fixture(scope="module", params=["athena", "spread"])
def twin(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Twin:
    """A paper robot, and one with the additional mass at the joints (full inertias).

    In MuJoCo with a free joint on the base, no damping, no limits, no contacts.
    """
    path = tmp_path_factory.mktemp("urdf") / "robot.urdf"
    spread = KHARAGPUR.model_copy(update={"additional_mass_placement": "joints"})
    own = request.param == "spread"
    path.write_text(spread.urdf() if own else urdf_path(request.param).read_text())
    robot, spec = load_robot(path), mujoco.MjSpec.from_file(str(path))
    spec.body("base_link").add_freejoint(name="root")
    model = spec.compile()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.jnt_limited[:] = 0
    assert not model.dof_damping.any()
    joints = [model.joint(name) for name in robot.joint_names]
    qpos, dof = (np.array([x[0] for x in column]) for column in
                 ([j.qposadr for j in joints], [j.dofadr for j in joints]))  # fmt: skip
    return Twin(robot, model, qpos, dof)


def close(ours: np.ndarray, theirs: np.ndarray) -> None:
    assert np.abs(ours - theirs).max() <= TOL * np.abs(theirs).max()


def test_mass_matrix_and_motion_equal_mujoco(twin: Twin) -> None:
    """Mass matrix, Coriolis and gravity forces, forward dynamics on 200 random states.

    MuJoCo's quaternion has w first, and its velocity of the base world axes: v = turn @ v_mujoco.
    """
    model, data, there = twin.robot.model, twin.robot.model.createData(), mujoco.MjData(twin.model)
    assert twin.model.body_mass.sum() == pytest.approx(twin.robot.total_mass, rel=1e-14)
    assert twin.model.opt.gravity.tolist() == model.gravity.linear.tolist()
    rng = np.random.default_rng(5)
    for _ in range(200):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        q = np.concatenate([rng.normal(size=3), quaternion, rng.uniform(-2.5, 2.5, 18)])
        v, tau, turn = rng.normal(size=24) * 2, rng.normal(size=18), np.zeros((24, 24))
        turn[:3, :3] = pin.Quaternion(quaternion).toRotationMatrix().T
        turn[3:6, 3:6] = np.eye(3)
        turn[np.arange(6, 24), twin.dof] = 1
        there.qpos[:3], there.qpos[3:7] = q[:3], q[[6, 3, 4, 5]]
        there.qpos[twin.qpos], there.qvel[:] = q[7:], turn.T @ v
        there.qfrc_applied[twin.dof] = tau
        mujoco.mj_forward(twin.model, there)
        mass = np.triu(pin.crba(model, data, q))
        mass += np.triu(mass, 1).T
        theirs = np.zeros((24, 24))
        mujoco.mj_fullM(twin.model, there, theirs)
        close(turn.T @ mass @ turn, theirs)
        drift = np.zeros(24)  # the base's velocity turns with its axes
        drift[:3] = -np.cross(v[3:6], v[:3])
        bias = pin.nonLinearEffects(model, data, q, v)
        close(turn.T @ (bias + mass @ drift), there.qfrc_bias)
        torque = np.concatenate([np.zeros(6), tau])
        close(turn.T @ (pin.aba(model, data, q, v, torque) - drift), there.qacc)


LINK = "lf_tibia"


def body(scene):
    model = loaded_model(scene)
    return model.inertias[model.getJointId("lf_tibia_joint")]


def test_a_factor_scales_every_body_or_one_and_moves_none(kharagpur):
    scene = hp.Scene(kharagpur, loads=[hp.loads.MassFactor(1.25)])
    model = loaded_model(scene)
    for ours, theirs in zip(
        list(model.inertias)[1:], list(kharagpur.model.inertias)[1:], strict=True
    ):
        np.testing.assert_allclose(ours.mass, 1.25 * theirs.mass, rtol=1e-15)
        np.testing.assert_allclose(ours.inertia, 1.25 * theirs.inertia, rtol=1e-14)
        np.testing.assert_array_equal(ours.lever, theirs.lever)
    np.testing.assert_allclose(scene.total_mass, 1.25 * kharagpur.total_mass, rtol=1e-14)
    scene = hp.Scene(kharagpur, loads=[hp.loads.MassFactor(2.0, [LINK])])
    alone = body(hp.Scene(kharagpur)).mass
    np.testing.assert_allclose(scene.total_mass, kharagpur.total_mass + alone, rtol=1e-14)
    np.testing.assert_allclose(body(scene).mass, 2.0 * alone, rtol=1e-15)


def test_what_was_put_on_can_be_taken_away(kharagpur):
    place = (0.02, -0.01, -0.03)
    loads = [hp.Payload(LINK, 0.05, place), hp.loads.RemovedMass(LINK, 0.05, place)]
    ours, theirs = body(hp.Scene(kharagpur, loads=loads)), body(hp.Scene(kharagpur))
    np.testing.assert_allclose(ours.mass, theirs.mass, rtol=1e-14)
    np.testing.assert_allclose(ours.lever, theirs.lever, atol=1e-16)
    np.testing.assert_allclose(ours.inertia, theirs.inertia, rtol=1e-10, atol=1e-15)
    pair = pin.Inertia(2.0, np.zeros(3), np.diag([1e-3, 2.0 + 1e-3, 2.0 + 1e-3]))
    left = _without(pair, RemovedPoint("pair", 1.0, np.zeros(3)), np.array([1.0, 0.0, 0.0]))
    assert left.mass == 1.0
    np.testing.assert_allclose(left.lever, [-1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(left.inertia, 1e-3 * np.eye(3), atol=1e-15)


def test_what_cannot_be_is_refused(kharagpur):
    for mass, place in ((5.0, (0.0, 0.0, 0.0)), (0.1, (0.2, 0.0, 0.0))):  # of mass, and of moments
        about = (LINK, "other side of the joint")
        with refused(ParameterError, "RemovedMass.mass[lf_tibia]", mass, about=about):
            hp.Scene(kharagpur, loads=[hp.loads.RemovedMass(LINK, mass, place)])
    with refused(ParameterError, "MassFactor.factor", 0.0):
        hp.loads.MassFactor(0.0)
    for load in (hp.loads.MassFactor(1.1, ["nowhere"]), hp.loads.RemovedMass("nowhere", 0.1)):
        with refused(UnknownNameError, kind="link (Scene.loads[0].link)", name="nowhere"):
            hp.Scene(kharagpur, loads=[load])


def test_a_case_keeps_them_and_its_trace_knows_the_masses(kharagpur):
    loads = [hp.loads.MassFactor(1.1, ["base_link"]), hp.loads.RemovedMass(LINK, 0.01)]
    case = hp.Case(hp.Scene(kharagpur, loads=loads), hp.HoldPosture(), duration=0.2, accuracy=1e-4)
    assert hp.Case.from_toml(case.to_toml()) == case
    trace = case.run()
    model = loaded_model(case.scene)
    ours = [y.mass for y in RecordedRobot.of(trace).model.inertias]
    np.testing.assert_allclose(ours, [y.mass for y in model.inertias], rtol=1e-15)
    np.testing.assert_allclose(trace.run.robot.total_mass, sum(ours), rtol=1e-12)
