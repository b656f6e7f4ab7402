"""Scenes of drives: a floating or landing leg of three joints whose drives reach every mode."""

from __future__ import annotations

from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import TrajectoryKind
from hexapod_pin.drive.gear_friction import GearFriction
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import Contact
from hexapod_pin.robot.robot import Robot
from hexapod_pin.scene.loads import Payload, Push
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.cases.bodies import NO_JOINT_STOPS, state
from oracles.second_rhs.contact_scenes import PLAIN_FRICTION, PLAIN_NORMAL
from oracles.second_rhs.law_scene import GivenSetPoints, LawScene
from oracles.second_rhs.small_robots import monopod

SOFT = Servo(kp=8.0, kd=0.05)
START = np.array([0.1, -0.3, 0.5])
"""Joint angles at the start [rad]."""

HIGH = 1.0
"""Of the trunk where nothing is touched [m]."""


def set_points(kind: TrajectoryKind = "cubic", *, reach: float = 0.5) -> GivenSetPoints:
    """Return set-points of three joints that go away and come back, with kinks at 20 ms."""
    time = np.array([0.0, 0.02, 0.045, 0.08])
    way = reach * np.array([[0.0, 0.0, 0.0], [0.4, -0.7, 0.5], [-0.3, 0.6, -0.8], [0.5, 0.2, 0.1]])
    rate = 5.0 * np.array([[0.0, 0.0, 0.0], [1.0, -0.5, 0.3], [-0.7, 0.2, 0.4], [0.0, 0.0, 0.0]])
    return GivenSetPoints(time, START + way, np.zeros_like(rate) if kind != "cubic" else rate, kind)


def floating(
    name: str, servo: Servo, *, robot: Robot | None = None, points: GivenSetPoints | None = None,
    rates: Array | None = None, height: float = HIGH, duration: float = 0.06, **parts: Any,
) -> LawScene:  # fmt: skip
    """Return the leg in flight, with gravity; `parts` are fields of `Scene`."""
    robot = monopod() if robot is None else robot
    parts.setdefault("stops", NO_JOINT_STOPS)
    parts.setdefault("contact", Contact(normal=PLAIN_NORMAL, friction=PLAIN_FRICTION))
    scene = Scene(robot, servo=servo, **parts)
    begin = state(
        robot, (0.0, 0.0, height), (0.1, 0.0, -0.1), spin=(0.2, 0.4, -0.3), joints=START,
        rates=np.zeros(3) if rates is None else rates,
    )  # fmt: skip
    points = set_points() if points is None else points
    return LawScene(f"drive: {name}", scene, points, begin, duration, duration / 8.0)


def drive_scenes() -> dict[str, LawScene]:
    """Return a scene of every part of the drives' law."""
    weak, stiff = monopod(effort=0.25), Servo(kp=20.0, kd=0.1)
    motor = Motor(
        stall_torque=0.5, no_load_speed=6.0, voltage_ratio=0.9, peak_torque=0.4,
        viscous_friction=0.003, rotor_inertia=2e-7, gear_ratio=60.0,
    )  # fmt: skip
    dry = motor.model_copy(update={"dry_friction": 0.05})
    gear = Servo(kp=8.0, kd=0.05, motor=Motor(
        stall_torque=0.5, no_load_speed=6.0, rotor_inertia=2e-7, gear_ratio=60.0,
        gear_friction=GearFriction(
            coulomb=0.005, stribeck=0.01, motor=0.1, load=0.15, motor_stribeck=0.05,
            load_stribeck=0.2, motor_quadratic=0.02, load_quadratic=0.05, stribeck_speed=2.0,
            external_load=True,
        ),
    ))  # fmt: skip
    hard = JointStops(stiffness=60.0, dissipation=0.4)
    out = set_points("held", reach=3.0)
    scenes = [
        floating("cubic set-points", Servo(kp=8.0, kd=0.05, limited=False)),
        floating("linear set-points", SOFT, points=set_points("linear")),
        floating("jumping set-points", SOFT, points=set_points("held")),
        floating("torque cap", stiff, robot=weak),
        floating("torque cap, jumping set-points", stiff, robot=weak, points=set_points("held")),
        floating("torque-speed line", Servo(kp=20.0, kd=0.1, motor=motor)),
        floating("dry friction", SOFT, robot=monopod(dry=0.15)),
        floating("dry friction, moving", SOFT, robot=monopod(dry=0.15),
                 rates=np.array([3.0, -2.0, 0.0])),
        floating("line and dry friction", Servo(kp=20.0, kd=0.1, motor=dry)),
        floating("gear friction, moving", gear, rates=np.array([3.0, -2.0, 1.0])),
        floating("landing with gear friction", gear, height=0.047, contact=Contact.accurate(),
                 duration=0.04),
        floating("gear friction and stops", gear, points=out, stops=hard,
                 rates=np.array([12.0, -16.0, 14.0])),
        floating("stops", SOFT, points=out, stops=hard, rates=np.array([12.0, -16.0, 14.0])),
        floating("elastic stops", SOFT, points=out, stops=JointStops(stiffness=200.0),
                 rates=np.array([12.0, -16.0, 14.0])),
        floating("stops left faster than they push", Servo(kp=40.0, kd=0.0),
                 points=set_points("held", reach=6.0), rates=np.array([12.0, -16.0, 14.0]),
                 stops=JointStops(stiffness=60.0, dissipation=3.0)),
        floating("push and payload", SOFT, loads=[
            Push("tibia", (0.05, 0.0, 0.0), force=(1.0, 2.0, -1.0), torque=(0.0, 0.05, 0.02),
                 start=0.013, duration=0.021),
            Payload("femur", 0.1, (0.02, 0.01, 0.03), inertia=(2e-5, 3e-5, 4e-5, 1e-6, 0.0, 0.0)),
        ]),
        floating("landing with dry friction and a cap", stiff, height=0.047,
                 robot=monopod(dry=0.05, effort=0.6), contact=Contact.accurate(), duration=0.04),
    ]  # fmt: skip
    return {scene.name.removeprefix("drive: "): scene for scene in scenes}
