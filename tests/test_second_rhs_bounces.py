"""Bounces whose force the clamp takes away and gives back within one contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracles.second_rhs import integrate
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.validation.cases.bodies import on_ground, particle, state

LAW = hp.contact.AdamsImpact(stiffness=6e8, exponent=1.5, damping=1132.0, damping_depth=1.16e-4)
GRAVITY, DROP, END = 9.81, 0.05, 0.4
TIMES = np.linspace(0.0, END, 9)


def one_unknown() -> Array:
    """Return heights (9,) [m] of 1 kg: parabolas, and F - m g in steps of 1 us below."""

    def rate(_: float, y: Array) -> tuple[float, float]:
        depth = max(-y[0], 0.0)
        share = min(depth / LAW.damping_depth, 1.0)
        damping = LAW.damping * share**2 * (3.0 - 2.0 * share)
        return y[1], max(0.0, LAW.stiffness * depth**1.5 - damping * y[1]) - GRAVITY

    def leaves(_: float, y: Array) -> float:
        return float(y[0])

    leaves.terminal, leaves.direction = True, 1.0  # type: ignore[attr-defined]
    heights, t, z, v = np.zeros(9), 0.0, DROP, 0.0
    while True:
        fall = (v + math.sqrt(v * v + 2.0 * GRAVITY * z)) / GRAVITY
        flown = TIMES - t
        air = (flown >= 0.0) & (flown <= fall)
        heights[air] = (z + v * flown - 0.5 * GRAVITY * flown**2)[air]
        if t + fall >= END:
            return heights
        touch = (-1e-18, v - GRAVITY * fall)
        found = solve_ivp(
            rate, (t + fall, t + fall + 0.01), touch, method="DOP853",
            rtol=2.3e-14, atol=1e-17, events=[leaves], max_step=1e-6,
        )  # fmt: skip
        t, z, v = float(found.t[-1]), 0.0, float(found.y[1, -1])


@pytest.fixture(scope="module")
def heights() -> Array:
    """Of the equation in one unknown."""
    return one_unknown()


def bouncing() -> tuple[hp.Scene, hp.State]:
    """Return the scene and its start."""
    robot = particle()
    assert robot.total_mass == pytest.approx(1.0, rel=1e-15)
    return on_ground(robot, LAW), state(robot, (0.0, 0.0, DROP))


def test_the_second_right_hand_side(heights: Array) -> None:
    """In the first bounce the clamp acts, until near the surface the spring presses again."""
    scene, start = bouncing()
    run = integrate(
        scene, hp.HoldPosture(), duration=END, initial=start, sample=END / 8, tolerance=1e-12
    )
    assert [run.count(what) for what in ("touching", "pushes", "deep")] == [8, 2, 6]
    np.testing.assert_allclose(run.q[:, 2], heights, atol=2e-12)


@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
@pytest.mark.parametrize("method", ["extrapolated-euler", "ndf", "dop853"])
def test_the_core_keeps_its_accuracy(heights: Array, method: str, accuracy: float) -> None:
    """Over four bounces."""
    scene, start = bouncing()
    run = hp.simulate(
        scene, hp.HoldPosture(), duration=END, initial=start, sample=END / 8, method=method,
        accuracy=accuracy,
    )  # fmt: skip
    assert np.abs(run.q[:, 2] - heights).max() < accuracy
    assert run.accuracy_kept
