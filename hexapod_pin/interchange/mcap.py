"""A run as an MCAP file, as Foxglove, PlotJuggler, Rerun and ROS 2 read it.

The messages are those of ROS 2 in CDR. All of these programs decode them; JSON schemas of Foxglove
are decoded by Foxglove alone, and its Protobuf schemas not by `ros2 bag play`. Numbers are doubles
there: what `read_mcap` reads back is what was written, to the bit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.interchange.ros_messages import (
    MCAP,
    NANO,
    Sent,
    header,
    vector,
    write_messages,
)
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.result_files import check_ending
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_verdict import walk_verdict

WORLD = "world"
"""Frame of the ground: x forward at the start, z up."""

JOINTS, SET_POINTS, BASE, MASS_CENTER = "/joint_states", "/joint_set_points", "/odom", "/com"
EXACT_TIME, FORCES, ARROWS = "/simulation_time", "/foot_force/", "/foot_force_arrows"
CONTACT = "_contact"
"""What the frame of a foot force adds to the foot's name."""

LONGEST_ARROW = 0.25
"""Of the largest foot force of a run, as drawn [m]."""

ARROW_WIDTH, ARROW_HEAD = 0.006, 0.014
"""Diameters of the shaft and of the head of an arrow [m]."""

ARROW_COLOR = {"r": 0.85, "g": 0.2, "b": 0.1, "a": 1.0}

FRAME_TIME = 0.02
"""Least time between two sets of transforms and arrows, which viewers interpolate [s]."""

LATEST = 2_147_483_647
"""Of a time in a message, which has seconds in 32 bits [s]."""

KINDS: Mapping[str, str] = {
    JOINTS: "sensor_msgs/JointState",
    SET_POINTS: "sensor_msgs/JointState",
    BASE: "nav_msgs/Odometry",
    MASS_CENTER: "geometry_msgs/PointStamped",
    EXACT_TIME: "std_msgs/Float64",
    FORCES: "geometry_msgs/WrenchStamped",
    "/robot_description": "std_msgs/String",
}
"""What is read, by topic."""


@checked
def write_mcap(trace: Trace, path: str | Path) -> Path:
    """Write a run into an MCAP file, as Foxglove, PlotJuggler, Rerun and `ros2 bag` read it.

    Topics: "/joint_states" and "/joint_set_points" (sensor_msgs/JointState: angle, rate, torque),
    "/odom" (nav_msgs/Odometry: the trunk), "/com", a geometry_msgs/WrenchStamped for each foot
    below "/foot_force/"; for 3-D views, 50 times a second, "/tf" and "/tf_static" (every link) and
    arrows of the forces; "/robot_description", "/verdict" (diagnostic_msgs/DiagnosticArray), and
    "/simulation_time" with each time as a double, which a stamp rounds to a nanosecond. What was
    not recorded is left out.

    Args:
        trace: of any run.
        path: ends in .mcap.

    Raises:
        ParameterError: the trace's URDF does not make its robot, or a time is after what a
            stamp can hold.
        TraceFileError: another ending, or the file cannot be written; the old one is intact.
        MissingPackageError: the packages for MCAP are not installed.

    Example:
        >>> hp.interchange.write_mcap(trace, "walk.mcap")
    """
    check_ending(path, MCAP)
    if trace.time[-1] > LATEST:
        raise ParameterError("Trace.time", float(trace.time[-1]), f"at most {LATEST} s")
    verdict = walk_verdict(trace)
    facts = {
        "robot": trace.run.robot.name,
        "verdict": verdict.line,
        "walks": str(verdict.walks).lower(),
        "provenance": trace.run.robot.provenance,
        "assumed": "\n".join(trace.run.assumed),
        **{f"version {name}": text for name, text in trace.run.versions.items()},
    }
    return write_messages(path, _messages(trace, facts), facts)


def _messages(trace: Trace, facts: Mapping[str, str]) -> Iterator[Sent]:
    """Yield all messages of a run, in the order of time."""
    links = _Links.of(trace)
    contacts = _Contacts.of(trace)
    begin = round(float(trace.time[0]) * NANO)
    if trace.run.robot.urdf is not None:
        text = {"data": trace.run.robot.urdf}
        yield "/robot_description", "std_msgs/String", begin, text
    if links.fixed:
        yield "/tf_static", "tf2_msgs/TFMessage", begin, {"transforms": links.still(begin)}
    yield "/verdict", "diagnostic_msgs/DiagnosticArray", begin, _diagnosis(trace, facts, begin)
    names = list(trace.joint_names)
    torque = trace.torque if "torque" in trace.recorded else None
    set_points = "set_points" in trace.recorded
    shown = -np.inf
    for k, seconds in enumerate(trace.time.tolist()):
        at = round(seconds * NANO)
        yield EXACT_TIME, KINDS[EXACT_TIME], at, {"data": seconds}
        q, v = trace.q[k], trace.v[k]
        effort = [] if torque is None else torque[k].tolist()
        yield JOINTS, KINDS[JOINTS], at, _joint_state(at, names, q[7:], v[6:], effort)
        if set_points:
            rows = trace.q_ref[k], trace.v_ref[k]
            yield SET_POINTS, KINDS[SET_POINTS], at, _joint_state(at, names, *rows, [])
        yield BASE, KINDS[BASE], at, _odometry(at, links.root, q, v)
        if "com" in trace.recorded:
            point = {"header": header(at, WORLD), "point": vector(trace.com[k])}
            yield MASS_CENTER, KINDS[MASS_CENTER], at, point
        yield from contacts.forces(at, k)
        if seconds - shown >= FRAME_TIME * (1.0 - 1e-9) or k == len(trace.time) - 1:
            shown = seconds
            moving = [*links.moving(at, q), *contacts.frames(at, k)]
            yield "/tf", "tf2_msgs/TFMessage", at, {"transforms": moving}
            yield from contacts.arrows(at, k)


def _joint_state(
    at: int, names: Sequence[str], position: Array, velocity: Array, effort: list[float]
) -> dict[str, Any]:
    return {
        "header": header(at),
        "name": names,
        "position": position.tolist(),
        "velocity": velocity.tolist(),
        "effort": effort,
    }


def _odometry(at: int, root: str, q: Array, v: Array) -> dict[str, Any]:
    """Return pose and twist of the trunk; the twist is in the trunk's own axes, as ROS has it."""
    pose = {"position": vector(q[:3]), "orientation": vector(q[3:7])}
    twist = {"linear": vector(v[:3]), "angular": vector(v[3:6])}
    unknown = [0.0] * 36
    return {
        "header": header(at, WORLD),
        "child_frame_id": root,
        "pose": {"pose": pose, "covariance": unknown},
        "twist": {"twist": twist, "covariance": unknown},
    }


def _transform(at: int, parent: str, child: str, place: Array) -> dict[str, Any]:
    """Return a transform; `place`: position and quaternion x, y, z, w of the child. Shape (7,)."""
    parts = {"translation": vector(place[:3]), "rotation": vector(place[3:7])}
    return {"header": header(at, parent), "child_frame_id": child, "transform": parts}


def _diagnosis(trace: Trace, facts: Mapping[str, str], at: int) -> dict[str, Any]:
    """Return the verdict as diagnostics: level OK where the robot walks, else ERROR."""
    values = {name: text for name, text in facts.items() if text and name not in ("verdict",)}
    if trace.gathered is not None:
        peaks = zip(trace.joint_names, trace.gathered.torque_peak.tolist(), strict=True)
        values |= {f"torque peak {joint} [N m]": f"{peak:.4g}" for joint, peak in peaks}
    status = {
        "level": 0 if facts["walks"] == "true" else 2,
        "name": "walk",
        "message": facts["verdict"],
        "hardware_id": facts["robot"],
        "values": [{"key": key, "value": text} for key, text in values.items()],
    }
    return {"header": header(at), "status": [status]}


class _Links(NamedTuple):
    """The tree of a robot's links.

    Attributes:
        root: name of the trunk's link.
        model: of the robot; None where the trace has no URDF.
        turned: links that move against their parents: frames of link and parent in the model.
        fixed: links that do not.
    """

    root: str
    model: Any
    turned: Sequence[tuple[int, int]]
    fixed: Sequence[tuple[int, int]]

    @staticmethod
    def of(trace: Trace) -> _Links:
        """Return the links of a trace's robot; the trunk alone where its URDF is not known."""
        if trace.run.robot.urdf is None:
            return _Links("base_link", None, (), ())
        import pinocchio as pin

        model = RecordedRobot.of(trace).model
        bodies = [k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
        turned: list[tuple[int, int]] = []
        fixed: list[tuple[int, int]] = []
        root = bodies[0]
        for k in bodies[1:]:
            moved = False
            parent = model.frames[k].parentFrame
            while model.frames[parent].type != pin.FrameType.BODY:
                moved |= model.frames[parent].type == pin.FrameType.JOINT
                parent = model.frames[parent].parentFrame
            (turned if moved else fixed).append((k, parent))
        return _Links(model.frames[root].name, model, turned, fixed)

    def still(self, at: int) -> list[dict[str, Any]]:
        """Return the transforms that hold for the whole run."""
        import pinocchio as pin

        return self._between(at, pin.neutral(self.model), self.fixed)

    def moving(self, at: int, q: Array) -> list[dict[str, Any]]:
        """Return the transforms of an instant: the trunk in the world, links in their parents."""
        trunk = _transform(at, WORLD, self.root, q[:7])
        return [trunk] if self.model is None else [trunk, *self._between(at, q, self.turned)]

    def _between(self, at: int, q: Array, pairs: Sequence[tuple[int, int]]) -> list[dict[str, Any]]:
        import pinocchio as pin

        data, frames = self.model.createData(), self.model.frames
        pin.framesForwardKinematics(self.model, data, np.asarray(q))
        found = []
        for child, parent in pairs:
            place = pin.SE3ToXYZQUAT(data.oMf[parent].actInv(data.oMf[child]))
            found.append(_transform(at, frames[parent].name, frames[child].name, place))
        return found


class _Contacts(NamedTuple):
    """The feet of a trace with their forces; F of them.

    Attributes:
        trace: the trace.
        names: of the feet; none where no forces were recorded.
        scale: length of an arrow for a force [m/N].
        topics: of the forces.
    """

    trace: Trace
    names: tuple[str, ...]
    scale: float
    topics: tuple[str, ...]

    @staticmethod
    def of(trace: Trace) -> _Contacts:
        """Return the feet of a trace."""
        if "contacts" not in trace.recorded:
            return _Contacts(trace, (), 0.0, ())
        largest = float(np.linalg.norm(trace.foot_force, axis=2).max(initial=0.0))
        topics: list[str] = []
        for k, name in enumerate(trace.foot_names):
            topic = FORCES + re.sub(r"\W", "_", name, flags=re.ASCII)
            topics.append(f"{topic}_{k}" if topic in topics else topic)
        scale = LONGEST_ARROW / largest if largest > 0.0 else 0.0
        return _Contacts(trace, trace.foot_names, scale, tuple(topics))

    def frames(self, at: int, k: int) -> list[dict[str, Any]]:
        """Return a frame at each foot with the axes of the world, in which its force is given."""
        level = np.array([0.0, 0.0, 0.0, 1.0])
        return [
            _transform(at, WORLD, name + CONTACT, np.concatenate([place, level]))
            for name, place in zip(self.names, self._places(k), strict=True)
        ]

    def _places(self, k: int) -> Array:
        empty: Array = np.empty((0, 3))
        return self.trace.foot_position[k] if self.names else empty

    def forces(self, at: int, k: int) -> Iterator[Sent]:
        """Yield the force of each foot at a sample."""
        if not self.names:
            return
        none = vector((0.0, 0.0, 0.0))
        for topic, name, force in zip(
            self.topics, self.names, self.trace.foot_force[k].tolist(), strict=True
        ):
            wrench = {"force": vector(force), "torque": none}
            fields = {"header": header(at, name + CONTACT), "wrench": wrench}
            yield topic, KINDS[FORCES], at, fields

    def arrows(self, at: int, k: int) -> Iterator[Sent]:
        """Yield the arrows of the feet that have a force."""
        if self.names:
            forces, places = self.trace.foot_force[k], self._places(k)
            feet = range(len(self.names))
            markers = [self._arrow(at, i, places[i], forces[i]) for i in feet]
            yield ARROWS, "visualization_msgs/MarkerArray", at, {"markers": markers}

    def _arrow(self, at: int, number: int, place: Array, force: Array) -> dict[str, Any]:
        """Return the arrow of a force from its foot on; of a foot without force, its removal."""
        shown = bool(np.any(force)) and self.scale > 0.0
        origin = {"position": vector((0.0, 0.0, 0.0)), "orientation": vector((0.0, 0.0, 0.0, 1.0))}
        nothing = {"header": header(0), "format": "", "data": b""}
        points = [vector(place), vector(place + self.scale * force)] if shown else []
        return {
            "header": header(at, WORLD),
            "ns": self.names[number],
            "id": number,
            "type": 0,
            "action": 0 if shown else 2,
            "pose": origin,
            "scale": vector((ARROW_WIDTH, ARROW_HEAD, 0.0)),
            "color": ARROW_COLOR,
            "lifetime": {"sec": 0, "nanosec": 0},
            "frame_locked": False,
            "points": points,
            "colors": [],
            "texture_resource": "",
            "texture": nothing,
            "uv_coordinates": [],
            "text": "",
            "mesh_resource": "",
            "mesh_file": {"filename": "", "data": b""},
            "mesh_use_embedded_materials": False,
        }
