"""The parts of foot control tick by tick, from readings made up by hand, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from foot_control_runs import EARLY, in_foot_order, reading, recall, robot, standing
from scipy.spatial.transform import Rotation

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.foot_control.controller import ReadyLaw, ready_law

T = 0.005  # s, between ticks
SERVO = hp.Servo(kp=100.0, kd=1.0)
every_robot = pytest.mark.parametrize("name", ["kharagpur", "athena"])


def made(name: str = "kharagpur", walk: Any = None, **parts: Any) -> ReadyLaw:
    control = hp.FootControl(standing() if walk is None else walk, **parts)
    return ready_law(control, hp.Scene(robot(name), servo=SERVO), refuse=False)


def ticks(law: ReadyLaw, readings: Any, first: int = 0, memory: Any = None):
    memory, feet, memories = law.first_memory(1) if memory is None else memory, [], []
    for k, m in enumerate(readings, start=first):
        target, memory = law.tick(k * T, m, memory)
        feet.append(target[0, :, :3])
        memories.append(memory[0])
    return np.array(feet), np.array(memories)


def loads_on(name: str, force: Any, **others: Any):
    return reading(name, foot_force=in_foot_order(name, force), **others)


PUSHED = np.outer(np.ones(6), [0.0, 0.0, 5.0])
"""Five newtons upward on every foot."""


ANTICIPATING = hp.foot_control.SlipPid(kp=0.0, ki=0.0, kd=0.0)


def anticipated(name: str, rotation: np.ndarray):
    law = made(name, slip=ANTICIPATING)
    plan = law.walk.table.at(law.lead)
    force = in_foot_order(name, PUSHED @ rotation.T)
    measured = reading(name, plan[:, :3], foot_force=force, rotation=rotation[None])
    _, memory = law.tick(0.0, measured, law.first_memory(1))
    one, foot = robot(name), plan[:, :3] - leg_group(robot(name)).radius[:, None] * [0.0, 0.0, 1.0]
    data = one.model.createData()
    q = np.concatenate([pin.neutral(one.model)[:7], measured.q[0]])
    centre = pin.centerOfMass(one.model, data, q)
    return recall(memory, "target")[0], foot - centre


@every_robot
@pytest.mark.parametrize("turn", [(0.1, 0.0, 0.4), (0.0, 0.12, 0.0)])
def test_six_feet_share_the_weight_with_the_least_squares(name, turn):
    """On a slope, the trunk along with it: vertical forces with the least sum of squares."""
    rotation = Rotation.from_rotvec(turn).as_matrix()
    loads, arms = anticipated(name, rotation)
    up, weight = rotation.T[:, 2], 9.81 * robot(name).total_mass
    wrench = np.vstack([np.tile(up[:, None], 6), np.cross(arms, up).T])
    expected = np.linalg.pinv(wrench, rcond=1e-9) @ [*(weight * up), 0.0, 0.0, 0.0]
    assert loads == pytest.approx(np.outer(expected, up), rel=1e-8, abs=1e-8 * weight)
    assert np.ptp(expected) > 0.01 * weight


def statics(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    one, six = robot(name), leg_group(robot(name))
    data, q = one.model.createData(), one.stand().q
    own = pin.computeGeneralizedGravity(one.model, data, q)[6:][six.joint_index]
    pin.computeJointJacobians(one.model, data, q)
    jacobians, soles = [], []
    for leg, columns in zip(six.legs, six.joint_index, strict=True):
        foot = one.foot(one.leg(leg.name).foot)
        place = data.oMi[one.model.getJointId(foot.joint)].act(np.array(foot.offset))
        place = place - [0.0, 0.0, foot.radius]
        column = data.J[:, 6 + columns]
        jacobians.append(column[:3] + np.cross(column[3:].T, place).T)
        soles.append(place - q[:3])
    return own, np.array(jacobians), np.array(soles)


@every_robot
def test_anticipated_torques_are_those_of_statics(name):
    law = made(name, slip=ANTICIPATING)
    target, memory = law.tick(0.0, loads_on(name, PUSHED), law.first_memory(1))
    own, jacobian, _ = statics(name)
    expected = own - np.einsum("lij,li->lj", jacobian, recall(memory, "target")[0])
    assert 100.0 * target[0, :, 6:9] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert target[0, :, 9:] == pytest.approx(0.0, abs=1e-12)
    assert target[0, :, :3] == pytest.approx(law.walk.table.at(law.lead)[:, :3], abs=1e-12)


def test_anticipated_torques_are_the_servos():
    """Kp d + kd d' is the torque at every tick, while loads change; d between two ticks, too."""
    walk, name = hp.KinematicControl(hp.Gait.tripod(cycle_time=2.0)), "kharagpur"
    law, memory = made(name, walk, slip=ANTICIPATING), None
    offsets, rates, torques = [], [], []
    measured = loads_on(name, PUSHED)
    for k in range(400):
        target, memory = law.tick(k * T, measured, law.first_memory(1) if k == 0 else memory)
        offsets.append(target[0, :, 6:9])
        rates.append(target[0, :, 9:])
        torques.append(100.0 * recall(memory, "wanted")[0])
    d, rate, torque = (np.array(part) for part in (offsets, rates, torques))
    assert np.ptp(torque, axis=0).max() > 0.1
    assert 100.0 * d + 1.0 * rate == pytest.approx(torque, abs=1e-9)  # kp, kd of the servo
    lag, exact = 0.01, d[0]
    for before, now, found in zip(torque, torque[1:], d[1:], strict=False):
        slope = (now - before) / T
        fades = np.exp(-T / lag)
        exact = (now - lag * slope) / 100.0 + (exact - (before - lag * slope) / 100.0) * fades
        assert found == pytest.approx(exact, abs=1e-12)


@every_robot
def test_measured_forces_are_turned_into_trunk_axes(name):
    """Sensors measure in world axes; the rotation takes trunk axes to world axes."""
    force = np.random.default_rng(1).uniform(1.0, 9.0, (6, 3))
    rotation = Rotation.from_rotvec((0.1, -0.2, 0.8)).as_matrix()
    _, memory = ticks(made(name), [loads_on(name, force @ rotation.T, rotation=rotation[None])])
    assert recall(memory, "force")[0] == pytest.approx(force, rel=1e-12)


@every_robot
def test_a_foot_that_lands_early_stays_where_it_is_while_the_trunk_turns(name):
    """At rest in the world: a turn of the wrong sign would drag it by 8 mm."""
    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=2.0, turn_rate=0.1))
    law, path = made(name, walk, touch_down=hp.foot_control.TouchDown()), walk.path(robot(name))
    memory, places = law.first_memory(1), []
    for k in range(800):
        plan = law.walk.table.at(k * T + law.lead)
        force = PUSHED * np.maximum(plan[:, 6:7], plan[:, 7:8] > 0.8)
        measured = reading(name, plan[:, :3], foot_force=in_foot_order(name, force))
        target, memory = law.tick(k * T, measured, memory)
        x, y, yaw = path.body_pose([k * T + law.lead])[0]
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        early = recall(memory, "mode")[0] == EARLY
        places.append(np.where(early[:, None], target[0, :, :2] @ turn.T + (x, y), np.nan))
    seen = np.array(places)[400:]  # the second cycle
    assert (np.isfinite(seen[..., 0]).sum(axis=0) > 20).all()
    assert np.nanmax(np.nanmax(seen, axis=0) - np.nanmin(seen, axis=0)) < 2e-3


FORCED = hp.foot_control.SlipPid(signal="force", kp=1e-5, ki=0.0, anticipates=False)


def internal(name: str, tangential: np.ndarray, load: np.ndarray, rotation: Any = None):
    rotation = np.eye(3) if rotation is None else rotation
    force = np.column_stack([tangential, load])
    measured = loads_on(name, force @ rotation.T, rotation=rotation[None])
    target, memory = ticks(made(name, slip=FORCED), [measured])
    error = recall(memory, "error")[0]
    assert target[0] - leg_group(robot(name)).neutral_feet == pytest.approx(
        1e-5 * error, abs=1e-12
    )  # feet give way along it
    return error


@every_robot
def test_internal_forces_have_no_resultant_and_no_moment(name):
    rng = np.random.default_rng(5)
    tangential, load = rng.normal(size=(6, 2)), rng.uniform(3.0, 9.0, 6)
    error = internal(name, tangential, load, Rotation.from_rotvec((0.2, -0.1, 1.0)).as_matrix())
    feet = leg_group(robot(name)).neutral_feet
    assert np.abs(error).max() > 0.3
    assert np.abs(error.sum(axis=0)).max() < 1e-12 and np.abs(error[:, 2]).max() < 1e-12
    assert np.cross(feet, error).sum(axis=0)[2] == pytest.approx(0.0, abs=1e-12)


@every_robot
def test_forces_in_proportion_to_the_loads_are_not_internal(name):
    load = np.array([3.0, 5.0, 4.0, 6.0, 8.0, 7.0])
    feet = leg_group(robot(name)).neutral_feet
    arm = feet - load @ feet / load.sum()
    turning = np.column_stack([-arm[:, 1], arm[:, 0]])
    tangential = load[:, None] * (np.array([0.2, -0.1]) + 0.7 * turning)
    assert np.abs(tangential).max() > 1.0
    assert np.abs(internal(name, tangential, load)).max() < 1e-12
    along, tangential = (feet[4] - feet[0])[:2], np.zeros((6, 2))
    tangential[0], tangential[4] = 2.0 * along, -2.0 * along
    error = internal(name, tangential, np.full(6, 5.0))
    assert error[:, :2] == pytest.approx(tangential, abs=1e-12)
