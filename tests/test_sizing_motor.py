"""What joints demand of motors and battery: closed forms, and a walk from its arrays."""

from __future__ import annotations

import json

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.recorded_robot import RecordedRobot
from tests.sizing_cases import OMEGA, cycle, demand, full, of_motion, pure_inertia, record, walk

ROOT2 = np.sqrt(2.0)


def use(torque: float, speed: float, **derating: float) -> hp.sizing.MotorUse:
    found = of_motion(np.full(11, torque), np.full(11, speed), cycle(10))
    return hp.motor_budget(found, record(), full(**derating)).joints[0]


def test_the_line_in_all_quadrants() -> None:
    """T0 - T0 v / v0 in the torque's own direction: it falls where the motor drives."""
    for torque, speed, allowed in (
        (-1.0, -4.0, 1.0), (1.0, -4.0, 3.0), (-1.0, 4.0, 3.0), (0.5, 7.0, 0.25),
    ):  # fmt: skip
        row = use(torque, speed)
        assert row.peak_use == pytest.approx(abs(torque) / allowed, rel=1e-12)
        assert row.margin == pytest.approx(allowed - abs(torque), rel=1e-12)
        assert row.outside_share == pytest.approx(float(abs(torque) > allowed))


def test_beyond_the_no_load_speed_it_can_only_brake() -> None:
    drives, brakes = use(0.01, 9.0), use(-0.01, 9.0)
    assert drives.peak_use == np.inf and drives.outside_share == 1.0 and drives.margin < 0.0
    assert brakes.peak_use == pytest.approx(0.01 / (2.0 * (1.0 + 9.0 / 8.0)))
    assert "only brake" in drives.failures["peak_use"]
    assert drives.speed_use == pytest.approx(9.0 / 8.0) and not brakes.passes


def test_derating_lowers_line_speed_and_lasting_torque() -> None:
    """At 0.9 of the voltage the line is parallel and lower; then 0.8 of it is allowed."""
    row = use(1.0, 4.0, peak=0.8, voltage=0.9, continuous=0.25)
    assert row.peak_use == pytest.approx(1.0 / (0.8 * (0.9 * 2.0 - 2.0 * 4.0 / 8.0)))
    assert row.speed_use == pytest.approx(4.0 / (0.9 * 8.0))
    assert row.continuous_use == pytest.approx(1.0 / 0.5)
    assert set(row.failures) == {"peak_use", "continuous_use"}
    rated = hp.motor_budget(pure_inertia(0.02), record(rated_torque=0.8), full()).joints[0]
    rms = 0.02 * 0.5 * OMEGA**2 / np.sqrt(2)
    assert rated.rated_use == pytest.approx(rms / 0.8)  # shown, and decides nothing
    assert rated.continuous_use == pytest.approx(rms / 2.0)


def test_the_best_gear_ratio_of_a_pure_inertia_matches_inertias() -> None:
    """N* = sqrt(J_load / J_rotor), J_rotor = 0.01 / 100^2; the torque there is least."""
    found = pure_inertia(0.02, 0.05)
    row = hp.motor_budget(found, record(), full()).joints[0]
    assert row.optimal_ratio == pytest.approx(np.sqrt(0.02 / 1e-6), rel=1e-6)
    assert row.inertia_ratio == pytest.approx(2.0) and row.armature == 0.01
    assert row.ratio_limit == pytest.approx(100.0 * 8.0 / (0.05 * OMEGA), rel=1e-6)
    assert row.torque_rms_with_armature == pytest.approx(1.5 * found.torque_rms[0], rel=1e-5)
    ratio = row.optimal_ratio * np.array([0.99, 1.0, 1.01])
    square = (found.torque / ratio + ratio * 1e-6 * found.acceleration) ** 2
    assert np.argmin(square.mean(axis=0)) == 1


def test_the_best_gear_ratio_beside_a_weight_and_below_the_speed_limit() -> None:
    """A = J^2 a^2 / 2 + M^2, C = J_m^2 a^2 / 2; a fast joint leaves no more than its speed."""
    slow, weight = pure_inertia(0.02, 0.05), 0.3
    found = hp.sizing.JointDemand.of_samples(slow.time, slow.torque + weight, slow.speed)
    row = hp.motor_budget(found, record(), full()).joints[0]
    mean = (0.05 * OMEGA**2) ** 2 / 2.0
    ratio = ((0.02**2 * mean + weight**2) / (1e-12 * mean)) ** 0.25
    assert row.optimal_ratio == pytest.approx(ratio, rel=1e-6)
    fast = hp.motor_budget(pure_inertia(0.02, 1.2), record(), full(voltage=0.9)).joints[0]
    assert fast.optimal_ratio == fast.ratio_limit == pytest.approx(100.0 * 7.2 / (1.2 * OMEGA))


def test_a_walk_held_against_a_motor_again_from_its_arrays() -> None:
    """Sample by sample, with the motor's two lines written out; peaks between samples add to it."""
    found, motor = demand(), record(stall_torque=4.0)
    budget = hp.motor_budget(found, motor)  # 0.8 of the line at 0.9 of the voltage
    upper = 0.8 * (0.9 * 4.0 - 4.0 / 8.0 * found.speed)
    lower = 0.8 * (-0.9 * 4.0 - 4.0 / 8.0 * found.speed)
    use = np.maximum(found.torque / upper, found.torque / lower).max(axis=0)
    margin = np.minimum(upper - found.torque, found.torque - lower).min(axis=0)
    peak, at = walk().summary.torque_peak, walk().summary.torque_peak_time
    for j, row in enumerate(budget.joints):
        speed = np.interp(at[j], walk().time, walk().v[:, 6 + j])
        most = 0.8 * (0.9 * 4.0 - np.sign(peak[j]) * 4.0 / 8.0 * speed)
        if abs(peak[j]) > np.abs(found.torque[:, j]).max():
            use[j] = max(use[j], abs(peak[j]) / most)
            margin[j] = min(margin[j], most - abs(peak[j]))
        assert row.peak_use == pytest.approx(use[j], rel=1e-9)
        assert row.margin == pytest.approx(margin[j], rel=1e-9)
    outside = (found.torque > upper) | (found.torque < lower)
    assert [r.outside_share for r in budget.joints] == pytest.approx(outside.mean(axis=0), abs=2e-3)
    worst = budget.kind("femur")
    assert worst.peak_use == max(row.peak_use for row in budget.joints if row.kind == "femur")
    assert budget.joint(worst.worst["peak_use"]).peak_use == worst.peak_use
    assert budget.robot.deciding_use == max(row.deciding_use for row in budget.kinds)


def test_motors_by_kind_of_joint() -> None:
    weak, strong = record(), record(model="S", stall_torque=20.0, stall_current=30.0, mass=0.4)
    mixed = hp.motor_budget(demand(), {"coxa": weak, "femur": strong, "tibia": weak})
    assert mixed.kind("femur").motor == "S at 12 V" and mixed.kind("coxa").motor == "M at 12 V"
    alone = hp.motor_budget(demand(), strong, kinds=["femur"])
    assert len(alone.joints) == 6 and alone.kind("femur") == mixed.kind("femur")
    with refused(ParameterError, "record", ("femur",)):
        hp.motor_budget(demand(), {"femur": strong}, kinds=["femur", "tibia"])
    with refused(ParameterError, "MotorRecord.no_load_speed", None):
        hp.motor_budget(demand(), record(no_load_speed=None))


def test_the_text_and_the_data_say_why_it_fails_and_what_is_unknown() -> None:
    budget = hp.motor_budget(demand(), record(stall_current=None))
    text, plain = budget.table(), json.loads(budget.to_json())
    assert text.startswith("M at 12 V in kharagpur: FAILS") and budget.reasons
    assert all(part in text for part in (*budget.reasons, "no stall current is published"))
    assert plain["passes"] is False and plain["units"]["margin"] == "N m"
    assert plain["battery"]["current_peak"] is None and budget.battery.run_time(1e5) is None
    mixed = {"coxa": record(), "femur": record(voltage=7.4), "tibia": record()}
    assert "7.4 V and 12 V" in hp.motor_budget(demand(), mixed).battery.unknown
    huge = record(stall_torque=80.0, no_load_speed=30.0, stall_current=300.0, mass=1.6)
    assert "PASSES" in hp.motor_budget(demand(), huge).table()


# what joints demand ----------------------------------------------------------------------------


def test_a_swinging_inertia_has_its_closed_form() -> None:
    """Peaks at samples; the trapezoidal rule over whole periods is exact; energy from J w^2 / 2."""
    inertia, amplitude = 0.02, 0.5
    found = pure_inertia(inertia, amplitude)
    peak, speed = inertia * amplitude * OMEGA**2, amplitude * OMEGA
    assert found.torque_peak == pytest.approx([peak], rel=1e-12)
    assert found.torque_peak_time == pytest.approx([0.25], abs=1e-3)
    assert found.torque_rms == pytest.approx([peak / ROOT2], rel=1e-9)
    assert found.speed_peak == pytest.approx([speed], rel=1e-12)
    assert found.speed_rms == pytest.approx([speed / ROOT2], rel=1e-9)
    assert found.power_peak == pytest.approx([peak * speed / 2.0], rel=1e-5)
    energy = 2 * inertia * speed**2 / 2.0  # gained and lost twice a cycle
    assert found.positive_energy == pytest.approx([energy], rel=1e-5)
    assert found.negative_energy == pytest.approx([-energy], rel=1e-5)
    p99 = peak * np.sin(0.99 * np.pi / 2.0)
    assert found.torque_p99 == pytest.approx([p99], rel=1e-4)
    assert found.acceleration_rms == pytest.approx([amplitude * OMEGA**2 / ROOT2], rel=1e-5)
    mean = inertia * (amplitude * OMEGA**2) ** 2 / 2.0
    assert found.torque_acceleration == pytest.approx([mean], rel=1e-5)


def test_moving_rms_of_a_pulse() -> None:
    """1 for a fifth of a second: the lag rises to (1 - e^-0.2/T) / (1 - e^-1/T); ramps 50 us."""
    time = cycle(20000)
    torque = np.outer(time < 0.2, [1.0, -3.0])
    found = of_motion(torque, 0.0 * torque, time)
    for constant in (0.05, 2.0):
        root = np.sqrt(np.expm1(-0.2 / constant) / np.expm1(-1.0 / constant))
        assert found.thermal_rms(constant) == pytest.approx([root, 3.0 * root], rel=3e-4)
    assert found.thermal_rms(1e-5) == pytest.approx([1.0, 3.0], rel=1e-6)
    with refused(ParameterError, "time_constant", 0.0):
        found.thermal_rms(0.0)


def test_the_load_inertia_of_a_walk_is_what_inverse_dynamics_asks_for() -> None:
    trace, found = walk(), demand()
    robot = RecordedRobot.of(trace)
    model, data = robot.model, robot.model.createData()
    assert found.armature == pytest.approx(np.full(18, 1e-3), rel=1e-12)
    for joint in (0, 7, 17):
        unit = np.zeros(model.nv)
        unit[6 + joint] = 1.0
        still = 0 * unit
        inertia = [
            pin.rnea(model, data, q, still, unit) - pin.rnea(model, data, q, still, still)
            for q in trace.q[np.searchsorted(trace.time, found.time)][::40]
        ]
        mean = np.mean([row[6 + joint] for row in inertia])
        assert found.load_inertia[joint] == pytest.approx(mean, rel=0.01)


def test_demands_that_there_are_not_are_refused() -> None:
    none = np.zeros((3, 1))
    with refused(ParameterError, "JointDemand.time", 3), np.errstate(all="ignore"):
        hp.sizing.JointDemand.of_samples([0.0, 0.0, 0.0], none, none)
    with refused(ParameterError, "torque", (3, 1)):
        hp.sizing.JointDemand.of_samples([0.0, 1.0], none, none)
    with refused(UnknownNameError, kind="kind of joint", name="wheel"):
        demand().of_kinds(["wheel"])


# what the battery gives ------------------------------------------------------------------------


def loaded(torque: np.ndarray, speed: np.ndarray, **more: object) -> hp.sizing.BatteryLoad:
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


def test_a_pack_sags_by_the_current_of_all_motors_together() -> None:
    """U^2 - U0 U + r P = 0 of a constant power, at each sample; the line falls with U."""
    ones = np.ones((11, 1))
    found = of_motion(0.8 * ones, 4.0 * ones, cycle(10))
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
    assert hp.motor_budget(found, record(), full()).passes and not budget.passes
    assert "lowest voltage at the motors" in budget.table()
    assert load.sag_line.startswith(f"battery: {volts:.3g} V at least of 12 V, ")


def test_a_pack_that_cannot_give_the_power_says_so() -> None:
    """R P above U0^2 / 4: at half the voltage it gives most; standby currents load it too."""
    ones = np.ones((11, 1))
    found = of_motion(1.0 * ones, 4.0 * ones, cycle(10))
    load = hp.motor_budget(found, record(), full(), pack_resistance=3.0).battery
    assert load.overloaded_share == pytest.approx(1.0) and load.voltage_least == pytest.approx(6.0)
    still = of_motion(np.zeros((11, 3)), np.zeros((11, 3)), cycle(10))
    load = hp.motor_budget(still, record(standby_current=0.4), full(), pack_resistance=2.0).battery
    assert load.voltage_least == pytest.approx(9.6)
    with pytest.raises(ParameterError, match="pack_resistance"):
        hp.motor_budget(found, record(), pack_resistance=-0.1)
