"""A file of motors is read, and every invalid row is reported in one error."""

from __future__ import annotations

import csv
import io
import math
from difflib import get_close_matches
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.drive.catalog.catalog import BY_HEADER, COMPUTED, HEADERS, REQUIRED, TEXTS, Catalog
from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.errors import CatalogError, CatalogFault, ParameterError
from hexapod_pin.foreign_text import text_of_cell
from hexapod_pin.user_file import TEXT_BYTES, read_bytes, reason_of, user_path

PACKAGE_FILE = "motors.csv"

SAME_NUMBER = 0.005
"""Relative difference up to which a quantity stated in two units is stated once [-]."""


@checked
def load_catalog(path: str | Path | None = None) -> Catalog:
    """Read a catalogue of motors.

    Args:
        path: a comma-separated file (UTF-8) with one motor at one voltage per row and headers
            with units, as docs/motors.md describes; None: the package's own.

    Raises:
        CatalogError: the file is missing or no such file, a header is not understood, or rows
            cannot be used; every such row is listed with line, column, value and what is allowed.
    """
    return _packaged() if path is None else read_catalog(_text(user_path(path)), str(path))


@cache
def _packaged() -> Catalog:
    """Return the package's own catalogue, read once."""
    text = resources.files(__package__).joinpath(PACKAGE_FILE).read_text(encoding="utf-8")
    return read_catalog(text, f"{PACKAGE_FILE} of hexapod_pin")


def _text(path: Path) -> str:
    """Return the file's text.

    Raises:
        CatalogError: it cannot be read, or is no text.
    """
    hint = "Save the table as CSV, UTF-8, from your spreadsheet."
    try:
        data = read_bytes(path, TEXT_BYTES)
    except (OSError, ValueError) as error:
        fault = CatalogFault(0, "", str(path), f"a readable file ({reason_of(error)})")
        raise CatalogError(str(path), [fault]) from error
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CatalogError(
            str(path),
            [CatalogFault(0, "", f"byte {error.start}", "text in UTF-8", hint)],
        ) from error
    if "\0" in text:
        raise CatalogError(str(path), [CatalogFault(0, "", "NUL bytes", "text", hint)])
    return text


def read_catalog(text: str, source: str) -> Catalog:
    """Read a catalogue from the text of a file; `source` names it in messages.

    Raises:
        CatalogError: as of `load_catalog`.
    """
    rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: dict[str, tuple[int, MotorRecord]] = {}
    faults: list[CatalogFault] = []
    try:
        header = [name.strip() for name in next(rows, [])]
        check_header(header, source)
        start = rows.line_num + 1
        for cells in rows:
            if any(cell.strip() for cell in cells):
                _add(records, faults, start, header, cells)
            start = rows.line_num + 1
    except csv.Error as error:
        fault = CatalogFault(rows.line_num, "", str(error), "comma-separated values")
        raise CatalogError(source, [*faults, fault]) from error
    if faults:
        raise CatalogError(source, faults)
    if not records:
        raise CatalogError(source, [CatalogFault(1, "", "no rows", "at least one row of a motor")])
    return Catalog(tuple(record for _, record in records.values()), source)


def _add(
    records: dict[str, tuple[int, MotorRecord]],
    faults: list[CatalogFault],
    line: int,
    header: list[str],
    cells: list[str],
) -> None:
    """Add a row's record, or what is wrong with it."""
    try:
        record = _record(line, header, cells)
    except _RowError as error:
        faults.append(error.fault)
        return
    key = record.name.casefold()
    if key in records:
        hint = f"Line {records[key][0]} has it already: remove one, or give it another name."
        faults.append(
            CatalogFault(line, "model", record.name, "a name and voltage of its own", hint)
        )
        return
    records[key] = (line, record)


class _RowError(Exception):
    """A row that cannot be used."""

    def __init__(self, fault: CatalogFault) -> None:
        super().__init__(str(fault))
        self.fault = fault


def _record(line: int, header: list[str], cells: list[str]) -> MotorRecord:
    if len(cells) != len(header):
        hint = "Put a cell that holds a comma in double quotes; leave unknown cells empty."
        allowed = f"{len(header)} cells, as in the header"
        raise _RowError(CatalogFault(line, "", f"{len(cells)} cells", allowed, hint))
    fields: dict[str, Any] = {}
    columns: dict[str, str] = {}
    for name, cell in zip(header, (cell.strip() for cell in cells), strict=True):
        if name in TEXTS:
            fields[name], columns[name] = text_of_cell(cell), name
        elif name in BY_HEADER and cell:
            _put(line, name, _number(line, name, cell), fields, columns)
    try:
        return MotorRecord(**fields)
    except ParameterError as error:
        raise _RowError(_fault(line, error, fields, columns)) from error


def _put(
    line: int, name: str, number: float, fields: dict[str, Any], columns: dict[str, str]
) -> None:
    field, factor = BY_HEADER[name]
    value = number * factor
    known = fields.get(field)
    if known is not None and abs(value - known) > SAME_NUMBER * abs(known):
        allowed = f"that of {columns[field]}, {known / factor:.4g}"
        raise _RowError(CatalogFault(line, name, number, allowed, "Leave one of them empty."))
    fields.setdefault(field, value)
    columns.setdefault(field, name)


def _number(line: int, name: str, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        comma = cell.count(",") == 1 and cell.replace(",", "").isdigit()
        hint = "Write a decimal point." if comma else "Leave the cell empty where it is unknown."
        raise _RowError(CatalogFault(line, name, cell, "a number", hint)) from None
    if not math.isfinite(number):
        hint = "Leave the cell empty where it is unknown."
        raise _RowError(CatalogFault(line, name, cell, "a finite number", hint))
    return number


def _fault(
    line: int, error: ParameterError, fields: dict[str, Any], columns: dict[str, str]
) -> CatalogFault:
    """Return a record's error with the column of the file and the value as written."""
    field = error.name.rpartition(".")[2]
    column = columns.get(field, HEADERS[field][0])
    value = error.value
    if column in BY_HEADER and isinstance(value, float):
        value = value / BY_HEADER[column].factor
    hint = error.hint
    if error.value is None:
        value, hint = "", "Every row needs it."
    return CatalogFault(line, column, value, error.allowed, hint)


# The header of a file of motors: every column understood, and those there that must be.

OTHER_DELIMITERS = {";": "semicolons", "\t": "tabs", "|": "bars"}


def check_header(header: list[str], source: str) -> None:
    """Check the header of a file of motors.

    Raises:
        CatalogError: there is none, it is separated by something else, has columns that are not
            understood, lack their unit or stand twice, or lacks one that must be there.
    """
    if not any(header):
        raise CatalogError(source, [CatalogFault(1, "", "", "a header and rows: it is empty")])
    faults = _delimiter(header) or [*_unknown(header), *_twice(header), *_missing(header)]
    if faults:
        raise CatalogError(source, faults)


def _delimiter(header: list[str]) -> list[CatalogFault]:
    if len(header) > 1:
        return []
    for mark, name in OTHER_DELIMITERS.items():
        if mark in header[0]:
            hint = "Save it with commas, and decimal points in numbers."
            return [CatalogFault(1, "", f"a header with {name}", "separated by commas", hint)]
    return []


def _unknown(header: list[str]) -> list[CatalogFault]:
    known = [*BY_HEADER, *TEXTS, *COMPUTED]
    return [_not_understood(name) for name in header if name not in known]


def _not_understood(name: str) -> CatalogFault:
    """Return what is wrong with a header that is not understood."""
    field = _quantity(name)
    if field is not None:
        allowed = f"with its unit: {' or '.join(HEADERS[field])}"
        return CatalogFault(1, name, name, allowed)
    near = get_close_matches(name, [*BY_HEADER, *TEXTS], n=1)
    hint = f"Perhaps {near[0]}. " if near else ""
    written = ", ".join(names[0] for names in HEADERS.values())
    return CatalogFault(1, name, name, f"one of {written}", f"{hint}Remarks go into `note`.")


def _quantity(name: str) -> str | None:
    """Return the quantity of a header that lacks its unit or has one that is not known."""
    fields = [field for field in HEADERS if name == field or name.startswith(f"{field}_")]
    return max(fields, key=len, default=None)


def _twice(header: list[str]) -> list[CatalogFault]:
    repeated = sorted({name for name in header if header.count(name) > 1})
    return [CatalogFault(1, name, name, "there once") for name in repeated]


def _missing(header: list[str]) -> list[CatalogFault]:
    there, known = set(header), {_quantity(name) for name in header}
    return [
        CatalogFault(1, HEADERS[field][0], "", f"there, as {' or '.join(HEADERS[field])}")
        for field in REQUIRED
        if there.isdisjoint(HEADERS[field]) and field not in known
    ]
