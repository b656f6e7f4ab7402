"""Read a trace from its netCDF-4 file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.results.error_estimate import QUANTITIES, ErrorEstimate
from hexapod_pin.results.file_ending import CSV, NETCDF, ending
from hexapod_pin.results.netcdf import read_netcdf
from hexapod_pin.results.recording import left_out, recorded_groups
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_layout import LAYOUT, SCHEMA, SCHEMA_VERSION

ADDED = {2: ("foot_impulse",)}
"""Arrays by the schema they came with; earlier foot forces are means, which give the impulses."""


@checked
def load_trace(path: str | Path) -> Trace:
    """Read a trace that `Trace.save` wrote; equal to it bit for bit.

    Raises:
        TraceFileError: the file is missing, truncated, damaged, of another kind or of a newer
            schema; the message names the file and the reason.
    """
    if ending(path, CSV) is not None:
        raise TraceFileError(
            f"{path}: a CSV file is for reading elsewhere: it holds the samples without what a "
            f"trace knows of its run. Save the trace as {', '.join(NETCDF)} to read it again."
        )
    return trace_from_group(str(path), read_netcdf(path))


def trace_from_group(path: str, group: tuple[Mapping[str, Any], Mapping[str, Any]]) -> Trace:
    """Return the trace of a group's arrays and attributes; `path` is for messages.

    Raises:
        TraceFileError: as `load_trace`.
    """
    arrays, attributes = group
    version = _schema_version(path, attributes)
    added = [name for since, names in ADDED.items() if version < since for name in names]
    try:
        trace = _from_arrays(arrays, _recorded(attributes), added)
    except KeyError as error:
        raise TraceFileError(f"{path}: variable {error.args[0]!r} is missing.") from error
    except (ParameterError, ValueError, TypeError, AttributeError) as error:
        raise TraceFileError(f"{path}: damaged ({error})") from error
    if trace.digest_without(added) != attributes.get("digest"):
        raise TraceFileError(f"{path}: damaged: its content does not match its digest.")
    return trace


def _schema_version(path: str | Path, attributes: Mapping[str, Any]) -> int:
    """Return a file's schema; refuse files that are no traces, and traces of a later schema."""
    if attributes.get("schema") != SCHEMA:
        found = attributes.get("schema")
        raise TraceFileError(f"{path}: not a trace (schema {found!r} instead of {SCHEMA!r}).")
    version = attributes.get("schema_version")
    if not isinstance(version, int | np.integer) or not 1 <= version <= SCHEMA_VERSION:
        raise TraceFileError(
            f"{path}: schema version {version}; this release reads versions up to "
            f"{SCHEMA_VERSION}: use the release of hexapod_pin that wrote the file, or a later one."
        )
    return int(version)


def _recorded(attributes: Mapping[str, Any]) -> tuple[str, ...] | None:
    """Return the groups that a file says it holds; None: all."""
    told = attributes.get("recorded")
    return None if told is None else recorded_groups(str(told).split(", "))


def _from_arrays(
    arrays: Mapping[str, npt.NDArray[Any]], recorded: tuple[str, ...] | None, added: Sequence[str]
) -> Trace:
    """Build a trace from the variables of a file and the groups that it holds, None for all.

    `added`: arrays that came with later schemas.
    """
    prefix = "energy_"
    stored = (name for name in arrays if name.startswith(prefix) and name != "energy_residual")
    absent = (*left_out(recorded), *added)
    energy = {name[len(prefix) :]: arrays[name] for name in stored}
    errors = {name: arrays[f"error_{name}"] for name in QUANTITIES if f"error_{name}" in arrays}
    return Trace(
        energy=None if "energy" in absent else energy,  # type: ignore[arg-type]
        counters=json.loads(arrays["counters"].item()),
        meta=json.loads(arrays["meta"].item()),
        joint_names=tuple(arrays["joint"]),
        foot_names=tuple(arrays["foot"]),
        error=ErrorEstimate(**errors) if errors else None,
        **{name: None if name in absent else arrays[name] for name in LAYOUT},  # type: ignore[arg-type]
    )
