"""What a file's name says of its format: endings that are written, and the refusal of others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hexapod_pin.errors import TraceFileError

NETCDF = (".nc", ".h5", ".hdf5")
"""Endings of netCDF-4 files, which are HDF5."""

CSV = (".csv", ".csv.gz")
"""Endings of tables of samples, plain and compressed."""

JSON = (".json",)


def ending(path: str | Path, allowed: Sequence[str]) -> str | None:
    """Return which of some endings a path has, upper or lower case; None: none of them."""
    name = Path(path).name.lower()
    return next((end for end in allowed if name.endswith(end) and name != end), None)


def check_ending(path: str | Path, allowed: Sequence[str]) -> str:
    """Return which of some endings a path has.

    Raises:
        TraceFileError: none of them; names them all.
    """
    found = ending(path, allowed)
    if found is None:
        raise TraceFileError(f"{path}: must end in {', '.join(allowed)}: its ending is its format.")
    return found
