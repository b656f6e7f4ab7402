"""Spherical feet in the plan: contact points that stand still, also under a moving trunk."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from hexapod_pin.arrays import Array
from hexapod_pin.control import BodyMotion, KinematicControl, Sine, VelocityCommand, Waypoints
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import LEG_ORDER, Gait
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.robot.robot import load_robot

TETRAPOD = Gait.tetrapod(stroke=0.06, cycle_time=1.6, heading=0.65)
TURNING = Gait.tripod(stroke=0.05, cycle_time=1.6, turn_rate=0.1, heading=-1.2)
SWAYING = BodyMotion(
    height=Sine(amplitude=0.01, period=1.1),
    pitch=Sine(amplitude=0.05, period=2.0),
    roll=Waypoints(time=(1.0, 2.0, 4.0), value=(0.0, 0.05, -0.03)),
    lateral=0.01,
)
COMMAND = VelocityCommand(
    time=(0.0, 3.0, 6.0), forward=(0.05, 0.03, 0.0), lateral=(0.0, 0.02, 0.0), turn_rate=(0, 0.1, 0)
)
CONTROLS = {
    "straight": KinematicControl(TETRAPOD),
    "turning": KinematicControl(TURNING),
    "stopping": KinematicControl(TETRAPOD, stop_at=6.4),
    "swaying": KinematicControl(TURNING, body=SWAYING),
    "commanded": KinematicControl(TETRAPOD, velocity=COMMAND),
}


def trunk_motion(control: KinematicControl, path: FootPath, time: float) -> tuple[Array, ...]:
    pose, twist = (row[0] for row in path.body.pose_and_twist(np.array([time])))
    level = pin.rpy.rpyToMatrix(0.0, 0.0, pose[2])
    offset = (control.body or BodyMotion()).offset(np.array(time))
    sway, turn = level @ offset.position, np.array([0.0, 0.0, twist[2]])
    rotation = level @ offset.rotation
    velocity = level @ [twist[0], twist[1], 0.0] + level @ offset.velocity + np.cross(turn, sway)
    position = np.array([pose[0], pose[1], 0.0]) + sway
    return rotation, position, velocity, rotation @ offset.angular_velocity + turn


@pytest.mark.parametrize(
    ("name", "foot"),
    [
        *((name, ("kharagpur", 0.03)) for name in CONTROLS),
        ("swaying", ("athena", 0.02)),
    ],
)
def test_contact_points_stand_still(name: str, foot: tuple[str, float]) -> None:
    """By Pinocchio's kinematics: v + omega x (-r z) = 0 at every foot that is down."""
    robot, control = load_robot(foot[0], foot_radius=foot[1]), CONTROLS[name]
    path, plan = control.path(robot), control.plan(robot, 8.0)
    model, data = robot.model, robot.model.createData()
    neutral, down = leg_group(robot).neutral_feet, path.stance(plan.time)
    slip, rise, rolled = 0.0, 0.0, 0.0
    for k in range(0, len(plan.time), 15):
        rotation, position, velocity, omega = trunk_motion(control, path, plan.time[k])
        q = np.concatenate([position, pin.Quaternion(rotation).coeffs(), plan.q[k]])
        v = np.concatenate([rotation.T @ velocity, rotation.T @ omega, plan.v[k]])
        pin.forwardKinematics(model, data, q, v)
        for leg in np.flatnonzero(down[k]):
            foot = robot.foot(robot.leg(LEG_ORDER[leg]).foot)
            joint = model.getJointId(foot.joint)
            own, axes = pin.getVelocity(model, data, joint, pin.LOCAL), data.oMi[joint].rotation
            centre = axes @ (own.linear + np.cross(own.angular, foot.offset))
            contact = centre + np.cross(axes @ own.angular, [0.0, 0.0, -foot.radius])
            slip, rolled = max(slip, np.abs(contact).max()), max(rolled, np.abs(centre).max())
            height = data.oMi[joint].act(foot.offset)[2] - neutral[leg, 2]
            rise = max(rise, abs(height))
    # Polynomials of degree 10: waypoints, where a derivative jumps, and ends of ramps cost most.
    assert slip < 1e-6
    assert rise < 1e-12
    assert rolled > 1e-3  # the centres of spheres do move


@pytest.mark.parametrize("name", CONTROLS)
def test_paths_are_twice_continuously_differentiable(name: str) -> None:
    path = CONTROLS[name].path(load_robot("kharagpur", foot_radius=0.03)).solved_until(9.0)
    h = 1e-6
    time = np.linspace(h, 8.0, 1501)
    slope = (path.positions(time + h) - path.positions(time - h)) / (2 * h)
    np.testing.assert_allclose(path.velocities(time), slope, atol=5e-9)  # rounding 1e-16 / h
    at, h = path.events(8.0), 1e-5
    before = (path.velocities(at - h) - path.velocities(at - 2 * h)) / h
    after = (path.velocities(at + 2 * h) - path.velocities(at + h)) / h
    np.testing.assert_allclose(after, before, atol=0.03)  # 3 h times 1000 m/s^3
