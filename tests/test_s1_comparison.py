"""S1's comparison judges cells by what was asked for, and draws the same grounds again."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from studies.foot_control.cells import DRY, LEAST_TORQUE, OWN, Cell, Found, Size, cells, draws
from studies.foot_control.further import (
    CHANGED,
    DISSIPATIONS,
    FURTHER_TITLE,
    SAND_TITLE,
    energy_table,
    sand_table,
)
from studies.foot_control.judgement import SHOWN, CellChange, median_table
from studies.foot_control.s1_comparison import (
    FASTER,
    FURTHER,
    KEPT,
    REASONS,
    kept,
    s1_comparison,
)
from studies.foot_control.variants import (
    BOTH_WAYS,
    NO_PARTS,
    PID,
    SOLE_UNKNOWN,
    TARGETS,
    TARGETS_SUSPENSION,
    leg_by_leg,
    parts,
)

import hexapod_pin as hp
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.results.walk_metrics import Estimate

GOOD = {
    "slip_distance": -0.5, "energy_per_metre": -0.15, "vertical_acceleration_rms": -0.3,
    "torque_rms": 0.01, "torque_peak": 0.02, "roll_rms": -0.1, "pitch_rms": -0.1,
    "force_peak": 0.0,
}  # fmt: skip
CELL = Cell("athena", LEAST_TORQUE, "bumps", "accurate")


def changed(variant: str = TARGETS, cell: Cell = CELL, half: float = 0.04, **values: float):
    """Return changes that meet everything, but for some values."""
    changes = {name: Estimate({**GOOD, **values}[name], half, 10) for name in SHOWN}
    return CellChange(cell, 0.005, variant, (10, 10), changes)


@pytest.mark.parametrize("variant", [TARGETS, TARGETS_SUSPENSION])
@pytest.mark.parametrize(
    ("values", "missed"),
    [
        ({}, []),
        ({"slip_distance": -0.03}, ["slip path"]),  # the interval goes up to +1 %
        ({"energy_per_metre": 0.01}, ["energy"]),
        ({"torque_rms": 0.03}, ["torque RMS"]),
        ({"torque_peak": 0.07}, ["torque peak"]),
        ({"roll_rms": 0.05}, []),  # not surely above 2 %
        ({"roll_rms": 0.07, "pitch_rms": 0.1}, ["roll", "pitch"]),
    ],
)
def test_force_targets_are_held_to_the_numbers(variant: str, values, missed: list[str]) -> None:
    assert changed(variant, **values).missed() == missed


def test_intervals_count_on_bumps_and_for_peaks() -> None:
    flat = replace(CELL, terrain="flat")
    assert changed(cell=flat, slip_distance=-0.03).missed() == []
    assert changed(half=0.09, torque_peak=0.02).missed() == ["torque peak"]
    lost = replace(changed(), walked=(9, 10))
    assert lost.missed() == ["a run that did not walk"]
    gone = replace(changed(), changes={**changed().changes, "roll_rms": None})
    assert gone.missed() == ["roll"]


def test_other_variants_have_rules_of_their_own() -> None:
    own = replace(CELL, posture=OWN)
    assert changed(PID).missed() is None
    assert changed(cell=own).missed() is None
    assert changed(cell=replace(CELL, terrain="soil"), slip_distance=-0.03).missed() == []
    assert changed(cell=replace(CELL, terrain="patches"), torque_rms=0.03).missed() == [
        "torque RMS"
    ]
    assert changed(SOLE_UNKNOWN, torque_rms=0.5).missed() == []
    assert changed(SOLE_UNKNOWN, slip_distance=0.01).missed() == ["slip path"]
    assert changed(BOTH_WAYS, own, torque_rms=0.04, torque_peak=0.11).missed() == ["torque RMS"]
    nothing = dict.fromkeys(GOOD, 0.005)
    assert changed(NO_PARTS, **nothing).missed() == []
    assert changed(NO_PARTS, replace(CELL, terrain=DRY), **nothing).missed() == []
    assert changed(NO_PARTS, **{**nothing, "roll_rms": -0.02}).missed() == ["roll"]
    assert replace(changed(NO_PARTS), tick=0.002).missed() is None


def test_medians_are_judged_where_one_was_asked_for() -> None:
    some = [changed(slip_distance=value) for value in (-0.1, -0.15, -0.5)]
    [row] = median_table(some).texts()
    assert row[-1] == "FAIL: slip path -15.0, at most -20" and row[5] == "-15 (-50, -10)"
    [row] = median_table([changed(slip_distance=-0.21)]).texts()
    assert row[-1] == "pass"
    [row] = median_table([changed(PID)]).texts()
    assert row[-1] == "-"


def test_draws_repeat_and_can_be_walked_in_all_postures() -> None:
    robots = {OWN: hp.load_robot("kharagpur")}
    size = Size(
        ("kharagpur",),
        (OWN,),
        ("bumps", "soil", DRY),
        ("accurate", "s1"),
        (0.005,),
        dict.fromkeys(("bumps", "soil", DRY), 4),
        3,
        {},
    )
    first, again = (draws(robots, "kharagpur", "bumps", size) for _ in range(2))
    assert [one.gait for one in first] == [one.gait for one in again]
    assert [one.seed for one in first] == [one.seed for one in again]
    fewer = draws(robots, "kharagpur", "bumps", replace(size, draws={"bumps": 2}))
    assert [one.seed for one in fewer] == [one.seed for one in first[:2]]
    assert len({one.seed for one in first}) == 4
    for one in first:
        refuse_impossible(robots[OWN], one.gait)
    assert [cell.contact for cell in cells(size)] == ["accurate", "s1", "soil", "accurate", "s1"]


def test_each_variant_has_its_parts_alone() -> None:
    """What differs from the variant without parts is what its name says."""
    assert parts()[NO_PARTS] == {}
    assert parts()[PID]["slip"].anticipates is False
    modes = leg_by_leg().model_dump()
    assert all(modes[name] == 1.0 for name in ("heave", "tilt", "warp") if name in modes)


def test_energy_is_compared_with_one_thing_changed() -> None:
    """A longer stroke costs less per metre, bumps do not change flat ground."""

    def run(size: Size) -> Found:
        small = replace(
            size, robots=("kharagpur",), postures=(OWN,), terrains=("flat",), draws={"flat": 1},
            contacts=("accurate",), variants=(TARGETS,), settings=FASTER,
        )  # fmt: skip
        return Found.of(small, threads=1)

    rows = {row[3]: row for row in energy_table(run, 1, 3).texts()}
    assert list(rows) == list(CHANGED)
    cost = {name: float(row[5]) for name, row in rows.items()}
    assert cost["stroke 40 mm"] > cost["as drawn"] > cost["stroke 100 mm"]
    assert all(row[4] == "1" for row in rows.values())


def test_less_dissipation_of_the_sand_alone_is_compared() -> None:
    """Each row is of another sand, on which the largest torque is another."""

    def run(size: Size) -> Found:
        small = replace(size, postures=(OWN,), variants=(TARGETS,), settings=FASTER)
        return Found.of(small, threads=1)

    rows = {row[3]: row for row in sand_table(run, 1, 3).texts()}
    assert list(rows) == [f"dissipation {size:g} s/m" for size in DISSIPATIONS]
    peaks = [float(row[5]) for row in rows.values()]
    assert len(set(peaks)) == len(peaks)


def test_what_a_command_does_not_run_again_is_kept(tmp_path) -> None:
    main = "`python scripts/studies s1_comparison`\n\nmachine\n\n## Table\n\n| a |"
    table = f"## {SAND_TITLE}\n\n| b |"
    data = {"command": "c", "machine": {"cpu": "x"}, "numbers": [], "cells": [1], "drawn": {}}
    page = tmp_path / "s1_comparison.md"
    (tmp_path / "s1_comparison.json").write_text(json.dumps(data))
    page.write_text(f"# Title\n\n{main}\n\n{REASONS}\n\n{table}\n")
    first = kept(tmp_path)
    assert first.main == [main] and first.tables == {SAND_TITLE: table}
    assert first.data["main"] == {"command": "c", "machine": {"cpu": "x"}}
    assert first.data["cells"] == [1]
    data |= {"command": "of the parts that were added", "main": first.data["main"]}
    (tmp_path / "s1_comparison.json").write_text(json.dumps(data))
    again, further = KEPT.format("all"), f"{FURTHER_TITLE}\n\nmore"
    page.write_text(f"# Title\n\nc2\n\n{again}\n\n{main}\n\n{further}\n\n{REASONS}\n\n{table}\n")
    second = kept(tmp_path)
    assert (second.main, second.data) == (first.main, first.data)
    assert second.tables == {FURTHER: further, SAND_TITLE: table}


def test_unknown_names_are_refused() -> None:
    with pytest.raises(UnknownNameError):
        s1_comparison(grounds="flat,water")
