"""Tables whose rows missed their number say so in the exit status of what printed them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from studies.study import StudyReport, run_study

from hexapod_pin.benchmark import hard_suite
from hexapod_pin.benchmark.report import row_name, run_table
from hexapod_pin.benchmark.work_precision.measure import BenchmarkRow
from hexapod_pin.commands import app as cli
from hexapod_pin.commands.terminal import MISSED
from hexapod_pin.text_table import Table
from hexapod_pin.validation import case_result as expected_failures
from hexapod_pin.validation.case_result import ExpectedFailure
from hexapod_pin.validation.hard_case import Check
from hexapod_pin.validation.stress import StressOutcome, stress_table


def status_of(words: list[str]) -> int:
    """Run the command line; return its exit status."""
    with pytest.raises(SystemExit) as stop:
        cli.main(words)
    return int(stop.value.code or 0)


@pytest.mark.parametrize(
    ("error", "registered", "status", "word"),
    [
        (1e-10, None, 0, "1 pass, 0 FAIL"),
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


def test_hard_suite(monkeypatch, capsys) -> None:
    for failed, status in ((0, 0), (2, MISSED)):
        part = hard_suite.SuitePart(Table("Made up", ("a",), (("FAIL",),)), "the summary", failed)
        parts = [("made up", lambda tick, part=part: part)]
        monkeypatch.setattr(hard_suite, "suite_parts", lambda quick, parts=parts: parts)
        assert status_of(["bench", "--hard", "--quick"]) == status
        assert ("Made up: the summary" in capsys.readouterr().err) == bool(failed)


def benchmark_row(error: float, estimate: float, **changes) -> BenchmarkRow:
    """Return a row of ours that asked for 1e-4 over the whole run."""
    row = BenchmarkRow(
        engine="hexapod_pin", method="ndf, error kept", setting="accuracy 1e-04", value=1e-4,
        error=error, trunk=error, estimate=estimate, uncertainty=1e-9, wall=1.0, runs=1,
        evaluations=1.0, steps=1.0, rejected=0.0, note="",
    )  # fmt: skip
    return replace(row, **changes)


@pytest.mark.parametrize(
    ("row", "verdict"),
    [
        (benchmark_row(1e-4, 1e-5), "pass"),
        (benchmark_row(3.2e-4, 1e-5, method="ndf"), "no promise"),
        (benchmark_row(3.2e-4, 1e-5), "FAIL: 3.2 times"),
        (benchmark_row(3.2e-4, 2e-4), "error reported: 3.2 times"),
        (benchmark_row(3.2e-4, 1e-5, uncertainty=2e-4), "not judged: reference known to 2e-04"),
        (benchmark_row(math.nan, 1e-5), "FAIL: did not end"),
        (benchmark_row(math.nan, 1e-5, note="refused: no bristles"), "not run: no bristles"),
        (benchmark_row(3.2e-4, 1e-5, engine="MuJoCo"), "no promise"),
    ],
)
def test_rows_of_work_and_precision(row: BenchmarkRow, verdict: str) -> None:
    assert row.verdict == verdict
    assert row.missed == verdict.startswith("FAIL")
    assert row_name(row).endswith(f"({verdict})")
    [cells] = run_table(SimpleNamespace(rows=[row])).rows  # type: ignore[arg-type]
    assert verdict in cells and not any("refused" in cell for cell in cells)


def test_bench(monkeypatch, capsys) -> None:
    """One row of a measured scene misses: the table is printed, its name is on stderr."""
    from hexapod_pin.benchmark.work_precision.comparison import Comparison
    from hexapod_pin.benchmark.work_precision.scenes import built_in

    found = Comparison(built_in("hc40-soft"), (), (benchmark_row(3.2e-4, 1e-5),))
    module = "hexapod_pin.benchmark.work_precision.comparison"
    monkeypatch.setattr(f"{module}.compare", lambda *args: found)
    assert status_of(["bench", "hc40-soft"]) == MISSED
    printed = capsys.readouterr()
    assert "FAIL: 3.2 times" in printed.out
    assert "ndf, error kept, accuracy 1e-04 (FAIL" in printed.err


@pytest.mark.parametrize(
    ("cell", "status"), [("expected failure: hard", 0), ("1.2 FAIL", 1), ("unexpected pass: x", 1)]
)
def test_a_row_of_a_study(cell: str, status: int, tmp_path: Path, capsys) -> None:
    """No study can print FAIL and succeed."""

    def sample() -> StudyReport:
        """A study."""
        return StudyReport("Sample", ["text", Table("Numbers", ("n", "result"), [("1", cell)])])

    assert run_study(sample, ["--out", str(tmp_path)]) == status
    capsys.readouterr()


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
