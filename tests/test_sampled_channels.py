"""Sliding, currents and temperatures at the samples; the states in which torques are largest."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.errors import NotRecordedError, ParameterError
from hexapod_pin.results.schema import schema
from hexapod_pin.simulation.plant import native_acceleration

MOTOR = hp.Motor(
    stall_torque=1e3, no_load_speed=1e3, gear_ratio=100.0, torque_constant=0.02,
    winding_resistance=2.0, thermal_resistance_winding=4.0, thermal_resistance_housing=10.0,
    thermal_time_winding=0.8, thermal_time_housing=60.0, ambient=30.0,
)  # fmt: skip  # too strong to matter; heats up within seconds
BARE = MOTOR.model_copy(update={"winding_resistance": None})
GAIT = hp.Gait.tripod(stroke=0.1, cycle_time=0.6)
EVERYTHING = (
    "torque", "set_points", "contacts", "com", "energy", "sliding", "current", "temperature"
)  # fmt: skip


@pytest.fixture(scope="module")
def case() -> hp.Case:
    robot = hp.load_robot("kharagpur")
    gains = hp.Servo.for_robot(robot)
    motors = {"coxa": MOTOR, "femur": MOTOR, "tibia": BARE}
    scene = hp.Scene(robot, servo=hp.Servo(kp=gains.kp, kd=gains.kd, motor=motors))
    return hp.Case(scene, hp.KinematicControl(GAIT), duration=3.0, record=EVERYTHING)


@pytest.fixture(scope="module")
def trace(case: hp.Case) -> hp.Trace:
    return case.run()


def test_the_sliding_of_a_foot_is_that_of_its_lowest_point(case, trace) -> None:
    """By Pinocchio's Jacobians; 0 in the air, and over a cycle the distance of the summary."""
    robot, model = case.scene.robot, case.scene.robot.model
    data, seen = model.createData(), 0
    loaded = trace.normal_force > 0.0
    assert np.all(trace.slip_speed[~loaded] == 0.0)
    for k in range(100, len(trace.time), 97):
        pin.computeJointJacobians(model, data, trace.q[k])
        for f, foot in enumerate(robot.feet):
            if not loaded[k, f]:
                continue
            joint = model.getJointId(foot.joint)
            frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            twist = pin.getJointJacobian(model, data, joint, frame) @ trace.v[k]
            contact = trace.foot_position[k, f] - [0.0, 0.0, foot.radius + trace.foot_gap[k, f]]
            arm = contact - data.oMi[joint].translation
            speed = np.linalg.norm((twist[:3] + np.cross(twist[3:], arm))[:2])
            # half of the depth at most separates two notions of the point of contact
            bound = np.linalg.norm(twist[3:]) * abs(trace.foot_gap[k, f]) + 1e-12
            assert trace.slip_speed[k, f] == pytest.approx(speed, abs=bound)
            seen += 1
    assert seen > 20
    window = trace.summary.path[[0, -1], 0]
    inside = (trace.time >= window[0] - 1e-9) & (trace.time <= window[1] + 1e-9)
    distance = np.trapezoid(trace.slip_speed[inside], trace.time[inside], axis=0)
    # touch-downs last a few samples: their sliding is known to a tenth from samples
    expected = trace.summary.slip_distance * trace.summary.cycles
    assert distance == pytest.approx(expected, rel=0.1)


def test_currents_and_temperatures_are_those_of_the_motors(trace) -> None:
    """I = torque / (N k) of warm magnets; both bodies by another solver on sampled currents."""
    cold = trace.torque / (100.0 * 0.02)
    names = trace.joint_names
    bare = np.array(["tibia" in name for name in names])
    assert trace.current[:, bare] == pytest.approx(cold[:, bare], rel=1e-14)
    assert np.isnan(trace.temperature[:, bare]).all()
    assert np.all(trace.temperature[0, ~bare] == 30.0)
    joint = int(np.argmax(np.where(bare, 0.0, trace.temperature[-1])))
    square = trace.current[:, joint] ** 2

    def slope(t: float, x: np.ndarray) -> list[float]:
        power = np.interp(t, trace.time, square) * 2.0 * (1.0 + 0.0039 * (x[0] - 25.0))
        out = (x[0] - x[1]) / 4.0
        return [(power - out) / (0.8 / 4.0), (out - (x[1] - 30.0) / 10.0) / (60.0 / 10.0)]

    settings = dict(max_step=2e-3, rtol=1e-8, t_eval=trace.time)
    heated = solve_ivp(slope, (0.0, trace.time[-1]), [30.0, 30.0], **settings).y
    # the housing warms by a tenth of a kelvin, which shifts currents by 1e-4
    flux = 1.0 - 0.0011 * (heated[1] - 25.0)
    assert 30.05 < heated[1, -1] < 30.2
    assert trace.current[:, joint] == pytest.approx(cold[:, joint] / flux, rel=1e-6)
    found = heated[0, -1]
    # the rise is linear in the current's square, which samples resolve to a hundredth
    assert found > 30.2
    assert trace.temperature[-1, joint] - 30.0 == pytest.approx(found - 30.0, rel=0.01)


def test_what_is_not_asked_for_is_not_there_and_changes_nothing(case, trace, tmp_path) -> None:
    usual = hp.Case(case.scene, case.controller, duration=3.0).run()
    assert usual.recorded == ("motion", "torque", "set_points", "contacts", "com", "energy")
    with refused(NotRecordedError, "slip_speed", about=("--record",)):
        _ = usual.slip_speed
    for name in vars(usual).keys() & schema(hp.Trace):
        assert np.array_equal(getattr(usual, name), getattr(trace, name)), name
    assert usual.summary.data == trace.summary.data and usual.peaks == trace.peaks
    again = hp.load_trace(trace.save(tmp_path / "walk.nc"))
    assert again == trace and again.recorded == trace.recorded and again.peaks == trace.peaks


def test_what_no_motor_has_is_refused(case) -> None:
    for group, motor in (("current", None), ("temperature", BARE)):
        scene = hp.Scene(case.scene.robot, servo=hp.Servo(kp=40.0, kd=0.8, motor=motor))
        with refused(ParameterError, "record", group, about=("torque_constant",)):
            hp.simulate(scene, hp.HoldPosture(), duration=0.01, record=[group])


def test_the_run_keeps_the_states_of_its_peaks(case, trace: hp.Trace) -> None:
    """The servo's law in that state, with the plan's set-points then, gives the peak."""
    peaks, summary = trace.peaks, trace.summary
    assert peaks is not None
    assert np.array_equal(peaks.time, summary.torque_peak_time)
    assert np.array_equal(np.diag(peaks.torque), summary.torque_peak)
    plan = case.controller.plan(case.scene.robot, 3.0)
    kp, kd = case.scene.servos.gains(case.scene.robot)
    between = 0
    for j, time in enumerate(peaks.time):
        points = native.set_points_at(
            plan.time.tolist(), plan.q, plan.v, plan.kind, native_acceleration(plan), time
        )
        torque = kp * (points[0] - peaks.q[j, 7:]) + kd * (points[1] - peaks.v[j, 6:])
        # a torque of 1 N m is a difference of angles of 1e-2 rad, each known to 1e-16
        assert peaks.torque[j] == pytest.approx(torque, abs=1e-10)
        after = int(np.searchsorted(trace.time, time - 1e-12))
        if abs(trace.time[after] - time) < 1e-9:  # a peak at a sample is that sample
            assert np.array_equal(peaks.q[j], trace.q[after])
            assert np.allclose(peaks.foot_force[j], trace.foot_force[after], atol=1e-9)
            continue
        between += 1
        share = (time - trace.time[after - 1]) / (trace.time[after] - trace.time[after - 1])
        middle = (1.0 - share) * trace.q[after - 1] + share * trace.q[after]
        # within 2 ms, at 50 rad/s^2 at most, a joint is off the chord by 50 (2e-3)^2 / 8
        assert np.abs(peaks.q[j] - middle).max() < 1e-4
    assert between > 0


def test_a_run_without_a_whole_cycle_has_no_states_of_peaks(case) -> None:
    trace = hp.simulate(case.scene, case.controller, duration=0.1)
    assert trace.peaks is not None and np.isnan(trace.peaks.q).all()
