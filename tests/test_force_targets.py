"""Forces that feet are to carry: closed forms, a second implementation, balance and continuity."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from foot_control_runs import reading, recall, robot
from refusals import refused
from scipy.spatial.transform import Rotation
from test_foot_control_parts import PUSHED, SERVO, T, loads_on, made, statics

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.foot_control.law import sole_of
from hexapod_pin.control.foot_control.leg_model import standing_centre
from hexapod_pin.control.foot_control.stability import spectral_radius, with_stable_gains
from hexapod_pin.native import LeastTorque, force_targets

UP = np.array([0.0, 0.0, 1.0])


def settings(friction: float = 0.35, damping: float = 0.02, cost: np.ndarray | None = None):
    found = LeastTorque()
    found.cost = list(np.full((6, 3), 0.25) if cost is None else cost)
    found.friction, found.damping = friction, damping
    return found


def legs(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    around = np.pi / 3.0 * np.arange(6) + rng.uniform(-0.2, 0.2, 6)
    arms = np.column_stack([0.2 * np.cos(around), 0.2 * np.sin(around), np.full(6, -0.15)])
    arms += rng.uniform(-0.02, 0.02, (6, 3))
    return rng.uniform(-0.2, 0.2, (6, 3, 3)), arms, rng.uniform(-0.2, 0.2, (6, 3))


def core(least, parts, weight, load=30.0, up=UP, normal=UP) -> np.ndarray:
    jacobian, arms, own = parts
    return force_targets(least, jacobian.reshape(18, 3), arms, own, list(weight), load, up, normal)


def least_by_elimination(least, parts, weight, load, up) -> np.ndarray:
    jacobian, arms, own = parts
    cost = np.array(least.cost)
    feet = np.flatnonzero(np.asarray(weight) > 0.0)
    h = np.einsum("lik,lk,ljk->lij", jacobian, cost, jacobian)
    h = h + least.damping * np.trace(h, axis1=1, axis2=2).mean() / 3.0 * np.eye(3)
    pull = np.einsum("lik,lk,lk->li", jacobian, cost, own)
    crosses = [np.cross(arm, np.eye(3)).T for arm in arms[feet]]  # arm x f = cross @ f
    balance = np.concatenate([np.vstack([np.eye(3), cross]) for cross in crosses], axis=1)
    wanted = np.concatenate([load * up, np.zeros(3)])
    first = np.linalg.lstsq(balance, wanted, rcond=None)[0]
    null = np.linalg.svd(balance)[2][6:].T
    big = np.zeros((3 * len(feet),) * 2)
    for k, foot in enumerate(feet):
        big[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = h[foot] / weight[foot]
    slope = big @ first - pull[feet].ravel()
    free = np.linalg.solve(null.T @ big @ null, -null.T @ slope)
    force = np.zeros((6, 3))
    force[feet] = (first + null @ free).reshape(-1, 3)
    return force


def vertical(parts, weight, load, up) -> np.ndarray:
    arms, root = parts[1], np.sqrt(np.asarray(weight))
    wrench = np.vstack([np.tile(up[:, None], 6), np.cross(arms, up).T]) * root
    wanted = np.concatenate([load * up, np.zeros(3)])
    return np.outer(root * (np.linalg.pinv(wrench, rcond=1e-9) @ wanted), up)


def in_cone(least, upright, targets, normal) -> np.ndarray:

    def inside(share: float) -> bool:
        force = upright + share * (targets - upright)
        along = force @ normal
        across = np.linalg.norm(force - np.outer(along, normal), axis=1)
        return bool((across <= least.friction * along + 1e-12).all())

    low, high = 0.0, 1.0
    if inside(1.0):
        return targets
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if inside(middle) else (low, middle)
    return upright + low * (targets - upright)


TILTED = Rotation.from_rotvec([0.08, -0.05, 0.0]).as_matrix()[:, 2]
WEIGHTS = ((1.0,) * 6, (1.0, 0.0, 1.0, 0.0, 1.0, 0.0), (1.0, 0.3, 0.8, 0.9, 0.5, 1.0))


@pytest.mark.parametrize(
    ("seed", "up", "friction"), [(0, UP, 0.2), (2, TILTED, 0.2), (3, TILTED, 10.0)]
)
@pytest.mark.parametrize("weight", WEIGHTS)
def test_targets_are_those_of_a_second_implementation(seed, weight, up, friction):
    """In the null space of balance, the cone by bisection; six, three and unlike feet, a slope."""
    least, parts = settings(friction), legs(seed)
    found = core(least, parts, weight, 30.0, up)
    upright = vertical(parts, weight, 30.0, up)
    targets = least_by_elimination(least, parts, weight, 30.0, up)
    expected = in_cone(least, upright, targets, UP)
    assert found == pytest.approx(expected, abs=1e-7 * 30.0)
    if seed == 0 and weight[1] == 1.0:  # the cone acts here
        assert np.abs(expected - targets).max() > 1.0


def test_targets_balance_force_and_moment():
    rng = np.random.default_rng(1)
    up = Rotation.from_rotvec(rng.uniform(-0.2, 0.2, 3) * [1.0, 1.0, 0.0]).as_matrix()[:, 2]
    parts, weight = legs(1), rng.uniform(0.2, 1.0, 6)
    found = core(settings(0.35), parts, weight, 80.0, up)
    assert found.sum(axis=0) == pytest.approx(80.0 * up, abs=1e-9 * 80.0)
    assert np.cross(parts[1], found).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-9 * 80.0)


@pytest.mark.parametrize("feet", [(), (0, 3)])
def test_too_few_feet_give_no_forces_that_run_away(feet):
    weight = np.zeros(6)
    weight[list(feet)] = 1.0
    found = core(settings(), legs(1), weight, 80.0)
    assert np.isfinite(found).all() and np.abs(found).max() < 10.0 * 80.0
    assert not found[weight == 0.0].any()
    assert not found[:, :2].any()  # vertical ones


@pytest.mark.parametrize(("name", "gait"), [("kharagpur", "tripod"), ("athena", "wave")])
def test_no_target_jumps(name, gait):
    """5 % of the weight per millisecond at most, also where tripods change (duty 1/2)."""
    weight, period = 9.81 * robot(name).total_mass, 1e-3
    walk = hp.KinematicControl(getattr(hp.Gait, gait)(lift=0.03, cycle_time=3.0))
    law = made(name, walk, period=period, force_targets=hp.foot_control.ForceTargets())
    memory, targets, shares = law.first_memory(1), [], []
    for k in range(round(3.6 / period)):
        plan = law.walk.table.at(k * period + law.lead)
        _, memory = law.tick(k * period, reading(name, plan[:, :3]), memory)
        targets.append(recall(memory, "target")[0])
        shares.append(recall(memory, "share")[0])
    found, share = np.array(targets), np.array(shares)
    assert np.abs(np.linalg.norm(np.diff(found, axis=0), axis=2)).max() < 0.05 * weight
    assert share.min() == 0.0 and share.max() == 1.0
    assert found.sum(axis=1) - weight * UP == pytest.approx(0.0, abs=1e-9 * weight)
    assert not found[share == 0.0].any()
    full = share > 0.2
    along, across = found[..., 2], np.linalg.norm(found[..., :2], axis=2)
    # the plan's feet are in one plane to some 1e-8 rad
    assert (across[full] <= 0.35 * along[full] + 1e-7 * weight).all()


@pytest.mark.parametrize("name", ["kharagpur", "athena"])
def test_offsets_are_the_torques_of_the_targets(name):
    """Targets and torques of a standing robot, from Pinocchio's Jacobians and weight."""
    law = made(name, force_targets=hp.foot_control.ForceTargets())
    target, memory = law.tick(0.0, loads_on(name, PUSHED), law.first_memory(1))
    own, jacobian, soles = statics(name)
    effort = robot(name).effort_limit[leg_group(robot(name)).joint_index]
    weight = 9.81 * robot(name).total_mass
    least = settings(cost=effort**-2.0)
    arms = soles - standing_centre(robot(name))
    expected = core(least, (jacobian, arms, own), np.ones(6), weight)
    force = recall(memory, "target")[0]
    assert force == pytest.approx(expected, abs=1e-7 * weight)
    torque = own - np.einsum("lij,li->lj", jacobian, force)
    assert 100.0 * target[0, :, 6:9] == pytest.approx(torque, abs=1e-8 * weight)
    vertical_only = own - jacobian[:, 2] * force[:, 2:]
    assert np.square(torque / effort).sum() < np.square(vertical_only / effort).sum()


def test_offsets_follow_from_the_servos_that_are_counted_on():
    """A controller that believes in 0.7 of the stiffness offsets its set-points by 1 / 0.7."""
    aim = hp.foot_control.ForceTargets()
    weak = SERVO.stiffer(0.7)
    plain, other = (
        law.tick(0.0, loads_on("kharagpur", PUSHED), law.first_memory(1))[0][0, :, 6:9]
        for law in (made(force_targets=aim), made(force_targets=aim, servo=weak))
    )
    assert np.abs(plain).max() > 1e-4
    assert other == pytest.approx(plain / 0.7, rel=1e-12)


def test_soles_are_pushed_into_the_ground():
    """By (f_n / K)^(1/e) along the normal, against f_t / k_t along the ground."""
    sole = hp.foot_control.Sole(stiffness=2e5, exponent=1.5, sliding_stiffness=4e4)
    aim = hp.foot_control.ForceTargets(sole=sole)
    law = made(force_targets=aim)
    target, memory = law.tick(0.0, loads_on("kharagpur", PUSHED), law.first_memory(1))
    force, plan = recall(memory, "target")[0], law.walk.table.at(law.lead)[:, :3]
    expected = -force / 4e4
    expected[:, 2] = -((force[:, 2] / 2e5) ** (2.0 / 3.0))
    assert target[0, :, :3] - plan == pytest.approx(expected, abs=1e-12)
    assert np.abs(expected[:, :2]).max() > 1e-6 and expected[:, 2].max() < -5e-4
    assert sole_of(hp.Contact.accurate()).sliding_stiffness == 2e4
    assert sole_of(hp.Contact.s1()).sliding_stiffness is None


SQUEEZE = hp.foot_control.SlipPid(kp=1e-5, ki=0.0, anticipates=False)


@pytest.mark.parametrize("deviation", ["segment", "target"])
def test_slip_correction_acts_on_the_deviation(deviation):
    """Forces in proportion to the targets are none; half of them only in the two-sided form."""
    aim = hp.foot_control.ForceTargets(deviation=deviation)

    def error(share: float, more: float = 0.0) -> np.ndarray:
        law = made(slip=SQUEEZE, force_targets=aim)
        memory = law.first_memory(1)
        _, memory = law.tick(0.0, loads_on("kharagpur", PUSHED), memory)
        force = recall(memory, "target")[0]
        out = np.array(force)
        out[:, :2] *= share
        out[[0, 4], :2] *= 1.0 + more / share
        _, memory = law.tick(T, loads_on("kharagpur", out), memory)
        return recall(memory, "error")[0], force

    scale = np.abs(error(1.0)[1][:, :2]).max()
    assert scale > 0.05
    assert np.abs(error(1.0)[0]).max() < 1e-6 * scale
    half = np.abs(error(0.5)[0]).max()
    assert (half < 1e-9) if deviation == "segment" else (half > 0.2 * scale)
    assert np.abs(error(1.0, 0.5)[0]).max() > 0.1 * scale


JOINTS, INWARD = robot("athena").joint_names, {"femur": -20.0, "tibia": 120.0}  # degrees


@cache
def inward() -> hp.Robot:
    angles = [next((a for k, a in INWARD.items() if k in n), 0.0) for n in JOINTS]
    return hp.load_robot("athena", posture=dict(zip(JOINTS, np.radians(angles), strict=True)))


def test_default_gains_suit_the_posture():
    """Twice the gain of the default bandwidth is unstable here: the gain follows from the loop."""
    scene = hp.Scene(inward(), contact=hp.Contact.s1())
    gait = hp.Gait.tripod(stroke=0.08)
    control = hp.FootControl(gait, slip=hp.foot_control.SlipPid())
    found = with_stable_gains(control, scene)
    gain = found.slip.ki
    drift = control.gait.duty * control.gait.cycle_time
    for factor, stable in ((2.0, True), (4.0, False)):
        changed = replace(found, slip=found.slip.model_copy(update={"ki": factor * gain}))
        assert (spectral_radius(changed, scene, drift_time=drift) < 1.0) == stable
    asked = replace(control, slip=hp.foot_control.SlipPid(bandwidth=1000.0))
    with refused(hp.errors.ParameterError, "slip.bandwidth", 1000.0):
        asked.start(scene, 1)
