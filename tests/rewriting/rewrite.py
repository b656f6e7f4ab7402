"""Rewriting a URDF of primitives in other conventions: the same robot, another file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.rotations import rotation
from rewriting import parts
from rewriting.conventions import ConventionSet, rename
from rewriting.parts import Placement, RobotParts
from rewriting.shape_files import to_meshes

FOLDER = "shapes"
"""Where mesh files stand beside the URDF."""

PLACES = 0.05
"""Largest shift of a frame [m]."""

Y_UP = (np.pi / 2.0, 0.0, 0.0)
"""Roll, pitch, yaw of a frame with y up in one with z up [rad]."""


class JointChange(NamedTuple):
    """What became of a joint: q_new = sign q_old + offset [rad]."""

    name: str
    sign: float
    offset: float


@dataclass(frozen=True, eq=False)
class Rewritten:
    """A robot's text in other conventions, and the content of the files beside it by path.

    `joints` has what became of every moved joint, by its old name; `base` places the original root
    frame in the new one.
    """

    text: str
    files: dict[str, bytes] = field(repr=False)
    joints: dict[str, JointChange] = field(repr=False)
    base: Placement = field(repr=False)


def rewrite(text: str, conventions: ConventionSet, rng: np.random.Generator) -> Rewritten:
    """Return a URDF of primitives in other conventions; its <hexapod_pin> element is left out."""
    robot = parts.parts_of(parse_urdf(text.encode(), "the original"))
    base = _turn_base(robot, conventions)
    moved = [joint for joint in robot.joints if joint.limit]
    signs = {joint.name: 1.0 for joint in moved}
    zeros = {joint.name: 0.0 for joint in moved}
    for joint in [j for j in robot.joints if not j.limit]:
        parts.place_foot(robot, joint, conventions.feet)
    if conventions.zeros:
        for joint in moved:
            zeros[joint.name] = float(rng.uniform(joint.limit["lower"], joint.limit["upper"]))
            parts.shift_zero(joint, zeros[joint.name])
    if conventions.frames:
        for joint in list(robot.joints):
            slide = float(rng.uniform(-PLACES, PLACES)) if joint.limit else 0.0
            parts.turn_child(robot, joint, _random_turn(rng), slide)
    if conventions.signs:
        for joint in moved:
            if rng.random() < 0.5:
                signs[joint.name] = -1.0
                parts.flip_axis(joint)
    if conventions.fixed:
        _add_fixed(robot, rng)
    files = {}
    names = rename(robot, conventions.names, rng)
    if conventions.shapes != "primitives":
        files = to_meshes(robot, conventions.shapes, FOLDER)
    if conventions.shuffled:
        robot.links = [robot.links[k] for k in rng.permutation(len(robot.links))]
        robot.joints = [robot.joints[k] for k in rng.permutation(len(robot.joints))]
    parts.in_units(robot, conventions.units)
    changes = {
        old: JointChange(names[old], sign, -sign * zeros[old]) for old, sign in signs.items()
    }
    return Rewritten(parts.text_of(robot), files, changes, base)


def stripped(text: str) -> str:
    return parts.text_of(parts.parts_of(parse_urdf(text.encode(), "the original")))


def _turn_base(robot: RobotParts, conventions: ConventionSet) -> Placement:
    new = Placement(rotation((0.0, 0.0, conventions.yaw)))
    if conventions.y_up:
        new = new @ Placement(rotation(Y_UP))
    parts.move_frame(robot, robot.root, new.inverse())
    return new.inverse()


def _add_fixed(robot: RobotParts, rng: np.random.Generator) -> None:
    for joint in list(robot.joints):
        if rng.random() < 0.5:
            place = Placement(_random_turn(rng), rng.uniform(-PLACES, PLACES, 3))
            parts.put_fixed_link_before(robot, joint, place)
    for link in list(robot.links):
        if link.mass and rng.random() < 0.5:
            place = Placement(_random_turn(rng), rng.uniform(-PLACES, PLACES, 3))
            parts.split(robot, link, float(rng.uniform(*parts.SPLIT_SHARES)), place)


def _random_turn(rng: np.random.Generator) -> Array:
    if rng.random() < 0.5:
        turn: Array = Rotation.random(rng=rng).as_matrix()
        return turn
    return rotation(tuple(rng.integers(4, size=3) * np.pi / 2.0))
