"""Forces of least torque: balance, optimality, cone, weights, and answers in closed form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.force_distribution import (
    REGULARISATION,
    cone_share,
    force_ratio,
    held_torque,
    holding_forces,
    least_torque_split,
    load_weights,
    vertical_split,
)

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
    least = least_torque_split(j, r, g, w, load, cost)
    np.testing.assert_allclose(least.sum(axis=-2), np.tile(load, (7, 1)), atol=1e-6)
    np.testing.assert_allclose(np.cross(r, least).sum(axis=-2), 0.0, atol=1e-6)
    upright = vertical_split(r, w, WEIGHT)
    np.testing.assert_allclose(upright.sum(axis=-2), np.tile(WEIGHT, (7, 1)), atol=1e-9)
    np.testing.assert_allclose(np.cross(r, upright).sum(axis=-2), 0.0, atol=1e-9)


def test_no_other_balanced_forces_cost_less() -> None:
    """The cost rises in every direction that changes neither the sum nor the moment."""
    j, r, g, w, cost = feet(5, seed=3)
    mean = np.trace(j @ (cost[..., None] * np.swapaxes(j, -1, -2)), axis1=-2, axis2=-1).mean() / 3
    eps = REGULARISATION * mean

    def total(force: Array) -> float:
        torque = held_torque(j, 0.0 * g, force) ** 2
        own = np.einsum("fij,fj,fj,fi->f", j, cost, g, force)
        square = 0.5 * (cost * torque).sum(-1) + 0.5 * eps * (force**2).sum(-1)
        return float((square / w - own).sum())

    least = least_torque_split(j, r, g, w, WEIGHT, cost)
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
        force, share = holding_forces(j, r, g, w, WEIGHT, cost, mu)
        ratio = force_ratio(force, WEIGHT)
        assert (ratio <= mu * (1.0 + 1e-9)).all()
        acts = (share > 0.0) & (share < 1.0)
        np.testing.assert_allclose(ratio[acts].max(axis=-1), mu, rtol=1e-9)
        limited += int(acts.sum())
    assert limited > 50
    assert (holding_forces(j, r, g, w, WEIGHT, cost, 0.0).share == 0.0).all()


def test_a_foot_without_a_weight_carries_nothing_and_does_so_continuously() -> None:
    j, r, g, w, cost = feet(6)
    for split in (
        lambda w: least_torque_split(j, r, g, w, WEIGHT, cost),
        lambda w: vertical_split(r, w, WEIGHT),
    ):
        without = w.copy()
        without[2] = 0.0
        little = w.copy()
        little[2] = 1e-6
        assert (split(without)[2] == 0.0).all()
        # in proportion to the weight: 1e-6 of a force below ten times the load
        assert np.abs(split(little) - split(without)).max() < 1e-5 * np.linalg.norm(WEIGHT) * 10.0


def test_weights_are_centred_on_touch_down_and_lift_off() -> None:
    duty, period, transfer = 0.6, 1.5, 0.1
    at = np.array([0.0, duty, 0.3, 0.8, transfer / period / 2, 1.0 - transfer / period / 2])
    weight = load_weights(at, duty, period, transfer)
    np.testing.assert_allclose(weight, [0.5, 0.5, 1.0, 0.0, 1.0, 0.0], atol=1e-12)
    age = np.linspace(0.0, 1.0, 5001)
    found = load_weights(age, duty, period, transfer)
    slope = np.abs(np.diff(found)).max() / (period * (age[1] - age[0]))
    assert slope == pytest.approx(1.875 / transfer, rel=1e-3)  # of a quintic step


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda f: vertical_split(f.lever, [1, 1, 0, 0, 0, 0], WEIGHT), "weight"),
        (lambda f: holding_forces(*f[:4], WEIGHT, f.cost, -0.1), "mu"),
        (lambda f: vertical_split(f.lever, f.weight, np.zeros(3)), "load"),
        (lambda f: load_weights(0.1, 0.5, 1.0, 0.0), "transfer"),
        (lambda f: cone_share(f.lever, f.lever, WEIGHT, np.nan), "cone_share.mu"),
    ],
)
def test_what_cannot_be_is_refused(call, name: str) -> None:
    with refused(ParameterError, name):
        call(feet(6))
