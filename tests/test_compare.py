"""Controllers on the same scenes, its figure, its command, its grounds; and `hp.tune`."""

from __future__ import annotations

import json
import math
import signal
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from conftest import Run
from matplotlib.container import ErrorbarContainer
from page_data import PageData
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, ParameterError, StudyInterrupted, UnknownNameError
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.results.walk_metrics import METRICS, Outcome
from hexapod_pin.study import random_bumps
from hexapod_pin.view import write_comparison_figure
from hexapod_pin.view.study_figures import draw_comparison

DURATION = 1.6  # two cycles to start, one steady one
ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
GAIT = hp.Gait.tripod(stroke=0.05, cycle_time=0.5)
PLAIN = hp.KinematicControl(GAIT)
FAST = hp.KinematicControl(GAIT.model_copy(update={"stroke": 0.06}))
BUMPS = random_bumps(SCENE, range(3), amplitude=0.005, wavelength=0.3, length=0.4)


@pytest.fixture(scope="module")
def found() -> hp.study.Comparison:
    return hp.compare(
        {"flat": SCENE, "bumps": BUMPS},
        {"plain": PLAIN, "fast": FAST, "far": hp.HoldPosture([9.0] * 18)},
        duration=DURATION, threads=2,
    )  # fmt: skip


def test_numbers_are_those_of_single_runs(found: hp.study.Comparison) -> None:
    assert found.scenes == ("flat", "bumps") and found.controllers == ("plain", "fast", "far")
    for number, scene in enumerate(BUMPS):
        alone = hp.simulate(scene, FAST, duration=DURATION).summary
        run = found.of("bumps", "fast")[number]
        assert run.metrics == hp.study.WalkMetrics.of(alone) and run.summary.data == alone.data
    speed = np.mean([run.metrics.measured_speed for run in found.of("bumps", "fast")])
    assert found.mean("bumps", "fast", "measured_speed").value == pytest.approx(speed, rel=1e-12)
    change = found.change("flat", "fast", "measured_speed")
    assert change.value == pytest.approx(0.2, abs=0.01)  # stroke 0.06 against 0.05 m
    assert change.half_width is None and change.count == 1
    assert found.change("bumps", "fast", "measured_speed").differs_from(0.0)


def test_a_run_that_is_refused_or_too_short_is_a_row(found: hp.study.Comparison) -> None:
    assert [run.outcome for run in found.of("bumps", "far")] == [Outcome.REFUSED] * 3
    assert found.mean("bumps", "far", "measured_speed") is None
    text = found.table()
    assert "0 of 3: refused" in text and "far on bumps #2: refused (" in text
    assert "nan" not in text.lower() and "kharagpur, 1.6 s, ndf" in text
    short = hp.compare(SCENE, {"plain": PLAIN}, duration=1.0)  # a bare scene will do
    [run] = short.runs
    assert run.outcome is Outcome.TOO_SHORT and "1.5 s" in run.reason


def test_nothing_to_compare_is_refused() -> None:
    for scenes, controllers, name, value in (
        ({"a": []}, {"plain": PLAIN}, "scenes", {"a": []}),
        ({"a": [3]}, {"plain": PLAIN}, "compare.scenes[a][0]", 3),
        (SCENE, {}, "controllers", {}),
    ):
        with refused(ParameterError, name, value):
            hp.compare(scenes, controllers, duration=DURATION)


def test_ctrl_c_keeps_what_was_done() -> None:
    with pytest.raises(StudyInterrupted) as caught:
        hp.compare(
            {"bumps": BUMPS}, {"plain": PLAIN, "fast": FAST}, duration=DURATION, threads=1,
            progress=lambda _: signal.raise_signal(signal.SIGINT),
        )  # fmt: skip
    partial = caught.value.result
    assert not partial.finished and len(partial.runs) == 6
    outcomes = [run.outcome for run in partial.runs]
    assert outcomes.count(Outcome.WALKED) == 1 and outcomes.count(Outcome.NOT_RUN) == 5


def test_bars_are_changes_with_their_intervals(found: hp.study.Comparison, tmp_path: Path) -> None:
    shown = ["measured_speed", "torque_peak"]
    figure = draw_comparison(found, metrics=shown)
    panels = figure.axes
    assert [axes.get_title().split(" (")[0] for axes in panels] == ["flat", "bumps"]
    for axes, scene in zip(panels, found.scenes, strict=True):
        widths = [bar.get_width() for bar in axes.patches]
        expected = [100.0 * found.change(scene, "fast", metric).value for metric in shown]
        assert widths == pytest.approx(expected)
        intervals = [c for c in axes.containers if isinstance(c, ErrorbarContainer)]
        assert len(intervals) == (scene == "bumps")  # one run has none
    names = [text.get_text() for text in panels[0].get_yticklabels()]
    assert names == [METRICS[name].meaning for name in shown]
    assert b"<svg" in write_comparison_figure(found, tmp_path / "bars.svg").read_bytes()
    with refused(UnknownNameError, kind="metric", name="beauty"):
        write_comparison_figure(found, tmp_path / "none.svg", metrics=["beauty"])
    alone = hp.study.Comparison(found.of("flat", "plain"))
    with refused(ParameterError, "comparison", ("plain",)):
        write_comparison_figure(alone, tmp_path / "none.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["bars.svg"]


@pytest.fixture
def compare(run: Run) -> Run:
    hp.Case(SCENE, PLAIN, duration=DURATION).save("plain.toml")
    slippery = hp.Scene(ROBOT, contact=hp.Contact.accurate().with_mu(0.1))
    hp.Case(slippery, FAST, duration=1.7).save("fast.toml")
    return partial(run, "compare")


def test_the_command_prints_and_leaves_files(compare: Run, found: hp.study.Comparison) -> None:
    files = ("--html", "runs.html", "--figure", "bars.svg", "--json", "numbers.json")
    done = compare("plain.toml", "fast.toml", *files)
    assert done.status == 0, done.err
    lines = done.out.splitlines()
    assert lines[0].startswith("fast against plain: torque RMS ") and max(map(len, lines[:6])) <= 80
    rows = [line.split()[:4] for line in lines[3:5]]
    assert rows == [["scene", "of", "plain", "plain"], ["scene", "of", "plain", "fast"]]
    numbers = json.loads(Path("numbers.json").read_text())
    by_name = {entry["controller"]: entry["metrics"] for entry in numbers["runs"]}
    for name in ("plain", "fast"):  # on the first one's scene, in its settings
        assert by_name[name] == found.of("flat", name)[0].metrics.to_dict()
    page = PageData(Path("runs.html").read_text())
    assert [run["name"] for run in page.runs] == ["plain", "fast"]
    assert "<svg" in Path("bars.svg").read_text()


def test_own_scenes_and_bumps(compare: Run) -> None:
    own = compare("plain.toml", "fast.toml", "--own-scenes", "--markdown")
    assert own.status == 0 and "1.6 s" in own.out and "1.7 s" in own.out
    options = ("--bumps", "0.005", "--wavelength", "0.3", "--seeds", "2", "--length", "0.4")
    files = ("--json", "numbers.json", "--html", "bumps.html")
    bumps = compare("plain.toml", "fast.toml", *options, *files, "--full")
    assert bumps.status == 0 and "bumps of 0.005 m, 0.3 m apart (2 variants)" in bumps.out
    assert "change against plain" in bumps.out
    runs = json.loads(Path("numbers.json").read_text())["runs"]
    expected = hp.simulate(BUMPS[1], PLAIN, duration=DURATION).summary
    assert runs[2]["metrics"] == hp.study.WalkMetrics.of(expected).to_dict()
    for run in PageData(Path("bumps.html").read_text()).runs:  # of each controller on two grounds
        assert run["spread"]["differ"] == "they differ in terrain heights"


def test_the_command_goes_on_with_a_store(compare: Run) -> None:
    options = ("plain.toml", "fast.toml", "--store", "rows.db", "--json", "numbers.json")
    first = compare(*options)
    assert first.status == 0, first.err
    again = compare(*options)
    assert again.status == 2 and "--resume" in again.err
    resumed = compare(*options, "--resume", "--threads", "1")
    assert (resumed.status, resumed.out) == (0, first.out)


def test_refusals_are_one_message(compare: Run) -> None:
    for options, culprit in (
        (("none.toml",), "none.toml"),
        (("plain.toml", "plain.toml"), "two of 'plain'"),
        (("plain.toml", "--seeds", "3"), "--seeds"),
        (("plain.toml", "--bumps", "0.01", "--seeds", "0"), "from 1 to 1000"),
        (("plain.toml", "--bumps", "0.01", "--length", "1e308"), "--length = 1e+308"),
        (("plain.toml", "--bumps", "0.01", "--own-scenes"), "--bumps"),
        (("plain.toml", "--figure", "bars.svg"), "--figure"),
        (("plain.toml", "--html", "same", "--json", "same"), ".html"),
    ):
        done = compare(*options)
        assert done.status == 2 and culprit in done.err and done.err.count("\n") == 1


LIFT, GROUND_LENGTH = 0.03, 3.0
GROUNDS = hp.terrain.study_grounds(LIFT, seed=3, length=GROUND_LENGTH)


def test_all_are_level_where_the_robot_starts_and_kept_in_toml() -> None:
    """Up to 0.5 m all round: height 0, normal up, factors 1; heights of the core, too."""
    assert list(GROUNDS) == ["flat", "slope", "bumps", "step", "slippery", "soft", "soil"]
    angle, radius = np.meshgrid(np.linspace(0.0, 2 * np.pi, 73), np.linspace(0.0, 0.4999, 40))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    low = np.stack([0.8 * x, 0.8 * y, 0 * x + 0.02], -1).reshape(-1, 3)
    for name, (ground, contact) in GROUNDS.items():
        assert (contact is not None) == (name == "soil")
        assert np.abs(ground.height_at(x, y)).max() < 1e-15
        assert np.abs(ground.normal_at(x, y) - (0.0, 0.0, 1.0)).max() < 1e-14
        assert ground.clearance(low) == pytest.approx(0.02, rel=1e-12)
        if isinstance(ground, hp.terrain.PatchedGround):
            assert (ground.factors_at(x, y) == 1.0).all()
        assert read_terrain(ground.model_dump(mode="json")) == ground
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=GROUNDS["bumps"][0])
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.5)  # the trunk does not move
    assert np.abs(trace.q[-1, :3] - trace.q[0, :3]).max() < 5e-3
    with refused(ParameterError, "lift", 0.0):
        hp.terrain.study_grounds(0.0, length=GROUND_LENGTH, seed=1)


def test_bumps_reach_half_the_lift_along_the_whole_path() -> None:
    bumps = GROUNDS["bumps"][0]
    x, y = np.meshgrid(np.arange(-1.0, GROUND_LENGTH + 1.0, 0.01), np.arange(-1.0, 1.0, 0.01))
    z = bumps.height_at(x, y)
    assert np.abs(bumps.z).max() == pytest.approx(0.5 * LIFT, rel=1e-12)
    assert np.abs(z).max() == pytest.approx(0.5 * LIFT, rel=0.05)  # splines between the points
    for begin in np.arange(1.0, GROUND_LENGTH, 0.5):
        assert np.ptp(z[(x >= begin) & (x < begin + 0.5)]) > 0.4 * LIFT
    cut = bumps.height_at(np.arange(1.0, GROUND_LENGTH, 0.01), 0.3)
    crossings = np.count_nonzero(np.diff(np.sign(cut)))
    assert 1.5 < 2.0 * (GROUND_LENGTH - 1.0) / crossings / 0.3 * 2.0 < 6.0  # waves of about 0.3 m
    assert hp.terrain.study_grounds(LIFT, seed=4, length=GROUND_LENGTH)["bumps"][0] != bumps


def test_slope_step_and_patches_have_their_sizes() -> None:
    """Values by hand; to the right is -y."""
    slope, step = GROUNDS["slope"][0], GROUNDS["step"][0]
    assert slope.height_at(1.5, 0.4) == pytest.approx(math.tan(math.radians(15.0)))
    assert slope.normal_at(1.5, 0.0) == pytest.approx(
        [-math.sin(math.pi / 12), 0.0, math.cos(math.pi / 12)]
    )
    assert slope.height_at(9.0, 0.0) == pytest.approx(GROUND_LENGTH * math.tan(math.pi / 12))
    assert step.height_at(0.499, 0.0) == 0.0 and step.height_at(0.501, 0.0) == LIFT
    slippery, soft = GROUNDS["slippery"][0], GROUNDS["soft"][0]
    assert slippery.factors_at([0.6, 1.4, 1.6], 0.2)[:, 0].tolist() == [0.15, 0.15, 1.0]
    assert (slippery.factors_at([0.6, 1.4], 0.2)[:, 1] == 1.0).all()
    left, right = (soft.factors_at([0.6, 0.9, 1.2], y)[:, 1].tolist() for y in (0.2, -0.2))
    assert left == [0.02, 1.0, 0.02] and right == [1.0, 0.02, 1.0]


def test_random_hills_keep_their_bits_and_their_place() -> None:
    plain = hp.HeightField.random(5, size=2.0)
    moved = hp.HeightField.random(5, size=2.0, centre=(1.5, -0.5))
    assert plain.heights == moved.heights
    assert np.subtract(moved.origin, plain.origin) == pytest.approx([1.5, -0.5])
    level = hp.HeightField.random(5, size=6.0, flat_radius=1.0)
    assert not level.height_at(np.linspace(-0.99, 0.99, 50), 0.0).any()
    with refused(ParameterError, "flat_radius", 3.0):
        hp.HeightField.random(5, size=1.0, flat_radius=3.0)


FEMUR = [k for k, name in enumerate(ROBOT.joint_names) if "femur" in name]
FLAT, HIGH = hp.Scene(ROBOT), hp.Scene(ROBOT, terrain=hp.Flat(height=0.1))
HEAVY = hp.Scene(ROBOT, gravity=(0.0, 0.0, -12.0))
HOW = {"duration": 0.05, "method": "robust", "step": 2e-3}


def crouch(values: dict[str, float]) -> hp.HoldPosture:
    q = np.array(ROBOT.posture)
    q[FEMUR] += values["angle"]
    return hp.HoldPosture(q)


def height_error(found, baseline) -> float:
    """Mean square distance from 5 mm below the baseline, in mm^2."""
    errors = [
        run.height_mean - ref.height_mean + 5e-3 for run, ref in zip(found, baseline, strict=True)
    ]
    return float(np.mean(np.square(errors))) * 1e6


def crouched(**changes):
    given = {
        "start": {"angle": 0.0}, "bounds": {"angle": (-0.2, 0.2)}, "scenes": {"flat": FLAT},
        "objective": height_error, "held_out": {"heavy": HEAVY}, "seed": 3, "budget": 40, **HOW,
    }  # fmt: skip
    return hp.tune(crouch, **{**given, **changes})


@cache
def plain() -> hp.study.TuningResult:
    return crouched()


def test_optimum_is_that_of_a_fine_scan() -> None:
    """An independent path: 11 angles in a row, a parabola through the best three."""
    result = plain()
    angle = np.linspace(-0.1, 0.0, 11)
    cases = [hp.Case(FLAT, crouch({"angle": a})) for a in [0.0, *angle]]
    reference, *runs = hp.simulate_batch(cases, keep="summary", **HOW)
    scores = np.array([height_error([run], [reference]) for run in runs])
    k = int(scores.argmin())
    a, b, _ = np.polyfit(angle[k - 1 : k + 2], scores[k - 1 : k + 2], 2)
    assert result.best["angle"] == pytest.approx(-0.5 * b / a, abs=4e-3)
    assert result.tuned.best < 0.01 * result.tuned.start
    assert result.history[0].values == {"angle": 0.0} and 16 <= len(result.history) <= 40
    assert [one.generation for one in result.history[:9]] == [0] * 8 + [1]
    best = min(result.history, key=lambda one: one.score)
    assert best.values == result.best and best.score == result.tuned.best
    assert all(-0.2 <= one.values["angle"] <= 0.2 for one in result.history)
    assert result.tuned.start == result.tuned.baseline == pytest.approx(25.0, rel=1e-12)


def test_same_seed_same_bits_for_any_number_of_threads() -> None:
    again = crouched(threads=2)
    assert json.dumps(again.data) == json.dumps(plain().data)
    other = crouched(seed=4, start={"angle": 1e-3}, bounds={"angle": (1e-3, 0.1)}, budget=16)
    assert other.history[1].values != plain().history[1].values
    assert other.logarithmic == ("angle",)  # half of the candidates below the geometric mean
    below = sum(one.values["angle"] < 1e-2 for one in other.history)
    assert below >= len(other.history) / 4


def test_gain_on_scenes_that_were_not_tuned_on_stands_beside() -> None:
    result = plain()
    runs = hp.simulate_batch(
        [hp.Case(HEAVY, crouch(values)) for values in (result.start, result.best)],
        keep="summary", **HOW,
    )  # fmt: skip
    assert result.held_out.best == height_error(runs[1:], runs[:1])
    assert result.held_out.gain == 1.0 - result.held_out.best / result.held_out.baseline
    assert f"{100 * result.held_out.gain:+.1f} %" in result.table()


def test_failing_candidates_do_not_stop_the_search() -> None:
    """Refused by the maker of controllers, beyond a joint's range, or without a score."""

    def picky(values):
        if values["angle"] > 0.1:
            raise ParameterError("angle", values["angle"], "at most 0.1")
        return crouch(values)

    def sometimes(found, baseline):
        score = height_error(found, baseline)
        return math.nan if score > 30.0 else score

    result = hp.tune(
        picky, {"angle": 0.0}, {"angle": (-0.2, 3.0)}, {"flat": FLAT}, sometimes,
        held_out={"high": HIGH}, seed=1, budget=16, penalty=77.0, **HOW,
    )  # fmt: skip
    texts = " ".join(one.failure for one in result.history)
    assert "at most 0.1" in texts and "flat: ParameterError" in texts
    assert {one.score for one in result.history if one.failure} == {77.0}
    assert result.tuned.best <= result.tuned.start


def test_errors_of_a_program_are_raised_and_not_scored() -> None:
    with refused(KeyError, about=("knee",)):
        crouched(objective=lambda found, baseline: {}["knee"])
    with pytest.raises((DivergenceError, ParameterError)):
        crouched(start={"angle": 30.0}, bounds={"angle": (0.0, 40.0)})


def test_ctrl_c_keeps_the_best_so_far() -> None:
    calls = []

    def interrupt(share: float) -> None:
        calls.append(share)
        if len(calls) == 21:  # in the third generation
            raise KeyboardInterrupt

    with refused(StudyInterrupted, about=("40",)) as caught:
        crouched(progress=interrupt)
    kept = caught.value.result
    assert len(kept.history) in (20, 21) and f" {len(kept.history)} " in str(caught.value)
    assert kept.held_out is None and "interrupted" in kept.table()
    assert list(kept.history[:16]) == list(plain().history[:16])
    assert kept.tuned.best == min(one.score for one in kept.history)
    assert calls == sorted(calls)


def test_relative_objective_by_hand() -> None:
    base, other = hp.simulate_batch(
        [hp.Case(FLAT, crouch({"angle": a})) for a in (0.0, 0.1)], keep="summary", **HOW
    )
    own = {"height": lambda run: run.height_mean}
    objective = hp.study.RelativeObjective(
        {"torque_rms": 3.0, "force_peak": 1.0, "height": 0.5}, own
    )
    expected = (
        3.0 * other.torque_rms.sum() / base.torque_rms.sum()
        + other.force_peak.max() / base.force_peak.max()
        + 0.5 * other.height_mean / base.height_mean
    ) / 4.5
    assert objective([other], [base]) == pytest.approx(expected, rel=1e-12)
    with refused(ParameterError, "RelativeObjective.none", 0.0):
        hp.study.RelativeObjective({"none": 1.0}, {"none": lambda run: 0.0})([other], [base])
    for weights, value in (({"pitch_rms": -1.0}, ANY), ({"beauty": 1.0}, "beauty")):
        with refused(ParameterError, "RelativeObjective.weights", value):
            hp.study.RelativeObjective(weights)


def test_what_does_not_fit_is_refused() -> None:
    for changes, name, value in (
        ({"bounds": {}}, "bounds", []),
        ({"bounds": {"angle": (0.2, -0.2)}}, "bounds[angle]", (0.2, -0.2)),
        ({"start": {"angle": 0.3}}, "start[angle]", 0.3),
        ({"held_out": {}}, "held_out", {}),
        ({"held_out": {"other": FLAT}}, "held_out", ["other"]),
        ({"budget": 15}, "budget", 15),
        ({"population": 4}, "population", 4),
        ({"objective": lambda found, baseline: math.nan}, "objective", math.nan),
    ):
        with refused(ParameterError, name, value):
            crouched(**changes)
