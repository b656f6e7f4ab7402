"""Friction of gears by load: the published formula, closed forms, an independent integration."""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from test_drive_runs import INERTIA, JOINT, SETTINGS, run

import hexapod_pin as hp
from hexapod_pin.drive.drive_law import drive_law, native_gear
from hexapod_pin.errors import ParameterError, UnknownNameError
from tests.vehicles import FREE, heavy_leg

MX64 = hp.drive.identified_drive("MX-64")
M3 = hp.drive.GearFriction(coulomb=0.05, motor=0.2, load=0.2)  # F = 0.05 + 0.2 |e - u|
EXTERNAL = M3.model_copy(update={"external_load": True})
PASSED = MX64.gear.model_copy(update={"external_load": False})
ADAPTIVE = ("extrapolated-euler", "ndf", "dop853")


def published(gear: hp.drive.GearFriction, motor: float, load: float, rate: float) -> float:
    """Return the friction by the formula of BAM, from signed torques [N m] and a rate [rad/s]."""
    s = np.exp(-(np.abs(rate / gear.stribeck_speed) ** gear.stribeck_exponent))
    found = gear.coulomb + abs(gear.load * load - gear.motor * motor)
    found += s * gear.stribeck
    found += s * abs(gear.load_stribeck * load - gear.motor_stribeck * motor)
    if np.sign(motor) != np.sign(load):
        if abs(load) < abs(motor):
            found += s * gear.load_quadratic * load**2
        if abs(load) > abs(motor):
            found += s * gear.motor_quadratic * motor**2
    return float(found)


def test_both_solutions_keep_the_published_formula() -> None:
    torques, speeds = (-2.0, -0.3, -0.01, 0.0, 0.02, 0.4, 3.0), (0.0, 0.1, 2.0, 9.0)
    grid = np.array(list(itertools.product(torques, speeds)))
    for drive in hp.drive.identified_drives().values():
        gear, c = drive.gear, drive.viscous
        law = native_gear(gear, c)
        motor, speed = grid[:, 0] * drive.torque_constant, grid[:, 1]
        friction = gear.under_motor(motor, speed, viscous=c)
        load = friction + c * speed - motor
        formula = [published(gear, *row) for row in zip(motor, load, speed, strict=True)]
        np.testing.assert_allclose(friction, formula, rtol=1e-13, atol=1e-15)
        core = [law.under_motor(u, w)[0] for u, w in zip(motor, speed, strict=True)]
        np.testing.assert_allclose(core, formula, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(gear.under_load(load, speed, viscous=c), formula, rtol=1e-12)
        core = [law.under_load(e, w)[0] for e, w in zip(load, speed, strict=True)]
        np.testing.assert_allclose(core, formula, rtol=1e-12)


def test_an_external_load_by_the_published_formula() -> None:
    torques, h, robot = (-2.0, -0.31, 0.02, 0.4, 3.0), 1e-7, heavy_leg(1.0)
    for drive in hp.drive.identified_drives().values():
        law = native_gear(drive.gear, drive.viscous)
        assert law.external_load
        servo = hp.Servo(kp=0.0, kd=0.0, limited=False, motor={JOINT: drive.motor(12.0)})
        joint = robot.joint_index(JOINT)
        whole = drive_law(robot, servo, FREE)
        for u, e, w in itertools.product(torques, (*torques, 0.05), (0.2, 2.0)):
            friction, *slopes = law.under_both(u, e, w)
            assert friction == pytest.approx(published(drive.gear, u, e, w), rel=1e-13)
            for k, slope in enumerate(slopes):
                at = [np.array([u, e, w]) + sign * h * np.eye(3)[k] for sign in (1.0, -1.0)]
                high, low = (law.under_both(*one)[0] for one in at)
                assert slope == pytest.approx((high - low) / (2.0 * h), abs=1e-6)
            taken = friction + drive.viscous * w
            for sign in (1.0, -1.0):
                found = whole.resistance_to(joint, sign * (u - taken), sign * w, sign * e)
                assert found == pytest.approx(sign * taken, rel=1e-12)
    # the quadratic part passes smoothly, from 0.9 to 1.1 |u|, where the load begins to prevail
    gear = hp.drive.GearFriction(motor_quadratic=0.02, load_quadratic=0.05, external_load=True)
    for load, square in ((1.8, 0.05 * 1.8**2), (2.0, 0.5 * 0.07 * 4.0), (2.2, 0.02 * 4.0)):
        assert native_gear(gear, 0.0).under_both(2.0, -load, 0.0)[0] == pytest.approx(square)


def strong(gear: hp.drive.GearFriction, viscous: float = 0.0) -> hp.Motor:
    line = {"stall_torque": 1e6, "no_load_speed": 1e6}
    return hp.Motor(**line, gear_friction=gear, viscous_friction=viscous)


def weight(torque: float) -> tuple[hp.Push, ...]:
    """Return a load on the joint [N m], there from the start."""
    return (hp.Push("c", torque=(0.0, torque, 0.0), start=0.0, duration=100.0),)


@pytest.mark.parametrize("method", SETTINGS)
def test_breakaway_under_a_load(method: str) -> None:
    """M3 under a load of -0.3 N m rests for motor torques from 0.158 to 0.512 N m, no others."""
    raised, lowered = (0.05 + 0.3 * 1.2) / 0.8, (0.3 * 0.8 - 0.05) / 1.2
    for torque, moves in (
        (raised - 1e-3, 0), (raised + 1e-3, 1), (lowered + 1e-3, 0), (lowered - 1e-3, -1),
    ):  # fmt: skip
        trace = run(
            method, kp=1.0, target=torque, duration=0.01, sample=0.01, motor=strong(M3),
            loads=weight(-0.3),
        )  # fmt: skip
        assert np.sign(trace.v[-1, -1]) == moves
        # friction leaves 1 mN m times (1 - K) / (1 + K) of the rest upwards, its inverse downwards;
        # as the joint turns, the servo takes back up to 2 % of that
        left = {1: 1e-3 * 0.8 / 1.2, 0: 0.0, -1: -1e-3 * 1.2 / 0.8}[moves]
        assert trace.v[-1, -1] == pytest.approx(0.01 * left / INERTIA, rel=0.04, abs=1e-15)


@pytest.mark.parametrize("method", SETTINGS)
def test_a_load_that_falls_with_the_motor_off(method: str) -> None:
    """Under L = -0.3 N m the gear of an external load takes Fc + K L = 0.11 N m all the way."""
    for gear, taken in ((EXTERNAL, 0.05 + 0.2 * 0.3), (M3, 0.05 / 0.8)):
        given = {"motor": strong(gear), "loads": weight(-0.3)}
        trace = run(method, duration=0.02, sample=0.01, **given)
        speed = -(0.3 - taken) / INERTIA * trace.time
        np.testing.assert_allclose(trace.v[:, -1], speed, rtol=1e-6)


def test_against_another_integration() -> None:
    gear, c, kp, kd, target = PASSED, MX64.viscous, 3.0, 0.05, 0.8

    def slope(t: float, y: np.ndarray) -> list[float]:
        angle, rate = y
        motor = kp * (target - angle) - kd * rate

        def miss(friction: float) -> float:
            return friction - published(gear, motor, friction + c * rate - motor, rate)

        friction = brentq(miss, 0.0, 100.0, xtol=1e-15, rtol=1e-14)
        return [rate, (motor - friction - c * rate) / INERTIA]

    end = 0.06
    exact = solve_ivp(slope, (0.0, end), [-0.5, 1.0], method="DOP853", rtol=1e-11, atol=1e-12)
    assert exact.y[1].min() > 0.5
    start = {"target": target, "angle": -0.5, "rate": 1.0, "duration": end, "sample": end}
    start |= {"kp": kp, "kd": kd, "motor": strong(gear, c)}
    for method in ADAPTIVE:
        trace = run(method, **start, settings={"accuracy": 1e-9 if method == "dop853" else 1e-7})
        assert trace.q[-1, -1] == pytest.approx(exact.y[0, -1], abs=1e-6), method
        assert trace.v[-1, -1] == pytest.approx(exact.y[1, -1], abs=1e-5), method
        lost = trace.energy["joint_damping_loss"][-1]
        assert lost > 1e-3 and np.abs(trace.energy_residual).max() < 1e-4 * lost
    # first order: a step of 0.125 ms misses an eighth of what one of 1 ms does
    for fixed in ("implicit-euler", "robust"):
        ends = (run(fixed, **start, settings={"step": step}).q[-1, -1] for step in (1e-3, 1.25e-4))
        coarse, fine = (abs(found - exact.y[0, -1]) for found in ends)
        assert fine < 2e-3
        assert fine < coarse / 4.0


@pytest.mark.parametrize("flies", [False, True])
def test_prescribed_motion_takes_the_motor_s_torque(flies: bool) -> None:
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=1.2))
    fixed = {"method": "implicit-euler", "step": 1e-3, "sample": 0.05}
    traces = []
    for gear in (None, MX64.gear if flies else PASSED):
        motor = hp.Motor(stall_torque=9.0, no_load_speed=7.0, gear_friction=gear)
        servo = hp.Servo(kp=60.0, kd=1.2, motor=motor)
        place = hp.Scene(robot, servo=servo, prescribed=True)
        trace = hp.simulate(place, control, duration=0.05 if flies else 0.3, **fixed)
        if flies:
            start = robot.check_state(trace.q[0] + np.eye(25)[2], trace.v[0])
            trace = hp.simulate(place, control, duration=0.3, initial=start, **fixed)
        traces.append(trace)
    plain, geared = traces
    model = robot.model
    for k, j in itertools.product(range(1, 6), range(18)):
        passed, rate = float(plain.torque[k, j]), float(plain.v[k, 6 + j])
        sign, speed = np.sign(rate), abs(rate)
        taken = 0.0
        if sign and not flies:
            taken = sign * PASSED.under_load(-sign * passed, speed)
        elif sign:
            still = pin.rnea(model, model.createData(), plain.q[k], plain.v[k], np.zeros(24))
            load = -float(still[6 + j])

            def miss(friction: float, left: float, load: float, speed: float) -> float:
                return friction - published(MX64.gear, left + friction, load, speed)

            along = (sign * passed, sign * load, speed)
            taken = sign * brentq(miss, 0.0, 10.0, args=along, xtol=1e-15)
        assert geared.torque[k, j] == pytest.approx(passed + taken, abs=1e-9)


def test_a_walk_with_identified_motors() -> None:
    """Friction costs work; a budget adds to a plain walk what the gear would take of it."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=1.2))
    motor = MX64.motor(12.0)
    record = hp.load_catalog().get("MX-64", 12.0)
    works, budgets = [], []
    for one in (motor.model_copy(update={"gear_friction": None, "viscous_friction": 0.0}), motor):
        place = hp.Scene(robot, servo=hp.Servo(kp=60.0, kd=1.2, motor=one))
        trace = hp.simulate(place, control, duration=3.6, accuracy=1e-4, sample=0.01)
        works.append(trace.energy["servo_work"][-1])
        budgets.append(hp.motor_budget(trace, record))
    assert works[1] > 1.3 * works[0]
    plain, geared = budgets
    for j, row in enumerate(plain.joints):
        torque, rate, c = plain.demand.torque[:, j], plain.demand.speed[:, j], MX64.viscous
        friction = PASSED.under_load(-np.sign(rate) * torque, np.abs(rate), viscous=c)
        found = torque + np.sign(rate) * friction + c * rate
        current = found / MX64.torque_constant
        rms = np.sqrt(plain.demand.weights @ current**2)
        assert row.current_rms == pytest.approx(rms, rel=5e-3)  # steps between the samples
        assert row.winding_heat == pytest.approx(MX64.resistance * rms**2, rel=1e-2)
    # of motors that overcame their gears the torque is the motor's already
    for row, torque in zip(geared.joints, geared.demand.torque_rms, strict=True):
        assert row.current_rms == pytest.approx(torque / MX64.torque_constant, rel=1e-12)


def test_identified_motor_by_hand() -> None:
    """MX-64 at 12 V: k U / R = 8.297 N m, U / k = 7.492 rad/s, and its parameters."""
    motor = hp.drive.identified_drive("mx-64").motor(12.0)
    servo = hp.Servo(kp=1.0, kd=0.1, motor=motor)
    assert hp.Servo.model_validate(servo.model_dump()) == servo
    assert motor.stall_torque == pytest.approx(1.60168 * 12.0 / 2.3164, rel=1e-12)
    assert motor.no_load_speed == pytest.approx(12.0 / 1.60168, rel=1e-12)
    assert motor.armature == pytest.approx(0.0122659)
    assert motor.gear_friction.motor == pytest.approx(0.311472)
    assert motor.gear_friction.stribeck_exponent == pytest.approx(0.840902)
    with pytest.raises(UnknownNameError, match="MX-106"):
        hp.drive.identified_drive("MX-65")


def test_an_assumed_gear_leaves_the_line_behind_it() -> None:
    """At rest it lifts the data sheet's 1.5 N m; unloaded it turns with 6.18 rad/s."""
    sheet = hp.load_catalog().get("AX-12A").motor()
    motor = sheet.with_assumed_gear("most")
    gear, own = motor.gear_friction, motor.stall_torque
    assert gear is not None and motor.rotor_inertia == sheet.rotor_inertia
    assert own - gear.under_motor(own, 0.0) == pytest.approx(sheet.stall_torque, rel=1e-12)
    left = own * (1.0 - sheet.no_load_speed / motor.no_load_speed)
    assert gear.under_motor(left, sheet.no_load_speed) == pytest.approx(left, rel=1e-12)
    with refused(ParameterError, "Motor.gear_friction"):
        motor.with_assumed_gear()


def test_refusals() -> None:
    for bad in ({"motor": 0.6, "motor_stribeck": 0.4}, {"load": 1.2}, {"coulomb": -1.0}):
        with refused(ParameterError):
            hp.drive.GearFriction(**bad)
    for bad in ((float("nan"), 1.0), (1.0, -1.0)):
        with refused(ParameterError):
            M3.under_motor(*bad)
