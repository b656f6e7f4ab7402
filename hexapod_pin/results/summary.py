"""A summary holds the numbers of a run over whole gait cycles, without samples.

Gathered by the native core at every accepted step, so that peaks do not depend on the sampling.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.file_schema import Bound, FileData, Name, check_data
from hexapod_pin.results.result_files import JSON, check_ending, require_schema, without_non_finite
from hexapod_pin.results.run_record import Event, JointLimits, RunRecord
from hexapod_pin.results.schema import (
    Record,
    from_plain,
    known_quantity,
    plain,
    quantity,
    schema,
)
from hexapod_pin.robot.rotations import yawed
from hexapod_pin.user_file import TEXT_BYTES, read_bytes, reason_of

FILE = ("hexapod_pin.summary", 1)
"""Schema of the file, and its version."""

MOST_STATES = 10**15

FRACTION = 1.0 + 1e-9
"""Largest fraction of a time: the sum of its parts is rounded."""


class Summary(Record):  # noqa: PLW1641  # no record has a hash
    """A run in numbers: n joints, F feet; SI units, radians. Two are equal when every bit is.

    "Per cycle": over the whole cycles of the window, divided by their number; the whole window
    where nothing repeats. Numbers of a run without a whole cycle are NaN. Quantities of largest
    size have their sign. Times of peaks have no error: of two peaks of the same height either may
    be found.

    Attributes:
        joint_names: n names.
        foot_names: F names of the feet (and of the trunk's contact points, where it has any).
        cycles: whole gait cycles in the window; None where nothing repeats.
        states: accepted states of the whole run.
        counters: steps, evaluations, ...
        run: what was run.
        errors: errors of the quantities for the run's own error, by name; see `error_of`.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "joint": "joint_names",
        "foot": "foot_names",
        "axis": ("x", "y", "z"),
        "path_column": ("time", "x", "y", "yaw"),
    }

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    cycles: int | None
    states: int
    # fmt: off
    window_time: float = quantity("", "s", "length of the window", least=0.0)
    torque_peak: Array = quantity("joint", "N m", "torque of largest size")
    torque_peak_time: Array = quantity("joint", "s", "time of torque_peak", error=False)
    torque_p99: Array = quantity("joint", "N m",
        "size of torque not exceeded for 99 % of the time, to 1 %", least=0.0)
    torque_rms: Array = quantity("joint", "N m", "RMS torque", least=0.0)
    at_limit: Array = quantity("joint", "1",
        "fraction of time at the limit: effort, or the motor's at that speed",
        least=0.0, most=FRACTION)
    limit_use: Array = quantity("joint", "1",
        "largest torque over that limit (stall torque in braking); 0 without one", least=0.0)
    speed_peak: Array = quantity("joint", "rad/s", "rate of largest size")
    speed_peak_time: Array = quantity("joint", "s", "time of speed_peak", error=False)
    speed_rms: Array = quantity("joint", "rad/s", "RMS rate", least=0.0)
    acceleration_rms: Array = quantity("joint", "rad/s^2",
        "RMS acceleration, from changes of rate", least=0.0)
    torque_acceleration: Array = quantity("joint", "N m rad/s^2",
        "mean of torque times acceleration")
    power_peak: Array = quantity("joint", "W", "torque times rate of largest size")
    power_peak_time: Array = quantity("joint", "s", "time of power_peak", error=False)
    driving_power_peak: Array = quantity("joint", "W", "largest torque times rate, given")
    braking_power_peak: Array = quantity("joint", "W", "largest torque times rate, taken up")
    positive_energy: Array = quantity("joint", "J",
        "work done by the joint per cycle", least=0.0)
    negative_energy: Array = quantity("joint", "J",
        "work absorbed by the joint per cycle, not positive")
    angle_min: Array = quantity("joint", "rad", "smallest angle")
    angle_max: Array = quantity("joint", "rad", "largest angle")
    outside_torque: Array = quantity("joint", "N m",
        "torque of largest size before and after the window")
    outside_torque_time: Array = quantity("joint", "s", "time of outside_torque", error=False)
    force_peak: Array = quantity("foot", "N", "largest normal force")
    force_peak_time: Array = quantity("foot", "s", "time of force_peak", error=False)
    normal_impulse: Array = quantity("foot", "N s", "impulse of the normal force per cycle")
    impulse: Array = quantity("foot axis", "N s",
        "impulse of the force on the robot per cycle, world axes")
    slip_distance: Array = quantity("foot", "m",
        "sliding distance of the contact point, while loaded, per cycle", least=0.0)
    loaded_time: Array = quantity("foot", "s", "time on the ground per cycle", least=0.0)
    friction_work: Array = quantity("foot", "J",
        "integral of |friction force . slip velocity| per cycle", least=0.0)
    outside_force: Array = quantity("foot", "N", "largest normal force before and after the window")
    outside_force_time: Array = quantity("foot", "s", "time of outside_force", error=False)
    height_min: float = quantity("", "m", "smallest height of the trunk's origin")
    height_max: float = quantity("", "m", "largest height of the trunk")
    height_mean: float = quantity("", "m", "mean height of the trunk")
    height_rms: float = quantity("", "m", "RMS height of the trunk about its mean", least=0.0)
    heave_rms: float = quantity("", "m",
        "RMS height of the trunk about its best straight line in time", least=0.0)
    roll_mean: float = quantity("", "rad", "mean roll of the trunk, of Rz(yaw) Ry(pitch) Rx(roll)")
    roll_rms: float = quantity("", "rad", "RMS roll", least=0.0)
    roll_peak: float = quantity("", "rad", "roll of largest size")
    pitch_mean: float = quantity("", "rad", "mean pitch")
    pitch_rms: float = quantity("", "rad", "RMS pitch", least=0.0)
    pitch_peak: float = quantity("", "rad", "pitch of largest size")
    roll_rate_rms: float = quantity("", "rad/s",
        "RMS angular velocity about the trunk's x axis", least=0.0)
    pitch_rate_rms: float = quantity("", "rad/s",
        "RMS angular velocity about the trunk's y axis", least=0.0)
    vertical_acceleration_rms: float = quantity("", "m/s^2",
        "RMS vertical acceleration of the trunk's origin", least=0.0)
    path: Array = quantity("edge path_column", "s, m, m, rad",
        "time, centre of mass, yaw of the trunk at half cycles, or both ends",
        error=False, nan=False, ascending="weakly")
    first_yaw: float = quantity("", "rad", "yaw at the start of the run", error=False)
    # fmt: on
    counters: Mapping[str, int | float]
    run: RunRecord
    errors: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        super().__post_init__()
        errors = {
            name: read_only(one) if schema(Summary)[name].axes else one
            for name, one in self.errors.items()
        }
        for name, values in (("counters", dict(self.counters)), ("errors", errors)):
            object.__setattr__(self, name, MappingProxyType(values))

    @classmethod
    def from_data(
        cls,
        data: Mapping[str, Any],
        joint_names: tuple[str, ...],
        foot_names: tuple[str, ...],
        counters: Mapping[str, int | float],
        run: RunRecord,
        errors: Mapping[str, Any] | None = None,
        where: tuple[str, str] = ("data", "errors"),
    ) -> Summary:
        """Return the summary of `Summary.data`, or of what the core gathered.

        What is missing or None is NaN. `where`: names of data and errors, for messages.

        Raises:
            ParameterError: a number breaks its rule, or there are too many or too few.
        """
        sizes = {"joint": len(joint_names), "foot": len(foot_names), "axis": 3, "path_column": 4}
        for name in ("cycles", "states"):
            _require_count(f"{where[0]}.{name}", data.get(name), optional=name == "cycles")
        values = from_plain(cls, data, sizes, where=where[0])
        if values["window_time"] and len(values["path"]) > 1:
            _require_known(values, where[0])
        return cls(
            joint_names, foot_names, data["cycles"], int(data["states"]), **values,
            counters=counters, run=run,
            errors=from_plain(cls, errors or {}, sizes, where=where[1], errors=True),
        )  # fmt: skip

    @property
    def data(self) -> dict[str, Any]:
        """All numbers as JSON-able data, NaN as None; every digit is written."""
        return {"cycles": self.cycles, "states": self.states, **plain(self)}

    @property
    def plain_errors(self) -> dict[str, Any]:
        """The errors as JSON-able data, NaN as None."""
        return {name: without_non_finite(error) for name, error in self.errors.items()}

    def __eq__(self, other: object) -> bool:
        """Tell whether all numbers, names and entries are the same."""
        return isinstance(other, Summary) and self.to_json() == other.to_json()

    @property
    def error_estimate(self) -> float:
        """How far any position at any sample may be off [m and rad], as `Trace.error_estimate`."""
        known = self.run.numerics.error_estimate
        return float("nan") if known is None else known

    @property
    def accuracy_kept(self) -> bool:
        """Whether the error estimated is within the accuracy requested, as of `Trace`."""
        return self.run.numerics.accuracy_kept

    def error_of(self, name: str) -> Array:
        """Return how far a number may be off for the run's own error, in its unit and shape.

        From another resolution of the same run: errors of the model are not in it. NaN where it is
        not known.

        Raises:
            UnknownNameError: there is no such number.
        """
        known_quantity(Summary, name)
        known = self.errors.get(name)
        value = np.full(np.shape(getattr(self, name)), np.nan) if known is None else known
        return np.asarray(value, dtype=float)

    @property
    def start(self) -> float:
        """Start of the window [s]; NaN where there is none."""
        return float(self.path[0, 0]) if len(self.path) else float("nan")

    @property
    def end(self) -> float:
        """End of the window [s]; NaN where there is none."""
        return float(self.path[-1, 0]) if len(self.path) else float("nan")

    @property
    def distance(self) -> float | None:
        """Distance of the centre of mass per cycle along the heading [m]; None without cycles."""
        if not self.cycles:
            return None
        along = np.array(self.run.walk.travel_direction)
        return distance_per_cycle(self.path[:, 1:3], self.path[:, 3] - self.first_yaw, along)

    @property
    def measured_speed(self) -> float | None:
        """Distance per time [m/s]; None without cycles."""
        distance = self.distance
        return None if distance is None else distance * (self.cycles or 1) / self.window_time

    @property
    def measured_turn_rate(self) -> float | None:
        """Mean yaw rate over the window [rad/s], left > 0; None without cycles."""
        if not self.cycles:
            return None
        return float(np.unwrap(self.path[:, 3])[[0, -1]] @ [-1.0, 1.0]) / self.window_time

    @property
    def torque_margin(self) -> Array:
        """(n,) [N m]: torque limit at standstill less the largest torque of the whole run."""
        limit = self.run.robot.effort(len(self.joint_names))
        return np.asarray(limit - np.fmax(np.abs(self.torque_peak), np.abs(self.outside_torque)))

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened, in the order of time, as `Trace.events`."""
        return self.run.events

    @property
    def limits(self) -> tuple[JointLimits, ...]:
        """How often and how long each joint was at its torque limit, as `Trace.limits`."""
        return self.run.limits or ()

    @property
    def case_toml(self) -> str:
        """The case that was run, as TOML text; see `Trace.case_toml`."""
        return self.run.case_toml

    def to_json(self) -> str:
        """Return everything as JSON text."""
        return json.dumps(
            {
                "schema": FILE[0],
                "schema_version": FILE[1],
                "joint_names": list(self.joint_names),
                "foot_names": list(self.foot_names),
                "data": self.data,
                "counters": without_non_finite(dict(self.counters)),
                "errors": self.plain_errors,
                "run": without_non_finite(self.run.to_dict()),
                "case": self.run.case.to_toml(),
            },
            allow_nan=False,
        )

    def save(self, path: str | Path) -> Path:
        """Write a JSON file, wholly or not at all, and return its path.

        Raises:
            TraceFileError: the file cannot be written.
        """
        check_ending(path, JSON)
        return write_atomically(path, self.to_json().encode())


@checked
def load_summary(path: str | Path) -> Summary:
    """Read a summary that `Summary.save` wrote; equal to it.

    Raises:
        TraceFileError: the file is missing, damaged, of another kind or of a newer schema.
    """
    try:
        found = json.loads(read_bytes(path, TEXT_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise TraceFileError(f"{path}: cannot be read as JSON ({reason_of(error)}).") from error
    require_schema(str(path), found if isinstance(found, dict) else {}, FILE)
    try:
        joints, feet = _checked_file(found)
        run = RunRecord.from_dict(found["run"], found["case"], joint=len(joints), foot=len(feet))
        return Summary.from_data(
            found["data"], joints, feet, found["counters"], run, found["errors"]
        )
    except ParameterError as error:
        raise TraceFileError(f"{path}: {error}") from error


class SummaryFile(FileData):
    """The file of a summary; what depends on the number of joints is checked after its names."""

    joint_names: list[Name]
    foot_names: list[Name]
    data: dict[str, Any]
    errors: dict[str, Any]
    counters: dict[str, Any]
    run: dict[str, Any]
    case: str


class SummaryCounters(FileData):
    """`Summary.counters` in a file, where None stands for what is not finite."""

    __pydantic_extra__: dict[str, Bound | None]


def _checked_file(found: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of joints and feet in a summary's file, all but the numbers checked.

    Raises:
        ParameterError: an entry is missing or breaks its rule.
    """
    check_data(SummaryFile, "summary", found)
    joints, feet = tuple(found["joint_names"]), tuple(found["foot_names"])
    for name, names in (("joint_names", joints), ("foot_names", feet)):
        if len(set(names)) < len(names):
            raise ParameterError(name, list(names), "there once each")
    check_data(SummaryCounters, "counters", found["counters"])
    return joints, feet


def _require_count(name: str, value: Any, *, optional: bool) -> None:
    if optional and value is None:
        return
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_STATES:
        raise ParameterError(name, value, f"a whole number from 0 to {MOST_STATES:g}")


def _require_known(values: Mapping[str, Any], where: str) -> None:
    """Refuse numbers of joints and feet over whole cycles that are not known."""
    for name, one in schema(Summary).items():
        inside = one.axes in (("joint",), ("foot",)) and not name.startswith("outside")
        if inside and np.isnan(values[name]).any():
            raise ParameterError(f"{where}.{name}", None, "known: the window has whole cycles")


# How far a walk comes along its heading.


def distance_per_cycle(place: Array, turn: Array, along: Array) -> float:
    """Return the mean distance per cycle along the heading [m].

    The heading is the direction of travel at the start, turned with the trunk's yaw; the
    displacement of each cycle is projected on the heading at its middle: turning gaits count too.

    Args:
        place: centre of mass at the edges and middles of the cycles [m]. Shape (2 cycles + 1, 2).
        turn: yaw of the trunk there, less that at the start [rad]. Shape (2 cycles + 1,).
        along: unit vector of travel at the start. Shape (2,).
    """
    steps, middle = np.diff(place[::2], axis=0), turn[1::2]
    return float(np.mean(np.sum(steps * yawed(along, middle), axis=1)))


def path_error(
    edges: Array, along: Array, *, first_yaw: float, speed: float, turn_rate: float
) -> tuple[float, float]:
    """Return how far a walk strays from its plan: RMS lateral distance [m], yaw error [rad].

    The planned path starts at the first edge. A straight one keeps the heading of the run's start;
    an arc, of radius speed / turn rate, starts with the heading that the trunk has there, because
    the yaw of a walk's first, slower cycles is not known here. The yaw error is of the last edge.

    Args:
        edges: time [s], x and y of the centre of mass [m], yaw [rad] at the edges of the cycles.
            Shape (cycles + 1, 4).
        along: unit vector of travel at the start of the run, with the trunk at `first_yaw`. (2,).
        first_yaw: yaw at the start of the run [rad].
        speed: planned [m/s].
        turn_rate: planned yaw rate [rad/s], left > 0.
    """
    time, yaw = edges[:, 0] - edges[0, 0], np.unwrap(edges[:, 3])
    begin = first_yaw if turn_rate == 0.0 else yaw[0]
    cos, sin = np.cos(begin - first_yaw), np.sin(begin - first_yaw)
    heading = np.array([cos * along[0] - sin * along[1], sin * along[0] + cos * along[1]])
    left, place = np.array([-heading[1], heading[0]]), edges[:, 1:3] - edges[0, 1:3]
    if turn_rate == 0.0:
        aside = place @ left
    else:
        radius = speed / turn_rate  # > 0: the centre lies to the left
        away = np.linalg.norm(place - radius * left, axis=1)
        aside = np.sign(radius) * (abs(radius) - away) if radius else -away
    error = yaw[-1] - begin - turn_rate * time[-1]
    turned = float(np.arctan2(np.sin(error), np.cos(error)))
    return float(np.sqrt(np.mean(aside**2))), turned
