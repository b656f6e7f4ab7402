"""Changes of convention that leave the robot as it is; parts are changed in place."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from rewriting.parts import JointPart, LinkPart, Placement, RobotParts, about

SPLIT_SHARES = (0.2, 0.8)
"""Least and largest share of a link's mass that goes to its new part."""

FOOT_BEYOND = 1.5
"""A foot frame beyond the sphere is this many times as far from the knee."""


def move_frame(robot: RobotParts, link: LinkPart, old: Placement) -> None:
    """Give a link another frame: `old` places its present frame in the new one."""
    link.com = old.r @ link.com + old.p
    link.inertia = old.r @ link.inertia @ old.r.T
    for shape in link.shapes:
        shape.place = old @ shape.place
    for joint in robot.joints:
        if joint.parent == link.name:
            joint.place = old @ joint.place


def turn_child(robot: RobotParts, joint: JointPart, turn: Array, slide: float) -> None:
    """Turn a joint's frame by a rotation (3, 3) and slide it along its axis [m]."""
    new = Placement(turn, slide * joint.axis)  # the new frame in the old
    joint.place = joint.place @ new
    joint.axis = turn.T @ joint.axis
    move_frame(robot, robot.link(joint.child), new.inverse())


def shift_zero(joint: JointPart, zero: float) -> None:
    joint.place = joint.place @ Placement(about(joint.axis, zero))
    joint.limit["lower"] -= zero
    joint.limit["upper"] -= zero


def flip_axis(joint: JointPart) -> None:
    joint.axis = -joint.axis
    lower, upper = joint.limit["lower"], joint.limit["upper"]
    joint.limit["lower"], joint.limit["upper"] = -upper, -lower


def put_fixed_link_before(robot: RobotParts, joint: JointPart, new: Placement) -> None:
    between = LinkPart(f"{joint.name}_mount", None, np.zeros(3), np.zeros((3, 3)), [])
    fixed = _fixed(f"{joint.name}_fixed", joint.parent, between.name, new)
    joint.parent, joint.place = between.name, new.inverse() @ joint.place
    robot.links.append(between)
    robot.joints.append(fixed)


def split(robot: RobotParts, link: LinkPart, share: float, place: Placement) -> None:
    """Put a share of a link's mass into a new link that is fixed to it at a placement.

    Both parts keep the centre of mass, so mass and inertia are the same together.
    """
    if link.mass is None:
        return
    part = LinkPart(f"{link.name}_part", share * link.mass, link.com.copy(), link.inertia, [])
    part.inertia = share * link.inertia
    link.mass, link.inertia = (1.0 - share) * link.mass, (1.0 - share) * link.inertia
    robot.links.append(part)
    robot.joints.append(_fixed(f"{link.name}_part_joint", link.name, part.name, place))
    move_frame(robot, part, place.inverse())


def place_foot(robot: RobotParts, joint: JointPart, frame: str) -> None:
    foot = robot.link(joint.child)
    if frame == "none":
        parent = robot.link(joint.parent)
        for shape in foot.shapes:
            shape.place = joint.place @ shape.place
        parent.shapes += foot.shapes
        robot.links.remove(foot)
        robot.joints.remove(joint)
        return
    away = {"at the sphere": 1.0, "at the knee": 0.0, "beyond the sphere": FOOT_BEYOND}[frame]
    new = Placement(p=(away - 1.0) * (joint.place.r.T @ joint.place.p))
    joint.place = joint.place @ new
    move_frame(robot, foot, new.inverse())


def _fixed(name: str, parent: str, child: str, place: Placement) -> JointPart:
    return JointPart(name, "fixed", parent, child, place, np.array([1.0, 0.0, 0.0]), {}, {})
