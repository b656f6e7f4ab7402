"""Loads in a run: pushes against momentum, a lost leg, a trunk on the ground."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hexapod_pin as hp
from hexapod_pin.robot import trunk_points

METHODS = {
    "extrapolated-euler": {"accuracy": 1e-6}, "ndf": {"accuracy": 1e-8},
    "dop853": {"accuracy": 1e-8}, "robust": {"step": 5e-4}, "implicit-euler": {"step": 5e-4},
    "rk4": {"step": 2e-5},
}  # fmt: skip


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def momentum(robot: hp.Robot, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return linear momentum, and angular momentum about the centre of mass, world axes."""
    data = robot.model.createData()
    return np.array(pin.computeCentroidalMomentum(robot.model, data, q, v).vector)


def lifted(robot: hp.Robot, height: float) -> hp.State:
    state = robot.stand()
    q = state.q.copy()
    q[2] += height
    return robot.check_state(q, state.v)


def test_a_push_in_free_flight_changes_the_momentum_by_its_impulse(robot):
    """Gravity off, joints limp to 1e-12: what is left is the push."""
    force, torque = np.array([1.0, -2.0, 0.5]), np.array([0.01, 0.02, -0.03])
    push = hp.Push("lf_tibia", force=force, torque=torque, start=0.013, duration=0.05)
    scene = hp.Scene(robot, gravity=(0.0, 0.0, 0.0), loads=[push])
    trace = hp.simulate(
        scene, hp.HoldPosture(), duration=0.1, initial=lifted(robot, 1.0), method="dop853",
        accuracy=1e-12, sample=1e-3,
    )  # fmt: skip
    change = momentum(robot, trace.q[-1], trace.v[-1])
    assert change[:3] == pytest.approx(0.05 * force, abs=1e-12)
    # angular momentum about the origin: the moment of the force about it, by Simpson's rule
    data = robot.model.createData()
    frame = robot.model.getFrameId("lf_tibia")
    moments = []
    for k in range(13, 64):
        pin.framesForwardKinematics(robot.model, data, trace.q[k])
        moments.append(np.cross(data.oMf[frame].translation, force) + torque)
    weights = np.array([1.0] + [4.0, 2.0] * 24 + [4.0, 1.0]) * 1e-3 / 3.0
    about_origin = change[3:] + np.cross(trace.com[-1], change[:3])
    assert about_origin == pytest.approx(weights @ np.array(moments), abs=1e-9)
    assert np.abs(trace.energy_residual).max() < 1e-10
    assert trace.energy["push_work"][-1] > 1e-4


@pytest.mark.parametrize("method", METHODS)
def test_a_push_on_a_standing_robot_closes_the_accounts(robot, method):
    """Momentum: feet, weight and push together; energy: the push's work is in the account."""
    start, duration = (0.05, 0.1) if method in ("rk4", "dop853") else (0.5031, 0.8)
    push = hp.Push("base_link", (0.05, 0, 0), force=(0, 6.0, 0), start=start, duration=0.03)
    trace = hp.simulate(
        hp.Scene(robot, loads=[push]), hp.HoldPosture(), duration=duration, method=method,
        sample=1e-3, **METHODS[method],
    )  # fmt: skip
    feet = trace.foot_impulse.sum(axis=(0, 1))
    total = feet + np.array([0.0, 0.03 * 6.0, -robot.total_mass * 9.81 * duration])
    change = momentum(robot, trace.q[-1], trace.v[-1])[:3]
    error = 5e-3 if method in ("implicit-euler", "robust") else 2e-5  # N s; order 1: the step's own
    assert total == pytest.approx(change, abs=error)
    worked = np.abs(trace.energy["push_work"]).max()
    assert worked > 1e-5
    allowed = 0.3 if method in ("implicit-euler", "robust") else 1e-3
    assert np.abs(trace.energy_residual).max() < allowed * max(worked, 1e-3)


def test_the_push_is_felt_where_it_begins_and_ends(robot):
    """The centre of mass accelerates by F/m between two times that are no samples."""
    push = hp.Push("base_link", force=(3.0, 0.0, 0.0), start=0.0123, duration=0.0345)
    scene = hp.Scene(robot, gravity=(0.0, 0.0, 0.0), loads=[push])
    for method, settings in METHODS.items():
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.1, initial=lifted(robot, 1.0), method=method,
            sample=2e-3, **settings,
        )  # fmt: skip
        acceleration = 3.0 / robot.total_mass
        pushed = np.clip(trace.time - 0.0123, 0.0, 0.0345)
        after = np.clip(trace.time - 0.0123 - 0.0345, 0.0, None)
        travel = acceleration * (0.5 * pushed**2 + 0.0345 * after)
        tolerance = 2e-5 if "step" in settings else 1e-7  # m; order 1: h v / 2
        assert trace.com[:, 0] - trace.com[0, 0] == pytest.approx(travel, abs=tolerance), method


def test_a_lost_leg_gives_no_torque(robot):
    lost = [robot.joint_index(joint) for joint in robot.leg("lm").joints]
    scene = hp.Scene(robot, loads=[hp.LostLeg("lm", start=0.4)])
    for method in ("extrapolated-euler", "ndf", "robust", "implicit-euler"):
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.5, method=method, sample=1e-3, **METHODS[method]
        )
        before, after = trace.time < 0.399, trace.time > 0.401
        assert np.abs(trace.torque[before][-1, lost]).max() > 1e-2, method
        assert not trace.torque[after][:, lost].any(), method
        assert np.abs(trace.torque[-1]).max() > 1e-2, method


def on_its_trunk(robot: hp.Robot) -> hp.State:
    """Return the robot with all feet high, its trunk 2 mm above the ground."""
    q = robot.stand().q.copy()
    for leg in robot.legs:
        q[7 + robot.joint_index(leg.joints[1])] = robot.lower[robot.joint_index(leg.joints[1])]
    trunk = trunk_points(robot)
    q[2] = 0.002 - np.min(np.asarray(trunk.points)[:, 2] - np.asarray(trunk.radius))
    return robot.check_state(q, np.zeros(robot.model.nv))


def test_a_trunk_on_the_ground_stands_with_body_contact_and_is_reported_without(robot, tmp_path):
    start = on_its_trunk(robot)
    hold = hp.HoldPosture(start.q[7:])
    scene = hp.Scene(robot, body_contact=True)
    trace = hp.simulate(scene, hold, duration=1.0, initial=start, accuracy=1e-5)
    feet = len(robot.feet)
    weight = robot.total_mass * 9.81
    assert trace.foot_force[-1, feet:].sum(axis=0)[2] == pytest.approx(weight, rel=1e-3)
    assert np.abs(trace.v[-1]).max() < 1e-3
    lowest = trace.q[0, 2] - 0.002
    assert trace.q[-1, 2] == pytest.approx(lowest, abs=1e-3)
    without = hp.simulate(
        hp.Scene(robot), hold, duration=0.05, initial=start, accuracy=1e-5, sample=5e-3
    )
    event = without.events[0]
    assert event.kind == "trunk-contact"
    fall = np.sqrt(2.0 * 0.002 / 9.81)
    assert event.time == pytest.approx(fall, abs=2e-6)  # by a cubic between two accepted states
    assert -0.01 < event.place[2] <= 0.0
    assert without.q[-1, 2] < lowest - 1e-3
    hp.view.write_html(trace, tmp_path / "trunk.html")  # it can be drawn
