"""Rigid bodies and the revolute joints between them, in body axes: constants of S1's equations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
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
