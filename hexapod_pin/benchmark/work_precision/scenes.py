"""The comparison has built-in scenes, and a command may name others."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.work_precision.task import Task, standing_task
from hexapod_pin.control.sampled_trajectory import HoldPosture, SampledTrajectory
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.user_file import read_text
from hexapod_pin.validation.cases.drop import catalogue_state, drop, drop_numbers
from hexapod_pin.validation.cases.robots import robot_file

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State


# The gait of the speed comparison: a smooth tripod, its set-points held for 10 ms each.

PERIOD = 1.0  # [s]
SWING = 0.25  # amplitude of the coxa, and of the lift in femur and tibia [rad]
RAMP = 0.2  # the gait grows from standing within this time [s]
FIRST_TRIPOD = ("lf", "lr", "rm")


def tripod_setpoints(robot: Robot, time: Array) -> Array:
    """Return the joint angles of the gait at some times, *assumed* for the comparison.

    The coxa swings by r s 0.25 sin(a) (s = 1 left, -1 right), femur and tibia lift by
    -+0.25 r max(0, cos a)^3 from the robot's posture; a = 2 pi t/T, and pi more for the second
    tripod; r = x^2 (3 - 2 x) with x = t/0.2 s up to 1.

    Args:
        robot: six legs of three joints.
        time: (K,) times [s].

    Returns:
        Angles in `joint_names` order [rad]. Shape (K, n).
    """
    q = np.tile(robot.posture, (len(time), 1))
    x = np.clip(time / RAMP, 0.0, 1.0)
    growth = x * x * (3.0 - 2.0 * x)
    for leg in robot.legs:
        coxa, femur, tibia = (robot.joint_index(joint) for joint in leg.joints)
        angle = 2.0 * np.pi * time / PERIOD + (0.0 if leg.name in FIRST_TRIPOD else np.pi)
        side = 1.0 if leg.name.startswith("l") else -1.0
        lift = -SWING * growth * np.maximum(0.0, np.cos(angle)) ** 3
        q[:, coxa] += side * SWING * growth * np.sin(angle)
        q[:, femur] += lift
        q[:, tibia] -= lift
    return q


# The built-in scenes: a walk, standing, and the hard case HC40 in three stiffnesses.

DROP_HEIGHT = 0.010
"""Height from which `walk` and `stand` are dropped [m]."""

SETPOINT_PERIOD = 0.010
"""How long a set-point of `walk` is held [s]."""


def built_in(name: str) -> Task:
    """Return a built-in scene: walk, stand, hc40-soft, hc40-mid or hc40-stiff.

    Raises:
        UnknownNameError: there is no such scene.
    """
    if name not in BUILT_IN:
        raise UnknownNameError("benchmark scene", name, list(BUILT_IN))
    return BUILT_IN[name]()


def walk(duration: float = 1.0) -> Task:
    """A tripod gait from a drop of 10 mm; 100 set-points a second, each held for 10 ms."""
    scene, state = _dropped()
    count = round(duration / SETPOINT_PERIOD)
    time = np.asarray(np.arange(count) * SETPOINT_PERIOD, dtype=np.float64)
    controller = SampledTrajectory(time, tripod_setpoints(scene.robot, time), limited=False)
    about = "drop by 10 mm, then a tripod gait of 1 Hz, set-points held 10 ms"
    return Task("walk", scene, controller, state, duration, SETPOINT_PERIOD, about=about)


def stand(duration: float = 1.0) -> Task:
    """The same robot dropped by 10 mm, its set-points constant."""
    scene, state = _dropped()
    controller = HoldPosture(scene.robot.posture)
    about = "drop by 10 mm, set-points constant"
    return Task("stand", scene, controller, state, duration, SETPOINT_PERIOD, about=about)


def _dropped() -> tuple[Scene, State]:
    """Return the 19-body hexapod in its posture, 10 mm above the ground; contact *assumed*."""
    robot = load_robot(robot_file("bench19"))
    contact = Contact(
        normal=HuntCrossley(stiffness=1e6, exponent=1.5, dissipation=0.2),
        friction=TanhCoulomb(mu=0.7, slope=1e3),
        assumed="K 1e6 N/m^1.5, a 0.2 s/m, mu 0.7, kt 1e3 s/m",
    )
    scene = Scene(robot, contact=contact, servo=Servo(kp=20.0, kd=0.3, limited=False))
    standing = robot.stand()
    q = standing.q.copy()
    q[2] += DROP_HEIGHT
    return scene, robot.check_state(q, standing.v)


def hc40(variant: str) -> Task:
    """The hard case HC40: a tilted hexapod set down moving, 0.25 s, compared at its end.

    Args:
        variant: "soft", "mid" or "stiff".
    """
    run, numbers = drop(variant, stops=True), drop_numbers(variant)
    about = f"tilted hexapod set down at 0.2 m/s, K {numbers['K']:g}, kt {numbers['kt']:g}"
    answer = catalogue_state(run.scene.robot).q if variant == "soft" else None
    name, duration = f"hc40-{variant}", run.duration
    return Task(name, run.scene, run.controller, run.initial, duration, duration, answer, about)


BUILT_IN: dict[str, Callable[[], Task]] = {
    "walk": walk,
    "stand": stand,
    "hc40-soft": lambda: hc40("soft"),
    "hc40-mid": lambda: hc40("mid"),
    "hc40-stiff": lambda: hc40("stiff"),
}


# The scene that a command names: built in, a scene file, or a robot with a gait.

HOLD = "hold"
"""The gait that is none: the robot's posture."""

DEFAULT_GAIT = "tetrapod"
DEFAULT_CYCLE, DEFAULT_SAMPLE, STANDING_DURATION = 2.4, 0.01, 1.0
"""[s]"""


@dataclass(frozen=True)
class SceneOptions:
    """Options of a command for the scene; None where one is not given.

    Attributes:
        gait: tripod, ripple, tetrapod, wave, or hold.
        stroke: [m].
        cycle_time: cycle time [s].
        contact: contact preset.
        mu: friction coefficient.
        kp: servo stiffness [N m/rad].
        kd: servo damping [N m s/rad].
        feet: names of the foot links.
        foot_radius: [m].
        duration: simulated time [s].
        sample: time between compared samples [s].
    """

    gait: str | None = None
    stroke: float | None = None
    cycle_time: float | None = None
    contact: str | None = None
    mu: float | None = None
    kp: float | None = None
    kd: float | None = None
    feet: tuple[str, ...] | None = None
    foot_radius: float | None = None
    duration: float | None = None
    sample: float | None = None

    def refuse(self, names: tuple[str, ...], why: str) -> None:
        """Refuse what has no meaning for a scene.

        Raises:
            ParameterError: one of them is given.
        """
        for name in names:
            value = getattr(self, name)
            if value is not None:
                option = f"--{name.replace('_', '-')}"
                raise ParameterError(option, value, "left out", why)


GAIT_OPTIONS = ("gait", "stroke", "cycle_time")
SCENE_OPTIONS = ("contact", "mu", "kp", "kd", "feet", "foot_radius")


def find_task(name: str, options: SceneOptions) -> Task:
    """Return the task that a name and options mean.

    Args:
        name: a built-in scene, the path of a scene file (.toml), or a robot: its name, or the path
            of its URDF.
        options: given besides.

    Raises:
        UnknownNameError: there is no such scene, robot, gait or contact preset.
        ParameterError: an option that the named scene does not take, or a value out of range.
        UrdfError, GaitError: as when it is walked.
    """
    from hexapod_pin.benchmark.work_precision.scenes import BUILT_IN, built_in

    if name in BUILT_IN:
        options.refuse(
            (*GAIT_OPTIONS, *SCENE_OPTIONS), f"{name} is built in, with its own numbers."
        )
        return _cut(built_in(name), options)
    if name.endswith(".toml"):
        options.refuse(SCENE_OPTIONS, "The scene file gives it.")
        return _with_gait(Path(name).stem, _read(Path(name)), options)
    try:
        return _with_gait(name, _robot_scene(name, options), options)
    except UnknownNameError as error:
        if error.kind != "robot":
            raise
        known = [*BUILT_IN, "a scene file (.toml)", *error.known]
        raise UnknownNameError("benchmark scene or robot", name, known) from error


def _cut(task: Task, options: SceneOptions) -> Task:
    """Return a built-in task with the requested duration and samples."""
    duration = task.duration if options.duration is None else options.duration
    if not 0.0 < duration <= task.duration:
        raise ParameterError("--duration", duration, f"above 0 and at most {task.duration:g} s")
    if options.sample is not None:
        task = replace(task, sample=options.sample)
    answer = task.answer if duration == task.duration else None
    return replace(task, duration=duration, sample=min(task.sample, duration), answer=answer)


def _read(path: Path) -> Scene:
    from hexapod_pin.scene.scene import Scene

    return Scene.from_toml(read_text(path, "SCENE"))


def _robot_scene(name: str, options: SceneOptions) -> Scene:
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.robot.robot import load_robot
    from hexapod_pin.scene.scene import Scene

    robot = load_robot(name, feet=options.feet, foot_radius=options.foot_radius)
    contact = Contact.preset(options.contact or "accurate").with_mu(options.mu)
    return Scene(
        robot, contact=contact, servo=Servo.from_effort(robot, kp=options.kp, kd=options.kd)
    )


def _with_gait(name: str, scene: Scene, options: SceneOptions) -> Task:
    controller, length, about = _controller(scene.robot, options)
    sample = DEFAULT_SAMPLE if options.sample is None else options.sample
    if not (math.isfinite(sample) and sample > 0.0):
        raise ParameterError("--sample", sample, "positive and finite [s]")
    duration = (
        max(1, round(length / sample)) * sample if options.duration is None else options.duration
    )
    return standing_task(name, scene, controller, duration=duration, sample=sample, about=about)


def _controller(robot: Robot, options: SceneOptions) -> tuple[Controller, float, str]:
    """Return the controller, its default duration [s], and what it is."""
    from hexapod_pin.control.feasible_gait import feasible_gait
    from hexapod_pin.control.kinematic import KinematicControl
    from hexapod_pin.control.sampled_trajectory import HoldPosture

    name = options.gait or DEFAULT_GAIT
    if name == HOLD:
        options.refuse(("stroke", "cycle_time"), "Without a gait there is none.")
        return HoldPosture(), STANDING_DURATION, "standing, set-points constant"
    cycle = DEFAULT_CYCLE if options.cycle_time is None else options.cycle_time
    gait, _ = feasible_gait(robot, name, options.stroke, cycle_time=cycle)
    about = f"{gait.name} from standing, stroke {gait.stroke:.4g} m, cycle {gait.cycle_time:g} s"
    return KinematicControl(gait), cycle, about


def as_typed(options: SceneOptions) -> str:
    """Return the options as they would be typed."""
    named = [(field.name, getattr(options, field.name)) for field in fields(options)]
    return "".join(
        f" --{name.replace('_', '-')} {','.join(value) if isinstance(value, tuple) else value}"
        for name, value in named
        if value is not None
    )
