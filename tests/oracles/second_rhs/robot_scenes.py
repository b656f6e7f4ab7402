"""Scenes of whole robots: a drop on six feet, a walk, a lost leg on a belly, a push."""

from __future__ import annotations

import numpy as np

from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.ground.contact import Contact
from hexapod_pin.robot.link_shapes import trunk_points
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.state import State
from hexapod_pin.scene.loads import LostLeg, Push
from hexapod_pin.scene.scene import Scene, standing_on
from oracles.second_rhs.law_scene import LawScene


def drop(name: str, contact: Contact, *, duration: float = 0.02) -> LawScene:
    """Return kharagpur thrown down 0.2 mm above the ground, turning and slipping."""
    robot = load_robot("kharagpur")
    scene = Scene(robot, contact=contact)
    start = standing_on(scene, robot.posture)
    begin = _moved(robot, start, up=2e-4, velocity=(0.1, 0.05, -0.15), spin=(0.2, -0.1, 0.1))
    return LawScene(f"robot: {name}", scene, HoldPosture(), begin, duration, duration / 8.0)


def robot_scenes() -> dict[str, LawScene]:
    """Return the scenes of whole robots, by name."""
    scenes = [
        drop("drop, s1", Contact.s1()), drop("drop, s2", Contact.s2()),
        drop("drop, default contact", Contact.accurate()), _walk(), _on_its_belly(),
    ]  # fmt: skip
    return {scene.name.removeprefix("robot: "): scene for scene in scenes}


def _walk() -> LawScene:
    """Return the first steps of a tripod of athena, pushed sideways."""
    robot = load_robot("athena")
    push = Push("base_link", force=(0.0, 15.0, 0.0), start=0.006, duration=0.008)
    scene = Scene(robot, contact=Contact.accurate(), loads=[push])
    control = KinematicControl(Gait.tripod(stroke=0.03, cycle_time=0.6))
    begin = standing_on(scene, control.plan(robot, 0.02).q[0])
    return LawScene("robot: walk, pushed", scene, control, begin, 0.02, 0.0025)


def _on_its_belly() -> LawScene:
    """Return kharagpur folded up, whose trunk meets the ground while a leg is lost."""
    robot = load_robot("kharagpur")
    scene = Scene(
        robot, contact=Contact.accurate(), body_contact=True, loads=[LostLeg("lm", start=0.01)],
    )  # fmt: skip
    angles = np.tile([0.0, -0.9, 0.6], len(robot.legs))
    trunk = trunk_points(robot)
    height = -min(float(z - r) for (_, _, z), r in zip(trunk.points, trunk.radius, strict=True))
    begin = State(np.array([0.0, 0.0, height + 2e-4, 0.0, 0.0, 0.0, 1.0, *angles]),
                  np.array([0.1, 0.0, -0.1, 0.1, 0.2, 0.0, *np.zeros(len(angles))]))  # fmt: skip
    return LawScene("robot: belly, lost leg", scene, HoldPosture(angles), begin, 0.02, 0.0025)


def _moved(
    robot: Robot, start: State, *, up: float, velocity: tuple[float, ...], spin: tuple[float, ...]
) -> State:
    """Return a state higher by `up` [m], with a base twist [m/s, rad/s]."""
    q, v = start.q.copy(), start.v.copy()
    q[2] += up
    v[:3], v[3:6] = velocity, spin
    return robot.check_state(q, v)
