"""Peaks computed again, planted causes, the rule of the verdict; reports of all studies."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, ParameterError, TraceFileError, UnknownNameError
from hexapod_pin.results.peak_judgement import judge_summaries
from hexapod_pin.results.peak_verdict import Recomputation
from hexapod_pin.study.runs.runner import Rows, Runner
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.study.tuning_result import Candidate, Scores
from hexapod_pin.view import write_study_report
from tests.browser import browse
from tests.runner_studies import GAIT, ROBUST, SHORT
from tests.runner_studies import scene as report_scene
from tests.sweep_studies import BASE

CYCLE = 1.0  # of walks [s]; three cycles: two to start, a steady one
QUICK = {"accuracy": 1e-2, "sample": 0.01}  # accuracy is not what these tests are about


@cache
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def walk(scene: hp.Scene, **settings) -> hp.Case:
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE))
    return hp.Case(scene, control, duration=3 * CYCLE, **(settings or QUICK))


def peaks(scene: hp.Scene, case: hp.Case, **settings) -> np.ndarray:
    trace = hp.simulate(scene, case.controller, duration=case.duration, **settings)
    return np.abs(trace.summary.torque_peak)


def test_every_verdict_is_that_of_peaks_computed_independently() -> None:
    """The scenes with doubled stiffness are written out here, and the rule too."""
    scene = hp.Scene(hp.load_robot("athena"))
    gait = hp.Gait.wave(5 / 6, stroke=0.02, lift=0.01, cycle_time=1.8)
    case = hp.Case(scene, hp.KinematicControl(gait), duration=5.4, **QUICK)
    found = hp.study.judge_peaks(case)
    contact, servo = scene.contact, scene.servos
    normal = hp.contact.Restitution(stiffness=2 * contact.normal.stiffness, restitution=0.3)
    friction = hp.contact.StickSlip(mu=0.7, stiffness=4e4, damping=60.0 * math.sqrt(2.0))
    stiff_feet = replace(scene, contact=hp.Contact(normal=normal, friction=friction))
    stiff_servos = replace(scene, servo=hp.Servo(kp=2 * servo.kp, kd=2 * servo.kd))
    # a tenth of the loosest accuracy that makes a difference to a run of ndf: 1e-5 / 0.3
    fine = {"accuracy": 1e-6 / 0.3, "sample": 0.01 / 3}
    run, finer = peaks(scene, case, **QUICK), peaks(scene, case, **fine)
    harder, tighter = peaks(stiff_feet, case, **fine), peaks(stiff_servos, case, **fine)
    floor = 0.01 * finer.max()
    for k, row in enumerate(found.joints):
        values = [each[k] for each in (run, finer, harder, tighter)]
        assert list(row.computed.values()) == pytest.approx(values, rel=1e-9)
        ends = row.torque_peak.low, row.torque_peak.high
        assert ends == pytest.approx((min(values), max(values)))
        size = max(finer[k], floor)
        shares = {
            "accuracy": abs(finer[k] - run[k]) / max(run[k], 0.01 * run.max()),
            "contact stiffness": abs(harder[k] - finer[k]) / size,
            "servo stiffness": abs(tighter[k] - finer[k]) / size,
        }
        moved = {key for key, share in shares.items() if share > 0.05}
        assert set(row.moved_by) == moved
        assert row.verdict == ("range" if moved else "peak")
        assert row.torque_peak.value == pytest.approx(finer[k], rel=1e-9)


def soft_feet(factor: float = 1.0) -> hp.Contact:
    """Soft feet without a tangential spring: with them and stiff servos, peaks hold."""
    contact = hp.Contact.s1()
    return hp.Contact(normal=contact.normal.stiffer(0.02 * factor), friction=contact.friction)


def stiff_servos(factor: float = 1.0, time: float = 0.02) -> hp.Servo:
    return hp.Servo(kp=2400.0 * factor, kd=2400.0 * factor * time, limited=False)


def calm_scene() -> hp.Scene:
    return hp.Scene(robot(), contact=soft_feet(), servo=stiff_servos())


def test_what_moves_a_peak_is_named() -> None:
    """By stiff feet (touch-downs dominate), coarse steps or soft servos, and by nothing else."""
    calm = hp.study.judge_peaks(walk(calm_scene(), accuracy=1e-3))
    assert [row.verdict for row in calm.kinds] == ["peak"] * 3
    hard = replace(calm_scene(), contact=soft_feet(100 / 0.02))
    row = hp.study.judge_peaks(walk(hard, accuracy=1e-3)).kind("tibia")
    assert row.verdict == "range" and "contact stiffness" in row.moved_by
    found = hp.study.judge_peaks(walk(calm_scene(), step=5e-3))
    assert "step 0.0005 instead of 0.005 s" in found.table()  # stiffness is varied at this step
    for row in found.kinds:
        assert (row.verdict, row.moved_by) == ("range", ("accuracy",))
    soft = replace(calm_scene(), servo=stiff_servos(0.1))
    row = hp.study.judge_peaks(walk(soft, accuracy=1e-3)).kind("femur")
    assert (row.verdict, row.moved_by) == ("range", ("servo stiffness",))


def test_a_trace_gives_the_verdict_of_its_case() -> None:
    case = walk(calm_scene())
    trace = case.run()
    done: list[float] = []
    found = hp.study.judge_peaks(trace, progress=done.append)
    assert done == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert found == hp.study.judge_peaks(case, threads=2)
    short = replace(case, duration=2.5)  # no whole cycle: how long it must be is said
    for run in (short, short.run()):
        with refused(ParameterError, "duration", 2.5, allowed=(3 * CYCLE,)):
            hp.study.judge_peaks(run)
    with refused(ParameterError, "Case.duration", None):
        hp.study.judge_peaks(replace(case, duration=None))


def test_runs_without_a_walk_or_with_a_start() -> None:
    case = hp.Case(calm_scene(), hp.HoldPosture(), duration=0.5, **QUICK)
    found = hp.study.judge_peaks(case)
    assert found.window.cycles is None and found.kind("femur").verdict == "peak"
    case = replace(case, initial=robot().stand(), duration=0.1)
    assert any("given state" in note for note in hp.study.judge_peaks(case).notes)
    scene = replace(calm_scene(), prescribed=True)
    found = hp.study.judge_peaks(walk(scene))
    assert "doubled servo stiffness: no servo: prescribed motion" in found.table()
    assert "servo stiffness" not in found.kind("femur").computed


def test_foot_control_keeps_its_gains_and_refuses_stiffer_servos() -> None:
    """A suspension that is stable on the servos it was given would shake on stiffer ones."""
    gait = hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE)
    suspension = hp.foot_control.VirtualSuspension(frequency=20.0 / 3.0)
    control = hp.FootControl(gait, suspension=suspension)
    case = hp.Case(hp.Scene(robot()), control, duration=3 * CYCLE, **QUICK)
    row = hp.study.judge_peaks(case).kind("femur")
    assert row.text.startswith("range unknown: doubled servo stiffness was refused")
    assert row.changes.keys() == {"accuracy", "contact stiffness"}


def test_divergence_is_a_verdict_but_not_of_the_run_itself(monkeypatch) -> None:
    real, lost = Runner.rows, {2}

    def losing(runner, cases, measure):
        rows = real(runner, cases, measure)
        return Rows([DivergenceError("far", None) if k in lost else r for k, r in enumerate(rows)])

    monkeypatch.setattr(Runner, "rows", losing)
    case = hp.Case(calm_scene(), hp.HoldPosture(), duration=0.2, **QUICK)
    row = hp.study.judge_peaks(case).kind("femur")
    assert row.text.startswith("range unknown: doubled contact stiffness diverged (")
    lost.add(0)
    with refused(DivergenceError, about=("far",)):
        hp.study.judge_peaks(case)


def test_an_accuracy_that_cannot_be_tightened_leaves_the_range_unknown() -> None:
    """`ndf` takes over from another method; below its own limit nothing does."""
    usual = {"method": "extrapolated-euler", "accuracy": 5e-8}
    case = hp.Case(calm_scene(), hp.HoldPosture(), duration=0.02, **usual)
    said = "accuracy 5e-09 instead of 5e-08 m and rad, ndf instead"
    assert said in hp.study.judge_peaks(case).table()
    tight = replace(case, method="ndf", accuracy=5e-12)
    row = hp.study.judge_peaks(tight).kind("femur")
    assert row.text.startswith("range unknown: ten times the accuracy is out of reach")
    assert row.changes.keys() == {"contact stiffness", "servo stiffness"}


NAMES = ("accuracy", "contact stiffness", "servo stiffness")
CHANGES = tuple(
    Recomputation(name, f"another {name}", "so and so", "accuracy" if k else "run")
    for k, name in enumerate(NAMES)
)
LIMIT = 6.0  # of kharagpur's joints [N m]


@cache
def walked() -> hp.Summary:
    gait = hp.Gait.tripod(stroke=0.02, cycle_time=0.4)
    case = hp.Case(hp.Scene(robot()), hp.KinematicControl(gait), duration=1.2)
    return hp.simulate_batch([case], accuracy=1e-2, keep="summary")[0]


def planted(*peaks: float, rest: float = 1.0, **others: object) -> hp.study.PeakVerdicts:
    """Judge: one joint has these peaks in run, accuracy, contact, servo; all others `rest`."""
    summaries = {}
    for name, peak in zip(("run", *NAMES), peaks, strict=False):
        torque = np.full(18, rest)
        torque[1] = -peak  # a peak is a size
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


def test_five_per_cent_is_the_border_for_each_change() -> None:
    for place, name in enumerate(NAMES, start=1):
        for share, verdict in ((-0.0499, "peak"), (-0.0501, "range"), (0.0501, "range")):
            after = 2.0 * (1.0 + share)
            peaks = [2.0, after, after, after] if place == 1 else [2.0] * 4
            peaks[place] = after
            row = planted(*peaks).joint("lf_femur_joint")
            assert row.verdict == verdict
            assert row.moved_by == (() if verdict == "peak" else (name,))
        assert f"another {name} +5.01 %" in row.text


def test_the_verdict_of_a_kind_is_that_of_its_largest_peak() -> None:
    """A small joint that moves leaves its kind alone; of the largest, the kind moves with it."""
    small = planted(0.5, 0.5, 0.8, 0.5)
    assert small.joint("lf_femur_joint").verdict == "range"
    assert small.kind("femur").verdict == "peak" and not small.hold
    large = planted(2.0, 2.0, 2.0, 3.0)
    assert large.kind("femur").moved_by == ("servo stiffness",)
    assert large.kind("femur").torque_peak.high == 3.0 and large.kind("coxa").verdict == "peak"


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
    assert planted(0.0, 0.0, 0.0, 0.0, rest=0.0).hold


def test_a_peak_at_the_torque_limit_is_never_confirmed() -> None:
    """Whichever computation reaches it: what it would have been is cut off."""
    for place in (0, 2):
        peaks = [0.99 * LIMIT] * 4
        peaks[place] = LIMIT
        row = planted(*peaks).joint("lf_femur_joint")
        assert (row.verdict, row.holds) == ("at the limit", False)
        assert row.text.startswith("at the limit, 5.94 to 6 N m")
    row = planted(7.0, 7.0, 7.0, 7.0, limited=False).joint("lf_femur_joint")
    assert (row.verdict, row.text) == ("peak", "peak 7 N m; beyond the limit of 6 N m")


def test_a_failed_computation_is_never_a_pass() -> None:
    found = planted(2.0, 2.0)
    assert {row.verdict for row in (*found.joints, *found.kinds)} == {"range unknown"}
    text = found.joint("lf_femur_joint").text
    assert "another contact stiffness diverged; another servo stiffness diverged" in text
    given = ["accuracy", "run"]  # one that is missing needs a reason
    with refused(ParameterError, "summaries", given, about=("'contact stiffness'",)):
        judge_summaries({"run": walked(), "accuracy": walked()}, CHANGES)


def test_spreads_hold_all_computations_and_every_foot() -> None:
    """Values are those of ten times the accuracy; least and largest are of all four."""
    base, numbers = walked(), ("torque_p99", "torque_rms", "normal_impulse")
    summaries = {
        name: replace(base, **{number: factor * getattr(base, number) for number in numbers})
        for name, factor in zip(("run", *NAMES), (1.0, 1.01, 1.2, 0.9), strict=True)
    }
    found = judge_summaries(summaries, CHANGES)
    assert found.to_dict() == json.loads(found.to_json())
    pairs = [(found.feet[k].impulse, base.normal_impulse[k]) for k in range(6)]
    pairs += [(found.joints[3].torque_p99, base.torque_p99[3])]
    pairs += [(found.joints[4].torque_rms, base.torque_rms[4])]
    for spread, number in pairs:
        expected = (1.01 * number, 0.9 * number, 1.2 * number)
        assert (spread.value, spread.low, spread.high) == pytest.approx(expected)
        assert spread.share == pytest.approx(0.3 / 1.01)
    with refused(UnknownNameError, kind="joint", name="elbow"):
        found.joint("elbow")


pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> hp.study.SweepResult:
    """Four cases, the third without numbers."""
    study = BASE + '\n[[vary]]\ninput = "stroke"\nvalues = [0.04, 0.05, 0.5, 0.03]\n'
    return hp.run_sweep(SweepStudy.from_toml(study), tmp_path_factory.mktemp("sweep") / "a.db")


def tuned() -> hp.study.TuningResult:
    """Return three candidates, of which one failed; better on the scene that was held out."""
    tried = (
        Candidate({"kp": 40.0}, 0.9, "", 0), Candidate({"kp": 99.0}, 1e3, "it fell", 1),
        Candidate({"kp": 55.0}, 0.5, "", 1),
    )  # fmt: skip
    on, held = (
        Scores(1.0, 0.9, best, {name: (1.0, 0.9, best)}, {})
        for name, best in (("flat", 0.5), ("hill", 0.75))
    )
    numbers = {"kp": 40.0}, {"kp": 55.0}, {"kp": (10.0, 100.0)}
    words = {"robot": "six legs", "walk": "tripod, stroke 0.1 m, cycle 1 s"}
    return hp.study.TuningResult(*numbers, ("kp",), on, held, tried, 1e3, 3, **words)


def found(kind: str) -> Any:
    """Return a result of a kind, of short runs."""
    if kind == "comparison":
        fast = hp.KinematicControl(GAIT.model_copy(update={"stroke": 0.05}))
        walks = {"<i>a</i>": hp.KinematicControl(GAIT), "b": fast}
        return hp.compare(report_scene(), walks, **{**ROBUST, "duration": 0.9})
    if kind == "map":
        points = {"strokes": [0.03, 0.05], "cycle_times": [0.02, 0.4]}
        how = {"gait": GAIT, "accuracy": 1e-2, "check": 0}
        return hp.torque_map(report_scene(), "straight", **points, **how)
    if kind == "peaks":
        return hp.study.judge_peaks(hp.Case(report_scene(), hp.KinematicControl(GAIT), **SHORT))
    return tuned()


@pytest.mark.parametrize(
    ("kind", "figures", "texts"),
    [
        ("comparison", 1, ["2 OF 2 RUNS WALKED", "kharagpur", "kp 240 N m/rad", "0.9 s"]),
        ("sweep", 1, ["3 OF 4 CASES HAVE NUMBERS", "stroke", "GaitError",
                      "tripod, stroke 0.04 m"]),
        ("map", 2, ["2 OF 4 POINTS WERE WALKED", "rad/s", "femur torque peak [N m]",
                    "0.01 m or rad"]),
        ("peaks", 1, ["PEAKS HOLD", "kharagpur", "kp 480 N m/rad"]),
        ("tuned", 1, ["25.0 % BETTER ON SCENES THAT IT WAS NOT TUNED ON", "flat", "hill", "it fell",
                      "3 candidates, 1 failed", "logarithmic", "six legs", "cycle 1 s", "50.0 %"]),
    ],
)  # fmt: skip
def test_a_report_has_header_figures_and_tables(
    tmp_path: Path, kind: str, figures: int, texts: list[str], sweep: hp.study.SweepResult
) -> None:
    result = sweep if kind == "sweep" else found(kind)
    marks = {"date": "2020-02-02", "command": "hexapod-pin compare 'a b.toml' c.toml"}
    path = write_study_report(result, tmp_path / "a.html", **marks)
    page = path.read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml") == figures and "<table" in page
    for text in (*texts, "2020-02-02", f"hexapod-pin {hp.__version__}"):
        assert text in page, text
    assert "hexapod-pin compare &#x27;a b.toml&#x27; c.toml" in page
    assert "<i>" not in page  # texts are escaped
    assert not re.search(r"@import|url\(|https?://(?!www\.w3\.org)", page)
    again = write_study_report(result, tmp_path / "b.html", **marks)
    assert again.read_bytes() == path.read_bytes()
    with refused(TraceFileError, about=(".html",)):
        write_study_report(result, tmp_path / "a.pdf")


def test_a_click_on_a_title_sorts_by_number_and_then_the_other_way(
    tmp_path: Path, sweep: hp.study.SweepResult
) -> None:
    """What has no number is last either way."""
    page = write_study_report(sweep, tmp_path / "a.html").read_text(encoding="utf-8")
    script = """<script>
    const one = [...document.querySelectorAll("th")].find((th) => th.textContent === NAME);
    const seen = [1, 2].map(() => {
      one.click();
      const rows = [...one.closest("table").querySelectorAll("tr > td:first-child")];
      return [one.getAttribute("aria-sort"), ...rows.map((cell) => cell.textContent)].join(" ");
    });
    document.body.append(`SEEN ${seen.join("; ")} END`);
    </script></body>""".replace("NAME", "'femur peak [N m]'")
    clicked = tmp_path / "clicked.html"
    clicked.write_text(page.replace("</body>", script), "utf-8")
    shown = browse(clicked, "--dump-dom").decode()
    peak = sweep.dataset["kind_torque_peak"].sel(kind="femur").values
    order = sorted((0, 1, 3), key=lambda k: round(float(peak[k]), 3))
    up, down = (" ".join(map(str, [*one, 2])) for one in (order, order[::-1]))
    assert f"SEEN ascending {up}; descending {down} END" in shown
