"""Samples of a robot's motion, of its forces and energies, and what follows from them.

Besides those at regular times: samples on request, and the states of largest torques.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import NotRecordedError, ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import Column
from hexapod_pin.results.run_facts import ALWAYS, GROUP_OF, GROUPS, ON_REQUEST, USUAL
from hexapod_pin.results.schema import Record, quantity, require_known, schema

STATE_ENERGIES = ("kinetic", "potential", "elastic")
LOSSES = ("joint_damping_loss", "normal_loss", "friction_loss")
ENERGIES = (*STATE_ENERGIES, "servo_work", *LOSSES)

BASE_Q = ("base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw")
BASE_V = ("base_vx", "base_vy", "base_vz", "base_wx", "base_wy", "base_wz")

LATEST_SAMPLE = 1e10
"""Of a sample's time [s]: three centuries."""

UP = read_only((0.0, 0.0, 1.0))
"""The ground's normal where it is level."""


class JointNames(Immutable):
    """Base of results that have an axis of joints."""

    joint_names: tuple[str, ...]

    def joint(self, name: str) -> int:
        """Return the index of a joint; k in `torque[:, k]` is `v[:, 6 + k]` and `q[:, 7 + k]`.

        Raises:
            UnknownNameError: there is no such joint.
        """
        require_known("joint", name, self.joint_names)
        return self.joint_names.index(name)


class StateNames(JointNames):
    """Base of results that hold states (q, v)."""

    @property
    def q_names(self) -> tuple[str, ...]:
        """The names of the coordinates in a row of `q`."""
        return (*BASE_Q, *self.joint_names)

    @property
    def v_names(self) -> tuple[str, ...]:
        """The names of the velocities in a row of `v`."""
        return (*BASE_V, *self.joint_names)


class RequestedSamples(Record):  # noqa: PLW1641  # no record has a hash
    """T samples of F feet and n joints; what was not named is None, and not there.

    Attributes:
        count: T.
        joint_names: n names.
        foot_names: F names.

    Raises:
        ParameterError: an array has the wrong shape.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "joint": "joint_names", "foot": "foot_names"
    }  # fmt: skip

    count: int
    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    # fmt: off
    slip_speed: Array | None = quantity("time foot", "m/s",
        "speed of the contact point along the ground, 0 where the foot is not loaded",
        least=0.0, nan=False, default=None)
    current: Array | None = quantity("time joint", "A",
        "current of the motor: its torque over gear ratio and torque constant; NaN without them",
        default=None)
    temperature: Array | None = quantity("time joint", "deg C",
        "temperature of the motor's winding; NaN where its thermal constants are not known",
        default=None)
    # fmt: on

    def __post_init__(self) -> None:
        """Check shapes, and make read-only what is there."""
        for name in schema(RequestedSamples):
            if getattr(self, name) is None:
                vars(self).pop(name, None)
        super().__post_init__()

    def sizes(self) -> dict[str, int]:
        """Return the length of every axis."""
        return {"time": self.count, **super().sizes()}

    @property
    def arrays(self) -> dict[str, Array]:
        """What is there, by name."""
        return {name: vars(self)[name] for name in schema(RequestedSamples) if name in vars(self)}

    def sampled_columns(self) -> dict[str, Column]:
        """Return what is there as columns of the trace's file."""
        own = self.columns()
        return {name: own[name] for name in self.arrays}

    @classmethod
    def of(
        cls,
        arrays: Mapping[str, Any],
        joint_names: tuple[str, ...],
        foot_names: tuple[str, ...],
    ) -> RequestedSamples | None:
        """Return those among some arrays of a trace, by name; None where there are none."""
        found = {name: arrays[name] for name in schema(cls) if arrays.get(name) is not None}
        if not found:
            return None
        return cls(len(next(iter(found.values()))), joint_names, foot_names, **found)


class RobotSamples(Record, StateNames):  # noqa: PLW1641  # no record has a hash
    """The samples of a `Trace`: their arrays, and what follows from them."""

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "time": "time", "q_name": "q_names", "v_name": "v_names", "joint": "joint_names",
        "foot": "foot_names", "axis": ("x", "y", "z"),
    }  # fmt: skip

    # fmt: off
    time: Array = quantity("time", "s", "time since the start of the simulation",
        least=0.0, most=LATEST_SAMPLE, ascending=True, nan=False)
    q: Array = quantity("time q_name", "m, 1, rad",
        "base position in the world, quaternion xyzw, joints", unit_vector=(3, 7), nan=False)
    v: Array = quantity("time v_name", "m/s, rad/s",
        "base twist in body axes (linear, angular), joints", nan=False)
    torque: Array = quantity("time joint", "N m", "torque applied by the servos", nan=False)
    q_ref: Array = quantity("time joint", "rad", "joint angle set-points", nan=False)
    v_ref: Array = quantity("time joint", "rad/s", "joint rate set-points", nan=False)
    foot_position: Array = quantity("time foot axis", "m",
        "centres of the foot spheres, world axes", nan=False)
    foot_force: Array = quantity("time foot axis", "N",
        "force on the robot at the feet, world axes", nan=False)
    foot_gap: Array = quantity("time foot", "m",
        "lowest point of the foot to the ground, < 0 pressed in", nan=False)
    com: Array = quantity("time axis", "m", "centre of mass, world axes", nan=False)
    energy: Mapping[str, Array]
    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    foot_normal: Array = quantity("time foot axis", "1",
        "ground normal under the feet, world axes", unit_vector=(0, 3), nan=False,
        default_factory=lambda: UP)
    foot_impulse: Array | None = quantity("time foot axis", "N s",
        "of the foot forces since the sample before, world axes", nan=False, default=None)
    requested: RequestedSamples | None = None
    # fmt: on

    _may_be_none: ClassVar[Collection[str]] = [name for g in USUAL for name in GROUPS[g]]

    def __post_init__(self) -> None:
        """Check shapes, copy, and make read-only."""
        self._hold_forces()
        self._leave_out()
        if np.ndim(self.time) != 1 or not len(self.time):
            raise ParameterError("Trace.time", np.shape(self.time), "a 1-D array of >= 1 times [s]")
        if "contacts" in self.recorded and np.shape(self.foot_normal) == (3,):
            shape = (len(self.time), len(self.foot_names), 3)
            object.__setattr__(self, "foot_normal", np.broadcast_to(self.foot_normal, shape))
        super().__post_init__()
        if "energy" in self.recorded:
            object.__setattr__(self, "energy", self._frozen_energy())
        if self.requested is not None and self.requested.count != len(self.time):
            raise ParameterError("Trace.requested", self.requested.count, "one row per sample")
        if np.any(np.diff(self.time) <= 0.0) or not np.all(np.isfinite(self.time)):
            raise ParameterError("Trace.time", self.time, "finite and strictly increasing [s]")

    def _hold_forces(self) -> None:
        """Take impulses that are not given from the forces at the samples."""
        if self.foot_impulse is not None or self.foot_force is None:
            return
        if np.ndim(self.foot_force) != 3 or len(self.foot_force) != np.size(self.time):
            return  # the check of shapes reports it
        interval = np.diff(self.time, prepend=self.time[0])
        object.__setattr__(self, "foot_impulse", interval[:, None, None] * self.foot_force)

    def _leave_out(self) -> None:
        """Take away the arrays that are None: a group is there as a whole, or not at all."""
        for group, arrays in GROUPS.items():
            if group in ON_REQUEST:
                continue
            given = [name for name in arrays if getattr(self, name) is not None]
            if "foot_normal" in given and given == ["foot_normal"]:
                given = []  # its default is no sample
            missing = [name for name in arrays if name not in given]
            if missing and (given or group == ALWAYS):
                raise ParameterError(f"Trace.{missing[0]}", None, f"given with {group}")
            for name in missing:
                object.__delattr__(self, name)

    if not TYPE_CHECKING:  # with it, a type checker would take any name for granted

        def __getattr__(self, name: str) -> Any:
            """Refuse what was not recorded, naming what to record."""
            if name not in GROUP_OF:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            needed = {*self.recorded, GROUP_OF[name]} - {ALWAYS}
            raise NotRecordedError(name, [group for group in GROUPS if group in needed])

    @property
    def recorded(self) -> tuple[str, ...]:
        """The groups of arrays that it holds: "motion", and of the others what was recorded."""
        recorded = {**vars(self), **({} if self.requested is None else self.requested.arrays)}
        return tuple(group for group, arrays in GROUPS.items() if arrays[0] in recorded)

    def _frozen_energy(self) -> Mapping[str, Array]:
        """Return the energies, checked and read-only."""
        missing = [name for name in ENERGIES if name not in self.energy]
        if missing:
            raise ParameterError("Trace.energy", sorted(self.energy), f"given with {missing} [J]")
        shape = (len(self.time),)
        stored = {name: read_only(values) for name, values in self.energy.items()}
        for name, values in stored.items():
            if values.shape != shape:
                place = f"Trace.energy[{name!r}]"
                raise ParameterError(place, values.shape, f"an array of shape {shape}")
        return MappingProxyType(stored)

    def foot(self, name: str) -> int:
        """Return the index of a foot.

        Raises:
            UnknownNameError: there is no such foot.
        """
        require_known("foot", name, self.foot_names)
        return self.foot_names.index(name)

    def _requested(self, name: str) -> Array:
        """Return samples that are recorded only where they are named.

        Raises:
            NotRecordedError: they were not.
        """
        found = {} if self.requested is None else self.requested.arrays
        if name not in found:
            needed = {*self.recorded, GROUP_OF[name]} - {ALWAYS}
            raise NotRecordedError(name, [group for group in GROUPS if group in needed])
        return found[name]

    @property
    def slip_speed(self) -> Array:
        """(T, F) [m/s]: speed of the contact point along the ground; 0 of a foot without load."""
        return self._requested("slip_speed")

    @property
    def current(self) -> Array:
        """(T, n) [A]: of the motors, their torque over gear ratio and torque constant."""
        return self._requested("current")

    @property
    def temperature(self) -> Array:
        """(T, n) [deg C]: of the motors' windings."""
        return self._requested("temperature")

    @property
    def normal_force(self) -> Array:
        """(T, F) [N]: the part of each foot force along the ground's normal, > 0 pushing up."""
        force: Array = np.einsum("tfi,tfi->tf", self.foot_force, self.foot_normal)
        return force

    @property
    def tangential_force(self) -> Array:
        """(T, F, 3) [N]: the part of each foot force within the ground, world axes."""
        along: Array = self.normal_force[..., None] * self.foot_normal
        return self.foot_force - along

    @property
    def mean_foot_force(self) -> Array:
        """(T, F, 3) [N]: mean since the sample before, world axes; at the first sample, the force.

        What a change of momentum over an interval needs: m g plus the sum over feet, times the
        interval, is the change of linear momentum.
        """
        if self.foot_impulse is None:  # pragma: no cover  # a trace with contacts has impulses
            raise NotRecordedError("foot_impulse", list(self.recorded))
        mean: Array = np.array(self.foot_force)
        mean[1:] = self.foot_impulse[1:] / np.diff(self.time)[:, None, None]
        return mean

    @property
    def contact(self) -> npt.NDArray[np.bool_]:
        """(T, F): whether the ground pushes on the foot."""
        return self.normal_force > 0.0

    @property
    def energy_residual(self) -> Array:
        """(T,) [J]: stored energy gained, less work done on the robot, plus losses; ideally 0."""
        stored = sum((self.energy[name] for name in STATE_ENERGIES), np.zeros(len(self.time)))
        lost = sum((self.energy[name] for name in LOSSES), np.zeros(len(self.time)))
        work = self.energy["servo_work"] + self.energy.get("push_work", 0.0)
        residual: Array = stored - stored[0] - work + lost
        return residual


# The states of a run in which the torques of its joints are largest, between samples or at one.


PREFIX = "peak_"
"""Begins the names of these arrays among those of a trace."""


class PeakStates(Record, StateNames):  # noqa: PLW1641  # no record has a hash
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
