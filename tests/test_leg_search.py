"""Inverse kinematics of legs of any shape in the core, against Newton steps in NumPy and SciPy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import least_squares

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, ReachError
from hexapod_pin.robot.leg_geometry import POSITION_TOLERANCE, travel_and_height
from hexapod_pin.robot.leg_kinematics import LegKinematics

SEEDS = range(9)
JOINTS = (2, 3)


def random_leg(joints: int, rng: np.random.Generator, *, limits: bool = True) -> LegKinematics:
    """Return a leg with axes in any direction, its standing posture inside its limits."""
    axes = rng.normal(size=(joints, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    points = np.cumsum(rng.uniform(-0.15, 0.15, (joints + 1, 3)), axis=0)
    lower, upper = rng.uniform(-2.0, -0.3, joints), rng.uniform(0.3, 2.0, joints)
    free = np.full(joints, np.inf)
    return LegKinematics(
        name="odd", joints=("a", "b", "c")[:joints], axes=axes, origins=points[:-1],
        foot=points[-1], lower=lower if limits else -free, upper=upper if limits else free,
        posture=rng.uniform(0.5 * lower, 0.5 * upper), closed_form=None,
        task=travel_and_height(rng.normal(size=3)) if joints == 2 else None,
    )  # fmt: skip


def scipy_search(leg: LegKinematics, target: Array, near: Array, limits: bool) -> tuple[Array, Any]:
    """Return the least-squares solution for one target, and its distance [m]."""
    bounds: Any = (leg.lower, leg.upper) if limits else (-np.inf, np.inf)
    found = least_squares(
        lambda q: leg.followed(leg.forward(q) - target),
        np.clip(near, *bounds),
        jac=lambda q: leg.followed(leg.jacobian(q).T).T,
        bounds=bounds, xtol=1e-15, ftol=1e-15, gtol=1e-15,
    )  # fmt: skip
    return found.x, np.linalg.norm(found.fun)


def newton(leg: LegKinematics, target: Array, q: Array) -> tuple[Array, Any]:
    """Return where 12 damped Newton steps of at most 0.3 rad lead, and its distance [m]."""
    for _ in range(12):
        jacobian = leg.followed(leg.jacobian(q).T).T
        missed = leg.followed(target - leg.forward(q))
        normal = jacobian.T @ jacobian + 1e-14 * np.eye(len(q))
        q = q + np.clip(np.linalg.solve(normal, jacobian.T @ missed), -0.3, 0.3)
    return q, np.linalg.norm(leg.followed(target - leg.forward(q)))


def expected_one(leg: LegKinematics, target: Array, near: Array, limits: bool) -> Array:
    """Return the angles for one target: by Newton steps that stay near, or by search."""
    q, distance = newton(leg, target, near)
    inside = not limits or ((q >= leg.lower) & (q <= leg.upper)).all()
    if inside and distance <= POSITION_TOLERANCE and np.abs(q - near).max() < 1.0:
        return q
    q, distance = scipy_search(leg, target, near, limits)
    if distance > POSITION_TOLERANCE:
        raise ReachError(leg.name, "", float(distance))
    return q


def expected(leg: LegKinematics, targets: Array, near: Array, limits: bool) -> Array:
    first = expected_one(leg, targets[0], near, limits)
    path = [newton(leg, targets[0], first)[0]]
    for target in targets[1:]:
        q, distance = newton(leg, target, first)
        if distance > POSITION_TOLERANCE or np.abs(q - path[-1]).max() >= 0.2:
            q = expected_one(leg, target, path[-1], limits)
        path.append(q)
    angles = np.array(path)
    if limits and ((angles < leg.lower - 1e-9) | (angles > leg.upper + 1e-9)).any():
        raise ReachError(leg.name, "", 0.0)
    return angles


@pytest.mark.parametrize(("joints", "limits"), [(2, False), (3, True)])
def test_any_targets_have_the_oracles_angles_or_its_excess(joints: int, limits: bool) -> None:
    reached, excess = 0, set()
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        leg = random_leg(joints, rng)
        targets = leg.forward(1.1 * rng.uniform(leg.lower, leg.upper, (6, joints)))
        targets[5] *= 4.0
        for part in (targets, targets[:5], targets[2:4], targets[1:2]):
            try:
                wanted = expected(leg, part, leg.posture, limits)
            except ReachError as error:
                with pytest.raises(ReachError) as caught:
                    leg.inverse(part, limits=limits)
                assert caught.value.excess == pytest.approx(error.excess, rel=1e-9)
                alone = [scipy_search(leg, p, leg.posture, False)[1] for p in part]
                alone = np.where(np.array(alone) <= POSITION_TOLERANCE, 0.0, alone)
                np.testing.assert_allclose(leg.excess(part), alone, rtol=1e-9, atol=1e-12)
                excess.add(error.excess)
                continue
            found = leg.inverse(part, limits=limits)
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-9)
            reached += 1
    assert reached > 8 and len(excess) > 8


@pytest.mark.parametrize("joints", JOINTS)
def test_a_smooth_path_is_followed_back_to_its_angles(joints: int) -> None:
    s = np.linspace(0.0, 1.0, 60)[:, None]
    followed = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        leg = random_leg(joints, rng)
        ends = rng.uniform(leg.lower, leg.upper, (2, joints))
        q = ends[0] + s * (ends[1] - ends[0])
        jacobian = leg.followed(np.swapaxes(leg.jacobian(q), -1, -2))
        if np.linalg.cond(jacobian).max() > 30.0:
            continue
        np.testing.assert_allclose(leg.inverse(leg.forward(q), near=q[0]), q, atol=1e-9)
        followed += 1
    assert followed >= 3


def test_unrelated_targets_are_solved_each_from_its_own_reference() -> None:
    rng = np.random.default_rng(4)
    leg = random_leg(3, rng)
    q = rng.uniform(leg.lower, leg.upper, (20, 3))
    p_BF, near = leg.forward(q), np.clip(q + 0.02, leg.lower, leg.upper)
    found = leg.inverse_each(p_BF, near)
    alone = [leg.inverse(p, near=start) for p, start in zip(p_BF, near, strict=True)]
    np.testing.assert_allclose(found, alone, rtol=0.0, atol=1e-9)
    p_BF[7, 2] += 9.0
    p_BF[9, 2] += 5.0
    with refused(ReachError, leg="odd", about=(f"{p_BF[7, 2]:.4f}",)):
        leg.inverse_each(p_BF, near)
    for odd in ([0.1, 0.2], [[0.1, 0.2, 0.3]] * 2, [np.nan, 0.0, 0.0], "near"):
        with refused(ParameterError):
            leg.inverse(p_BF[0], near=odd)


def test_a_leg_that_is_singular_everywhere_reaches_its_plane() -> None:
    """Three parallel axes: the angles are not unique, the foot's place and the excess are."""
    y = np.array([0.0, 1.0, 0.0])
    leg = replace(
        random_leg(3, np.random.default_rng(1), limits=False),
        axes=np.array([y, y, y]),
        origins=np.array([[0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.1]]),
        foot=np.array([0.4, 0.0, -0.1]),
    )
    q = np.random.default_rng(2).uniform(-1.0, 1.0, (20, 3))
    p_BF = leg.forward(q)
    found = leg.inverse(p_BF)
    np.testing.assert_allclose(leg.forward(found), p_BF, rtol=0.0, atol=POSITION_TOLERANCE)
    np.testing.assert_allclose(leg.excess(p_BF + 0.02 * y), 0.02, atol=1e-12)
    with refused(ReachError, leg="odd", excess=pytest.approx(0.02, abs=1e-12)):
        leg.inverse(p_BF + 0.02 * y)
