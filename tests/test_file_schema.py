"""Files are checked on reading: damage is told from forgery, and what is wrong is named."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import HexapodError, ParameterError, StateError, TraceFileError
from hexapod_pin.results.netcdf import read_netcdf
from hexapod_pin.results.trace_file import _stored_digest


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    gait = hp.Gait.tripod(stroke=0.04, cycle_time=0.3)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(gait)
    return hp.Case(scene, control, duration=0.9, accuracy=1e-4, sample=0.02, estimate=True).run()


def write(path: Path, name: str, value: Any) -> None:
    """Put another variable into a file, or take it away."""
    with h5py.File(path, "r+") as file:
        del file[name]
        if value is not None:
            text = isinstance(value, str) or np.asarray(value).dtype.kind == "O"
            dtype = h5py.string_dtype() if text else None
            file.create_dataset(name, data=value, dtype=dtype)


def forge(path: Path) -> None:
    """Write the digest of what the file holds now."""
    digest = _stored_digest(read_netcdf(path)[0])
    with h5py.File(path, "r+") as file:
        file.attrs["digest"] = digest or "none"


def with_value(name: str, place: Any, value: float) -> Callable[[dict[str, Any]], tuple[str, Any]]:
    def change(arrays: dict[str, Any]) -> tuple[str, Any]:
        array = np.array(arrays[name])
        array[place] = value
        return name, array

    return change


def with_meta(*keys: Any, value: Any) -> Callable[[dict[str, Any]], tuple[str, Any]]:
    def change(arrays: dict[str, Any]) -> tuple[str, Any]:
        variable, *path = keys
        data = json.loads(arrays[variable].item())
        place = data
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value
        return variable, json.dumps(data)

    return change


FORGERIES = {
    "torque\\[3, 2\\] = nan: must be a number": with_value("torque", (3, 2), np.nan),
    "com\\[1, 0\\] = inf": with_value("com", (1, 0), np.inf),
    "v\\[0, 7\\] = 1e\\+200: must be .* of at most 1e": with_value("v", (0, 7), 1e200),
    "time\\[5\\] = 0.0: must be greater than the one before": with_value("time", 5, 0.0),
    "time\\[0\\] = -1.0: must be at least 0": with_value("time", 0, -1.0),
    "q\\[2\\] = .*: must be of length 1": with_value("q", (2, 3), 0.5),
    "foot_normal\\[0, 1\\] = .*: must be of length 1": with_value("foot_normal", (0, 1, 0), 0.5),
    "error_place\\[4\\] = 0.0: must be not smaller": with_value("error_place", 4, 0.0),
    "energy_kinetic\\[0\\] = nan": with_value("energy_kinetic", 0, np.nan),
    "q_ref.dtype = 'float32'": lambda a: ("q_ref", a["q_ref"].astype("f4")),
    "foot_gap.shape = .*: must be .*, of time, foot": lambda a: ("foot_gap", a["foot_gap"][:, :-1]),
    "variable 'com'": lambda a: ("com", None),
    "joint\\[0\\] = .*: must be a name": lambda a: ("joint", np.array(["", *a["joint"][1:]], "O")),
    "joint = .*: must be there once": lambda a: ("joint", a["joint"][[0, 0, *range(2, 18)]]),
    "foot = 'float64 of shape": lambda a: ("foot", np.arange(6.0)),
    "meta = .*: must be JSON": lambda a: ("meta", "[" * 100_000),
    "counters = .*: must be a JSON object": lambda a: ("counters", "3"),
    "counters.steps = -1": with_meta("counters", "steps", value=-1),
    "meta.method = 3": with_meta("meta", "method", value=3),
    "meta.cycle_time = 0": with_meta("meta", "cycle_time", value=0.0),
    "meta.steady_from = inf": with_meta("meta", "steady_from", value=float("inf")),
    "meta.gravity = .*: must be .* 3 items": with_meta("meta", "gravity", value=[0.0]),
    "meta.effort_limit = .*: must be 18 values": with_meta("meta", "effort_limit", value=[1.0]),
    "meta.drive.limit_time.4 = -1": with_meta("meta", "drive", "limit_time", 4, value=-1.0),
    "meta.events": with_meta("meta", "events", value=[{"time": 0.0}]),
    "meta.summary.torque_rms.0 = -1": with_meta("meta", "summary", "torque_rms", 0, value=-1.0),
    "every number of speed_rms": with_meta("meta", "summary", "speed_rms", 1, value=None),
    "meta.summary.way": with_meta("meta", "summary", "way", value=[[0.0, 0.0]]),
    "meta.number_errors": with_meta("meta", "number_errors", "torque_rms", value="x"),
    "meta.checkpoint.q": with_meta("meta", "checkpoint", "q", 6, value=0.1),
    "meta.scene": with_meta("meta", "scene", value="= ="),
    "meta.scene.loads": with_meta("meta", "scene", value="loads = 3"),
    "meta.velocity_limit.2 = 'x'": with_meta("meta", "velocity_limit", 2, value="x"),
}  # fmt: skip


@pytest.mark.parametrize("words", FORGERIES)
def test_damage_is_told_from_forgery(words: str, trace: hp.Trace, tmp_path: Path) -> None:
    path = trace.save(tmp_path / "walk.nc")
    write(path, *FORGERIES[words](read_netcdf(path)[0]))
    with pytest.raises(TraceFileError, match="damaged: its content does not match its digest"):
        hp.load_trace(path)
    forge(path)
    with pytest.raises(TraceFileError, match=words) as caught:
        hp.load_trace(path)
    readable = _stored_digest(read_netcdf(path)[0]) is not None
    assert ("damaged" in str(caught.value)) != readable


def test_a_summary_or_checkpoint_of_null_is_none(trace: hp.Trace, tmp_path: Path) -> None:
    meta = {**trace.meta, "summary": None, "checkpoint": None}
    again = hp.load_trace(replace(trace, meta=meta).save(tmp_path / "walk.nc"))
    for name in ("summary", "checkpoint"):
        with refused(hp.errors.ParameterError, "Trace.meta"):
            getattr(again, name)
    from_samples = hp.walk_verdict(again)
    assert (from_samples.robot, from_samples.holds) == ("kharagpur", hp.walk_verdict(trace).holds)


def test_a_value_that_breaks_no_rule_is_damage_all_the_same(
    trace: hp.Trace, tmp_path: Path
) -> None:
    path = trace.save(tmp_path / "walk.nc")
    arrays = read_netcdf(path)[0]
    write(path, *with_value("torque", (0, 0), 0.125)(arrays))
    with pytest.raises(TraceFileError, match="damaged: its content does not match its digest.$"):
        hp.load_trace(path)
    forge(path)
    assert hp.load_trace(path).torque[0, 0] == 0.125


SUMMARIES = {
    "data.torque_p99.2 = 'x'": ("data", "torque_p99", 2, "x"),
    "data.at_limit.0 = 2": ("data", "at_limit", 0, 2.0),
    "data.cycles = -1": ("data", "cycles", -1),
    "meta.drive": ("meta", "drive", 3),
    "meta.number_errors": ("meta", "number_errors", "torque_rms", [1.0]),
    "counters.steps = 'x'": ("counters", "steps", "x"),
    "joint_names.0 = 3": ("joint_names", 0, 3),
    "data = ": ("data", []),
}


@pytest.mark.parametrize("words", SUMMARIES)
def test_a_summary_that_breaks_its_schema_is_refused(
    words: str, trace: hp.Trace, tmp_path: Path
) -> None:
    found = json.loads(trace.summary.to_json())
    *keys, last, value = SUMMARIES[words]
    place = found
    for key in keys:
        place = place[key]
    place[last] = value
    path = tmp_path / "summary.json"
    path.write_text(json.dumps(found))
    with pytest.raises(TraceFileError, match=words):
        hp.load_summary(path)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"time": None}, "checkpoint.time"),
        ({"time": 1e300}, "checkpoint.time"),
        ({"q": [0.0] * 25}, "quaternion"),
        ({"v": [0.0]}, "24 velocities"),
        ({"contacts": [[0.0]]}, "checkpoint.contacts.0"),
        ({"controller": ["x"]}, "checkpoint.controller.0"),
        ({"other": 1}, "checkpoint.other"),
        ({"impulse": 3}, "checkpoint.impulse"),
        ({"impulse": {"__array__": "O", "shape": [1], "data": [1]}}, "__array__ = 'O'"),
        ({"impulse": {"__array__": "<f8", "shape": [2, 3], "data": [1]}}, "as much data"),
        ({"loop": {"a": {"__array__": "<f8", "shape": [1], "data": ["x"]}}}, "loop.a.data"),
    ],
)
def test_a_checkpoint_that_breaks_its_schema_is_refused(
    changes: dict[str, Any], words: str, trace: hp.Trace
) -> None:
    data = copy.deepcopy(trace.checkpoint.to_dict()) | changes
    with pytest.raises((ParameterError, StateError), match=words):
        hp.Checkpoint.from_dict(data)
    assert hp.Checkpoint.from_dict(trace.checkpoint.to_dict()).time == trace.time[-1]


@pytest.mark.parametrize("text", ["terrain = 3", "contact = 3", "loads = [1]", "servo = 1"])
def test_the_scene_of_a_case_is_checked(text: str, trace: hp.Trace) -> None:
    case = trace.case_toml.replace("[scene]\n", f"[scene]\n{text}\n", 1)
    with pytest.raises(HexapodError):
        hp.Case.from_toml(case)
