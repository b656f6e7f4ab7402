"""The links of a URDF, grouped by the fixed joints between them; read by yourdfpy."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import MissingPackageError, UrdfError

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

TURNING_JOINTS = ("revolute", "continuous")
"""URDF types of the joints that move."""


@dataclass(frozen=True, eq=False)
class LinkGroup:
    """Links fixed to each other.

    Attributes:
        frames: (4, 4) of every link in the first link's frame.
        joint: the turning joint between the group and its parent; None for the root.
        parent: index of the parent group; -1 for the root.
        joint_frame: (4, 4) the joint's frame in the parent group's first link.
    """

    frames: dict[str, Array]
    joint: Any
    parent: int
    joint_frame: Array


def parsed_robot(urdf: str) -> Any:
    """Return yourdfpy's robot; refuse joints that are neither turning nor fixed.

    Raises:
        MissingPackageError: yourdfpy is not installed.
        UrdfError: it cannot read the text, or a joint is of another kind.
    """
    try:
        import yourdfpy
    except ImportError as error:
        raise MissingPackageError("yourdfpy", "formulations", "maximal coordinates") from error

    stream = io.BytesIO(urdf.encode())
    try:
        model = yourdfpy.URDF.load(stream, build_scene_graph=False, load_meshes=False)
    except Exception as error:  # it lets through whatever its XML library raises
        raise UrdfError("URDF text", [f"yourdfpy cannot read it: {error}"]) from error
    findings = []
    for joint in model.robot.joints:
        if joint.type not in (*TURNING_JOINTS, "fixed") or joint.mimic is not None:
            what = "mimic" if joint.mimic is not None else joint.type
            findings.append(f"joint {joint.name!r}: {what}; must be revolute, continuous or fixed")
    if findings:
        raise UrdfError(model.robot.name, findings)
    return model.robot


def rigid_groups(robot: Any) -> list[LinkGroup]:
    """Return the groups, by depth."""
    below: dict[str, list[Any]] = {link.name: [] for link in robot.links}
    for joint in robot.joints:
        below[joint.parent].append(joint)
    children = {joint.child for joint in robot.joints}
    roots = [link.name for link in robot.links if link.name not in children]
    if len(roots) != 1:
        raise UrdfError(robot.name, [f"root links {roots}: must be exactly one"])
    groups = [_rigid(roots[0], below, None, -1, np.eye(4))]
    for parent, group in enumerate(groups):
        for name, frame in group.frames.items():
            groups += [
                _rigid(joint.child, below, joint, parent, frame @ joint.origin)
                for joint in below[name]
                if joint.type in TURNING_JOINTS
            ]
    return groups


def _rigid(
    first: str, below: dict[str, list[Any]], joint: Any, parent: int, joint_frame: Array
) -> LinkGroup:
    """Return `first` with every link fixed to it."""
    frames, queue = {first: np.eye(4)}, [first]
    for name in queue:
        for fixed in below[name]:
            if fixed.type == "fixed":
                frames[fixed.child] = frames[name] @ fixed.origin
                queue.append(fixed.child)
    return LinkGroup(frames, joint, parent, joint_frame)
