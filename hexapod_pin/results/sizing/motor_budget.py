"""A motor of a catalogue held against what the joints demand."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from hexapod_pin.arguments import checked, explain_methods
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.derating import Derating
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.sizing.battery_load import battery_load
from hexapod_pin.results.sizing.joint_demand import JointDemand
from hexapod_pin.results.sizing.joint_use import joint_uses
from hexapod_pin.results.sizing.motor_use import UNITS, UNKNOWN, BatteryLoad, MotorUse, finite
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.sizing.use_text import budget_text
from hexapod_pin.results.sizing.worst_use import worst_use
from hexapod_pin.results.trace import Trace

NO_MOTOR = ("slide",)
"""Kinds of joints that no motor of a catalogue drives: they need a force."""


@explain_methods
@dataclass(frozen=True)
class MotorBudget:
    """Whether a motor carries the joints, and at what load; `table()` prints it.

    Attributes:
        motor: name of the catalogue's row, or of the rows by kind.
        joints: one row per joint, in the demand's order.
        kinds: one row per kind: the worst of its joints, number by number.
        robot: the worst of all joints.
        battery: what all joints together draw.
        demand: what it was held against.
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
        return _row("kind of joint", name, {row.kind: row for row in self.kinds})

    def joint(self, name: str) -> MotorUse:
        """Return the row of a joint.

        Raises:
            UnknownNameError: there is no such joint.
        """
        return _row("joint", name, {row.joint: row for row in self.joints})

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
        kinds: kinds of joint to hold against it; None: all that turn, or those of the mapping.
        lost_leg: whether a joint must also hold the robot with one leg lost.
        ambient: temperature of the surroundings [deg C], *assumed*.

    Raises:
        ParameterError: a row has no no-load speed; a kind has no motor.
        UnknownNameError: the run has no joints of such a kind.
    """
    allowed = Derating() if derating is None else derating
    whole = joint_demand(demand) if isinstance(demand, Trace) else demand
    need = whole.of_kinds(_kinds(whole, record, kinds))
    motors = Motors.of(need.kinds, record, allowed)
    rows = joint_uses(need, motors, lost_leg, ambient)
    names = tuple(dict.fromkeys(need.kinds))
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
        found = tuple(k for k in dict.fromkeys(demand.kinds) if k not in NO_MOTOR)
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


def _row(kind: str, name: str, rows: Mapping[str, MotorUse]) -> MotorUse:
    if name not in rows:
        raise UnknownNameError(kind, name, list(rows))
    return rows[name]
