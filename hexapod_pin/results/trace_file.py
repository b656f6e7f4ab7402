"""A trace, or all results of a study, is read from its netCDF file."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy.typing as npt

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.file_schema import (
    ArrayRule,
    Bound,
    FileData,
    check_arrays,
    check_data,
    check_names,
    json_object,
    text_of,
)
from hexapod_pin.results.checkpoint import Checkpoint, CheckpointData
from hexapod_pin.results.error_estimate import QUANTITIES, ErrorEstimate
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.result_files import (
    CSV,
    NETCDF,
    ending,
    netcdf_groups,
    read_netcdf,
    require_schema,
    write_netcdf,
)
from hexapod_pin.results.run_facts import left_out, recorded_groups
from hexapod_pin.results.run_record import RunRecord
from hexapod_pin.results.samples import (
    BASE_Q,
    BASE_V,
    ENERGIES,
    PREFIX,
    PeakStates,
    RequestedSamples,
)
from hexapod_pin.results.schema import schema
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import SCHEMA, SCHEMA_VERSION, Trace, digest_of

DAMAGED = "damaged: its content does not match its digest"

JSON_TEXTS = ("run", "counters", "checkpoint", "summary", "errors")
"""Variables that hold JSON."""


ENERGY, ERROR = "energy_", "error_"
"""How the names of energies and of estimated errors begin."""

DERIVED = "energy_residual"
"""Follows from the others; not read."""


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
    require_schema(path, attributes, (SCHEMA, SCHEMA_VERSION))
    digest = attributes.get("digest")
    try:
        trace = _from_arrays(arrays, _recorded(attributes))
    except (ParameterError, RecursionError) as error:
        damage = "" if _stored_digest(arrays) == str(digest) else f"{DAMAGED}; "
        raise TraceFileError(f"{path}: {damage}{error}") from error
    if trace.digest != str(digest):
        raise TraceFileError(f"{path}: {DAMAGED}.")
    return trace


def _stored_digest(arrays: Mapping[str, npt.NDArray[Any]]) -> str | None:
    """Return the digest of what a file holds, fit for a trace or not; None where it has none."""
    names = [name for name in (*schema(Trace), *schema(RequestedSamples)) if name in arrays]
    names += sorted(name for name in arrays if name.startswith(ENERGY) and name != DERIVED)
    names += [name for name in peak_names() if name in arrays]
    names += [ERROR + name for name in QUANTITIES if ERROR + name in arrays]
    try:
        texts = {name: json.loads(arrays[name].item()) for name in JSON_TEXTS if name in arrays}
        return digest_of(
            {name: arrays[name] for name in names}, tuple(arrays["joint"]), tuple(arrays["foot"]),
            {**texts, "case": text_of("case", arrays["case"])},
        )  # fmt: skip
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError, ParameterError):
        return None  # too far from a trace to have one


def _recorded(attributes: Mapping[str, Any]) -> tuple[str, ...] | None:
    """Return the groups that a file lists; None: the usual ones."""
    listed = attributes.get("recorded")
    return None if listed is None else recorded_groups(str(listed).split(", "))


def _from_arrays(arrays: Mapping[str, npt.NDArray[Any]], recorded: tuple[str, ...] | None) -> Trace:
    """Build a trace from the variables of a file and the groups that it holds, None: the usual.

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    absent = left_out(recorded)
    texts = checked_trace(arrays, absent)
    sizes = {"joint": len(texts.joint_names), "foot": len(texts.foot_names)}
    run = RunRecord.from_dict(texts.run, texts.case, **sizes)
    names = (texts.joint_names, texts.foot_names, texts.counters)
    gathered = None if texts.data is None else Summary.from_data(
        texts.data, *names, run.of_summary, texts.errors, ("summary", "errors")
    )  # fmt: skip
    if texts.checkpoint is not None:
        checkpoint = Checkpoint.from_dict(texts.checkpoint)
        run = run.model_copy(update={"checkpoint": checkpoint})
    stored = (name for name in arrays if name.startswith(ENERGY) and name != DERIVED)
    energy = {name.removeprefix(ENERGY): arrays[name] for name in stored}
    errors = {name: arrays[ERROR + name] for name in QUANTITIES if ERROR + name in arrays}
    return Trace(
        energy=None if "energy" in absent else energy,  # type: ignore[arg-type]
        counters=texts.counters,
        run=run,
        gathered=gathered,
        joint_names=texts.joint_names,
        foot_names=texts.foot_names,
        error=ErrorEstimate(**errors) if errors else None,
        peaks=PeakStates.of_arrays(arrays, texts.joint_names, texts.foot_names),
        requested=RequestedSamples.of(
            {name: one for name, one in arrays.items() if name not in absent},
            texts.joint_names,
            texts.foot_names,
        ),
        **{name: None if name in absent else arrays[name] for name in schema(Trace)},  # type: ignore[arg-type]
    )


# What the file of a trace must hold.


class Counters(FileData):
    """`Trace.counters`, whatever their names."""

    __pydantic_extra__: dict[str, Bound]


ENERGY_RULE = ArrayRule(("time",), "J")
ERROR_RULE = ArrayRule(("time",), least=0.0, ascending="weakly")


OPTIONAL = ("summary", "errors", "checkpoint")
"""Texts that a trace need not have."""


class TraceParts(NamedTuple):
    """Texts of a file that were checked."""

    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    counters: dict[str, Any]
    run: dict[str, Any]
    case: str
    checkpoint: dict[str, Any] | None
    data: dict[str, Any] | None
    errors: dict[str, Any]


def checked_trace(
    arrays: Mapping[str, npt.NDArray[Any]], absent: Collection[str] = ()
) -> TraceParts:
    """Check all variables of a trace's file and return its texts.

    Args:
        arrays: the variables.
        absent: arrays that the file need not hold.

    Raises:
        ParameterError: a variable is missing or breaks its rule.
    """
    joints, feet = (
        check_names("joint", arrays.get("joint")),
        check_names("foot", arrays.get("foot")),
    )
    time = arrays.get("time")
    if time is None or time.ndim != 1 or not len(time):
        raise ParameterError("time", None if time is None else time.shape, "at least one time [s]")
    sizes = {
        "time": len(time), "joint": len(joints), "foot": len(feet), "axis": 3,
        "q_name": len(BASE_Q) + len(joints), "v_name": len(BASE_V) + len(joints),
        "peak": len(joints),
    }  # fmt: skip
    check_arrays(arrays, _rules(arrays, absent), sizes)
    texts = {name: json_object(name, arrays.get(name)) for name in ("run", "counters")}
    more = {name: json_object(name, arrays[name]) for name in OPTIONAL if name in arrays}
    own = {"joint": len(joints), "foot": len(feet)}
    check_data(Counters, "counters", texts["counters"])
    if "checkpoint" in more:
        check_data(CheckpointData, "checkpoint", more["checkpoint"], **own)
    return TraceParts(
        joints, feet, texts["counters"], texts["run"], text_of("case", arrays.get("case")),
        more.get("checkpoint"), more.get("summary"), more.get("errors", {}),
    )  # fmt: skip


def _rules(arrays: Mapping[str, npt.NDArray[Any]], absent: Collection[str]) -> dict[str, ArrayRule]:
    """Return the rules of the arrays that are there or must be."""
    sampled = {**schema(Trace), **schema(RequestedSamples)}
    rules: dict[str, ArrayRule] = {k: one for k, one in sampled.items() if k not in absent}
    if "energy" not in absent:
        stored = [name for name in arrays if name.startswith(ENERGY) and name != DERIVED]
        rules |= dict.fromkeys([*(ENERGY + name for name in ENERGIES), *stored], ENERGY_RULE)
    errors = [ERROR + name for name in QUANTITIES if ERROR + name in arrays]
    if errors:
        needed = (ERROR + name for name in ("place", "turn", "joint"))
        rules |= dict.fromkeys([*needed, *errors], ERROR_RULE)
    if any(name in arrays for name in peak_names()):
        rules |= peak_names()
    return rules


def peak_names() -> dict[str, ArrayRule]:
    """Return the rules of the states of peaks by their names in a file."""
    return {PREFIX + name: one for name, one in schema(PeakStates).items()}


# One file for all results of a study: a group for each.

STUDY_SCHEMA, STUDY_SCHEMA_VERSION = "hexapod_pin.study_file", 1

StudyPart = TorqueMap | GaitEnergy | Trace
"""What a study may hold."""

_READERS: Mapping[str, Callable[[str, Any], StudyPart]] = {
    TorqueMap.FILE[0]: TorqueMap.from_group,
    GaitEnergy.FILE[0]: GaitEnergy.from_group,
    SCHEMA: trace_from_group,
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
    for name in parts:
        if not name.isidentifier():
            raise ParameterError("parts", name, "names of letters, digits and _")
    groups = {name: part.group() for name, part in parts.items()}
    return write_netcdf(
        path, {}, {"schema": STUDY_SCHEMA, "schema_version": STUDY_SCHEMA_VERSION}, groups
    )


@checked
def load_study(path: str | Path) -> dict[str, StudyPart]:
    """Read all results that `write_study` wrote, each equal to what was written.

    Raises:
        TraceFileError: the file is missing, damaged, no study, or of a newer schema.
    """
    attributes = read_netcdf(path)[1]
    schema = attributes.get("schema")
    if not isinstance(schema, str) or schema != STUDY_SCHEMA:
        raise TraceFileError(f"{path}: not a study (schema {schema!r}).")
    version = attributes.get("schema_version")
    if version != STUDY_SCHEMA_VERSION:
        raise TraceFileError(
            f"{path}: schema version {version}; this release reads {STUDY_SCHEMA_VERSION}."
        )
    return {name: _part(path, name) for name in netcdf_groups(path)}


def _part(path: str | Path, name: str) -> StudyPart:
    found, where = read_netcdf(path, name), f"{path}, group {name}"
    schema = str(found[1].get("schema"))
    if schema not in _READERS:
        raise TraceFileError(f"{where}: schema {schema!r} is none of {', '.join(_READERS)}.")
    return _READERS[schema](where, found)
