"""Inverse kinematics of legs of any shape in the core, against searches by SciPy."""

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


def nearest_distance(leg: LegKinematics, target: Array, limits: bool) -> float:
    """Return how far the leg stays from a target by SciPy's search from its posture [m]."""
    bounds: Any = (leg.lower, leg.upper) if limits else (-np.inf, np.inf)
    found = least_squares(
        lambda q: leg.followed(leg.forward(q) - target), leg.posture, bounds=bounds,
        jac=lambda q: leg.followed(leg.jacobian(q).T).T, xtol=1e-15, ftol=1e-15, gtol=1e-15,
    )  # fmt: skip
    distance = float(np.linalg.norm(found.fun))
    return 0.0 if distance <= POSITION_TOLERANCE else distance


@pytest.mark.parametrize(("joints", "limits"), [(2, False), (3, True)])
def test_any_target_is_reached_or_has_the_excess_of_a_search(joints: int, limits: bool) -> None:
    reached = beyond = 0
    for seed in range(9):
        rng = np.random.default_rng(seed)
        leg = random_leg(joints, rng)
        targets = leg.forward(1.1 * rng.uniform(leg.lower, leg.upper, (6, joints)))
        targets[5] *= 4.0
        free = [nearest_distance(leg, p, False) for p in targets]
        np.testing.assert_allclose(leg.excess(targets), free, rtol=1e-9, atol=1e-12)
        for target in targets:
            distance = nearest_distance(leg, target, limits)
            if distance > 0.0:
                with pytest.raises(ReachError) as caught:
                    leg.inverse(target, limits=limits)
                assert caught.value.excess == pytest.approx(distance, rel=1e-9)
                beyond += 1
                continue
            q = leg.inverse(target, limits=limits)
            assert np.abs(leg.followed(leg.forward(q) - target)).max() <= POSITION_TOLERANCE
            assert not limits or ((q >= leg.lower - 1e-9) & (q <= leg.upper + 1e-9)).all()
            reached += 1
    assert reached > 8 and beyond > 8


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
