"""A motor budget compares a motor with what the joints demand."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.schema import named
from hexapod_pin.results.sizing.battery import BatteryLoad, battery_load, supply_of
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_use import (
    UNITS,
    UNKNOWN,
    MotorUse,
    finite,
    joint_uses,
    worst_use,
)
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.sizing.walking_heat import WalkingHeat, check_ambient, heat_course
from hexapod_pin.results.sizing.winding import THERMAL_RULE, lasting_torque
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Cell, Table, indented, labelled

HOUR = 3600.0
"""Time over which temperatures are followed [s]."""

NO_MOTOR = ("slide", "gap")
"""Kinds of joints that no motor of a catalogue drives: they need a force, or are free play."""


@dataclass(frozen=True)
class MotorBudget(Immutable):
    """Whether a motor carries the joints, and at what load; `table()` prints it.

    Attributes:
        motor: name of the catalogue's row, or of the rows by kind.
        joints: one row per joint, in the demand's order.
        kinds: one row per kind: the worst of its joints, number by number.
        robot: the worst of all joints.
        battery: what all joints together draw.
        demand: what the motors were compared with.
        derating: what of the data sheet was allowed.
        notes: what is assumed, estimated or unknown.
        motors: of the joints, as arrays.
        ambient: temperature of the surroundings [deg C].
    """

    motor: str
    joints: tuple[MotorUse, ...]
    kinds: tuple[MotorUse, ...]
    robot: MotorUse
    battery: BatteryLoad
    demand: JointDemand = field(repr=False)
    derating: Derating
    notes: tuple[str, ...]
    motors: Motors = field(repr=False, compare=False)
    ambient: float = 25.0

    @cached_property
    def hour(self) -> WalkingHeat:
        """Temperatures over an hour of this walk; see `walking_heat`."""
        return heat_course(self.demand, self.motors, HOUR, self.ambient)

    @property
    def passes(self) -> bool:
        """Whether every joint passes."""
        return self.robot.passes

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it does not pass: of each kind that fails, and of its worst joint."""
        return tuple(reason for row in self.kinds for reason in row.reasons)

    def kind(self, name: str) -> MotorUse:
        """Return the row of a kind of joint: "coxa", "femur", "tibia", ...

        Raises:
            UnknownNameError: there is no such kind.
        """
        return named("kind of joint", name, {row.kind: row for row in self.kinds})

    def joint(self, name: str) -> MotorUse:
        """Return the row of a joint.

        Raises:
            UnknownNameError: there is no such joint.
        """
        return named("joint", name, {row.joint: row for row in self.joints})

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data, `units` among it; NaN and infinities as None."""
        rows = {"joints": self.joints, "kinds": self.kinds, "robot": (self.robot,)}
        plain = {name: [row.to_dict() for row in group] for name, group in rows.items()}
        return finite(
            {
                "motor": self.motor,
                "passes": self.passes,
                "reasons": list(self.reasons),
                **plain,
                "robot": plain["robot"][0],
                "battery": asdict(self.battery),
                "demand": self.demand.to_dict(),
                "derating": self.derating.model_dump(),
                "notes": list(self.notes),
                "units": dict(UNITS),
            }
        )

    def to_json(self) -> str:
        """Return `to_dict` as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def table(self) -> str:
        """Return the budget as plain text with units."""
        return budget_text(self)


@checked
def motor_budget(
    demand: JointDemand | Trace,
    record: MotorRecord | Mapping[str, MotorRecord],
    derating: Derating | None = None,
    kinds: Sequence[str] | None = None,
    *,
    lost_leg: bool = False,
    ambient: float = 25.0,
    pack_resistance: float = 0.0,
) -> MotorBudget:
    """Return how a motor of the catalogue fares with what joints demand.

    Args:
        demand: of a run; a trace's is taken from it (`joint_demand`: for several motors, do it
            once).
        record: the motor of all joints, or motors by kind of joint.
        derating: what of the data sheet is allowed; None: the default.
        kinds: kinds of joint to compare with it; None: all that turn, or those of the mapping.
        lost_leg: whether a joint must also hold the robot with one leg lost.
        ambient: temperature of the surroundings [deg C], *assumed*.
        pack_resistance: of the battery and its leads [ohm]: its voltage then falls with the sum of
            all currents at every sample, and the motors' lines with it. The derating's voltage is
            that of the battery without current. 0: none.

    Raises:
        ParameterError: a row has no no-load speed; a kind has no motor; a temperature or resistance
            that cannot be.
        UnknownNameError: the run has no joints of such a kind.
    """
    allowed = Derating() if derating is None else derating
    check_ambient(ambient)
    if not 0.0 <= pack_resistance < np.inf:
        raise ParameterError("pack_resistance", pack_resistance, "0 or more, finite [ohm]")
    whole = joint_demand(demand) if isinstance(demand, Trace) else demand
    need = whole.of_kinds(_kinds(whole, record, kinds))
    motors = Motors.of(need.joint_kinds, record, allowed)
    motors = replace(motors, continuous=lasting_torque(motors, ambient))
    supply = supply_of(need, motors, pack_resistance) if pack_resistance else None
    rows = joint_uses(need, motors, lost_leg, ambient, supply)
    names = tuple(dict.fromkeys(need.joint_kinds))
    groups = [[row for row in rows if row.kind == name] for name in names]
    return MotorBudget(
        motor=motors.name,
        joints=rows,
        kinds=tuple(worst_use(name, group) for name, group in zip(names, groups, strict=True)),
        robot=worst_use("all", rows),
        battery=battery_load(need, motors, pack_resistance),
        demand=need,
        derating=allowed,
        notes=(*need.notes, *motors.notes, *_assumed(rows, allowed, ambient)),
        motors=motors,
        ambient=ambient,
    )


def _kinds(
    demand: JointDemand,
    record: MotorRecord | Mapping[str, MotorRecord],
    kinds: Sequence[str] | None,
) -> tuple[str, ...]:
    """Return the kinds of joint to look at."""
    if kinds is not None:
        found = tuple(kinds)
    elif isinstance(record, Mapping):
        found = tuple(record)
    else:
        found = tuple(k for k in dict.fromkeys(demand.joint_kinds) if k not in NO_MOTOR)
    if isinstance(record, Mapping) and (missing := [k for k in found if k not in record]):
        raise ParameterError("record", sorted(record), f"given with a motor of {missing}")
    if not found:
        raise ParameterError("kinds", found, "one kind of joint or more")
    return found


def _assumed(rows: Sequence[MotorUse], derating: Derating, ambient: float) -> Iterator[str]:
    """Yield what the derating rests on, and the surroundings where they count."""
    yield from (f"derating: {ground}" for ground in derating.evidence)
    sources = {row.thermal_source for row in rows}
    if sources - {UNKNOWN}:
        yield f"assumed: surroundings at {ambient:g} deg C"
    if "assumed" in sources:
        yield THERMAL_RULE
    yield from (row.doubt for row in rows if row.doubtful and row.passes)


# A motor's budget as plain text.

USE_HEADER = (
    "", "verdict", "peak\n[-]", "margin\n[N m]", "outside\n[%]", "RMS\n[-]", "moving RMS\n[-]",
    "standing\n[-]", "holding\n[-]", "leg lost\n[-]", "speed\n[-]", "current\npeak [A]", "RMS\n[A]",
    "heat\n[W]", "winding\n[deg C]", "maker's\nrating [-]",
)  # fmt: skip
INERTIA_HEADER = (
    "", "load inertia\n[kg m^2]", "rotor's at joint\n[kg m^2]", "load / rotor\n[-]",
    "RMS with rotor\n[N m]", "best gear ratio\n[-]", "ratio by speed\n[-]",
)  # fmt: skip
NEED_HEADER = (
    "", "peak\n[N m]", "p99\n[N m]", "RMS\n[N m]", "standing\n[N m]", "holding\n[N m]",
    "leg lost\n[N m]", "peak speed\n[rad/s]", "RMS\n[rad/s]", "power\n[W]",
    "energy +\n[J]", "energy -\n[J]",
)  # fmt: skip


def budget_text(budget: MotorBudget) -> str:
    """Return all tables of a motor's budget, with units."""
    verdict = "PASSES" if budget.passes else "FAILS"
    verdict += " (doubtful)" if budget.robot.doubtful else ""
    head = [f"{budget.motor} in {budget.demand.robot_name}: {verdict}", _allowed(budget)]
    head += [f"  {reason}" for reason in budget.reasons]
    uses = [_use_cells(row, f"{row.kind} ({row.joint})") for row in budget.kinds]
    uses += [_use_cells(row, row.joint) for row in budget.joints]
    inertias = [_inertia_cells(row, budget.demand) for row in budget.joints]
    notes = ["Notes", *(f"  {note}" for note in budget.notes)]
    per = "window" if budget.demand.cycles is None else "cycle"
    blocks = (
        head,
        sizing_table("Need over what is allowed; a use passes at 1 or below", USE_HEADER, uses),
        demand_lines(budget.demand),
        sizing_table("Rotor and gear", INERTIA_HEADER, inertias),
        [
            f"All joints at the same time, per {per}",
            *work_lines(budget.demand),
            *battery_lines(budget.battery),
        ],
        budget.hour.table_lines(),
        notes,
    )
    return "\n\n".join("\n".join(block) for block in blocks)


def demand_lines(demand: JointDemand) -> list[str]:
    """Return what the joints demand, one line each."""
    names = (
        "torque_peak", "torque_p99", "torque_rms", "standing", "holding", "holding_lost_leg",
        "speed_peak", "speed_rms", "power_peak", "positive_energy", "negative_energy",
    )  # fmt: skip
    rows = [
        [joint, *(getattr(demand, name)[j] for name in names)]
        for j, joint in enumerate(demand.joint_names)
    ]
    per = "window" if demand.cycles is None else "cycle"
    return sizing_table(f"Need of every joint; energies per {per}", NEED_HEADER, rows)


def sizing_table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[Cell]], number: str = ".3g"
) -> list[str]:
    """Return a table of numbers, "unknown" where there is none."""
    return Table(title, head, rows, "<>", number=number, missing=UNKNOWN).lines()


def work_lines(demand: JointDemand) -> list[str]:
    """Return mechanical work and cost of transport."""
    positive, negative = demand.positive_energy.sum(), demand.negative_energy.sum()
    rows = [
        ("mechanical work given by the joints", positive, "J"),
        ("mechanical work taken up by the joints", negative, "J"),
        ("mechanical cost of transport, work by its size", demand.cost_of_transport, ""),
        ("the same, work given only", demand.cost_of_transport_positive, ""),
    ]
    return indented(labelled(rows, ".3g", UNKNOWN, least=48))


def battery_lines(load: BatteryLoad) -> list[str]:
    """Return what the battery gives, an estimate."""
    if load.unknown:
        return [f"  battery current and electrical power: unknown ({load.unknown})"]
    rows = [
        ("supply under load", load.voltage, "V"),
        *_sag(load),
        ("largest current of all together", load.current_peak, "A"),
        ("sum of the joints' own peaks, for comparison", load.sum_of_peaks, "A"),
        ("mean current", load.current_mean, "A"),
        ("RMS current", load.current_rms, "A"),
        ("mean power, nothing given back", load.power_mean, "W"),
        ("mean power, braking gives back", load.power_mean_regeneration, "W"),
        ("energy, nothing given back", load.energy, "J"),
        ("energy, braking gives back", load.energy_regeneration, "J"),
        ("electrical cost of transport, nothing given back", load.cost_of_transport, ""),
        ("the same, braking gives back", load.cost_of_transport_regeneration, ""),
    ]
    lines = labelled(rows, ".3g", UNKNOWN, least=48)
    return indented(
        [*lines, "estimated from identified motors and gears, else from data-sheet currents"]
    )


def _sag(load: BatteryLoad) -> list[tuple[str, float | None, str]]:
    """Return what the pack's resistance does to the voltage, where one is given."""
    if not load.pack_resistance:
        return []
    return [
        ("internal resistance of the pack", load.pack_resistance, "ohm"),
        ("lowest voltage at the motors", load.voltage_least, "V"),
        ("mean voltage at the motors", load.voltage_mean, "V"),
        ("share of the time beyond what the pack can give", load.overloaded_share, ""),
    ]


def _allowed(budget: MotorBudget) -> str:
    d = budget.derating
    return (
        f"allowed: {d.peak:g} of the torque-speed line at {d.voltage:g} of the rated voltage; "
        f"for ever {d.continuous:g} of stall, or what heats the winding to its limit where thermal "
        "constants are published"
    )


def _use_cells(row: MotorUse, name: str) -> Sequence[Cell]:
    return (
        name, row.verdict, row.peak_use, row.margin,
        100.0 * row.outside_share, row.continuous_use, row.thermal_use,
        row.standing_use, row.holding_use, row.lost_leg_use,
        row.speed_use, row.current_peak, row.current_rms,
        row.winding_heat, _winding(row), row.rated_use,
    )  # fmt: skip


def _winding(row: MotorUse) -> Cell:
    """Return the winding's temperature; of assumed constants with the ends of their spread."""
    middle = row.winding_temperature
    if isinstance(middle, str) or row.thermal_source != "assumed":
        return middle
    return f"{middle:.0f} ({row.winding_cool:.0f} to {row.winding_hot:.0f})"


def _inertia_cells(row: MotorUse, demand: JointDemand) -> Sequence[Cell]:
    load = demand.load_inertia[demand.joint_names.index(row.joint)]
    return (
        row.joint, load, row.armature, row.inertia_ratio,
        row.torque_rms_with_armature, row.optimal_ratio, row.ratio_limit,
    )  # fmt: skip
