"""Other engines in the benchmark, tested where they are installed, and its scenes."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from vehicles import HARD_CASES, drop, hexa_ref

import hexapod_pin as hp
from hexapod_pin.benchmark.engines import engine as rivals_module
from hexapod_pin.benchmark.engines.engine import Problem, engine_entries
from hexapod_pin.benchmark.work_precision.comparison import ComparisonSettings, compare
from hexapod_pin.benchmark.work_precision.own_entry import run_task
from hexapod_pin.benchmark.work_precision.scenes import (
    SceneOptions,
    built_in,
    find_task,
    tripod_setpoints,
)
from hexapod_pin.benchmark.work_precision.task import Task, held_task, set_points
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.validation.solver_setting import SolverSetting


def engine(module: str, task: Task):
    pytest.importorskip(module)
    name = module.removeprefix("py") if module == "pydrake" else module
    found = importlib.import_module(f"hexapod_pin.benchmark.engines.{name}_engine")
    return getattr(found, name.capitalize())(Problem.of(task))


def flight(limited: bool = False) -> Task:
    """The walk's robot 1 m up, tilted, moving and turning, its servos at work, for 50 ms."""
    task = built_in("walk")
    robot, q = task.scene.robot, task.initial.q + np.eye(len(task.initial.q))[2]
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.4, 0.9)).coeffs()
    v = 0.3 * np.random.default_rng(5).standard_normal(robot.model.nv)
    v[:6] = (0.4, -0.2, 0.1, 0.5, -0.8, 1.1)
    goals = [robot.posture + 0.1, robot.posture - 0.1]
    controller = hp.motion.SampledTrajectory([0.0, 0.02], goals, limited=False)
    scene = replace(task.scene, servo=hp.Servo(kp=20.0, kd=0.3, limited=limited))
    state = robot.check_state(q, v)
    return replace(task, scene=scene, initial=state, duration=0.05, controller=controller)


@pytest.mark.parametrize(
    ("module", "method", "tolerance", "limited"),
    [
        ("mujoco", "RK4 pyramidal", 1e-8, False), ("mujoco", "RK4 pyramidal", 1e-8, True),
        ("mujoco", "implicitfast elliptic", 5e-5, False), ("pydrake", "SAP", 5e-5, True),
        ("pybullet", "torque servo", 5e-5, True),
    ],
)  # fmt: skip
def test_engines_agree_in_flight(module, method, tolerance, limited):
    """Before the contact laws differ there is one answer: gravity, servos, twist, frames.

    First-order engines fall g h t/2 wrong, 2.5e-5 m at 0.1 ms; RK4 on both sides is at round-off.
    """
    task = flight(limited)
    ours = run_task(task, SolverSetting("rk4", 1e-4))
    other = engine(module, task).run(method, "step", 1e-4, exact=True)
    assert other.ended and other.steps == 500, other.note
    assert np.abs(ours.places[-1] - ours.places[0]).max() > 0.01
    assert other.places == pytest.approx(ours.places, abs=tolerance)


def test_mujoco_stands_where_we_stand():
    """Dropped by 10 mm, at rest after 0.4 s: a soft foot's depth, 1 mm, is the laws' difference."""
    task = replace(built_in("stand"), duration=0.4)
    ours = run_task(task, SolverSetting("implicit-euler", 1e-3))
    other = engine("mujoco", task).run("Euler elliptic", "step", 1e-3)
    assert other.places[-1] == pytest.approx(ours.places[-1], abs=1.2e-3)


def test_a_diverging_mujoco_run_is_a_note_and_leaves_no_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    task = replace(built_in("walk"), duration=0.1)
    found = engine("mujoco", task).run("RK4 pyramidal", "step", 5e-3)
    assert not found.ended and found.note.startswith("diverged: ")
    assert list(tmp_path.iterdir()) == []


def test_what_engines_cannot_be_compared_on_is_refused():
    soft, stand = built_in("hc40-soft"), built_in("stand")
    with refused(ParameterError, "depth of a foot at t = 0", 0.006125, allowed=(0.0001,)):
        Problem.of(soft)
    with refused(ParameterError, "radius of L1_foot", 0.0):
        Problem.of(replace(soft, initial=hp.load_robot("athena").stand()))
    with refused(ParameterError, "terrain", "slope"):
        Problem.of(replace(stand, scene=replace(stand.scene, terrain=hp.Slope(angle=0.1))))
    found = engine_entries(soft, quick=True)
    assert found.entries == [] and "no other engines" in found.notes[0]


def test_engines_that_are_not_installed_are_named(monkeypatch):
    monkeypatch.setattr(rivals_module, "find_spec", lambda name: None)
    found = engine_entries(built_in("walk"), quick=True)
    assert found.notes == [
        "MuJoCo: not installed (pip install mujoco)", "Drake: not installed (pip install drake)",
        "PyBullet: not installed (pip install pybullet)",
    ]  # fmt: skip


def test_ours_and_mujoco_stand_in_one_table_with_their_ratio(monkeypatch):
    monkeypatch.setattr(rivals_module, "find_spec", {"mujoco": "there"}.get)
    monkeypatch.setattr("hexapod_pin.benchmark.engines.mujoco_engine.QUICK_STEPS", (1e-3, 5e-4))
    task = replace(built_in("walk"), duration=0.1)
    settings = ComparisonSettings(["implicit-euler"], rounds=1, quick=True, engines=True)
    found = compare(task, settings)
    assert {one.engine for one in found.rows} == {"hexapod_pin", "MuJoCo"}
    methods = {one.method for one in found.rows if one.engine == "MuJoCo"}
    integrators, cones = ("implicitfast", "Euler", "RK4"), ("pyramidal", "elliptic")
    assert methods == {f"{a} {b}" for a in integrators for b in cones}
    assert len(found.references) == 3  # ours, and one per cone
    assert any("ratio" in line for line in found.ratios)


# scenes -------------------------------------------------------------------------------------------


def test_hc40_soft_is_the_hard_case_itself():
    task, (scene, state, posture) = built_in("hc40-soft"), drop(hexa_ref())
    assert (task.initial.q == state.q).all() and (task.initial.v == state.v).all()
    assert (task.scene.contact, task.scene.servos) == (scene.contact, scene.servos)
    assert (task.controller.plan(task.scene.robot, task.duration).q == posture).all()
    answer = HARD_CASES["HC40_hexapod_drop_soft"]["ref"]
    assert task.answer[7:] == pytest.approx(answer["q_joints_pin_order"], abs=0.0)
    assert task.answer[:3] == pytest.approx(answer["base_xyz"], abs=0.0)
    mid = built_in("hc40-mid")
    normal, friction = mid.scene.contact.normal, mid.scene.contact.friction
    assert (normal.stiffness, friction.slope) == (1e6, 1e3)
    assert (normal.dissipation, friction.mu) == (0.5, 0.5)
    assert (mid.initial.q == task.initial.q).all() and mid.answer is None


def test_walk_starts_10_mm_above_the_ground_with_100_held_set_points():
    """The tripod swings and lifts as by hand: t = 0.25 s, a = 90 degrees; t = 1 s, a = 0."""
    task = built_in("walk")
    robot = task.scene.robot
    assert task.initial.q[2] - robot.stand().q[2] == pytest.approx(0.010, abs=1e-15)
    assert (task.samples, task.sample, len(task.controller.time)) == (100, 0.01, 100)
    assert set_points(task) == pytest.approx(np.array(task.controller.q), abs=0.0)
    quarter, full = tripod_setpoints(robot, np.array([0.25, 1.0]))

    def angle(row, joint):
        return row[robot.joint_index(joint)] - robot.posture[robot.joint_index(joint)]

    for leg, swing in (("lf", 0.25), ("rm", -0.25), ("lm", -0.25), ("rf", 0.25)):
        assert angle(quarter, f"{leg}_coxa_joint") == pytest.approx(swing, abs=1e-15)
    for leg, lift in (("lf", -0.25), ("rm", -0.25), ("rf", 0.0)):
        assert angle(full, f"{leg}_femur_joint") == pytest.approx(lift, abs=1e-15)
        assert angle(full, f"{leg}_tibia_joint") == pytest.approx(-lift, abs=1e-15)


def test_a_gait_is_held_from_sample_to_sample_for_all_engines():
    options = SceneOptions(gait="tripod", cycle_time=0.8, stroke=0.05, duration=0.3)
    task = find_task("kharagpur", options)
    held = held_task(task)
    plan = task.controller.plan(task.scene.robot, 0.3)
    rows = np.round(plan.time / 0.01).astype(int)
    knots = np.isclose(plan.time, 0.01 * rows) & (rows < 30)
    assert knots.sum() > 10
    assert set_points(held)[rows[knots]] == pytest.approx(plan.q[knots], abs=1e-9)
    assert held_task(built_in("stand")).controller == built_in("stand").controller


def test_what_a_scene_does_not_take_is_refused(tmp_path: Path):
    for scene, options, name, value in (
        ("walk", SceneOptions(contact="s1"), "--contact", "s1"),
        ("walk", SceneOptions(duration=1.5), "--duration", 1.5),
        ("kharagpur", SceneOptions(sample=1e-9, duration=0.02), "sample", 1e-9),
        ("kharagpur", SceneOptions(gait="hold", stroke=0.1), "--stroke", 0.1),
        ("nothing.toml", SceneOptions(kp=1.0), "--kp", 1.0),
    ):
        with refused(ParameterError, name, value):
            find_task(scene, options)
    with refused(ParameterError, "sample", 0.02):
        set_points(replace(built_in("walk"), sample=0.02, duration=0.1))
    with refused(UnknownNameError, kind="gait", name="gallop", about=("tetrapod",)):
        find_task("kharagpur", SceneOptions(gait="gallop"))
    with refused(UnknownNameError, name="nothing", about=("hc40-soft", "athena")):
        find_task("nothing", SceneOptions())
    (tmp_path / "mine.toml").write_text(built_in("walk").scene.to_toml())
    assert find_task(str(tmp_path / "mine.toml"), SceneOptions(gait="hold")).name == "mine"
