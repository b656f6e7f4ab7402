"""A gait or a run as a trajectory for the joint_trajectory_controller of ROS 2."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.control.walk_plan import WalkPlan
from hexapod_pin.errors import ParameterError
from hexapod_pin.foreign_text import visible
from hexapod_pin.interchange.joint_samples import JointSamples, joint_samples
from hexapod_pin.interchange.ros_messages import MCAP, NANO, header, stamp, write_messages
from hexapod_pin.results.result_files import check_ending
from hexapod_pin.results.trace import Trace

YAML = (".yaml", ".yml")

TOPIC = "/joint_trajectory_controller/joint_trajectory"
"""Where the controller of that name listens."""

MOST_DEVIATION = 2.0 * np.pi / 4096
"""Of the controller's cubics from the motion between samples: a tick of a 12-bit servo [rad]."""

REST = 1e-9
"""Largest rate at the end of a motion that is at rest there [rad/s]."""


@checked
def write_joint_trajectory(
    source: WalkPlan | Trace,
    path: str | Path,
    *,
    rate: float = 50.0,
    duration: float | None = None,
    lead_in: float = 2.0,
) -> Path:
    """Write the set-points of a gait or of a run as a trajectory_msgs/JointTrajectory.

    In YAML, as `ros2 topic pub` takes it, or in MCAP, as `ros2 bag play` sends it. Each point has
    positions, rates and `time_from_start`; the joint_trajectory_controller joins them by cubics.
    Accelerations are left out: those of a gait jump where feet lift and touch down, and with them
    the controller would join points by quintics. The motion must end at rest, as the controller
    requires; a plan's does.

    Args:
        source: plan of a gait, which is walked from standing to standing, or a run, whose
            set-points are written.
        path: ends in .yaml, .yml or .mcap.
        rate: points in a second [1/s].
        duration: of the motion [s]; None: ten cycles of a plan, the whole of a run.
        lead_in: time before the first point, in which the controller moves the joints from where
            they are [s].

    Raises:
        ParameterError: an argument out of range, a motion that is not at rest at its end, or a rate
            too low for the motion.
        JointRangeError: the motion leaves the joint or speed limits of the robot's URDF, between
            the points too; it names joint, time, value and range.
        GaitError: the robot cannot walk the gait.
        NotRecordedError: the run recorded no set-points.
        TraceFileError: another ending, or the file cannot be written; the old one is intact.
        MissingPackageError: the packages for MCAP are not installed.

    Example:
        >>> plan = hp.motion.WalkPlan(robot, hp.Gait.tripod(stroke=0.06, cycle_time=1.2))
        >>> hp.interchange.write_joint_trajectory(plan, "gait.yaml", rate=50, duration=12)
    """
    ending = check_ending(path, YAML + MCAP)
    if not 0.0 <= lead_in <= 3600.0:
        raise ParameterError("write_joint_trajectory.lead_in", lead_in, "0 to 3600 s")
    samples = joint_samples(source, rate, duration, "write_joint_trajectory")
    _require_rest(samples)
    _require_dense(samples, rate)
    samples.require_limits()
    times = [round((lead_in + t) * NANO) for t in samples.time.tolist()]
    if ending in YAML:
        return write_atomically(path, _yaml(samples, times))
    points = [
        {
            "positions": q,
            "velocities": v,
            "accelerations": [],
            "effort": [],
            "time_from_start": stamp(at),
        }
        for q, v, at in zip(samples.q.tolist(), samples.v.tolist(), times, strict=True)
    ]
    names = list(samples.robot.joint_names)
    message = {"header": header(0), "joint_names": names, "points": points}
    sent = [(TOPIC, "trajectory_msgs/JointTrajectory", 0, message)]
    return write_messages(path, sent, {"motion": samples.what})


def _require_rest(samples: JointSamples) -> None:
    """Refuse a motion that goes on where it ends: the controller would reject it."""
    j = int(np.argmax(np.abs(samples.v[-1])))
    if abs(samples.v[-1, j]) > REST:
        raise ParameterError(
            f"write_joint_trajectory.source[{samples.robot.joint_names[j]}]",
            float(samples.v[-1, j]),
            f"at rest at its end, t = {samples.time[-1]:.4g} s [rad/s]",
            "Let the walk stop: hp.KinematicControl(gait, stop_at=...); or give a WalkPlan.",
        )


def _require_dense(samples: JointSamples, rate: float) -> None:
    """Refuse points too far apart for the cubics between them to follow the motion."""
    error = samples.interpolation_error
    worst = float(error.max())
    if worst > MOST_DEVIATION:
        k, j = np.unravel_index(int(np.argmax(error)), error.shape)
        raise ParameterError(
            "write_joint_trajectory.rate",
            rate,
            f"such that cubics stay within {MOST_DEVIATION:.2g} rad of the motion",
            f"{samples.robot.joint_names[int(j)]} is off by {worst:.2g} rad at "
            f"t = {samples.time[int(k)]:.4g} s; try {2.0 * rate:g} points in a second.",
        )


def _yaml(samples: JointSamples, times: list[int]) -> str:
    """Return the message as YAML that readers of versions 1.1 and 1.2 read alike."""
    joints = ", ".join(json.dumps(name) for name in samples.robot.joint_names)
    lines = [
        "# trajectory_msgs/msg/JointTrajectory: positions [rad], velocities [rad/s].",
        f"# {visible(samples.what)}".replace("\n", " "),
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"joint_names: [{joints}]",
        "points:",
    ]
    for q, v, at in zip(samples.q.tolist(), samples.v.tolist(), times, strict=True):
        since = stamp(at)
        lines += [
            f"- positions: [{', '.join(map(_number, q))}]",
            f"  velocities: [{', '.join(map(_number, v))}]",
            f"  time_from_start: {{sec: {since['sec']}, nanosec: {since['nanosec']}}}",
        ]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """Return the shortest text of a double; YAML 1.1 takes 1e-05, without a point, for a word."""
    text = repr(value)
    mantissa, mark, exponent = text.partition("e")
    return f"{mantissa}.0e{exponent}" if mark and "." not in mantissa else text
