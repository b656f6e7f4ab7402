"""The robust fixed step: its order, its grounds, its invariances, its books."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from refusals import refused

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.benchmark.work_precision.scenes import built_in
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.stress import stress_scenes

G = 9.81
RUBBER = hp.contact.HuntCrossley(stiffness=3e5, dissipation=0.3)
TANH = hp.contact.TanhCoulomb(mu=0.6, slope=300.0)
WALK = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.14))


def robust(scene: hp.Scene, control: Any, duration: float, step: float, **more: Any) -> hp.Trace:
    method = more.pop("method", "robust")
    sample = more.pop("sample", 0.05)
    return hp.simulate(
        scene, control, duration=duration, method=method, step=step, sample=sample, **more
    )


def largest_error(
    scene: hp.Scene, control: Any, duration: float, step: float, **more: Any
) -> float:
    """Largest difference of a position to X3 at 1e-6, samples every 50 ms [m, rad]."""
    reference = hp.simulate(scene, control, duration=duration, accuracy=1e-6, sample=0.05, **more)
    return PositionError.between(robust(scene, control, duration, step, **more).q, reference.q).q


HC40 = {  # 1 ms, 0.5 ms
    "hc40-soft": (6.6e-4, 4.2e-4),
    "hc40-mid": (5.7e-4, 2.9e-4),
    "hc40-stiff": (5.0e-3, 4.5e-3),
}


@pytest.mark.parametrize("name", HC40)
def test_hc40_errors_are_those_of_the_study(name: str) -> None:
    """Within 5 %: the table's two digits, and a gyroscopic term that the study took explicitly."""
    task = built_in(name)
    reference = hp.simulate(
        task.scene, task.controller, duration=0.25, accuracy=1e-7, sample=0.25, initial=task.initial
    )
    for step, expected in zip((1e-3, 5e-4), HC40[name], strict=True):
        run = robust(task.scene, task.controller, 0.25, step, sample=0.25, initial=task.initial)
        assert PositionError.between(run.q[-1:], reference.q[-1:]).q == pytest.approx(
            expected, rel=0.05
        )


RUBBER_TANH = hp.Contact(normal=RUBBER, friction=TANH)
BRISTLE = hp.contact.StickSlip(mu=0.6, stiffness=2e4, damping=10.0)
HILLS = hp.HeightField.random(seed=1, amplitude=0.01, wavelength=0.5)
GROOVE = hp.terrain.Groove(angle_left=0.6, angle_right=0.4, depth=0.02, bottom=0.2)
SHAKEN = hp.terrain.ShakingGround(amplitude=2e-3, frequency=8.0)
SOFT = hp.terrain.Patch(low=(-2.0, -2.0), high=(2.0, 0.0), friction=0.3, stiffness=0.2)


@pytest.mark.parametrize(
    ("contact", "ground", "control", "expected"),
    [
        (RUBBER_TANH, HILLS, WALK, 9.8e-4),
        # under the front feet: two contacts on one leg
        (hp.Contact(normal=RUBBER, friction=BRISTLE), GROOVE, hp.HoldPosture(), 5.9e-3),
        (RUBBER_TANH, SHAKEN, hp.HoldPosture(), 4.5e-4),
        (RUBBER_TANH, hp.terrain.PatchedGround(ground=hp.Flat(), patches=(SOFT,)), WALK, 1.7e-4),
    ],
    ids=["hills", "groove", "shaken", "patches"],
)
def test_grounds_converge_to_another_method(contact, ground, control, expected) -> None:
    """First order: the error at 1 ms as measured, within 20 %; a fifth of the step, 1/3.5 of it."""
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact, terrain=ground)
    coarse, fine = (largest_error(scene, control, 0.5, step) for step in (1e-3, 2e-4))
    assert coarse < 1.2 * expected
    assert fine < coarse / 3.5


def test_flat_and_nested_newton_find_the_same_step() -> None:
    """From states on the way of random extreme scenes, where something moves at less than 30 /s."""
    compared = hits = 0
    for stress in stress_scenes(10, seed=3):
        control, at = hp.HoldPosture(tuple(stress.targets)), stress.initial
        for _ in range(4):
            part = robust(stress.scene, control, 5e-3, 1e-3, sample=5e-3, initial=at)
            at = part.checkpoint
            if np.abs(at.v).max() > 30.0:
                continue
            flat, nested = (
                robust(stress.scene, control, 1e-3, 1e-3, sample=1e-3, initial=at, method=method)
                for method in ("robust", "robust-reference")
            )
            apart = np.abs(flat.v[-1] - nested.v[-1])
            # 1e-4 m/s at the base: the nested Newton's own stop; joints follow at 1/lever
            assert apart[:3].max() < 1e-4 and apart[3:].max() < 1e-3
            compared += 1
            hits += part.counters["flat_hits"]
    assert compared > 20 and hits > 33


def test_a_bristle_does_not_drift_on_a_slope_and_tanh_creeps_at_its_own_speed(
    tmp_path: Path,
) -> None:
    """Slope 0.4, mu 0.5: below 1e-6 mm in 4 s, and atanh(0.8)/kt, at any step."""
    robot, angle = vehicles.particle(tmp_path), np.arctan(0.4)
    normal = hp.contact.HuntCrossley(stiffness=1e7, dissipation=0.5)
    depth = (robot.total_mass * G * np.cos(angle) / normal.stiffness) ** (2.0 / 3.0)
    turn = pin.rpy.rpyToMatrix(0.0, angle, 0.0)
    q = np.concatenate([turn[:, 2] * -depth, pin.Quaternion(turn).coeffs()])
    start = robot.check_state(q, np.zeros(6))

    def run(friction: Any, duration: float) -> hp.Trace:
        contact = hp.Contact(normal=normal, friction=friction)
        scene = hp.Scene(robot, terrain=hp.Slope(angle=-angle), contact=contact)
        return robust(scene, hp.HoldPosture(), duration, 2e-3, sample=0.5, initial=start)

    for damping in (0.0, 60.0):
        held = run(hp.contact.StickSlip(mu=0.5, stiffness=1e5, damping=damping), 6.0)
        assert np.linalg.norm(held.q[-1, :3] - held.q[4, :3]) < 1e-9
    creeping = run(hp.contact.TanhCoulomb(mu=0.5, slope=1e3), 1.0)
    assert np.linalg.norm(creeping.v[-1, :3]) == pytest.approx(np.arctanh(0.8) / 1e3, rel=1e-7)


def test_a_turning_ball_in_flight_keeps_its_energy_and_momentum(tmp_path: Path) -> None:
    robot = vehicles.block(tmp_path, {"foot": (0.1, 0.0, 0.0)}, m=2.0, inertia=(0.02,) * 3)
    q = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 1.0])
    start = robot.check_state(q, np.array([1.0, 2.0, 0.5, 3.0, -4.0, 5.0]))
    trace = robust(hp.Scene(robot, gravity=(0, 0, 0)), hp.HoldPosture(), 2.0, 2e-3, initial=start)
    assert np.ptp(trace.energy["kinetic"]) < 1e-11 * trace.energy["kinetic"][0]
    assert np.allclose(trace.com[-1] - trace.com[0], [2.0, 4.0, 1.0], atol=1e-12)


def test_the_energy_residual_falls_with_the_step() -> None:
    """What the step loses by itself is first order; nothing is missing from the books."""
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=RUBBER_TANH, terrain=HILLS)
    lost = [robust(scene, WALK, 1.2, step).energy_residual for step in (1e-3, 2.5e-4)]
    assert np.abs(lost[1]).max() < 0.35 * np.abs(lost[0]).max()


def test_servos_stay_within_their_limits_and_the_run_converges() -> None:
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, contact=RUBBER_TANH, servo=hp.Servo(kp=4000.0, kd=4.0, limited=True))
    start = robot.stand()
    q = start.q.copy()
    q[2] += 0.15
    dropped = {"initial": robot.check_state(q, start.v)}
    assert robust(scene, hp.HoldPosture(), 0.4, 1e-3, **dropped).counters["solved_again"] > 0
    errors = [largest_error(scene, hp.HoldPosture(), 0.4, step, **dropped) for step in (1e-3, 2e-4)]
    assert errors[1] < errors[0] / 3.0


def test_joint_stops_throw_joints_back_and_the_run_converges() -> None:
    robot = hp.load_robot("kharagpur")
    stops = hp.JointStops(stiffness=500.0, dissipation=0.1)
    servo = hp.Servo(kp=0.1, kd=0.01, limited=False)
    scene = hp.Scene(robot, gravity=(0.0, 0.0, 0.0), servo=servo, stops=stops)
    q, v = robot.stand().q.copy(), np.zeros(robot.model.nv)
    q[2], q[8::3], v[7::3] = 1.0, robot.upper[1::3] - 0.1, 5.0
    start = {"initial": robot.check_state(q, v)}
    trace = robust(scene, hp.HoldPosture(), 0.2, 1e-3, sample=1e-3, **start)
    beyond = trace.q[:, 8::3] - robot.upper[1::3]
    assert beyond.max(axis=0).min() > 0.002 and beyond[-1].max() < 0.0
    assert trace.v[-1, 7::3].max() < -1.0
    errors = [largest_error(scene, hp.HoldPosture(), 0.2, step, **start) for step in (4e-4, 1e-4)]
    assert errors[1] < errors[0] / 3.0


def test_other_robots_are_refused_with_the_reason() -> None:
    """The core's own word; `dense` stands for any tree that is not legs of three joints."""
    robot = hp.load_robot("kharagpur")
    plant = native_plant(hp.Scene(robot), dense=True)
    n = len(robot.joint_names)
    state = robot.stand()
    with refused(ValueError, about=("method robust", "three")):
        native.start(
            plant, time=[0.0], position=np.zeros((1, n)), rate=np.zeros((1, n)), kind="cubic",
            start=native.checkpoint(0, 0.0, state.q, state.v, np.zeros((0, 6)), ()),
            method="robust", step=1e-3, stride=1, sample=1e-3, tolerance=0.0,
        )  # fmt: skip
