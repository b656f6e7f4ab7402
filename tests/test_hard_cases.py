"""The registry of hard cases, every one in its quick form, and what its records and tables say."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from refusals import refused

from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.validation.case_result import CaseResult, ExpectedFailure, ExpectedValue
from hexapod_pin.validation.cases.registry import HARD_CASES, run_hard_cases
from hexapod_pin.validation.cases.robots import answers, references, robot_file
from hexapod_pin.validation.hard_case import HardCase, Trial, run_cases
from hexapod_pin.validation.solver_setting import DOP853, IMPLICIT_1MS, SolverSetting
from hexapod_pin.validation.tables import result_table, summary, worst_results

SLOW_TRIALS = [
    pytest.param(case.name, trial, id=f"{case.name}-{trial.run.__name__}")
    for case in HARD_CASES
    for trial in case.trials
    if isinstance(trial, Trial) and trial.slow
]


def failures_of(results: list[CaseResult]) -> str:
    failed = [result for result in results if result.failed]
    return "\n".join(f"{r.what}: {r.error:.1e}, {r.method} {r.note}" for r in failed)


@pytest.mark.parametrize("case", HARD_CASES, ids=lambda case: case.name)
def test_hard_case(case: HardCase) -> None:
    results = run_cases([case], quick=True)
    assert results
    assert not failures_of(results)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "trial"), SLOW_TRIALS)
def test_slow_trial_of_a_hard_case(case: str, trial: Trial) -> None:
    one = replace(trial, settings=trial.settings[-1:], full_only=(), variants=trial.variants[:1])
    results = list(one.results(case, quick=False))
    assert results
    assert not failures_of(results)


def test_every_case_of_the_catalogue_is_registered_once() -> None:
    named = {name.split("_")[0] for name in references() if name != "_meta"}
    names = [case.name for case in HARD_CASES]
    assert named <= set(names)
    assert len(set(names)) == len(names)
    names = load_robot(robot_file("hexa_ref")).joint_names
    assert tuple(names) == tuple(answers("HC14b")["joint_order"])


# --- records, runner, tables --------------------------------------------------------------------


def result(error: float, reason: str = "", tolerance: float = 1e-6) -> CaseResult:
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
    assert table.rows[0][:7] == ("HC38b", "a|b", "closed form", "1.0e-16", "1.0e-15", "m", "pass")
    assert summary(results) == (
        "1 pass, 1 FAIL, 1 expected failure, 1 unexpected pass, 1 not run; 5 results, 3 s"
    )
    nearer = CaseResult("HC38b", "c", "closed form", 9e-16, 1e-15, "m")
    assert worst_results([*results, nearer]) == [nearer, results[1], results[3]]
