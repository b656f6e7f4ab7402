"""One file, three parsers: Pinocchio, MuJoCo and yourdfpy give the same mass matrix and motion."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import urdf_path

# Both codes do the same sums in another order on matrices of condition number 1e4 to 1e5:
# 1e-12 of the largest entry leaves a factor of ten and more over what is seen.
TOL = 1e-12
ROBOTS = ("kharagpur", "athena", "spread")


class Sample(NamedTuple):
    """A random state in both conventions, and v_pin = turn @ v_mujoco."""

    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    turn: np.ndarray


class Twin(NamedTuple):
    """The same robot in Pinocchio and MuJoCo; index of each of our joints in MuJoCo's arrays."""

    robot: Robot
    model: mujoco.MjModel
    data: mujoco.MjData
    qpos: np.ndarray
    dof: np.ndarray


@pytest.fixture(scope="module", params=ROBOTS)
def twin(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Twin:
    """Both paper robots, and one with the additional mass at the joints (full inertias)."""
    path = tmp_path_factory.mktemp("urdf") / "robot.urdf"
    spread = KHARAGPUR.model_copy(update={"additional_mass_placement": "joints"})
    own = request.param == "spread"
    path.write_text(spread.urdf() if own else urdf_path(request.param).read_text())
    return make_twin(path)


def make_twin(path: Path) -> Twin:
    """Open a file in both: free joint on the base, no damping, no limits, no contacts."""
    robot, spec = load_robot(path), mujoco.MjSpec.from_file(str(path))
    spec.body("base_link").add_freejoint(name="root")
    model = spec.compile()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.jnt_limited[:] = 0
    assert not model.dof_damping.any()
    joints = [model.joint(name) for name in robot.joint_names]
    qpos, dof = (np.array([x[0] for x in column]) for column in
                 ([j.qposadr for j in joints], [j.dofadr for j in joints]))  # fmt: skip
    return Twin(robot, model, mujoco.MjData(model), qpos, dof)


def samples(twin: Twin, count: int) -> list[Sample]:
    """Set nothing; return random states anywhere in position, attitude and joint angles."""
    rng = np.random.default_rng(5)
    found = []
    for _ in range(count):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        q = np.concatenate([rng.normal(size=3), quaternion, rng.uniform(-2.5, 2.5, 18)])
        turn = np.zeros((24, 24))
        turn[:3, :3] = pin.Quaternion(quaternion).toRotationMatrix().T
        turn[3:6, 3:6] = np.eye(3)
        turn[np.arange(6, 24), twin.dof] = 1
        found.append(Sample(q, rng.normal(size=24) * 2, rng.normal(size=18), turn))
    return found


def put(twin: Twin, sample: Sample) -> None:
    """Set MuJoCo's state (quaternion w first, base velocity in world axes) and evaluate it."""
    data = twin.data
    data.qpos[:3], data.qpos[3:7] = sample.q[:3], sample.q[[6, 3, 4, 5]]
    data.qpos[twin.qpos] = sample.q[7:]
    data.qvel[:] = sample.turn.T @ sample.v
    data.qfrc_applied[twin.dof] = sample.tau
    mujoco.mj_forward(twin.model, data)


def mass_matrix(robot: Robot, q: np.ndarray) -> np.ndarray:
    upper = np.triu(pin.crba(robot.model, robot.model.createData(), q))
    return upper + np.triu(upper, 1).T


def close(ours: np.ndarray, theirs: np.ndarray) -> None:
    """Compare to TOL of the largest entry."""
    assert np.abs(ours - theirs).max() <= TOL * np.abs(theirs).max()


def test_mass_matrix_and_motion_equal_mujoco(twin: Twin) -> None:
    """Mass matrix, Coriolis and gravity forces, forward dynamics on 200 random states."""
    model = twin.robot.model
    data = model.createData()
    assert twin.model.opt.gravity.tolist() == model.gravity.linear.tolist()
    for sample in samples(twin, 200):
        put(twin, sample)
        q, v, turn = sample.q, sample.v, sample.turn
        mass = mass_matrix(twin.robot, q)
        theirs = np.zeros((24, 24))
        for column in range(24):
            unit, product = np.eye(24)[column], np.zeros(24)
            mujoco.mj_mulM(twin.model, twin.data, product, unit)
            theirs[:, column] = product
        close(turn.T @ mass @ turn, theirs)
        drift = np.zeros(24)  # the base's velocity turns with its axes
        drift[:3] = -np.cross(v[3:6], v[:3])
        bias = pin.nonLinearEffects(model, data, q, v)
        close(turn.T @ (bias + mass @ drift), twin.data.qfrc_bias)
        torque = np.concatenate([np.zeros(6), sample.tau])
        close(turn.T @ (pin.aba(model, data, q, v, torque) - drift), twin.data.qacc)


def test_yourdfpy_gives_the_same_mass_matrix(twin: Twin) -> None:
    """Sum of m Jv'Jv + Jw'I Jw over the links, with NumPy, from yourdfpy's own parsing."""
    parsed = yourdfpy.URDF.load(twin.robot.source, load_meshes=False)
    assert parsed.validate()
    for sample in samples(twin, 5):
        parsed.update_cfg(dict(zip(twin.robot.joint_names, sample.q[7:], strict=True)))
        close(mass_matrix(twin.robot, sample.q), mass_from_yourdfpy(parsed, twin.robot))


def mass_from_yourdfpy(parsed: yourdfpy.URDF, robot: Robot) -> np.ndarray:
    """Return the (24, 24) mass matrix in base axes, columns in our joint order."""
    carriers = {joint.child: joint for joint in parsed.joint_map.values()}
    total = np.zeros((24, 24))
    for link in parsed.link_map.values():
        if link.inertial is None:
            continue
        frame = parsed.get_transform(link.name, "base_link") @ link.inertial.origin
        turn, point = frame[:3, :3], frame[:3, 3]
        linear, angular = np.zeros((3, 24)), np.zeros((3, 24))
        linear[:, :3] = angular[:, 3:6] = np.eye(3)
        linear[:, 3:6] = np.cross(np.eye(3), point).T  # turning about axis k moves by e_k x p
        name = link.name
        while name in carriers:
            joint = carriers[name]
            if joint.type == "revolute":
                pose = parsed.get_transform(joint.child, "base_link")
                axis = pose[:3, :3] @ joint.axis
                column = 6 + robot.joint_index(joint.name)
                linear[:, column] = np.cross(axis, point - pose[:3, 3])
                angular[:, column] = axis
            name = joint.parent
        inertia = turn @ link.inertial.inertia @ turn.T
        total += link.inertial.mass * linear.T @ linear + angular.T @ inertia @ angular
    return total


def test_equal_totals_and_harmless_extension(twin: Twin) -> None:
    """Total masses agree, the feet weigh nothing, and every parser skips our own element."""
    parsed = yourdfpy.URDF.load(twin.robot.source, load_meshes=False)
    weights = [link.inertial.mass for link in parsed.link_map.values() if link.inertial]
    assert sum(weights) == pytest.approx(twin.robot.total_mass, rel=1e-14)
    assert twin.model.body_mass.sum() == pytest.approx(twin.robot.total_mass, rel=1e-14)
    assert twin.model.body("lf_foot").mass[0] == 0
    assert "<hexapod_pin " in twin.robot.urdf
    assert parsed.errors == []
