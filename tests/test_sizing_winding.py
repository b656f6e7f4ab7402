"""Winding temperatures: step response, steady state with feedback, run-away, and a walk."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.drive.winding import MAGNET, Winding, assumed_constants
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.sizing.winding import SPREAD, lasting_torque_of
from tests.sizing_cases import OMEGA, cycle, demand, full, of_motion, record

MOTOR = Winding(2.0, 4.0, 10.0, 5.0, 300.0)  # ohm, K/W, K/W, s, s
THERMAL = dict(
    winding_resistance=2.0, torque_constant=0.01, thermal_resistance_winding=4.0,
    thermal_resistance_housing=10.0, thermal_time_winding=5.0, thermal_time_housing=300.0,
    winding_temperature_max=85.0,
)  # fmt: skip


def test_a_steady_state_by_hand_and_a_run_away() -> None:
    """P 14 K/W (1 + 0.0039 (T - 25)) = T - 25: at 1 A^2 28 K / (1 - 0.1092)."""
    assert MOTOR.lasting(1.0) == pytest.approx(25.0 + 28.0 / (1.0 - 0.0039 * 28.0))
    assert MOTOR.lasting(1.0 / (0.0039 * 28.0) + 1e-6) == np.inf


def test_a_joint_heats_its_winding_through_the_gear() -> None:
    """1 N m at 100:1 and 0.01 N m/A is 1 A; constants are missing of most motors."""
    time = cycle()
    found = of_motion(np.ones_like(time), np.zeros_like(time), time)
    hot = hp.motor_budget(found, record(**THERMAL), full(), ambient=60.0)
    loss = 0.0
    for _ in range(200):  # 2 ohm of copper and magnets at their temperatures, 14 K/W
        flux = 1.0 - MAGNET * (60.0 + 10.0 * loss - 25.0)
        loss = 2.0 * (1.0 + 0.0039 * (60.0 + 14.0 * loss - 25.0)) / flux**2
    expected = 60.0 + 14.0 * loss
    assert hot.joints[0].winding_temperature == pytest.approx(expected, rel=1e-9)
    assert not hot.passes and f"{expected:.0f} deg C, 85 are allowed" in hot.reasons[0]
    assert hot.joints[0].thermal_source == "published"
    cool = hp.motor_budget(found, record(**THERMAL), full()).joints[0]
    assert cool.winding_temperature < 85.0 and cool.passes
    row = hp.motor_budget(found, record(**THERMAL | {"torque_constant": None}), full()).joints[0]
    assert row.thermal_source == "assumed"
    row = hp.motor_budget(found, record(stall_current=None), full()).joints[0]
    assert row.winding_temperature == "unknown" and row.thermal_source == "unknown"


def test_a_load_that_comes_and_goes_heats_above_its_mean() -> None:
    """The winding follows: mean rise, and 4 K/W times what the lag exceeds the mean."""
    time = cycle()
    found = of_motion(np.sin(OMEGA * time), np.zeros_like(time), time)
    row = hp.motor_budget(found, record(**THERMAL), full()).joints[0]
    warm = dataclasses.replace(MOTOR, magnet=MAGNET)
    mean = warm.lasting(0.5)
    ripple = 0.5 / np.sqrt(1.0 + (2.0 * OMEGA * 5.0) ** 2)  # of sin^2 behind 5 s
    flux = 1.0 - MAGNET * 10.0 / 14.0 * (mean - 25.0)
    loss = 2.0 * (1.0 + 0.0039 * (mean - 25.0)) / flux**2
    assert row.winding_temperature == pytest.approx(mean + 4.0 * loss * ripple, rel=1e-6)


def test_ten_minutes_of_a_run_against_its_steady_cycle() -> None:
    """A walk of 600 s, its windings followed at every step: within 2 % of each rise."""
    motor = hp.Motor(
        stall_torque=6.0, no_load_speed=6.6, gear_ratio=200.0, torque_constant=0.008,
        winding_resistance=2.3, thermal_resistance_winding=4.0, thermal_resistance_housing=10.0,
        thermal_time_winding=12.0, thermal_time_housing=300.0,
    )  # fmt: skip
    columns = {name: getattr(motor, name) for name in THERMAL if hasattr(motor, name)}
    row = record(**columns, gear_ratio=200.0, winding_temperature_max=100.0)
    robot = hp.load_robot("kharagpur")
    servo = hp.Servo.for_robot(robot).model_copy(update={"motor": motor})
    scene, gait = hp.Scene(robot, servo=servo), hp.Gait.tripod(stroke=0.06, cycle_time=1.0)
    settings = {"method": "robust", "step": 5e-3, "record": ["motion", "torque", "temperature"]}
    control = hp.KinematicControl(gait)
    full = hp.simulate(scene, control, duration=600.0, sample=1.0, **settings)
    cycle = hp.simulate(scene, control, duration=5.0, **settings)
    heat = hp.sizing.walking_heat(hp.sizing.joint_demand(cycle), row, duration=600.0)
    assert heat.published.all() and full.temperature[-1].max() > 30.0
    for k in (len(heat.time) // 2, -1):
        rise = full.temperature[int(round(heat.time[k]))] - 25.0
        np.testing.assert_allclose(heat.winding[k] - 25.0, rise, rtol=0.02)
    assert (heat.winding_cool == heat.winding[-1]).all()


def test_the_step_response_of_two_bodies_and_their_magnets() -> None:
    """Without feedback two exponentials; with copper and magnets an integrator, to 1e-3."""
    plain = dataclasses.replace(MOTOR, copper=0.0)
    times, power = np.array([3.0, 60.0, 600.0]), 0.7 * 2.0
    rates, shapes = np.linalg.eig([[-1 / 5.0, 1 / 5.0], [1 / 120.0, -1 / 120.0 - 1 / 300.0]])
    end = power * np.array([14.0, 10.0])
    parts = np.linalg.solve(shapes, -end)
    rise = [end[0] + float(shapes[0] @ (parts * np.exp(rates * t))) for t in times]
    assert plain.course(0.7, times) - 25.0 == pytest.approx(rise, rel=1e-9)
    warm = dataclasses.replace(MOTOR, magnet=MAGNET)

    def slope(_: float, t: np.ndarray) -> list[float]:
        made = 1.8 * (1.0 + 0.0039 * (t[0] - 25.0)) / (1.0 - MAGNET * (t[1] - 25.0)) ** 2
        out = (t[0] - t[1]) / 4.0
        return [(made - out) / 1.25, (out - (t[1] - 30.0) / 10.0) / 30.0]

    reference = solve_ivp(slope, (0, 600), [30.0, 30.0], "LSODA", times, rtol=1e-9, atol=1e-9)
    assert warm.course(0.9, times, ambient=30.0) == pytest.approx(reference.y[0], rel=1e-3)
    assert warm.course(0.9, np.array([1.2e4]))[0] == pytest.approx(warm.lasting(0.9), rel=1e-9)
    assert np.isinf(warm.course(9.0, np.array([2e3]))[0]) and np.isinf(warm.lasting(9.0))


def test_assumed_constants_scale_with_the_mass_and_their_spread_reaches_the_verdict() -> None:
    """1.5 and 2 K/W at 1 kg; a motor of 1/8 kg has four times that, and half the time constants."""
    assert assumed_constants(1.0) == pytest.approx((1.5, 2.0, 22.5, 1600.0))
    assert assumed_constants(0.125) == pytest.approx((6.0, 8.0, 11.25, 800.0))
    time = cycle(100)

    def row(torque: float, **more: object) -> hp.sizing.MotorUse:
        found = of_motion(np.full_like(time, torque), np.zeros_like(time), time)
        return hp.motor_budget(found, record(**more), full(continuous=0.2)).joints[0]

    light, middle, heavy = row(0.2), row(0.55), row(1.6)
    assert (light.verdict, middle.verdict, heavy.verdict) == ("passes", "doubtful", "FAILS")
    assert middle.winding_cool < 100.0 < middle.winding_hot and not middle.passes
    assert "doubtful: winding at" in middle.reasons[0] and heavy.winding_cool > 100.0
    ohm, square = 12.0 / 3.0, (0.2 * 1.5) ** 2  # 0.05 kg
    for end, factor in ((light.winding_cool, 1 / SPREAD), (light.winding_hot, SPREAD)):
        whole = Winding(ohm, *assumed_constants(0.05, factor), magnet=MAGNET)
        assert end == pytest.approx(whole.lasting(square), rel=1e-9)
    assert row(0.2, mass=None).winding_hot is None and row(0.55, mass=None).verdict == "FAILS"


def test_a_published_limit_gives_the_lasting_torque_of_any_maker() -> None:
    """The torque at which the winding is at its limit in the end: 85 deg C of 25."""
    torque = lasting_torque_of(record(**THERMAL, rated_torque=0.3), full(continuous=0.2))
    warm = dataclasses.replace(MOTOR, magnet=MAGNET)
    assert warm.lasting(torque**2) == pytest.approx(85.0, rel=1e-9)  # 1 A per N m
    assert lasting_torque_of(record(rated_torque=0.3), full(continuous=0.2)) == pytest.approx(0.4)
    with pytest.raises(ParameterError, match="duration"):
        hp.sizing.walking_heat(demand(), record(), duration=0.0)
