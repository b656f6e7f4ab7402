"""Speed against error: measure, rounds, levels, reports, the command, and advice."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from conftest import Run
from refusals import NUMBER, refused

import hexapod_pin as hp
from hexapod_pin.benchmark.advice import SAFETY_FACTOR, NoAdviceError, advise, advise_on
from hexapod_pin.benchmark.report import BenchmarkReport, csv_text, json_text, level_table, markdown
from hexapod_pin.benchmark.work_precision import comparison
from hexapod_pin.benchmark.work_precision.comparison import ComparisonSettings, compare
from hexapod_pin.benchmark.work_precision.measure import (
    OURS,
    BenchmarkRow,
    ReferenceSolution,
    RunOutcome,
    cheapest,
    measure,
    ratios,
    sweeps,
)
from hexapod_pin.benchmark.work_precision.own_entry import (
    NoReferenceError,
    find_reference,
    known_answer,
    run_task,
)
from hexapod_pin.benchmark.work_precision.scenes import built_in
from hexapod_pin.errors import ParameterError, SimulationInterrupted, UnknownNameError
from hexapod_pin.validation.machine import Machine
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting

STILL = np.array([[0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.3, -0.2]] * 3)


def row(value: float, error: float, wall: float, **rest) -> BenchmarkRow:
    numbers = {"uncertainty": 1e-12, "evaluations": None, "method": "a", "engine": OURS, "note": ""}
    numbers |= {"estimate": math.nan, "runs": 1, "steps": None, "rejected": None, **rest}
    return BenchmarkRow(
        setting=f"{value:g}", value=value, error=error, trunk=error, wall=wall, **numbers
    )


def test_distance_is_the_largest_of_place_turn_and_joints():
    """The turn is that of the relative rotation, and knows both signs."""
    moved = STILL.copy()
    moved[1, :3] += (3e-3, 4e-3, 0.0)
    found = PositionError.between(moved, STILL)
    assert (found.q, found.trunk) == pytest.approx((4e-3, 5e-3), rel=1e-12)
    a, b = pin.rpy.rpyToMatrix(0.3, -1.1, 2.0), pin.rpy.rpyToMatrix(-0.2, 0.4, 1.0)
    first, second = STILL.copy(), STILL.copy()
    first[2, 3:7], second[2, 3:7] = pin.Quaternion(a).coeffs(), -pin.Quaternion(b).coeffs()
    wanted = np.linalg.norm(pin.log3(b.T @ a))
    assert PositionError.between(first, second).q == pytest.approx(wanted, rel=1e-12)


def test_a_level_counts_only_if_every_tighter_setting_meets_it():
    """Refused settings are no part of a sweep; a ratio is our time over the best other one."""
    own = [row(1e-2, 5e-5, 1.0), row(1e-3, 2e-4, 2.0), row(1e-4, 3e-5, 4.0), row(1e-5, 9e-6, 3.0)]
    assert cheapest(own, 1e-4).value == 1e-5  # 1e-2 met it by chance; 1e-5 is cheaper than 1e-4
    assert cheapest(own, 1e-3).value == 1e-2
    assert cheapest(own, 1e-6) is None
    broken = [*own[:2], row(1e-4, math.nan, 0.1), own[3]]
    assert cheapest(broken, 1e-3).value == 1e-5  # a diverged run meets nothing
    rows = [
        row(1e-3, 5e-4, 0.004), row(1e-4, 8e-5, 0.02, method="b"),
        row(1e-3, 7e-4, 0.020, engine="X", method="slow"),
        row(1e-3, 6e-4, 0.016, engine="X", method="fast"),
    ]  # fmt: skip
    first, second = ratios(rows)
    assert first.endswith("X 16 ms (fast, 0.001); ours 4 ms (a, 0.001), ratio 0.250")
    assert "no method of X reached it" in second
    rows = [row(1e-3, 1e-4, 1.0), row(1e-2, math.nan, math.nan, note="refused: no")]
    assert [one.value for one in sweeps(rows)[OURS, "a"]] == [1e-3]


def outcome(x: float, wall: float = 0.0) -> RunOutcome:
    q = STILL + np.eye(9)[0] * x
    return RunOutcome(q[:, :3], q, wall=wall, evaluations=50, steps=20, rejected=4)


@dataclass
class Fake:
    """An entry that takes a given time and counts its runs; Ctrl-C comes at one of them."""

    method: str
    wall: float
    log: list[str] = field(default_factory=list)
    stop_at: int = 10**9
    engine: str = OURS
    setting: str = "s"
    value: float = 1.0
    reference = ReferenceSolution(outcome(0.0), "t", PositionError(0, 0), "c")

    def run(self) -> RunOutcome:
        self.log.append(self.method)
        if len(self.log) >= self.stop_at:
            raise SimulationInterrupted("interrupted", None)
        return outcome(1e-3, self.wall + 1e-3 * self.log.count(self.method))


def test_rounds_are_interleaved_and_slow_runs_are_timed_once():
    log: list[str] = []
    fraction: list[float] = []
    found = measure([Fake("a", 0.01, log), Fake("b", 5.0, log)], 0.5, 3, fraction.append)
    assert "".join(log) == "abaaa" and fraction[-1] == 1.0 and not found.interrupted
    quick, slow = found.rows
    assert (quick.runs, slow.runs) == (3, 1)
    assert quick.wall == pytest.approx((0.01 + 3e-3) / 0.5)  # median of runs 2, 3, 4
    assert (quick.evaluations, quick.steps, quick.rejected) == (100.0, 40.0, 8.0)
    assert quick.error == pytest.approx(1e-3, rel=1e-12)
    early = measure([Fake("a", 0.0), Fake("b", 0.0, stop_at=1)], 1.0, 1)
    assert [one.method for one in early.rows] == ["a"] and early.interrupted


def test_reference_of_hc40_soft_is_the_published_end_state():
    """1e-7 is a tenth of what the hard case asks for; its own digits are good to 4e-13."""
    task = built_in("hc40-soft")
    reference = find_reference(task)
    assert known_answer(task, reference) < 1e-7 > reference.uncertainty.q
    assert known_answer(built_in("stand"), reference) is None


def test_what_cannot_be_measured_is_refused():
    with refused(NoReferenceError, about=("stand", "dop853", "ndf", "0")):
        find_reference(replace(built_in("stand"), duration=0.01), max_wall=0.0)
    with refused(UnknownNameError, kind="method", name="magic", about=("extrapolated-euler",)):
        compare(built_in("walk"), ComparisonSettings(["magic"]))
    for accuracy, piece in ((0.5, 0.1), (1e-3, 0.005)):
        with pytest.raises(ParameterError):
            advise(built_in("stand").scene, hp.HoldPosture(), accuracy, piece=piece)


def test_implicit_euler_on_hc40_is_first_order_and_costs_what_it_says():
    """Halving the step halves the error, within 25 %; evaluations are steps and one more."""
    task = built_in("hc40-soft")
    found = compare(task, ComparisonSettings(["implicit-euler"], rounds=1, quick=True))
    errors = [one.error for one in found.rows]
    assert errors[0] == pytest.approx(2.77e-3, rel=0.02)  # known: 2.6e-3 to 2.8e-3 at 1 ms
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.25)
    assert [one.steps for one in found.rows] == [1e3, 2e3, 4e3, 1e4]
    assert all(one.evaluations == one.steps + 4.0 for one in found.rows)
    assert level_table(found, "error").rows[0][2] == "not reached: 4e-04"


def test_a_run_that_diverges_is_a_row_that_says_so():
    found = run_task(built_in("hc40-soft"), SolverSetting("rk4", 5e-3))
    assert not found.ended and found.note.startswith("diverged after 0")
    assert math.isnan(found.distance(found).q)


def test_csv_and_json_hold_the_same_rows():
    task = replace(built_in("walk"), duration=0.05)
    found = compare(task, ComparisonSettings(["implicit-euler", "rk4"], rounds=1, quick=True))
    report = BenchmarkReport(Machine.here(), "hexapod-pin bench walk", [found])
    for text in (markdown(report), csv_text(report), json_text(report)):
        for part in (report.machine.packages["mujoco"], report.machine.cpu, report.machine.date):
            assert part in text
    table = csv.DictReader(x for x in csv_text(report).splitlines() if not x.startswith("#"))
    rows = json.loads(json_text(report))["scenes"][0]["rows"]
    assert [flat["error"] for flat in table] == [
        "" if full["error"] is None else repr(full["error"]) for full in rows
    ]


SHORT = ("--duration", "0.02", "--rounds", "1", "--quick", "--methods", "implicit-euler")


def test_command_prints_tables_and_writes_report_and_figure(run: Run):
    done = run("bench", "walk", "stand", *SHORT, "--out", "r.md", "--plot", "f.svg")
    assert (done.status, done.err, done.left) == (0, "", ["f.svg", "r.md"])
    page = Path("r.md").read_text()
    for text in (done.out, page):
        assert text.count("reference: ") == 2 and "step 0.25 ms" in text and "evaluations" in text
    assert page.count("| implicit-euler | step 1 ms | ") == 2
    assert "`hexapod-pin bench walk stand --duration 0.02 --methods implicit-euler" in page
    assert Path("f.svg").read_text().count("<svg") == 1


def test_command_refuses_before_it_measures(run):
    for words, says in (
        (("--out", "r.txt"), ".md, .csv, .json"), (("--methods", "rk4,magic"), "'magic'"),
        (("--rounds", "1001"), "--rounds"),
    ):  # fmt: skip
        done = run("bench", "walk", *words)
        assert (done.status, done.out, done.left) == (2, "", []) and says in done.err


def test_ctrl_c_writes_what_is_done_and_ends_with_130(run, monkeypatch: pytest.MonkeyPatch):
    real = comparison.compare

    def interrupted(task, *rest):
        if task.name == "stand":
            raise KeyboardInterrupt
        return real(task, *rest)

    monkeypatch.setattr(comparison, "compare", interrupted)
    done = run("bench", "walk", "stand", *SHORT, "--out", "r.json")
    assert (done.status, done.left) == (130, ["r.json"]) and "interrupted" in done.err
    assert [one["name"] for one in json.loads(Path("r.json").read_text())["scenes"]] == ["walk"]


WALK = replace(built_in("walk"), duration=0.06)


def test_advised_run_keeps_the_error_it_predicts():
    """The cheapest of what was good enough."""
    advice, task = advise_on(WALK, 1e-3), WALK
    trace = hp.simulate(
        task.scene, task.controller, duration=task.duration, sample=task.sample,
        initial=task.initial, **advice.settings,
    )  # fmt: skip
    error = PositionError.between(trace.q, advice.reference.outcome.q).q
    assert error == advice.predicted_error  # the same run, bit for bit
    assert error * SAFETY_FACTOR <= 1e-3
    per_second = trace.counters["evaluations"] / task.duration
    assert advice.evaluations == pytest.approx(per_second, rel=1e-12)
    tried = sweeps(advice.tried)
    good = [cheapest(own, 1e-3 / SAFETY_FACTOR) for own in tried.values()]
    times = {row.method: row.wall * 1e3 for row in good if row is not None}
    assert times[advice.method] == advice.milliseconds == min(times.values())
    assert len(tried) > 1 and advice.method in advice.table()
    assert str(advice).startswith(f'for an error of 0.001: method="{advice.method}", ')


def test_what_nothing_reaches_is_refused_with_what_came_nearest(monkeypatch):
    monkeypatch.setattr("hexapod_pin.benchmark.advice.method_names", lambda: ("implicit-euler",))
    wanted = 1e-8 / SAFETY_FACTOR
    with refused(NoAdviceError, about=(f"{wanted:.1e}", "0.06")) as caught:
        advise_on(WALK, 1e-8)
    assert float(NUMBER.findall(str(caught.value))[2]) > wanted  # what came nearest
