"""PID and suspension over time: closed forms of their difference and differential equations."""

from __future__ import annotations

import numpy as np
import pytest
from foot_control_runs import in_foot_order, reading, recall, robot
from scipy.spatial.transform import Rotation
from test_foot_control_parts import PUSHED, T, loads_on, made, ticks

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.foot_control.leg_model import standing_centre

NAME = "kharagpur"
FEET = leg_group(robot(NAME)).neutral_feet
ALONG = (FEET[4] - FEET[0]) / np.linalg.norm(FEET[4] - FEET[0])


def squeezed(size: float):
    """Return the reading of feet 0 and 4 that squeeze the trunk: an error of `size` [N]."""
    force = PUSHED.copy()
    force[0] += size * ALONG
    force[4] -= size * ALONG
    return loads_on(NAME, force)


def corrections(sizes, **gains):
    """Return the correction of foot 0 along the squeeze at ticks with errors of these sizes [m]."""
    slip = hp.foot_control.SlipPid(signal="force", anticipates=False, **gains)
    _, memory = ticks(made(slip=slip), [squeezed(size) for size in sizes])
    found = recall(memory, "correction")
    assert found[:, 0] == pytest.approx(-found[:, 4], abs=1e-12)
    assert np.abs(found[:, [1, 2, 3, 5]]).max() < 1e-12
    return found[:, 0] @ ALONG


def test_parts_of_the_pid():
    """Kp e + ki e n T; of a ramp of slope a: kd a (1 - (tau / (tau + T))^n), none at first."""
    n = np.arange(1, 41)
    found = corrections([2.0] * 40, kp=1e-4, ki=2e-3, limit=1.0)
    assert found == pytest.approx(1e-4 * 2.0 + 2e-3 * 2.0 * n * T, rel=1e-9)
    a, tau, kd = 30.0, 0.02, 1e-5
    n = np.arange(40)
    found = corrections(a * T * n, kp=0.0, ki=0.0, kd=kd, derivative_time=tau, limit=1.0)
    assert found == pytest.approx(kd * a * (1.0 - (tau / (tau + T)) ** n), rel=1e-6, abs=1e-12)


def test_the_integral_stops_at_the_limit_and_leaves_it_at_once():
    """Without anti-windup an integral of 400 ticks would need 390 to come back."""
    step = 1e-2 * 2.0 * T
    limit = 10.5 * step  # between two ticks: the integral stops at ten steps
    sizes = [2.0] * 400 + [-2.0] * 20
    found = corrections(sizes, kp=0.0, ki=1e-2, limit=limit)
    assert found[10:400] == pytest.approx([limit] * 390, rel=1e-12)
    assert found[400:419] == pytest.approx(step * np.arange(9, -10, -1), rel=1e-6, abs=1e-15)
    assert np.abs(found).max() <= limit * (1.0 + 1e-12)


def moved(places: np.ndarray, **others):
    return reading(NAME, places, foot_force=in_foot_order(NAME, PUSHED), **others)


SLIDING = hp.foot_control.SlipPid(signal="slip", kp=1.0, ki=0.0, anticipates=False)


def test_a_foot_that_slides_is_put_back():
    """One of six slides by d: that less the shift and turn of all feet that comes nearest to it."""
    d = np.array([1e-3, -2e-3, 0.0])
    after = FEET.copy()
    after[2] += d
    target, memory = ticks(made(slip=SLIDING), [moved(FEET), moved(after), moved(after)])
    slid = recall(memory, "slid")
    x, y = after[:, :2].T
    one, none = np.ones(6), np.zeros(6)
    common = np.block([[one, none], [none, one], [-y, x]]).T
    motion = (after - FEET)[:, :2].T.ravel()
    rest = motion - common @ np.linalg.lstsq(common, motion, rcond=None)[0]
    for row in slid[1:]:  # it does not slide further
        assert row[:, :2].T.ravel() == pytest.approx(rest, abs=3e-6)
    assert target[2] - FEET == pytest.approx(-slid[2], abs=1e-9)


def turning_trunk(rate: np.ndarray, first_rate: np.ndarray):
    shift, readings = np.array([2e-3, 1e-3, -1e-3]), []
    for k in range(30):
        turn = Rotation.from_rotvec(-k * T * rate).as_matrix()
        gyroscope = (rate if k else first_rate)[None]
        readings.append(moved(FEET @ turn.T - k * shift / 30.0, angular_velocity=gyroscope))
    return readings


def test_a_trunk_that_moves_over_its_feet_slides_none():
    rate = np.array([0.05, -0.03, 0.2])
    _, memory = ticks(made(slip=SLIDING), turning_trunk(rate, np.zeros(3)))
    way = recall(memory, "foot")[-1] - recall(memory, "foot")[0]
    assert np.linalg.norm(way, axis=1).min() > 5e-3
    assert np.abs(recall(memory, "slid")).max() < 1e-5  # second order in the angle of a tick
    # a run may begin in motion: the first tick knows of no way of the feet yet
    _, memory = ticks(made(slip=SLIDING), turning_trunk(rate, rate))
    assert np.abs(recall(memory, "slid")).max() < 1e-5


def test_corrections_stay_at_lift_off_and_are_removed_in_the_swing():
    walk = hp.KinematicControl(hp.Gait.tripod(cycle_time=2.0))
    slip = hp.foot_control.SlipPid(signal="force", kp=0.0, ki=1e-3, anticipates=False)
    law = made(walk=walk, slip=slip)
    targets, memory = ticks(law, [squeezed(2.0)] * 420)
    plan = np.array([law.walk.table.at(k * T + law.lead) for k in range(420)])
    lift = int(np.argmax(plan[:, 0, 6] == 0.0))
    correction, offset = recall(memory, "correction")[:, 0], recall(memory, "offset")[:, 0]
    assert np.linalg.norm(correction[lift - 1]) > 1e-3
    assert not correction[lift].any() and not recall(memory, "integral")[lift, 0].any()
    assert recall(memory, "left_with")[lift, 0] == pytest.approx(correction[lift - 1])
    apart = targets[:, 0] - plan[:, 0, :3]
    assert np.abs(np.diff(apart[lift - 2 : lift + 40], axis=0)).max() < 1e-4
    landed = lift + int(np.argmax(plan[lift:, 0, 6] == 1.0))
    assert np.abs(offset[landed - 1]).max() < 1e-4 * np.abs(offset[lift]).max() + 1e-9


LOAD = 5.0  # N, nominal


def travels(extra, period: float = T, **settings):
    settings = {"limit": 1.0, "tilt": 1.0, **settings}
    suspension = hp.foot_control.VirtualSuspension(load=LOAD, **settings)
    law = made(suspension=suspension, period=period)
    readings = []
    for more in extra:
        force = PUSHED.copy()
        force[0, 2] += more
        readings.append(loads_on(NAME, force))
    targets, memory = ticks(law, readings)
    travel = recall(memory, "travel")
    assert np.abs(travel[:, 1:]).max() < 1e-12
    shift = targets - FEET  # the foot is drawn up
    assert shift[:, 0] == pytest.approx(travel[:, :1] * [0.0, 0.0, 1.0], abs=1e-9)
    return travel[:, 0]


def test_static_travel_is_load_over_stiffness():
    found = travels([2.0] * 600, stiffness=400.0, frequency=4.0)
    assert found[-1] == pytest.approx(2.0 / 400.0, rel=1e-9)
    found = travels([50.0] * 300 + [0.0] * 300, stiffness=400.0, frequency=4.0, limit=0.004)
    assert found[:300].max() == found[299] == 0.004
    assert found[301] < 0.004 and abs(found[-1]) < 1e-6


@pytest.mark.parametrize("damping", [0.4, 1.6])
def test_the_step_response_is_that_of_mass_spring_and_damper(damping):
    """Implicit Euler: the error falls with the period."""
    k, frequency, duration = 400.0, 3.0, 0.4
    w = 2.0 * np.pi * frequency
    roots = np.roots([1.0, 2.0 * damping * w, w * w])
    errors = []
    for period in (0.004, 0.002):
        count = round(duration / period)
        found = travels([2.0] * count, period, stiffness=k, frequency=frequency, damping=damping)
        t = period * np.arange(1, count + 1)
        a, b = roots
        exact = 2.0 / k * (1.0 + ((b * np.exp(a * t) - a * np.exp(b * t)) / (a - b)).real)
        errors.append(np.abs(found - exact).max())
    assert errors[0] < 0.1 * 2.0 / k
    assert errors[1] < 0.6 * errors[0]


@pytest.mark.parametrize("gains", [(0.5, 0.25, 2.0), (0.0, 1.0, 0.0)])
def test_legs_yield_to_the_modes_of_the_loads(gains):
    """At rest travel is P e / k; heave, tilt and warp by projections on a plane over the feet."""
    error, k = np.array([1.0, -0.4, 0.3, 0.8, -1.1, 0.2]), 400.0
    names = ("heave", "tilt", "warp")
    suspension = hp.foot_control.VirtualSuspension(
        load=LOAD, stiffness=k, frequency=4.0, limit=1.0, **dict(zip(names, gains, strict=True))
    )
    force = PUSHED.copy()
    force[:, 2] += error
    _, memory = ticks(made(suspension=suspension), [loads_on(NAME, force)] * 900)
    arms = FEET[:, :2] - standing_centre(robot(NAME))[:2]
    plane = np.column_stack([np.ones(6), arms])
    rigid, heave = plane @ np.linalg.pinv(plane), np.full((6, 6), 1.0 / 6.0)
    shares = (heave, rigid - heave, np.eye(6) - rigid)
    expected = sum(g * part @ error for g, part in zip(gains, shares, strict=True)) / k
    assert recall(memory, "travel")[-1] == pytest.approx(expected, abs=1e-4 * 1.1 / k)


def test_forces_are_filtered():
    """First order, implicit: after n ticks f (1 - (tau / (tau + T))^n)."""
    sensing = hp.foot_control.FootForceSensing(cutoff=5.0)
    tau = 1.0 / (2.0 * np.pi * 5.0)
    readings = [reading(NAME)] + [loads_on(NAME, PUSHED)] * 30
    _, memory = ticks(made(force=sensing), readings)
    expected = 5.0 * (1.0 - (tau / (tau + T)) ** np.arange(31))
    assert recall(memory, "force")[:, 3, 2] == pytest.approx(expected, rel=1e-9)


def test_levelling_integrates_the_tilt_up_to_its_limit():
    level = hp.foot_control.Levelling(bandwidth=0.5, limit=0.02)
    roll, pitch = 0.01, -0.02
    rotation = Rotation.from_euler("ZYX", [0.7, pitch, roll]).as_matrix()[None]
    law = made(levelling=level)
    targets, memory = ticks(law, [loads_on(NAME, PUSHED, rotation=rotation)] * 300)
    n = np.arange(1, 301)
    step, most = T * 2.0 * np.pi * 0.5, np.tan(0.02)
    assert recall(memory, "roll") == pytest.approx(np.minimum(step * roll * n, most), rel=1e-9)
    assert recall(memory, "pitch") == pytest.approx(np.minimum(-step * pitch * n, most), rel=1e-9)
    up = recall(memory, "pitch")[-1] * FEET[:, 0] + recall(memory, "roll")[-1] * FEET[:, 1]
    assert targets[-1, :, 2] - FEET[:, 2] == pytest.approx(up, abs=1e-9)
