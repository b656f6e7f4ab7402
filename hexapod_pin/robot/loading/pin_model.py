"""Pinocchio's model of a checked URDF: feet in it, and the model with other masses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.description.solids import point_inertia, symmetric_matrix
from hexapod_pin.robot.description.urdf_file import LARGEST_RADIUS, POINT, Joint, UrdfFile

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


# Feet: spheres fixed to links, the only parts of a robot that touch the ground.


@dataclass(frozen=True, eq=False)
class Foot(Immutable):
    """A sphere fixed to a link that may touch the ground.

    Attributes:
        name: name of its link.
        leg: name of its leg; None where the robot has no legs of three joints.
        joint: name of the joint that moves it ("root_joint" where it is fixed to the base).
        offset: (3,) centre of the sphere in that joint's frame [m].
        radius: radius [m]; 0 is a point foot.
    """

    name: str
    leg: str | None
    joint: str
    offset: Array
    radius: float


def place_feet(
    file: UrdfFile, model: pin.Model, links: Mapping[str, str | None], radius: float | None = None
) -> tuple[tuple[Foot, ...], list[str]]:
    """Return the feet with their spheres, and notes on feet that have none.

    Args:
        file: the URDF.
        model: its model.
        links: foot link -> its leg, None for a robot without legs.
        radius: radius of all feet [m]; None takes each link's collision sphere, else a point.

    Raises:
        ParameterError: a radius out of range.
        UrdfError: a collision sphere whose numbers are.
    """
    if radius is not None and not 0.0 <= radius <= LARGEST_RADIUS:
        raise ParameterError("foot_radius", radius, f"from 0 to {LARGEST_RADIUS:g} m")
    feet, points = [], []
    for name, leg in links.items():
        sphere = file.foot_sphere(name)
        if sphere is None and radius is None:
            points.append(name)
        sphere = sphere or POINT
        joint, place = placement(model, name)
        centre = read_only(place.act(np.array(sphere.centre)))
        size = sphere.radius if radius is None else float(radius)
        feet.append(Foot(name, leg, joint, centre, size))
    note = f"no collision sphere on {', '.join(points)}: point feet (or give foot_radius)"
    return tuple(feet), [note] if points else []


# A model with other masses: bodies fixed to links for good, taken from them, or scaled.


class AddedBody(NamedTuple):
    """A rigid body on a link.

    Attributes:
        link: name of the link, also one that is fixed to another.
        mass: [kg].
        position: its centre of mass in the link's frame [m]. Shape (3,).
        inertia: about its centre of mass, along the link's axes [kg m^2]. Shape (3, 3).
    """

    link: str
    mass: float
    position: Array
    inertia: Array


class RemovedPoint(NamedTuple):
    """A point mass [kg] taken from a link, at a place in the link's frame [m]."""

    link: str
    mass: float
    position: Array


class ScaledBodies(NamedTuple):
    """A factor on mass and inertia of the moved bodies that links belong to; of all without one."""

    links: tuple[str, ...]
    factor: float


MassChange = AddedBody | RemovedPoint | ScaledBodies


def mass_change(load: Mapping[str, Any]) -> MassChange | None:
    """Return what a load, as plain data of a scene, does to the masses; None: nothing."""
    position = np.array(load.get("position", (0.0, 0.0, 0.0)), dtype=float)
    if load["kind"] == "payload":
        inertia = symmetric_matrix(load.get("inertia"))
        return AddedBody(load["link"], float(load["mass"]), position, inertia)
    if load["kind"] == "removed-mass":
        return RemovedPoint(load["link"], float(load["mass"]), position)
    if load["kind"] == "mass-factor":
        return ScaledBodies(tuple(load.get("links", ())), float(load["factor"]))
    return None


def with_mass_changes(bare: pin.Model, changes: Sequence[MassChange]) -> pin.Model:
    """Return a copy of a model with other masses: scaled first, then added, then removed.

    Raises:
        UnknownNameError: no such link.
        ParameterError: more is taken from a body than it contains.
    """
    import pinocchio as pin

    model = pin.Model(bare)
    for scaling in (x for x in changes if isinstance(x, ScaledBodies)):
        for joint in _bodies(model, scaling.links):
            body, factor = model.inertias[joint], scaling.factor
            model.inertias[joint] = pin.Inertia(
                factor * body.mass, body.lever, factor * body.inertia
            )
    for added in (x for x in changes if isinstance(x, AddedBody)):
        name, place = placement(model, added.link)
        inertia = pin.Inertia(added.mass, np.array(added.position, dtype=float), added.inertia)
        model.inertias[model.getJointId(name)] += place.act(inertia)
    for point in (x for x in changes if isinstance(x, RemovedPoint)):
        name, place = placement(model, point.link)
        joint = model.getJointId(name)
        where = place.act(np.array(point.position, dtype=float))
        model.inertias[joint] = _without(model.inertias[joint], point, where)
    return model


def _bodies(model: pin.Model, links: Sequence[str]) -> list[int]:
    """Return the moved bodies that links belong to, each once; all where no link is named."""
    if not links:
        return list(range(1, model.njoints))
    return sorted({int(model.getJointId(placement(model, link)[0])) for link in links})


def _without(body: pin.Inertia, point: RemovedPoint, where: Array) -> pin.Inertia:
    """Return what is left of a body without a point mass of it.

    The point's inertia about the body's centre of mass c is m (|r|^2 1 - r r^T) with r = p - c;
    what is left has its own centre of mass, to which Steiner's theorem takes it.
    """
    import pinocchio as pin

    left = body.mass - point.mass
    if left <= 0.0:
        raise _too_much(point, f"{left:.4g} kg are left")
    arm = where - body.lever
    shift = -point.mass / left * arm  # of the centre of mass
    inertia = body.inertia - point.mass * point_inertia(arm) - left * point_inertia(shift)
    small, middle, large = np.linalg.eigvalsh(inertia)
    if small < 0.0 or small + middle < large:
        moments = f"{small:.3g}, {middle:.3g}, {large:.3g}"
        raise _too_much(point, f"principal moments of {moments} kg m^2 are left")
    return pin.Inertia(left, body.lever + shift, inertia)


def _too_much(point: RemovedPoint, left: str) -> ParameterError:
    return ParameterError(
        f"RemovedMass.mass[{point.link}]", point.mass,
        f"of what the link contains there [kg]: {left}, which no rigid body has",
        "Take less away, or take it from the link on the other side of the joint.",
    )  # fmt: skip
