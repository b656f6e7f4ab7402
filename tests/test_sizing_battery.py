"""What the battery gives to all joints together: antiphase, regeneration, and a walk again."""

from __future__ import annotations

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from tests.sizing_cases import OMEGA, cycle, demand, full, of_motion, record


def loaded(torque: np.ndarray, speed: np.ndarray, **more: object) -> hp.sizing.BatteryLoad:
    """Return the load of the motor of 2 N m, 8 rad/s, 3 A at 12 V, not derated."""
    found = of_motion(torque, speed, cycle(), **more)
    return hp.motor_budget(found, record(), full()).battery


def test_two_joints_in_antiphase_share_the_battery() -> None:
    """At rest the power is V I0 (tau / T0)^2: sin^2 and cos^2 add up to a constant."""
    phase = OMEGA * cycle()
    torque = 1.0 * np.column_stack([np.sin(phase), np.cos(phase)])
    load = loaded(torque, np.zeros_like(torque))
    one = 3.0 * (1.0 / 2.0) ** 2  # A
    assert load.current_peak == pytest.approx(one, rel=1e-9)
    assert load.sum_of_peaks == pytest.approx(2.0 * one, rel=1e-9)
    assert load.current_mean == pytest.approx(one) and load.current_rms == pytest.approx(one)
    assert load.power_mean == pytest.approx(12.0 * one) and load.energy == pytest.approx(12.0 * one)


def test_braking_gives_back_or_is_lost() -> None:
    """Tau -0.5, w 4: d = 0.25, i = -0.75 A, 12 V d i = -2.25 W for half of the time."""
    brakes = (cycle() % 1.0 < 0.5)[:, None]
    torque, speed = np.where(brakes, -0.5, 0.5), np.full((2001, 1), 4.0)
    load = loaded(torque, speed)
    drives = 12.0 * (0.25 + 0.5) * 0.75
    assert load.power_mean == pytest.approx(drives / 2.0, rel=2e-3)
    assert load.power_mean_regeneration == pytest.approx((drives - 2.25) / 2.0, rel=2e-3)
    assert load.power_peak == pytest.approx(drives)
    moving = loaded(torque, speed, weight=10.0, distance=0.1)
    assert moving.cost_of_transport == pytest.approx(load.energy / 1.0)
    assert moving.cost_of_transport_regeneration == pytest.approx(load.energy_regeneration / 1.0)


def test_mechanical_power_and_winding_loss_make_up_the_electrical_power() -> None:
    """Of a row that is one linear motor, V d i = R i^2 + tau w with R = V / I0 = 4 ohm."""
    phase = OMEGA * cycle()
    torque, speed = np.sin(phase)[:, None], (2.0 + np.cos(phase))[:, None]
    found = of_motion(torque, speed, cycle())
    motor = record(stall_torque=12.0 * 3.0 / 8.0)  # T0 w0 = V I0
    load = hp.motor_budget(found, motor, full()).battery
    current = 3.0 * torque[:-1, 0] / motor.stall_torque
    power = 4.0 * current**2 + torque[:-1, 0] * speed[:-1, 0]
    assert load.power_mean_regeneration == pytest.approx(power.mean(), rel=1e-9)
    assert load.power_mean == pytest.approx(np.maximum(power, 0.0).mean(), rel=1e-3)


def test_standby_currents_and_a_sagging_battery() -> None:
    still = of_motion(np.zeros((2001, 3)), np.zeros((2001, 3)), cycle())
    load = hp.motor_budget(still, record(standby_current=0.05), full(voltage=0.9)).battery
    assert load.current_mean == pytest.approx(0.15) and load.voltage == pytest.approx(10.8)
    assert load.run_time(16.2 * 3600.0) == pytest.approx(36000.0)  # 16.2 Wh at 1.62 W
    for bus, current in (("TTL", 0.04), ("PWM", 0.01)):  # assumed of makers that state none
        budget = hp.motor_budget(still, record(standby_current=None, bus=bus), full())
        assert budget.battery.current_mean == pytest.approx(3 * current)
        assert any("assumed: standby current" in note for note in budget.notes)


def test_what_is_not_published_is_unknown() -> None:
    ones = np.ones((2001, 2))
    found = of_motion(ones, 0.0 * ones, cycle(), joint_kinds=["coxa", "femur"])
    none = hp.motor_budget(found, record(stall_current=None)).battery
    assert none.current_peak is None and none.run_time(1e5) is None and "M at 12 V" in none.unknown
    mixed = hp.motor_budget(found, {"coxa": record(), "femur": record(voltage=7.4)}).battery
    assert mixed.power_mean is None and "7.4 V and 12 V" in mixed.unknown


def test_a_walk_again_from_its_arrays() -> None:
    """Sample by sample, joint by joint, in another order; the derated supply carries it."""
    found = demand()
    load = hp.motor_budget(found, record(stall_torque=4.0, standby_current=0.02)).battery
    total, peaks = np.zeros(len(found.time)), 0.0
    for j in range(18):
        current = 3.0 * found.torque[:, j] / 4.0
        voltage = 12.0 * (found.torque[:, j] / 4.0 + found.speed[:, j] / 8.0)
        own = np.clip(voltage * current, 0.0, None)
        total, peaks = total + own, peaks + own.max()
    total += 18 * 0.02 * 10.8
    assert load.current_peak == pytest.approx(total.max() / 10.8, rel=1e-12)
    assert load.sum_of_peaks == pytest.approx(peaks / 10.8 + 0.36, rel=1e-12)
    mean = np.trapezoid(total, found.time) / (found.time[-1] - found.time[0])
    assert load.power_mean == pytest.approx(mean, rel=1e-12)
    assert load.energy == pytest.approx(0.6 * mean, rel=1e-6)  # a cycle of 0.6 s
    assert load.cost_of_transport == pytest.approx(load.energy / (found.weight * found.distance))


def test_a_pack_sags_by_the_current_of_all_motors_together() -> None:
    """U^2 - U0 U + r P = 0 of a constant power, at each sample; the line falls with U."""
    time = cycle(10)
    ones = np.ones((11, 1))
    found = of_motion(0.8 * ones, 4.0 * ones, time)
    budget = hp.motor_budget(found, record(), full(), pack_resistance=1.5)
    power = 12.0 * (0.8 / 2.0 + 4.0 / 8.0) * (3.0 * 0.8 / 2.0)
    volts = 6.0 + np.sqrt(36.0 - 1.5 * power)
    load = budget.battery
    assert load.voltage_least == pytest.approx(volts) and load.voltage == pytest.approx(12.0)
    assert load.current_peak == pytest.approx((12.0 - volts) / 1.5)  # the line of a resistance
    assert load.power_mean == pytest.approx(12.0 * load.current_mean) and not load.overloaded_share
    row = budget.joints[0]
    assert row.peak_use == pytest.approx(0.8 / (2.0 * (volts / 12.0 - 0.5)))
    assert row.speed_use == pytest.approx(4.0 / (8.0 * volts / 12.0))
    assert f"battery: {volts:.3g} V at least of 12 V, " in load.sag_line
    assert hp.motor_budget(found, record(), full()).passes and not budget.passes


def test_a_pack_that_cannot_give_the_power_says_so() -> None:
    """R P above U0^2 / 4: at half the voltage it gives most; a resistance that is none is refused.

    Standby currents load it too: 3 motors of 0.4 A at rest, 12 V - 1.2 A x 2 ohm.
    """
    ones = np.ones((11, 1))
    found = of_motion(1.0 * ones, 4.0 * ones, cycle(10))
    load = hp.motor_budget(found, record(), full(), pack_resistance=3.0).battery
    assert load.overloaded_share == pytest.approx(1.0) and load.voltage_least == pytest.approx(6.0)
    still = of_motion(np.zeros((11, 3)), np.zeros((11, 3)), cycle(10))
    load = hp.motor_budget(still, record(standby_current=0.4), full(), pack_resistance=2.0).battery
    assert load.voltage_least == pytest.approx(9.6)
    with pytest.raises(ParameterError, match="pack_resistance"):
        hp.motor_budget(found, record(), pack_resistance=-0.1)
