"""Robots drawn at random: dropped, walking, pushed, and in flight."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.gait import GAITS, Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import HexapodError
from hexapod_pin.ground.terrain import Flat
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.loads import Push
from hexapod_pin.scene.scene import Scene, standing_on
from hexapod_pin.validation.cases.drop import drop
from random_scenes.bodies import SAMPLE, above_ground, turned
from random_scenes.contacts import draw_contact
from random_scenes.draws import Draws
from random_scenes.grounds import draw_terrain
from random_scenes.scene import PromiseScene, SceneLabels

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

REFERENCE = "reference"
WALKERS = ("kharagpur", "athena")
LARGEST_STROKE = {"kharagpur": 0.11, "athena": 0.08}
"""Of the walks drawn [m]."""

SHORTEST_CYCLE = {"tripod": 0.7, "ripple": 1.0, "tetrapod": 1.0, "wave": 2.0}
"""Of the walks drawn [s]: a foot swings in the share of it that the duty leaves."""

MOST_TRIES = 6
"""Gaits, each slower and shorter, until a robot can walk one."""


@lru_cache(maxsize=4)
def robot_named(name: str) -> Robot:
    """Return "kharagpur", "athena" or "reference", the hexapod of the drops."""
    return drop("soft").scene.robot if name == REFERENCE else load_robot(name)


def draw_scene_parts(rng: Draws, name: str, **parts: Any) -> tuple[Scene, dict[str, str]]:
    """Return a robot on its ground, default drives unless given, and labels but kind and drive."""
    contact, normal, friction = draw_contact(rng)
    terrain, ground = draw_terrain(rng)
    scene = Scene(robot_named(name), contact=contact, terrain=terrain, **parts)
    labels = {"robot": name, "normal": normal, "friction": friction, "terrain": ground}
    return scene, labels


def dropped(rng: Draws) -> PromiseScene:
    """A hexapod is thrown down somehow from up to 40 mm, holding its posture."""
    name = rng.pick((REFERENCE, *WALKERS))
    soft = name == REFERENCE and rng.chance(0.5)
    parts: dict[str, Any] = {"servo": drop("soft").scene.servos} if soft else {}
    parts["body_contact"] = name != REFERENCE and rng.chance(0.15)
    scene, labels = draw_scene_parts(rng, name, **parts)
    posture = scene.robot.posture
    start = above_ground(
        scene.robot, scene.terrain, rng.between(0.0, 0.04), quaternion=turned(rng, 0.3),
        joints=posture, velocity=rng.vector(0.3, 3), spin=rng.vector(1.0, 3),
    )  # fmt: skip
    drive = "soft, no limit" if soft else "default"
    about = SceneLabels(kind="dropped", drive=drive, **labels)
    return PromiseScene(about, scene, HoldPosture(posture), start, rng.pick((0.3, 0.5)), SAMPLE)


def draw_gait(rng: Draws, name: str) -> KinematicControl:
    """Return a walk of any named gait that the robot of this name can do for a second."""
    gait = rng.pick(tuple(GAITS))
    stroke = LARGEST_STROKE[name] * rng.between(0.2, 1.0)
    cycle = SHORTEST_CYCLE[gait] * rng.between(1.0, 2.0)
    heading, turn = rng.pick((0.0, 0.0, math.pi)), rng.pick((0.0, 0.0, 0.1))  # rad a cycle
    for k in range(MOST_TRIES):
        longer = cycle * 1.3**k
        control = KinematicControl(
            Gait.by_name(
                gait, stroke=stroke * 0.6**k, cycle_time=longer, heading=heading,
                turn_rate=turn * 0.6**k / longer,
            )
        )  # fmt: skip
        if can_walk(robot_named(name), control):
            break
    return control


def can_walk(robot: Robot, control: KinematicControl) -> bool:
    """Tell whether a robot can do the first second of a walk."""
    try:
        control.plan(robot, 1.0)
    except HexapodError:
        return False
    return True


def _walk(rng: Draws, kind: str, duration: float, sample: float) -> PromiseScene:
    name = rng.pick(WALKERS)
    scene, labels = draw_scene_parts(rng, name)
    about = SceneLabels(kind=kind, drive="default", **labels)
    return PromiseScene(about, scene, draw_gait(rng, name), None, duration, sample)


def walking(rng: Draws) -> PromiseScene:
    """A walk of 1 s."""
    return _walk(rng, "walking 1 s", 1.0, SAMPLE)


def walking_long(rng: Draws) -> PromiseScene:
    """A walk of 10 s."""
    return _walk(rng, "walking 10 s", 10.0, 0.05)


def pushed(rng: Draws) -> PromiseScene:
    """A robot that stands or walks is pushed once or twice for 20 to 150 ms."""
    name = rng.pick(WALKERS)
    scene, labels = draw_scene_parts(rng, name)
    weight = 9.81 * scene.robot.total_mass
    loads = [
        Push(
            "base_link", tuple(rng.vector(0.05, 3)), force=tuple(rng.vector(0.7 * weight, 3)),
            start=rng.between(0.0, 0.3), duration=rng.between(0.02, 0.15),
        )
        for _ in range(rng.integer(1, 3))
    ]  # fmt: skip
    walks = rng.chance(0.4)
    control = draw_gait(rng, name) if walks else HoldPosture()
    about = SceneLabels(kind="pushed", drive="default", **labels)
    return PromiseScene(about, replace(scene, loads=loads), control, None, 0.5, SAMPLE)


def limp_flight(rng: Draws) -> PromiseScene:
    """A robot flies 1 s with its drives off, or holding its posture, its joints moving."""
    name = rng.pick((REFERENCE, *WALKERS))
    robot, limp = robot_named(name), rng.chance(0.7)
    servo = Servo(kp=0.0, kd=0.0) if limp else Servo.for_robot(robot)
    scene = Scene(robot, servo=servo, terrain=Flat(height=-100.0))
    q = standing_on(scene, robot.posture).q.copy()
    q[2] += 100.0
    v = np.concatenate([rng.vector(0.5, 3), rng.vector(2.0, 3), rng.vector(1.0, 18)])
    drive = "off" if limp else "default"
    about = SceneLabels("flight 1 s", name, "none", "none", "none", drive)
    return PromiseScene(about, scene, HoldPosture(), robot.check_state(q, v), 1.0, 0.02)
