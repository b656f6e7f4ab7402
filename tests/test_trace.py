"""The trace: shapes, derived quantities, tables, and a file that is whole or refused."""

from __future__ import annotations

import copy
import csv
import gzip
import math
import pickle
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import h5netcdf
import numpy as np
import pytest
from refusals import refused
from synthetic import FEET, WEIGHT, synthetic_trace, with_run

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.results.samples import ENERGIES
from hexapod_pin.results.schema import (
    Record,
    from_plain,
    known_quantity,
    pack,
    plain,
    quantity,
    unpack,
)
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import load_trace


@pytest.fixture
def trace() -> Trace:
    """A short trace with a different number everywhere, odd ones included."""
    still = synthetic_trace(duration=0.05, effort_limit=[5.0] * 17 + [float("inf")])
    noise = np.random.default_rng(0)
    torque = noise.normal(size=still.torque.shape)
    torque[0, :4] = 1e-300, -0.0, 5e-324, 1e150
    force = noise.normal(size=still.foot_force.shape)
    energy = {name: noise.normal(size=len(still.time)) for name in ENERGIES}
    return replace(still, torque=torque, foot_force=force, energy=energy)


@pytest.fixture
def saved(trace: Trace, tmp_path: Path) -> Path:
    return trace.save(tmp_path / "walk.nc")


def test_arrays_are_read_only_copies() -> None:
    torque = np.ones((401, 18))
    trace = synthetic_trace(torque=torque)
    torque[:] = 7.0
    assert np.all(trace.torque == 1.0)
    for array in (trace.torque, trace.foot_normal, trace.energy["kinetic"]):
        with pytest.raises(ValueError):
            array[0] = 1.0


def test_arrays_of_another_form_are_refused_by_name() -> None:
    trace = synthetic_trace()
    for name in ("q", "foot_force"):
        whole = getattr(trace, name)
        with refused(ParameterError, f"Trace.{name}", whole[:-1].shape, allowed=whole.shape):
            replace(trace, **{name: whole[:-1]})
    still = np.zeros_like(trace.time)
    with refused(ParameterError, "Trace.time", still):
        replace(trace, time=still)
    with refused(ParameterError, "Trace.time", (0,), allowed=(1,)):
        replace(trace, time=np.zeros(0))
    energy = {name: trace.energy[name] for name in ENERGIES if name != "normal_loss"}
    with refused(ParameterError, "Trace.energy", sorted(energy), about=("['normal_loss']",)):
        replace(trace, energy=energy)


def test_forces_split_along_the_ground_normal() -> None:
    """On a 30 degree slope a vertical force W has W cos 30 normal and W sin 30 downhill parts.

    A foot without force, or pulled, is not in contact.
    """
    slope = np.array([np.sin(np.pi / 6), 0.0, np.cos(np.pi / 6)])
    trace = replace(synthetic_trace(), foot_normal=slope)
    force = WEIGHT / 6
    np.testing.assert_allclose(trace.normal_force, force * np.cos(np.pi / 6), rtol=1e-15)
    downhill = trace.tangential_force @ np.array([-np.cos(np.pi / 6), 0.0, np.sin(np.pi / 6)])
    np.testing.assert_allclose(downhill, force * np.sin(np.pi / 6), rtol=1e-14)
    np.testing.assert_allclose(trace.tangential_force @ slope, 0.0, atol=1e-14)
    pulled = np.array(trace.foot_force)
    pulled[:, 0], pulled[:, 1, 2] = 0.0, -1.0
    assert replace(trace, foot_force=pulled).contact[5].tolist() == [False] * 2 + [True] * 4


def test_energy_residual_of_a_damped_drive_is_zero() -> None:
    """Servo work 3t feeds kinetic energy t (from 2), heat t in a joint, heat t by slip."""
    trace = synthetic_trace()
    t, zero = trace.time, np.zeros(len(trace.time))
    energy = dict.fromkeys(ENERGIES, zero) | {"joint_damping_loss": t, "friction_loss": t}
    energy |= {"kinetic": 2.0 + t + np.sin(t), "potential": 5.0 - np.sin(t), "servo_work": 3.0 * t}
    # round-off of sums of size 10
    np.testing.assert_allclose(replace(trace, energy=energy).energy_residual, 0.0, atol=1e-14)
    for name, sign in (("servo_work", -1), ("friction_loss", 1)):
        changed = replace(trace, energy=energy | {name: energy[name] + t})
        np.testing.assert_allclose(changed.energy_residual, sign * t, atol=1e-14)


def test_a_saved_trace_comes_back_bit_for_bit(trace: Trace, saved: Path) -> None:
    back = load_trace(saved)
    assert back == trace
    assert back.torque.tobytes() == trace.torque.tobytes()  # NaN, -0.0 and subnormals included
    saved.write_bytes(saved.read_bytes()[:-28])  # without a checksum: of other programs
    assert load_trace(saved) == trace
    # an HDF5 attribute ends at 64 KiB; a URDF does not
    long = with_run(trace, urdf="\u00fc" * 200_000)
    assert load_trace(long.save(saved)).run.robot.urdf == long.run.robot.urdf
    com = np.array(trace.com)
    com[2, 1] = np.nextafter(com[2, 1], 1.0)
    assert replace(trace, com=com) != trace
    assert with_run(trace, method="other") != trace


def test_the_file_opens_in_xarray_with_names_and_units(trace: Trace, saved: Path) -> None:
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(saved, engine="h5netcdf") as dataset:
        assert dataset.identical(trace.to_dataset())
        knee = dataset.torque.sel(joint="lm_tibia_joint")
        assert knee.attrs["units"] == "N m"
        np.testing.assert_array_equal(knee, trace.torque[:, trace.joint("lm_tibia_joint")])
        up = dataset.foot_force.sel(foot="rr_foot", axis="z")
        np.testing.assert_array_equal(up, trace.foot_force[:, 5, 2])
        assert dataset.q.sel(q_name="base_qw").values.tolist() == [1.0] * len(trace.time)
        assert dataset.contact.dtype == bool


def test_damage_is_found_before_hdf5_follows_it(saved: Path) -> None:
    """Damaged heaps of HDF5 once made it read for ever: any byte that changes is found first."""
    data = saved.read_bytes()
    for place in range(0, len(data) - 30, len(data) // 20):
        saved.write_bytes(data[:place] + bytes([data[place] ^ 16]) + data[place + 1 :])
        with refused(TraceFileError, about=(str(saved), "checksum")):
            load_trace(saved)


def larger_than_its_file(file: h5netcdf.File) -> None:
    del file._h5file["com"]
    file._h5file.create_dataset("com", shape=(10**12, 3), dtype="f8", chunks=(1000, 3))


@pytest.mark.parametrize(
    ("change", "about"),
    [
        (lambda file: file.attrs.update(schema="weather"), ("'hexapod_pin.trace'",)),
        (lambda file: file.attrs.update(schema_version=3), ("3", "1", "hexapod_pin")),
        (lambda file: file._h5group.pop("torque"), ("'torque'",)),
        (lambda file: file._h5group.pop("run"), ("'run'",)),
        (lambda file: file.variables["com"].__setitem__(0, 1.0), ("digest",)),
        (larger_than_its_file, ("/com", "(1000000000000, 3)")),
    ],
)
def test_what_another_program_changed_is_refused(saved: Path, change, about) -> None:
    with h5netcdf.File(saved, "a") as file:
        change(file)
    with refused(TraceFileError, about=(str(saved), *about)):
        load_trace(saved)


def test_what_is_no_whole_file_is_refused(saved: Path, tmp_path: Path) -> None:
    content = saved.read_bytes()
    for start in (b"", content[: len(content) // 2], b"time,torque\n0,1\n" * 100):
        saved.write_bytes(start)
        with refused(TraceFileError, about=(str(saved),)) as caught:
            load_trace(saved)
        assert caught.value.__cause__ is not None  # HDF5 has refused it: no attribute is looked at
    with refused(TraceFileError, about=("nowhere.nc",)) as caught:
        load_trace(tmp_path / "nowhere.nc")
    assert isinstance(caught.value.__cause__, FileNotFoundError)


def test_a_table_has_names_units_and_every_bit(trace: Trace, tmp_path: Path) -> None:
    """Also for pandas, in which `to_dataset().to_dataframe()` of a walk ran out of memory."""
    path = trace.save(tmp_path / "walk.csv")
    head, *lines = csv.reader(path.read_text().splitlines())
    rows = np.array(lines, dtype=float)
    assert rows.shape == (len(trace.time), len(head)) and len(set(head)) == len(head)
    joint, foot = trace.joint("lm_femur_joint"), trace.foot("rr_foot")
    expected = {
        "time [s]": trace.time,
        "q.base_qw [1]": trace.q[:, 6],
        "q.lm_femur_joint [rad]": trace.q[:, 7 + joint],
        "v.base_wz [rad/s]": trace.v[:, 5],
        "torque.lm_femur_joint [N m]": trace.torque[:, joint],
        "foot_force.rr_foot.z [N]": trace.foot_force[:, foot, 2],
        "energy_kinetic [J]": trace.energy["kinetic"],
        "contact.rr_foot [1]": trace.contact[:, foot],
    }
    for name, values in expected.items():
        assert np.array_equal(rows[:, head.index(name)], values), name
    frame, dataset = trace.to_pandas(), synthetic_trace(duration=1.0).to_dataset()
    assert [frame.index.name, *frame.columns] == head
    assert (frame.to_numpy(dtype=float) == rows[:, 1:]).all()
    assert (frame.index.to_numpy() == trace.time).all()
    size = math.prod(dataset.sizes.values())
    with refused(ParameterError, "rows of to_dataframe", size, about=("to_pandas",)):
        dataset.to_dataframe()
    part = trace.to_dataset()[["torque"]].to_dataframe()["torque"]
    assert (part.to_numpy() == trace.torque.ravel()).all()
    packed = trace.save(tmp_path / "walk.csv.gz").read_bytes()
    assert gzip.decompress(packed) == path.read_bytes()
    with refused(TraceFileError, about=(str(path), "CSV", ".nc, .h5, .hdf5")):
        load_trace(path)
    odd = replace(trace, foot_names=("left, front", *FEET[1:])).save(path).read_text()
    assert "foot_gap.left, front [m]" in next(csv.reader(odd.splitlines()))


def test_endings_are_formats(trace: Trace, tmp_path: Path) -> None:
    for name in ("walk.h5", "WALK.NC"):
        assert load_trace(trace.save(tmp_path / name)) == trace
    for name in ("walk", "walk.csv.zip"):
        with refused(TraceFileError, about=(name, ".nc, .h5, .hdf5, .csv, .csv.gz")):
            trace.save(tmp_path / name)
        assert not (tmp_path / name).exists()


# Records: what is derived from the one line that declares a number.


class Loads(Record):
    """Loads of joints.

    Attributes:
        joint_names: n names.
    """

    AXES: ClassVar[Mapping[str, str | tuple[str, ...]]] = {
        "joint": "joint_names", "axis": ("x", "y")
    }  # fmt: skip

    joint_names: tuple[str, ...]
    mass: float = quantity("", "kg", "mass", least=0.0)
    path: Array = quantity("edge axis", "m", "places", error=False, nan=False)
    force: Array = quantity("joint axis", "N", "force on a joint")
    use: Array = quantity("joint", "1", "fraction of the limit", least=0.0, most=1.0)


SIZES = {"joint": 2, "axis": 2}


def loads(**changes: Any) -> Loads:
    values: dict[str, Any] = {
        "joint_names": ["a", "b"], "mass": 2.5, "path": np.arange(6.0).reshape(3, 2),
        "force": np.array([[1.0, -2.0], [3.0, np.nan]]), "use": [0.25, 0.5],
    }  # fmt: skip
    return Loads(**{**values, **changes})


def test_a_record_is_frozen_and_equal_by_its_bits() -> None:
    record = loads()
    assert record == loads() and record != loads(mass=np.nextafter(2.5, 3.0))
    assert loads(mass=-0.0) != loads(mass=0.0) and loads(mass=np.nan) == loads(mass=np.nan)
    assert record.joint_names == ("a", "b")
    for copied in (copy.deepcopy(record), pickle.loads(pickle.dumps(record))):
        assert copied == record and not copied.force.flags.writeable
    with pytest.raises(AttributeError):
        record.mass = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        record.force[0, 0] = 1.0


def test_plain_data_and_rows_hold_every_bit() -> None:
    record = loads(mass=0.1 + 0.2)
    data = plain(record)
    assert data["force"] == [[1.0, -2.0], [3.0, None]] and data["mass"] == 0.1 + 0.2
    assert Loads(record.joint_names, **from_plain(Loads, data, SIZES)) == record
    row = pack(record)
    assert row.shape == (1 + 4 + 2 + 6,) and row[-1] == record.path[-1, -1]  # the path is last
    assert Loads(record.joint_names, **unpack(Loads, row, SIZES)) == record
    with refused(ParameterError, "row", 12):
        unpack(Loads, row[:12], SIZES)


def test_plain_data_that_breaks_a_rule_is_refused() -> None:
    for name, value, where in (
        ("mass", True, "loads.mass"),
        ("mass", -1.0, "loads.mass"),
        ("use", [0.1, 1.5], "loads.use[1]"),
        ("use", 0.1, "loads.use"),
        ("force", [[0.0, 0.0], [0.0]], "loads.force[1]"),
        ("path", [[0.0, None]], "loads.path[0][1]"),
    ):
        with refused(ParameterError, where):
            from_plain(Loads, {**plain(loads()), name: value}, SIZES, where="loads")


def test_shapes_and_names_that_break_a_rule_are_refused() -> None:
    with refused(ParameterError, "Loads.force", (3, 2), allowed=(2, 2)):
        loads(force=np.zeros((3, 2)))
    with refused(ParameterError, "Loads.path", (3, 3), allowed=(2,)):
        loads(path=np.zeros((3, 3)))
    data = plain(loads())
    del data["use"]
    with refused(ParameterError, "use", None):
        from_plain(Loads, data, SIZES)
    with refused(UnknownNameError, name="usage"):
        known_quantity(Loads, "usage")
    with pytest.raises(ValueError, match="path"):  # in a netCDF file it would label that axis

        class _Wrong(Record):
            path: Array = quantity("path axis", "m", "places")


def test_the_page_of_quantities_is_that_of_the_classes() -> None:
    script = Path(__file__).parents[1] / "scripts" / "quantities.py"
    subprocess.run([sys.executable, str(script), "--check"], check=True, timeout=120)
