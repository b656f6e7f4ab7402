"""The benchmark's scenes: their robots, gait, held set-points, and which scene a command names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from vehicles import HARD_CASES, drop, hexa_ref

import hexapod_pin as hp
from hexapod_pin.benchmark.work_precision.scenes import (
    SceneOptions,
    built_in,
    find_task,
    tripod_setpoints,
)
from hexapod_pin.benchmark.work_precision.task import held_task, set_points
from hexapod_pin.errors import ParameterError, UnknownNameError


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
    knots = np.isclose(plan.time % 0.01, 0.0) | np.isclose(plan.time % 0.01, 0.01)
    rows = np.round(plan.time[knots] / 0.01).astype(int)
    inside = rows < 30
    found = set_points(held)
    assert inside.sum() > 10
    assert found[rows[inside]] == pytest.approx(plan.q[knots][inside], abs=1e-9)
    assert held_task(built_in("stand")).controller == built_in("stand").controller


def test_what_no_scene_is_made_of_is_refused():
    """Set-points between samples, names that are not there, a stroke that cannot be walked."""
    task = replace(built_in("walk"), sample=0.02, duration=0.1)
    with refused(ParameterError, "sample", 0.02):
        set_points(task)
    with refused(UnknownNameError, kind="gait", name="gallop", about=("tetrapod",)):
        find_task("kharagpur", SceneOptions(gait="gallop"))
    kind = "benchmark scene or robot"
    with refused(UnknownNameError, kind=kind, name="nothing", about=("hc40-soft", "athena")):
        find_task("nothing", SceneOptions())


def test_a_scene_file_and_a_gait_name_a_task(tmp_path: Path):
    scene = hp.Scene(hp.load_robot("athena"), contact=hp.Contact.s1())
    (tmp_path / "mine.toml").write_text(scene.to_toml())
    task = find_task(str(tmp_path / "mine.toml"), SceneOptions(gait="hold"))
    assert (task.name, task.scene.contact, task.duration) == ("mine", scene.contact, 1.0)
    walk = find_task("athena", SceneOptions(gait="tripod", cycle_time=1.6, contact="s2", mu=0.5))
    assert walk.scene.contact.friction.mu_static == 0.5
    assert (walk.duration, walk.controller.gait.name) == (1.6, "tripod")


@pytest.mark.parametrize(
    ("scene", "options", "name", "value"),
    [
        ("walk", SceneOptions(contact="s1"), "--contact", "s1"),
        ("walk", SceneOptions(duration=1.5), "--duration", 1.5),
        ("kharagpur", SceneOptions(sample=0.0), "--sample", 0.0),
        ("kharagpur", SceneOptions(sample=1e-9, duration=0.02), "sample", 1e-9),
        ("kharagpur", SceneOptions(gait="hold", stroke=0.1), "--stroke", 0.1),
        ("nothing.toml", SceneOptions(kp=1.0), "--kp", 1.0),
    ],
)
def test_what_a_scene_does_not_take_is_refused(scene, options, name, value):
    with refused(ParameterError, name, value):
        find_task(scene, options)
