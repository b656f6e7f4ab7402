"""Poses of all links and joints in the root link's frame, from a URDF's tree alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.description.urdf_inertia import rotation
from hexapod_pin.robot.serial_chain import JointAxis

SLIDING = ("prismatic",)
TURNING = ("revolute", "continuous")


class Pose(NamedTuple):
    """A frame in the root link's frame: rotation (3, 3) and position (3,) [m]."""

    rotation: Array
    position: Array

    def act(self, points: Array) -> Array:
        """Return points (..., 3) of this frame in the root link's frame [m]."""
        moved: Array = points @ self.rotation.T + self.position
        return moved

    def into(self, points: Array) -> Array:
        """Return points (..., 3) of the root link's frame in this frame [m]."""
        moved: Array = (points - self.position) @ self.rotation
        return moved


class Axis(NamedTuple):
    """A joint's axis in the root link's frame: a point on it [m] and its unit direction."""

    origin: Array
    unit: Array

    def arm(self, points: Array) -> Array:
        """Return the perpendiculars (..., 3) from the axis to points (..., 3) [m]."""
        offset = points - self.origin
        across: Array = offset - (offset @ self.unit)[..., None] * self.unit
        return across


@dataclass(frozen=True, eq=False)
class TreeFrames:
    """Poses in the root link's frame.

    Attributes:
        links: pose of every link.
        axes: axis of every moved joint.
    """

    links: Mapping[str, Pose]
    axes: Mapping[str, Axis]


def tree_frames(file: UrdfFile, places: Mapping[str, float] = MappingProxyType({})) -> TreeFrames:
    """Return the poses of all links and moved joints.

    Args:
        file: a URDF whose tree is sound (`check_tree`).
        places: joint name -> angle or travel [rad or m]; the others are at zero.

    Raises:
        UrdfError: a moved joint without an axis.
    """
    links = {file.base: Pose(np.eye(3), np.zeros(3))}
    axes: dict[str, Axis] = {}
    reached = [file.base]
    for name in reached:
        for joint in file.joints_below[name]:
            parent = links[name]
            turn = parent.rotation @ rotation(joint.rpy)
            pose = Pose(turn, parent.act(np.array(joint.xyz)))
            if joint.moves:
                axes[joint.name] = Axis(pose.position, turn @ unit_axis(file, joint))
                pose = _moved(joint, axes[joint.name], pose, places.get(joint.name, 0.0))
            links[joint.child] = pose
            reached.append(joint.child)
    return TreeFrames(links, axes)


def turned_about(axis: Axis, points: Array, angle: float) -> Array:
    """Return points (..., 3) turned about an axis by an angle [rad]."""
    joint = JointAxis.of(axis.unit, axis.origin)
    c, s = np.cos([angle]), np.sin([angle])
    moved: Array = axis.origin + joint.rotate(points - axis.origin, c, s)
    return moved


def check_tree(file: UrdfFile) -> None:
    """Refuse what is no tree of links: the rest of recognition relies on it.

    Raises:
        UrdfError: naming each link or joint: no or several roots, links with two parents or
            without a <link>, numbers that cannot be read.
    """
    known = {link.name for link in file.links}
    counts = Counter(joint.child for joint in file.joints)
    findings = [
        f"joint {joint.name!r}: its {end} link {name!r} does not exist; declare it or correct it"
        for joint in file.joints
        for end, name in (("parent", joint.parent), ("child", joint.child))
        if name not in known
    ]
    roots = [link.name for link in file.links if link.name not in counts]
    if len(roots) != 1:
        text = ", ".join(roots) if roots else "none"
        findings.append(f"root links: {text}; must be exactly one: join the parts by fixed joints")
    findings += [
        f"link {name!r}: child of {count} joints; must be of one: a loop is no tree"
        for name, count in counts.items()
        if count > 1
    ]
    findings += [
        f"joint {joint.name!r}: origin or axis has missing or non-finite numbers; give three each"
        for joint in file.joints
        if not np.isfinite([*joint.xyz, *joint.rpy, *(joint.axis if joint.moves else ())]).all()
    ]
    if not findings and (lost := _unreached(file)):
        findings.append(f"links {lost}: on a loop of joints; the links must form a tree")
    if findings:
        raise UrdfError(file.source, findings)


def unit_axis(file: UrdfFile, joint: Joint) -> Array:
    """Return the unit axis (3,) of a moved joint in its own frame."""
    axis = np.array(joint.axis)
    size = float(np.linalg.norm(axis))
    if size == 0 and joint.kind in (*TURNING, *SLIDING):
        raise UrdfError(file.source, [f"joint {joint.name!r}: axis (0, 0, 0); give it a direction"])
    return axis / size if size else np.array([1.0, 0.0, 0.0])


def _moved(joint: Joint, axis: Axis, pose: Pose, place: float) -> Pose:
    """Return a joint's child frame at a place of the joint."""
    if place == 0 or joint.kind not in (*TURNING, *SLIDING):
        return pose
    if joint.kind in SLIDING:
        return Pose(pose.rotation, pose.position + place * axis.unit)
    columns = turned_about(Axis(np.zeros(3), axis.unit), pose.rotation.T, place)
    return Pose(columns.T, pose.position)


def _unreached(file: UrdfFile) -> str:
    """Return the links that the root does not lead to."""
    queue = [file.base]
    for name in queue:
        queue += [joint.child for joint in file.joints_below[name]]
    reached = set(queue)
    return ", ".join(repr(link.name) for link in file.links if link.name not in reached)
