"""The built-in scenes: a walk, standing, and the hard case HC40 in three stiffnesses."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.task import Task
from hexapod_pin.benchmark.tripod import tripod_setpoints
from hexapod_pin.control.hold_posture import HoldPosture
from hexapod_pin.control.sampled_trajectory import SampledTrajectory
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.reference_data import references
from hexapod_pin.validation.cases.robots import robot_file

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State

CLEARANCE = 0.010
"""Height from which `walk` and `stand` are dropped [m]."""

HOLD = 0.010
"""How long a set-point of `walk` is held [s]."""


VARIANTS = {
    "soft": {"K": 1e5, "kt": 1e2},
    "mid": {"K": 1e6, "kt": 1e3},
    "stiff": {"K": 1e8, "kt": 1e4},
}
"""HC40's contact stiffness [N/m^1.5] and slope of the friction law [s/m]."""


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
    time = np.asarray(np.arange(round(duration / HOLD)) * HOLD, dtype=np.float64)
    controller = SampledTrajectory(time, tripod_setpoints(scene.robot, time))
    about = "drop by 10 mm, then a tripod gait of 1 Hz, set-points held 10 ms"
    return Task("walk", scene, controller, state, duration, HOLD, about=about)


def stand(duration: float = 1.0) -> Task:
    """The same robot dropped by 10 mm, its set-points constant."""
    scene, state = _dropped()
    controller = HoldPosture(scene.robot.posture)
    about = "drop by 10 mm, set-points constant"
    return Task("stand", scene, controller, state, duration, HOLD, about=about)


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
    q[2] += CLEARANCE
    return scene, robot.check_state(q, standing.v)


def hc40(variant: str) -> Task:
    """The hard case HC40: a tilted hexapod set down moving, 0.25 s, compared at its end.

    Args:
        variant: "soft", "mid" or "stiff".
    """
    case: dict[str, Any] = references()["HC40_hexapod_drop_soft"]
    numbers = {**case["params"], **VARIANTS[variant]}
    robot = load_robot(robot_file("hexa_ref"))
    contact = Contact(
        normal=HuntCrossley(stiffness=numbers["K"], dissipation=numbers["a"]),
        friction=TanhCoulomb(mu=numbers["mu"], slope=numbers["kt"]),
    )
    servo = Servo(kp=numbers["kp"], kd=numbers["kd"], limited=False)
    scene, state = Scene(robot, contact=contact, servo=servo), _tilted(robot, numbers)
    duration = float(numbers["T"])
    about = f"tilted hexapod set down at 0.2 m/s, K {numbers['K']:g}, kt {numbers['kt']:g}"
    answer = _answer(robot, case["ref"]) if variant == "soft" else None
    controller = HoldPosture(state.q[7:])
    return Task(f"hc40-{variant}", scene, controller, state, duration, duration, answer, about)


def _tilted(robot: Robot, numbers: dict[str, Any]) -> State:
    """Return HC40's first state: tilted, moving, some feet already in the ground."""
    import pinocchio as pin

    femur = -0.3
    rotation = pin.rpy.rpyToMatrix(numbers["roll"], numbers["pitch"], 0.0)
    height = 0.09879 + 0.11934 * np.sin(femur) + numbers["clear"]
    posture = np.tile([0.0, femur, -femur], 6)
    q = np.concatenate([[0.0, 0.0, height], pin.Quaternion(rotation).coeffs(), posture])
    v = np.zeros(robot.model.nv)
    v[:3] = rotation.T @ np.array(numbers["vel"])
    return robot.check_state(q, v)


def _answer(robot: Robot, known: dict[str, Any]) -> Array:
    """Return the known end state of HC40 soft in our joint order. Shape (7 + n,)."""
    angles = dict(zip(known["joint_order"], known["q_joints_pin_order"], strict=True))
    joints = [angles[joint] for joint in robot.joint_names]
    return np.array([*known["base_xyz"], *known["quat_xyzw"], *joints])


BUILT_IN: dict[str, Callable[[], Task]] = {
    "walk": walk,
    "stand": stand,
    "hc40-soft": lambda: hc40("soft"),
    "hc40-mid": lambda: hc40("mid"),
    "hc40-stiff": lambda: hc40("stiff"),
}
