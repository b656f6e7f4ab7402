"""The built-in scenes: a walk, standing, and the hard case HC40 in three stiffnesses."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.benchmark.work_precision.tripod import tripod_setpoints
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.drop import catalogue_state, drop, drop_numbers
from hexapod_pin.validation.cases.robots import robot_file

if TYPE_CHECKING:
    from hexapod_pin.robot.state import State

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
