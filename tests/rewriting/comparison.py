"""Walks of a robot and of its rewritten file, compared leg by leg and joint by joint."""

from __future__ import annotations

import math
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feasible_gait import feasible_gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_urdf
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.robot.rotations import rotation
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import simulate
from rewriting.conventions import ConventionSet
from rewriting.rewrite import rewrite, stripped

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State

GAIT = "tripod"
CYCLES = 2
METHOD, STEP = "implicit-euler", 1e-3
"""How every walk is run; the step in seconds."""

PRESSED = 1e-4
"""How deep the feet stand in the ground at the start [m].

On feet that just touch, rounding would decide which of them carry the first step's impact.
"""

ROBOTS = ("kharagpur", "athena")
TORQUE_TOLERANCE = 1e-6
"""Allowed difference of torques, relative to the largest of the walk."""

FOOT_TOLERANCE = 1e-3
"""Allowed distance of feet from the original's [m]."""


@dataclass(frozen=True, eq=False)
class Walk:
    """What is compared of a walk."""

    gait: Gait
    torque: Mapping[str, Array]  # of each leg's joints, signs as of the original's. (T, 3) [N m]
    feet: Mapping[str, Array]  # foot centres where the robot stands, trunk axes, by leg. (3,) [m]

    @property
    def peak(self) -> float:
        """The largest torque [N m]."""
        return max(float(np.abs(torque).max()) for torque in self.torque.values())


@dataclass(frozen=True)
class Difference:
    """How a rewritten robot's walk differs from the original's; nan where it failed."""

    seed: int
    robot: str
    conventions: ConventionSet
    torque: float  # largest difference of a torque, relative to the largest torque
    foot: float  # largest distance between feet [m]
    failure: str  # why it does not walk; empty where it does

    @property
    def passed(self) -> bool:
        """Whether it walks like the original."""
        close = self.torque <= TORQUE_TOLERANCE and self.foot <= FOOT_TOLERANCE
        return not self.failure and close


def reference_walk(robot: str, repair: bool = False) -> Walk:
    """Return the walk of a built-in robot of which its file states nothing but the parts."""
    text = stripped(urdf_path(robot).read_text(encoding="utf-8"))
    loaded = _loaded(text, {}, repair=repair)
    return _walk(loaded, feasible_gait(loaded, GAIT, None)[0], {})


def difference(robot: str, seed: int, reference: Walk, *, repair: bool = False) -> Difference:
    """Rewrite a built-in robot in conventions drawn from a seed, let it walk, and compare."""
    rng = np.random.default_rng(seed)
    conventions = ConventionSet.draw(rng, repair=repair)
    text = urdf_path(robot).read_text(encoding="utf-8")
    rewritten = rewrite(text, conventions, rng)
    signs = {change.name: change.sign for change in rewritten.joints.values()}
    failed = (seed, robot, conventions, np.nan, np.nan)
    try:
        loaded = _loaded(rewritten.text, rewritten.files, repair=repair)
        walk = _walk(loaded, reference.gait, signs)
    except Exception as error:  # whatever ends a walk is a finding
        return Difference(*failed, f"{type(error).__name__}: {error}")
    if set(walk.torque) != set(reference.torque):
        names = f"{', '.join(walk.torque)} instead of {', '.join(reference.torque)}"
        return Difference(*failed, f"legs {names}")
    torque = max(float(np.abs(walk.torque[x] - reference.torque[x]).max()) for x in walk.torque)
    foot = max(float(np.linalg.norm(walk.feet[x] - reference.feet[x])) for x in walk.feet)
    return Difference(seed, robot, conventions, torque / reference.peak, foot, "")


def _loaded(text: str, files: Mapping[str, bytes], *, repair: bool) -> Robot:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(text, encoding="utf-8")
        for name, content in files.items():
            (path.parent / name).parent.mkdir(exist_ok=True)
            (path.parent / name).write_bytes(content)
        robot = load_robot(path, repair=repair)
        leg_bodies(robot)  # reads the files
    return robot


def _walk(robot: Robot, gait: Gait, signs: Mapping[str, float]) -> Walk:
    trace = simulate(
        Scene(robot), KinematicControl(gait), duration=CYCLES * gait.cycle_time,
        method=METHOD, step=STEP, initial=_pressed(robot),
    )  # fmt: skip
    torque = {}
    for leg in robot.legs:
        columns = [robot.joint_index(name) for name in leg.joints]
        sign = np.array([signs.get(name, 1.0) for name in leg.joints])
        torque[leg.name] = sign * np.asarray(trace.torque)[:, columns]
    return Walk(gait, torque, _feet(robot))


def _pressed(robot: Robot) -> State:
    state = robot.stand()
    q = state.q.copy()
    q[2] -= PRESSED
    return robot.check_state(q, state.v)


def _feet(robot: Robot) -> dict[str, Array]:
    q = robot.stand().q.copy()
    q[:3] = 0.0
    return dict(zip((leg.name for leg in robot.legs), foot_centres(robot, q), strict=True))


def foot_centres(robot: Robot, q: Array) -> Array:
    import pinocchio as pin

    data, feet = robot.model.createData(), [robot.foot(leg.foot) for leg in robot.legs]
    pin.forwardKinematics(robot.model, data, q)
    numbers = [robot.model.getJointId(foot.joint) for foot in feet]
    return np.array([data.oMi[k].act(x.offset) for k, x in zip(numbers, feet, strict=True)])


def stripped_file(text: str) -> UrdfFile:
    """Return a URDF without what its text states itself."""
    root = ET.fromstring(text)
    for own in root.findall("hexapod_pin"):
        root.remove(own)
    return parse_urdf(ET.tostring(root), "rewritten.urdf")


def found(text: str, folder: Path = Path("."), **hints: object) -> RobotLayout:
    """Recognise a robot in a folder without what its text states itself."""
    finder = ResourceFinder(folder / "rewritten.urdf")
    return recognise(stripped_file(text), finder, RobotHints(**hints))  # type: ignore[arg-type]


def about_z(degrees: float) -> Array:
    return rotation((0.0, 0.0, math.radians(degrees)))
