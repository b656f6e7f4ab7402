"""A motor compared with a demand: its line in all quadrants, margins, gear, verdict, text."""

from __future__ import annotations

import json

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from tests.sizing_cases import OMEGA, cycle, demand, full, of_motion, pure_inertia, record, walk


def use(torque: float, speed: float, **derating: float) -> hp.sizing.MotorUse:
    """Return what a constant torque at a constant speed takes of the motor of 2 N m, 8 rad/s."""
    time = cycle(10)
    found = of_motion(np.full(11, torque), np.full(11, speed), time)
    return hp.motor_budget(found, record(), full(**derating)).joints[0]


@pytest.mark.parametrize(
    ("torque", "speed", "allowed"),
    [
        (-1.0, -4.0, 1.0),  # drives: the line falls
        (1.0, -4.0, 3.0),  # brakes: the line rises
        (-1.0, 4.0, 3.0),
        (0.5, 7.0, 0.25),
    ],
)
def test_the_line_in_all_quadrants(torque: float, speed: float, allowed: float) -> None:
    """T0 - T0 v / v0 in the torque's own direction."""
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
    assert set(row.failures) == {"peak_use", "continuous_use"} and len(row.reasons) == 2
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
    torque = slow.torque + weight
    found = hp.sizing.JointDemand.of_samples(slow.time, torque, slow.speed)
    row = hp.motor_budget(found, record(), full()).joints[0]
    mean = (0.05 * OMEGA**2) ** 2 / 2.0
    ratio = ((0.02**2 * mean + weight**2) / (1e-12 * mean)) ** 0.25
    assert row.optimal_ratio == pytest.approx(ratio, rel=1e-6)
    fast = hp.motor_budget(pure_inertia(0.02, 1.2), record(), full(voltage=0.9)).joints[0]
    assert fast.optimal_ratio == fast.ratio_limit == pytest.approx(100.0 * 7.2 / (1.2 * OMEGA))
    unknown = hp.motor_budget(found, record(gear_ratio=None), full()).joints[0]
    assert unknown.optimal_ratio is None and unknown.armature == 0.01


def test_moving_rms_needs_a_time_constant() -> None:
    found = of_motion(np.repeat([1.5, 0.0], [1001, 1000]), np.zeros(2001), cycle())
    assert hp.motor_budget(found, record(), full()).joints[0].thermal_use is None
    known = hp.motor_budget(found, record(thermal_time_winding=0.2), full()).joints[0]
    assert known.thermal_use == pytest.approx(found.thermal_rms(0.2)[0] / 2.0)
    assert known.thermal_use > known.continuous_use


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
    femurs = [row for row in budget.joints if row.kind == "femur"]
    assert worst.peak_use == max(row.peak_use for row in femurs)
    assert worst.margin == min(row.margin for row in femurs)
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
    with pytest.raises(UnknownNameError):
        mixed.kind("wheel")
    with refused(ParameterError, "MotorRecord.no_load_speed", None):
        hp.motor_budget(demand(), record(no_load_speed=None))


def test_the_text_and_the_data_say_why_it_fails_and_what_is_unknown() -> None:
    budget = hp.motor_budget(demand(), record(stall_current=None))
    text = budget.table()
    assert text.startswith("M at 12 V in kharagpur: FAILS")
    assert all(reason in text for reason in budget.reasons) and budget.reasons
    assert "no stall current is published" in text
    plain = json.loads(budget.to_json())
    assert plain["passes"] is False and plain["units"]["margin"] == "N m"
    assert plain["battery"]["current_peak"] is None and plain["battery"]["unknown"]
    huge = record(stall_torque=80.0, no_load_speed=30.0, stall_current=300.0, mass=1.6)
    strong = hp.motor_budget(demand(), huge)
    assert strong.passes and not strong.reasons and "PASSES" in strong.table()
