"""What joints demand: closed forms of sinusoids, and a walk computed again from its arrays."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.recorded_robot import RecordedRobot
from tests.sizing_cases import OMEGA, cycle, demand, of_motion, pure_inertia, walk

ROOT2 = np.sqrt(2.0)


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
    """Torques 1 and -3 for a fifth of the time: the lag rises to (1 - e^-a) / (1 - e^-b).

    a = 0.2 s / constant, b = 1 s / constant; the pulse's ramps last one sample of 1/20000 s.
    """
    time = cycle(20000)
    torque = np.outer(time < 0.2, [1.0, -3.0])
    found = of_motion(torque, 0.0 * torque, time)
    for constant in (0.05, 2.0):
        root = np.sqrt(np.expm1(-0.2 / constant) / np.expm1(-1.0 / constant))
        assert found.thermal_rms(constant) == pytest.approx([root, 3.0 * root], rel=3e-4)
    assert found.thermal_rms(1e-5) == pytest.approx([1.0, 3.0], rel=1e-6)
    with refused(ParameterError, "time_constant", 0.0):
        found.thermal_rms(0.0)


def test_another_rotor_at_the_same_motion() -> None:
    """The torque of an inertia J with a rotor J_m is that of J + J_m; what it has counts."""
    found = pure_inertia(0.02)
    assert found.torque_rms_with_armature(0.03) == pytest.approx(2.5 * found.torque_rms, rel=1e-4)
    own = pure_inertia(0.02, armature=0.005)  # 0.015 of load, 0.005 of rotor
    assert own.torque_rms_with_armature(0.005) == pytest.approx(own.torque_rms, rel=1e-12)
    assert own.torque_rms_with_armature(0.0) == pytest.approx(0.75 * own.torque_rms, rel=1e-4)


def test_a_walk_agrees_with_its_samples() -> None:
    """Peaks are those of samples and accepted states; means agree to what lies between samples."""
    trace, found = walk(), demand()
    summary = trace.summary
    first, last = (int(round(t / 2e-3)) for t in (summary.start, summary.end))
    tau, w = trace.torque[first : last + 1], trace.v[first : last + 1, 6:]
    time = trace.time[first : last + 1]
    assert found.cycles == summary.cycles == 2
    assert np.array_equal(found.torque, tau) and np.array_equal(found.speed, w)
    largest = np.maximum(np.abs(summary.torque_peak), np.abs(tau).max(axis=0))
    assert found.torque_peak == pytest.approx(largest, rel=1e-12)
    length = time[-1] - time[0]
    mean_square = np.trapezoid(tau**2, time, axis=0) / length
    assert found.torque_rms == pytest.approx(np.sqrt(mean_square), rel=0.02)
    net = found.positive_energy + found.negative_energy
    assert net == pytest.approx(np.trapezoid(tau * w, time, axis=0) / 2, rel=0.1, abs=2e-3)
    row = int(np.argmax(found.torque_peak))
    rate = trace.v[int(round(found.torque_peak_time[row] / 2e-3)), 6 + row]
    sign = np.sign(summary.torque_peak[row])
    assert found.torque_peak_speed[row] == pytest.approx(sign * rate, abs=0.15)


def test_the_load_inertia_of_a_walk_is_what_inverse_dynamics_asks_for() -> None:
    """RNEA with one joint accelerated alone, less the same at rest; the rotor is not in it."""
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


def test_cost_of_transport_is_that_of_the_torque_budget() -> None:
    found, whole = demand(), hp.torque_budget(walk())
    assert found.weight == pytest.approx(9.81 * (hp.load_robot("kharagpur").total_mass + 0.5))
    x = np.interp(found.time[[0, -1]], walk().time, walk().q[:, 0])  # of two cycles
    cost = found.positive_energy.sum() / (found.weight * (x[1] - x[0]) / 2)
    assert found.cost_of_transport_positive == pytest.approx(cost, rel=2e-3)
    assert found.cost_of_transport_positive == pytest.approx(whole.cost_of_transport_positive)
    assert found.cost_of_transport == pytest.approx(whole.cost_of_transport)


def test_a_run_that_cut_torques_off_has_a_note() -> None:
    """A motor of 0.6 N m: what the walk would take of a stronger one is unknown."""
    robot = hp.load_robot("kharagpur")
    weak = hp.Motor(stall_torque=0.6, no_load_speed=20.0)
    servo = hp.Servo(**hp.Servo.for_robot(robot).model_dump() | {"motor": weak})
    gait = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=0.6))
    trace = hp.simulate(hp.Scene(robot, servo=servo), gait, duration=1.9, accuracy=1e-3)
    notes = [note for note in hp.sizing.joint_demand(trace).notes if "at the torque limit" in note]
    assert len(notes) == 1 and "stronger" in notes[0]
    assert not any("at the torque limit" in note for note in demand().notes)


def test_of_some_kinds_alone() -> None:
    part = demand().of_kinds(["tibia"])
    whole = [name for name in demand().joint_names if "tibia" in name]
    assert list(part.joint_names) == whole and part.torque.shape[1] == 6
    assert np.array_equal(part.torque_peak, demand().torque_peak[2::3])
    with refused(UnknownNameError, kind="kind of joint", name="wheel"):
        demand().of_kinds(["wheel"])


@pytest.mark.parametrize(
    ("time", "rows", "name", "value"),
    [([0.0, 0.0], 2, "JointDemand.time", 2), ([0.0, 1.0], 3, "torque", (3, 1))],
)
def test_samples_that_do_not_fit_are_refused(time, rows, name, value) -> None:
    none = np.zeros((rows, 1))
    with refused(ParameterError, name, value), np.errstate(all="ignore"):
        hp.sizing.JointDemand.of_samples(time, none, none)
