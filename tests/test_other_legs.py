"""Robots of four to eight legs, legs of two joints, held joints: planned, walked and budgeted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from leg_robots import COXA, FEMUR, TIBIA, hips, legged, load
from refusals import refused
from rewriting.comparison import foot_centres

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import default_gait, named_gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import leg_group, leg_order
from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.leg_kinematics import LegKinematics

STEP = {"stroke": 0.04, "cycle_time": 1.0}
SERVO = hp.Servo(kp=200.0, kd=4.0)
ROBOTS = {
    "five": {"count": 5}, "eight": {"count": 8}, "four of two joints": {"count": 4, "joints": 2},
    "tarsus and head": {"tarsus": 0.4, "pan": True},
}  # fmt: skip


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> hp.Robot:
    return load(legged(**ROBOTS[request.param]), tmp_path_factory.mktemp("robot"))


def feet_of(robot: hp.Robot, q: np.ndarray) -> np.ndarray:
    """Return the feet of joint angles (K, n) by Pinocchio, base frame, in our order. (K, L, 3)."""
    order = [[leg.name for leg in robot.legs].index(name) for name in leg_order(robot)]
    base = [0, 0, 0, 0, 0, 0, 1]
    return np.array([foot_centres(robot, np.concatenate([base, row]))[order] for row in q])


def test_feet_are_on_their_paths_and_held_joints_in_their_places(robot: hp.Robot) -> None:
    control = KinematicControl(named_gait(robot, default_gait(robot), **STEP))
    plan, path = control.plan(robot, 3.0), control.path(robot)
    rows = slice(0, None, 5)
    off = feet_of(robot, plan.q[rows]) - path.positions(plan.time[rows])
    followed = [0, 2] if len(robot.legs[0].joints) == 2 else [0, 1, 2]  # travel ahead, and height
    assert np.abs(off[..., followed]).max() < 1e-9
    for name, place in robot.held.items():
        column = robot.joint_index(name)
        assert (plan.q[:, column] == place).all() and (plan.v[:, column] == 0.0).all()


def test_a_short_walk_keeps_its_speed_and_its_budget_lists_every_joint(robot: hp.Robot) -> None:
    gait = named_gait(robot, default_gait(robot), **STEP)
    trace = hp.simulate(
        hp.Scene(robot, servo=SERVO), KinematicControl(gait), duration=4.0, accuracy=1e-3
    )
    half = len(trace.time) // 2
    speed = (trace.q[-1, 0] - trace.q[half, 0]) / (trace.time[-1] - trace.time[half])
    assert 0.8 * gait.speed < speed < 1.25 * gait.speed
    budget = hp.torque_budget(trace)
    assert [row.joint for row in budget.joints] == list(robot.joint_names)
    kinds = {row.joint: row.kind for row in budget.joints}
    assert all(kinds[name] == "held" for name in robot.held)
    for leg in robot.legs:
        own = [kinds[joint] for joint in leg.joints]
        assert own == ["coxa", "femur", "tibia"][: len(own)]
    assert "held" in budget.table() or not robot.held


def test_a_held_joint_is_the_same_as_a_fixed_one(tmp_path: Path) -> None:
    held = load(legged(tarsus=0.4, pan=True), tmp_path)
    fixed = load(legged(tarsus_place=0.4), tmp_path)
    assert held.held["lf_tarsus_joint"] == 0.4 and held.held["pan_joint"] == 0.4
    for name in leg_order(held):
        one, other = LegKinematics.of(held, name), LegKinematics.of(fixed, name)
        for part in ("axes", "origins", "foot"):
            np.testing.assert_allclose(getattr(one, part), getattr(other, part), atol=1e-15)
        assert one.closed_form is not None
        target = one.forward([0.1, -0.2, 1.3])
        np.testing.assert_allclose(one.inverse(target), [0.1, -0.2, 1.3], atol=1e-12)


def test_the_measure_of_two_joint_legs_is_that_of_yaw_and_lift(tmp_path: Path) -> None:
    """|sin yaw| l / rho: l across and rho from the lifting axis to the foot, travel along x."""
    robot = load(legged(4, joints=2), tmp_path)
    legs = leg_group(robot)
    measure = legs.kinematics.normalised_determinant(legs.kinematics.posture[:, None])[:, 0]
    lift = 0.1
    across = FEMUR * np.cos(lift) + TIBIA * np.cos(lift + 1.5)
    down = FEMUR * np.sin(lift) + TIBIA * np.sin(lift + 1.5)
    yaw = np.array([hips(4)[name][2] for name in leg_order(robot)])
    expected = np.abs(np.sin(yaw)) * across / np.hypot(across, down)
    np.testing.assert_allclose(measure, expected, rtol=1e-12)
    assert np.allclose(np.linalg.norm(legs.neutral_feet[:, 2]), 2.0 * down)
    assert COXA > 0.0


def test_two_joint_legs_follow_one_direction(tmp_path: Path) -> None:
    robot = load(legged(joints=2), tmp_path)
    turning = KinematicControl(hp.Gait.tripod(stroke=0.0, cycle_time=1.0, turn_rate=0.2))
    plan, path = turning.plan(robot, 2.0), turning.path(robot)
    off = feet_of(robot, plan.q[::5]) - path.positions(plan.time[::5])
    feet = leg_group(robot).neutral_feet
    along = np.stack([-feet[:, 1], feet[:, 0]], axis=-1)
    along /= np.linalg.norm(along, axis=1)[:, None]
    assert np.abs(np.einsum("kli,li->kl", off[..., :2], along)).max() < 1e-9
    assert np.abs(off[..., 2]).max() < 1e-9
    with refused(GaitError, quantity="posture", about=("singular",)):
        KinematicControl(hp.Gait.tripod(heading=np.pi / 2, **STEP)).plan(robot, 2.0)
    wanted = hp.motion.VelocityCommand(time=(0.0, 2.0), forward=(0.05, 0.0), turn_rate=(0.0, 0.2))
    with refused(GaitError, quantity="velocity"):
        KinematicControl(hp.Gait.tripod(**STEP), velocity=wanted).plan(robot, 4.0)
    faster = hp.motion.VelocityCommand(time=(0.0, 2.0), forward=(0.03, 0.05))
    control = KinematicControl(hp.Gait.tripod(**STEP), velocity=faster)
    plan, path = control.plan(robot, 4.0), control.path(robot)
    off = feet_of(robot, plan.q[::5]) - path.positions(plan.time[::5])
    assert np.abs(off[..., [0, 2]]).max() < 1e-9


def test_what_needs_six_legs_of_three_joints_is_refused(tmp_path: Path) -> None:
    scene, gait = hp.Scene(load(legged(joints=2), tmp_path), servo=SERVO), hp.Gait.tetrapod(**STEP)
    for part, control in (
        ("ArcWalk", hp.motion.ArcWalk(gait)),
        ("FootControl", hp.FootControl(gait)),
    ):
        with refused(GaitError, quantity="legs", about=(part, "6", "2")):
            hp.simulate(scene, control, duration=1.0)
    with refused(ParameterError, "method", "robust"):
        hp.simulate(scene, hp.HoldPosture(), duration=0.01, method="robust", step=1e-3)
    robot = load(legged(pan=True), tmp_path)
    with refused(GaitError, quantity="legs", about=("FootControl", "pan_joint")):
        hp.simulate(hp.Scene(robot), hp.FootControl(gait), duration=1.0)


def test_links_beyond_held_joints_are_checked_for_clearance(tmp_path: Path) -> None:
    """Capsules of coxa, femur, tibia and tarsus from joint to joint, and the foot's sphere."""
    bodies = leg_bodies(load(legged(tarsus=0.4), tmp_path))
    shapes = {shape.name.split()[1]: shape for shape in bodies.geometry.geometryObjects}
    lengths = {"coxa": COXA, "femur": FEMUR, "tibia": TIBIA / 2, "tarsus": TIBIA / 2}
    for part, length in lengths.items():
        capsule = shapes[f"rr_{part}"]
        assert 2.0 * capsule.geometry.halfLength == pytest.approx(length, abs=1e-12)
        np.testing.assert_allclose(capsule.placement.translation, [length / 2, 0, 0], atol=1e-12)
    assert ("lf_tarsus", "rr_foot") in bodies.pairs
