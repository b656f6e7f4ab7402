"""The registry of hard cases, every one in its quick form, and what its records and tables say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.validation.case_result import CaseResult, ExpectedFailure, ExpectedValue
from hexapod_pin.validation.cases.bodies import ChainLink, anchored, anchored_scene
from hexapod_pin.validation.cases.drop import catalogue_state, drop, end_state
from hexapod_pin.validation.cases.flight import TRUNK, first_flip
from hexapod_pin.validation.cases.linkage import double_pendulum
from hexapod_pin.validation.cases.registry import HARD_CASES, run_hard_cases
from hexapod_pin.validation.cases.robots import answers, references, robot_file
from hexapod_pin.validation.hard_case import HardCase, Trial, run_cases
from hexapod_pin.validation.solver_setting import DOP853, IMPLICIT_1MS, CaseRun, SolverSetting
from hexapod_pin.validation.tables import RESULT_HEAD, result_table, summary, worst_results

CHOSEN = {
    "bounces_at_small_steps": lambda _, name, step, bounces: bounces == 30,
    "turning": lambda setting, duration: setting != IMPLICIT_1MS,
    "grazing": lambda setting, name, _: (setting.method == "rk4") == (name in ("elastic", "exact")),
}
"""What is run of dear trials, by what the quick ones hold too.

That is: 100 bounces of HC04 by DOP853, and a bounce of every kind by rk4; the turns of HC19 at 1 ms
over 360 s; the laws of HC24 by other methods, each law by one of the two that are slow."""
SLOW_TRIALS = [
    pytest.param(case.name, trial, id=f"{case.name}-{trial.run.__name__}")
    for case in HARD_CASES
    for trial in case.trials
    if isinstance(trial, Trial) and trial.slow
]


def told(results: list[CaseResult]) -> str:
    """Return the failures, one line each."""
    failed = [result for result in results if result.failed]
    return "\n".join(f"{r.what}: {r.error:.1e}, {r.method} {r.note}" for r in failed)


@pytest.mark.parametrize("case", HARD_CASES, ids=lambda case: case.name)
def test_hard_case(case: HardCase) -> None:
    """Every number that must hold its tolerance does."""
    results = run_cases([case], quick=True)
    assert results
    assert not told(results)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "trial"), SLOW_TRIALS)
def test_slow_trial_of_a_hard_case(case: str, trial: Trial) -> None:
    """Those that a quick run leaves out, in the settings of a full run."""
    chosen = CHOSEN.get(trial.run.__name__, lambda *_: True)
    results = []
    for setting in (*trial.settings, *trial.full_only):
        variants = [one for one in trial.variants if chosen(setting, *one)]
        one = replace(trial, settings=(setting,), full_only=(), variants=variants)
        results += one.results(case, quick=False)
    assert results
    assert not told(results)


def test_every_case_of_the_catalogue_is_registered_once() -> None:
    """The catalogue has the joints of our robot in our order."""
    named = {name.split("_")[0] for name in references() if name != "_meta"}
    names = [case.name for case in HARD_CASES]
    assert named <= set(names)
    assert len(set(names)) == len(names)
    names = load_robot(robot_file("hexa_ref")).joint_names
    assert tuple(names) == tuple(answers("HC14b")["joint_order"])


# --- records, runner, tables --------------------------------------------------------------------


def result(error: float, reason: str = "", tolerance: float = 1e-6) -> CaseResult:
    """Return a result of a made-up case; with a reason it is expected to reach 0.5."""
    entry = ExpectedFailure("HC0", "x", "m", reason, 0.5) if reason else None
    return CaseResult("HC0", "x", "m", error, tolerance, expected=entry)


def test_verdicts() -> None:
    """Of an expected failure, three times what is registered, 0.5, is the end; so is a pass."""
    beyond = "FAIL: expected to reach 5.0e-01 (order 1)"
    for error, reason, verdict in [
        (1e-6, "", "pass"), (1.01e-6, "", "FAIL"), (math.inf, "", "FAIL"), (math.nan, "", "FAIL"),
        (1.5, "order 1", "expected failure: order 1"), (1.51, "order 1", beyond),
        (math.inf, "order 1", beyond), (math.nan, "order 1", beyond),
        (1e-7, "order 1", "unexpected pass: order 1"),
    ]:  # fmt: skip
        one = result(error, reason)
        assert one.verdict == verdict
        assert one.failed == (verdict[:4] == "FAIL" or verdict[:10] == "unexpected")
    missing = CaseResult.not_run("HC0", "x", "m", "mujoco is not installed")
    assert missing.verdict == "not run: mujoco is not installed" and not missing.failed


def test_a_trial_runs_settings_and_variants_and_says_where_it_fails() -> None:
    loose = SolverSetting("rk4", 1e-2)

    def run(setting, number):
        if number == 3:
            raise ParameterError("number", number, "below 3")
        yield ExpectedValue(f"number {number}", 0.1 * number, 0.15, "m", "note")

    trial = Trial(run, (DOP853, IMPLICIT_1MS), (loose,), ((1,), (2,), (3,)), quick_variants=1)
    case = HardCase("HC0", "tests", (trial,))
    [only] = run_cases([case], quick=True)
    assert (only.what, only.method, only.kind) == ("number 1", str(DOP853), "pass")
    found = run_cases([case])
    assert [one.method for one in found] == [str(s) for s in (DOP853, IMPLICIT_1MS, loose)
                                             for _ in range(3)]  # fmt: skip
    assert [one.kind for one in found[:3]] == ["pass", "FAIL", "FAIL"]
    assert "below 3" in found[2].note and found[2].error == math.inf
    assert [one.kind for one in found[6:]] == ["pass", "FAIL", "FAIL"]
    assert all(one.seconds >= 0.0 for one in found)


def test_run_takes_names_and_tells_progress() -> None:
    fractions: list[float] = []
    results = run_hard_cases(quick=True, names=["HC17", "HC38b"], progress=fractions.append)
    assert [one.case for one in results] == ["HC17", "HC38b"]
    assert fractions == [0.5, 1.0]
    with refused(UnknownNameError, kind="hard case", name="HC99"):
        run_hard_cases(quick=True, names=["HC99"])


def test_table_and_summary() -> None:
    results = [
        CaseResult("HC38b", "a|b", "closed form", 1e-16, 1e-15, "m", seconds=1.0),
        CaseResult("HC34", "b", "refused", 1.0, 0.0, seconds=2.0), result(1.0, "order 1"),
        result(0.0, "order 1"), CaseResult.not_run("HC0", "x", "m", "rigid"),
    ]  # fmt: skip
    table = result_table(results)
    assert table.head == RESULT_HEAD
    assert table.rows[0][:7] == ("HC38b", "a|b", "closed form", "1.0e-16", "1.0e-15", "m", "pass")
    assert summary(results) == (
        "1 pass, 1 FAIL, 1 expected failure, 1 unexpected pass, 1 not run; 5 results, 3 s"
    )
    assert table.markdown().count("\n") == 7 and r"a\|b" in table.markdown()
    assert "expected failure: order 1" in table.text()
    nearer = CaseResult("HC38b", "c", "closed form", 9e-16, 1e-15, "m")
    assert worst_results([*results, nearer]) == [nearer, results[1], results[3]]


# --- the constructions themselves ---------------------------------------------------------------


def test_an_anchored_base_stays() -> None:
    """A pendulum of 1 kg moves its base of 1e12 kg by 1e-12 of what one of 1 kg would move."""
    robot = anchored([ChainLink(1.0, (0.0, 0.0, -0.05), (0.0025,) * 3)])
    scene, start = anchored_scene(robot, [2.0], [0.0])
    trace = CaseRun(scene, start, 1.0, 0.1).by(SolverSetting("dop853", 1e-9))
    assert np.abs(trace.q[:, :7] - trace.q[0, :7]).max() < 1e-11
    assert np.ptp(trace.q[:, 7]) > 3.9  # from 2 rad to -2 rad: no friction, no energy lost
    energy = trace.energy["kinetic"] + trace.energy["potential"] + trace.energy["elastic"]
    # of 1e13 J in all, which round to 2 mJ
    assert np.abs(energy - energy[0]).max() < 0.1


def test_references_of_our_own_meet_the_catalogue() -> None:
    """The double pendulum; the first flip: it starts at the top where an outer rate is zero.

    HC40 soft by another integrator and another way to count forces than the catalogue's: 1e-11.
    """
    case = answers("HC13")["seed_leg_femur_tibia"]
    numbers = tuple(float(x) for x in case["params_m1,c1,l1,J1,m2,c2,J2"])
    known = [float(x) for x in case["theta1,theta2,dtheta1,dtheta2 at 1s"]]
    assert double_pendulum(numbers) == pytest.approx(known, abs=1e-11)
    period = float(answers("HC11")["I=(1,2,3),w=(0.01,1,0)"]["period"])
    flip = first_flip(np.array([1.0, 2.0, 3.0]), np.array([0.01, 1.0, 0.0]))
    assert flip == pytest.approx(period / 4.0, rel=1e-13)
    # with both outer rates it first goes up: between a quarter and half a period
    case = answers("HC11")["seed_trunk_w2=10,eps=1e-3"]
    flip = first_flip(np.array(TRUNK), np.array([1e-3, 10.0, 1e-3]))
    assert 0.25 * float(case["period"]) < flip < 0.5 * float(case["period"])
    robot = drop("soft").scene.robot
    ours, answer = end_state(robot, "soft").q, catalogue_state(robot).q.copy()
    answer[3:7] *= np.sign(ours[3:7] @ answer[3:7])
    assert np.abs(ours - answer).max() < 1e-11
