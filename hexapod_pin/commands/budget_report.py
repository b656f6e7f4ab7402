"""What `hexapod-pin budget` prints."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.commands.terminal import echo

if TYPE_CHECKING:
    from hexapod_pin.results.peak_verdict import PeakVerdicts
    from hexapod_pin.results.sizing import MotorBudget, MotorRanking
    from hexapod_pin.results.trace import Trace


def motors_of(
    trace: Trace, file: Path | None, motor: str | None, voltage: float | None
) -> MotorRanking | MotorBudget:
    """Return one motor held against a run, or all of a catalogue.

    Raises:
        CatalogError: the file is not usable.
        UnknownNameError, ParameterError: no such motor or voltage.
    """
    from hexapod_pin.drive.catalog import load_catalog
    from hexapod_pin.results.sizing import motor_budget, motor_ranking

    rows = load_catalog(file)
    if motor is not None:
        return motor_budget(trace, rows.get(motor, voltage))
    chosen = rows if voltage is None else rows.at(voltage)
    return motor_ranking(trace, chosen, source=rows.source)


def print_budget(
    trace: Trace,
    judged: PeakVerdicts | None,
    motors: MotorRanking | MotorBudget | None,
    json: bool,
) -> None:
    """Print the budget, the verdict on its peaks, and motors, as text or JSON."""
    from hexapod_pin.results.torque_budget import torque_budget

    found = torque_budget(trace)
    more: dict[str, Any] = {}
    if judged is not None:
        more["verdict"] = judged.to_dict()
    if motors is not None:
        more["motors"] = motors.to_dict()
    if json:
        echo(found.to_json(**more))
        return
    texts = [part.table() for part in (found, judged, motors) if part is not None]
    echo("\n\n".join(texts))
