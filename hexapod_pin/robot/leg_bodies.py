"""The shapes with which legs can hit each other and the trunk, for Pinocchio's collision library.

A leg link is its URDF collision shapes where these are primitives; else a capsule (a segment with
a radius) from its joint to the next one, or to the foot, as wide as the link is drawn, else of an
*assumed* radius. Feet are their spheres; the trunk is its collision shapes, else its drawn ones.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.immutable import ComparedByContent
from hexapod_pin.robot.description.urdf_annotation import moved_joints_above
from hexapod_pin.robot.leg_kinematics import held_configuration
from hexapod_pin.robot.link_shapes import LinkShape, link_shapes, urdf_of
from hexapod_pin.robot.robot import once_per_robot
from hexapod_pin.robot.serial_chain import axis_points

if TYPE_CHECKING:
    import pinocchio as pin

    from hexapod_pin.robot.description.urdf_file import Joint
    from hexapod_pin.robot.loading.pin_model import Foot
    from hexapod_pin.robot.robot import Leg, Robot

RADIUS_SHARE = 0.1
"""Radius of a capsule over its length where the URDF gives the link no primitive (*assumed*)."""

MIN_CAPSULE_LENGTH = 1e-6
"""A link shorter than this has no capsule [m]."""

TRUNK = "trunk"
"""What stands for a leg's name with the shapes of the trunk."""


@dataclass(frozen=True, eq=False)
class LegBodies(ComparedByContent):
    """Shapes of legs and trunk with the pairs to check; one instance per robot.

    Attributes:
        model: Pinocchio's model of the robot.
        geometry: the shapes and pairs of them.
        pairs: names of the two links of every pair.
        excluded: pairs of links that overlap in the standing posture, and so are not checked.
        assumed: what is assumed of the shapes; empty where the URDF's collision shapes give all.
    """

    model: pin.Model
    geometry: pin.GeometryModel
    pairs: tuple[tuple[str, str], ...]
    excluded: tuple[tuple[str, str], ...]
    assumed: str

    def distances(self, q: Array) -> tuple[Array, list[int]]:
        """Return the smallest distance in each configuration, and which pair has it.

        Args:
            q: configurations of the robot. Shape (K, nq).

        Returns:
            Distances, negative where shapes overlap [m], shape (K,), and indices into `pairs`;
            infinite where there is no pair.
        """
        import pinocchio as pin

        if not self.pairs:
            return np.full(len(q), np.inf), [0] * len(q)
        data, found = self.model.createData(), pin.GeometryData(self.geometry)
        results = found.distanceResults
        distance, nearest = np.empty(len(q)), []
        for row, configuration in enumerate(q):
            index = pin.computeDistances(self.model, data, self.geometry, found, configuration)
            distance[row] = results[index].min_distance
            nearest.append(int(index))
        return distance, nearest


@dataclass(frozen=True)
class _Body:
    """A shape of a link: the leg it belongs to, its joint's place on that leg (0: on the trunk)."""

    leg: str
    place: int
    link: str
    shape: Any


@once_per_robot
def leg_bodies(robot: Robot) -> LegBodies:
    """Return the shapes of a robot's legs and trunk, with the pairs that may come to overlap.

    Checked are links of different legs with each other, and all but the first link of each leg
    with the trunk.
    """
    import pinocchio as pin

    notes: dict[str, list[str]] = {}
    bodies = [body for leg in robot.legs for body in _leg_shapes(robot, leg, notes)]
    bodies += _trunk_shapes(robot, notes)
    geometry = pin.GeometryModel()
    for k, body in enumerate(bodies):
        name, place, shape = body.shape
        joint = robot.model.getJointId(name)
        geometry.addGeometryObject(pin.GeometryObject(f"{k} {body.link}", joint, place, shape))
    pairs = [
        (a, b)
        for a, b in itertools.combinations(range(len(bodies)), 2)
        if _may_meet(bodies[a], bodies[b])
    ]
    names = {pair: (bodies[pair[0]].link, bodies[pair[1]].link) for pair in pairs}
    overlapping = _overlapping(robot, geometry, pairs)
    checked = [pair for pair in pairs if pair not in overlapping]
    geometry.removeAllCollisionPairs()
    for pair in checked:
        geometry.addCollisionPair(pin.CollisionPair(*pair))
    return LegBodies(
        model=robot.model,
        geometry=geometry,
        pairs=tuple(names[pair] for pair in checked),
        excluded=tuple(dict.fromkeys(names[pair] for pair in overlapping)),
        assumed="; ".join(f"{note} ({', '.join(links)})" for note, links in notes.items()),
    )


def _may_meet(first: _Body, second: _Body) -> bool:
    """Return whether two shapes are checked: the trunk comes last, a first link sits on it."""
    return first.leg != second.leg and not (second.leg == TRUNK and first.place == 0)


def _overlapping(
    robot: Robot, geometry: pin.GeometryModel, pairs: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Return the pairs of shapes that overlap in the standing posture."""
    import pinocchio as pin

    for pair in pairs:
        geometry.addCollisionPair(pin.CollisionPair(*pair))
    if not pairs:
        return []
    found = pin.GeometryData(geometry)
    data = robot.model.createData()
    pin.computeDistances(robot.model, data, geometry, found, robot.stand().q)
    results = zip(pairs, found.distanceResults, strict=True)
    return [pair for pair, result in results if result.min_distance < 0.0]


def _leg_shapes(robot: Robot, leg: Leg, notes: dict[str, list[str]]) -> list[_Body]:
    """Return the shapes of one leg."""
    import coal
    import pinocchio as pin

    file, foot, bodies = urdf_of(robot), robot.foot(leg.foot), []
    chain = _own_joints(robot, leg)
    spans = _spans(robot, [joint.name for joint in chain], foot)
    rotors = set(robot.gaps.values())  # before a gear's play: the link is behind the next joint
    for k, joint in enumerate(chain):
        place = sum(before.name not in rotors for before in chain[:k])
        links = [name for name in file.rigid_group(joint.child) if name != foot.name]
        shapes, _ = link_shapes(robot, links, "collision", meshes=False)
        if shapes:
            bodies += [_Body(leg.name, place, x.link, _primitive(x)) for x in shapes]
        elif capsule := _capsule(robot, joint, links, spans[k], notes):
            bodies.append(_Body(leg.name, place, joint.child, capsule))
    if foot.radius > 0.0:
        centre = pin.SE3(np.eye(3), np.array(foot.offset))
        sphere = (foot.joint, centre, coal.Sphere(foot.radius))
        bodies.append(_Body(leg.name, len(chain) - 1, foot.name, sphere))
    return bodies


def _own_joints(robot: Robot, leg: Leg) -> list[Joint]:
    """Return the moved joints of one leg alone, held ones included, from the trunk outwards."""
    file = urdf_of(robot)
    others = {
        joint.name
        for other in robot.legs
        if other.name != leg.name
        for joint in moved_joints_above(file, other.foot)
    }
    return [joint for joint in moved_joints_above(file, leg.foot) if joint.name not in others]


def _trunk_shapes(robot: Robot, notes: dict[str, list[str]]) -> list[_Body]:
    """Return the primitives of the trunk; a trunk without any is not checked, which is noted."""
    file, feet = urdf_of(robot), {foot.name for foot in robot.feet}
    links = [name for name in file.rigid_group(file.base) if name not in feet]
    shapes, _ = link_shapes(robot, links, "collision", meshes=False)
    if not shapes:
        shapes, _ = link_shapes(robot, links, "visual", meshes=False)
        note = "as drawn" if shapes else "not checked: no primitive shape"
        notes.setdefault(note, []).append(file.base)
    return [_Body(TRUNK, 0, shape.link, _primitive(shape)) for shape in shapes]


def _primitive(shape: LinkShape) -> tuple[str, pin.SE3, Any]:
    """Return joint, placement and shape of a primitive."""
    import coal
    import pinocchio as pin

    make = {"box": coal.Box, "cylinder": coal.Cylinder, "sphere": coal.Sphere}[shape.kind]
    place = pin.SE3(np.array(shape.rotation), np.array(shape.position))
    return shape.joint, place, make(*shape.size)


def _spans(robot: Robot, joints: list[str], foot: Foot) -> list[tuple[Array, Array]]:
    """Return where each joint's link begins and ends in the joint's frame [m]. (3,) each.

    These points of the axes are the same wherever along them the file puts the joints; a joint that
    slides begins at its origin.
    """
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, held_configuration(robot))
    ids = [model.getJointId(joint) for joint in joints]
    frames = [data.oMi[k] for k in ids]
    turns = [np.asarray(model.joints[k].createData().S).ravel()[3:] for k in ids]
    axes = np.array([frame.rotation @ turn for frame, turn in zip(frames, turns, strict=True)])
    tip = data.oMi[model.getJointId(foot.joint)].act(foot.offset)
    points = axis_points(axes, np.array([frame.translation for frame in frames]), tip)
    ends = [*points[1:], tip]
    return [
        (frame.actInv(begin), frame.actInv(end))
        for frame, begin, end in zip(frames, points, ends, strict=True)
    ]


def _capsule(
    robot: Robot, joint: Joint, links: list[str], span: tuple[Array, Array],
    notes: dict[str, list[str]],
) -> tuple[str, pin.SE3, Any] | None:  # fmt: skip
    """Return the capsule from a joint to the next one or the foot; None where they coincide."""
    import coal
    import pinocchio as pin

    begin, end = span
    along = end - begin
    length = float(np.linalg.norm(along))
    if length < MIN_CAPSULE_LENGTH:
        return None
    drawn, _ = link_shapes(robot, links, "visual", meshes=False)
    radius = max((_half_width(shape, along / length) for shape in drawn), default=0.0)
    note = "capsules as wide as drawn"
    if not drawn:
        radius, note = RADIUS_SHARE * length, f"capsules of radius {RADIUS_SHARE:g} times length"
    notes.setdefault(note, []).append(joint.child)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length)
    return joint.name, pin.SE3(turn.matrix(), 0.5 * (begin + end)), coal.Capsule(radius, length)


def _half_width(shape: LinkShape, along: Array) -> float:
    """Return half the larger width of a shape across the direction `along` (3,) it is nearest to.

    Of a box or a cylinder the axis nearest to the direction is its length.
    """
    if shape.kind == "sphere":
        return shape.size[0]
    radius = shape.size[0]
    edges = shape.size if shape.kind == "box" else (2 * radius, 2 * radius, shape.size[1])
    length = int(np.argmax(np.abs(shape.rotation.T @ along)))
    return 0.5 * max(edge for axis, edge in enumerate(edges) if axis != length)
