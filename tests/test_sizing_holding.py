"""Holding torque: three and four feet by hand, tipping, and the stances of a walk again."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pinocchio as pin
import pytest
from synthetic import with_run

import hexapod_pin as hp
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.sizing.trace_demand import foot_places
from hexapod_pin.robot.holding_torque import holding_torque
from tests.sizing_cases import demand, record, walk

WEIGHT = 10.0 * 9.81
REACH = 0.3  # of a leg from hinge to foot, m


def table(places: list[tuple[float, float]], center: tuple[float, float]) -> tuple:
    """Return model and feet of a trunk of 10 kg on massless legs hinged about +y, along +x."""
    text = (
        f'<robot name="table"><link name="base"><inertial><origin xyz="{center[0]} {center[1]} 0"/>'
        '<mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        "</link>"
    )
    for k, (x, y) in enumerate(places):
        text += (
            f'<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="base"/>'
            f'<child link="l{k}"/><origin xyz="{x - REACH} {y} 0"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )
    model = pin.buildModelFromXML(text + "</robot>", pin.JointModelFreeFlyer())
    offset = np.array([REACH, 0.0, 0.0])
    return model, [(model.getJointId(f"j{k}"), offset) for k in range(len(places))]


def holding(model: pin.Model, feet: list, *supports: list[bool], tilt: float = 0.0):
    """Return the holding torques in the neutral posture, the trunk turned about the vertical."""
    q = pin.neutral(model)
    q[5:7] = np.sin(tilt / 2.0), np.cos(tilt / 2.0)
    return holding_torque(model, feet, q[None], np.array([supports]))


@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_three_feet_by_hand(turn: float) -> None:
    """Forces 0.2, 0.3, 0.5 of the weight; a leg pressed up turns about -y: tau is positive."""
    model, feet = table([(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)], (0.2, 0.3))
    found = holding(model, feet, [True] * 3, tilt=turn)
    share = np.array([0.2, 0.3, 0.5]) * WEIGHT
    assert found.force[0, 0] == pytest.approx(share, rel=1e-9)
    order = [feet[k][0] - 2 for k in range(3)]
    assert found.torque[0, 0][order] == pytest.approx(share * REACH, rel=1e-9)


def test_four_feet_share_with_least_norm_and_none_is_pulled() -> None:
    """Corners (+-1, +-1): W (1/4 + (x xk + y yk) / 4) while that is positive; then three carry."""
    corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
    model, feet = table(corners, (0.2, 0.1))
    force = holding(model, feet, [True] * 4).force[0, 0]
    expected = [WEIGHT * (0.25 + (0.2 * x + 0.1 * y) / 4.0) for x, y in corners]
    assert force == pytest.approx(expected, rel=1e-9)
    model, feet = table(corners, (0.7, 0.6))  # the formula gives the last foot -0.075 W
    found = holding(model, feet, [True] * 4, [True, True, True, False])
    expected = WEIGHT * np.array([0.65, 0.2, 0.15, 0.0])  # moments about the two other feet
    assert found.force[0, 0] == pytest.approx(expected, abs=1e-6 * WEIGHT)
    assert found.torque[0, 0] == pytest.approx(found.torque[0, 1], abs=1e-6 * WEIGHT)


def test_a_robot_that_would_tip_over_is_told() -> None:
    places = [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)]
    model, feet = table(places, (0.6, 0.6))
    cases = [[True] * 3, [True, True, False], [True, False, False], [False] * 3]
    found = holding(model, feet, *cases)
    assert not found.holds.any() and np.isnan(found.torque).all()
    model, feet = table(places, (0.5, 0.5))
    line = holding(model, feet, [True, True, False])
    assert line.force[0, 0] == pytest.approx(WEIGHT * np.array([0.5, 0.5, 0.0]), rel=1e-9)


def least_norm(rows: np.ndarray, load: np.ndarray) -> np.ndarray | None:
    """Return the shortest forces >= 0 that balance, by trying every set of feet."""
    best = None
    for count in range(1, len(rows) + 1):
        for chosen in combinations(range(len(rows)), count):
            force = np.zeros(len(rows))
            force[list(chosen)] = np.linalg.pinv(rows[list(chosen)].T) @ load
            left = np.abs(rows.T @ force - load).max()
            if left > 1e-6 * np.linalg.norm(load) or force.min() < -1e-9:
                continue
            if best is None or force @ force < best @ best - 1e-12:
                best = force
    return best


def test_the_stances_of_a_walk_again() -> None:
    """Forces by trying all sets of feet, torques by RNEA under them, at the same samples."""
    trace, found = walk(), demand()
    robot = RecordedRobot.of(trace)
    model, data, feet = robot.model, robot.model.createData(), foot_places(robot)
    inside = np.flatnonzero((trace.time >= found.time[0]) & (trace.time <= found.time[-1]))
    picked = inside[np.unique(np.linspace(0, len(inside) - 1, 32).round().astype(int))]
    torques, falls, zero = [], [], np.zeros(model.nv)
    first = [(trace.q[0], range(6))]
    stances = first + [(trace.q[k], np.flatnonzero(trace.foot_force[k, :, 2] > 0)) for k in picked]
    for q, stands in stances:
        pin.forwardKinematics(model, data, q)
        place = np.array([data.oMi[feet[f][0]].act(feet[f][1]) for f in stands])
        center = pin.centerOfMass(model, data, q)
        rows = np.column_stack([np.ones(len(place)), place[:, :2] - center[:2]])
        force = least_norm(rows, np.array([robot.total_mass * 9.81, 0.0, 0.0]))
        falls.append(force is None)
        if force is None:
            continue
        outside = pin.StdVec_Force([pin.Force.Zero()] * model.njoints)
        for f, up in zip(stands, force, strict=True):
            joint, offset = feet[f]
            own = data.oMi[joint].rotation.T @ [0.0, 0.0, up]
            outside[joint] += pin.Force(own, np.cross(offset, own))
        torque = pin.rnea(model, data, q, zero, zero, outside)
        assert np.abs(torque[:6]).max() < 1e-4 * robot.total_mass * 9.81
        torques.append(np.abs(torque[6:]))
    assert found.standing == pytest.approx(torques[0], rel=1e-5, abs=1e-6)
    assert found.holding == pytest.approx(np.max(torques, axis=0), rel=1e-5, abs=1e-6)
    assert found.unheld == pytest.approx(np.mean(falls[1:]))


def test_losing_a_leg_loads_the_others_and_may_tip_the_robot() -> None:
    """A tetrapod stands on four feet and often falls on three; on five it always stands."""
    found = demand()
    assert set(found.unheld_lost_leg) == {"lf", "lm", "lr", "rf", "rm", "rr"}
    assert 0.0 < min(found.unheld_lost_leg.values()) and max(found.unheld_lost_leg.values()) < 1.0
    femurs = [j for j, kind in enumerate(found.joint_kinds) if kind == "femur"]
    assert found.holding_lost_leg[femurs].max() > 1.2 * found.holding[femurs].max()
    assert any("without one leg" in note and "lm" in note for note in found.notes)
    strong = hp.motor_budget(found, record(stall_torque=3.0)).robot
    required = hp.motor_budget(found, record(stall_torque=3.0), lost_leg=True).robot
    use = found.holding_lost_leg.max() / (0.8 * 0.9 * 3.0)
    assert strong.lost_leg_use == required.lost_leg_use == pytest.approx(use)
    assert ("lost_leg_use" in required.failures) == (use > 1.0)
    assert "lost_leg_use" not in strong.failures
    assert strong.standing_use == pytest.approx(found.standing.max() / 0.6)  # a fifth, for ever
    assert strong.holding_use == pytest.approx(found.holding.max() / (0.8 * 0.9 * 3.0))
    weak = hp.motor_budget(found, record(stall_torque=0.1)).robot
    assert {"standing_use", "holding_use"} <= set(weak.failures)


def test_without_the_robot_or_its_contacts_it_is_unknown() -> None:
    found = hp.sizing.joint_demand(with_run(walk(), urdf=None))
    assert np.isnan(found.holding).all() and any("unknown" in note for note in found.notes)
    row = hp.motor_budget(found, record()).joints[0]
    assert row.standing_use is row.holding_use is row.lost_leg_use is row.inertia_ratio is None
    names = ("foot_position", "foot_force", "foot_impulse", "foot_gap", "foot_normal")
    found = hp.sizing.joint_demand(replace(walk(), **dict.fromkeys(names)))
    assert np.isnan(found.holding_lost_leg).all() and np.isfinite(found.load_inertia).all()
