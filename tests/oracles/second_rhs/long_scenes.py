"""Longer motions of small robots, in which errors add up: flights, bounces, stops, a slide."""

from __future__ import annotations

import numpy as np

from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import HuntCrossley, KelvinVoigt, StickSlip
from hexapod_pin.ground.terrain import Slope
from hexapod_pin.validation.cases.bodies import (
    NO_FRICTION,
    ZERO_GAIN_SERVO,
    on_ground,
    particle,
    state,
)
from oracles.second_rhs.drive_scenes import floating
from oracles.second_rhs.law_scene import GivenSetPoints, LawScene
from oracles.second_rhs.small_robots import monopod, puck

HIGH = 100.0
"""Of what never comes down [m]."""


def long_scenes() -> dict[str, LawScene]:
    """Return the scenes, by name."""
    scenes = (_spin(), _limp_leg(), _bounces(), _stops(), _slide())
    return {scene.name.removeprefix("long: "): scene for scene in scenes}


def _spin() -> LawScene:
    """Return a body that turns about its middle axis, which is unstable, without a force."""
    robot = puck()
    scene = on_ground(robot, KelvinVoigt(stiffness=1e3, damping=0.0), gravity=(0.0, 0.0, 0.0))
    begin = state(robot, (0.0, 0.0, HIGH), (0.1, 0.0, 0.0), spin=(0.1, 8.0, 0.2))
    return LawScene("long: free spin", scene, HoldPosture(), begin, 2.0, 0.25)


def _limp_leg() -> LawScene:
    """Return the leg in flight without servos, its joints within their range."""
    limp = floating(
        "limp leg", ZERO_GAIN_SERVO, rates=np.array([1.0, -0.5, -0.8]), height=HIGH, duration=0.5
    )
    return LawScene("long: limp leg", limp.scene, HoldPosture(), limp.initial, 0.5, 0.0625)


def _bounces() -> LawScene:
    """Return a point that bounces without loss: each flight carries the last one's error."""
    robot = particle(0.5)
    scene = on_ground(robot, HuntCrossley(stiffness=1e6), friction=NO_FRICTION)
    begin = state(robot, (0.0, 0.0, 0.01), (0.1, 0.0, 0.0))
    return LawScene("long: bounces", scene, HoldPosture(), begin, 0.6, 0.075)


def _stops() -> LawScene:
    """Return the leg against its default stops: two set-points beyond the range, no contact."""
    robot, out = monopod(), np.array([[1.5, -1.4, 1.6], [-1.3, 1.5, -1.6]])
    points = GivenSetPoints(np.array([0.0, 0.12]), out, np.zeros_like(out), "held")
    scene = floating(
        "stops", Servo.for_robot(robot), robot=robot, points=points, height=HIGH, duration=0.24,
        stops=JointStops.for_robot(robot),
    )  # fmt: skip
    return LawScene("long: default stops", scene.scene, scene.controller, scene.initial, 0.24, 0.03)


def _slide() -> LawScene:
    """Return a point on a slope of 0.6 rad that sticks at 0.5 and slides at 0.3."""
    robot, angle = particle(0.5), 0.6
    friction = StickSlip(mu=0.5, mu_dynamic=0.3, stiffness=1e4, damping=20.0)
    normal = KelvinVoigt(stiffness=1e4, damping=50.0)
    scene = on_ground(robot, normal, friction=friction, terrain=Slope(angle=angle))
    depth = 0.5 * 9.81 * np.cos(angle) / 1e4
    begin = state(robot, depth * np.array([np.sin(angle), 0.0, -np.cos(angle)]))
    return LawScene("long: slide on a slope", scene, HoldPosture(), begin, 0.2, 0.025)
