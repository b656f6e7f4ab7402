"""One file for all results of a study: a group for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.results import gait_energy, torque_map, trace_layout
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.netcdf import netcdf_groups, read_netcdf, write_netcdf
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import trace_from_group

SCHEMA, SCHEMA_VERSION = "hexapod_pin.study", 1

StudyPart = TorqueMap | GaitEnergy | Trace
"""What a study may hold."""

_READERS: Mapping[str, Callable[[str, Any], StudyPart]] = {
    torque_map.SCHEMA[0]: TorqueMap.from_group,
    gait_energy.SCHEMA[0]: GaitEnergy.from_group,
    trace_layout.SCHEMA: trace_from_group,
}


@checked
def write_study(path: str | Path, parts: Mapping[str, StudyPart]) -> Path:
    """Write results into one netCDF-4 file, wholly or not at all, and return its path.

    `xarray.open_dataset(path, group=name, engine="h5netcdf")` opens one of them.

    Args:
        path: the file.
        parts: the results by the names of their groups.

    Raises:
        ParameterError: no part, or a name that no group can have, or something else than results.
        TraceFileError: the file cannot be written; an old one stays as it was.
    """
    if not parts:
        raise ParameterError("parts", parts, "at least one result by its name")
    for name, part in parts.items():
        if not name.isidentifier():
            raise ParameterError("parts", name, "names of letters, digits and _")
        _require_part(name, part)
    groups = {name: part.group() for name, part in parts.items()}
    return write_netcdf(path, {}, {"schema": SCHEMA, "schema_version": SCHEMA_VERSION}, groups)


def _require_part(name: str, part: object) -> None:
    if not isinstance(part, StudyPart):
        known = "a TorqueMap, GaitEnergy or Trace"
        raise ParameterError(f"parts[{name!r}]", type(part).__name__, known)


@checked
def load_study(path: str | Path) -> dict[str, StudyPart]:
    """Read all results that `write_study` wrote, each equal to what was written.

    Raises:
        TraceFileError: the file is missing, damaged, no study, or of a newer schema.
    """
    attributes = read_netcdf(path)[1]
    schema = attributes.get("schema")
    if not isinstance(schema, str) or schema != SCHEMA:
        raise TraceFileError(f"{path}: not a study (schema {schema!r}).")
    version = attributes.get("schema_version")
    if version != SCHEMA_VERSION:
        raise TraceFileError(
            f"{path}: schema version {version}; this release reads {SCHEMA_VERSION}."
        )
    return {name: _part(path, name) for name in netcdf_groups(path)}


def _part(path: str | Path, name: str) -> StudyPart:
    found, where = read_netcdf(path, name), f"{path}, group {name}"
    schema = str(found[1].get("schema"))
    if schema not in _READERS:
        raise TraceFileError(f"{where}: schema {schema!r} is none of {', '.join(_READERS)}.")
    return _READERS[schema](where, found)
