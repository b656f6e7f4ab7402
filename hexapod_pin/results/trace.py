"""What a simulation leaves behind: pure, read-only data, and its file.

A `Trace` knows neither the simulator that made it nor the viewers that show it.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import NotRecordedError, ParameterError
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.results.error_estimate import QUANTITIES, ErrorEstimate
from hexapod_pin.results.peak_states import PeakStates
from hexapod_pin.results.requested_samples import RequestedSamples
from hexapod_pin.results.result_files import CSV, NETCDF, Column, Group, check_ending, write_netcdf
from hexapod_pin.results.run_facts import ALWAYS, GROUP_OF, GROUPS, ON_REQUEST, USUAL
from hexapod_pin.results.run_record import UNKNOWN, Event, JointLimits, RunRecord
from hexapod_pin.results.schema import Record, quantity, require_known, schema
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.trace_csv import csv_bytes, sampled_table
from hexapod_pin.results.trace_layout import (
    BASE_Q,
    BASE_V,
    ENERGIES,
    LOSSES,
    SCHEMA,
    SCHEMA_VERSION,
    STATE_ENERGIES,
    described,
    digest_of,
    frozen,
)
from hexapod_pin.shown import drawn

if TYPE_CHECKING:
    import pandas
    import xarray

LATEST_SAMPLE = 1e10
"""Of a sample's time [s]: three centuries."""

UP = read_only((0.0, 0.0, 1.0))
"""The ground's normal where it is level."""


class Trace(Record):  # noqa: PLW1641  # no record has a hash
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

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "time": "time", "q_name": "q_names", "v_name": "v_names", "joint": "joint_names",
        "foot": "foot_names", "axis": ("x", "y", "z"),
    }  # fmt: skip

    # fmt: off
    time: Array = quantity("time", "s", "time since the start of the simulation",
        least=0.0, most=LATEST_SAMPLE, ascending=True, nan=False)
    q: Array = quantity("time q_name", "m, 1, rad",
        "base position in the world, quaternion xyzw, joints", unit_vector=(3, 7), nan=False)
    v: Array = quantity("time v_name", "m/s, rad/s",
        "base twist in body axes (linear, angular), joints", nan=False)
    torque: Array = quantity("time joint", "N m", "torque applied by the servos", nan=False)
    q_ref: Array = quantity("time joint", "rad", "joint angle set-points", nan=False)
    v_ref: Array = quantity("time joint", "rad/s", "joint rate set-points", nan=False)
    foot_position: Array = quantity("time foot axis", "m",
        "centres of the foot spheres, world axes", nan=False)
    foot_force: Array = quantity("time foot axis", "N",
        "force on the robot at the feet, world axes", nan=False)
    foot_gap: Array = quantity("time foot", "m",
        "lowest point of the foot to the ground, < 0 pressed in", nan=False)
    com: Array = quantity("time axis", "m", "centre of mass, world axes", nan=False)
    energy: Mapping[str, Array]
    counters: Mapping[str, int | float]
    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]
    run: RunRecord = UNKNOWN
    foot_normal: Array = quantity("time foot axis", "1",
        "ground normal under the feet, world axes", unit_vector=(0, 3), nan=False,
        default_factory=lambda: UP)
    foot_impulse: Array | None = quantity("time foot axis", "N s",
        "of the foot forces since the sample before, world axes", nan=False, default=None)
    error: ErrorEstimate | None = None
    gathered: Summary | None = None
    peaks: PeakStates | None = None
    requested: RequestedSamples | None = None
    # fmt: on

    _may_be_none: ClassVar[Collection[str]] = [name for g in USUAL for name in GROUPS[g]]

    def __post_init__(self) -> None:
        """Check shapes, copy, and make read-only."""
        self._hold_forces()
        self._leave_out()
        if np.ndim(self.time) != 1 or not len(self.time):
            raise ParameterError("Trace.time", np.shape(self.time), "a 1-D array of >= 1 times [s]")
        if "contacts" in self.recorded and np.shape(self.foot_normal) == (3,):
            shape = (len(self.time), len(self.foot_names), 3)
            object.__setattr__(self, "foot_normal", np.broadcast_to(self.foot_normal, shape))
        super().__post_init__()
        if "energy" in self.recorded:
            object.__setattr__(self, "energy", self._frozen_energy())
        counters = {name: np.asarray(value).item() for name, value in self.counters.items()}
        object.__setattr__(self, "counters", MappingProxyType(counters))
        if self.requested is not None and self.requested.count != len(self.time):
            raise ParameterError("Trace.requested", self.requested.count, "one row per sample")
        if self.error is not None and self.error.place.shape != self.time.shape:
            raise ParameterError("Trace.error", self.error.place.shape, "one row per sample")
        if np.any(np.diff(self.time) <= 0.0) or not np.all(np.isfinite(self.time)):
            raise ParameterError("Trace.time", self.time, "finite and strictly increasing [s]")

    def _hold_forces(self) -> None:
        """Take impulses that are not given from the forces at the samples."""
        if self.foot_impulse is not None or self.foot_force is None:
            return
        if np.ndim(self.foot_force) != 3 or len(self.foot_force) != np.size(self.time):
            return  # the check of shapes reports it
        interval = np.diff(self.time, prepend=self.time[0])
        object.__setattr__(self, "foot_impulse", interval[:, None, None] * self.foot_force)

    def _leave_out(self) -> None:
        """Take away the arrays that are None: a group is there as a whole, or not at all."""
        for group, arrays in GROUPS.items():
            if group in ON_REQUEST:
                continue
            given = [name for name in arrays if getattr(self, name) is not None]
            if "foot_normal" in given and given == ["foot_normal"]:
                given = []  # its default is no sample
            missing = [name for name in arrays if name not in given]
            if missing and (given or group == ALWAYS):
                raise ParameterError(f"Trace.{missing[0]}", None, f"given with {group}")
            for name in missing:
                object.__delattr__(self, name)

    if not TYPE_CHECKING:  # with it, a type checker would take any name for granted

        def __getattr__(self, name: str) -> Any:
            """Refuse what was not recorded, naming what to record."""
            if name not in GROUP_OF:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            needed = {*self.recorded, GROUP_OF[name]} - {ALWAYS}
            raise NotRecordedError(name, [group for group in GROUPS if group in needed])

    def __repr__(self) -> str:
        """Return what it is of and what it holds; the arrays themselves are long."""
        size = f"{len(self.time)} samples to {self.time[-1]:g} s, {len(self.joint_names)} joints"
        return f"<Trace: {size}, {len(self.foot_names)} feet; recorded {', '.join(self.recorded)}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the facts of the run, and its playback."""
        return str(drawn("notebook_html", self))

    @property
    def recorded(self) -> tuple[str, ...]:
        """The groups of arrays that it holds: "motion", and of the others what was recorded."""
        recorded = {**vars(self), **({} if self.requested is None else self.requested.arrays)}
        return tuple(group for group, arrays in GROUPS.items() if arrays[0] in recorded)

    @property
    def plot(self) -> Any:
        """Figures of it, one call each: `trace.plot("torque")`, `trace.plot.foot_forces()`, ...

        A `hexapod_pin.view.TracePlots`.
        """
        return drawn("TracePlots", self)

    @property
    def q_names(self) -> tuple[str, ...]:
        """The names of the coordinates in a row of `q`."""
        return (*BASE_Q, *self.joint_names)

    @property
    def v_names(self) -> tuple[str, ...]:
        """The names of the velocities in a row of `v`."""
        return (*BASE_V, *self.joint_names)

    def _frozen_energy(self) -> Mapping[str, Array]:
        """Return the energies, checked and read-only."""
        missing = [name for name in ENERGIES if name not in self.energy]
        if missing:
            raise ParameterError("Trace.energy", sorted(self.energy), f"given with {missing} [J]")
        shape = (len(self.time),)
        stored = {k: frozen(f"Trace.energy[{k!r}]", e, shape) for k, e in self.energy.items()}
        return MappingProxyType(stored)

    def __eq__(self, other: object) -> bool:
        """Tell whether every array, name and entry is the same, bit for bit."""
        return isinstance(other, Trace) and self.digest == other.digest

    def joint(self, name: str) -> int:
        """Return the index of a joint; k in `torque[:, k]` is `v[:, 6 + k]` and `q[:, 7 + k]`.

        Raises:
            UnknownNameError: there is no such joint.
        """
        require_known("joint", name, self.joint_names)
        return self.joint_names.index(name)

    def foot(self, name: str) -> int:
        """Return the index of a foot.

        Raises:
            UnknownNameError: there is no such foot.
        """
        require_known("foot", name, self.foot_names)
        return self.foot_names.index(name)

    def _requested(self, name: str) -> Array:
        """Return samples that are recorded only where they are named.

        Raises:
            NotRecordedError: they were not.
        """
        found = {} if self.requested is None else self.requested.arrays
        if name not in found:
            needed = {*self.recorded, GROUP_OF[name]} - {ALWAYS}
            raise NotRecordedError(name, [group for group in GROUPS if group in needed])
        return found[name]

    @property
    def slip_speed(self) -> Array:
        """(T, F) [m/s]: speed of the contact point along the ground; 0 of a foot without load."""
        return self._requested("slip_speed")

    @property
    def current(self) -> Array:
        """(T, n) [A]: of the motors, their torque over gear ratio and torque constant."""
        return self._requested("current")

    @property
    def temperature(self) -> Array:
        """(T, n) [deg C]: of the motors' windings."""
        return self._requested("temperature")

    @property
    def normal_force(self) -> Array:
        """(T, F) [N]: the part of each foot force along the ground's normal, > 0 pushing up."""
        force: Array = np.einsum("tfi,tfi->tf", self.foot_force, self.foot_normal)
        return force

    @property
    def tangential_force(self) -> Array:
        """(T, F, 3) [N]: the part of each foot force within the ground, world axes."""
        along: Array = self.normal_force[..., None] * self.foot_normal
        return self.foot_force - along

    @property
    def mean_foot_force(self) -> Array:
        """(T, F, 3) [N]: mean since the sample before, world axes; at the first sample, the force.

        What a change of momentum over an interval needs: m g plus the sum over feet, times the
        interval, is the change of linear momentum.
        """
        if self.foot_impulse is None:  # pragma: no cover  # a trace with contacts has impulses
            raise NotRecordedError("foot_impulse", list(self.recorded))
        mean: Array = np.array(self.foot_force)
        mean[1:] = self.foot_impulse[1:] / np.diff(self.time)[:, None, None]
        return mean

    @property
    def contact(self) -> npt.NDArray[np.bool_]:
        """(T, F): whether the ground pushes on the foot."""
        return self.normal_force > 0.0

    @property
    def energy_residual(self) -> Array:
        """(T,) [J]: stored energy gained, less work done on the robot, plus losses; ideally 0."""
        stored = sum((self.energy[name] for name in STATE_ENERGIES), np.zeros(len(self.time)))
        lost = sum((self.energy[name] for name in LOSSES), np.zeros(len(self.time)))
        work = self.energy["servo_work"] + self.energy.get("push_work", 0.0)
        residual: Array = stored - stored[0] - work + lost
        return residual

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
