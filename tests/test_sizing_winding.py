"""Winding temperatures: step response, steady state with feedback, run-away, and a walk."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.results.sizing.winding import Winding
from tests.sizing_cases import OMEGA, cycle, demand, full, of_motion, record

MOTOR = Winding(2.0, 4.0, 10.0, 5.0, 300.0)  # ohm, K/W, K/W, s, s
THERMAL = dict(
    winding_resistance=2.0, torque_constant=0.01, thermal_resistance_winding=4.0,
    thermal_resistance_housing=10.0, thermal_time_winding=5.0, thermal_time_housing=300.0,
    winding_temperature_max=85.0,
)  # fmt: skip


def test_a_step_of_current_heats_by_one_less_an_exponential() -> None:
    """A housing that stays cold, no feedback: P R (1 - exp(-t / time constant))."""
    cold = Winding(2.0, 4.0, 1e-9, 5.0, 300.0, copper=0.0)
    times = np.array([0.0, 1.0, 5.0, 50.0])
    rise = cold.course(0.5, times, ambient=20.0) - 20.0
    assert rise == pytest.approx(0.5 * 2.0 * 4.0 * (1.0 - np.exp(-times / 5.0)), rel=1e-6)


def test_both_bodies_with_a_growing_resistance_against_an_integrator() -> None:
    """C_w = 5 s / 4 K/W, C_h = 300 s / 10 K/W; the printed equations, by another solver."""
    square = 0.9

    def slope(_: float, t: np.ndarray) -> list[float]:
        power = square * 2.0 * (1.0 + 0.0039 * (t[0] - 25.0))
        out = (t[0] - t[1]) / 4.0
        return [(power - out) / 1.25, (out - (t[1] - 30.0) / 10.0) / 30.0]

    times = np.array([1.0, 20.0, 400.0, 3000.0])
    reference = solve_ivp(slope, (0, 3000), [30.0, 30.0], "LSODA", times, rtol=1e-10, atol=1e-10)
    assert MOTOR.course(square, times, ambient=30.0) == pytest.approx(reference.y[0], rel=1e-7)
    end = MOTOR.course(square, np.array([1e5]), ambient=30.0)[0]
    assert MOTOR.lasting(square, ambient=30.0) == pytest.approx(end, rel=1e-9)


def test_a_steady_state_by_hand_and_a_run_away() -> None:
    """P 14 K/W (1 + 0.0039 (T - 25)) = T - 25: at 1 A^2 28 K / (1 - 0.1092)."""
    assert MOTOR.lasting(1.0) == pytest.approx(25.0 + 28.0 / (1.0 - 0.0039 * 28.0))
    assert MOTOR.lasting(1.0 / (0.0039 * 28.0) + 1e-6) == np.inf


def test_a_joint_heats_its_winding_through_the_gear() -> None:
    """1 N m at 100:1 and 0.01 N m/A is 1 A; constants are missing of most motors."""
    time = cycle()
    found = of_motion(np.ones_like(time), np.zeros_like(time), time)
    hot = hp.motor_budget(found, record(**THERMAL), full(), ambient=60.0)
    expected = 60.0 + 28.0 * (1.0 + 0.0039 * 35.0) / (1.0 - 0.0039 * 28.0)
    assert hot.joints[0].winding_temperature == pytest.approx(expected, rel=1e-9)
    assert not hot.passes and "96 deg C, 85 are allowed" in hot.reasons[0]
    cool = hp.motor_budget(found, record(**THERMAL), full()).joints[0]
    assert cool.winding_temperature < 85.0 and cool.passes
    for name in ("winding_resistance", "torque_constant", "thermal_time_housing"):
        row = hp.motor_budget(found, record(**THERMAL | {name: None}), full()).joints[0]
        assert row.winding_temperature == "unknown", name


def test_a_load_that_comes_and_goes_heats_above_its_mean() -> None:
    """The winding follows: mean rise, and 4 K/W times what the lag exceeds the mean."""
    time = cycle()
    found = of_motion(np.sin(OMEGA * time), np.zeros_like(time), time)
    row = hp.motor_budget(found, record(**THERMAL), full()).joints[0]
    mean = MOTOR.lasting(0.5)
    ripple = 0.5 / np.sqrt(1.0 + (2.0 * OMEGA * 5.0) ** 2)  # of sin^2 behind 5 s
    loss = 2.0 * (1.0 + 0.0039 * (mean - 25.0))
    assert row.winding_temperature == pytest.approx(mean + 4.0 * loss * ripple, rel=1e-6)


def test_a_walk_again_from_its_arrays() -> None:
    """An integration of the winding over many cycles, the housing at its mean."""
    found, motor = demand(), record(**THERMAL)
    budget = hp.motor_budget(found, motor)
    j = int(np.argmax(found.torque_rms))
    square = found.torque[:, j] ** 2  # 1 A per N m
    mean = np.trapezoid(square, found.time) / (found.time[-1] - found.time[0])
    lasting = 25.0 + 28.0 * mean / (1.0 - 0.0039 * 28.0 * mean)
    power = 2.0 * (1.0 + 0.0039 * (lasting - 25.0)) * square
    housing = 25.0 + 10.0 * np.trapezoid(power, found.time) / (found.time[-1] - found.time[0])
    hot, most, steps = lasting, -np.inf, np.diff(found.time)
    for _ in range(30):
        for k, step in enumerate(steps):
            hot += step * (0.5 * (power[k] + power[k + 1]) - (hot - housing) / 4.0) / 1.25
            most = max(most, hot) if _ == 29 else most
    assert budget.joints[j].winding_temperature == pytest.approx(most, rel=5e-3)
