"""A trace is written as labelled columns of a file or dataset, or as a CSV table."""

from __future__ import annotations

import csv
import gzip
import io
import json
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.error_estimate import QUANTITIES
from hexapod_pin.results.result_files import CSV, Column, ending
from hexapod_pin.results.run_facts import GROUPS
from hexapod_pin.results.trace_layout import (
    BASE_Q,
    BASE_V,
    LAYOUT,
    SCHEMA,
    SCHEMA_VERSION,
    described,
)

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.results.trace import Trace


def trace_columns(trace: Trace) -> dict[str, Column]:
    """Return everything, with what follows from it, as labelled columns."""
    columns = {
        axis: Column((axis,), np.array(labels, dtype=object), {})
        for axis, labels in axis_labels(trace).items()
        if axis != "time"
    }
    for name, (dims, units, meaning) in LAYOUT.items():
        if name in vars(trace):
            columns[name] = Column(dims, getattr(trace, name), described(units, meaning))
    if "energy" in trace.recorded:
        columns |= _energy_columns(trace)
    if "contacts" in trace.recorded:
        columns |= _contact_columns(trace)
    for name, values in _estimated_errors(trace).items():
        units, meaning = QUANTITIES[name]
        about = described(units, f"estimated error so far of {meaning}")
        columns[f"error_{name}"] = Column(("time",), values, about)
    for name, value in stored_texts(trace).items():
        kind, text = ("TOML", value) if isinstance(value, str) else ("JSON", json.dumps(value))
        columns[name] = Column((), np.array(text, dtype=object), {"long_name": kind})
    return columns


def axis_labels(trace: Trace) -> dict[str, Any]:
    """Return the labels of every axis."""
    return {
        "time": trace.time,
        "q_name": (*BASE_Q, *trace.joint_names),
        "v_name": (*BASE_V, *trace.joint_names),
        "joint": trace.joint_names,
        "foot": trace.foot_names,
        "axis": ("x", "y", "z"),
    }


def _estimated_errors(trace: Trace) -> dict[str, Array]:
    """Return the estimated errors by name; none where the run was not compared with another."""
    return {} if trace.error is None else trace.error.arrays


def stored_arrays(trace: Trace) -> dict[str, Array]:
    """Return the arrays that are stored, by their names in a file."""
    arrays = {name: getattr(trace, name) for name in LAYOUT if name in vars(trace)}
    energy = vars(trace).get("energy", {})
    arrays |= {f"energy_{name}": energy[name] for name in sorted(energy)}
    return arrays | {f"error_{name}": e for name, e in _estimated_errors(trace).items()}


def stored_texts(trace: Trace) -> dict[str, Any]:
    """Return what is stored as text, by its name in a file: plain data as JSON, `case` as TOML."""
    run = trace.run
    found: dict[str, Any] = {
        "run": run.to_dict(), "case": run.case.to_toml(), "counters": dict(trace.counters)
    }  # fmt: skip
    if run.checkpoint is not None:
        found["checkpoint"] = run.checkpoint.to_dict()
    if trace.gathered is not None:
        found |= {"summary": trace.gathered.data, "errors": dict(trace.gathered.errors)}
    return found


def trace_attributes(trace: Trace) -> dict[str, Any]:
    """Return the attributes of the file; `recorded` where it does not hold everything."""
    held = trace.recorded
    some = {} if len(held) == len(GROUPS) else {"recorded": ", ".join(held)}
    return {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "digest": trace.digest, **some}


def _energy_columns(trace: Trace) -> dict[str, Column]:
    """Return the energies and what is missing from their balance."""
    values = {f"energy_{name}": (trace.energy[name], name) for name in sorted(trace.energy)}
    values["energy_residual"] = (trace.energy_residual, "energy that the method lost or made")
    return {
        name: Column(("time",), array, described("J", meaning.replace("_", " ")))
        for name, (array, meaning) in values.items()
    }


def _contact_columns(trace: Trace) -> dict[str, Column]:
    """Return what follows from the foot forces and the ground's normals."""
    feet = ("time", "foot")
    about = described("N", "foot force within the ground, world axes")
    return {
        "normal_force": Column(feet, trace.normal_force, described("N", "along normal")),
        "tangential_force": Column((*feet, "axis"), trace.tangential_force, about),
        "contact": Column(feet, trace.contact, described("1", "the ground pushes")),
    }


# Samples as a CSV table, for spreadsheets and other programs.

Q_UNITS = ("m", "m", "m", "1", "1", "1", "1")
V_UNITS = ("m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s")

LEVEL = 6
"""Compression of ".csv.gz"."""


def csv_bytes(path: str | Path, columns: Mapping[str, Column]) -> bytes:
    """Return a table: a header, then a row per sample; compressed where the path ends in ".gz".

    A heading is a variable, its joint, foot or axis where it has one, and its unit:
    "foot_force.lf_foot.z [N]". Numbers are the shortest that give the same double again; what is
    either true or false is 1 or 0.

    Args:
        path: names the format by its ending.
        columns: of a trace; those along time are written.
    """
    stream = io.StringIO()
    sampled = {name: c for name, c in columns.items() if c.dims[:1] == ("time",)}
    head = [text for name, c in sampled.items() for text in _headings(name, c, columns)]
    csv.writer(stream, lineterminator="\n").writerow(head)
    tables = [c.values.reshape(len(c.values), -1) for c in sampled.values()]
    for row in zip(*(_texts(table) for table in tables), strict=True):
        stream.write(",".join(row) + "\n")
    text = encoded(stream.getvalue())
    if ending(path, CSV[1:]) is None:
        return text
    return gzip.compress(text, LEVEL, mtime=0)


def _headings(name: str, column: Column, columns: Mapping[str, Column]) -> Iterator[str]:
    """Return a heading for each number in a row of a variable."""
    labels = [columns[axis].values.tolist() for axis in column.dims[1:]]
    units = _units(name, column, [len(names) for names in labels])
    for unit, place in zip(units, product(*labels), strict=True):
        yield csv_cell(f"{'.'.join((name, *place))} [{unit}]")


def _units(name: str, column: Column, sizes: list[int]) -> list[str]:
    """Return a unit for each number in a row; a configuration and a velocity hold several."""
    if name == "q":
        return [*Q_UNITS, *["rad"] * (sizes[0] - len(Q_UNITS))]
    if name == "v":
        return [*V_UNITS, *["rad/s"] * (sizes[0] - len(V_UNITS))]
    return [column.attributes["units"]] * int(np.prod(sizes, dtype=int))


def _texts(table: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Iterator[str]:
    """Return the numbers of each row as text."""
    numbers = table.astype(np.int8) if table.dtype == bool else table
    for row in numbers:
        yield ",".join(map(repr, row.tolist()))
