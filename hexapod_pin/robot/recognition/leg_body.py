"""The last body of a leg: everything beyond its last turning joint, as shapes in one frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.chains import Chain
from hexapod_pin.robot.recognition.shape_points import FlatEnd, link_shapes
from hexapod_pin.robot.recognition.tree_frames import Axis, TreeFrames

if TYPE_CHECKING:
    from hexapod_pin.robot.reading.resources import ResourceFinder


NOTHING = 1e-9
"""A shape that reaches no further than this from the last joint's axis shows no foot [m]."""


class BodySphere(NamedTuple):
    """A sphere on a leg's last body, root link's frame.

    Attributes:
        link: that carries it.
        centre: [m]. Shape (3,).
        radius: [m].
        stated: whether it is the link's first collision sphere: the file's own foot sphere.
    """

    link: str
    centre: Array
    radius: float
    stated: bool


class BodyEnd(NamedTuple):
    """An end face of a cylinder on a leg's last body, root link's frame."""

    link: str
    face: FlatEnd


@dataclass(frozen=True, eq=False)
class LegBody:
    """Shapes beyond a leg's last turning joint at q = 0, root link's frame.

    Attributes:
        chain: the leg.
        axis: of its last turning joint.
        points: vertices [m]. Shape (N, 3).
        owners: index into `chain.body` of the link of each point. Shape (N,).
        spheres: exact spheres.
        ends: end faces of cylinders.
        lost: why meshes give no points.
    """

    chain: Chain
    axis: Axis
    points: Array
    owners: Array
    spheres: tuple[BodySphere, ...]
    ends: tuple[BodyEnd, ...]
    lost: tuple[str, ...]

    @property
    def empty(self) -> bool:
        """Whether there is no shape away from the last joint's axis."""
        return self.reach <= NOTHING

    @property
    def reach(self) -> float:
        """Largest distance of any shape from the axis of the last joint [m]."""
        across = np.linalg.norm(self.axis.arm(self.points), axis=1)
        balls = [np.linalg.norm(self.axis.arm(s.centre)) + s.radius for s in self.spheres]
        return float(max([*across, *balls], default=0.0))

    def furthest(self) -> Array:
        """Return the unit direction from the last joint's axis to the furthest shape. (3,)."""
        arms = self.axis.arm(self.points)
        balls = [self.axis.arm(s.centre) for s in self.spheres]
        across = np.linalg.norm(arms, axis=1)
        sizes = [
            float(np.linalg.norm(a)) + s.radius for a, s in zip(balls, self.spheres, strict=True)
        ]
        reach = self.reach
        near = [a for a, s in zip(balls, sizes, strict=True) if s > 0.98 * reach]
        near += list(arms[across > 0.98 * reach])
        return _unit(np.sum([_unit(arm) for arm in near], axis=0) + np.zeros(3))


def _unit(vector: Array) -> Array:
    """Return a vector (3,) at unit length; zeros for zeros, as of a shape on the axis."""
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0.0 else np.zeros(3)


def leg_body(file: UrdfFile, finder: ResourceFinder, frames: TreeFrames, chain: Chain) -> LegBody:
    """Return the shapes beyond a leg's last turning joint."""
    points, owners = [np.zeros((0, 3))], [np.zeros(0, dtype=int)]
    spheres: list[BodySphere] = []
    ends: list[BodyEnd] = []
    lost: list[str] = []
    for index, link in enumerate(chain.body):
        shapes, pose = link_shapes(file, finder, link), frames.links[link]
        points.append(pose.act(shapes.points))
        owners.append(np.full(len(shapes.points), index))
        stated = file.link_by_name[link].collision_sphere
        for sphere in shapes.spheres:
            own = (
                stated is not None
                and sphere.radius == stated.radius
                and np.allclose(sphere.centre, stated.centre, rtol=0, atol=1e-12)
            )
            spheres.append(BodySphere(link, pose.act(sphere.centre), sphere.radius, own))
        for end in shapes.ends:
            face = FlatEnd(pose.act(end.centre), pose.rotation @ end.normal, end.radius, end.depth)
            ends.append(BodyEnd(link, face))
        lost += shapes.lost
    return LegBody(
        chain, frames.axes[chain.joints[-1].name], np.vstack(points), np.concatenate(owners),
        tuple(spheres), tuple(ends), tuple(lost),
    )  # fmt: skip
