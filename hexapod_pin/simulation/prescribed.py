"""Prescribed motion: which references joints can follow exactly, and where such a run starts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, StateError

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.robot.robot import Robot

START_TOLERANCE = 1e-9
"""How far the joints may be from their motion at the start [rad, rad/s]."""


def prescribed_start(
    robot: Robot, plan: JointTrajectory, start: Checkpoint, *, given: bool
) -> Checkpoint:
    """Return a start whose joints have the rates of their motion; one that is given must have them.

    Raises:
        ParameterError: set-points jump, or move at rates that jump: no torque does that.
        StateError: a joint of a given state does not start where its motion does.
    """
    if plan.kind in ("held", "linear") and len(plan.time) > 1:
        raise ParameterError(
            "Scene.prescribed", True, f"False with {plan.kind} set-points",
            "Joints follow a motion exactly where its rates are continuous: KinematicControl, "
            "ArcWalk, JointMotion, HoldPosture.",
        )  # fmt: skip
    angle, rate = motion_at(plan, start.time)
    if not given:
        return replace(start, v=np.concatenate([start.v[:6], rate]))
    _check_joints(robot, "angle", "rad", start.q[7:], angle, start.time)
    _check_joints(robot, "rate", "rad/s", start.v[6:], rate, start.time)
    return start


def _check_joints(
    robot: Robot, name: str, unit: str, here: Array, there: Array, time: float
) -> None:
    """Refuse joints that are not where their motion is at a time [s]."""
    off = np.abs(here - there)
    if off.size and off.max() > START_TOLERANCE:
        joint = int(off.argmax())
        raise StateError(
            f"initial {name} of {robot.joint_names[joint]} = {here[joint]:.9g} {unit}: its motion "
            f"has {there[joint]:.9g} {unit} at t = {time:g} s. With Scene.prescribed, start "
            "there, or leave `initial` out."
        )


def refuse_commands(prescribed: bool, what: str) -> None:
    """Refuse prescribed motion where set-points are not known before the run.

    Raises:
        ParameterError: joints are to follow commands exactly.
    """
    if prescribed:
        raise ParameterError(
            "Scene.prescribed", True, f"False {what}",
            "Commands jump at ticks; stiff servos follow them, nothing follows them exactly.",
        )  # fmt: skip


def motion_at(plan: JointTrajectory, time: float) -> tuple[Array, Array]:
    """Return angles [rad] and rates [rad/s] of a motion (n,), as the native core follows it."""
    from hexapod_pin import native

    last = int(np.clip(np.searchsorted(plan.time, time, side="right"), 1, len(plan.time) - 1))
    near = slice(max(0, last - 2), last + 2)
    curves = native_acceleration(plan)
    rows = native.set_points_at(
        time=plan.time[near].tolist(), position=plan.q[near], rate=plan.v[near], kind=plan.kind,
        acceleration=curves[near.start : near.stop - 1], at=float(time),
    )  # fmt: skip
    return rows[0], rows[1]


def native_acceleration(plan: JointTrajectory) -> Array:
    """Return the accelerations of quintic intervals as the core takes them (K - 1, 2 n)."""
    if plan.kind != "quintic" or plan.acceleration is None:
        return np.zeros((0, 0))
    flat: Array = np.ascontiguousarray(plan.acceleration.reshape(len(plan.time) - 1, -1))
    return flat
