"""Bodies and joints from the text of a URDF, independent of Pinocchio's parser."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.formulations.maximal.bodies import Bodies, FootSphere
from hexapod_pin.formulations.maximal.inertia import RigidInertia, combined, link_inertia
from hexapod_pin.formulations.maximal.urdf_tree import LinkGroup, parsed_robot, rigid_groups

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array


def read_bodies(
    urdf: str, feet: Sequence[str] = (), radii: Sequence[float | None] | None = None
) -> Bodies:
    """Return the bodies of a URDF; links behind fixed joints become part of their parent's body.

    Args:
        urdf: text of the file; any tree of revolute, continuous and fixed joints.
        feet: foot links.
        radii: of the feet [m]; None takes the collision sphere of the link, and a point without.

    Raises:
        UrdfError: not such a tree, or a moving body without mass or with an inertia that is not
            positive definite.
        UnknownNameError: a foot that is no link.
        ParameterError: as many radii as feet are needed.
    """
    parsed = parsed_robot(urdf)
    groups = rigid_groups(parsed)
    inertias = [_inertia(parsed, group) for group in groups]
    _require_mass(groups, inertias)
    joints = [group.joint for group in groups[1:]]
    return Bodies(
        names=tuple(next(iter(group.frames)) for group in groups),
        mass=np.array([part.mass for part in inertias]),
        inertia=np.array([part.inertia for part in inertias]),
        root_origin=-inertias[0].com,
        joint_names=tuple(joint.name for joint in joints),
        parent=np.array([group.parent for group in groups[1:]], dtype=np.intp),
        place=_stack((g.joint_frame[:3, 3] - inertias[g.parent].com for g in groups[1:]), (3,)),
        attitude=_stack((g.joint_frame[:3, :3] for g in groups[1:]), (3, 3)),
        child_place=_stack((-part.com for part in inertias[1:]), (3,)),
        axis=_stack((_unit_axis(joint) for joint in joints), (3,)),
        lower=_numbers(joints, "limit", "lower", -math.inf),
        upper=_numbers(joints, "limit", "upper", math.inf),
        effort=_numbers(joints, "limit", "effort", math.inf),
        damping=_numbers(joints, "dynamics", "damping", 0.0),
        feet=_feet(parsed, groups, inertias, feet, radii),
    )


def _inertia(robot: Any, group: LinkGroup) -> RigidInertia:
    """Return mass and inertia of a group."""
    links = {link.name: link for link in robot.links}
    parts = []
    for name, frame in group.frames.items():
        inertial = links[name].inertial
        if inertial is not None and inertial.mass is not None:
            own = np.eye(4) if inertial.origin is None else inertial.origin
            parts.append(link_inertia(inertial.mass, frame @ own, inertial.inertia))
    return combined(parts)


def _require_mass(groups: list[LinkGroup], inertias: list[RigidInertia]) -> None:
    """Every body has six equations of its own: refuse those without mass."""
    findings = []
    for group, part in zip(groups, inertias, strict=True):
        name = next(iter(group.frames))
        if not part.mass > 0.0:
            findings.append(f"body {name!r}: mass {part.mass:g} kg; must be above 0")
        elif not np.linalg.eigvalsh(part.inertia).min() > 0.0:
            findings.append(f"body {name!r}: inertia must be positive definite")
    if findings:
        raise UrdfError("maximal coordinates", findings)


def _feet(
    robot: Any,
    groups: list[LinkGroup],
    inertias: list[RigidInertia],
    names: Sequence[str],
    radii: Sequence[float | None] | None,
) -> tuple[FootSphere, ...]:
    """Return the spheres of the feet on their bodies."""
    if radii is not None and len(radii) != len(names):
        raise ParameterError("radii", len(radii), f"{len(names)}, one for each foot")
    links = {link.name: link for link in robot.links}
    found = []
    for k, name in enumerate(names):
        if name not in links:
            raise UnknownNameError("foot link", name, list(links))
        body = next(b for b, group in enumerate(groups) if name in group.frames)
        centre, own = _sphere(links[name])
        offset = (groups[body].frames[name] @ centre)[:3] - inertias[body].com
        given = None if radii is None else radii[k]
        found.append(FootSphere(name, body, offset, own if given is None else float(given)))
    return tuple(found)


def _sphere(link: Any) -> tuple[Array, float]:
    """Return centre (4,), homogeneous, and radius of a link's first collision sphere."""
    for collision in link.collisions:
        if collision.geometry.sphere is not None:
            origin = np.eye(4) if collision.origin is None else collision.origin
            return origin[:, 3], float(collision.geometry.sphere.radius)
    return np.array([0.0, 0.0, 0.0, 1.0]), 0.0


def _unit_axis(joint: Any) -> Array:
    size = float(np.linalg.norm(joint.axis))
    if not size > 0.0:
        raise UrdfError("maximal coordinates", [f"joint {joint.name!r}: axis 0 0 0"])
    return np.asarray(joint.axis / size)


def _numbers(joints: list[Any], part: str, name: str, default: float) -> Array:
    """Return one number of <limit> or <dynamics> for every joint."""
    found = []
    for joint in joints:
        free = joint.type == "continuous" and name in ("lower", "upper")
        value = None if free else getattr(getattr(joint, part), name, None)
        found.append(default if value is None else float(value))
    return np.array(found)


def _stack(rows: Any, shape: tuple[int, ...]) -> Array:
    """Return rows as one array, also where there are none."""
    return np.array(list(rows), dtype=float).reshape(-1, *shape)
