"""The scene of a playback: the robot's links as a tree with their shapes, ground, and loads.

Plain data for the page: lengths in metres, quaternions x y z w, meshes as arrays of a block.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.scene.loads import LostLeg, Payload, Push
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.robot_shapes import DrawnShape, RobotShapes
from hexapod_pin.view.sample_block import SampleBlock

MESH_DIGITS = 1e-5
"""Resolution of meshes [m]; a robot of 10 m is drawn to this, too."""

DIGITS = 6
"""Of lengths in the tree: micrometres."""


def meshed_robot(
    trace: Trace, store: MeshStore, package_path: Sequence[str | Path] = ()
) -> RobotShapes:
    """Return the shapes of the trace's robot, with its meshes.

    Meshes are looked for beside the file that the robot was loaded from.

    Args:
        trace: what is drawn.
        store: takes the meshes; one for a page.
        package_path: folders that hold ROS packages, looked into first.

    Raises:
        ViewerError: the trace's URDF cannot be drawn.
    """
    robot = trace.run.case.robot_file
    source = str(robot.get("source", ""))
    folders = (*package_path, *robot.get("options", {}).get("package_path", ()))
    finder = ResourceFinder(source or "robot.urdf", folders) if source or folders else None
    radii = trace.run.robot.radii(len(trace.foot_names))
    feet = dict(zip(trace.foot_names, (float(radius) for radius in radii), strict=True))
    return RobotShapes(trace.run.robot.urdf or "", feet, finder=finder, store=store)


def require_finite(trace: Trace) -> None:
    """Refuse samples that cannot be drawn.

    Raises:
        ViewerError: names the first that is not finite.
    """
    drawn = ("q", "foot_position", "foot_force") if "contacts" in trace.recorded else ("q",)
    for name in drawn:
        good = np.isfinite(getattr(trace, name)).reshape(len(trace.time), -1).all(axis=1)
        if not good.all():
            sample = int(np.argmin(good))
            raise ViewerError(
                f"{name} is not finite in sample {sample} (t = {trace.time[sample]:g} s); "
                "it cannot be drawn."
            )


class DrawnMeshes:
    """The meshes of a page, each array packed once."""

    def __init__(self, block: SampleBlock) -> None:
        """Pack into a block."""
        self._block = block
        self._places: dict[bytes, tuple[int, int]] = {}

    def places(self, geometry: Mapping[str, Any]) -> tuple[int, int]:
        """Return where corners and triangles of a mesh are in the block."""
        data = geometry["data"]
        corners, index = data["attributes"]["position"]["array"], data["index"]["array"]
        key = corners.tobytes() + index.tobytes()
        if key not in self._places:
            self._places[key] = (
                self._block.add(corners.reshape(-1, 3), MESH_DIGITS, order=1),
                self._block.add(index, 1.0, order=1),
            )
        return self._places[key]


def robot_tree(
    shapes: RobotShapes, joint_names: Sequence[str], meshes: DrawnMeshes
) -> list[dict[str, Any]]:
    """Return the bodies, parents first: place on the parent, axis, index of the joint, and shapes.

    The joint's index is -1 for the trunk, -2 for a joint that the trace does not have.

    Raises:
        ViewerError: the URDF lacks a joint of the trace.
    """
    import pinocchio as pin

    model, tree = shapes.model, []
    for name in joint_names:
        if not model.existJointName(name):
            raise ViewerError(f"the trace's URDF has no joint {name!r} to draw.")
    data, neutral = model.createData(), pin.neutral(model)
    pin.computeJointJacobians(model, data, neutral)
    order = {name: k for k, name in enumerate(joint_names)}
    for joint, name in itertools.islice(enumerate(model.names), 1, None):
        place = model.jointPlacements[joint]
        entry: dict[str, Any] = {
            "name": name,
            "parent": int(model.parents[joint]) - 1,
            "joint": -1 if joint == 1 else order.get(name, -2),
            "place": _plain(place.translation),
            "turn": _plain(pin.Quaternion(place.rotation).coeffs(), 9),
            "shapes": [_drawn(shape, meshes) for shape in shapes.bodies[name]],
        }
        if joint > 1:
            motion = np.asarray(data.joints[joint].S).ravel()
            slides = np.linalg.norm(motion[3:]) < 0.5
            entry["axis"] = _plain(motion[:3] if slides else motion[3:], 9)
            entry["slides"] = bool(slides)
        tree.append(entry)
    return tree


def _drawn(shape: DrawnShape, meshes: DrawnMeshes) -> dict[str, Any]:
    import pinocchio as pin

    geometry = dict(shape.geometry)
    if geometry["type"] == "BufferGeometry":
        geometry = {"type": "mesh", "arrays": meshes.places(geometry)}
    return {
        **geometry,
        "place": _plain(shape.position),
        "turn": _plain(pin.Quaternion(np.asarray(shape.rotation, dtype=float)).coeffs(), 9),
        "color": rgb(shape.color),
        "opacity": float(shape.color[3]),
    }


def feet_of(trace: Trace, shapes: RobotShapes) -> list[dict[str, Any]]:
    """Return the contact points: name, radius, body, joints from the trunk outwards, label.

    Feet have the joints of their leg; points of the trunk have none.
    """
    import pinocchio as pin

    if "contacts" not in trace.recorded:
        return []
    model, found = shapes.model, list[dict[str, Any]]()
    order = {name: k for k, name in enumerate(trace.joint_names)}
    radii = trace.run.robot.radii(len(trace.foot_names))
    for foot, radius in zip(trace.foot_names, radii, strict=True):
        joint, chain = 1, list[int]()
        if model.existFrame(foot, pin.FrameType.BODY):
            joint = model.frames[model.getFrameId(foot, pin.FrameType.BODY)].parentJoint
        body = max(int(joint), 1)
        while joint > 1:
            chain.insert(0, order.get(model.names[joint], -1))
            joint = model.parents[joint]
        chain = [k for k in chain if k >= 0]
        found.append({"name": foot, "radius": float(radius), "body": body - 1, "joints": chain})
    legs = [one for one in found if one["joints"]]
    for one, label in zip(legs, short_names([one["name"] for one in legs]), strict=True):
        one["label"] = label
    return found


def short_names(names: Sequence[str]) -> list[str]:
    """Return names without the words that all of them share: lf_foot, rr_foot -> lf, rr."""
    words = [name.replace("-", "_").split("_") for name in names]
    shared = set.intersection(*map(set, words)) if len(words) > 1 else set()
    short = ["_".join(word for word in one if word not in shared) for one in words]
    return short if all(short) and len(set(short)) == len(short) else list(names)


def loads_of(trace: Trace, shapes: RobotShapes) -> list[dict[str, Any]]:
    """Return payloads, pushes and lost legs, with the body that carries them and the point on it.

    Pushes have their force [N] and torque [N m] in world axes, and their times [s].
    """
    scene, found = trace.run.scene, []
    for load in () if scene is None else scene.loads:
        if isinstance(load, LostLeg):
            found.append({"kind": "lost", "leg": load.leg, "start": load.start})
            continue
        if not isinstance(load, Payload | Push):
            continue
        body, point = _on_body(shapes, load.link, load.position)
        entry = {"kind": load.kind, "link": load.link, "body": body, "point": _plain(point)}
        if isinstance(load, Payload):
            found.append({**entry, "mass": load.mass})
        else:
            times = {"start": load.start, "end": load.end}
            found.append({**entry, **times, "force": load.force, "torque": load.torque})
    return found


def _on_body(shapes: RobotShapes, link: str, position: Sequence[float]) -> tuple[int, Array]:
    """Return the body that carries a link, and a point of the link in the body's frame [m]."""
    import pinocchio as pin

    model = shapes.model
    if not model.existFrame(link, pin.FrameType.BODY):
        return 0, np.asarray(position, dtype=float)
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    return max(int(frame.parentJoint), 1) - 1, np.asarray(frame.placement.act(np.array(position)))


def _plain(values: npt.ArrayLike, digits: int = DIGITS) -> list[float]:
    """Return rounded numbers, without -0."""
    plain: list[float] = (np.round(np.asarray(values, dtype=float), digits) + 0.0).tolist()
    return plain


def rgb(color: Sequence[float]) -> int:
    """Return 0xRRGGBB of red, green, blue from 0 to 1."""
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in color[:3])
    return (red << 16) + (green << 8) + blue
