"""Scenes that switch: friction lets go, edges and corners are crossed, stops and limits met."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import Contact, TanhCoulomb
from hexapod_pin.ground.terrain import (
    AnyTerrain,
    Flat,
    Groove,
    Patch,
    PatchedGround,
    ShakingGround,
    Stairs,
)
from hexapod_pin.validation.cases.bodies import ball, particle, state
from random_scenes.bodies import SAMPLE, passive_scene
from random_scenes.draws import Draws
from random_scenes.drives import beyond_the_range, jumping, leg_torque
from random_scenes.named import floating, point_on_a_slope
from random_scenes.robots import robot_named
from random_scenes.scene import PromiseScene, SceneLabels

SEED = 8
RADIUS = 0.05
"""Of the ball [m]."""

SMOOTH = Contact(normal=Contact.accurate().normal, friction=TanhCoulomb(mu=0.7, slope=200.0))
"""Friction without a memory, so that only the ground switches."""


def _sliding(
    terrain: AnyTerrain, contact: Contact, *, start: float, speed: float, rolls: bool = False
) -> PromiseScene:
    """Return a point (or a rolling ball) at rest depth on z = 0 that moves along x from x [m]."""
    law, radius = contact.normal, RADIUS if rolls else 0.0
    robot = ball(radius, inertia=0.4 * radius**2) if rolls else particle()
    depth = (9.81 / law.stiffness) ** (1.0 / law.exponent)
    height = float(terrain.height_at(start, 0.0)) + radius - depth
    spin = (0.0, speed / radius, 0.0) if rolls else (0.0, 0.0, 0.0)
    first = state(robot, (start, 0.0, height), (speed, 0.0, 0.0), spin=spin)
    labels = SceneLabels("switching", "ball" if rolls else "point", "-", "-", terrain.kind, "none")
    scene = passive_scene(robot, contact, terrain)
    return PromiseScene(labels, scene, HoldPosture(), first, 0.3, SAMPLE)


def _patch(*, friction: float = 1.0, stiffness: float = 1.0) -> PatchedGround:
    patch = Patch(low=(0.0, -1.0), high=(1.0, 1.0), friction=friction, stiffness=stiffness)
    return PatchedGround(ground=Flat(), patches=(patch,))


def _corner() -> PromiseScene:
    groove = Groove(angle_left=0.3, angle_right=0.4, depth=0.03)
    return _sliding(groove, SMOOTH, start=-0.06, speed=0.3, rolls=True)


def _stairs_edge() -> PromiseScene:
    down = Stairs(rise=0.02, run=0.5, count=1, start=0.0, heading=math.pi)
    return _sliding(down, SMOOTH, start=-0.03, speed=0.3, rolls=True)


def _hard_stop() -> PromiseScene:
    robot = robot_named("athena")
    stops = JointStops.for_robot(robot)
    stiff = stops.model_copy(update={"stiffness": 100.0 * stops.stiffness, "assumed": False})
    control = beyond_the_range(Draws(SEED), robot, 2, over=0.3)
    return floating("athena", control, 0.5, stiff)


def _saturating() -> PromiseScene:
    return floating("athena", jumping(Draws(SEED), robot_named("athena"), 0.4, 0.3), 0.3)


def _dry_friction() -> PromiseScene:
    robot = robot_named("kharagpur")
    strength = 4.0 * leg_torque(robot)
    motor = Motor(stall_torque=strength, no_load_speed=8.0, dry_friction=0.1 * strength)
    one = floating("kharagpur", jumping(Draws(SEED), robot, 0.1, 0.3), 0.3)
    servo = Servo(kp=20.0 * strength, kd=0.4 * strength, motor=motor)
    return replace(one, scene=replace(one.scene, servo=servo))


def _shaken_touch_down() -> PromiseScene:
    robot = ball(RADIUS, inertia=0.4 * RADIUS**2)
    first = state(robot, (0.0, 0.0, RADIUS + 0.005), (0.1, 0.0, 0.0))
    ground = ShakingGround(amplitude=2e-3, frequency=15.0)
    labels = SceneLabels("switching", "ball", "-", "-", "shaken", "none")
    scene = passive_scene(robot, SMOOTH, ground)
    return PromiseScene(labels, scene, HoldPosture(), first, 0.3, SAMPLE)


def _dropped_point(contact: Contact) -> PromiseScene:
    robot = particle()
    first = state(robot, (0.0, 0.0, 0.01), (0.3, 0.1, 0.0))
    labels = SceneLabels("switching", "point", "-", "-", "flat", "none")
    scene = passive_scene(robot, contact, Flat())
    return PromiseScene(labels, scene, HoldPosture(), first, 0.3, SAMPLE)


SWITCHING: Mapping[str, Callable[[], PromiseScene]] = {
    "touch-down, friction without memory": lambda: _dropped_point(SMOOTH),
    "touch-down, default contact": lambda: _dropped_point(Contact.accurate()),
    "stick-slip switch, mu_dynamic below mu": point_on_a_slope,
    "stick-slip, slides to rest": lambda: _sliding(
        Flat(), Contact.accurate(), start=0.0, speed=0.5
    ),
    "patch edge, friction": lambda: _sliding(_patch(friction=0.3), SMOOTH, start=-0.05, speed=0.9),
    "patch edge, stiffness": lambda: _sliding(
        _patch(stiffness=0.3), SMOOTH, start=-0.05, speed=0.9
    ),
    "concave corner": _corner,
    "stairs' edge": _stairs_edge,
    "hard stop": _hard_stop,
    "saturating servo, jumping set-points": _saturating,
    "dry joint friction": _dry_friction,
    "shaken ground, touch-down": _shaken_touch_down,
}
"""Makers of the scenes, by name."""
