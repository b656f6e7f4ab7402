"""Files are checked on reading: damage differs from forgery; what a run keeps as samples."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from refusals import refused
from synthetic import with_run

import hexapod_pin as hp
from hexapod_pin.errors import NotRecordedError, ParameterError, StateError, TraceFileError
from hexapod_pin.results.result_files import read_netcdf
from hexapod_pin.results.schema import schema
from hexapod_pin.results.trace_file import _stored_digest

Change = Callable[[dict[str, Any]], tuple[str, Any]]


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.3))
    return hp.Case(scene, control, duration=0.9, accuracy=1e-4, sample=0.02, estimate=True).run()


@pytest.fixture(scope="module")
def saved(trace: hp.Trace, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, Any]:
    path = trace.save(tmp_path_factory.mktemp("saved") / "walk.nc")
    return path.read_bytes(), read_netcdf(path)[0]


def damaged(folder: Path, saved: tuple[bytes, Any], change: Change) -> Path:
    """Write the file with another variable, or without it."""
    path = folder / "walk.nc"
    path.write_bytes(saved[0])
    name, value = change(saved[1])
    with h5py.File(path, "r+") as file:
        del file[name]
        if value is not None:
            text = isinstance(value, str) or np.asarray(value).dtype.kind == "O"
            file.create_dataset(name, data=value, dtype=h5py.string_dtype() if text else None)
    return path


def forge(path: Path) -> None:
    digest = _stored_digest(read_netcdf(path)[0])
    with h5py.File(path, "r+") as file:
        file.attrs["digest"] = digest or "none"


def with_value(name: str, place: Any, value: float) -> Change:
    def change(arrays: dict[str, Any]) -> tuple[str, Any]:
        array = np.array(arrays[name])
        array[place] = value
        return name, array

    return change


def with_json(*keys: Any, value: Any) -> Change:
    def change(arrays: dict[str, Any]) -> tuple[str, Any]:
        variable, *path = keys
        data = json.loads(arrays[variable].item())
        place = data
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value
        return variable, json.dumps(data)

    return change


FORGERIES: dict[tuple[str, ...], Change] = {
    ("torque[3, 2] = nan", "1e+150"): with_value("torque", (3, 2), np.nan),
    ("time[5] = 0.0",): with_value("time", 5, 0.0),
    ("q[2] = [0.5,", "1"): with_value("q", (2, 3), 0.5),
    ("q_ref.dtype = 'float32'", "float64"): lambda a: ("q_ref", a["q_ref"].astype("f4")),
    ("foot_gap.shape = (46, 5)", "(46, 6)"): lambda a: ("foot_gap", a["foot_gap"][:, :-1]),
    ("variable 'com' = None",): lambda a: ("com", None),
    ("joint[0] = \"''\"",): lambda a: ("joint", np.array(["", *a["joint"][1:]], "O")),
    ("foot = 'float64", "(6,)"): lambda a: ("foot", np.arange(6.0)),
    ("run = ", "[[[[", "JSON"): lambda a: ("run", "[" * 100_000),
    ("run.numerics.method = 3",): with_json("run", "numerics", "method", value=3),
    ("run.limits[4].limit_time = -1.0",): with_json("run", "limits", 4, "limit_time", value=-1.0),
    ("summary.speed_rms = None", "known"): with_json("summary", "speed_rms", 1, value=None),
    ("summary.path[0] = [0.0, 0.0]", "4"): with_json("summary", "path", value=[[0.0, 0.0]]),
    ("checkpoint.q = [", "[3:7]"): with_json("checkpoint", "q", 6, value=0.1),
}  # fmt: skip


@pytest.mark.parametrize("about", FORGERIES, ids=" ".join)
def test_damage_differs_from_forgery(about, saved, tmp_path):
    path = damaged(tmp_path, saved, FORGERIES[about])
    with refused(TraceFileError, about=(str(path), "digest", *about)):
        hp.load_trace(path)
    forge(path)
    with refused(TraceFileError, about=(str(path), *about)) as caught:
        hp.load_trace(path)
    readable = _stored_digest(read_netcdf(path)[0]) is not None
    assert ("digest" in str(caught.value)) != readable


def test_a_trace_need_not_have_a_summary_or_checkpoint(trace: hp.Trace, tmp_path: Path) -> None:
    bare = replace(with_run(trace, checkpoint=None), gathered=None)
    again = hp.load_trace(bare.save(tmp_path / "walk.nc"))
    for name, where in (("summary", "Trace.gathered"), ("checkpoint", "Trace.run.checkpoint")):
        with refused(ParameterError, where):
            getattr(again, name)
    assert hp.walk_verdict(again).holds == hp.walk_verdict(trace).holds


def test_a_value_that_breaks_no_rule_is_damage_all_the_same(saved, tmp_path):
    path = damaged(tmp_path, saved, with_value("torque", (0, 0), 0.125))
    with refused(TraceFileError, about=(str(path), "digest")) as caught:
        hp.load_trace(path)
    assert " = " not in str(caught.value)  # no place in it is named
    forge(path)
    assert hp.load_trace(path).torque[0, 0] == 0.125


def test_a_summary_that_breaks_its_schema_is_refused(trace, tmp_path):
    path, found = tmp_path / "summary.json", json.loads(trace.summary.to_json())
    for about, changes in {
        "data.cycles = -1": {"data": {**found["data"], "cycles": -1}},
        "errors.torque_rms = [1.0]": {"errors": {**found["errors"], "torque_rms": [1.0]}},
        "summary.joint_names[0] = 3": {"joint_names": [3, *found["joint_names"][1:]]},
    }.items():
        path.write_text(json.dumps(found | changes))
        with refused(TraceFileError, about=(f"{path}: {about}",)):
            hp.load_summary(path)


def test_a_checkpoint_that_breaks_its_schema_is_refused(trace):
    data, read = trace.checkpoint.to_dict(), hp.results.Checkpoint.from_dict
    for changes, name, value, allowed in (
        ({"time": 1e300}, "checkpoint.time", "1e+300", (1e150,)),
        ({"contacts": [[0.0]]}, "checkpoint.contacts[0]", "[0.0]", (12, 6)),
        ({"other": 1}, "checkpoint.other", "1", ()),
    ):
        with refused(ParameterError, name, value, allowed=allowed):
            read(data | changes)
    for kind, shape, values, about in (
        ("O", [1], [1], "__array__ = 'O'"), ("<f8", [2, 3], [1], "shape"),
        ("<f8", [1], ["x"], ".data: "),
    ):  # fmt: skip
        array = {"__array__": kind, "shape": shape, "data": values}
        with refused(StateError, about=("checkpoint.loop.a", about)):
            read(data | {"loop": {"a": array}})
    assert read(data).time == trace.time[-1]


# what a run keeps as samples ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def walk() -> hp.Case:
    gait = hp.Gait.tetrapod(stroke=0.1, cycle_time=2.4)
    scene, control = hp.Scene(hp.load_robot("kharagpur")), hp.KinematicControl(gait)
    return hp.Case(scene, control, duration=7.2, accuracy=1e-3, sample=0.01)


ALL = ("torque", "set_points", "contacts", "com", "energy")


def recorded(case: hp.Case, *groups: str) -> hp.Trace:
    settings = {name: getattr(case, name) for name in ("duration", "accuracy", "sample")}
    return hp.Case(case.scene, case.controller, **settings, record=groups).run()


@pytest.fixture(scope="module")
def whole(walk: hp.Case) -> hp.Trace:
    return walk.run()


@pytest.fixture(scope="module")
def motion(walk: hp.Case) -> hp.Trace:
    return recorded(walk, "motion")


def test_what_is_recorded_is_the_same_to_the_bit(walk, whole, motion) -> None:
    some = recorded(walk, "contacts", "torque")
    assert some.recorded == ("motion", "torque", "contacts")
    for name in ("time", "q", "v", "torque", "foot_position", "foot_force", "contact"):
        assert np.array_equal(getattr(some, name), getattr(whole, name)), name
    assert motion.summary.data == whole.summary.data  # of accepted steps
    assert whole.recorded == ("motion", *ALL)


def test_what_is_missing_is_said_with_what_to_record(motion, tmp_path: Path) -> None:
    for array, name, group in (
        ("q_ref", "q_ref", "set_points"), ("contact", "foot_force", "contacts"),
        ("energy_residual", "energy", "energy"),
    ):  # fmt: skip
        with refused(NotRecordedError, name, record=[group], about=(f"--record {group}`",)):
            getattr(motion, array)
    again = hp.load_trace(motion.save(tmp_path / "walk.nc"))
    assert again == motion and again.recorded == ("motion",) and "recorded motion" in repr(again)


def test_a_choice_is_part_of_the_case(walk: hp.Case) -> None:
    plain, some, every = (
        hp.Case(walk.scene, walk.controller, duration=1.0, record=groups)
        for groups in (None, ["energy", "torque"], ALL)
    )
    assert "record" not in plain.to_toml() and every == plain != some
    again = hp.Case.from_toml(some.to_toml())
    assert again == some and again.record == ("torque", "energy")
    for bad, value in ((["forces"], "forces"), ("torque", "torque")):
        with refused(ParameterError, "record", value, about=("contacts, com, energy",)):
            hp.Case(walk.scene, walk.controller, duration=1.0, record=bad)


def test_a_group_is_there_as_a_whole(whole: hp.Trace) -> None:
    arrays = {name: getattr(whole, name) for name in schema(hp.Trace)}
    rest = {"counters": {}, "joint_names": whole.joint_names, "foot_names": whole.foot_names}
    with refused(ParameterError, "Trace.foot_gap", None):
        hp.Trace(**{**arrays, "foot_gap": None}, energy=whole.energy, **rest)
