"""The moment across every joint of a trace: about its axis, and in all (the joint's reaction).

The motor delivers the part about the joint's axis; bearings carry the rest. [S2]'s figure 6 shows
one of the two without naming it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, protect
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.samples import JointNames
from hexapod_pin.results.stability_margins import at_middles, contact_points
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.results.trace import Trace

if TYPE_CHECKING:
    import pinocchio as pin

Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class JointMoments(JointNames):
    """Moments at the joints, means over K sampling intervals; n joints.

    A trace's foot forces are means over the interval that ends at their sample. So the equations of
    motion are taken in its middle: accelerations are the change of the velocities over it, and
    positions and velocities are half-way. They hold to second order in the interval; inside a
    touch-down that is shorter than it, to first.

    Attributes:
        joint_names: n names.
        time: middle of each interval [s]. Shape (K,).
        ends: sample at which each interval ends, as index in the trace. Shape (K,).
        moment_vector: on the link beyond the joint, about the joint's origin, in the axes of the
            frame that the joint moves [N m]. Shape (K, n, 3).
        axis_torque: the part of it about the joint's axis [N m]. Shape (K, n). It is what the links
            need; the motor gives it and also turns its rotor and overcomes the joint's friction.
        motor_torque: `trace.torque`, mean of the interval's ends [N m]. Shape (K, n).
        axis_residual: motor_torque less viscous damping and the rotor's inertia, less axis_torque
            [N m]. Shape (K, n). Left are discretisation, dry friction, and joint stops.
        base_residual: force and moment, trunk axes, that the trunk would need besides its feet and
            the pushes [N, N m]; ideally 0. Shape (K, 6).
    """

    joint_names: tuple[str, ...]
    time: Array = field(repr=False)
    ends: Indices = field(repr=False)
    moment_vector: Array = field(repr=False)
    axis_torque: Array = field(repr=False)
    motor_torque: Array = field(repr=False)
    axis_residual: Array = field(repr=False)
    base_residual: Array = field(repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        protect(self)

    @cached_property
    def moment(self) -> Array:
        """(K, n) [N m]: size of the total moment, never below |axis_torque|."""
        size: Array = np.linalg.norm(self.moment_vector, axis=-1)
        return size

    @property
    def agreement(self) -> float:
        """RMS of `axis_residual` over the RMS of `motor_torque`, all joints and intervals [-]."""
        return float(np.linalg.norm(self.axis_residual) / np.linalg.norm(self.motor_torque))


@checked
def joint_moments(trace: Trace, *, whole: bool = False) -> JointMoments:
    """Return the moments across the joints of a trace.

    Recursive Newton-Euler (Pinocchio) on the motion of the trace, with the feet's forces at their
    contact points, and the scene's pushes, as external forces.

    Args:
        trace: of a run; must hold its URDF.
        whole: all intervals instead of those in the window of `torque_budget`.

    Raises:
        ParameterError: the robot cannot be built again from `trace.run`, or the run is too short.

    Example:
        >>> moments = joint_moments(trace)
        >>> moments.moment.max(axis=0) / abs(moments.axis_torque).max(axis=0)
    """
    window = slice(0, len(trace.time)) if whole else steady_window(trace).samples
    ends = np.arange(window.start + 1, window.stop)
    if not ends.size:
        raise ParameterError("trace.time", len(trace.time), "two samples or more")
    robot = RecordedRobot.of(trace)
    base, axis, vector = _newton_euler(robot, trace, ends)
    step = (trace.time[ends] - trace.time[ends - 1])[:, None]
    rate, before = trace.v[ends, 6:], trace.v[ends - 1, 6:]
    motor = 0.5 * (trace.torque[ends] + trace.torque[ends - 1])
    link_side = motor - robot.damping * 0.5 * (rate + before)
    link_side -= robot.armature * (rate - before) / step
    time = 0.5 * (trace.time[ends] + trace.time[ends - 1])
    return JointMoments(
        trace.joint_names, time, ends, vector, axis, motor, link_side - axis, base
    )  # fmt: skip


def _newton_euler(robot: RecordedRobot, trace: Trace, ends: Indices) -> tuple[Array, Array, Array]:
    """Return what base (K, 6) and axes (K, n) need, and the joints' moments (K, n, 3)."""
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    place = sorted((model.joints[j].idx_v - 6, j) for j in range(2, model.njoints))
    before = ends - 1
    step = (trace.time[ends] - trace.time[before])[:, None]
    v, a = 0.5 * (trace.v[before] + trace.v[ends]), (trace.v[ends] - trace.v[before]) / step
    force = trace.mean_foot_force[ends]
    wrench = np.concatenate([force, np.cross(at_middles(contact_points(trace))[ends], force)], 2)
    generalised = np.empty((len(ends), model.nv))
    vector = np.empty((len(ends), model.nv - 6, 3))
    for row, k in enumerate(ends):
        q = pin.interpolate(model, trace.q[k - 1], trace.q[k], 0.5)
        pin.forwardKinematics(model, data, q)
        external = pin.StdVec_Force([pin.Force.Zero()] * model.njoints)
        for contact in np.flatnonzero(force[row].any(axis=1)):
            joint = robot.contact_joints[contact]
            external[joint] += data.oMi[joint].actInv(pin.Force(wrench[row, contact]))
        _add_pushes(robot, data, (trace.time[k - 1], trace.time[k]), external)
        generalised[row] = pin.rnea(model, data, q, v[row], a[row], external)
        for j, joint in place:
            vector[row, j] = data.f[joint].angular
    return generalised[:, :6], generalised[:, 6:], vector


def _add_pushes(
    robot: RecordedRobot, data: pin.Data, span: tuple[float, float], external: Any
) -> None:
    """Add the mean wrenches of the pushes over a span of time to the forces on the bodies."""
    import pinocchio as pin

    for push in robot.pushes:
        lasted = min(push.end, span[1]) - max(push.start, span[0])
        if lasted > 0.0:
            placement = data.oMi[push.joint]
            about_origin = push.torque + np.cross(placement.act(push.point), push.force)
            share = lasted / (span[1] - span[0])
            wrench = pin.Force(share * push.force, share * about_origin)
            external[push.joint] += placement.actInv(wrench)
