"""Forces that feet are to carry: closed forms, a second implementation, balance and continuity."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from foot_control_runs import reading, recall, robot
from refusals import refused
from scipy.spatial.transform import Rotation
from test_foot_control_parts import PUSHED, SERVO, T, loads_on, made, statics

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control import leg_group
from hexapod_pin.control.foot_control.law import sole_of
from hexapod_pin.control.foot_control.leg_model import standing_centre
from hexapod_pin.control.foot_control.stability import spectral_radius, with_stable_gains
from hexapod_pin.errors import ParameterError
from hexapod_pin.native import LeastTorque, force_targets
from hexapod_pin.robot import force_distribution as split

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
    weight, period, cycle = 9.81 * robot(name).total_mass, 1e-3, 3.0 if gait == "wave" else 2.4
    walk = hp.KinematicControl(getattr(hp.Gait, gait)(lift=0.03, cycle_time=cycle))
    law = made(name, walk, period=period, force_targets=hp.foot_control.ForceTargets())
    memory, targets, shares = law.first_memory(1), [], []
    for k in range(round(1.2 * cycle / period)):
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


# forces of least torque of a posture: balance, optimality, cone, weights

WEIGHT = np.array([0.0, 0.0, 30.0])  # N


class Feet(NamedTuple):
    """Feet of a random robot: arguments of the functions."""

    jacobian: Array
    lever: Array
    own_torque: Array
    weight: Array
    cost: Array


def feet(count: int, instants: tuple[int, ...] = (), seed: int = 0) -> Feet:
    rng = np.random.default_rng(seed)
    turn = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, (*instants, count))) / count
    lever = np.stack([0.3 * np.cos(turn), 0.2 * np.sin(turn), np.full(turn.shape, -0.1)], axis=-1)
    jacobian = rng.normal(size=(*turn.shape, 3, 3)) * 0.1
    own = rng.normal(size=(*turn.shape, 3)) * 0.1
    return Feet(jacobian, lever, own, rng.uniform(0.3, 1.0, turn.shape), np.full((count, 3), 0.5))


@pytest.mark.parametrize("count", [3, 6])
def test_forces_balance_the_load_whatever_its_direction(count: int) -> None:
    """To the damping of the system, 1e-10, times its condition number."""
    found = feet(count, (7,))
    load = np.array([3.0, -2.0, 30.0])
    j, r, g, w, cost = found
    least = split.least_torque_split(j, r, g, w, load, cost)
    np.testing.assert_allclose(least.sum(axis=-2), np.tile(load, (7, 1)), atol=1e-6)
    np.testing.assert_allclose(np.cross(r, least).sum(axis=-2), 0.0, atol=1e-6)
    upright = split.vertical_split(r, w, WEIGHT)
    np.testing.assert_allclose(upright.sum(axis=-2), np.tile(WEIGHT, (7, 1)), atol=1e-9)
    np.testing.assert_allclose(np.cross(r, upright).sum(axis=-2), 0.0, atol=1e-9)


def test_no_other_balanced_forces_cost_less() -> None:
    j, r, g, w, cost = feet(5, seed=3)
    mean = np.trace(j @ (cost[..., None] * np.swapaxes(j, -1, -2)), axis1=-2, axis2=-1).mean() / 3
    eps = split.REGULARISATION * mean

    def total(force: Array) -> float:
        torque = split.held_torque(j, 0.0 * g, force) ** 2
        own = np.einsum("fij,fj,fj,fi->f", j, cost, g, force)
        square = 0.5 * (cost * torque).sum(-1) + 0.5 * eps * (force**2).sum(-1)
        return float((square / w - own).sum())

    least = split.least_torque_split(j, r, g, w, WEIGHT, cost)
    skew = [np.cross(np.eye(3), -arm) for arm in r]
    rows = np.hstack([np.vstack([np.eye(3), one]) for one in skew])
    free = np.linalg.svd(rows)[2][6:]
    for direction in free:
        step = 0.1 * direction.reshape(5, 3)
        assert total(least + step) > total(least) < total(least - step)


def test_forces_stay_inside_the_cone_and_touch_it() -> None:
    j, r, g, w, cost = feet(6, (50,), seed=1)
    limited = 0
    for mu in (0.05, 0.35, 50.0):
        force, share = split.holding_forces(j, r, g, w, WEIGHT, cost, mu)
        ratio = split.force_ratio(force, WEIGHT)
        assert (ratio <= mu * (1.0 + 1e-9)).all()
        acts = (share > 0.0) & (share < 1.0)
        np.testing.assert_allclose(ratio[acts].max(axis=-1), mu, rtol=1e-9)
        limited += int(acts.sum())
    assert limited > 50
    assert (split.holding_forces(j, r, g, w, WEIGHT, cost, 0.0).share == 0.0).all()


def test_weights_are_centred_on_touch_down_and_lift_off() -> None:
    duty, period, transfer = 0.6, 1.5, 0.1
    at = np.array([0.0, duty, 0.3, 0.8, transfer / period / 2, 1.0 - transfer / period / 2])
    weight = split.load_weights(at, duty, period, transfer)
    np.testing.assert_allclose(weight, [0.5, 0.5, 1.0, 0.0, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda f: split.vertical_split(f.lever, [1, 1, 0, 0, 0, 0], WEIGHT), "weight"),
        (lambda f: split.holding_forces(*f[:4], WEIGHT, f.cost, -0.1), "mu"),
        (lambda f: split.vertical_split(f.lever, f.weight, np.zeros(3)), "load"),
        (lambda f: split.load_weights(0.1, 0.5, 1.0, 0.0), "transfer"),
        (lambda f: split.load_weights(0.1, 1.0, 1.0, 0.1), "duty"),
        (lambda f: split.cone_share(f.lever, f.lever, WEIGHT, np.nan), "cone_share.mu"),
    ],
)
def test_what_cannot_be_is_refused(call, name: str) -> None:
    with refused(ParameterError, name):
        call(feet(6))
