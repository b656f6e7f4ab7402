"""The hard cases in reduced form, and the machinery that computes and shows them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hexapod_pin.benchmark.scenes import hc40
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.validation.cases.bodies import Link, anchored, anchored_scene
from hexapod_pin.validation.cases.drop import drop, end_state
from hexapod_pin.validation.cases.flight import TRUNK, first_flip
from hexapod_pin.validation.cases.linkage import double_pendulum
from hexapod_pin.validation.cases.reference_data import answers, references
from hexapod_pin.validation.cases.registry import HARD_CASES, HardCase, HardRow, run_hard
from hexapod_pin.validation.cases.solver_settings import Run
from hexapod_pin.validation.cases.table import HEAD, hard_table, summary, worst_rows


@pytest.mark.parametrize("case", HARD_CASES, ids=lambda case: case.name)
def test_hard_case(case: HardCase) -> None:
    """Every number of the reduced case that must hold its tolerance does."""
    rows = list(case.rows(quick=True))
    assert rows
    failed = [row for row in rows if row.verdict == "FAIL"]
    assert not failed, "\n".join(f"{row.what}: {row.error:.1e}, {row.method}" for row in failed)


def test_every_case_of_the_catalogue_is_in_the_suite() -> None:
    """38b is a row of HC38; HC32's hour is a benchmark of its own, a minute stands here."""
    named = {name.split("_")[0] for name in references() if name != "_meta"}
    assert named - {case.name for case in HARD_CASES} == {"HC38b"}
    assert any(row.case == "HC38b" for row in run_hard(quick=True, names=["HC38"]))


def test_what_cannot_be_run_says_why() -> None:
    for case in HARD_CASES:
        if case.run is None:
            [row] = case.rows(quick=True)
            assert row.verdict == "not run" and row.note == case.why_not
    assert {case.name for case in HARD_CASES if case.run is None} == {"HC17", "HC18"}


def test_verdicts() -> None:
    def verdict(error: float, required: bool = True) -> str:
        return HardRow("HC0", "x", "m", error, 1e-6, required=required).verdict

    assert verdict(1e-6) == "pass"
    assert verdict(1.01e-6) == verdict(math.inf) == verdict(math.nan) == "FAIL"
    assert verdict(1.0, required=False) == "short"
    assert HardRow("HC0", "x", "m", math.nan, math.nan).verdict == "not run"


def test_run_hard_takes_names_and_tells_progress() -> None:
    told: list[float] = []
    rows = run_hard(quick=True, names=["HC17", "HC16"], progress=told.append)
    assert [row.case for row in rows] == ["HC16", "HC16", "HC17"]
    assert told == [0.5, 1.0]
    with pytest.raises(UnknownNameError, match="HC99"):
        run_hard(quick=True, names=["HC99"])


def test_table_and_summary() -> None:
    rows = [
        HardRow("HC38b", "a", "closed form", 1e-16, 1e-15, "m"),
        HardRow("HC34", "b", "refused", 1.0, 0.0),
    ]
    table = hard_table(rows)
    assert table.head == HEAD
    assert table.rows[0][:7] == ("HC38b", "a", "closed form", "1.0e-16", "1.0e-15", "m", "pass")
    assert summary(rows) == "1 pass, 1 FAIL, 0 short, 0 not run"
    nearer = HardRow("HC38b", "c", "closed form", 9e-16, 1e-15, "m")
    assert worst_rows([*rows, nearer]) == [nearer, rows[1]]


# --- the constructions themselves ---------------------------------------------------------------


def test_an_anchored_base_stays() -> None:
    """A pendulum of 1 kg moves its base of 1e12 kg by 1e-12 of what one of 1 kg would move."""
    robot = anchored([Link(1.0, (0.0, 0.0, -0.05), (0.0025,) * 3)])
    scene, start = anchored_scene(robot, [2.0], [0.0])
    trace = Run(scene, start, 1.0, 0.1).by(Setting("dop853", 1e-9))
    assert np.abs(trace.q[:, :7] - trace.q[0, :7]).max() < 1e-11
    assert np.ptp(trace.q[:, 7]) > 3.9  # from 2 rad to -2 rad: no friction, no energy lost
    energy = trace.energy["kinetic"] + trace.energy["potential"] + trace.energy["elastic"]
    # of 1e13 J in all, which round to 2 mJ
    assert np.abs(energy - energy[0]).max() < 0.1


def test_double_pendulum_of_our_own_meets_the_catalogue() -> None:
    case = answers("HC13")["seed_leg_femur_tibia"]
    numbers = tuple(float(x) for x in case["params_m1,c1,l1,J1,m2,c2,J2"])
    known = [float(x) for x in case["theta1,theta2,dtheta1,dtheta2 at 1s"]]
    assert double_pendulum(numbers) == pytest.approx(known, abs=1e-11)


def test_first_flip_is_a_quarter_of_the_catalogue_s_period() -> None:
    """It starts at the top of the middle rate where an outer rate is zero."""
    period = float(answers("HC11")["I=(1,2,3),w=(0.01,1,0)"]["period"])
    flip = first_flip(np.array([1.0, 2.0, 3.0]), np.array([0.01, 1.0, 0.0]))
    assert flip == pytest.approx(period / 4.0, rel=1e-13)
    # with both outer rates it first goes up: between a quarter and half a period
    case = answers("HC11")["seed_trunk_w2=10,eps=1e-3"]
    flip = first_flip(np.array(TRUNK), np.array([1e-3, 10.0, 1e-3]))
    assert 0.25 * float(case["period"]) < flip < 0.5 * float(case["period"])


def test_our_reference_of_hc40_soft_meets_the_catalogue() -> None:
    """Another integrator and another way to count forces than the catalogue's: 1e-11."""
    robot = drop("soft").scene.robot
    answer = hc40("soft").answer
    assert answer is not None
    ours = end_state(robot, "soft").q
    sign = np.sign(ours[3:7] @ answer[3:7])
    answer = np.concatenate([answer[:3], sign * answer[3:7], answer[7:]])
    assert np.abs(ours - answer).max() < 1e-11
