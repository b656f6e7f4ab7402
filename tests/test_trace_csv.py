"""A trace as a table for other programs, and endings that are no format."""

from __future__ import annotations

import csv
import gzip
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, TraceFileError


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    robot = hp.load_robot("kharagpur")
    return hp.simulate(hp.Scene(robot), hp.HoldPosture(), duration=0.05, accuracy=1e-3)


def table(text: str) -> tuple[list[str], np.ndarray]:
    head, *rows = csv.reader(text.splitlines())
    return head, np.array(rows, dtype=float)


def test_a_table_has_names_units_and_every_bit(trace: hp.Trace, tmp_path: Path) -> None:
    path = trace.save(tmp_path / "walk.csv")
    head, rows = table(path.read_text())
    assert rows.shape == (len(trace.time), len(head))
    assert len(set(head)) == len(head)
    joint, foot = trace.joint("lm_femur_joint"), trace.foot("rr_foot")
    expected = {
        "time [s]": trace.time,
        "q.base_z [m]": trace.q[:, 2],
        "q.base_qw [1]": trace.q[:, 6],
        "q.lm_femur_joint [rad]": trace.q[:, 7 + joint],
        "v.base_wz [rad/s]": trace.v[:, 5],
        "v.lm_femur_joint [rad/s]": trace.v[:, 6 + joint],
        "torque.lm_femur_joint [N m]": trace.torque[:, joint],
        "foot_force.rr_foot.z [N]": trace.foot_force[:, foot, 2],
        "com.y [m]": trace.com[:, 1],
        "energy_kinetic [J]": trace.energy["kinetic"],
        "contact.rr_foot [1]": trace.contact[:, foot],
    }
    for name, values in expected.items():
        assert np.array_equal(rows[:, head.index(name)], values), name


def test_pandas_has_the_same_columns(trace: hp.Trace, tmp_path: Path) -> None:
    """One row per sample: `to_dataset().to_dataframe()` of a walk ran out of memory."""
    frame = trace.to_pandas()
    head, rows = table(trace.save(tmp_path / "t.csv").read_text())
    assert [frame.index.name, *frame.columns] == head
    assert frame.shape == (len(trace.time), len(head) - 1)
    assert (frame.to_numpy(dtype=float) == rows[:, 1:]).all()
    assert (frame.index.to_numpy() == trace.time).all()
    dataset = trace.to_dataset()
    rows = math.prod(dataset.sizes.values())
    with refused(ParameterError, "rows of to_dataframe", rows, about=("to_pandas",)):
        dataset.to_dataframe()
    part = dataset[["torque"]].to_dataframe()
    assert part.shape[0] == trace.torque.size
    assert (part["torque"].to_numpy() == trace.torque.ravel()).all()


def test_a_compressed_table_is_the_same(trace: hp.Trace, tmp_path: Path) -> None:
    plain = trace.save(tmp_path / "walk.csv").read_bytes()
    packed = trace.save(tmp_path / "walk.csv.gz").read_bytes()
    assert gzip.decompress(packed) == plain
    assert len(packed) < 0.6 * len(plain)


def test_a_table_is_not_read_back(trace: hp.Trace, tmp_path: Path) -> None:
    path = trace.save(tmp_path / "walk.csv")
    with refused(TraceFileError, about=(str(path), "CSV", ".nc, .h5, .hdf5")):
        hp.load_trace(path)


@pytest.mark.parametrize("name", ["walk.txt", "walk", "walk.csv.zip", ".nc", "walk.json"])
def test_other_endings_are_refused_and_write_nothing(
    trace: hp.Trace, tmp_path: Path, name: str
) -> None:
    path = tmp_path / name
    with refused(TraceFileError, about=(str(path), ".nc, .h5, .hdf5, .csv, .csv.gz")):
        trace.save(path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["walk.nc", "walk.h5", "walk.hdf5", "WALK.NC"])
def test_netcdf_keeps_its_endings(trace: hp.Trace, tmp_path: Path, name: str) -> None:
    assert hp.load_trace(trace.save(tmp_path / name)) == trace


def test_a_summary_is_json(trace: hp.Trace, tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    with refused(TraceFileError, about=(str(path), ".json")):
        trace.summary.save(path)
    assert hp.load_summary(trace.summary.save(tmp_path / "walk.json")) == trace.summary


def test_names_with_commas_are_quoted(tmp_path: Path) -> None:
    trace = synthetic_trace(duration=1.0)
    names = ("left, front", *trace.foot_names[1:])
    head, rows = table(replace(trace, foot_names=names).save(tmp_path / "a.csv").read_text())
    assert "foot_gap.left, front [m]" in head
    assert rows.shape[1] == len(head)
