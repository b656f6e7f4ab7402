"""The robust fixed step: its order, its laws, its invariances, its books."""

from __future__ import annotations

from dataclasses import replace
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


# --- the order, against the table of the study this step comes from ------------------------------

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


SCENES = {  # contact, ground, servos; largest error at 1 ms as measured, first order
    "hills": (hp.Contact(normal=RUBBER, friction=TANH), "hills", 9.8e-4),
    "groove": (hp.Contact(normal=RUBBER, friction=TANH), "groove", 7.0e-3),
    "groove, bristle": (
        hp.Contact(
            normal=RUBBER, friction=hp.contact.StickSlip(mu=0.6, stiffness=2e4, damping=10.0)
        ),
        "groove",
        5.9e-3,
    ),
    "shaken": (hp.Contact(normal=RUBBER, friction=TANH), "shaken", 4.5e-4),
    "patches": (hp.Contact(normal=RUBBER, friction=TANH), "patches", 1.7e-4),
}


def ground(name: str) -> Any:
    if name == "hills":
        return hp.HeightField.random(seed=1, amplitude=0.01, wavelength=0.5)
    if name == "groove":  # under the front feet: two contacts on one leg
        return hp.terrain.Groove(angle_left=0.6, angle_right=0.4, depth=0.02, bottom=0.2)
    if name == "shaken":
        return hp.terrain.ShakingGround(amplitude=2e-3, frequency=8.0)
    soft = hp.terrain.Patch(low=(-2.0, -2.0), high=(2.0, 0.0), friction=0.3, stiffness=0.2)
    return hp.terrain.PatchedGround(ground=hp.Flat(), patches=(soft,))


@pytest.mark.parametrize("name", SCENES)
def test_grounds_converge_to_another_method(name: str) -> None:
    """First order: the error at 1 ms as measured, within 20 %; a fifth of the step, 1/3.5 of it."""
    contact, surface, expected = SCENES[name]
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact, terrain=ground(surface))
    control = WALK if name in ("hills", "patches") else hp.HoldPosture()
    coarse, fine = (largest_error(scene, control, 0.5, step) for step in (1e-3, 2e-4))
    assert coarse < 1.2 * expected
    assert fine < coarse / 3.5


@pytest.mark.parametrize(
    "contact",
    [
        hp.Contact(
            normal=hp.contact.AdamsImpact(
                stiffness=1e6, exponent=1.5, damping=200.0, damping_depth=1e-3
            ),
            friction=hp.contact.AdamsCoulomb(
                mu_static=0.6, mu_dynamic=0.4, stiction_speed=0.02, transition_speed=0.05
            ),
        ),
        hp.Contact(
            normal=hp.contact.KelvinVoigt(stiffness=2e4, damping=60.0),
            friction=hp.contact.SmoothStep(mu_static=0.7, mu_dynamic=0.5, speed=0.02),
        ),
        hp.Contact(
            normal=hp.contact.Restitution(stiffness=3e5, restitution=0.3),
            friction=hp.contact.BrownMcPhee(mu_static=0.7, mu_dynamic=0.5, speed=0.02),
        ),
        hp.Contact(
            normal=RUBBER, friction=hp.contact.StickSlip(mu=0.3, stiffness=2e4, damping=60.0)
        ),
    ],
    ids=["impact-adams", "voigt-smooth", "restitution-brown", "bristle"],
)
def test_every_law_converges_to_another_method(contact: hp.Contact, tmp_path: Path) -> None:
    """A block that lands on four feet, sliding and turning: first order, 0.02 s apart."""
    feet = {f"f{x:+d}{y:+d}": (0.1 * x, 0.1 * y, -0.05) for x in (1, -1) for y in (1, -1)}
    robot = vehicles.block(tmp_path, feet, m=2.0, inertia=(0.01, 0.012, 0.02))
    scene = hp.Scene(robot, contact=contact)
    q = np.array([0.0, 0.0, 0.051, 0.0, 0.0, 0.0, 1.0])
    start = robot.check_state(q, np.array([0.4, 0.2, 0.0, 0.0, 0.0, 0.3]))
    errors = [
        largest_error(scene, hp.HoldPosture(), 0.2, step, initial=start) for step in (4e-4, 1e-4)
    ]
    assert errors[1] < 1.5e-3
    assert errors[1] < errors[0] / 2.5


# --- the reference form and its accelerator ------------------------------------------------------


def one_step(stress: Any, at: hp.results.Checkpoint, method: str, step: float) -> np.ndarray:
    trace = hp.simulate(
        stress.scene, hp.HoldPosture(tuple(stress.targets)), duration=step, method=method,
        step=step, sample=step, initial=at,
    )  # fmt: skip
    return np.asarray(trace.v[-1])


def test_flat_and_nested_newton_find_the_same_step() -> None:
    """From states on the way of random extreme scenes, where something moves at less than 30 /s."""
    compared = hits = 0
    for stress in stress_scenes(30, seed=3):
        control, step = hp.HoldPosture(tuple(stress.targets)), 1e-3
        at: Any = stress.initial
        for _ in range(4):
            part = hp.simulate(
                stress.scene, control, duration=5e-3, method="robust", step=step, initial=at
            )
            at = part.checkpoint
            if np.abs(at.v).max() > 30.0:
                continue
            flat = one_step(stress, at, "robust", step)
            nested = one_step(stress, at, "robust-reference", step)
            # 1e-4 m/s at the base: the nested Newton's own stop; joints follow at 1/lever
            assert np.abs(flat[:3] - nested[:3]).max() < 1e-4
            assert np.abs(flat[3:] - nested[3:]).max() < 1e-3
            compared += 1
            hits += part.counters["flat_hits"]
    assert compared > 60 and hits > 100


# --- friction ------------------------------------------------------------------------------------


def on_slope(robot: hp.Robot, ratio: float, friction: Any) -> tuple[hp.Scene, hp.State]:
    """A vehicle at its static depth on ground that falls by `ratio` along x."""
    angle = np.arctan(ratio)
    normal = hp.contact.HuntCrossley(stiffness=1e7, dissipation=0.5)
    load = robot.total_mass * G * np.cos(angle) / len(robot.feet)
    depth = (load / normal.stiffness) ** (2.0 / 3.0)
    scene = hp.Scene(
        robot, terrain=hp.Slope(angle=-angle), contact=hp.Contact(normal=normal, friction=friction)
    )
    turn = pin.rpy.rpyToMatrix(0.0, angle, 0.0)
    q = np.concatenate([turn[:, 2] * -depth, pin.Quaternion(turn).coeffs()])
    return scene, robot.check_state(q, np.zeros(6))


@pytest.mark.parametrize(("step", "damping"), [(5e-4, 0.0), (2e-3, 0.0), (2e-3, 60.0)])
def test_a_bristle_does_not_drift_on_a_slope(step: float, damping: float, tmp_path: Path) -> None:
    """Slope 0.4, mu 0.5, 4 s: below 1e-6 mm."""
    feet = {f"f{x:+d}{y:+d}": (0.1 * x, 0.1 * y, 0.0) for x in (1, -1) for y in (1, -1)}
    robot = vehicles.block(tmp_path, feet, m=2.0, com=(0.0, 0.0, 0.02))
    friction = hp.contact.StickSlip(mu=0.5, stiffness=1e5, damping=damping)
    scene, start = on_slope(robot, 0.4, friction)
    trace = robust(scene, hp.HoldPosture(), 6.0, step, sample=1.0, initial=start)
    assert np.linalg.norm(trace.q[-1, :3] - trace.q[2, :3]) < 1e-9


@pytest.mark.parametrize(
    "friction",
    [
        hp.contact.StickSlip(mu=0.5, stiffness=1e5, damping=0.0),
        hp.contact.TanhCoulomb(mu=0.5, slope=1e5),
    ],
)
def test_sliding_down_a_slope_gains_speed_as_coulomb_says(friction: Any, tmp_path: Path) -> None:
    """Slope 0.7, mu 0.5: g (sin - mu cos) = 1.60733 m/s^2 to 1e-6, and not sideways."""
    scene, start = on_slope(vehicles.particle(tmp_path), 0.7, friction)
    trace = robust(scene, hp.HoldPosture(), 1.0, 1e-3, initial=start)
    angle = np.arctan(0.7)
    gained = np.linalg.norm(trace.v[-1, :3]) - np.linalg.norm(trace.v[10, :3])
    assert gained / 0.5 == pytest.approx(G * (np.sin(angle) - 0.5 * np.cos(angle)), rel=1e-6)
    assert abs(trace.q[-1, 1]) < 1e-12


def test_tanh_creeps_at_its_own_speed_at_any_step(tmp_path: Path) -> None:
    """Slope 0.4, mu 0.5, kt 1000: atanh(0.8)/kt, 5.5 mm in 5 s."""
    scene, start = on_slope(
        vehicles.particle(tmp_path), 0.4, hp.contact.TanhCoulomb(mu=0.5, slope=1e3)
    )
    for step in (5e-4, 2e-3):
        trace = robust(scene, hp.HoldPosture(), 1.0, step, sample=0.1, initial=start)
        assert np.linalg.norm(trace.v[-1, :3]) == pytest.approx(np.arctanh(0.8) / 1e3, rel=1e-7)


# --- flight, frames, books -----------------------------------------------------------------------


def test_a_turning_ball_in_flight_keeps_its_energy_and_momentum(tmp_path: Path) -> None:
    """Linear velocity is carried along in world axes: no gain from the turning of the body."""
    robot = vehicles.block(tmp_path, {"foot": (0.1, 0.0, 0.0)}, m=2.0, inertia=(0.02,) * 3)
    q = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 0.0, 1.0])
    start = robot.check_state(q, np.array([1.0, 2.0, 0.5, 3.0, -4.0, 5.0]))
    trace = robust(hp.Scene(robot, gravity=(0, 0, 0)), hp.HoldPosture(), 2.0, 2e-3, initial=start)
    assert np.ptp(trace.energy["kinetic"]) < 1e-11 * trace.energy["kinetic"][0]
    assert np.allclose(trace.com[-1] - trace.com[0], [2.0, 4.0, 1.0], atol=1e-12)


def test_a_tumbling_hexapod_in_flight_gains_next_to_nothing() -> None:
    """Base and angular momentum are exact; the legs' own Coriolis forces leave 1.3e-5 at 2 ms."""
    robot = vehicles.hexa_ref()
    servo = hp.Servo(kp=200.0, kd=2.0, limited=False)
    scene = hp.Scene(robot, gravity=(0.0, 0.0, 0.0), servo=servo)
    q, v = robot.stand().q.copy(), np.zeros(robot.model.nv)
    q[2], v[:6] = 5.0, (1.0, 2.0, 0.5, 3.0, -4.0, 5.0)
    lost = []
    for step in (2e-3, 1e-3):
        start = robot.check_state(q, v)
        trace = robust(scene, hp.HoldPosture(), 1.0, step, sample=step, initial=start)
        springs = 100.0 * ((trace.q_ref - trace.q[:, 7:]) ** 2).sum(axis=1)
        energy = trace.energy["kinetic"] + trace.energy["elastic"] + springs
        assert energy.max() - energy[0] < 2e-5 * energy[0]
        lost.append(energy[0] - energy[-1])
    assert lost[1] < 0.6 * lost[0] < 0.006 * energy[0]  # first order


def test_published_forces_carry_the_weight() -> None:
    """A standing robot at rest: the feet's mean forces are its weight, without side load."""
    robot = hp.load_robot("kharagpur")
    contact = hp.Contact(
        normal=RUBBER, friction=hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)
    )
    trace = robust(hp.Scene(robot, contact=contact), hp.HoldPosture(), 3.0, 1e-3)
    weight = np.array([0.0, 0.0, robot.total_mass * G])
    assert np.abs(trace.foot_force[-1].sum(axis=0) - weight).max() < 1e-9 * weight[2]


def test_the_energy_residual_falls_with_the_step() -> None:
    """What the step loses by itself is first order; nothing is missing from the books."""
    scene = hp.Scene(
        hp.load_robot("kharagpur"), contact=hp.Contact(normal=RUBBER, friction=TANH),
        terrain=hp.HeightField.random(seed=1, amplitude=0.01, wavelength=0.5),
    )  # fmt: skip
    lost = [robust(scene, WALK, 1.2, step).energy_residual for step in (1e-3, 2.5e-4)]
    assert np.abs(lost[1]).max() < 0.35 * np.abs(lost[0]).max()


# --- servos, stops, refusals ---------------------------------------------------------------------


def test_servos_stay_within_their_limits_and_the_run_converges() -> None:
    robot = hp.load_robot("kharagpur")
    plain = hp.Scene(robot, contact=hp.Contact(normal=RUBBER, friction=TANH))
    scene = replace(plain, servo=hp.Servo(kp=4000.0, kd=4.0, limited=True))
    start = robot.stand()
    q = start.q.copy()
    q[2] += 0.15
    dropped = {"initial": robot.check_state(q, start.v)}
    assert robust(scene, hp.HoldPosture(), 0.4, 1e-3, **dropped).counters["solved_again"] > 0
    errors = [largest_error(scene, hp.HoldPosture(), 0.4, step, **dropped) for step in (1e-3, 2e-4)]
    assert errors[1] < errors[0] / 3.0


def test_joint_stops_throw_joints_back_and_the_run_converges() -> None:
    """Femurs thrown against their stops at 5 rad/s, without gravity; servos too weak to matter."""
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
