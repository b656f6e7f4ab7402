"""Joint torques of a walk against stroke and cycle time, as data ([S2]'s two sweeps)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.results.grid_columns import GridResult
from hexapod_pin.results.phase_torque import PHASES
from hexapod_pin.results.result_files import read_netcdf
from hexapod_pin.results.schema import quantity, require_known, schema

GRID = ("stroke", "cycle_time")
JOINT, PHASE = "stroke cycle_time joint", "stroke cycle_time phase joint"
POINT, FOOT = "stroke cycle_time", "stroke cycle_time foot"


class TorqueMap(GridResult):
    """Torques on a grid of S strokes by C cycle times: n joints, F feet, 2 phases; SI units.

    Every number is over the whole cycles of the runs' window. A point that could not be walked is
    NaN, and `reason` has the cause. Phases are those of the gait's schedule: "retraction" while the
    leg is on the ground, "protraction" while it swings; torques of a phase are those of samples,
    peaks those of accepted steps where the largest of all is in that phase. Two maps are equal when
    every bit is.

    Attributes:
        joint_names: n names.
        joint_kinds: kind of each joint: "coxa", "femur", "tibia", or "joint" where it is not
            known.
        foot_names: F names.
        reason: why a point could not be walked, "" where it was (S, C).
        check: some points at a tighter accuracy; None where none was run.
        run: how the map came about: scene, controller, settings, what is assumed.
    """

    GRID: ClassVar[tuple[str, ...]] = GRID
    FILE: ClassVar[tuple[str, int]] = ("hexapod_pin.torque_map", 1)
    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "stroke": "stroke", "cycle_time": "cycle_time", "joint": "joint_names",
        "foot": "foot_names", "phase": PHASES,
    }  # fmt: skip
    TEXTS: ClassVar[Mapping[str, tuple[str, str]]] = {"kind": ("joint", "joint_kinds")}

    # fmt: off
    stroke: Array = quantity("stroke", "m", "stroke", least=0.0, nan=False)
    cycle_time: Array = quantity("cycle_time", "s", "cycle time", least=0.0, nan=False)
    joint_names: tuple[str, ...]
    joint_kinds: tuple[str, ...]
    foot_names: tuple[str, ...]
    torque_peak: Array = quantity(JOINT, "N m", "largest axis torque by size, of accepted steps")
    torque_p99: Array = quantity(JOINT, "N m",
        "axis torque by size not exceeded for 99 % of the time")
    torque_rms: Array = quantity(JOINT, "N m", "RMS axis torque")
    speed_peak: Array = quantity(JOINT, "rad/s", "largest joint rate by size, of accepted steps")
    positive_energy: Array = quantity(JOINT, "J", "mechanical work done per cycle")
    negative_energy: Array = quantity(JOINT, "J",
        "mechanical work absorbed per cycle, not positive")
    normal_impulse: Array = quantity(FOOT, "N s", "impulse of the normal force per cycle")
    distance: Array = quantity(POINT, "m",
        "distance of the centre of mass along the heading per cycle")
    measured_speed: Array = quantity(POINT, "m/s", "speed of the centre of mass along the heading")
    nominal_speed: Array = quantity(POINT, "m/s", "stroke / (duty * cycle time)")
    cost_of_transport: Array = quantity(POINT, "1",
        "absolute mechanical energy / (weight * distance)")
    cost_of_transport_positive: Array = quantity(POINT, "1",
        "positive mechanical energy / (weight * distance)")
    phase_torque_peak: Array = quantity(PHASE, "N m",
        "largest axis torque by size in a phase of the leg")
    phase_torque_rms: Array = quantity(PHASE, "N m", "RMS axis torque in a phase of the leg")
    phase_time: Array = quantity(PHASE, "s", "time of the phase in the window")
    phase_torque_rms_error: Array = quantity(PHASE, "N m",
        "error of phase_torque_rms from the sampling")
    # fmt: on

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
        per_joint = [name for name, one in schema(TorqueMap).items() if one.axes[-1] == "joint"]
        require_known("quantity of joints", quantity, per_joint)
        require_known("kind of joint", kind, self.kind_names)
        values = getattr(self, quantity)[..., [own == kind for own in self.joint_kinds]]
        summed = schema(TorqueMap)[quantity].by_kind == "sum"
        found: Array = values.sum(axis=-1) if summed else values.max(axis=-1)
        return found


@checked
def load_torque_map(path: str | Path) -> TorqueMap:
    """Read a map that `TorqueMap.save` wrote; equal to it.

    Raises:
        TraceFileError: the file is missing, damaged, of another kind or of a newer schema.
    """
    return TorqueMap.from_group(str(path), read_netcdf(path))
