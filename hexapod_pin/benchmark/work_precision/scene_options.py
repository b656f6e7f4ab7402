"""The scene that a command names: built in, a scene file, or a robot with a gait."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.benchmark.work_precision.task import Task, standing_task
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.user_file import read_text

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.simulation.scene import Scene

HOLD = "hold"
"""The gait that is none: the robot's posture."""

DEFAULT_GAIT = "tetrapod"
DEFAULT_CYCLE, DEFAULT_SAMPLE, STANDING_DURATION = 2.4, 0.01, 1.0
"""[s]"""


@dataclass(frozen=True)
class SceneOptions:
    """What a command says about the scene; None where it says nothing.

    Attributes:
        gait: tripod, ripple, tetrapod, wave, or hold.
        stroke: [m].
        cycle: cycle time [s].
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
    cycle: float | None = None
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


GAIT_OPTIONS = ("gait", "stroke", "cycle")
SCENE_OPTIONS = ("contact", "mu", "kp", "kd", "feet", "foot_radius")


def find_task(name: str, options: SceneOptions) -> Task:
    """Return the task that a name and options mean.

    Args:
        name: a built-in scene, the path of a scene file (.toml), or a robot: its name, or the path
            of its URDF.
        options: what was said besides.

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
        options.refuse(SCENE_OPTIONS, "The scene file says it.")
        return _with_gait(Path(name).stem, _read(Path(name)), options)
    try:
        return _with_gait(name, _robot_scene(name, options), options)
    except UnknownNameError as error:
        if error.kind != "robot":
            raise
        known = [*BUILT_IN, "a scene file (.toml)", *error.known]
        raise UnknownNameError("benchmark scene or robot", name, known) from error


def _cut(task: Task, options: SceneOptions) -> Task:
    """Return a built-in task with the duration and samples asked for."""
    duration = task.duration if options.duration is None else options.duration
    if not 0.0 < duration <= task.duration:
        raise ParameterError("--duration", duration, f"above 0 and at most {task.duration:g} s")
    if options.sample is not None:
        task = replace(task, sample=options.sample)
    answer = task.answer if duration == task.duration else None
    return replace(task, duration=duration, sample=min(task.sample, duration), answer=answer)


def _read(path: Path) -> Scene:
    from hexapod_pin.simulation.scene import Scene

    return Scene.from_toml(read_text(path, "SCENE"))


def _robot_scene(name: str, options: SceneOptions) -> Scene:
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.robot.robot import load_robot
    from hexapod_pin.simulation.scene import Scene

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
    """Return the controller, how long it is run unless said [s], and what it is."""
    from hexapod_pin.control.feasible_gait import feasible_gait
    from hexapod_pin.control.hold_posture import HoldPosture
    from hexapod_pin.control.kinematic import KinematicControl

    name = options.gait or DEFAULT_GAIT
    if name == HOLD:
        options.refuse(("stroke", "cycle"), "Without a gait there is none.")
        return HoldPosture(), STANDING_DURATION, "standing, set-points constant"
    cycle = DEFAULT_CYCLE if options.cycle is None else options.cycle
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
