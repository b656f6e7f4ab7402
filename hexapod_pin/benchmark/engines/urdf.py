"""One URDF for all other engines: the bodies of our model, no fixed joints, foot spheres only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description import urdf_writer as xml
from hexapod_pin.robot.description.urdf_writer import Shape

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

ROOT = "root_joint"
BASE = "trunk"


def engine_urdf(robot: Robot, damping: Array) -> str:
    """Return the robot's URDF for another engine.

    Written from the model that we integrate, so that what is fixed together is one link: MuJoCo's
    parser needs no fusing, Drake's no weld, PyBullet's no massless link (it would give it 1 kg).

    Args:
        robot: revolute joints only, feet with a radius.
        damping: (n,) viscous damping of the joints, `joint_names` order [N m s/rad].

    Raises:
        ParameterError: a joint that is not revolute, or a point foot.
    """
    model = robot.model
    parts = [_link(robot, BASE, model.inertias[model.getJointId(ROOT)], ROOT)]
    for name, friction in zip(robot.joint_names, damping, strict=True):
        index = model.getJointId(name)
        parts.append(_link(robot, link_name(name), model.inertias[index], name))
        parts.append(_joint(model, index, name, float(friction)))
    body = "".join(parts)
    return f'<?xml version="1.0"?>\n<robot name="{robot.name}">\n{body}</robot>\n'


def link_name(joint: str) -> str:
    """Return the name of the link that a joint moves."""
    return BASE if joint == ROOT else f"{joint}_link"


def _link(robot: Robot, name: str, inertia: Any, joint: str) -> str:
    """Return a body with the spheres of the feet it carries."""
    parts = [xml.inertial(float(inertia.mass), tuple(inertia.lever), inertia.inertia.tolist())]
    for foot in robot.feet:
        if foot.joint == joint:
            if foot.radius <= 0.0:
                raise ParameterError(
                    f"radius of {foot.name}", foot.radius, "above 0 m: other engines have spheres"
                )
            centre = (float(foot.offset[0]), float(foot.offset[1]), float(foot.offset[2]))
            parts.append(xml.collision(Shape("sphere", (foot.radius,), centre)))
    return xml.link(name, parts)


def _joint(model: Any, index: int, name: str, damping: float) -> str:
    """Return a revolute joint with the placement and axis of our model."""
    import pinocchio as pin

    column = np.array(model.createData().joints[index].S, dtype=float).reshape(6, -1)
    if column.shape[1] != 1 or np.abs(column[:3]).max() > 0.0:
        raise ParameterError(f"joint {name}", str(model.joints[index]), "revolute")
    place = model.jointPlacements[index]
    parent = link_name(model.names[model.parents[index]])
    rpy = xml.numbers(pin.rpy.matrixToRpy(place.rotation).tolist())
    return (
        f'  <joint name="{name}" type="continuous">\n'
        f'    <parent link="{parent}"/><child link="{link_name(name)}"/>\n'
        f'    <origin xyz="{xml.numbers(place.translation.tolist())}" rpy="{rpy}"/>\n'
        f'    <axis xyz="{xml.numbers(column[3:, 0].tolist())}"/>\n'
        f'    <limit effort="1000" velocity="1000"/>\n'
        f'    <dynamics damping="{xml.number(damping)}" friction="0"/>\n  </joint>\n'
    )
