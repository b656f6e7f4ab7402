"""The rule of the verdict on peaks, on summaries with planted numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.peak_judgement import judge_summaries
from hexapod_pin.results.peak_verdict import Recomputation

NAMES = ("accuracy", "contact stiffness", "servo stiffness")
CHANGES = tuple(
    Recomputation(name, f"another {name}", "so and so", "accuracy" if k else "run")
    for k, name in enumerate(NAMES)
)
LIMIT = 6.0  # of kharagpur's joints [N m]


@cache
def walked() -> hp.Summary:
    gait = hp.Gait.tripod(stroke=0.02, cycle_time=0.4)
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.KinematicControl(gait), duration=1.2)
    summary = hp.simulate_batch([case], accuracy=1e-2, keep="summary")[0]
    assert isinstance(summary, hp.Summary)
    return summary


def planted(
    *peaks: float, joint: int = 1, rest: float = 1.0, **others: object
) -> hp.study.PeakVerdicts:
    """Judge: one joint has these peaks in run, accuracy, contact, servo; all others `rest`."""
    summaries = {}
    for name, peak in zip(("run", *NAMES), peaks, strict=False):
        torque = np.full(18, rest)
        torque[joint] = -peak  # a peak is a size
        summaries[name] = replace(
            walked(), torque_peak=torque, at_limit=np.zeros(18), outside_torque=np.zeros(18)
        )
    changes = [
        change if change.name in summaries else replace(change, failure="diverged")
        for change in CHANGES
    ]
    return judge_summaries(summaries, changes, **others)


def test_a_peak_that_stays_is_a_peak_at_the_finer_value() -> None:
    row = planted(2.0, 2.09, 2.0, 2.19).joint("lf_femur_joint")
    assert (row.verdict, row.holds, row.moved_by) == ("peak", True, ())
    assert (row.torque_peak.value, row.torque_peak.low, row.torque_peak.high) == (2.09, 2.0, 2.19)
    assert row.text == "peak 2.09 N m"
    # each change against the run without it: accuracy from the run, stiffness from the finer run
    assert row.changes == pytest.approx(
        {"accuracy": 0.09 / 2.0, "contact stiffness": -0.09 / 2.09, "servo stiffness": 0.10 / 2.09}
    )


@pytest.mark.parametrize("place", [1, 2, 3])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_five_per_cent_is_the_border_for_each_change(place: int, sign: float) -> None:
    name = NAMES[place - 1]
    for share, verdict in ((0.0499, "peak"), (0.0501, "range")):
        after = 2.0 * (1.0 + sign * share)
        peaks = [2.0, after, after, after] if place == 1 else [2.0] * 4
        peaks[place] = after
        row = planted(*peaks).joint("lf_femur_joint")
        assert row.verdict == verdict
        assert row.moved_by == (() if verdict == "peak" else (name,))
    assert f"another {name} {'+' if sign > 0 else '-'}5.01 %" in row.text
    assert row.text.startswith("range ") and " to " in row.text


def test_the_verdict_of_a_kind_is_that_of_its_largest_peak() -> None:
    """A small joint that moves leaves its kind alone; of the largest, the kind moves with it."""
    small = planted(0.5, 0.5, 0.8, 0.5)
    assert small.joint("lf_femur_joint").verdict == "range"
    assert small.kind("femur").verdict == "peak"
    assert not small.hold
    large = planted(2.0, 2.0, 2.0, 3.0)
    assert large.kind("femur").moved_by == ("servo stiffness",)
    assert large.kind("femur").torque_peak.high == 3.0
    assert large.kind("coxa").verdict == "peak"


def test_a_kind_whose_largest_peak_changes_legs_holds_by_luck_only() -> None:
    """lf_femur falls from 2 to 1 N m, and lm_femur happens to rise from 1 to 2."""
    before, after = np.full(18, 0.5), np.full(18, 0.5)
    before[[1, 4]], after[[1, 4]] = (2.0, 1.0), (1.0, 2.0)
    first, second = (replace(walked(), torque_peak=peaks) for peaks in (before, after))
    summaries = {**dict.fromkeys(("run", *NAMES), first), "contact stiffness": second}
    row = judge_summaries(summaries, CHANGES).kind("femur")
    assert row.computed["contact stiffness"] == row.computed["accuracy"] == 2.0
    assert (row.verdict, row.moved_by) == ("range", ("contact stiffness",))
    assert (row.torque_peak.low, row.torque_peak.value, row.torque_peak.high) == (1.0, 2.0, 2.0)
    assert row.changes["contact stiffness"] == -0.5


def test_peaks_that_size_nothing_are_held_against_one_per_cent_of_the_largest() -> None:
    """Of 4 N m 1 % is 0.04, and 5 % of that 0.002: below, a peak may do what it likes."""
    still = planted(1e-9, 1e-9, 1.9e-3, 1e-9, rest=4.0)
    assert still.joint("lf_femur_joint").verdict == "peak"
    moving = planted(1e-9, 1e-9, 2.1e-3, 1e-9, rest=4.0)
    assert moving.joint("lf_femur_joint").moved_by == ("contact stiffness",)


def test_a_robot_without_torques_holds() -> None:
    assert planted(0.0, 0.0, 0.0, 0.0, rest=0.0).hold


@pytest.mark.parametrize("place", range(4))
def test_a_peak_at_the_torque_limit_is_never_confirmed(place: int) -> None:
    """Whichever computation reaches it: what it would have been is cut off."""
    peaks = [0.99 * LIMIT] * 4
    peaks[place] = LIMIT
    row = planted(*peaks).joint("lf_femur_joint")
    assert (row.verdict, row.holds) == ("at the limit", False)
    assert row.text.startswith("at the limit, 5.94 to 6 N m")


def test_torques_that_nothing_limits_may_pass_the_limit_and_say_so() -> None:
    row = planted(7.0, 7.0, 7.0, 7.0, limited=False).joint("lf_femur_joint")
    assert (row.verdict, row.text) == ("peak", "peak 7 N m; beyond the limit of 6 N m")


def test_a_failed_computation_is_never_a_pass() -> None:
    found = planted(2.0, 2.0)
    for row in (*found.joints, *found.kinds):
        assert (row.verdict, row.holds) == ("range unknown", False)
    text = found.joint("lf_femur_joint").text
    assert "another contact stiffness diverged; another servo stiffness diverged" in text
    assert found.joint("lf_femur_joint").torque_p99.value > 0.0
    assert "another servo stiffness: so and so; diverged" in found.table()


def test_a_missing_computation_needs_a_reason() -> None:
    given = ["accuracy", "run"]
    with refused(ParameterError, "summaries", given, about=("'contact stiffness'",)):
        judge_summaries({"run": walked(), "accuracy": walked()}, CHANGES)


def test_a_change_that_does_not_apply_is_told_and_leaves_the_others() -> None:
    summaries = {name: walked() for name in ("run", *NAMES[:2])}
    unneeded = replace(CHANGES[2], unneeded="no servo: prescribed motion")
    found = judge_summaries(summaries, (*CHANGES[:2], unneeded))
    assert found.hold
    assert "no servo: prescribed motion" in found.table()


def test_larger_torques_outside_of_the_window_are_told() -> None:
    calm, violent = (replace(walked(), outside_torque=np.full(18, size)) for size in (1e-3, 50.0))
    one = judge_summaries(dict.fromkeys(("run", *NAMES), calm), CHANGES)
    assert not one.notes
    summaries = {**dict.fromkeys(("run", *NAMES), calm), "servo stiffness": violent}
    two = judge_summaries(summaries, CHANGES)
    assert two.hold and "0.001 to 50 N m" in two.notes[0]
    assert "Not judged" in two.table()


def test_spreads_hold_all_computations_and_every_foot() -> None:
    """Values are those of ten times the accuracy; least and largest are of all four."""
    factors = dict(zip(("run", *NAMES), (1.0, 1.01, 1.2, 0.9), strict=True))
    base = walked()
    summaries = {
        name: replace(
            base,
            torque_p99=factor * base.torque_p99,
            torque_rms=factor * base.torque_rms,
            normal_impulse=factor * base.normal_impulse,
        )
        for name, factor in factors.items()
    }
    found = judge_summaries(summaries, CHANGES)
    assert [row.foot for row in found.feet] == list(base.foot_names)
    pairs = [(found.feet[k].impulse, base.normal_impulse[k]) for k in range(6)]
    pairs += [(found.joints[k].torque_p99, base.torque_p99[k]) for k in range(18)]
    pairs += [(found.joints[k].torque_rms, base.torque_rms[k]) for k in range(18)]
    for spread, number in pairs:
        expected = (1.01 * number, 0.9 * number, 1.2 * number)
        assert (spread.value, spread.low, spread.high) == pytest.approx(expected)
        assert spread.share == pytest.approx(0.3 / 1.01)


def test_as_json_it_holds_what_the_objects_hold() -> None:
    found = planted(2.0, 2.0, 2.5, 2.0)
    data = json.loads(found.to_json())
    assert data == found.to_dict()
    row = {each["name"]: each for each in data["joints"]}["lf_femur_joint"]
    assert row["verdict"] == "range" and row["moved_by"] == ["contact stiffness"]
    assert row["changes"]["contact stiffness"] == pytest.approx(0.25)
    assert row["torque_peak"]["high"] == 2.5 and len(data["feet"]) == 6
    with refused(UnknownNameError, kind="joint", name="elbow"):
        found.joint("elbow")
