"""The trace: shapes, derived quantities, and a file that is whole or refused."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
from refusals import refused
from synthetic import FEET, JOINTS, WEIGHT, synthetic_trace, with_run

from hexapod_pin.errors import ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.results.result_files import Column, Group, read_netcdf, write_netcdf
from hexapod_pin.results.samples import ENERGIES
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
    """The file of that trace."""
    return trace.save(tmp_path / "walk.nc")


def edit(path: Path, change: str, name: str, value: object = None) -> None:
    """Change a saved file as another program might."""
    with h5netcdf.File(path, "a") as file:
        if change == "attribute":
            file.attrs[name] = value
        elif change == "remove":
            del file._h5group[name]
        else:
            file.variables[name][0] = value


# --- data ---------------------------------------------------------------------------------------


def test_arrays_are_read_only_copies() -> None:
    """Neither the trace nor the caller's array can change the other."""
    torque = np.ones((401, 18))
    trace = synthetic_trace(torque=torque)
    torque[:] = 7.0
    assert np.all(trace.torque == 1.0)
    for array in (trace.torque, trace.foot_normal, trace.energy["kinetic"]):
        assert not array.flags.writeable
        with pytest.raises(ValueError):
            array[0] = 1.0
    with pytest.raises(TypeError):
        trace.energy["kinetic"] = np.zeros(3)  # type: ignore[index]


@pytest.mark.parametrize("name", ["q", "v", "torque", "q_ref", "foot_force", "foot_gap", "com"])
def test_a_wrong_shape_is_refused_by_name(name: str) -> None:
    trace = synthetic_trace()
    whole = getattr(trace, name)
    with refused(ParameterError, f"Trace.{name}", whole[:-1].shape, allowed=whole.shape):
        replace(trace, **{name: whole[:-1]})


def test_times_must_increase() -> None:
    trace = synthetic_trace()
    still = np.zeros_like(trace.time)
    with refused(ParameterError, "Trace.time", still):
        replace(trace, time=still)
    with refused(ParameterError, "Trace.time", (0,), allowed=(1,)):
        replace(trace, time=np.zeros(0))


def test_a_missing_energy_is_refused_by_name() -> None:
    trace = synthetic_trace()
    energy = {name: trace.energy[name] for name in ENERGIES if name != "normal_loss"}
    with refused(ParameterError, "Trace.energy", sorted(energy), about=("['normal_loss']",)):
        replace(trace, energy=energy)


def test_counters_are_pythons_numbers() -> None:
    given = {"steps": np.int64(7), "error_most": np.float64(0.1)}
    counters = replace(synthetic_trace(), counters=given).counters
    assert [type(value) for value in counters.values()] == [int, float] and counters == given
    with refused(ParameterError, "Trace.counters[steps]", "7"):
        replace(synthetic_trace(), counters={"steps": "7"})


def test_joints_and_feet_are_found_by_name() -> None:
    trace = synthetic_trace()
    assert trace.joint("rf_femur_joint") == JOINTS.index("rf_femur_joint")
    assert trace.foot("rr_foot") == FEET.index("rr_foot")
    with refused(UnknownNameError, kind="joint", name="knee", known=list(JOINTS)):
        trace.joint("knee")
    with refused(UnknownNameError, kind="foot", name="paw", known=list(FEET)):
        trace.foot("paw")


def test_forces_split_along_the_ground_normal() -> None:
    """On a 30 degree slope a vertical force W has W cos 30 normal and W sin 30 downhill parts."""
    slope = np.array([np.sin(np.pi / 6), 0.0, np.cos(np.pi / 6)])
    trace = replace(synthetic_trace(), foot_normal=slope)
    force = WEIGHT / 6
    np.testing.assert_allclose(trace.normal_force, force * np.cos(np.pi / 6), rtol=1e-15)
    downhill = trace.tangential_force @ np.array([-np.cos(np.pi / 6), 0.0, np.sin(np.pi / 6)])
    np.testing.assert_allclose(downhill, force * np.sin(np.pi / 6), rtol=1e-14)
    np.testing.assert_allclose(trace.tangential_force @ slope, 0.0, atol=1e-14)


def test_contact_needs_a_push() -> None:
    """A foot without force, or pulled, is not in contact."""
    trace = synthetic_trace()
    force = np.array(trace.foot_force)
    force[:, 0], force[:, 1, 2] = 0.0, -1.0
    assert replace(trace, foot_force=force).contact[5].tolist() == [False] * 2 + [True] * 4


def test_energy_residual_of_a_damped_drive_is_zero() -> None:
    """Servo work 3t feeds kinetic energy t (from 2), heat t in a joint, heat t by slip."""
    trace = synthetic_trace()
    t, zero = trace.time, np.zeros(len(trace.time))
    energy = {
        "kinetic": 2.0 + t + np.sin(t),
        "potential": 5.0 - np.sin(t),
        "elastic": zero,
        "servo_work": 3.0 * t,
        "joint_damping_loss": t,
        "normal_loss": zero,
        "friction_loss": t,
    }
    # round-off of sums of size 10
    np.testing.assert_allclose(replace(trace, energy=energy).energy_residual, 0.0, atol=1e-14)
    for name, sign in (("servo_work", -1), ("friction_loss", 1), ("elastic", 1)):
        changed = replace(trace, energy=energy | {name: energy[name] + t})
        np.testing.assert_allclose(changed.energy_residual, sign * t, atol=1e-14)


# --- the file -----------------------------------------------------------------------------------


def test_a_saved_trace_comes_back_bit_for_bit(trace: Trace, saved: Path) -> None:
    back = load_trace(saved)
    assert back == trace
    assert back.torque.tobytes() == trace.torque.tobytes()  # NaN, -0.0 and subnormals included
    assert back.run.to_dict() == trace.run.to_dict()
    assert (back.joint_names, back.foot_names) == (JOINTS, FEET)
    assert dict(back.counters) == dict(trace.counters)


def test_one_bit_makes_traces_unequal(trace: Trace) -> None:
    com = np.array(trace.com)
    com[2, 1] = np.nextafter(com[2, 1], 1.0)
    assert replace(trace, com=com) != trace
    assert with_run(trace, method="other") != trace
    assert trace != "a trace"


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


def test_long_texts_fit(tmp_path: Path) -> None:
    """An HDF5 attribute ends at 64 KiB; a URDF does not."""
    trace = synthetic_trace(duration=0.01, urdf="ü" * 200_000)
    assert load_trace(trace.save(tmp_path / "long.nc")).run.robot.urdf == "ü" * 200_000


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "nowhere.nc"
    with refused(TraceFileError, about=(str(path),)) as caught:
        load_trace(path)
    assert isinstance(caught.value.__cause__, FileNotFoundError)


@pytest.mark.parametrize("keep", [0, 7, 100, 0.5, 0.999])
def test_a_truncated_file_is_refused(saved: Path, keep: float) -> None:
    content = saved.read_bytes()
    saved.write_bytes(content[: keep if isinstance(keep, int) else int(keep * len(content))])
    with refused(TraceFileError, about=(str(saved),)) as caught:
        load_trace(saved)
    assert caught.value.__cause__ is not None  # HDF5 has refused it: no attribute was looked at


def test_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.nc"
    path.write_text("time,torque\n0,1\n" * 100)
    with refused(TraceFileError, about=(str(path), "HDF5")):
        load_trace(path)
    with h5netcdf.File(path, "w") as file:
        file.attrs["title"] = "weather"
    with refused(TraceFileError, about=(str(path), "None", "'hexapod_pin.trace'")):
        load_trace(path)


def test_a_newer_schema_is_refused_with_the_way_out(saved: Path) -> None:
    edit(saved, "attribute", "schema_version", 3)
    with refused(TraceFileError, about=(str(saved), "3", "1", "hexapod_pin")):
        load_trace(saved)


@pytest.mark.parametrize("name", ["torque", "run", "energy_servo_work"])
def test_a_missing_variable_is_named(saved: Path, name: str) -> None:
    edit(saved, "remove", name)
    with refused(TraceFileError, about=(str(saved), f"'{name}'")):
        load_trace(saved)


def test_a_changed_number_does_not_pass_the_digest(saved: Path) -> None:
    edit(saved, "number", "com", 1.0)
    with refused(TraceFileError, about=(str(saved), "digest")):
        load_trace(saved)


def test_flipped_bytes_are_refused_or_harmless(trace: Trace, saved: Path) -> None:
    """Whatever byte a disk corrupts, the result is the same trace or a typed refusal."""
    content, places = saved.read_bytes(), np.random.default_rng(1)
    caught = 0
    for place in places.integers(0, len(content), 60):
        broken = bytearray(content)
        broken[place] ^= 0xFF
        saved.write_bytes(broken)
        try:
            assert load_trace(saved) == trace  # the byte held nothing, or a derived quantity
        except TraceFileError:
            caught += 1
    assert caught > 10


def test_a_trace_needs_no_simulator_or_viewer() -> None:
    """Importing the trace imports neither dynamics, nor viewer, nor the heavy file libraries."""
    heavy = "pinocchio meshcat xarray h5py h5netcdf scipy hexapod_pin.simulation.case".split()
    code = f"import sys, hexapod_pin.results.trace\nprint([m for m in {heavy} if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_damage_is_found_before_hdf5_follows_it(saved: Path) -> None:
    """Damaged heaps of HDF5 once made it read for ever: any byte that changes is found first."""
    data = saved.read_bytes()
    for place in range(0, len(data) - 30, len(data) // 50):
        saved.write_bytes(data[:place] + bytes([data[place] ^ 16]) + data[place + 1 :])
        with refused(TraceFileError, about=(str(saved), "checksum")):
            load_trace(saved)


def test_files_without_a_checksum_are_read(saved: Path) -> None:
    """Those of earlier releases, and those that other programs wrote again."""
    trace = load_trace(saved)
    saved.write_bytes(saved.read_bytes()[:-28])
    assert np.array_equal(load_trace(saved).q, trace.q)


def test_an_array_larger_than_its_file_can_hold_is_not_made(saved: Path) -> None:
    with h5netcdf.File(saved, "a") as file:
        del file._h5file["com"]
        file._h5file.create_dataset("com", shape=(10**12, 3), dtype="f8", chunks=(1000, 3))
    with refused(TraceFileError, about=(str(saved), "/com", "(1000000000000, 3)")):
        load_trace(saved)


def test_axes_without_length_and_groups_are_those_of_netcdf(tmp_path: Path) -> None:
    """Another reader finds names of axes, labels, text and truth values where no sample is."""
    xarray = pytest.importorskip("xarray")
    columns = {
        "time": Column(("time",), np.linspace(0.0, 1.0, 5000), {"units": "s"}),
        "force": Column(("time", "foot"), np.arange(10000.0).reshape(5000, 2), {"units": "N"}),
        "foot": Column(("foot",), np.array(["left", "right"], dtype=object), {}),
        "pushed": Column(("event", "foot"), np.zeros((0, 2)), {}),
        "down": Column(("time",), np.arange(5000) % 2 == 0, {}),
        "source": Column((), np.array("Müller", dtype=object), {}),
    }
    path = write_netcdf(tmp_path / "a.nc", columns, {"count": 3}, {"more": Group(columns, {})})
    for group in (None, "more"):
        with xarray.open_dataset(path, group=group, engine="h5netcdf") as found:
            assert dict(found.sizes) == {"time": 5000, "foot": 2, "event": 0}
            assert found.force.dims == ("time", "foot")
            assert found.force.sel(foot="right").values[-1] == 9999.0
            assert found.down.dtype == bool and found.source.item() == "Müller"
            assert set(found.coords) == {"time", "foot"}
    assert read_netcdf(path)[1]["count"] == 3
