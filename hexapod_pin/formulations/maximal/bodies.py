"""S1's equations take rigid bodies and revolute joints from a URDF, without Pinocchio's parser."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import MissingPackageError, ParameterError, UnknownNameError, UrdfError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from hexapod_pin.arrays import Array

    Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class FootSphere:
    """The sphere of a foot.

    Attributes:
        name: of its link.
        body: index of its body.
        offset: (3,) from the body's centre of mass to the sphere's centre, body axes [m].
        radius: [m].
    """

    name: str
    body: int
    offset: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Bodies:
    """A tree of nb bodies, by depth, the root first; joint j moves body j + 1.

    A body frame has the axes of a URDF link and its origin at the body's centre of mass. A joint
    frame has the child link's axes at zero angle; its origin lies on the axis.

    Attributes:
        names: link that gives each body its axes.
        mass: (nb,) [kg].
        inertia: (nb, 3, 3) about the centre of mass, body axes [kg m^2].
        root_origin: (3,) origin of the root link, root body frame [m].
        joint_names: of the nb - 1 joints.
        parent: (nj,) parent body of each joint.
        place: (nj, 3) s_i, joint's origin in the parent's body frame [m].
        attitude: (nj, 3, 3) axes of the joint frame in the parent's body frame.
        child_place: (nj, 3) s_j, joint's origin in the child's body frame [m].
        axis: (nj, 3) unit axis in the joint frame, and so in the child's.
        lower: (nj,) [rad], minus infinity without a limit.
        upper: (nj,) [rad].
        effort: (nj,) largest torque [N m].
        damping: (nj,) viscous [N m s/rad].
        feet: the feet.
    """

    names: tuple[str, ...]
    mass: Array
    inertia: Array
    root_origin: Array
    joint_names: tuple[str, ...]
    parent: Indices
    place: Array
    attitude: Array
    child_place: Array
    axis: Array
    lower: Array
    upper: Array
    effort: Array
    damping: Array
    feet: tuple[FootSphere, ...] = ()

    @cached_property
    def depth(self) -> Indices:
        """(nb,) joints between each body and the root."""
        found = np.zeros(len(self.mass), dtype=np.intp)
        for j, parent in enumerate(self.parent):
            found[j + 1] = found[parent] + 1
        return found

    @cached_property
    def levels(self) -> tuple[slice, ...]:
        """Joints of equal depth, root's first: `levels[0]` are those on the root."""
        depth = self.depth[1:]
        edges = np.searchsorted(depth, np.arange(1, self.depth.max() + 2))
        return tuple(slice(int(a), int(b)) for a, b in zip(edges, edges[1:], strict=False))

    @cached_property
    def joints_on_body(self) -> Array:
        """0-1 matrix (nb, nj) that adds joints up on their parents."""
        return np.eye(len(self.mass))[:, self.parent]

    @cached_property
    def across(self) -> tuple[Array, Array]:
        """Unit vectors a, b (nj, 3) with a x b = axis, joint frame: the axis' normal plane."""
        helper = np.eye(3)[np.argmin(np.abs(self.axis), axis=1)]
        a = np.cross(self.axis, helper)
        a /= np.linalg.norm(a, axis=1, keepdims=True)
        return a, np.cross(self.axis, a)


# Mass and inertia of links that fixed joints hold together, as one rigid body.


@dataclass(frozen=True, eq=False)
class RigidInertia:
    """A mass with its inertia, in the axes of the group's first link, from that link's origin.

    Attributes:
        mass: [kg].
        com: (3,) [m].
        inertia: (3, 3) about `com` [kg m^2].
    """

    mass: float
    com: Array
    inertia: Array


def link_inertia(mass: float, frame: Array, inertia: Array) -> RigidInertia:
    """Return the inertia of a link given in a frame (4, 4) of its own."""
    turn = frame[:3, :3]
    return RigidInertia(float(mass), frame[:3, 3], turn @ inertia @ turn.T)


def combined(inertias: Iterable[RigidInertia]) -> RigidInertia:
    """Return all as one: masses add, inertias move to the common centre (Steiner)."""
    parts = list(inertias)
    mass = sum(part.mass for part in parts)
    if mass <= 0.0:
        return RigidInertia(0.0, np.zeros(3), np.zeros((3, 3)))
    com = np.sum([part.mass * part.com for part in parts], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = part.com - com
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return RigidInertia(mass, com, inertia)


# Bodies and joints from the text of a URDF, independent of Pinocchio's parser.


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
            parts.append(link_inertia(inertial.mass, frame @ _origin(inertial), inertial.inertia))
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
            return _origin(collision)[:, 3], float(collision.geometry.sphere.radius)
    return np.array([0.0, 0.0, 0.0, 1.0]), 0.0


def _origin(part: Any) -> Array:
    """Return the <origin> (4, 4) of a joint, inertial or collision; URDF's default: identity."""
    return np.eye(4) if part.origin is None else np.asarray(part.origin)


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


# The links of a URDF, grouped by the fixed joints between them; read by yourdfpy.

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
                _rigid(joint.child, below, joint, parent, frame @ _origin(joint))
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
                frames[fixed.child] = frames[name] @ _origin(fixed)
                queue.append(fixed.child)
    return LinkGroup(frames, joint, parent, joint_frame)
