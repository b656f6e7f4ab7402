"""Battery and heat in a run: sag as the line of a resistance, two-body heating, cut-off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.drive.supplied_drives import SuppliedDrives
from hexapod_pin.drive.winding import COPPER, MAGNET
from hexapod_pin.errors import ParameterError
from tests.test_firmware import INERTIA, JOINT, held, loop, run
from tests.vehicles import heavy_leg

VOLTS, OHM, CONSTANT = 12.0, 6.0, 1.0  # of the motor; N m/A at the joint
MOTOR = hp.Motor(
    stall_torque=CONSTANT * VOLTS / OHM, no_load_speed=VOLTS / CONSTANT, torque_constant=0.005,
    gear_ratio=200.0, winding_resistance=OHM, thermal_resistance_winding=2.0,
    thermal_resistance_housing=4.0, thermal_time_winding=0.05, thermal_time_housing=0.4,
)  # fmt: skip
PACK = hp.drive.Battery(voltage=VOLTS, resistance=2.0, standby_current=0.25)


def supplied(count: int, battery: hp.drive.Battery | None, **given: Any) -> SuppliedDrives:
    settings = {"cap": np.full(count, np.inf), "heat": False, "temperature_limit": None, **given}
    names, gears = [f"j{i}" for i in range(count)], np.full(count, 2.0)
    return SuppliedDrives(names, [MOTOR] * count, gears, battery=battery, **settings)


def driven(firmware: hp.drive.Firmware, motor: hp.Motor = MOTOR) -> hp.Servo:
    one, rest = firmware.driven(motor), {"a_joint": 0.0, "b_joint": 0.0}
    return hp.Servo(
        kp={**rest, JOINT: one.kp}, kd={**rest, JOINT: one.kd}, motor={JOINT: one.motor},
        limited=False,
    )  # fmt: skip


def test_sag_is_the_line_of_a_resistance() -> None:
    """Some stalled motors of R at full duty on a pack of r: U = (U0 - r I0) R / (R + n r)."""
    for count in (1, 3):
        drives = supplied(count, PACK)
        torque, _, memory = drives.command(
            np.ones((1, count)), np.zeros((1, count)), drives.start(1), 0.0
        )
        volts = (VOLTS - 2.0 * 0.25) * OHM / (OHM + count * 2.0)
        voltage, current = drives.at(memory)[:2]
        assert voltage[0] == pytest.approx(volts, rel=1e-13)
        assert current[0] == pytest.approx(count * volts / OHM + 0.25, rel=1e-12)
        np.testing.assert_allclose(torque, CONSTANT * volts / OHM, rtol=1e-13)


def test_current_limits_and_braking_on_the_bus() -> None:
    """A motor at its limit takes its power; one that brakes feeds the others only where it may."""
    drives = supplied(1, PACK, cap=np.array([0.6]))
    _, _, memory = drives.command(np.ones((1, 1)), np.full((1, 1), 2.0), drives.start(1), 0.0)
    voltage, current = (float(x[0]) for x in drives.at(memory)[:2])
    power = 0.6**2 * OHM + CONSTANT * 0.6 * 2.0
    assert voltage * (current - 0.25) == pytest.approx(power, rel=1e-12)
    assert voltage == pytest.approx(VOLTS - 2.0 * current, rel=1e-13)
    duty, rate = np.array([0.5, 0.2]), np.array([0.0, 8.0])  # the second brakes: 0.2 U < k w
    for gives in (False, True):
        pack = PACK.model_copy(update={"regeneration": gives, "standby_current": 0.0})
        both = supplied(2, pack)
        _, _, memory = both.command(duty[None], rate[None], both.start(1), 0.0)
        voltage, current, _, each = (x[0] for x in both.at(memory)[:4])
        np.testing.assert_allclose(each, (duty * voltage - CONSTANT * rate) / OHM, rtol=1e-12)
        taken = duty * each
        assert current == pytest.approx(taken.sum() if gives else taken[0], rel=1e-12)
        assert voltage == pytest.approx(VOLTS - 2.0 * current, rel=1e-13)


def spin_up(pack: hp.drive.Battery, until: float, motor: hp.Motor = MOTOR) -> np.ndarray:
    """Return (rate, winding, housing, charge) after a time at full voltage from rest, by SciPy."""
    ohm, c = pack.resistance, motor.winding
    heat, mass = c[4] / c[2], c[5] / c[3]

    def slopes(_: float, y: np.ndarray) -> tuple[float, ...]:
        speed, winding, housing, drawn = y
        k = CONSTANT * (1.0 - MAGNET * (housing - 25.0))
        warm = OHM * (1.0 + COPPER * (winding - 25.0))
        opened = float(pack.open_voltage(drawn))
        i = (opened - ohm * pack.standby_current - k * speed) / (warm + ohm)
        return (
            k * i / INERTIA, (i**2 * warm - (winding - housing) / c[2]) / heat,
            ((winding - housing) / c[2] - (housing - 25.0) / c[3]) / mass,
            i + pack.standby_current,
        )  # fmt: skip

    found = solve_ivp(slopes, (0.0, until), (0.0, 25.0, 25.0, 0.0), rtol=1e-10, atol=1e-10)
    return np.asarray(found.y[:, -1])


def test_spin_up_with_sag_and_heat_against_scipy() -> None:
    """A motor at full duty: rate, temperatures, charge; the passes' lag is of first order."""
    pack = PACK.model_copy(update={"capacity": 2e-5, "curve": ((0.0, 0.5), (1.0, 1.0))})
    small = MOTOR.model_copy(update={"thermal_time_winding": 0.004, "thermal_time_housing": 0.02})
    exact = spin_up(pack, 0.012, small)
    assert exact[1] > 35.0 and exact[3] > 0.1 * 3600.0 * 2e-5  # 10 K warmer, a tenth drawn
    errors = []
    for period in (4e-4, 2e-4):
        firmware = loop(proportional=1e3, integral=0.0, derivative=0.0, period=period)
        control = held(0.9, firmware, battery=pack, heat=True)
        trace = run(control, driven(firmware, small), duration=0.012, sample=period)
        scene = hp.Scene(heavy_leg(1.0), servo=driven(firmware, small))
        course = control.course(scene, trace)
        j = course.joint_names.index(JOINT)
        found = (trace.v[-1, -1], course.winding[-1, j], course.housing[-1, j], course.drawn[-1])
        errors.append(np.abs(np.array(found) / exact - 1.0))
        assert np.abs(trace.q[:, -1]).max() < 0.8  # at full duty until the end
    order = [0, 3]  # of rate and charge; temperatures, whose squares are averaged, are closer
    np.testing.assert_allclose(errors[0][order] / errors[1][order], 2.0, rtol=0.2)
    assert errors[1][order].max() < 6e-4
    assert max(error[1:3].max() for error in errors) < 5e-5
    # what the bus gives at every pass: copper, shaft and electronics
    current, volts = course.motor_current[:, j], course.voltage
    power = current**2 * OHM * (1.0 + COPPER * (course.winding[:, j] - 25.0))
    weak = CONSTANT * (1.0 - MAGNET * (course.housing[:, j] - 25.0))
    np.testing.assert_allclose(
        volts * course.current, power + weak * current * trace.v[:, -1] + 0.25 * volts, rtol=1e-9
    )
    with refused(ParameterError, "FirmwareControl.course.trace.sample"):
        control.course(scene, run(control, driven(firmware, small), duration=0.012, sample=4e-3))


def test_heat_cuts_the_torque_off() -> None:
    gains = {"proportional": 4.0, "integral": 0.0, "derivative": 0.0}
    firmware = loop(**gains, temperature_limit=60.0, period=1e-3)
    control = held(0.5, firmware, heat=True)
    # a load that the joint holds near the middle of its way
    trace = run(control, driven(firmware), duration=0.5, sample=1e-3, push=-1.5)
    scene = hp.Scene(heavy_leg(1.0), servo=driven(firmware))
    course = control.course(scene, trace)
    j = course.joint_names.index(JOINT)
    off = int(np.argmax(course.shut_down[:, j]))
    assert course.housing[off, j] > 60.0 >= course.housing[off - 1, j]
    # open bridge: what is left is the rate's growth within a pass; a fast one brakes by diodes
    after, held_before = trace.torque[off + 1 :, j], trace.torque[off - 1, j]
    free = np.abs(trace.v[off + 1 :, -1]) < 0.9 * MOTOR.no_load_speed
    lag = MOTOR.stall_torque / MOTOR.no_load_speed * 1.5 / INERTIA * 1e-3
    assert free.sum() > 5 and np.abs(after[free]).max() <= 1.001 * lag < 0.5 < abs(held_before)
    assert f"shut down: {JOINT}" in course.line and "no battery" in course.line


def test_a_walk_on_a_weak_pack() -> None:
    robot, gait = hp.load_robot("kharagpur"), hp.Gait.tripod(stroke=0.06, cycle_time=1.2)
    firmware = hp.drive.Firmware.dynamixel(850, temperature_limit=80.0)
    motor = hp.drive.identified_drive("MX-64").motor(12.6).warming(0.126)
    scene = hp.Scene(robot, servo=firmware.driven(motor))
    pack = hp.drive.Battery.lithium(3, 2.2, 0.3, standby_current=1.8)
    assert pack.open_voltage() == pytest.approx(12.6)
    assert pack.open_voltage(1.1 * 3600.0) == pytest.approx(3 * 3.84)
    control = hp.FirmwareControl(gait, firmware, battery=pack, heat=True)
    case = hp.Case(scene, control, duration=0.15, sample=1e-3, accuracy=1e-3)
    assert hp.Case.from_toml(case.to_toml()) == case
    trace = case.run()
    course = control.course(scene, trace)
    assert 10.0 < course.voltage.min() < course.voltage.max() <= 12.6 - 0.3 * 1.8 + 1e-12
    np.testing.assert_allclose(
        course.voltage, pack.open_voltage(course.drawn) - 0.3 * course.current, rtol=1e-12
    )
    assert course.winding.max() > 25.0 and not course.shut_down.any()
    for one in hp.simulate_batch([case, case]):
        np.testing.assert_array_equal(one.q, trace.q)


def test_refusals() -> None:
    with refused(ParameterError, "Battery.curve"):
        hp.drive.Battery(voltage=12.0, curve=((0.0, 0.8), (0.9, 1.0)))
    with refused(ParameterError, "Battery.curve", about=("do not fall",)):
        hp.drive.Battery(voltage=12.0, curve=((0.0, 0.8), (0.5, 0.7), (1.0, 1.0)))
    with refused(ParameterError, "Battery.lithium.cells", 0):
        hp.drive.Battery.lithium(0, 2.0, 0.1)
    with refused(ParameterError, "FirmwareControl.heat", False):
        held(0.0, loop(temperature_limit=80.0))
    bare = hp.Motor(stall_torque=2.0, no_load_speed=6.0)
    firmware = loop()
    with refused(ParameterError, f"Scene.servo.motor[{JOINT}]"):
        run(held(0.1, firmware, battery=PACK), driven(firmware, bare))
    with refused(ParameterError, "Motor.winding_resistance"):
        bare.warming(0.1)
    assert MOTOR.warming(0.1) == MOTOR  # what is given stays
