"""What a run keeps as samples: groups, what works without the rest, and size of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from page_data import PageData
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import NotRecordedError, ParameterError
from hexapod_pin.results.schema import schema


@pytest.fixture(scope="module")
def walk() -> hp.Case:
    """The shortest with a whole steady cycle."""
    gait = hp.Gait.tetrapod(stroke=0.1, cycle_time=2.4)
    scene, control = hp.Scene(hp.load_robot("kharagpur")), hp.KinematicControl(gait)
    return hp.Case(scene, control, duration=7.2, accuracy=1e-3, sample=0.01)


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
    """Choosing changes what is stored, not what is run."""
    some = recorded(walk, "contacts", "torque")
    assert some.recorded == ("motion", "torque", "contacts")
    for name in ("time", "q", "v", "torque", "foot_position", "foot_force", "foot_normal"):
        assert np.array_equal(getattr(some, name), getattr(whole, name)), name
    assert np.array_equal(some.contact, whole.contact)
    assert motion.summary.data == whole.summary.data  # of accepted steps
    assert whole.recorded == ("motion", "torque", "set_points", "contacts", "com", "energy")


@pytest.mark.parametrize(
    ("array", "name", "group"),
    [("q_ref", "q_ref", "set_points"), ("contact", "foot_force", "contacts"),
     ("energy_residual", "energy", "energy")],
)  # fmt: skip
def test_what_is_missing_is_said_with_what_to_record(
    motion: hp.Trace, array: str, name: str, group: str
) -> None:
    with refused(NotRecordedError, name, record=[group], about=(f"--record {group}`",)):
        getattr(motion, array)


def test_a_partial_trace_goes_through_its_file(motion: hp.Trace, tmp_path: Path) -> None:
    again = hp.load_trace(motion.save(tmp_path / "walk.nc"))
    assert again == motion
    assert again.recorded == ("motion",)
    assert hp.load_case(again).record == ()


def test_a_playback_without_contacts_has_no_arrows(motion: hp.Trace, tmp_path: Path) -> None:
    page = PageData(hp.view.write_html(motion, tmp_path / "walk.html").read_text())
    assert len(page.runs[0]["tree"]) == 19 and page.runs[0]["feet"] == []
    assert set(page.runs[0]["channels"]) == {"time", "place", "turn", "angle", "speed"}


def test_a_choice_is_part_of_the_case(walk: hp.Case) -> None:
    """Cases that name nothing stay as they were; one that names everything is one of them."""

    def case(**more: list[str]) -> hp.Case:
        return hp.Case(walk.scene, walk.controller, duration=1.0, accuracy=1e-3, **more)

    plain, some = case(), case(record=["energy", "torque"])
    assert "record" not in plain.to_toml()
    assert case(record=["torque", "set_points", "contacts", "com", "energy"]) == plain != some
    again = hp.Case.from_toml(some.to_toml())
    assert again == some and again.record == ("torque", "energy")


@pytest.mark.parametrize(("bad", "value"), [(["forces"], "forces"), ("torque", "torque")])
def test_a_bad_choice_is_refused(walk: hp.Case, bad: object, value: object) -> None:
    with refused(ParameterError, "record", value, about=("contacts, com, energy",)):
        hp.Case(walk.scene, walk.controller, duration=1.0, record=bad)  # type: ignore[arg-type]


def test_a_group_is_there_as_a_whole(whole: hp.Trace) -> None:
    """A half-given group would be found out too late."""
    arrays = {name: getattr(whole, name) for name in schema(hp.Trace)}
    rest = {"counters": {}, "joint_names": whole.joint_names, "foot_names": whole.foot_names}
    with refused(ParameterError, "Trace.foot_gap", None):
        hp.Trace(**{**arrays, "foot_gap": None}, energy=whole.energy, **rest)


def test_a_file_is_smaller_than_its_samples(whole: hp.Trace, tmp_path: Path) -> None:
    """Measured: 0.74 of its columns' bytes here, 0.57 for longer walks with more samples."""
    size = sum(column.values.nbytes for column in whole.group().columns.values())
    stored = whole.save(tmp_path / "whole.nc").stat().st_size
    assert stored < 0.8 * size
