"""A motor selection as CSV: a row for each motor and kind of joint, for other programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.motor_selection import COLUMNS, MotorSelection
from hexapod_pin.results.result_files import check_ending


def write_selection_csv(selection: MotorSelection, path: str | Path) -> Path:
    """Write one row for each motor and kind of joint, wholly or not at all.

    Raises:
        TraceFileError: the ending is not .csv, or the file cannot be written.
    """
    check_ending(path, (".csv",))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for row in _rows(selection):
        writer.writerow([csv_cell(x) if isinstance(x, str) else x for x in row])
    return write_atomically(path, encoded(stream.getvalue()))


def _rows(selection: MotorSelection) -> Iterator[list[Any]]:
    yield [
        "rank", "motor", "voltage [V]", "kind of joint", "passes joint", "passes all",
        *(heading for _, heading in COLUMNS), "robot mass [kg]", "motor mass [kg]", "price",
        "battery peak [A]", "battery mean [A]", "walks in simulation", "reasons", "source",
    ]  # fmt: skip
    for rank, c in enumerate(selection.candidates, start=1):
        walked = f"{sum(run.walks for run in c.runs)} of {len(c.runs)}"
        for use in c.uses:
            record = c.motors[use.kind]
            numbers = [_number(getattr(use, name)) for name, _ in COLUMNS]
            yield [
                rank, record.model, record.voltage, use.kind, use.passes, c.passes, *numbers,
                c.total_mass, record.mass, "" if record.price is None else record.price,
                _number(c.battery_current_peak), _number(c.battery_current_mean), walked,
                "; ".join(use.reasons), record.source,
            ]  # fmt: skip


def _number(value: float) -> Any:
    return "" if math.isnan(value) else value
