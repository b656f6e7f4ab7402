"""Free rigid bodies drawn at random: they bounce, tumble on their feet, slide, or spin in space."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.ground.contact import Contact
from hexapod_pin.ground.terrain import Flat, Slope
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.cases.bodies import (
    NO_JOINT_STOPS,
    SIX_FEET,
    ZERO_GAIN_SERVO,
    ball,
    body,
    particle,
    six_feet_body,
)
from random_scenes.contacts import draw_contact
from random_scenes.draws import Draws
from random_scenes.grounds import draw_terrain
from random_scenes.scene import PromiseScene, SceneLabels

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.ground.terrain import AnyTerrain
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State

SAMPLE = 0.01
"""[s]"""

THREE_FEET, ALL_FEET, POINT, BALL, BOX = "three feet", "six feet", "point", "ball", "box"


@lru_cache(maxsize=8)
def _standing_body(name: str) -> Robot:
    feet = ("L1", "R2", "L3") if name == THREE_FEET else tuple(SIX_FEET)
    return six_feet_body((0.01, -0.005, 0.0), 0.1, (0.02, 0.06, 0.07), feet)


def draw_body(rng: Draws, names: tuple[str, ...]) -> tuple[Robot, str]:
    """Return a body and its name, one of these."""
    name = rng.pick(names)
    if name == POINT:
        return particle(rng.log_between(0.2, 3.0)), name
    if name == BALL:
        radius, mass = rng.between(0.02, 0.1), rng.log_between(0.2, 3.0)
        return ball(radius, mass=mass, inertia=0.4 * mass * radius**2), name
    if name == BOX:
        a, b, c = (rng.between(0.03, 0.12) for _ in range(3))
        signs = [(x, y, z) for x in (1, -1) for y in (1, -1) for z in (1, -1)]
        feet = {f"corner{k}": (x * a, y * b, z * c) for k, (x, y, z) in enumerate(signs)}
        inertia = ((b * b + c * c) / 3.0, (a * a + c * c) / 3.0, (a * a + b * b) / 3.0)
        return body(feet, inertia=inertia, radius=0.005), name
    return _standing_body(name), name


def turned(rng: Draws, tilt: float) -> Array:
    """Return a quaternion x y z w (4,): roll and pitch within `tilt` [rad], any heading."""
    import pinocchio as pin

    roll, pitch = rng.vector(tilt, 2)
    rotation = pin.rpy.rpyToMatrix(float(roll), float(pitch), rng.between(-math.pi, math.pi))
    return np.asarray(pin.Quaternion(rotation).coeffs())


def above_ground(
    robot: Robot, terrain: AnyTerrain, gap: float, *, quaternion: Array, joints: Array,
    velocity: Array, spin: Array,
) -> State:  # fmt: skip
    """Return the state whose lowest foot is a vertical `gap` [m] above touching the ground."""
    import pinocchio as pin

    q = np.concatenate([np.zeros(3), quaternion, joints])
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    centers = [data.oMi[robot.model.getJointId(foot.joint)].act(foot.offset) for foot in robot.feet]
    q[2] = terrain.lift(centers, [foot.radius for foot in robot.feet]) + gap
    rates = np.zeros(len(robot.joint_names))
    return robot.check_state(q, np.concatenate([velocity, spin, rates]))


def passive_scene(robot: Robot, contact: Contact, terrain: AnyTerrain) -> Scene:
    """Return a body on its ground."""
    return Scene(
        robot, contact=contact, terrain=terrain, servo=ZERO_GAIN_SERVO, stops=NO_JOINT_STOPS
    )


def _thrown(
    rng: Draws, kind: str, names: tuple[str, ...], duration: float, tilt: float, speed: float,
    rate: float, gap: float,
) -> PromiseScene:  # fmt: skip
    robot, name = draw_body(rng, names)
    contact, normal, friction = draw_contact(rng)
    terrain, ground = draw_terrain(rng)
    start = above_ground(
        robot, terrain, rng.between(0.0, gap), quaternion=turned(rng, tilt), joints=np.zeros(0),
        velocity=rng.vector(speed, 3), spin=rng.vector(rate, 3),
    )  # fmt: skip
    labels = SceneLabels(kind, name, normal, friction, ground, "none")
    scene = passive_scene(robot, contact, terrain)
    return PromiseScene(labels, scene, HoldPosture(), start, duration, SAMPLE)


def thrown(rng: Draws) -> PromiseScene:
    """A body of three feet, six or the eight corners of a box is thrown and tumbles."""
    names = (THREE_FEET, THREE_FEET, ALL_FEET, BOX)
    return _thrown(rng, "thrown", names, rng.pick((0.3, 0.5)), 0.4, 0.4, 2.0, 0.04)


def bouncing(rng: Draws) -> PromiseScene:
    """A point or a ball bounces and rolls."""
    return _thrown(rng, "bouncing", (POINT, BALL), rng.pick((0.5, 1.0)), 0.2, 0.3, 5.0, 0.1)


def sliding(rng: Draws) -> PromiseScene:
    """A body is let go of on a slope, near what its friction holds: sticks, creeps or slides."""
    robot, name = draw_body(rng, (POINT, BALL, THREE_FEET))
    contact, normal, friction = draw_contact(rng)
    angle = min(math.atan(contact.friction.limit * rng.between(0.6, 1.4)), 0.9)
    terrain = Slope(angle=angle, heading=rng.between(-math.pi, math.pi))
    start = above_ground(
        robot, terrain, 0.0, quaternion=np.array([0.0, 0.0, 0.0, 1.0]), joints=np.zeros(0),
        velocity=rng.vector(0.05, 3), spin=np.zeros(3),
    )  # fmt: skip
    labels = SceneLabels("sliding", name, normal, friction, "slope", "none")
    scene = passive_scene(robot, contact, terrain)
    return PromiseScene(labels, scene, HoldPosture(), start, 0.5, SAMPLE)


def spinning(rng: Draws) -> PromiseScene:
    """A body of three different moments of inertia spins without contact for 10 s."""
    moments = sorted(0.01 * rng.between(0.5, 1.0) for _ in range(3))
    robot = body({"foot": (0.0, 0.0, 0.0)}, inertia=(moments[0], moments[1], moments[2]))
    start = above_ground(
        robot, Flat(), 1.0, quaternion=turned(rng, 1.0), joints=np.zeros(0),
        velocity=rng.vector(0.5, 3), spin=rng.vector(5.0, 3),
    )  # fmt: skip
    scene = Scene(
        robot, servo=ZERO_GAIN_SERVO, stops=NO_JOINT_STOPS, terrain=Flat(height=-1e3),
        gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    labels = SceneLabels("spinning 10 s", "body", "none", "none", "none", "none")
    return PromiseScene(labels, scene, HoldPosture(), start, 10.0, 0.1)
