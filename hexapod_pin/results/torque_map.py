"""Joint torques of a walk against stroke and cycle time, as data ([S2]'s two sweeps)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.file_schema import ArrayRule, check_names
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.grid_columns import (
    AccuracyCheck,
    GridRecord,
    check_grid,
    freeze_grid,
    grid_fields,
    grid_group,
    require_schema,
    same_group,
)
from hexapod_pin.results.phase_torque import PHASES
from hexapod_pin.results.result_files import Column, Group, read_netcdf, write_netcdf
from hexapod_pin.results.trace_layout import described

SCHEMA = ("hexapod_pin.torque_map", 1)

GRID = ("stroke", "cycle_time")
JOINTS, FEET, BY_PHASE = (*GRID, "joint"), (*GRID, "foot"), (*GRID, "phase", "joint")

LAYOUT: dict[str, tuple[tuple[str, ...], str, str]] = {
    "torque_peak": (JOINTS, "N m", "largest axis torque by size, of accepted steps"),
    "torque_p99": (JOINTS, "N m", "axis torque by size not exceeded for 99 % of the time"),
    "torque_rms": (JOINTS, "N m", "RMS axis torque"),
    "speed_peak": (JOINTS, "rad/s", "largest joint rate by size, of accepted steps"),
    "positive_energy": (JOINTS, "J", "mechanical work given per cycle"),
    "negative_energy": (JOINTS, "J", "mechanical work taken up per cycle, not positive"),
    "normal_impulse": (FEET, "N s", "impulse of the normal force per cycle"),
    "distance": (GRID, "m", "way of the centre of mass along the heading per cycle"),
    "measured_speed": (GRID, "m/s", "speed of the centre of mass along the heading"),
    "nominal_speed": (GRID, "m/s", "stroke / (duty * cycle time)"),
    "cost_of_transport": (GRID, "1", "absolute mechanical energy / (weight * distance)"),
    "cost_of_transport_positive": (GRID, "1", "positive mechanical energy / (weight * distance)"),
    "phase_torque_peak": (BY_PHASE, "N m", "largest axis torque by size in a phase of the leg"),
    "phase_torque_rms": (BY_PHASE, "N m", "RMS axis torque in a phase of the leg"),
    "phase_time": (BY_PHASE, "s", "time of the phase in the window"),
    "phase_torque_rms_error": (BY_PHASE, "N m", "how far sampling may have moved phase_torque_rms"),
}
"""Name: (axes, unit, meaning) of every array."""

NAMES = ("joint", "foot", "phase")
RULES = {
    "stroke": ArrayRule(("stroke",), "m", least=0.0),
    "cycle_time": ArrayRule(("cycle_time",), "s", least=0.0),
}
"""Names and numbers of a file besides the arrays of `LAYOUT`."""

SUMMED = ("positive_energy", "negative_energy")
"""What a kind of joint has as the sum over its joints; of all else, that of the worst joint."""


@dataclass(frozen=True, eq=False)
class TorqueMap(Immutable):
    """Torques on a grid of S strokes by C cycle times: n joints, F feet, 2 phases; SI units.

    Every number is over the whole cycles of the runs' window. A point that could not be walked is
    NaN, and `reason` says why. Phases are those of the gait's schedule: "retraction" while the leg
    is on the ground, "protraction" while it swings. Two maps are equal when every bit is.

    Attributes:
        stroke: [m]. Shape (S,).
        cycle_time: [s]. Shape (C,).
        joint_names: n names.
        joint_kinds: kind of each joint: "coxa", "femur", "tibia", or "joint" where it is not
            known.
        foot_names: F names.
        torque_peak: largest axis torque by size, of accepted steps (S, C, n) [N m].
        torque_p99: not exceeded for 99 % of the time (S, C, n) [N m].
        torque_rms: (S, C, n) [N m].
        speed_peak: largest joint rate by size (S, C, n) [rad/s].
        positive_energy: work given per cycle (S, C, n) [J].
        negative_energy: work taken up per cycle, <= 0 (S, C, n) [J].
        normal_impulse: of the normal force per cycle (S, C, F) [N s].
        distance: way along the heading per cycle (S, C) [m].
        measured_speed: along the heading (S, C) [m/s].
        nominal_speed: what the gait asks for (S, C) [m/s].
        cost_of_transport: absolute mechanical energy / (weight * distance) (S, C) [-].
        cost_of_transport_positive: that of the positive energy only (S, C) [-].
        phase_torque_peak: largest torque in each phase, of samples, or of accepted steps where the
            largest of all is in that phase (S, C, 2, n) [N m].
        phase_torque_rms: (S, C, 2, n) [N m].
        phase_time: of each phase in the window (S, C, 2, n) [s].
        phase_torque_rms_error: how far sampling may have moved `phase_torque_rms` (S, C, 2, n)
            [N m].
        reason: why a point could not be walked, "" where it was (S, C).
        check: some points at a tighter accuracy; None where none was run.
        run: how the map came about: scene, controller, settings, what is assumed.
    """

    stroke: Array
    cycle_time: Array
    joint_names: tuple[str, ...]
    joint_kinds: tuple[str, ...]
    foot_names: tuple[str, ...]
    torque_peak: Array
    torque_p99: Array
    torque_rms: Array
    speed_peak: Array
    positive_energy: Array
    negative_energy: Array
    normal_impulse: Array
    distance: Array
    measured_speed: Array
    nominal_speed: Array
    cost_of_transport: Array
    cost_of_transport_positive: Array
    phase_torque_peak: Array
    phase_torque_rms: Array
    phase_time: Array
    phase_torque_rms_error: Array
    reason: npt.NDArray[np.object_]
    check: AccuracyCheck | None = None
    run: GridRecord = GridRecord()

    __hash__ = None  # type: ignore[assignment]  # equal by content

    def __post_init__(self) -> None:
        """Check shapes and make read-only."""
        for name in ("joint_names", "joint_kinds", "foot_names"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in GRID:
            object.__setattr__(self, name, read_only(getattr(self, name)))
        sizes = {
            "stroke": len(self.stroke), "cycle_time": len(self.cycle_time), "phase": len(PHASES),
            "joint": len(self.joint_names), "foot": len(self.foot_names),
        }  # fmt: skip
        if len(self.joint_kinds) != len(self.joint_names):
            raise ParameterError("TorqueMap.joint_kinds", self.joint_kinds, "one per joint")
        freeze_grid(self, LAYOUT, sizes, GRID)

    def __eq__(self, other: object) -> bool:
        """Tell whether every bit is the same."""
        return isinstance(other, TorqueMap) and same_group(self.group(), other.group())

    @property
    def absolute_energy(self) -> Array:
        """Integral of |torque * rate| per cycle (S, C, n) [J]."""
        energy: Array = self.positive_energy - self.negative_energy
        return energy

    @property
    def kind_names(self) -> tuple[str, ...]:
        """The kinds of joints, in the order of first appearance."""
        return tuple(dict.fromkeys(self.joint_kinds))

    def of_kind(self, quantity: str, kind: str) -> Array:
        """Return a quantity of a kind of joint: its worst joint, of energies the sum over joints.

        Returns:
            The array of that name without its last axis: (S, C), or (S, C, 2) by phase.

        Raises:
            UnknownNameError: there is no such kind of joint, or no such quantity of joints.
        """
        per_joint = [name for name, (axes, _, _) in LAYOUT.items() if axes[-1] == "joint"]
        if quantity not in per_joint:
            raise UnknownNameError("quantity of joints", quantity, per_joint)
        if kind not in self.joint_kinds:
            raise UnknownNameError("kind of joint", kind, list(self.kind_names))
        values = getattr(self, quantity)[..., [own == kind for own in self.joint_kinds]]
        found: Array = values.sum(axis=-1) if quantity in SUMMED else values.max(axis=-1)
        return found

    @property
    def finished(self) -> bool:
        """Whether every point was run or refused."""
        return not any(reason == NOT_RUN for reason in self.reason.flat)

    def group(self) -> Group:
        """Return everything as columns and attributes of a file."""
        text = {
            "joint": np.array(self.joint_names, dtype=object),
            "foot": np.array(self.foot_names, dtype=object),
            "phase": np.array(PHASES, dtype=object),
        }
        axes = {name: Column((name,), values, {}) for name, values in text.items()}
        axes["stroke"] = Column(("stroke",), self.stroke, described("m", "stroke"))
        axes["cycle_time"] = Column(("cycle_time",), self.cycle_time, described("s", "cycle time"))
        kinds = np.array(self.joint_kinds, dtype=object)
        axes["kind"] = Column(("joint",), kinds, {"long_name": "kind of joint"})
        return grid_group(self, LAYOUT, axes, GRID, SCHEMA)

    @classmethod
    def from_group(
        cls, where: str, group: tuple[Mapping[str, npt.NDArray[Any]], Mapping[str, Any]]
    ) -> TorqueMap:
        """Return the map of a group's arrays and attributes; `where` is for messages.

        Raises:
            TraceFileError: the group is damaged, of another kind or of a newer schema.
        """
        arrays, attributes = group
        require_schema(where, attributes, SCHEMA)
        try:
            check_grid(arrays, LAYOUT, GRID, NAMES, RULES)
            check_names("kind", arrays.get("kind"), repeated=True)
            return cls(
                stroke=arrays["stroke"],
                cycle_time=arrays["cycle_time"],
                joint_names=tuple(arrays["joint"]),
                joint_kinds=tuple(arrays["kind"]),
                foot_names=tuple(arrays["foot"]),
                **grid_fields(arrays, LAYOUT),
            )
        except ParameterError as error:
            raise TraceFileError(f"{where}: {error}") from error

    def save(self, path: str | Path) -> Path:
        """Write a netCDF-4 file, wholly or not at all, and return its path.

        Raises:
            TraceFileError: the file cannot be written; an old one stays as it was.
        """
        return write_netcdf(path, *self.group())


NOT_RUN = "not run"
"""Reason of a point that an interruption left out."""


@checked
def load_torque_map(path: str | Path) -> TorqueMap:
    """Read a map that `TorqueMap.save` wrote; equal to it.

    Raises:
        TraceFileError: the file is missing, damaged, of another kind or of a newer schema.
    """
    return TorqueMap.from_group(str(path), read_netcdf(path))
