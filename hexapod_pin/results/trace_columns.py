"""A trace as the labelled columns of a file or a dataset, with what follows from its samples."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.results.error_estimate import QUANTITIES
from hexapod_pin.results.netcdf import Column
from hexapod_pin.results.recording import GROUPS
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
    for name in ("meta", "counters"):
        text = json.dumps(dict(getattr(trace, name)))
        columns[name] = Column((), np.array(text, dtype=object), {"long_name": "JSON"})
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
