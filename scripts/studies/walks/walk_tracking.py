"""How far a walk goes where its plan says: speed, heading and turn rate of every gait, and slip."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control import FootPath, JointTrajectory
from hexapod_pin.control.gait import GAITS
from hexapod_pin.errors import GaitError
from hexapod_pin.robot.robot import scratch_data
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

ROBOTS = ("kharagpur", "athena")
RADII = (0.0, None, 0.03)
"""Radii of the foot spheres [m]; None: those of the URDF."""

HEADINGS = (0.0, 37.0, 90.0, -120.0)  # degrees
STROKE = 0.06
"""What every gait can do in any direction, turning [m]."""

TURN_PER_CYCLE = 0.24
"""Of the walks that turn; more than that and athena's legs meet in its slow wave [rad]."""

STIFF_SERVO_ERROR = 0.003
"""Joint error at which the servos would give the largest effort [rad]; they are not limited."""

CYCLE_TIME = {"wave": 4.0}
"""Where 2.4 s is too short for the joints of athena [s]."""

FIRST_CYCLE = 3
CYCLES = 2
"""Whole cycles of which the mean is taken, from the end of the third on."""

LIMIT = 0.01
"""Largest relative error of speed and turn rate, and of the heading in radians."""

LOADED = 1e-3
"""A foot with less force slides freely [N]."""


@dataclass(frozen=True)
class WalkErrors:
    """What a walk does beside its plan, over whole cycles.

    Attributes:
        speed: relative error of the length of the way [-].
        heading: error of its direction [rad].
        turn_rate: relative error of the yaw rate [-]; 0 where none is planned.
        slip: way of the loaded contact points over the ground, mean of the feet [m per cycle].
    """

    speed: float
    heading: float
    turn_rate: float
    slip: float


@dataclass(frozen=True)
class CentredPlan:
    """A walk planned as if the feet were points at the centres of their spheres.

    Attributes:
        control: the walk.
    """

    control: hp.KinematicControl

    def plan(self, robot: hp.Robot, duration: float) -> JointTrajectory:
        """Return the plan of the same robot on point feet."""
        return self.control.plan(hp.load_robot(robot.source, foot_radius=0.0), duration)

    def to_dict(self) -> dict[str, object]:
        """Return the settings as TOML-able data."""
        return {**self.control.to_dict(), "kind": "centred"}


def walk_tracking(*, quick: bool = False) -> StudyReport:
    """Walk every gait on both robots; with `quick` one gait on one robot."""
    rows, worst = [], 0.0
    for name, radius, gait in _gaits(quick):
        found, before, refused = [], [], 0
        for one in _directions(gait, quick):
            try:
                found.append(measured(name, radius, one))
                before.append(measured(name, radius, one, centred=True))
            except GaitError:  # with the largest feet neighbouring legs meet
                refused += 1
        errors = _largest(found)
        worst = max(worst, *errors[:3])
        size = "URDF" if radius is None else f"{1e3 * radius:g}"
        walks = f"{len(found)}" + (f", {refused} refused" if refused else "")
        rows.append([name, size, gait.name, walks, *_cells(errors),
                     verdict(max(errors[:3]) <= LIMIT), *_cells(_largest(before))])  # fmt: skip
    head = ["robot", "radius [mm]", "gait", "walks"]
    what = ["speed [%]", "heading [rad]", "turn rate [%]", "slip [mm/cycle]"]
    columns = [*head, *what, "result", *(f"centres fixed: {one}" for one in what)]
    return StudyReport(
        "Walks and their plans",
        [
            f"Largest errors over headings of {', '.join(f'{h:g}' for h in HEADINGS)} degrees, "
            f"stroke {STROKE} m, straight and "
            f"turning by {TURN_PER_CYCLE} rad per cycle, mean of {CYCLES} cycles; flat ground, "
            f"default contact, servos with `from_effort(error={STIFF_SERVO_ERROR})`, not limited. "
            "Refused: walks in which neighbouring legs would overlap. "
            "Slip is that of loaded contact points, mean of the feet. On the right the same with "
            "feet planned as points, whose spheres roll all the same.",
            Table("", columns, rows),
            f"Largest of all: {100 * worst:.2f} % or 0.01 rad; to be at most {100 * LIMIT:g}.",
        ],
        met=worst <= LIMIT,
    )


def _gaits(quick: bool) -> Iterator[tuple[str, float | None, hp.Gait]]:
    """Yield robots, foot radii and gaits."""
    for name in ROBOTS[:1] if quick else ROBOTS:
        for radius in RADII[2:] if quick else RADII:
            for gait in list(GAITS)[:1] if quick else GAITS:
                cycle_time = CYCLE_TIME.get(gait, 2.4)
                yield name, radius, hp.Gait.by_name(gait, stroke=STROKE, cycle_time=cycle_time)


def _directions(gait: hp.Gait, quick: bool) -> Iterator[hp.Gait]:
    for heading in np.radians(HEADINGS[1:2] if quick else HEADINGS):
        for turn_rate in (0.0, TURN_PER_CYCLE / gait.cycle_time):
            yield gait.with_changes(heading=float(heading), turn_rate=turn_rate)


def measured(
    robot_name: str, radius: float | None, gait: hp.Gait, *, centred: bool = False
) -> WalkErrors:
    """Walk a gait and return its errors; `centred`: planned with feet that do not roll."""
    robot = hp.load_robot(robot_name, foot_radius=radius)
    servo = hp.Servo.from_effort(robot, error=STIFF_SERVO_ERROR)
    scene = hp.Scene(robot, servo=servo.model_copy(update={"limited": False}))
    control = hp.KinematicControl(gait)
    begin, end = (k * gait.cycle_time for k in (FIRST_CYCLE, FIRST_CYCLE + CYCLES))
    trace = hp.simulate(
        scene, CentredPlan(control) if centred else control, duration=end, accuracy=1e-4
    )
    inside = trace.time >= begin - 1e-9
    made = _way(_planar(trace.q[inside][[0, -1]]))
    path: FootPath = control.path(robot)
    meant = _way(path.body_pose(np.array([begin, end])))
    return WalkErrors(
        speed=made[0] / meant[0] - 1.0,
        heading=float(np.angle(np.exp(1j * (made[1] - meant[1])))),
        turn_rate=made[2] / meant[2] - 1.0 if gait.turn_rate else 0.0,
        slip=float(_slip(trace, robot, inside).mean()) / CYCLES,
    )


def _planar(q: Array) -> Array:
    """Return x, y [m] and yaw [rad] of configurations. (K, 7 + n) -> (K, 3)."""
    x, y, z, w = q[:, 3:7].T
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([q[:, 0], q[:, 1], yaw], axis=-1)


def _way(pose: Array) -> tuple[float, float, float]:
    """Return length [m], direction relative to the first pose [rad] and turn [rad] of a way."""
    along, turn = pose[1, :2] - pose[0, :2], float(np.angle(np.exp(1j * (pose[1, 2] - pose[0, 2]))))
    return float(np.hypot(*along)), float(np.arctan2(along[1], along[0]) - pose[0, 2]), turn


def _slip(trace: hp.Trace, robot: hp.Robot, inside: NDArray[np.bool_]) -> Array:
    """Return how far the contact points of loaded feet slide over level ground [m]. (F,)."""
    model, data = robot.model, scratch_data(robot)
    joints = [model.getJointId(foot.joint) for foot in robot.feet]
    rows = np.flatnonzero(inside)
    linear, angular, arm = np.zeros((3, len(rows), len(joints), 3))
    axes = np.zeros((len(rows), len(joints), 3, 3))
    for number, row in enumerate(rows):
        pin.forwardKinematics(model, data, trace.q[row], trace.v[row])
        for k, (joint, foot) in enumerate(zip(joints, robot.feet, strict=True)):
            own, at = pin.getVelocity(model, data, joint, pin.LOCAL), (number, k)
            linear[at], angular[at], axes[at] = own.linear, own.angular, data.oMi[joint].rotation
            arm[at] = np.asarray(foot.offset) - foot.radius * axes[at][2]
    along = (axes @ (linear + np.cross(angular, arm))[..., None])[..., 0]
    speed = np.hypot(along[..., 0], along[..., 1])
    loaded = trace.foot_force[rows, :, 2] > LOADED
    return np.asarray(np.trapezoid(speed * loaded, trace.time[rows], axis=0))


def _largest(found: list[WalkErrors]) -> tuple[float, float, float, float]:
    names = ("speed", "heading", "turn_rate", "slip")
    speed, heading, turn, slip = (max(abs(getattr(one, name)) for one in found) for name in names)
    return speed, heading, turn, slip


def _cells(errors: tuple[float, float, float, float]) -> list[str]:
    speed, heading, turn, slip = errors
    return [f"{100 * speed:.2f}", f"{heading:.4f}", f"{100 * turn:.2f}", f"{1e3 * slip:.2f}"]
