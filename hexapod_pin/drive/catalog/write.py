"""Write a file of motors that `load_catalog` reads back to the same records."""

from __future__ import annotations

import csv
import io

from hexapod_pin.drive.catalog.columns import HEADERS, ORDER
from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.foreign_text import csv_cell


def catalog_text(records: tuple[MotorRecord, ...]) -> str:
    """Return the records as comma-separated values, in SI units with the units in the header."""
    out = io.StringIO(newline="")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([HEADERS[field][0] for field in ORDER])
    for record in records:
        writer.writerow([_cell(getattr(record, field)) for field in ORDER])
    return out.getvalue()


def _cell(value: str | float | None) -> str:
    """Return a cell's text; numbers with as many digits as their bits take."""
    if value is None:
        return ""
    if isinstance(value, str):
        return csv_cell(value)
    return repr(int(value)) if value == int(value) and abs(value) < 1e9 else repr(value)
