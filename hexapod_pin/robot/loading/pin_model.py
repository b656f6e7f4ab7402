"""Pinocchio's model of a checked URDF; the only place where its names become indices."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hexapod_pin.errors import UnknownNameError, UrdfError
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile

if TYPE_CHECKING:
    import pinocchio as pin


def build_model(file: UrdfFile) -> pin.Model:
    """Return the floating-base model of a URDF without findings, gravity as Pinocchio sets it.

    Raises:
        UrdfError: Pinocchio refuses the text, or reads another mass or joint count than we do.
    """
    import pinocchio as pin

    try:
        model = pin.buildModelFromXML(file.text, pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError) as error:
        raise UrdfError(file.source, [f"Pinocchio cannot read it: {error}"]) from error
    ours = math.fsum(link.mass or 0.0 for link in file.links)
    theirs = math.fsum(body.mass for body in model.inertias)
    if not math.isclose(ours, theirs, rel_tol=1e-12):
        raise UrdfError(
            file.source, [f"Pinocchio reads a mass of {theirs:.9g} kg instead of {ours:.9g} kg"]
        )
    moved = sum(joint.moves for joint in file.joints)
    if model.nv != 6 + moved or model.nq != 7 + moved:
        raise UrdfError(file.source, [f"Pinocchio reads {model.nv - 6} joints instead of {moved}"])
    return model


def joints_in_order(file: UrdfFile, model: pin.Model) -> list[Joint]:
    """Return the moved joints in the order of Pinocchio's velocity vector."""
    by_name = {joint.name: joint for joint in file.joints}
    names = [str(name) for name in model.names][2:]
    order = [model.joints[model.getJointId(name)].idx_v for name in names]
    return [by_name[name] for _, name in sorted(zip(order, names, strict=True))]


def placement(model: pin.Model, link: str) -> tuple[str, pin.SE3]:
    """Return the joint that moves a link and the link's frame in that joint's frame.

    Raises:
        UnknownNameError: no such link. (Pinocchio itself returns an index out of range for an
            unknown name, and crashes later.)
    """
    import pinocchio as pin

    if not model.existFrame(link, pin.FrameType.BODY):
        known = [frame.name for frame in model.frames if frame.type == pin.FrameType.BODY]
        raise UnknownNameError("link", link, known)
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    return str(model.names[frame.parentJoint]), frame.placement
