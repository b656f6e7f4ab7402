"""Hard drives drawn at random: torque limits and jumping set-points, joint stops, dry friction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.scene.scene import standing_on
from random_scenes.bodies import SAMPLE
from random_scenes.draws import Draws
from random_scenes.robots import WALKERS, draw_gait, draw_scene_parts, robot_named
from random_scenes.scene import PromiseScene, SceneLabels

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene

JUMP_PERIOD, DURATION = 0.02, 0.3
"""[s]"""

LEG_ARM = 0.05
"""Lever by which a leg's share of the weight scales the strength of drawn motors [m]."""


def leg_torque(robot: Robot) -> float:
    """Return a third of the weight at `LEG_ARM` [N m]."""
    return 9.81 * robot.total_mass * LEG_ARM / 3.0


def draw_motor(rng: Draws, robot: Robot, strength: float, dry_share: float) -> Servo:
    """Return servos with motors of `strength` [N m] and dry friction of that share of it."""
    kp = rng.log_between(5.0, 200.0) * strength
    motor = Motor(
        stall_torque=strength, no_load_speed=rng.between(3.0, 12.0),
        peak_torque=strength * rng.between(0.6, 1.2), dry_friction=dry_share * strength,
        rotor_inertia=1e-7, gear_ratio=rng.between(50.0, 200.0),
    )  # fmt: skip
    return Servo(kp=kp, kd=kp * rng.log_between(0.005, 0.05), motor=motor)


def jumping(rng: Draws, robot: Robot, reach: float, duration: float) -> SampledTrajectory:
    """Return set-points within the range that jump by up to `reach` [rad] every 20 ms."""
    times = JUMP_PERIOD * np.arange(round(duration / JUMP_PERIOD))
    q = robot.posture + rng.vector(reach, len(times), len(robot.joint_names))
    q[0] = robot.posture
    return SampledTrajectory(times, np.clip(q, robot.lower, robot.upper), limited=False)


def _floating(rng: Draws, name: str, **parts: Any) -> tuple[Scene, dict[str, str], State]:
    """Return a robot without weight or ground, drifting."""
    scene, _ = draw_scene_parts(rng, name, **parts)
    scene = replace(scene, terrain=Flat(height=-100.0), gravity=(0.0, 0.0, 0.0))
    q, v = standing_on(scene, scene.robot.posture).q.copy(), np.zeros(scene.robot.model.nv)
    q[2], v[:6] = 0.0, rng.vector(0.3, 6)
    labels = {"robot": name, "normal": "none", "friction": "none", "terrain": "none"}
    return scene, labels, scene.robot.check_state(q, v)


def saturated(rng: Draws) -> PromiseScene:
    """Set-points jump every 20 ms into the torque limits, of weak motors or the URDF's."""
    name, weak, floats = rng.pick(WALKERS), rng.chance(0.7), rng.chance(0.3)
    robot = robot_named(name)
    strength = leg_torque(robot) * (rng.between(0.2, 1.0) if floats else rng.between(1.5, 4.0))
    parts: dict[str, Any] = {"servo": draw_motor(rng, robot, strength, 0.0)} if weak else {}
    about = {"kind": "saturated", "drive": "motor" if weak else "default"}
    scene, labels, start = _place(rng, name, floats, parts)
    control = jumping(rng, robot, 0.3 if floats else 0.1, DURATION)
    return PromiseScene(SceneLabels(**about, **labels), scene, control, start, DURATION, SAMPLE)


def _place(
    rng: Draws, name: str, floats: bool, parts: dict[str, Any]
) -> tuple[Scene, dict[str, str], State | None]:
    if floats:
        return _floating(rng, name, **parts)
    scene, labels = draw_scene_parts(rng, name, **parts)
    return scene, labels, None


def stopped(rng: Draws) -> PromiseScene:
    """Two set-points or more lie beyond the range: default stops, stiffer or softer ones."""
    name, floats = rng.pick(WALKERS), rng.chance(0.6)
    robot = robot_named(name)
    stops, stiff = JointStops.for_robot(robot), rng.pick((1.0, 1.0, 10.0, 0.3))
    if stiff != 1.0:
        stops = stops.model_copy(update={"stiffness": stiff * stops.stiffness, "assumed": False})
    parts: dict[str, Any] = {"stops": stops}
    undamped = floats and rng.chance(0.4)
    if undamped:
        kp = float(np.max(Servo.for_robot(robot).gains(robot)[0]))
        parts["servo"] = Servo(kp=kp * rng.log_between(0.01, 0.3), kd=0.0)
    scene, labels, start = _place(rng, name, floats, parts)
    control = beyond_the_range(rng, robot, rng.pick((2, 2, 6)))
    servo = "undamped" if undamped else "default"
    drive = f"{servo}, {'default' if stiff == 1.0 else 'other'} stops"
    about = SceneLabels(kind="stopped", drive=drive, **labels)
    return PromiseScene(about, scene, control, start, DURATION, SAMPLE)


def beyond_the_range(
    rng: Draws, robot: Robot, count: int, *, over: float = 0.05
) -> SampledTrajectory:
    """Return a posture of which `count` set-points lie `over` [rad] beyond an end after 20 ms."""
    after: Array = robot.posture.copy()
    joints = len(after)
    first = rng.integer(0, joints)
    for k in range(count):
        joint = (first + 5 * k) % joints
        high = rng.chance(0.5)
        after[joint] = robot.upper[joint] + over if high else robot.lower[joint] - over
    return SampledTrajectory([0.0, 0.02], np.stack([robot.posture, after]), limited=False)


def dry_friction(rng: Draws) -> PromiseScene:
    """Joints with dry friction: walking, or set-points that jump; robots stand or float."""
    name, floats = rng.pick(WALKERS), rng.chance(0.3)
    robot = robot_named(name)
    strength = leg_torque(robot) * rng.between(4.0, 10.0)
    servo = draw_motor(rng, robot, strength, rng.between(0.02, 0.2))
    scene, labels, start = _place(rng, name, floats, {"servo": servo})
    walks = not floats and rng.chance(0.6)
    control = draw_gait(rng, name) if walks else jumping(rng, robot, 0.1, DURATION)
    about = SceneLabels(kind="dry friction", drive="motor, dry friction", **labels)
    return PromiseScene(about, scene, control, start, DURATION, SAMPLE)
