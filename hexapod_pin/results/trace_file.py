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
from hexapod_pin.results.trace_layout import LAYOUT, SCHEMA, SCHEMA_VERSION, digest_of
from hexapod_pin.results.trace_schema import DERIVED, ENERGY, ERROR, checked_trace

DAMAGED = "damaged: its content does not match its digest"

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
    told = attributes.get("digest")
    try:
        trace = _from_arrays(arrays, _recorded(attributes), added)
    except (ParameterError, RecursionError) as error:
        damage = "" if _stored_digest(arrays) == str(told) else f"{DAMAGED}; "
        raise TraceFileError(f"{path}: {damage}{error}") from error
    if trace.digest_without(added) != str(told):
        raise TraceFileError(f"{path}: {DAMAGED}.")
    return trace


def _stored_digest(arrays: Mapping[str, npt.NDArray[Any]]) -> str | None:
    """Return the digest of what a file holds, fit for a trace or not; None where it has none."""
    names = [name for name in LAYOUT if name in arrays]
    names += sorted(name for name in arrays if name.startswith(ENERGY) and name != DERIVED)
    names += [ERROR + name for name in QUANTITIES if ERROR + name in arrays]
    try:
        texts = (json.loads(arrays[name].item()) for name in ("counters", "meta"))
        return digest_of(
            {name: arrays[name] for name in names}, tuple(arrays["joint"]), tuple(arrays["foot"]),
            *texts,
        )  # fmt: skip
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError):
        return None  # too far from a trace to have one


def _schema_version(path: str | Path, attributes: Mapping[str, Any]) -> int:
    """Return a file's schema; refuse files that are no traces, and traces of a later schema."""
    found = attributes.get("schema")
    if not isinstance(found, str) or found != SCHEMA:
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

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    absent = (*left_out(recorded), *added)
    texts = checked_trace(arrays, absent)
    stored = (name for name in arrays if name.startswith(ENERGY) and name != DERIVED)
    energy = {name.removeprefix(ENERGY): arrays[name] for name in stored}
    errors = {name: arrays[ERROR + name] for name in QUANTITIES if ERROR + name in arrays}
    return Trace(
        energy=None if "energy" in absent else energy,  # type: ignore[arg-type]
        counters=texts.counters,
        meta=texts.meta,
        joint_names=texts.joint_names,
        foot_names=texts.foot_names,
        error=ErrorEstimate(**errors) if errors else None,
        **{name: None if name in absent else arrays[name] for name in LAYOUT},  # type: ignore[arg-type]
    )
