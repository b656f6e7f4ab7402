"""Scenes with names, made one by one: walks, a point that sticks and slides, floating robots."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.control.feasible_gait import named_gait
from hexapod_pin.control.feedback import FeedbackController
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.sampled_trajectory import HoldPosture, SampledTrajectory
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.ground.contact import Contact, StickSlip
from hexapod_pin.ground.terrain import Flat, Slope
from hexapod_pin.scene.scene import Scene, standing_on
from hexapod_pin.validation.cases.bodies import particle, state
from random_scenes.bodies import SAMPLE, passive_scene
from random_scenes.robots import can_walk, robot_named
from random_scenes.scene import PromiseScene, SceneLabels

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

FALLING = StickSlip(mu=0.5, mu_dynamic=0.3, stiffness=2e4, damping=60.0)
"""Sticks up to 0.5 and slides at 0.3; spring and damper of the default contact."""

CYCLE_TIMES = (2.4, 3.0, 3.6)
"""[s]"""


def labels(kind: str, robot: str, contact: str = "default", ground: str = "flat") -> SceneLabels:
    """Return labels of default drives, one name for both laws of a contact."""
    return SceneLabels(kind, robot, contact, contact, ground, "default")


def walk(
    name: str, gait: str, duration: float, *, preset: str = "accurate", **fields: float
) -> PromiseScene:
    """Return a walk of "kharagpur" or "athena" with a preset's contact.

    Args:
        name: of the robot.
        gait: its name.
        duration: [s].
        preset: of the contact.
        fields: of the gait; the package's defaults where nothing is given, but the first of
            `CYCLE_TIMES` at which the joints are quick enough.
    """
    robot = robot_named(name)
    gaits = (named_gait(robot, gait, **{"cycle_time": one, **fields}) for one in CYCLE_TIMES)
    controls = [KinematicControl(gait) for gait in gaits]
    control = next((one for one in controls if can_walk(robot, one)), controls[-1])
    scene = Scene(robot, contact=Contact.preset(preset))
    about = labels(f"{gait} {duration:g} s", name, preset)
    return PromiseScene(about, scene, control, None, duration, SAMPLE)


def point_on_a_slope(touching: bool = False) -> PromiseScene:
    """Return a point mass of 1 kg at rest on 0.6 rad, mu 0.5/0.3: it sticks, lets go, slides.

    Args:
        touching: whether it starts just touching; else pressed in as deep as it rests, and then
            the answer is known.
    """
    contact = Contact(normal=Contact.accurate().normal, friction=FALLING)
    angle, robot = 0.6, particle()
    law = contact.normal
    depth = 0.0 if touching else (9.81 * math.cos(angle) / law.stiffness) ** (1.0 / law.exponent)
    start = state(robot, (depth * math.sin(angle), 0.0, -depth * math.cos(angle)))
    scene = passive_scene(robot, contact, Slope(angle=angle))
    about = SceneLabels("sticks, then slides", "point", "default", "stick-slip", "slope", "none")
    one = PromiseScene(about, scene, HoldPosture(), start, 0.5, SAMPLE)
    return one if touching else replace(one, answer=_slid(start.q, angle, one.duration))


def _slid(start: Array, angle: float, duration: float) -> Array:
    """Return the positions (T, 7) of the pressed-in point of 1 kg, by hand.

    Its normal force stays g cos: the spring and damper of the friction are those of an oscillator
    under g sin, until their force reaches mu N; from then on mu_dynamic N slows it down.
    """
    from scipy.optimize import brentq

    pull, load = 9.81 * math.sin(angle), 9.81 * math.cos(angle)
    k, c = FALLING.stiffness, FALLING.damping
    decay = 0.5 * c
    rate = math.sqrt(k - decay**2)

    def stuck(t: float) -> tuple[float, float]:
        fade, rest = math.exp(-decay * t), pull / k
        turn = math.cos(rate * t) + decay / rate * math.sin(rate * t)
        return rest * (1.0 - fade * turn), pull / rate * fade * math.sin(rate * t)

    def over(t: float) -> float:
        way, speed = stuck(t)
        return k * way + c * speed - FALLING.mu * load

    slips = brentq(over, 0.0, math.pi / rate, xtol=1e-16, rtol=1e-15)
    way, speed = stuck(slips)
    times = SAMPLE * np.arange(round(duration / SAMPLE) + 1)
    gone = times - slips
    slid = way + speed * gone + 0.5 * (pull - FALLING.mu_dynamic * load) * gone**2
    ways = np.where(gone > 0.0, slid, [stuck(t)[0] for t in times])
    q: Array = np.tile(start, (len(times), 1))
    q[:, :3] += ways[:, None] * np.array([-math.cos(angle), 0.0, -math.sin(angle)])
    return q


def floating(
    name: str, control: SampledTrajectory, duration: float, stops: JointStops | None = None,
    kind: str = "floating",
) -> PromiseScene:  # fmt: skip
    """Return a robot without weight and ground that starts at rest in its posture."""
    robot = robot_named(name)
    scene = Scene(robot, terrain=Flat(height=-100.0), gravity=(0.0, 0.0, 0.0), stops=stops)
    q = standing_on(scene, robot.posture).q.copy()
    q[2] = 0.0
    start = robot.check_state(q, np.zeros(robot.model.nv))
    return PromiseScene(labels(kind, name, "none", "none"), scene, control, start, duration, 0.02)


def sent(one: PromiseScene, period: float) -> PromiseScene:
    """Return a walk whose set-points are sent at a period [s] and held: they jump."""
    from scipy.interpolate import CubicHermiteSpline

    assert not isinstance(one.controller, FeedbackController)
    plan = one.controller.plan(one.scene.robot, one.duration)
    times = period * np.arange(round(one.duration / period))
    q = CubicHermiteSpline(plan.time, plan.q, plan.v)(times)
    knots = SampledTrajectory(times, q, limited=False)
    return replace(one, controller=knots)
