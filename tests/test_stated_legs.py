"""Legs that a URDF states, four to eight, of two joints, with held ones: gaits, plans, walks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from leg_robots import COXA, FEMUR, NAMES, TIBIA, hips, legged, load
from refusals import refused
from rewriting.comparison import foot_centres

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import default_gait, named_gait
from hexapod_pin.control.gait import gaits_for
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import leg_group, leg_order
from hexapod_pin.errors import GaitError, ParameterError, UnknownNameError, UrdfError
from hexapod_pin.robot.leg_kinematics import LegKinematics

CHAIN = "lf_coxa_joint lf_femur_joint lf_tibia_joint"


@pytest.mark.parametrize(
    ("old", "new", "about"),
    [
        ('foot="lf_foot"', 'foot="sole"', ("<leg name='lf'>", "'sole'")),
        (CHAIN, "lf_femur_joint lf_coxa_joint lf_tibia_joint", ("<leg name='lf'>", CHAIN)),
        (CHAIN, "lf_coxa_joint", ("<leg name='lf'>", "1", "2", "3")),
        ('name="lm" joints', 'name="lf" joints', ("<leg>: leg 'lf'",)),
        ('position="0.4"', 'position="far"', ("<held>", "'pan_joint'", "'far'")),
        ('<held joint="pan_joint"', '<held joint="tail"', ("<held>", "'tail'")),
        (CHAIN, "lf_coxa_joint lf_spring_joint", ("'lf_spring_joint'", "<held>")),
        ('<leg name="r', '<limb name="r', ("<leg>", "3", "4", "8")),
    ],
)
def test_what_is_stated_wrongly_is_named(
    old: str, new: str, about: tuple[str, ...], tmp_path: Path
) -> None:
    text = legged(pan=True, spring="spring" in new)
    assert old in text
    with refused(UrdfError, about=about):
        load(text.replace(old, new), tmp_path)


def test_legs_of_two_and_three_joints_do_not_walk_together(tmp_path: Path) -> None:
    text = legged().replace(
        "lm_coxa_joint lm_femur_joint lm_tibia_joint", "lm_coxa_joint lm_femur_joint"
    )
    with refused(GaitError, quantity="legs", limit=None, about=("lf 3", "lm 2")):
        KinematicControl(hp.Gait.tripod()).plan(load(text, tmp_path), 2.0)


@pytest.mark.parametrize("count", [4, 7])
def test_gait_order_goes_by_where_legs_stand_not_by_the_file(count: int, tmp_path: Path) -> None:
    shuffled = tuple(np.random.default_rng(count).permutation(NAMES[count]).tolist())
    robot = load(legged(count, order=shuffled), tmp_path)
    assert [leg.name for leg in robot.legs] == list(shuffled)
    assert leg_order(robot) == NAMES[count]
    six = load(legged(order=("rr", "lf", "rm", "lm", "lr", "rf")), tmp_path)
    assert [leg.name for leg in six.legs] == list(NAMES[6])  # with the usual names


@pytest.mark.parametrize(("count", "name"), [(n, g) for n in (4, 5, 7, 8) for g in gaits_for(n)])
def test_a_robot_on_these_gaits_stands_at_every_instant(
    count: int, name: str, tmp_path: Path
) -> None:
    """The base's origin, over which the symmetric robot's mass is, lies inside its support."""
    robot = load(legged(count), tmp_path)
    gait = named_gait(robot, name, stroke=0.03, cycle_time=1.0)
    path = KinematicControl(gait).path(robot)
    time = 3.0 + (np.arange(200) + 0.5) / 200.0
    for feet, down in zip(path.positions(time)[..., :2], path.stance(time), strict=True):
        assert down.sum() >= 3
        assert _inside(feet[down])


def _inside(points: np.ndarray) -> bool:
    """Tell whether the origin is inside the convex hull of points: no half-plane is empty."""
    angle = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    return bool(np.diff(np.append(angle, angle[0] + 2.0 * np.pi)).max() < np.pi)


def test_alternating_tetrapod_and_creep() -> None:
    gait = hp.Gait.tetrapod(legs=8)
    sets = np.array(gait.phases).reshape(2, 4)
    assert (sets[0] != sets[1]).all() and (np.abs(np.diff(sets, axis=1)) == 0.5).all()
    assert gait.minimum_feet_down == 4 and gait.duty == 0.5
    creep = hp.Gait.wave(0.75, legs=4)  # left hind, left fore, right hind, right fore
    assert creep.phases == (0.0, 0.75, 0.5, 0.25)
    with refused(GaitError, quantity="duty", limit=0.75, about=("0.6", "0.75")):
        hp.Gait.wave(0.6, legs=4)


def test_default_gaits_and_those_that_do_not_fit(tmp_path: Path) -> None:
    four = load(legged(4), tmp_path)
    assert default_gait(four) == "wave"
    assert default_gait(load(legged(8), tmp_path)) == "tetrapod"
    assert default_gait(hp.load_robot("kharagpur")) == "tetrapod"
    with refused(UnknownNameError, kind="gait of 4 legs", name="tripod", known=["wave"]):
        named_gait(four, "tripod")
    about = ("tripod", "6", "4", "(lf, lr, rf, rr)", "wave")
    with refused(GaitError, quantity="phases", limit=None, about=about):
        KinematicControl(hp.Gait.tripod()).plan(four, 2.0)
    with refused(GaitError, quantity="legs", limit=None, about=("tetrapod", "4", "wave")):
        hp.Gait.tetrapod(legs=4)
    with refused(ParameterError, "Gait.phases", (0.0, 0.5, 0.0), allowed=(4,)):
        hp.Gait(phases=(0.0, 0.5, 0.0), duty=0.9)


def test_phases_by_name(tmp_path: Path) -> None:
    plain = hp.Gait.custom((0.0, 0.5, 0.0, 0.5, 0.0, 0.5), 0.5)
    named = {"rm": 0.0, "lf": 0.0, "lr": 0.0, "rf": 0.5, "lm": 0.5, "rr": 0.5}
    assert hp.Gait(phases=named, duty=0.5) == plain and "leg_names" not in plain.model_dump()
    robot = load(legged(8), tmp_path)
    wave = hp.Gait.wave(legs=8, stroke=0.03)
    table = dict(zip(leg_order(robot), wave.phases, strict=True))
    shuffled = hp.Gait.custom(
        {k: table[k] for k in sorted(table, reverse=True)}, wave.duty, stroke=0.03
    )
    mine, theirs = (KinematicControl(gait).plan(robot, 1.0) for gait in (shuffled, wave))
    np.testing.assert_array_equal(mine.q, theirs.q)
    about = ("8", "(l1, l2, l3, l4, r1, r2, r3, r4)", "6", "(lf, lm, lr, rf, rm, rr)")
    with refused(GaitError, quantity="phases", limit=None, about=about):
        KinematicControl(hp.Gait.custom(table, wave.duty)).plan(hp.load_robot("kharagpur"), 1.0)
    case = hp.Case(hp.Scene(robot), KinematicControl(shuffled), duration=1.0)
    again = hp.load_case(case.save(tmp_path / "case.toml"))
    assert again.controller.gait == shuffled


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
