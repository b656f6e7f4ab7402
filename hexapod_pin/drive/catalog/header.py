"""The header of a file of motors: every column understood, and those there that must be."""

from __future__ import annotations

from difflib import get_close_matches

from hexapod_pin.drive.catalog.columns import BY_HEADER, COMPUTED, HEADERS, REQUIRED, TEXTS
from hexapod_pin.errors import CatalogError, CatalogFault

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
    there, told = set(header), {_quantity(name) for name in header}
    return [
        CatalogFault(1, HEADERS[field][0], "", f"there, as {' or '.join(HEADERS[field])}")
        for field in REQUIRED
        if there.isdisjoint(HEADERS[field]) and field not in told
    ]
