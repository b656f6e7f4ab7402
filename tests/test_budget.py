"""The torque budget against closed forms: sine torque and rate of known amplitude and phase."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from synthetic import JOINTS, WEIGHT, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.run_record import RunCase
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace

TORQUE, RATE = 2.0, 3.0  # amplitudes [N m], [rad/s]
CYCLE = 1.0  # of the synthetic trace [s]

# Trapezoids over whole periods of a smooth signal are exact to round-off; |.| and max(., 0) have
# corners, which cost about (pi h / T)^2 / 3 of the value.
SAMPLE = 1e-3
CORNER = 1e-5


def wave(amplitude: float, phase: float, duration: float, sample: float = SAMPLE) -> np.ndarray:
    """Return (T, 18): a sine of one period per cycle, joint k scaled by (k + 1) / 18."""
    time = np.arange(round(duration / sample) + 1) * sample
    scale = np.arange(1, len(JOINTS) + 1) / len(JOINTS)
    return amplitude * np.sin(2.0 * np.pi * time / CYCLE + phase)[:, None] * scale


def swinging(lag: float = 0.0, duration: float = 4.0, **meta: object) -> Trace:
    """Return a walk whose torques lag the rates by `lag` [rad]; start-up (t < 1 s) is violent."""
    torque, rate = wave(TORQUE, -lag, duration), wave(RATE, 0.0, duration)
    violent = np.arange(len(torque)) * SAMPLE < 0.9
    torque[violent], rate[violent] = 50.0, 70.0
    return synthetic_trace(duration=duration, sample=SAMPLE, torque=torque, rate=rate, **meta)


def test_peak_rms_and_percentile_of_a_sine() -> None:
    """Peak A, RMS A / sqrt 2, 99th percentile A sin(0.99 pi / 2); the start-up does not count."""
    row = torque_budget(swinging()).joint(JOINTS[17])
    assert row.torque_peak == pytest.approx(TORQUE, rel=1e-12)
    assert row.torque_peak_time % 0.5 == pytest.approx(0.25, abs=1e-9)
    assert row.torque_rms == pytest.approx(TORQUE / math.sqrt(2), rel=1e-12)
    # a percentile of samples is good to one spacing: 2 pi h A cos(0.99 pi / 2)
    assert row.torque_p99 == pytest.approx(TORQUE * math.sin(0.99 * math.pi / 2), abs=2e-4)
    assert row.speed_peak == pytest.approx(RATE, rel=1e-12)
    assert row.speed_rms == pytest.approx(RATE / math.sqrt(2), rel=1e-12)
    assert row.at_limit == 0.0


@pytest.mark.parametrize("lag", [0.7, math.pi])
def test_energies_of_a_sine(lag: float) -> None:
    """P = AB/2 (cos lag - cos(2wt - lag)): net AB T cos(lag)/2, absolute by Pythagoras' arc.

    The absolute integral over a period is AB T/pi (sin lag + (pi/2 - lag) cos lag), lag in 0..pi.
    """
    row = torque_budget(swinging(lag)).joint(JOINTS[17])
    size = TORQUE * RATE * CYCLE
    net = 0.5 * size * math.cos(lag)
    absolute = size / math.pi * (math.sin(lag) + (math.pi / 2 - lag) * math.cos(lag))
    assert row.positive_energy + row.negative_energy == pytest.approx(net, abs=CORNER * size)
    assert row.absolute_energy == pytest.approx(absolute, abs=CORNER * size)
    assert row.positive_energy >= 0.0 >= row.negative_energy
    half, c = 0.5 * TORQUE * RATE, math.cos(lag)  # P: from -(1 - cos lag) to 1 + cos lag halves
    peaks = row.power_peak, row.driving_power_peak, row.braking_power_peak
    expected = half * (1.0 + abs(c)), half * (1.0 + c), half * (1.0 - c)
    assert peaks == pytest.approx(expected, rel=1e-5, abs=1e-5 * half)  # between two samples


def test_cost_of_transport_of_a_known_walk() -> None:
    """0.1 m/s over cycles of 1 s: energy / (weight x 0.1 m), both conventions; backwards none."""
    budget = torque_budget(swinging(0.4))
    assert budget.distance == pytest.approx(0.1, rel=1e-9)
    assert budget.measured_speed == pytest.approx(0.1, rel=1e-9)
    expected = budget.absolute_energy / (WEIGHT * 0.1)
    assert budget.cost_of_transport == pytest.approx(expected)
    assert budget.cost_of_transport_positive < budget.cost_of_transport
    budget = torque_budget(swinging(travel_direction=[-1.0, 0.0]))
    assert budget.distance == pytest.approx(-0.1) and budget.cost_of_transport is None
    assert "does not move forward" in budget.table()


@pytest.mark.parametrize("side", [0.0, 2.0])
def test_a_turning_walk_counts_its_distance_along_the_heading(side: float) -> None:
    """On a circle of radius R each cycle makes the chord 2 R sin(turn / 2), walking at `side`.

    The start-up of exactly one cycle puts the middle of a cycle at a turn that is not zero.
    """
    trace = swinging(travel_direction=[math.cos(side), math.sin(side)])
    radius, rate = 0.4, 0.5
    turn = rate * trace.time
    q, com = np.array(trace.q), np.array(trace.com)
    q[:, 5], q[:, 6] = np.sin(turn / 2), np.cos(turn / 2)
    com[:, 0] = radius * (np.sin(side + turn) - np.sin(side))
    com[:, 1] = radius * (np.cos(side) - np.cos(side + turn))
    budget = torque_budget(replace(trace, q=q, com=com))
    assert budget.distance == pytest.approx(2 * radius * math.sin(rate * CYCLE / 2), rel=1e-9)


def test_the_window_is_whole_cycles_between_start_up_and_stop() -> None:
    """Round-off and samples that miss the last cycle's end by half a spacing lose no cycle."""
    window = steady_window(swinging(steady_from=0.95, steady_until=3.8))
    assert window.cycles == 2
    assert (window.start, window.end) == (pytest.approx(0.95), pytest.approx(2.95))
    trace = synthetic_trace(duration=4.9, sample=0.07, cycle_time=1.3, steady_from=1.0)
    assert steady_window(trace).cycles == 3
    assert steady_window(synthetic_trace(duration=0.3 * 7, cycle_time=0.3)).cycles == 3
    with refused(ParameterError, "duration", 1.8, allowed=(2.0,), about=("3",)):  # too short
        torque_budget(synthetic_trace(duration=1.8))


def test_a_held_posture_is_budgeted_over_the_second_half() -> None:
    budget = torque_budget(swinging(cycle_time=None, steady_from=0.0, nominal_speed=0.0))
    assert (budget.window.start, budget.window.end) == (pytest.approx(2.0), pytest.approx(4.0))
    assert budget.window.cycles is None
    row = budget.joint(JOINTS[17])
    assert row.positive_energy == pytest.approx(TORQUE * RATE, rel=1e-5)  # 2 s of mean A B / 2
    assert budget.cost_of_transport is None


def test_the_worst_joint_of_each_kind_is_named() -> None:
    """Amplitudes grow with the number; a sine cut at half its height is there for two thirds."""
    budget = torque_budget(swinging())
    femur = budget.kind("femur")
    assert femur.peak.joint == femur.rms.joint == femur.power.joint == "rr_femur_joint"
    assert femur.rms.torque_rms == pytest.approx(17 / 18 * TORQUE / math.sqrt(2))
    known = ["coxa", "femur", "tibia"]
    with refused(UnknownNameError, kind="kind of joint", name="knee", known=known):
        budget.kind("knee")
    torque = np.clip(wave(TORQUE, 0.0, 4.0), -1.0, 1.0)
    budget = torque_budget(synthetic_trace(sample=SAMPLE, torque=torque, effort_limit=[1.0] * 18))
    assert budget.joint(JOINTS[17]).at_limit == pytest.approx(2 / 3, abs=2e-3)
    assert budget.joint(JOINTS[0]).at_limit == 0.0


def test_printed_columns_hold_the_numbers_of_their_heads() -> None:
    """Cells are read again in the order of the heads; all numbers differ by more than rounding."""
    torque = TORQUE * wave(1.0, 0.7, 4.0) ** 41
    trace = synthetic_trace(sample=SAMPLE, torque=torque, rate=wave(RATE, 0.0, 4.0))
    budget = torque_budget(trace)
    femur, joint = budget.kind("femur"), budget.joint("rr_femur_joint")
    heads = {
        "peak torque": (femur.peak.torque_peak, joint.torque_peak),
        "p99": (femur.p99.torque_p99, joint.torque_p99),
        "RMS torque": (femur.rms.torque_rms, joint.torque_rms),
        "peak speed": (femur.speed.speed_peak, joint.speed_peak),
        "RMS speed": (femur.speed_rms.speed_rms, joint.speed_rms),
        "driving power": (femur.driving_power.driving_power_peak, joint.driving_power_peak),
        "braking power": (femur.braking_power.braking_power_peak, joint.braking_power_peak),
        "energy +": (femur.positive_energy, joint.positive_energy),
        "energy -": (femur.negative_energy, joint.negative_energy),
    }
    lines = budget.table().splitlines()
    for which, start in enumerate(("femur (x6)", "rr_femur_joint")):
        row = next(k for k, line in enumerate(lines) if line.startswith(start))
        head = next(line for line in reversed(lines[:row]) if "RMS torque" in line)
        places = [head.index(name) for name in heads]
        numbers = [found[which] for found in heads.values()]
        cells = [float(cell) for cell in lines[row].removeprefix(start).split()[:9]]
        assert places == sorted(places) and cells == pytest.approx(numbers, rel=5e-4)
        assert np.diff(np.log(sorted(map(abs, numbers)))).min() > 2e-3


def test_the_table_says_what_was_simulated_and_what_is_assumed() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1())
    case = RunCase(scene_settings=scene.settings, controller_data={"kind": "kinematic"})
    table = torque_budget(swinging(case=case, assumed=["hips at x = 0.2 m"])).table()
    for text in ("hunt-crossley with tanh", "kinematic", "assumed: hips at x = 0.2 m"):
        assert text in table
    assert "Outside the window lf_coxa_joint reaches 50 N m at 0 s" in table


def test_joint_kinds_by_name_or_place() -> None:
    for names in (("L1_1", "L1_2", "L1_3"), ("j_c1_lf", "j_thigh_lf", "j_tibia_lf")):
        assert joint_kinds(names, 1) == ("coxa", "femur", "tibia")
    assert joint_kinds(("FL_HAA", "FL_HFE", "FL_KFE"), 1) == ("coxa", "femur", "tibia")
    assert joint_kinds(("wheel", "arm"), 1) == ("joint", "joint")


def test_turning_on_the_spot_has_energy_per_yaw_and_no_cost_of_transport() -> None:
    """Torque times rate over 15 degrees a cycle; the 0.1 mm that it slips are no distance."""
    trace = swinging(turn_rate=0.2617993877991494, nominal_speed=0.0)
    q = np.array(trace.q)
    yaw = 0.2617993877991494 * trace.time
    q[:, 5], q[:, 6] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    budget = torque_budget(replace(trace, q=q))
    assert budget.distance is not None and budget.cost_of_transport is None
    assert budget.turn == pytest.approx(math.radians(15.0), rel=1e-9)
    expected = budget.absolute_energy / math.radians(15.0)
    assert budget.energy_per_radian == pytest.approx(expected, rel=1e-9)
    assert "15 deg, 100.0 % of the gait's 15" in budget.table()
