"""S1's comparison judges cells by what was asked for, and draws the same grounds again."""

from __future__ import annotations

from dataclasses import replace

import pytest
from studies.foot_control.cells import DRY, LEAST_TORQUE, OWN, Cell, Size, cells, draws
from studies.foot_control.judgement import SHOWN, CellChange
from studies.foot_control.s1_comparison import (
    s1_comparison,
)
from studies.foot_control.variants import (
    BOTH_WAYS,
    NO_PARTS,
    PID,
    SOLE_UNKNOWN,
    TARGETS,
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


@pytest.mark.parametrize(
    ("values", "missed"),
    [
        ({}, []),
        ({"slip_distance": -0.03}, ["slip path"]),  # the interval goes up to +1 %
        ({"energy_per_metre": 0.01}, ["energy"]),
        ({"torque_rms": 0.03, "torque_peak": 0.07}, ["torque RMS", "torque peak"]),
        ({"roll_rms": 0.05}, []),  # not surely above 2 %
        ({"roll_rms": 0.07, "pitch_rms": 0.1}, ["roll", "pitch"]),
        ({"half": 0.09, "torque_peak": 0.02}, ["torque peak"]),
        ({"cell": replace(CELL, terrain="flat"), "slip_distance": -0.03}, []),
    ],
)
def test_force_targets_are_held_to_the_numbers(values, missed: list[str]) -> None:
    assert changed(**values).missed() == missed


def test_other_variants_have_rules_of_their_own() -> None:
    lost = replace(changed(), walked=(9, 10))
    assert lost.missed() == ["a run that did not walk"]
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
    assert changed(NO_PARTS, **{**nothing, "roll_rms": -0.02}).missed() == ["roll"]
    assert replace(changed(NO_PARTS), tick=0.002).missed() is None


def test_draws_repeat_and_can_be_walked_in_all_postures() -> None:
    robots = {OWN: hp.load_robot("kharagpur")}
    grounds = ("bumps", "soil", DRY)
    size = Size(
        ("kharagpur",), (OWN,), grounds, ("accurate", "s1"), (0.005,),
        dict.fromkeys(grounds, 4), 3, {},
    )  # fmt: skip
    with pytest.raises(UnknownNameError):
        s1_comparison(grounds="flat,water")
    first, again = (draws(robots, "kharagpur", "bumps", size) for _ in range(2))
    assert [(one.gait, one.seed) for one in first] == [(one.gait, one.seed) for one in again]
    fewer = draws(robots, "kharagpur", "bumps", replace(size, draws={"bumps": 2}))
    assert [one.seed for one in fewer] == [one.seed for one in first[:2]]
    assert len({one.seed for one in first}) == 4
    for one in first:
        refuse_impossible(robots[OWN], one.gait)
    assert [cell.contact for cell in cells(size)] == ["accurate", "s1", "soil", "accurate", "s1"]
