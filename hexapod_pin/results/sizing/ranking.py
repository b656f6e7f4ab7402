"""The motors of a catalogue compared with one run: ranked, and the lightest of each kind."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_budget import (
    NO_MOTOR,
    MotorBudget,
    demand_lines,
    motor_budget,
    sizing_table,
)
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Cell

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
        lines = sizing_table(title, head, rows, ".2g")
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
                budget.robot.verdict, *(row.deciding_use for row in budget.kinds),
            ]
            for budget, mass in zip(self.budgets[:FIRST], self.masses, strict=False)
        ]  # fmt: skip
        count = len(self.passing)
        title = (
            f"{count} of {len(self.budgets)} motors pass all joints; largest use, lightest first"
        )
        return sizing_table(title, ["motor", "mass\n[g]", "verdict", *kinds], rows, ".2f")

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
        budget.robot.verdict,
    ]
    for row in budget.kinds:
        rest = [use for use in (row.standing_use, row.holding_use) if use is not None]
        cells += [row.peak_use, row.continuous_use, max(rest, default=None), row.speed_use]
    return cells


# The lightest motor of a catalogue that carries each kind of joint of one run.


@dataclass(frozen=True)
class LightestMotor(Immutable):
    """The lightest motor that carries all joints of one kind.

    Attributes:
        kind: of joint.
        motor: its name and voltage.
        mass: of one motor [kg].
        use: largest need over what is allowed: torque, continuous torque, speed, holding [-].
    """

    kind: str
    motor: str
    mass: float
    use: float


@checked
def lightest_motors(
    demand: JointDemand, records: Iterable[MotorRecord], derating: Derating | None = None
) -> dict[str, LightestMotor | None]:
    """Return the lightest motor that passes, by kind of joint; None where none does.

    The criterion is that of `motor_budget`: peak against the derated line, continuous torque,
    speed, holding torque, and heat where its constants are known. Neither the motors' masses nor
    their rotors are in the run: `select_motors` simulates them.

    Args:
        demand: what the joints of a run need.
        records: rows of a catalogue; those without a mass or a torque-speed line are left out.
        derating: what of the data sheets is allowed; None: the default.
    """
    usable = [row for row in records if row.mass and row.stall_torque and row.no_load_speed]
    found: dict[str, LightestMotor | None] = {
        kind: None for kind in demand.joint_kinds if kind not in NO_MOTOR
    }
    for row in sorted(usable, key=lambda row: row.mass or math.inf):
        left = [kind for kind, motor in found.items() if motor is None]
        if not left:
            break
        for use in motor_budget(demand, row, derating, kinds=left).kinds:
            if use.passes:
                found[use.kind] = LightestMotor(
                    use.kind, row.name, row.mass or 0.0, use.deciding_use
                )
    return found
