"""The position loop of bus servos: registers, dead band, limits; steps against exact solutions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.linalg import expm

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from tests.vehicles import FREE, heavy_leg

INERTIA = 2e-3  # of the light link about its joint, kg m^2
JOINT = "c_joint"
MOTOR = hp.Motor(stall_torque=2.0, no_load_speed=6.0, torque_constant=0.01, gear_ratio=200.0)
STALL, EMF = 2.0, 2.0 / 6.0  # N m, N m s/rad
FINE = 2**24  # counts, of an encoder that no result can tell from a continuous one


def loop(**changes: Any) -> hp.drive.Firmware:
    gains = {"proportional": 4.0, "integral": 6.0, "derivative": 0.02, "counts": FINE}
    return hp.drive.Firmware(**{**gains, **changes})


def run(
    control: Any, servo: hp.Servo, *, duration: float = 0.2, push: float = 0.0,
    angle: float = 0.0, sample: float = 0.01,
) -> hp.Trace:  # fmt: skip
    """Return a run of the light joint from rest at an angle [rad], under a torque [N m]."""
    robot = heavy_leg(1.0)
    loads = [hp.Push("c", torque=(0.0, push, 0.0), start=0.0, duration=100.0)] if push else []
    scene = hp.Scene(robot, servo=servo, gravity=(0.0, 0.0, 0.0), stops=FREE, loads=loads)
    q = robot.stand({JOINT: angle}).q.copy()
    q[2] += 10.0
    return hp.simulate(
        scene, control, duration=duration, sample=sample, method="dop853", accuracy=1e-9,
        initial=robot.check_state(q, np.zeros(9)),
    )  # fmt: skip


def driven(firmware: hp.drive.Firmware) -> hp.Servo:
    one, rest = firmware.driven(MOTOR), {"a_joint": 0.0, "b_joint": 0.0}
    return hp.Servo(
        kp={**rest, JOINT: one.kp}, kd={**rest, JOINT: one.kd}, motor={JOINT: one.motor},
        limited=False,
    )  # fmt: skip


def held(target: float, firmware: hp.drive.Firmware, **given: Any) -> hp.FirmwareControl:
    return hp.FirmwareControl(hp.HoldPosture((0.0, 0.0, target)), firmware, **given)


def exact_step(firmware: hp.drive.Firmware, target: float, until: float) -> np.ndarray:
    h, late, count = firmware.period, firmware.delay, 2.0 * math.pi / firmware.counts
    system = np.zeros((3, 3))
    system[0, 1], system[1, 1], system[1, 2] = 1.0, -EMF / INERTIA, STALL / INERTIA
    first, second = expm(system * late), expm(system * (h - late))
    x, total, before = np.zeros(3), 0.0, None
    found = []
    for k in range(round(until / h) + 1):
        if k % round(0.01 / h) == 0:
            found.append(x[0])
        e = round(target / count) - round(x[0] / count)
        d = 0.0 if before is None else (e - before) / h
        p = e if abs(e) > firmware.dead_band else 0.0
        grown = total + h * p
        wanted = count * (firmware.proportional * p + firmware.derivative * d)
        if not (abs(wanted + count * firmware.integral * grown) > firmware.duty_limit
                and (wanted + count * firmware.integral * grown) * p > 0.0):  # fmt: skip
            total = grown
        duty = wanted + count * firmware.integral * total
        before = e
        x = first @ x
        x[2] = np.clip(duty, -firmware.duty_limit, firmware.duty_limit)
        x = second @ x
    return np.array(found)


@pytest.mark.parametrize(
    ("changes", "target"),
    [({}, 0.05), ({"delay": 4e-4, "duty_limit": 0.5}, 0.3), ({"counts": 4096}, 0.05)],
    ids=["PID", "late and at its limit", "encoder of 4096"],
)
def test_steps_of_the_loop_against_exact_ones(changes: dict[str, Any], target: float) -> None:
    firmware = loop(**changes)
    trace = run(held(target, firmware), driven(firmware))
    exact = exact_step(firmware, target, 0.2)
    bound = 1e-7 if firmware.counts == FINE else 2.0 * math.pi / firmware.counts
    np.testing.assert_allclose(trace.q[:, -1], exact, atol=bound, rtol=0.0)
    assert abs(exact[-1] - target) < 0.2 * target  # it has moved
    if firmware.duty_limit < 1.0:  # the motor's line at half of the voltage
        line = 0.5 * STALL - EMF * trace.v[:, -1]
        assert trace.torque[1, -1] == pytest.approx(line[1], abs=1e-9)
    assert np.abs(trace.energy_residual).max() < 1e-7 * trace.energy["servo_work"].max()


def test_continuous_equivalent() -> None:
    """`servo` is J v' = kp e - (kd + T0 / v0) v with kp = T0 P and kd = T0 D."""
    firmware = loop(integral=0.0)
    assert firmware.gains(MOTOR) == (pytest.approx(STALL * 4.0), pytest.approx(STALL * 0.02))
    found = firmware.servo(MOTOR)
    assert (found.kp, found.kd) == pytest.approx((STALL * 4.0, STALL * 0.02 + EMF))


def test_dead_band_and_integral() -> None:
    count = 2.0 * math.pi / 4096
    firmware = loop(counts=4096, dead_band=8, integral=0.0, derivative=0.0)
    inside = run(held(0.0, firmware), driven(firmware), angle=8.0 * count, duration=0.05)
    assert np.abs(inside.torque[:, -1]).max() == 0.0
    assert np.ptp(inside.q[:, -1]) < 1e-12
    outside = run(held(0.0, firmware), driven(firmware), angle=9.0 * count)
    assert 0.0 < outside.q[-1, -1] < 8.5 * count  # within the band, where it has run out
    loaded, load = loop(counts=4096, integral=0.0), 0.4
    error = run(held(0.0, loaded), driven(loaded), push=load).q[-1, -1]
    assert error == pytest.approx(load / (STALL * 4.0), abs=count)
    whole = loop(counts=4096, integral=60.0)
    assert abs(run(held(0.0, whole), driven(whole), push=load, duration=0.6).q[-1, -1]) < 2 * count


def test_current_limit_is_a_limit_of_torque() -> None:
    """0.5 A of a motor of 0.01 N m/A behind 200:1 are 1 N m at the joint, at any duty cycle."""
    firmware = loop(current_limit=0.5)
    trace = run(held(0.8, firmware), driven(firmware), duration=0.1, sample=2e-3)
    assert trace.torque[:, -1].max() == pytest.approx(1.0, abs=1e-12)
    free = STALL - EMF * trace.v[1:5, -1]  # what the whole voltage would give
    np.testing.assert_allclose(trace.torque[1:5, -1], np.minimum(free, 1.0), atol=1e-9)
    unknown = hp.Motor(stall_torque=2.0, no_load_speed=6.0)
    with refused(ParameterError, "Firmware.current_limit"):
        firmware.servo(unknown)


def test_registers() -> None:
    """Register values by the e-Manual's conversion; of Feetech by the measured scale."""
    found = hp.drive.Firmware.dynamixel(800, 200, 400, pwm_limit=600, period=2e-3)
    full = 4096.0 / (2.0 * math.pi) / 885.0  # whole voltages per rad and unit of gain
    assert found.proportional == pytest.approx(800 / 128 * full)
    assert found.integral * found.period == pytest.approx(200 / 65536 * full)
    assert found.derivative / found.period == pytest.approx(400 / 16 * full)
    assert found.duty_limit == pytest.approx(600 / 885)
    # MX-64: P 32 of protocol 1 is 0.158 x 32 = 5.06 by Rhoban's oscilloscope, 850 of protocol 2
    assert hp.drive.Firmware.dynamixel(850).proportional == pytest.approx(0.158 * 32, rel=0.04)
    assert hp.drive.Firmware.feetech(32, dead_zone=1).proportional == pytest.approx(5.312)
    with refused(ParameterError, "Firmware.dynamixel.p", 20_000, allowed=(16_383,)):
        hp.drive.Firmware.dynamixel(20_000)
    with refused(ParameterError, "Firmware.feetech.dead_zone"):
        hp.drive.Firmware.feetech(32, dead_zone=33)
