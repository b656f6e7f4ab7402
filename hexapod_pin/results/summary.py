"""A summary holds the numbers of a run over whole gait cycles, without samples.

Gathered by the native core at every accepted step, so that peaks do not depend on the sampling.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import JSON, check_ending, without_non_finite
from hexapod_pin.results.run_record import Event, JointLimits, RunRecord
from hexapod_pin.results.run_schema import checked_summary
from hexapod_pin.results.summary_layout import LAYOUT, SCHEMA, SCHEMA_VERSION, shape_of
from hexapod_pin.robot.rotations import yawed
from hexapod_pin.user_file import TEXT_BYTES, read_bytes, reason_of


@dataclass(frozen=True, eq=False)
class Summary(Immutable):
    """A run in numbers: n joints, F feet; SI units, radians. Two are equal when every bit is.

    "Per cycle": over the whole cycles of the window, divided by their number; the whole window
    where nothing repeats. Numbers of a run without a whole cycle are NaN.

    Attributes:
        joint_names: n names.
        foot_names: F names of the feet (and of the trunk's contact points, where it has any).
        cycles: whole gait cycles in the window; None where nothing repeats.
        states: accepted states of the whole run.
        window_time: length of the window [s].
        torque_peak: torque of largest size, with its sign (n,) [N m].
        torque_peak_time: its time (n,) [s].
        torque_p99: size not exceeded for 99 % of the time, to 1 % (n,) [N m].
        torque_rms: (n,) [N m].
        at_limit: share of the time at the torque limit: effort, or what the motor gives at the
            joint's speed (n,) [-].
        limit_use: largest torque over that limit, the stall torque where it brakes, in the same
            state (n,) [-]; 0 without a limit.
        speed_peak: rate of largest size, with its sign (n,) [rad/s].
        speed_peak_time: its time (n,) [s].
        speed_rms: (n,) [rad/s].
        acceleration_rms: from changes of rate between accepted states (n,) [rad/s^2].
        torque_acceleration: mean of torque times acceleration (n,) [N m rad/s^2]; with both, the
            RMS torque follows for another rotor inertia at the same motion.
        power_peak: torque times rate, of largest size, with its sign (n,) [W].
        power_peak_time: its time (n,) [s].
        positive_energy: work given by the joint per cycle (n,) [J].
        negative_energy: work taken up per cycle (n,) [J], <= 0.
        angle_min: smallest joint angle (n,) [rad].
        angle_max: largest joint angle (n,) [rad].
        outside_torque: as `torque_peak`, before and after the window (n,) [N m].
        outside_torque_time: its time (n,) [s].
        force_peak: largest normal force (F,) [N].
        force_peak_time: its time (F,) [s].
        normal_impulse: of the normal force per cycle (F,) [N s].
        impulse: of the force on the robot per cycle, world axes (F, 3) [N s].
        slip_distance: way of the contact point on the ground, while loaded, per cycle (F,) [m].
        loaded_time: time on the ground per cycle (F,) [s].
        friction_work: integral of |friction force . velocity of the contact point| while loaded,
            per cycle (F,) [J]; of `StickSlip`, what its bristles store and return counts too.
        outside_force: largest normal force before and after the window (F,) [N].
        outside_force_time: its time (F,) [s].
        height_min: least height of the trunk's origin [m].
        height_max: its largest [m].
        height_mean: its mean [m].
        height_rms: square root of its mean square about the mean [m].
        heave_rms: the same about the straight line in time that fits best, so that a slope does
            not count [m].
        roll_mean: mean roll of the trunk, of Rz(yaw) Ry(pitch) Rx(roll) [rad].
        roll_rms: square root of its mean square [rad].
        roll_peak: roll of largest size [rad].
        pitch_mean: the same of the pitch [rad].
        pitch_rms: the same of the pitch [rad].
        pitch_peak: the same of the pitch [rad].
        roll_rate_rms: of the trunk's angular velocity about its own x axis [rad/s].
        pitch_rate_rms: the same about its own y axis [rad/s].
        vertical_acceleration_rms: of the trunk's origin [m/s^2].
        path: time [s], x and y of the centre of mass [m], yaw of the trunk [rad], at the edges and
            middles of the cycles, or at both ends of the window (W, 4).
        first_yaw: yaw at the start of the run [rad].
        counters: steps, evaluations, ...
        run: what was run.
        errors: how far numbers may be off for the run's own error, by name; see `error_of`.
    """

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    cycles: int | None
    states: int
    window_time: float
    torque_peak: Array
    torque_peak_time: Array
    torque_p99: Array
    torque_rms: Array
    at_limit: Array
    limit_use: Array
    speed_peak: Array
    speed_peak_time: Array
    speed_rms: Array
    acceleration_rms: Array
    torque_acceleration: Array
    power_peak: Array
    power_peak_time: Array
    positive_energy: Array
    negative_energy: Array
    angle_min: Array
    angle_max: Array
    outside_torque: Array
    outside_torque_time: Array
    force_peak: Array
    force_peak_time: Array
    normal_impulse: Array
    impulse: Array
    slip_distance: Array
    loaded_time: Array
    friction_work: Array
    outside_force: Array
    outside_force_time: Array
    height_min: float
    height_max: float
    height_mean: float
    height_rms: float
    heave_rms: float
    roll_mean: float
    roll_rms: float
    roll_peak: float
    pitch_mean: float
    pitch_rms: float
    pitch_peak: float
    roll_rate_rms: float
    pitch_rate_rms: float
    vertical_acceleration_rms: float
    path: Array
    first_yaw: float
    counters: Mapping[str, int | float]
    run: RunRecord
    errors: Mapping[str, Any] = field(default_factory=dict)

    __hash__ = None  # type: ignore[assignment]  # equal by content

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        sizes = {"joint": len(self.joint_names), "foot": len(self.foot_names), "axis": 3}
        for name, (axes, _, _) in LAYOUT.items():
            if axes:
                array = read_only(getattr(self, name))
                if array.shape != shape_of(axes, sizes, array):
                    raise ParameterError(f"Summary.{name}", array.shape, f"of shape {axes}")
                object.__setattr__(self, name, array)
        for name in ("counters", "errors"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @classmethod
    def from_data(
        cls,
        data: Mapping[str, Any],
        joint_names: tuple[str, ...],
        foot_names: tuple[str, ...],
        counters: Mapping[str, int | float],
        run: RunRecord,
        errors: Mapping[str, Any] | None = None,
    ) -> Summary:
        """Return the summary of `Summary.data`; what is missing or None is NaN."""
        sizes = {"joint": len(joint_names), "foot": len(foot_names), "axis": 3}
        values: dict[str, Any] = {}
        for name, (axes, _, _) in LAYOUT.items():
            given = data.get(name)
            if not axes:
                values[name] = float("nan") if given is None else float(given)
            elif name == "path":
                values[name] = np.array(given, dtype=float).reshape(-1, 4)
            elif given is None:
                values[name] = np.full(tuple(sizes[axis] for axis in axes), np.nan)
            else:
                values[name] = np.array(given, dtype=float).reshape(
                    tuple(sizes[axis] for axis in axes)
                )
        return cls(
            joint_names, foot_names, data["cycles"], int(data["states"]), **values,
            counters=counters, run=run, errors=errors or {},
        )  # fmt: skip

    @property
    def data(self) -> dict[str, Any]:
        """All numbers as JSON-able data, NaN as None; every digit is kept."""
        plain: dict[str, Any] = {"cycles": self.cycles, "states": self.states}
        for name in LAYOUT:
            value = getattr(self, name)
            plain[name] = value.tolist() if isinstance(value, np.ndarray) else value
        finite: dict[str, Any] = without_non_finite(plain)
        return finite

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
        """Whether the error estimated is within the accuracy asked for, as of `Trace`."""
        return self.run.numerics.accuracy_kept

    def error_of(self, name: str) -> Array:
        """Return how far a number may be off for the run's own error, in its unit and shape.

        From another resolution of the same run: errors of the model are not in it. NaN where it is
        not known.

        Raises:
            UnknownNameError: there is no such number.
        """
        if name not in LAYOUT:
            raise UnknownNameError("number", name, list(LAYOUT))
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
        """Way of the centre of mass per cycle along the heading [m]; None without cycles."""
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
                "schema": SCHEMA,
                "schema_version": SCHEMA_VERSION,
                "joint_names": list(self.joint_names),
                "foot_names": list(self.foot_names),
                "data": self.data,
                "counters": without_non_finite(dict(self.counters)),
                "errors": without_non_finite(dict(self.errors)),
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
    if not isinstance(found, dict) or found.get("schema") != SCHEMA:
        raise TraceFileError(f"{path}: not a summary.")
    if found.get("schema_version") != SCHEMA_VERSION:
        raise TraceFileError(f"{path}: schema version {found.get('schema_version')}; this release "
                             f"reads {SCHEMA_VERSION}.")  # fmt: skip
    try:
        joints, feet = checked_summary(found)
        run = RunRecord.from_dict(found["run"], found["case"], joint=len(joints), foot=len(feet))
    except ParameterError as error:
        raise TraceFileError(f"{path}: {error}") from error
    return Summary.from_data(found["data"], joints, feet, found["counters"], run, found["errors"])


# How far a walk comes along its heading.


def distance_per_cycle(place: Array, turn: Array, along: Array) -> float:
    """Return the mean way per cycle along the heading [m].

    The heading is the direction of travel at the start, turned with the trunk's yaw; the way of
    each cycle is projected on the heading at its middle, so that turning gaits count too.

    Args:
        place: centre of mass at the edges and middles of the cycles [m]. Shape (2 cycles + 1, 2).
        turn: yaw of the trunk there, less that at the start [rad]. Shape (2 cycles + 1,).
        along: unit vector of travel at the start. Shape (2,).
    """
    ways, middle = np.diff(place[::2], axis=0), turn[1::2]
    return float(np.mean(np.sum(ways * yawed(along, middle), axis=1)))


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
