"""One file, two parsers: Pinocchio and MuJoCo give the same mass matrix and motion."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import urdf_path

# Both codes do the same sums in another order on matrices of condition number 1e4 to 1e5:
# 1e-12 of the largest entry leaves a factor of ten and more over what is seen.
TOL = 1e-12
ROBOTS = ("athena", "spread")


class Twin(NamedTuple):
    """The same robot in Pinocchio and MuJoCo; index of each of our joints in MuJoCo's arrays."""

    robot: Robot
    model: mujoco.MjModel
    qpos: np.ndarray
    dof: np.ndarray


@pytest.fixture(scope="module", params=ROBOTS)
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
