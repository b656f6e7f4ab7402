"""Results are written to netCDF-4 files that are sealed with a checksum.

The ending of a file's name gives its format; JSON holds finite numbers only.
"""

from __future__ import annotations

import io
import math
import re
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import TraceFileError
from hexapod_pin.user_file import read_bytes, reason_of

Result = TypeVar("Result")

ZLIB = 1
"""Level of compression: higher ones take longer and save less than 1 % more of a walk's trace."""

CHUNK_ROWS = 1 << 16
"""Rows of a column that are compressed together."""

MOST_GROWTH = 1100
"""An array is at most so many times as large as its file, by the limit of the compression [-]."""

LEAST_COMPRESSED = 1 << 14
"""Smaller arrays are stored as they are [bytes]."""


MOST_BYTES = 4_000_000_000
"""Largest file that is read [bytes]: the samples that a run may keep, uncompressed."""


class Column(NamedTuple):
    """One variable of a file; a variable named like its only dimension is that axis' labels."""

    dims: tuple[str, ...]  # names of the axes, one per array dimension; () for a scalar
    values: np.ndarray[Any, Any]  # floats, booleans, or str objects
    attributes: Mapping[str, str]  # "units", "long_name", ...


def described(units: str, meaning: str) -> dict[str, str]:
    """Return the attributes of a column."""
    return {"units": units, "long_name": meaning}


class Group(NamedTuple):
    """What one group of a file holds; its axes are its own."""

    columns: Mapping[str, Column]
    attributes: Mapping[str, Any]


def write_netcdf(
    path: str | Path,
    columns: Mapping[str, Column],
    attributes: Mapping[str, Any],
    groups: Mapping[str, Group] | None = None,
) -> Path:
    """Write `columns` and the file's `attributes` to `path`, wholly or not at all.

    The file is composed in memory first: HDF5 cannot recover from a disk that fills up under it.

    Args:
        path: the file.
        columns: of the file itself.
        attributes: of the file itself.
        groups: more columns and attributes, in groups of these names.

    Raises:
        TraceFileError: another ending than that of a netCDF-4 file, or the file cannot be written;
            the old one, if any, is intact.
    """
    import h5netcdf

    check_ending(path, NETCDF)
    image = io.BytesIO()
    with h5netcdf.File(image, "w") as file:
        _write_group(file, Group(columns, attributes))
        for name, group in (groups or {}).items():
            _write_group(file.create_group(name), group)
    image.seek(0, io.SEEK_END)
    image.write(seal_of(image.getvalue()))
    return write_atomically(path, image.getbuffer())


def _write_group(place: Any, group: Group) -> None:
    """Write columns and attributes into a file or one of its groups."""
    place.dimensions = _dimensions(group.columns)
    for name, column in group.columns.items():
        _write_column(place, name, column)
    for key, value in group.attributes.items():
        place.attrs[key] = value


def _dimensions(columns: Mapping[str, Column]) -> dict[str, int]:
    """Return the length of every axis that the columns name."""
    return {
        dim: length
        for column in columns.values()
        for dim, length in zip(column.dims, column.values.shape, strict=True)
    }


def _storage(values: np.ndarray[Any, Any]) -> dict[str, Any]:
    """Return how an array is stored: long ones column by column, compressed without loss."""
    if values.ndim == 0 or values.nbytes < LEAST_COMPRESSED:
        return {}
    chunks = (min(len(values), CHUNK_ROWS), *(1 for _ in values.shape[1:]))
    return {"chunks": chunks, "compression": "gzip", "compression_opts": ZLIB, "shuffle": True}


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
        variable = file.create_variable(name, column.dims, data=values, **_storage(values))
    for key, value in attributes.items():
        variable.attrs[key] = value


def read_netcdf(
    path: str | Path, group: str | None = None
) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]]:
    """Return the arrays of all variables of a file by name, and the file's attributes.

    Text comes back as str objects, everything else as it was stored.

    Args:
        path: the file.
        group: name of the group to read; None: what is in no group.

    Raises:
        TraceFileError: the file is missing, truncated, damaged, or no netCDF-4 file, or has no
            such group.
    """
    found = _read(
        path, lambda file, size: _read_group(file if group is None else file.get(group), size)
    )
    if found is None:
        raise TraceFileError(
            f"{path}: no group {group!r}; it has {', '.join(netcdf_groups(path)) or 'none'}."
        )
    return found


def netcdf_groups(path: str | Path) -> tuple[str, ...]:
    """Return the names of the groups of a file, in the order of the alphabet.

    Raises:
        TraceFileError: as of `read_netcdf`.
    """
    return _read(
        path, lambda file, _: tuple(name for name in file if not hasattr(file[name], "shape"))
    )


def _read(path: str | Path, read: Callable[[Any, int], Result]) -> Result:
    """Return what `read` makes of an open file and its size, or raise what is wrong with it."""
    import h5py  # a netCDF-4 file is HDF5; h5netcdf leaves warnings behind on damage

    try:
        data = read_bytes(path, MOST_BYTES)
    except (OSError, ValueError) as error:
        raise TraceFileError(f"{path}: cannot be read ({reason_of(error)}).") from error
    if is_broken(data):
        raise TraceFileError(f"{path}: damaged: its bytes do not match its checksum.")
    try:  # HDF5 is given the content: a file that it opens itself it locks against its writer
        with h5py.File(h5py.h5f.open_file_image(data)) as file:
            return read(file, len(data))
    except Exception as error:  # HDF5 reports damage by many types, OSError to UnicodeError
        raise TraceFileError(f"{path}: {_damage(data, error)}") from error


def _read_group(
    place: Any, size: int
) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]] | None:
    """Return variables and attributes of a file or a group; None of a variable or of nothing.

    `size`: of the file [bytes].
    """
    if place is None or hasattr(place, "shape"):
        return None
    variables = {name: item for name, item in place.items() if hasattr(item, "shape")}
    arrays = {name: _read_column(variable, size) for name, variable in variables.items()}
    return arrays, {key: _scalar(value) for key, value in place.attrs.items()}


def _scalar(value: Any) -> Any:
    """Return an attribute, which netCDF keeps as an array of one, as a plain value."""
    return value.item() if isinstance(value, np.ndarray) and value.size == 1 else value


def _read_column(variable: Any, size: int) -> np.ndarray[Any, Any]:
    """Return one variable's array, text decoded, from a file of so many bytes."""
    if variable.size * variable.dtype.itemsize > MOST_GROWTH * size:
        raise ValueError(f"{variable.name} has the shape {variable.shape}")
    values = np.asarray(variable[()])
    if values.dtype.kind != "O":
        return values
    text = [item.decode() for item in values.ravel()]
    return np.array(text, dtype=object).reshape(values.shape)


def _damage(data: bytes, error: Exception) -> str:
    """Say in one sentence why the content of a file could not be read."""
    if not data.startswith(b"\x89HDF\r\n\x1a\n"):
        return "not a netCDF-4 file (its first bytes are not those of HDF5)."
    detail = " ".join(str(error).split())
    if "truncated" in detail:
        return f"truncated: {len(data)} bytes are left of a longer file ({detail})."
    return f"damaged ({type(error).__name__}: {detail})."


def require_schema(where: str, attributes: Mapping[str, Any], schema: tuple[str, int]) -> None:
    """Refuse a file, or a group of one, of another kind or of another release's schema.

    Args:
        where: the file, for messages.
        attributes: of the file.
        schema: name and version that are read.

    Raises:
        TraceFileError: it is another one.
    """
    found, version = attributes.get("schema"), attributes.get("schema_version")
    if not isinstance(found, str) or found != schema[0]:
        raise TraceFileError(f"{where}: schema {found!r} instead of {schema[0]!r}.")
    if not isinstance(version, int | np.integer) or version != schema[1]:
        raise TraceFileError(
            f"{where}: schema version {version}; this release reads {schema[1]}: use the release "
            "of hexapod_pin that wrote the file."
        )


# A checksum behind the last byte of a file, checked before anything else looks at the file.
#
# HDF5 follows the links of a file, for ever where damage made them circular; what stands behind
# its end it ignores.

_SEAL = re.compile(rb"\nhexapod_pin crc32 ([0-9a-f]{8})\n")
_LENGTH = len(b"\nhexapod_pin crc32 00000000\n")


def seal_of(data: bytes | memoryview) -> bytes:
    """Return what is to stand behind the data."""
    return b"\nhexapod_pin crc32 %08x\n" % zlib.crc32(data)


def is_broken(data: bytes) -> bool:
    """Whether the content of a file has a seal and is not what was sealed."""
    found = _SEAL.fullmatch(data, max(0, len(data) - _LENGTH))
    if found is None:
        return False
    return b"%08x" % zlib.crc32(memoryview(data)[: len(data) - _LENGTH]) != found[1]


# The format that a file's name gives: endings that are written, and the refusal of others.

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


# Numbers that JSON can hold.


def without_non_finite(value: Any) -> Any:
    """Return nested data with None in place of NaN and infinities, arrays as nested lists."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        return {key: without_non_finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_non_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
