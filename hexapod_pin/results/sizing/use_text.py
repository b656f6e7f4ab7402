"""A motor's budget as plain text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hexapod_pin.results.budget_table import aligned
from hexapod_pin.results.sizing.joint_demand import JointDemand
from hexapod_pin.results.sizing.motor_use import UNKNOWN, BatteryLoad, MotorUse

if TYPE_CHECKING:
    from hexapod_pin.results.sizing.motor_budget import MotorBudget

USE_HEADER = (
    "", "verdict", "peak|[-]", "margin|[N m]", "outside|[%]", "RMS|[-]", "moving RMS|[-]",
    "holding|[-]", "leg lost|[-]", "speed|[-]", "current|peak [A]", "RMS|[A]", "winding|[deg C]",
)  # fmt: skip
INERTIA_HEADER = (
    "", "load inertia|[kg m^2]", "rotor's at joint|[kg m^2]", "load / rotor|[-]",
    "RMS with rotor|[N m]", "best gear ratio|[-]", "ratio by speed|[-]",
)  # fmt: skip
NEED_HEADER = (
    "", "peak|[N m]", "p99|[N m]", "RMS|[N m]", "holding|[N m]", "leg lost|[N m]",
    "peak speed|[rad/s]", "RMS|[rad/s]", "power|[W]", "energy +|[J]", "energy -|[J]",
)  # fmt: skip


def budget_text(budget: MotorBudget) -> str:
    """Return all tables of a motor's budget, with units."""
    verdict = "PASSES" if budget.passes else "FAILS"
    head = [f"{budget.motor} in {budget.demand.robot}: {verdict}", _allowed(budget)]
    head += [f"  {reason}" for reason in budget.reasons]
    uses = [_use_cells(row, f"{row.kind} ({row.joint})") for row in budget.kinds]
    uses += [_use_cells(row, row.joint) for row in budget.joints]
    inertias = [_inertia_cells(row, budget.demand) for row in budget.joints]
    notes = ["Notes", *(f"  {note}" for note in budget.notes)]
    per = "window" if budget.demand.cycles is None else "cycle"
    blocks = (
        head,
        ["Need over what is allowed; a use passes at 1 or below", *aligned(USE_HEADER, uses)],
        demand_lines(budget.demand),
        ["Rotor and gear", *aligned(INERTIA_HEADER, inertias)],
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
        "peak_torque", "p99_torque", "rms_torque", "holding", "holding_lost_leg", "peak_speed",
        "rms_speed", "peak_power", "positive_energy", "negative_energy",
    )  # fmt: skip
    rows = [
        [joint, *(number(getattr(demand, name)[j]) for name in names)]
        for j, joint in enumerate(demand.joint_names)
    ]
    per = "window" if demand.cycles is None else "cycle"
    return [f"Need of every joint; energies per {per}", *aligned(NEED_HEADER, rows)]


def work_lines(demand: JointDemand) -> list[str]:
    """Return mechanical work and cost of transport."""
    positive, negative = demand.positive_energy.sum(), demand.negative_energy.sum()
    rows = [
        ("mechanical work given by the joints", positive, "J"),
        ("mechanical work taken up by the joints", negative, "J"),
        ("mechanical cost of transport, work by its size", demand.cost_of_transport, ""),
        ("the same, work given only", demand.cost_of_transport_positive, ""),
    ]
    return [f"  {name:<50}{number(value)} {unit}".rstrip() for name, value, unit in rows]


def battery_lines(load: BatteryLoad) -> list[str]:
    """Return what the battery gives; an estimate from data-sheet currents."""
    if load.unknown:
        return [f"  battery current and electrical power: unknown ({load.unknown})"]
    rows = [
        ("supply under load", load.voltage, "V"),
        ("largest current of all together", load.peak_current, "A"),
        ("sum of the joints' own peaks, for comparison", load.sum_of_peaks, "A"),
        ("mean current", load.mean_current, "A"),
        ("RMS current", load.rms_current, "A"),
        ("mean power, nothing given back", load.mean_power, "W"),
        ("mean power, braking gives back", load.mean_power_regeneration, "W"),
        ("energy, nothing given back", load.energy, "J"),
        ("energy, braking gives back", load.energy_regeneration, "J"),
        ("electrical cost of transport, nothing given back", load.cost_of_transport, ""),
        ("the same, braking gives back", load.cost_of_transport_regeneration, ""),
    ]
    lines = [f"  {name:<50}{number(value)} {unit}".rstrip() for name, value, unit in rows]
    return [*lines, "  estimated from the data sheet's stall and standby currents"]


def number(value: float | str | None, digits: int = 3) -> str:
    """Return a number as text; `unknown` of None and NaN."""
    if value is None or isinstance(value, str) or value != value:
        return UNKNOWN
    return f"{value:.{digits}g}"


def _allowed(budget: MotorBudget) -> str:
    d = budget.derating
    return (
        f"allowed: {d.peak:g} of the torque-speed line at {d.voltage:g} of the rated voltage; "
        f"for ever the rated torque, or {d.continuous:g} of stall where none is published"
    )


def _use_cells(row: MotorUse, name: str) -> Sequence[str]:
    return (
        name, "passes" if row.passes else "FAILS", number(row.peak_use), number(row.margin),
        number(100.0 * row.outside_share), number(row.continuous_use), number(row.thermal_use),
        number(row.holding_use), number(row.lost_leg_use), number(row.speed_use),
        number(row.current_peak), number(row.current_rms), number(row.winding_temperature),
    )  # fmt: skip


def _inertia_cells(row: MotorUse, demand: JointDemand) -> Sequence[str]:
    load = demand.load_inertia[demand.joint_names.index(row.joint)]
    return (
        row.joint, number(load), number(row.reflected_inertia), number(row.inertia_ratio),
        number(row.rms_with_rotor), number(row.optimal_ratio), number(row.ratio_limit),
    )  # fmt: skip
