"""`hexapod-pin verify` and tables of rows: planted errors are found; the exit status says so."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from functools import cache
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refused
from typer.testing import CliRunner

from hexapod_pin.benchmark import hard_suite
from hexapod_pin.benchmark.report import row_name, run_table
from hexapod_pin.benchmark.work_precision.measure import BenchmarkRow
from hexapod_pin.commands import app as cli
from hexapod_pin.commands.terminal import MISSED
from hexapod_pin.errors import MissingPackageError, UnknownNameError
from hexapod_pin.formulations.maximal import model as kinematics
from hexapod_pin.formulations.maximal.bodies import parsed_robot
from hexapod_pin.formulations.maximal.model import JOINT_POINT
from hexapod_pin.formulations.rigid import contact_events as impact
from hexapod_pin.formulations.rigid import model
from hexapod_pin.text_table import Table
from hexapod_pin.validation import case_result as expected_failures
from hexapod_pin.validation.case_result import CaseResult, ExpectedFailure
from hexapod_pin.validation.checks import flight_checks, limit_checks
from hexapod_pin.validation.checks import registry as mujoco_terms
from hexapod_pin.validation.checks.registry import run_checks
from hexapod_pin.validation.hard_case import Check, run_cases
from hexapod_pin.validation.stress import StressOutcome, stress_table
from hexapod_pin.validation.tables import result_table, summary

DERIVATIVE = import_module("hexapod_pin.formulations.rigid.derivative")
CONTAINED = ("tripod-limit", "flight")  # by tripod-order and hc14b
OWN = (*limit_checks.CHECKS, *flight_checks.CHECKS, mujoco_terms.MUJOCO_CHECK)
CHECKED = [check for check in OWN if check.name not in CONTAINED]
NO_MUJOCO = "not run: mujoco is not installed"
DRIFT = model.RigidModel.drift
QUICK = "core-terms,hc15-tripods,hc18,pinocchio-impact"


def found(name: str) -> CaseResult:
    [result] = run_checks(names=[name])
    return result


def run(check: Check) -> CaseResult:
    [result] = run_cases([check])
    return result


@pytest.mark.parametrize("check", CHECKED, ids=lambda check: check.name)
def test_limits_flight_and_mujoco(check) -> None:
    row = run(check)
    assert row.passed or row.verdict == NO_MUJOCO, row


def test_without_mujoco_the_row_says_so(monkeypatch) -> None:
    monkeypatch.setattr(mujoco_terms, "find_spec", lambda name: None)
    row = run(mujoco_terms.MUJOCO_CHECK)
    assert row.verdict == NO_MUJOCO and not row.failed


def test_command_prints_a_table_and_succeeds(tmp_path) -> None:
    out = tmp_path / "verify.md"
    result = CliRunner().invoke(cli.app, ["verify", "--only", QUICK, "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "4 pass, 0 FAIL" in result.output
    assert out.read_text().startswith("| case | what | method or source | error")


def test_a_check_that_breaks_or_gives_nan_has_failed() -> None:
    def breaks() -> float:
        raise np.linalg.LinAlgError("singular")

    broken = run(Check("a", "b", breaks, 1.0))
    blank = run(Check("c", "d", lambda: math.nan, 1.0))
    assert not broken.passed and "singular" in broken.note
    assert not blank.passed
    assert "singular" in result_table([broken, blank]).text()
    assert "0 pass, 2 FAIL" in summary([broken, blank])
    with refused(UnknownNameError, kind="check", name="hc99"):
        run_checks(names=["hc99"])


def negated(function):
    return lambda *args: -function(*args)


def turned_forces(module):
    solve = module.solve_kkt

    def solve_kkt(*args):
        found = solve(*args)
        return type(found)(**{**vars(found), "f": -found.f})

    return solve_kkt


def lost_dots(i, j):
    """S1's eq. 3, row 1, as it is printed: s where s' belongs."""
    return i.rate[:, :, JOINT_POINT] - j.rate[:, :, JOINT_POINT]


PLANTED = {
    "eq. 5 with the sign of its right side turned":
        ("pinocchio-impact", impact, "required_velocity_change", lambda rows, v: rows @ v),
    "eq. 5 as printed, +lambda": ("hc18", impact, "solve_kkt", turned_forces(impact)),
    "foot rows in the joint's own axes": ("core-terms", model, "CONTACT_FRAME", "LOCAL"),
    "eq. 3 without J' v":
        ("pinocchio-motion", model.RigidModel, "drift", lambda *args: 0.0 * DRIFT(*args)),
    "pulling ground forces":
        ("pinocchio-motion", DERIVATIVE, "solve_kkt", turned_forces(DERIVATIVE)),
    "S1's eq. 3, rows 2-3, with its sign turned":
        ("maximal-motion", kinematics, "gamma_rows_2_3", negated(kinematics.gamma_rows_2_3)),
    "S1's eq. 3, row 1, as printed": ("maximal-motion", kinematics, "gamma_row_1", lost_dots),
    "inertia in the axes of the bodies":
        ("maximal-motion", kinematics, "world_inertia", lambda turn, inertia: inertia),
}  # fmt: skip


@pytest.mark.parametrize(("check", "place", "name", "wrong"), PLANTED.values(), ids=PLANTED)
def test_a_planted_error_fails_its_check(check, place, name, wrong, monkeypatch) -> None:
    """Without it, the same check passes; `QUICK` holds the others."""
    monkeypatch.setattr(place, name, wrong)
    assert found(check).failed
    monkeypatch.undo()
    if check not in QUICK.split(","):
        assert _passes(check)


@cache
def _passes(name: str) -> bool:
    return found(name).passed


def test_maximal_coordinates_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yourdfpy", None)
    with pytest.raises(MissingPackageError) as caught:
        parsed_robot("<robot/>")
    assert (caught.value.name, caught.value.extra) == ("yourdfpy", "formulations")
    [result] = run_checks(names=["maximal-motion"])
    assert result.kind == "not run" and "hexapod-pin[formulations]" in result.note


# Rows that missed their number say so in the exit status of what printed them.


def status_of(words: list[str]) -> int:
    with pytest.raises(SystemExit) as stop:
        cli.main(words)
    return int(stop.value.code or 0)


@pytest.mark.parametrize(
    ("error", "registered", "status", "word"),
    [
        (1e-5, None, MISSED, "FAIL"),
        (1e-5, 1e-5, 0, "expected failure: it is hard"),
        (1e-4, 1e-5, MISSED, "FAIL: expected to reach 1.0e-05"),
        (1e-10, 1e-5, MISSED, "unexpected pass: it is hard"),
    ],
)
def test_verify(error, registered, status, word, monkeypatch, capsys) -> None:
    check = Check("made-up", "one against two", lambda: error, 1e-9, source="a paper")
    key = ("made-up", "one against two", "a paper")
    entries = {} if registered is None else {key: ExpectedFailure(*key, "it is hard", registered)}
    monkeypatch.setattr(expected_failures, "expected_failures", lambda: entries)
    monkeypatch.setattr("hexapod_pin.validation.checks.registry.all_checks", lambda: [check])
    assert status_of(["verify"]) == status
    printed = capsys.readouterr()
    assert word in printed.out
    assert ("made-up, one against two" in printed.err) == bool(status)


def test_ctrl_c_prints_the_checks_that_are_done(monkeypatch, capsys) -> None:
    def stop() -> float:
        raise KeyboardInterrupt

    checks = [Check("first", "a against b", lambda: 0.0, 1.0), Check("next", "c", stop, 1.0)]
    monkeypatch.setattr("hexapod_pin.validation.checks.registry.all_checks", lambda: checks)
    assert status_of(["verify"]) == 130
    printed = capsys.readouterr()
    assert "a against b" in printed.out
    assert "interrupted; 1 of 2 cases are done" in printed.out + printed.err


def test_hard_suite(monkeypatch, capsys) -> None:
    for failed, status in ((0, 0), (2, MISSED)):
        part = hard_suite.SuitePart(Table("Made up", ("a",), (("FAIL",),)), "the summary", failed)
        parts = [("made up", lambda tick, part=part: part)]
        monkeypatch.setattr(hard_suite, "suite_parts", lambda quick, parts=parts: parts)
        assert status_of(["bench", "--hard", "--quick"]) == status
        assert ("Made up: the summary" in capsys.readouterr().err) == bool(failed)


def benchmark_row(error: float, estimate: float, **changes) -> BenchmarkRow:
    row = BenchmarkRow(
        engine="hexapod_pin", method="ndf, error kept", setting="accuracy 1e-04", value=1e-4,
        error=error, trunk=error, estimate=estimate, uncertainty=1e-9, wall=1.0, runs=1,
        evaluations=1.0, steps=1.0, rejected=0.0, note="",
    )  # fmt: skip
    return replace(row, **changes)


def test_rows_of_work_and_precision() -> None:
    for row, verdict in (
        (benchmark_row(1e-4, 1e-5), "pass"),
        (benchmark_row(3.2e-4, 1e-5, method="ndf"), "no promise"),
        (benchmark_row(3.2e-4, 1e-5), "FAIL: 3.2 times"),
        (benchmark_row(3.2e-4, 2e-4), "error reported: 3.2 times"),
        (benchmark_row(3.2e-4, 1e-5, uncertainty=2e-4), "not judged: reference known to 2e-04"),
        (benchmark_row(math.nan, 1e-5, note="refused: no bristles"), "not run: no bristles"),
    ):
        assert row.verdict == verdict and row.missed == verdict.startswith("FAIL")
        assert row_name(row).endswith(f"({verdict})")
        [cells] = run_table(SimpleNamespace(rows=[row])).rows  # type: ignore[arg-type]
        assert verdict in cells and not any("refused" in cell for cell in cells)


def test_rows_of_several_runs_and_entries_without_a_row(monkeypatch) -> None:
    good = StressOutcome("a", 1e-3, finite=True, gain=0.0, rise=0.0, injection=0.0, iterations=1.0)
    lost = StressOutcome("b", 1e-3, finite=False)
    rows = stress_table({1e-3: [good, good], 2e-3: [good, lost], 5e-4: [lost]}).rows
    assert [row[-1] for row in rows] == ["pass", "FAIL: 1 of 2 runs", "FAIL: 1 of 1 runs"]
    entry = ExpectedFailure("HC01", "no such number", "rk4, step 1 ms", "hard", 1e-3)
    entries = {(entry.case, entry.what, entry.method): entry}
    monkeypatch.setattr(expected_failures, "expected_failures", lambda: entries)
    [result] = hard_suite.entries_without_row([])
    assert result.failed and "no such row" in result.note
