"""A motor budget compares a motor with what the joints demand.

A ranking does so for all motors of a catalogue.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.schema import named
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_use import (
    UNITS,
    UNKNOWN,
    BatteryLoad,
    MotorUse,
    battery_load,
    finite,
    joint_uses,
    worst_use,
)
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Cell, Table, indented, labelled

NO_MOTOR = ("slide",)
"""Kinds of joints that no motor of a catalogue drives: they need a force."""


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
    """

    motor: str
    joints: tuple[MotorUse, ...]
    kinds: tuple[MotorUse, ...]
    robot: MotorUse
    battery: BatteryLoad
    demand: JointDemand = field(repr=False)
    derating: Derating
    notes: tuple[str, ...]

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

    Raises:
        ParameterError: a row has no no-load speed; a kind has no motor.
        UnknownNameError: the run has no joints of such a kind.
    """
    allowed = Derating() if derating is None else derating
    whole = joint_demand(demand) if isinstance(demand, Trace) else demand
    need = whole.of_kinds(_kinds(whole, record, kinds))
    motors = Motors.of(need.joint_kinds, record, allowed)
    rows = joint_uses(need, motors, lost_leg, ambient)
    names = tuple(dict.fromkeys(need.joint_kinds))
    groups = [[row for row in rows if row.kind == name] for name in names]
    return MotorBudget(
        motor=motors.name,
        joints=rows,
        kinds=tuple(worst_use(name, group) for name, group in zip(names, groups, strict=True)),
        robot=worst_use("all", rows),
        battery=battery_load(need, motors),
        demand=need,
        derating=allowed,
        notes=(*need.notes, *motors.notes, *_assumed(rows, allowed, ambient)),
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
    if any(row.winding_temperature != UNKNOWN for row in rows):
        yield f"assumed: surroundings at {ambient:g} deg C; gears without losses"


# A motor's budget as plain text.

USE_HEADER = (
    "", "verdict", "peak\n[-]", "margin\n[N m]", "outside\n[%]", "RMS\n[-]", "moving RMS\n[-]",
    "standing\n[-]", "holding\n[-]", "leg lost\n[-]", "speed\n[-]", "current\npeak [A]", "RMS\n[A]",
    "heat\n[W]", "winding\n[deg C]",
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
    head = [f"{budget.motor} in {budget.demand.robot_name}: {verdict}", _allowed(budget)]
    head += [f"  {reason}" for reason in budget.reasons]
    uses = [_use_cells(row, f"{row.kind} ({row.joint})") for row in budget.kinds]
    uses += [_use_cells(row, row.joint) for row in budget.joints]
    inertias = [_inertia_cells(row, budget.demand) for row in budget.joints]
    notes = ["Notes", *(f"  {note}" for note in budget.notes)]
    per = "window" if budget.demand.cycles is None else "cycle"
    blocks = (
        head,
        _table("Need over what is allowed; a use passes at 1 or below", USE_HEADER, uses),
        demand_lines(budget.demand),
        _table("Rotor and gear", INERTIA_HEADER, inertias),
        [
            f"All joints at the same time, per {per}",
            *work_lines(budget.demand),
            *battery_lines(budget.battery),
        ],
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
    return _table(f"Need of every joint; energies per {per}", NEED_HEADER, rows)


def _table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[Cell]], number: str = ".3g"
) -> list[str]:
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


def _allowed(budget: MotorBudget) -> str:
    d = budget.derating
    return (
        f"allowed: {d.peak:g} of the torque-speed line at {d.voltage:g} of the rated voltage; "
        f"for ever the rated torque, or {d.continuous:g} of stall where none is published"
    )


def _use_cells(row: MotorUse, name: str) -> Sequence[Cell]:
    return (
        name, "passes" if row.passes else "FAILS", row.peak_use, row.margin,
        100.0 * row.outside_share, row.continuous_use, row.thermal_use,
        row.standing_use, row.holding_use, row.lost_leg_use,
        row.speed_use, row.current_peak, row.current_rms,
        row.winding_heat, row.winding_temperature,
    )  # fmt: skip


def _inertia_cells(row: MotorUse, demand: JointDemand) -> Sequence[Cell]:
    load = demand.load_inertia[demand.joint_names.index(row.joint)]
    return (
        row.joint, load, row.armature, row.inertia_ratio,
        row.torque_rms_with_armature, row.optimal_ratio, row.ratio_limit,
    )  # fmt: skip


# The motors of a catalogue compared with one run, ranked.

CAVEAT = (
    "Compared with the run as it is: neither the motors' masses and rotors nor their lines were in "
    "it. `hexapod-pin select` simulates each motor with them."
)

FIRST = 5
"""Motors of a short ranking."""

SHOWN = 15
"""Motors of the text table that do not pass."""


@dataclass(frozen=True)
class MotorRanking(Immutable):
    """Motors in their order for one run.

    Attributes:
        demand: what the joints need.
        budgets: those that pass every joint first, the lightest first; then the others by how many
            kinds of joint they fail, and by their largest use.
        unusable: names and reasons of those without a line.
        source: of the catalogue.
    """

    demand: JointDemand
    budgets: tuple[MotorBudget, ...]
    masses: tuple[float | None, ...]
    unusable: tuple[tuple[str, str], ...]
    source: str

    @property
    def passing(self) -> tuple[MotorBudget, ...]:
        """Motors that carry every joint."""
        return tuple(budget for budget in self.budgets if budget.passes)

    def table(self) -> str:
        """Return need and ranking as text with units."""
        good = len(self.passing)
        shown = self.budgets[: good + SHOWN]
        head = ["motor", "mass\n[g]", "verdict"]
        for row in self.budgets[0].kinds if self.budgets else ():
            head += [f"{row.kind}\npeak", "\nRMS", "\nrest", "\nspeed"]
        rows = [_cells(b, mass) for b, mass in zip(shown, self.masses, strict=False)]
        title = f"Motors of {self.source}, need over what is allowed; passes at 1 or below"
        lines = _table(title, head, rows, ".2g")
        left = len(self.budgets) - len(shown)
        lines += [f"and {left} more that fail (--json lists all)"] if left else []
        why = [f"  {b.motor}: {b.reasons[0]}" for b in shown if b.reasons]
        lines += ["", "Why not", *why] if why else []
        lines += [f"  {name}: {reason}" for name, reason in self.unusable]
        return "\n".join([*demand_lines(self.demand), "", *lines, "", CAVEAT])

    def short_lines(self) -> list[str]:
        """Return the first motors of the ranking, each with its largest use by kind of joint."""
        kinds = [row.kind for row in self.budgets[0].kinds] if self.budgets else []
        rows = [
            [
                budget.motor, None if mass is None else f"{1e3 * mass:.4g}",
                "passes" if budget.passes else "FAILS", *(row.deciding_use for row in budget.kinds),
            ]
            for budget, mass in zip(self.budgets[:FIRST], self.masses, strict=False)
        ]  # fmt: skip
        count = len(self.passing)
        title = (
            f"{count} of {len(self.budgets)} motors pass all joints; largest use, lightest first"
        )
        return _table(title, ["motor", "mass\n[g]", "verdict", *kinds], rows, ".2f")

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        return {
            "catalog": self.source,
            "motors": [budget.to_dict() for budget in self.budgets],
            "unusable": [{"motor": name, "reason": why} for name, why in self.unusable],
            "caveat": CAVEAT,
        }


@checked
def motor_ranking(
    run: Trace | JointDemand,
    records: Iterable[MotorRecord],
    derating: Derating | None = None,
    source: str = "the catalogue",
) -> MotorRanking:
    """Return the motors of a catalogue in their order for one run.

    Args:
        run: a trace, or what its joints need.
        records: rows of a catalogue; those without a torque-speed line are listed apart.
        derating: what of the data sheets is allowed; None: the default.
        source: of the catalogue, for the heading.

    Raises:
        ParameterError, NotRecordedError: as `joint_demand`; something is no record of a motor.
    """
    demand = joint_demand(run) if isinstance(run, Trace) else run
    rows = list(records)
    for row in rows:
        if not hasattr(row, "stall_torque"):
            raise ParameterError("motor_ranking.records", row, "several of MotorRecord")
    good = [row for row in rows if row.stall_torque and row.no_load_speed]
    found = [(motor_budget(demand, row, derating), row.mass) for row in good]
    found.sort(key=lambda item: _order(*item))
    usable = {row.name for row in good}
    bad = tuple((row.name, str(row.unusable)) for row in rows if row.name not in usable)
    return MotorRanking(demand, tuple(b for b, _ in found), tuple(m for _, m in found), bad, source)


def _order(budget: MotorBudget, mass: float | None) -> tuple[Any, ...]:
    if budget.passes:
        return (0, mass is None, mass or 0.0, budget.robot.deciding_use)
    failing = sum(not row.passes for row in budget.kinds)
    return (1, failing, budget.robot.deciding_use, 0.0)


def _cells(budget: MotorBudget, mass: float | None) -> list[Cell]:
    cells: list[Cell] = [
        budget.motor,
        None if mass is None else f"{1e3 * mass:.4g}",
        "passes" if budget.passes else "FAILS",
    ]
    for row in budget.kinds:
        rest = [use for use in (row.standing_use, row.holding_use) if use is not None]
        cells += [row.peak_use, row.continuous_use, max(rest, default=None), row.speed_use]
    return cells
