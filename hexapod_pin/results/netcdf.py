"""Labelled columns to and from a netCDF-4 file, through h5netcdf."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hexapod_pin.errors import TraceFileError
from hexapod_pin.results.atomic_file import write_atomically


class Column(NamedTuple):
    """One variable of a file; a variable named like its only dimension is that axis' labels."""

    dims: tuple[str, ...]  # names of the axes, one per array dimension; () for a scalar
    values: np.ndarray[Any, Any]  # floats, booleans, or str objects
    attributes: Mapping[str, str]  # "units", "long_name", ...


def write_netcdf(
    path: str | Path, columns: Mapping[str, Column], attributes: Mapping[str, Any]
) -> Path:
    """Write `columns` and the file's `attributes` to `path`, wholly or not at all.

    The file is composed in memory first: HDF5 cannot recover from a disk that fills up under it.

    Raises:
        TraceFileError: the file cannot be written; the old one, if any, is intact.
    """
    import h5netcdf

    image = io.BytesIO()
    with h5netcdf.File(image, "w") as file:
        file.dimensions = _dimensions(columns)
        for name, column in columns.items():
            _write_column(file, name, column)
        for key, value in attributes.items():
            file.attrs[key] = value
    return write_atomically(path, image.getbuffer())


def _dimensions(columns: Mapping[str, Column]) -> dict[str, int]:
    """Return the length of every axis that the columns name."""
    return {
        dim: length
        for column in columns.values()
        for dim, length in zip(column.dims, column.values.shape, strict=True)
    }


def _write_column(file: Any, name: str, column: Column) -> None:
    """Write one column: text as variable-length UTF-8, booleans as xarray reads them."""
    import h5py

    values, attributes = column.values, dict(column.attributes)
    if values.dtype == object:
        variable = file.create_variable(name, column.dims, dtype=h5py.string_dtype())
        variable[...] = values if column.dims else values.item()
    else:
        if values.dtype == bool:
            values, attributes = values.astype(np.int8), {**attributes, "dtype": "bool"}
        variable = file.create_variable(name, column.dims, data=values)
    for key, value in attributes.items():
        variable.attrs[key] = value


def read_netcdf(path: str | Path) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]]:
    """Return the arrays of all variables of a file by name, and the file's attributes.

    Text comes back as str objects, everything else as it was stored.

    Raises:
        TraceFileError: the file is missing, truncated, damaged, or no netCDF-4 file.
    """
    import h5py  # a netCDF-4 file is HDF5; h5netcdf leaves warnings behind on damage

    if not os.path.isfile(path):
        raise TraceFileError(f"{path}: no such file.")
    try:
        with h5py.File(path, "r") as file:
            arrays = {name: _read_column(variable) for name, variable in file.items()}
            return arrays, {key: _scalar(value) for key, value in file.attrs.items()}
    except Exception as error:  # HDF5 reports damage by many types, OSError to UnicodeError
        raise TraceFileError(f"{path}: {_damage(Path(path), error)}") from error


def _scalar(value: Any) -> Any:
    """Return an attribute, which netCDF keeps as an array of one, as a plain value."""
    return value.item() if isinstance(value, np.ndarray) and value.size == 1 else value


def _read_column(variable: Any) -> np.ndarray[Any, Any]:
    """Return one variable's array, text decoded."""
    values = np.asarray(variable[()])
    if values.dtype.kind != "O":
        return values
    text = [item.decode() for item in values.ravel()]
    return np.array(text, dtype=object).reshape(values.shape)


def _damage(path: Path, error: Exception) -> str:
    """Say in one sentence why a file could not be read."""
    try:
        with open(path, "rb") as stream:
            start = stream.read(8)
    except OSError as refusal:
        return f"cannot be read ({refusal.strerror or refusal})."
    if start != b"\x89HDF\r\n\x1a\n":
        return "not a netCDF-4 file (its first bytes are not those of HDF5)."
    detail = " ".join(str(error).split())
    if "truncated" in detail:
        return f"truncated: {path.stat().st_size} bytes are left of a longer file ({detail})."
    return f"damaged ({type(error).__name__}: {detail})."
