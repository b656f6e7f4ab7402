"""A run from an MCAP file, and the joint states that a robot or another program recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.immutable import Immutable
from hexapod_pin.interchange.mcap import (
    BASE,
    CONTACT,
    EXACT_TIME,
    FORCES,
    JOINTS,
    KINDS,
    MASS_CENTER,
    SET_POINTS,
)
from hexapod_pin.interchange.ros_messages import NANO, McapFile, Received


@dataclass(frozen=True, eq=False)
class McapRecording(Immutable):
    """What an MCAP file holds of a run: T samples, n joints, F feet; SI units, radians.

    Of a file of another program (a robot's own recording) it has what "/joint_states" has, and its
    times are the stamps of those messages.

    Attributes:
        time: [s]. Shape (T,).
        joint_names: n names.
        joint_position: [rad]. Shape (T, n).
        joint_velocity: [rad/s]. Shape (T, n); None where there is none.
        torque: applied by the servos [N m]. Shape (T, n); None where there is none.
        base: position in the world and quaternion x, y, z, w. Shape (T, 7); None without it.
        base_velocity: linear and angular, in base axes [m/s, rad/s]. Shape (T, 6); None without it.
        q_ref: joint angle set-points [rad]. Shape (T, n); None where there are none.
        v_ref: joint rate set-points [rad/s]. Shape (T, n); None where there are none.
        com: centre of mass, world axes [m]. Shape (T, 3); None without it.
        foot_names: F names.
        foot_force: on the robot, world axes [N]. Shape (T, F, 3); None where there are none.
        urdf: of the robot; None where it is not known.
        metadata: texts on the run, such as "verdict".
    """

    time: Array
    joint_names: tuple[str, ...]
    joint_position: Array
    joint_velocity: Array | None = None
    torque: Array | None = None
    base: Array | None = None
    base_velocity: Array | None = None
    q_ref: Array | None = None
    v_ref: Array | None = None
    com: Array | None = None
    foot_names: tuple[str, ...] = ()
    foot_force: Array | None = None
    urdf: str | None = field(default=None, repr=False)
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return what it holds; the arrays themselves are long."""
        feet = f"{len(self.foot_names)} feet"
        return f"<McapRecording: {len(self.time)} samples, {len(self.joint_names)} joints, {feet}>"

    @property
    def q(self) -> Array:
        """Configurations as those of a trace (T, 7 + n).

        Raises:
            ParameterError: the file does not hold the motion of the base.
        """
        return self._with_base("base", self.base, self.joint_position)

    @property
    def v(self) -> Array:
        """Velocities as those of a trace (T, 6 + n).

        Raises:
            ParameterError: the file does not hold them.
        """
        return self._with_base("base_velocity", self.base_velocity, self.joint_velocity)

    def _with_base(self, name: str, base: Array | None, joints: Array | None) -> Array:
        if base is None or joints is None:
            raise ParameterError(f"McapRecording.{name}", None, "held by the file")
        return read_only(np.hstack([base, joints]))


@checked
def read_mcap(path: str | Path) -> McapRecording:
    """Read a run from an MCAP file that `write_mcap` has written, or joint states of any robot's.

    Args:
        path: the file.

    Raises:
        TraceFileError: the file is missing, damaged, holds no joint states, or its messages do not
            belong together.
        MissingPackageError: the packages for MCAP are not installed.

    Example:
        >>> recording = hp.interchange.read_mcap("walk.mcap")
        >>> recording.q.shape
    """
    file = McapFile(path)
    metadata = file.metadata()
    wanted = KINDS if metadata is not None else {JOINTS: KINDS[JOINTS]}
    topics: dict[str, list[Received]] = {}
    for message in file.messages(wanted):
        topics.setdefault(message[0], []).append(message)
    if JOINTS not in topics:
        raise TraceFileError(f"{path}: has no topic {JOINTS} of {KINDS[JOINTS]}.")
    try:
        return _recording(path, topics, metadata or {})
    except (ValueError, IndexError) as error:
        if isinstance(error, ParameterError):
            raise
        raise TraceFileError(f"{path}: its messages do not belong together ({error}).") from error


def _recording(
    path: str | Path, topics: Mapping[str, list[Received]], metadata: Mapping[str, str]
) -> McapRecording:
    """Return the arrays of decoded messages."""
    states = [fields for _, _, _, fields in topics[JOINTS]]
    count, names = len(states), tuple(states[0].name)
    for topic, several in topics.items():
        if len(several) != count and topic != "/robot_description":
            text = f"{topic} has {len(several)} messages, {JOINTS} {count}"
            raise TraceFileError(f"{path}: {text}.")
    if any(tuple(one.name) != names for one in states):
        raise TraceFileError(f"{path}: the messages of {JOINTS} are of different joints.")

    def rows(topic: str, width: int, values: Any) -> Array | None:
        """Return a row of numbers for each message; None where there are none."""
        table = [list(values(fields)) for _, _, _, fields in topics.get(topic, ())]
        if not any(table):
            return None
        return read_only(np.array(table, dtype=float).reshape(count, width))

    stamps = rows(JOINTS, 1, lambda m: [m.header.stamp.sec + m.header.stamp.nanosec / NANO])
    exact = rows(EXACT_TIME, 1, lambda m: [m.data])
    time = stamps if exact is None else exact
    position = rows(JOINTS, len(names), lambda m: m.position)
    if time is None or position is None:
        raise TraceFileError(f"{path}: the messages of {JOINTS} hold no positions.")
    feet = [topic for topic in topics if topic.startswith(FORCES)]
    forces = [rows(topic, 3, lambda m: _xyz(m.wrench.force)) for topic in feet]
    description = topics.get("/robot_description")
    return McapRecording(
        time=read_only(time[:, 0]),
        joint_names=names,
        joint_position=position,
        joint_velocity=rows(JOINTS, len(names), lambda m: m.velocity),
        torque=rows(JOINTS, len(names), lambda m: m.effort),
        base=rows(BASE, 7, _pose),
        base_velocity=rows(BASE, 6, _twist),
        q_ref=rows(SET_POINTS, len(names), lambda m: m.position),
        v_ref=rows(SET_POINTS, len(names), lambda m: m.velocity),
        com=rows(MASS_CENTER, 3, lambda m: _xyz(m.point)),
        foot_names=tuple(topics[one][0][3].header.frame_id.removesuffix(CONTACT) for one in feet),
        foot_force=read_only(np.stack(forces, axis=1)) if feet else None,  # type: ignore[arg-type]
        urdf=description[0][3].data if description else None,
        metadata=metadata,
    )


def _xyz(one: Any) -> tuple[float, float, float]:
    return one.x, one.y, one.z


def _pose(message: Any) -> tuple[float, ...]:
    pose = message.pose.pose
    return (*_xyz(pose.position), *_xyz(pose.orientation), pose.orientation.w)


def _twist(message: Any) -> tuple[float, ...]:
    twist = message.twist.twist
    return (*_xyz(twist.linear), *_xyz(twist.angular))
