"""What a simulation leaves behind: pure, read-only data, and its file.

A `Trace` knows neither the simulator that made it nor the viewers that show it.
"""

from __future__ import annotations

import csv
import gzip
import hashlib
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import field
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.error_estimate import QUANTITIES, ErrorEstimate
from hexapod_pin.results.result_files import (
    CSV,
    NETCDF,
    Column,
    Group,
    check_ending,
    described,
    ending,
    write_netcdf,
)
from hexapod_pin.results.run_facts import USUAL
from hexapod_pin.results.run_record import UNKNOWN, Event, JointLimits, RunRecord
from hexapod_pin.results.samples import PeakStates, RobotSamples
from hexapod_pin.results.schema import schema
from hexapod_pin.results.summary import Summary
from hexapod_pin.shown import drawn

if TYPE_CHECKING:
    import pandas
    import xarray

SCHEMA = "hexapod_pin.trace"
SCHEMA_VERSION = 1


class Trace(RobotSamples):  # noqa: PLW1641  # no record has a hash
    """Samples of a simulation: T times, n joints, F feet; SI units, radians.

    Arrays are read-only, copied where they were not. Two traces are equal when every bit is,
    but for the wall-clock time of the run. What was not recorded is given as None, and reading
    it raises `NotRecordedError`; `recorded` names what is there. Time, q and v always are.

    Foot forces at the samples are those of the contact law in the sampled state, so that a force
    never pulls and is inside the friction cone. Impulses are integrals of the force over the
    sampling interval that ends at the sample, 0 at the first: momentum adds up. Where none are
    given, the force at the sample is taken as constant over the interval. One `foot_normal` of
    shape (3,) is that of all feet; the default is z.

    Attributes:
        energy: (T,) arrays [J] by name: the state functions "kinetic", "potential", "elastic"; and
            accumulated since t = 0 "servo_work", "joint_damping_loss", "normal_loss",
            "friction_loss" (losses >= 0), and "push_work" where something pushes the robot.
        counters: steps, evaluations, ...
        joint_names: n names.
        foot_names: F names: the feet, and after them the trunk's points with `body_contact`.
        run: how the trace came about: robot, scene, controller, method, what is assumed.
        error: estimated error of the samples; None where a run was not compared with another.
        gathered: what the run came to, which `summary` gives; None where none was gathered.
        peaks: the states in which the joints' torques were largest; None where none were kept:
            without torques, or by another simulator than the core.
        requested: samples that are recorded only where they are named, which `slip_speed`,
            `current` and `temperature` give; None where none were.

    Raises:
        ParameterError: an array has the wrong shape, times do not increase, or an energy is
            missing.
    """

    counters: Mapping[str, int | float] = field(kw_only=True)
    run: RunRecord = UNKNOWN
    error: ErrorEstimate | None = None
    gathered: Summary | None = None
    peaks: PeakStates | None = None

    def __post_init__(self) -> None:
        """Check shapes, copy, and make read-only."""
        super().__post_init__()
        counters = {name: np.asarray(value).item() for name, value in self.counters.items()}
        object.__setattr__(self, "counters", MappingProxyType(counters))
        if self.error is not None and self.error.place.shape != self.time.shape:
            raise ParameterError("Trace.error", self.error.place.shape, "one row per sample")

    def __repr__(self) -> str:
        """Return what it is of and what it holds; the arrays themselves are long."""
        size = f"{len(self.time)} samples to {self.time[-1]:g} s, {len(self.joint_names)} joints"
        return f"<Trace: {size}, {len(self.foot_names)} feet; recorded {', '.join(self.recorded)}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the facts of the run, and its playback."""
        return str(drawn("notebook_html", self))

    @property
    def plot(self) -> Any:
        """Figures of it, one call each: `trace.plot("torque")`, `trace.plot.foot_forces()`, ...

        A `hexapod_pin.view.TracePlots`.
        """
        return drawn("TracePlots", self)

    def __eq__(self, other: object) -> bool:
        """Tell whether every array, name and entry is the same, bit for bit."""
        return isinstance(other, Trace) and self.digest == other.digest

    @property
    def step_error(self) -> float:
        """Largest estimated error of one step, in positions [m and rad]; nan with fixed steps."""
        return float(self.counters.get("error_most", float("nan")))

    @property
    def error_estimate(self) -> float:
        """How far any position at any sample may be from the exact motion [m and rad].

        Of `error`, the largest. NaN where the run was not compared with another: with fixed steps,
        in sessions, and with `estimate=False`.
        """
        return float("nan") if self.error is None else float(self.error.position.max())

    @property
    def accuracy_kept(self) -> bool:
        """Whether the error estimated is within the accuracy requested.

        False where it is not, and where nothing is known of it.
        """
        return self.run.numerics.accuracy_kept

    @property
    def predictable_until(self) -> float:
        """Time up to which positions are within the accuracy requested [s]; inf: to the end.

        Behind it a trajectory means nothing, its statistics do; NaN where nothing is known.
        """
        accuracy = self.run.numerics.accuracy
        if self.error is None or not accuracy:
            return float("nan")
        beyond = np.flatnonzero(self.error.position > accuracy)
        return float(self.time[max(0, beyond[0] - 1)]) if len(beyond) else float("inf")

    @property
    def checkpoint(self) -> Checkpoint:
        """Where the run stood at its end: `simulate(initial=...)` goes on from there.

        Raises:
            ParameterError: the trace was not made by a simulation that left one.
        """
        if self.run.checkpoint is None:
            raise ParameterError("Trace.run.checkpoint", None, "left by a simulation")
        return self.run.checkpoint

    @property
    def case_toml(self) -> str:
        """The case that was run, as TOML text: what `hexapod-pin run` and `load_case` take.

        Raises:
            ParameterError: the trace was made by a session, or by a release that stored no case.
        """
        return self.run.case_toml

    @property
    def has_summary(self) -> bool:
        """Whether the run gathered one."""
        return self.gathered is not None

    @property
    def summary(self) -> Summary:
        """What the run came to, gathered at its accepted steps: peaks between samples included.

        Raises:
            ParameterError: the trace was not made by a simulation that gathered one.
        """
        if self.gathered is None:
            raise ParameterError("Trace.gathered", None, "a summary: no simulation gathered one")
        return self.gathered

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened, in the order of time: where the trunk came to touch the ground.

        Empty where nothing did, with or without `Scene.body_contact`.
        """
        return self.run.events

    @property
    def limits(self) -> tuple[JointLimits, ...]:
        """How often and how long each joint was at its torque limit, or ran into a stop.

        Of the whole run, the motor's limits included: `joint`, `limit_count`, `limit_time` [s],
        `stop_count` for each joint.
        """
        return self.run.limits or ()

    @property
    def digest(self) -> str:
        """SHA-256 over every bit of arrays, names, numbers and run but the wall-clock time."""
        return digest_of(stored_arrays(self), self.joint_names, self.foot_names, stored_texts(self))

    def to_dataset(self) -> xarray.Dataset:
        """Return an xarray.Dataset: named axes, units, and what follows from the samples.

        `xarray.open_dataset(path, engine="h5netcdf")` of a saved trace gives the same. Its
        `to_dataframe()` is refused where it would have more than ten million rows: see `to_pandas`.
        """
        from hexapod_pin.results.trace_dataset import TraceDataset

        plain = super().to_dataset()
        return TraceDataset(plain.data_vars, plain.coords, trace_attributes(self))

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table for pandas: one row per sample, its time as index.

        Columns are those of a ".csv" file: a quantity, its joint, foot or axis, and its unit, such
        as "foot_force.lf_foot.z [N]". (`to_dataset().to_dataframe()` has a row for every
        combination of joint, foot, axis and time.)
        """
        import pandas

        head, tables = sampled_table(self.columns())
        numbers = {
            name: values
            for name, values in zip(head, (c for t in tables for c in t.T), strict=True)
        }
        time = numbers.pop(next(iter(numbers)))
        return pandas.DataFrame(numbers, index=pandas.Index(time, name="time [s]"))

    def save(self, path: str | Path) -> Path:
        """Write the trace to a file, wholly or not at all, and return its path.

        The path's ending gives the format: ".nc", ".h5" and ".hdf5" are netCDF-4, without loss,
        which `load_trace` reads again. ".csv" and ".csv.gz" are a table for other programs: one row
        per sample, a header with names and units, numbers that keep every bit; without
        what is known of the run.

        Raises:
            TraceFileError: another ending, or the file cannot be written; an old one stays as it
                was.
        """
        if check_ending(path, (*NETCDF, *CSV)) in CSV:
            return write_atomically(path, csv_bytes(path, self.columns()))
        return write_netcdf(path, *self.group())

    def columns(self) -> dict[str, Column]:
        """Return everything, with what follows from it, as labelled columns."""
        columns = super().columns()
        if "energy" in self.recorded:
            columns |= _energy_columns(self)
        if "contacts" in self.recorded:
            columns |= _contact_columns(self)
        for name, values in _estimated_errors(self).items():
            units, meaning = QUANTITIES[name]
            about = described(units, f"estimated error so far of {meaning}")
            columns[f"error_{name}"] = Column(("time",), values, about)
        columns |= {} if self.requested is None else self.requested.sampled_columns()
        columns |= {} if self.peaks is None else self.peaks.prefixed_columns()
        for name, value in stored_texts(self).items():
            kind, text = ("TOML", value) if isinstance(value, str) else ("JSON", json.dumps(value))
            columns[name] = Column((), np.array(text, dtype=object), {"long_name": kind})
        return columns

    def group(self) -> Group:
        """Return everything as columns and attributes of a file."""
        return Group(self.columns(), trace_attributes(self))


# A trace as labelled columns of a file or dataset.


def _estimated_errors(trace: Trace) -> dict[str, Array]:
    """Return the estimated errors by name; none where the run was not compared with another."""
    return {} if trace.error is None else trace.error.arrays


def stored_arrays(trace: Trace) -> dict[str, Array]:
    """Return the arrays that are stored, by their names in a file."""
    arrays = {name: getattr(trace, name) for name in schema(Trace) if name in vars(trace)}
    energy = vars(trace).get("energy", {})
    arrays |= {f"energy_{name}": energy[name] for name in sorted(energy)}
    arrays |= {} if trace.requested is None else trace.requested.arrays
    arrays |= {} if trace.peaks is None else trace.peaks.prefixed
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
        found |= {"summary": trace.gathered.data, "errors": trace.gathered.plain_errors}
    return found


def trace_attributes(trace: Trace) -> dict[str, Any]:
    """Return the attributes of the file; `recorded` where it does not hold the usual groups."""
    recorded = trace.recorded
    some = {} if recorded == USUAL else {"recorded": ", ".join(recorded)}
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


def digest_of(
    arrays: Mapping[str, Any],
    joint_names: tuple[str, ...],
    foot_names: tuple[str, ...],
    texts: Mapping[str, Any],
) -> str:
    """Return the SHA-256 over every bit of arrays, names and texts but the wall-clock time.

    Args:
        arrays: by their names in a file.
        joint_names: of the axis "joint".
        foot_names: of the axis "foot".
        texts: what is stored as JSON or TOML text, by its name in a file.
    """
    total = hashlib.sha256()
    for name, values in arrays.items():
        total.update(f"{name}{values.shape}".encode())
        total.update(values.astype("<f8").tobytes())
    run = {key: value for key, value in texts["run"].items() if key != "wall_time"}
    rest = [joint_names, foot_names, {**texts, "run": run}]
    total.update(json.dumps(rest, sort_keys=True).encode())
    return total.hexdigest()


# Samples as a table, for spreadsheets and other programs.

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
    head, tables = sampled_table(columns)
    csv.writer(stream, lineterminator="\n").writerow(map(csv_cell, head))
    for row in zip(*(_texts(table) for table in tables), strict=True):
        stream.write(",".join(row) + "\n")
    text = encoded(stream.getvalue())
    if ending(path, CSV[1:]) is None:
        return text
    return gzip.compress(text, LEVEL, mtime=0)


def sampled_table(
    columns: Mapping[str, Column],
) -> tuple[list[str], list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]]:
    """Return the headings and numbers of what is along time: T rows, of one table or several.

    Args:
        columns: of a trace.
    """
    sampled = {name: c for name, c in columns.items() if c.dims[:1] == ("time",)}
    head = [text for name, c in sampled.items() for text in _headings(name, c, columns)]
    return head, [c.values.reshape(len(c.values), -1) for c in sampled.values()]


def _headings(name: str, column: Column, columns: Mapping[str, Column]) -> Iterator[str]:
    """Return a heading for each number in a row of a variable."""
    labels = [columns[axis].values.tolist() for axis in column.dims[1:]]
    units = _units(name, column, [len(names) for names in labels])
    for unit, place in zip(units, product(*labels), strict=True):
        yield f"{'.'.join((name, *place))} [{unit}]"


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
