"""The states of a run in which the torques of its joints are largest, between samples or at one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.results.result_files import Column
from hexapod_pin.results.samples import BASE_Q, BASE_V, StateNames
from hexapod_pin.results.schema import Record, quantity, schema

PREFIX = "peak_"
"""Begins the names of these arrays among those of a trace."""


class PeakStates(StateNames, Record):  # noqa: PLW1641  # no record has a hash
    """The state at the instant of each joint's `Summary.torque_peak`: n peaks, n joints, F feet.

    Peaks are those of integration steps, which may lie between two samples. Without a whole cycle
    in the window of the summary all is NaN. Where a peak is at an edge of that window between two
    steps, the state is interpolated linearly, as the torque is.

    Attributes:
        joint_names: n names: of the peaks, and of the joints.
        foot_names: F names of the feet (and of the trunk's contact points, where it has any).

    Raises:
        ParameterError: an array has the wrong shape.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "peak": "joint_names", "q_name": "q_names", "v_name": "v_names", "joint": "joint_names",
        "foot": "foot_names", "axis": ("x", "y", "z"),
    }  # fmt: skip

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    # fmt: off
    time: Array = quantity("peak", "s", "time of the joint's largest torque", least=0.0)
    q: Array = quantity("peak q_name", "m, 1, rad",
        "base position in the world, quaternion xyzw, joints, at that time")
    v: Array = quantity("peak v_name", "m/s, rad/s",
        "base twist in body axes (linear, angular), joints, at that time")
    torque: Array = quantity("peak joint", "N m", "torques of all joints at that time")
    foot_force: Array = quantity("peak foot axis", "N",
        "force on the robot at the feet, world axes, at that time")
    # fmt: on

    @property
    def prefixed(self) -> dict[str, Array]:
        """The arrays by their names among those of a trace."""
        return {PREFIX + name: getattr(self, name) for name in schema(PeakStates)}

    def prefixed_columns(self) -> dict[str, Column]:
        """Return the arrays as columns of a trace's file, and the labels of the peaks."""
        own = self.columns()
        named = {PREFIX + name: own[name] for name in schema(PeakStates)}
        return {"peak": own["peak"], **named}

    @classmethod
    def of_rows(
        cls, rows: Array, joint_names: tuple[str, ...], foot_names: tuple[str, ...]
    ) -> PeakStates | None:
        """Return the states that the core gives; None where it has kept none.

        Args:
            rows: time, q, v, torques and foot forces of each peak. Shape (n, 14 + 3 n + 3 F).
            joint_names: n names.
            foot_names: F names.
        """
        joints = len(joint_names)
        if not joints or len(rows) != joints:
            return None
        widths = (1, len(BASE_Q) + joints, len(BASE_V) + joints, joints)
        time, q, v, torque, force = np.split(rows, np.cumsum(widths), axis=1)
        force = force.reshape(joints, len(foot_names), 3)
        return cls(joint_names, foot_names, time[:, 0], q, v, torque, force)

    @classmethod
    def of_arrays(
        cls,
        arrays: Mapping[str, Any],
        joint_names: tuple[str, ...],
        foot_names: tuple[str, ...],
    ) -> PeakStates | None:
        """Return the states among the arrays of a trace's file; None where it has none."""
        if PREFIX + "time" not in arrays:
            return None
        found = {name: arrays[PREFIX + name] for name in schema(PeakStates)}
        return cls(joint_names, foot_names, **found)
