"""The motor that S2's maximum torque chooses, beside the one that RMS, speed and peak choose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from hexapod_pin.drive.catalog import MotorRecord, load_catalog
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.sizing.motor_budget import MotorBudget
from hexapod_pin.results.sizing.ranking import motor_ranking
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Table


class Choice(NamedTuple):
    """A motor of the catalogue, and its budget for the walk."""

    name: str
    mass: float  # [kg]
    budget: MotorBudget


@dataclass(frozen=True)
class Choices:
    """The lightest motors by different rules; of a motor on all joints.

    Attributes:
        axis_torque: largest axis torque of any joint [N m].
        total_moment: largest total moment across any joint [N m].
        by_axis_torque: the lightest whose stall torque is that or more.
        by_total_moment: the same for the total moment.
        by_all_needs: the lightest that passes the motor budget.
        by_kind: for each kind of joint, its largest axis torque [N m], the lightest motor by it,
            and the lightest that passes the budget of that kind.
    """

    axis_torque: float
    total_moment: float
    by_axis_torque: Choice
    by_total_moment: Choice
    by_all_needs: Choice
    by_kind: dict[str, tuple[float, Choice, Choice]]


def chosen_motors(walk: Trace) -> Choices:
    """Return the motors for a walk, none with uncertain numbers; the robot keeps its masses."""
    rows = [row for row in load_catalog() if row.mass is not None and not row.uncertain]
    records = {row.name: row for row in rows}
    ranking = motor_ranking(joint_demand(walk), records.values())
    budgets = {budget.motor: budget for budget in ranking.budgets}
    order = sorted(budgets, key=lambda name: (records[name].mass, records[name].stall_torque))

    def lightest(fits: Callable[[MotorRecord, MotorBudget], bool]) -> Choice:
        name = next(one for one in order if fits(records[one], budgets[one]))
        return Choice(name, float(records[name].mass or 0.0), budgets[name])

    def strong(torque: float) -> Choice:
        return lightest(lambda record, _: record.stall_torque >= torque)

    kinds = {row.kind: row.peak.torque_peak for row in torque_budget(walk).kinds}
    moment = float(joint_moments(walk).moment.max())
    return Choices(
        axis_torque=max(kinds.values()),
        total_moment=moment,
        by_axis_torque=strong(max(kinds.values())),
        by_total_moment=strong(moment),
        by_all_needs=lightest(lambda _, budget: budget.passes),
        by_kind={
            kind: (peak, strong(peak), lightest(lambda _, b, k=kind: b.kind(k).passes))  # type: ignore[misc]
            for kind, peak in kinds.items()
        },
    )


def motor_table(walk: Trace) -> Table:
    """Return each rule, the motor that it chooses, and what the walk takes of that motor."""
    found = chosen_motors(walk)
    rows = [
        _row(f"largest axis torque, {found.axis_torque:.2f} N m, all joints", found.by_axis_torque),
        _row(f"largest total moment, {found.total_moment:.2f} N m, all joints",
             found.by_total_moment),
        _row("peak, RMS, rest and speed, all joints", found.by_all_needs),
    ]  # fmt: skip
    for kind, (peak, strong, right) in found.by_kind.items():
        rows.append(_row(f"largest axis torque, {peak:.2f} N m, {kind}", strong, kind))
        rows.append(_row(f"peak, RMS, rest and speed, {kind}", right, kind))
    head = (
        "chosen by", "lightest motor", "mass [g]", "peak [-]", "RMS [-]", "rest [-]", "speed [-]",
        "carries the walk",
    )  # fmt: skip
    return Table("", head, rows)


def _row(rule: str, choice: Choice, kind: str | None = None) -> tuple[str, ...]:
    use = choice.budget.robot if kind is None else choice.budget.kind(kind)
    rest = "unknown" if use.standing_use is None else f"{use.standing_use:.2f}"
    return (
        rule, choice.name, f"{1e3 * choice.mass:.1f}", f"{use.peak_use:.2f}",
        f"{use.continuous_use:.2f}", rest, f"{use.speed_use:.2f}",
        {"passes": "yes", "FAILS": "no"}.get(use.verdict, use.verdict),
    )  # fmt: skip
