"""Controllers on the same scenes: `hp.compare`, its figure, and `hexapod-pin compare`."""

from __future__ import annotations

import json
import signal
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Run
from matplotlib.container import ErrorbarContainer
from page_data import PageData
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.errors import GaitError, ParameterError, StudyInterrupted, UnknownNameError
from hexapod_pin.results.walk_metrics import METRICS, ComparedRun, Outcome
from hexapod_pin.study import random_bumps
from hexapod_pin.view import write_comparison_figure
from hexapod_pin.view.study_figures import draw_comparison

CYCLE = 0.5
DURATION = 1.6  # two cycles to start, one steady one
ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
GAIT = hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE)
PLAIN = hp.KinematicControl(GAIT)
FAST = hp.KinematicControl(GAIT.model_copy(update={"stroke": 0.06}))
BUMPS = random_bumps(SCENE, range(3), amplitude=0.005, wavelength=0.3, length=0.4)


class Steps:
    """A feedback controller that walks what `PLAIN` plans, from its ticks."""

    period = 0.01
    gait = GAIT

    def __init__(self) -> None:
        """Plan the walk."""
        self.plan = PLAIN.plan(ROBOT, DURATION + 0.1)
        self.batches: list[int] = []

    def start(self, scene: hp.Scene, batch: int) -> None:
        """Remember how many run side by side."""
        self.batches.append(batch)

    def posture(self, scene: hp.Scene) -> np.ndarray:
        """Start as the plan does."""
        return np.array(self.plan.q[0])

    def update(
        self, time: float, m: hp.feedback.Measurement, state: None
    ) -> tuple[hp.feedback.Command, None]:
        """Go to where the plan is at the next tick."""
        at = time + self.period
        q = np.array([np.interp(at, self.plan.time, column) for column in self.plan.q.T])
        return hp.feedback.Command(np.repeat(q[None], len(m.q), axis=0), ramp=True), None


class Crouch:
    """Lets its trunk down to the ground, legs drawn up."""

    period = 0.05
    gait = GAIT

    def start(self, scene: hp.Scene, batch: int) -> None:
        """Nothing to remember."""

    def update(
        self, time: float, m: hp.feedback.Measurement, state: None
    ) -> tuple[hp.feedback.Command, None]:
        """Raise all feet by what the trunk is above the ground, and more."""
        legs = leg_group(ROBOT)
        up = min(1.0, time) * (0.02 - legs.neutral_feet[:, 2].min())
        feet = np.repeat(legs.neutral_feet[None], len(m.q), axis=0) + np.array([0.0, 0.0, up])
        return hp.feedback.Command(legs.joint_angles(feet)), None


class TooFar:
    """A plan that no robot can walk."""

    def plan(self, robot: hp.Robot, duration: float) -> Any:
        """Refuse."""
        raise GaitError("stroke 9 m: must be at most 0.1 m", "stroke", 0.1)

    def to_dict(self) -> dict[str, Any]:
        """Return the kind."""
        return {"kind": "too-far"}


@pytest.fixture(scope="module")
def found() -> hp.study.Comparison:
    """Two walks and one that is refused, on two scenes."""
    return hp.compare(
        {"flat": SCENE, "bumps": BUMPS}, {"plain": PLAIN, "fast": FAST, "far": TooFar()},
        duration=DURATION, threads=2,
    )  # fmt: skip


def test_numbers_are_those_of_single_runs(found: hp.study.Comparison) -> None:
    assert found.scenes == ("flat", "bumps") and found.controllers == ("plain", "fast", "far")
    for number, scene in enumerate(BUMPS):
        alone = hp.simulate(scene, FAST, duration=DURATION).summary
        run = found.of("bumps", "fast")[number]
        assert run.metrics == hp.study.WalkMetrics.of(alone) and run.summary.data == alone.data
    speeds = [run.metrics.measured_speed for run in found.of("bumps", "fast")]
    assert found.mean("bumps", "fast", "measured_speed").value == pytest.approx(
        np.mean(speeds), rel=1e-12
    )
    change = found.change("flat", "fast", "measured_speed")
    assert change.value == pytest.approx(0.2, abs=0.01)  # stroke 0.06 against 0.05 m
    assert change.half_width is None and change.count == 1
    assert found.change("bumps", "fast", "measured_speed").differs_from(0.0)


def test_a_run_that_is_refused_or_too_short_is_a_row(
    found: hp.study.Comparison,
) -> None:
    """A bare scene or a list will do."""
    runs = found.of("bumps", "far")
    assert [run.outcome for run in runs] == [Outcome.REFUSED] * 3
    assert found.mean("bumps", "far", "measured_speed") is None
    text = found.table()
    assert "0 of 3: refused" in text and "far on bumps #2: refused (" in text
    assert "nan" not in text.lower() and "kharagpur, 1.6 s, ndf" in text
    for metric in METRICS.values():
        assert f"{metric.meaning} [{metric.unit}]" in text
    rows = found.to_markdown().splitlines()
    widths = {row.count(" | ") for row in rows if row.startswith("| ") and "---" not in row}
    assert widths == {3}
    short = hp.compare(SCENE, {"plain": PLAIN}, duration=1.0)
    [run] = short.runs
    assert run.outcome is Outcome.TOO_SHORT and "1.5 s" in run.reason
    assert "0 of 1: too short" in short.table()


def test_feedback_controllers_go_in_lock_step_and_may_fall() -> None:
    steps = Steps()
    found = hp.compare(
        {"bumps": BUMPS}, {"plain": PLAIN, "steps": steps, "crouch": Crouch()}, duration=DURATION
    )
    assert steps.batches == [3]
    change = found.change("bumps", "steps", "measured_speed")
    assert change.value == pytest.approx(0.0, abs=0.02)  # the same plan, cut into ticks
    assert [run.outcome for run in found.of("bumps", "crouch")] == [Outcome.FELL] * 3
    assert "the trunk touched the ground" in found.of("bumps", "crouch")[0].reason


@pytest.mark.parametrize(
    ("scenes", "controllers", "name", "value"),
    [
        ({}, {"plain": PLAIN}, "scenes", {}), ({"a": []}, {"plain": PLAIN}, "scenes", {"a": []}),
        ({"a": [3]}, {"plain": PLAIN}, "compare.scenes[a][0]", 3), (SCENE, {}, "controllers", {}),
        (SCENE, PLAIN, "compare.controllers", PLAIN),
    ],
)  # fmt: skip
def test_nothing_to_compare_is_refused(scenes, controllers, name, value):
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
    assert "not run" in partial.table()


# --- the figure ---------------------------------------------------------------------------------


def test_bars_are_changes_with_their_intervals(found: hp.study.Comparison) -> None:
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
    assert [text.get_text() for text in panels[0].get_yticklabels()] == [
        METRICS[name].meaning for name in shown
    ]


def test_a_bar_beyond_the_axis_says_how_long_it_is() -> None:
    numbers = dict.fromkeys(METRICS)
    runs = [
        ComparedRun(
            "flat", 0, name, Outcome.WALKED, metrics=hp.study.WalkMetrics(**numbers | values)
        )
        for name, values in (
            ("a", {"measured_speed": 1.0, "roll_rms": 1.0}),
            ("b", {"measured_speed": 5.0, "roll_rms": 1.5}),
        )
    ]
    [axes] = draw_comparison(hp.study.Comparison(tuple(runs))).axes
    assert axes.get_xlim()[1] == pytest.approx(150.0)
    assert [text.get_text() for text in axes.texts] == ["+400 %"]


def test_figures_are_written_or_refused(found: hp.study.Comparison, tmp_path: Path) -> None:
    assert b"<svg" in write_comparison_figure(found, tmp_path / "bars.svg").read_bytes()
    with refused(UnknownNameError, kind="metric", name="beauty"):
        write_comparison_figure(found, tmp_path / "none.svg", metrics=["beauty"])
    with refused(ParameterError, "path"):
        write_comparison_figure(found, tmp_path / "none.gif")
    alone = hp.study.Comparison(found.of("flat", "plain"))
    with refused(ParameterError, "comparison", ("plain",)):
        write_comparison_figure(alone, tmp_path / "none.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["bars.svg"]


# --- the command --------------------------------------------------------------------------------


@pytest.fixture
def compare(run: Run) -> Run:
    """Run the command in a folder with two cases."""
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
    full = compare("plain.toml", "fast.toml", "--full").out
    assert "change against plain" in full and "scene of plain" in full
    numbers = json.loads(Path("numbers.json").read_text())
    by_name = {entry["controller"]: entry["metrics"] for entry in numbers["runs"]}
    for name in ("plain", "fast"):  # on the first one's scene, in its settings
        assert by_name[name] == found.of("flat", name)[0].metrics.to_dict()
    page = PageData(Path("runs.html").read_text())
    assert [run["name"] for run in page.runs] == ["plain", "fast"]
    assert "<svg" in Path("bars.svg").read_text()


def test_own_scenes_and_bumps(compare: Run) -> None:
    own = compare("plain.toml", "fast.toml", "--own-scenes", "--markdown")
    assert own.status == 0 and "| plain | fast |" in own.out
    assert "1.6 s" in own.out and "1.7 s" in own.out
    options = ("--bumps", "0.005", "--wavelength", "0.3", "--seeds", "2", "--length", "0.4")
    files = ("--json", "numbers.json", "--html", "bumps.html")
    bumps = compare("plain.toml", "fast.toml", *options, *files, "--full")
    assert bumps.status == 0 and "bumps of 0.005 m, 0.3 m apart (2 variants)" in bumps.out
    runs = json.loads(Path("numbers.json").read_text())["runs"]
    expected = hp.simulate(BUMPS[1], PLAIN, duration=DURATION).summary
    assert runs[2]["metrics"] == hp.study.WalkMetrics.of(expected).to_dict()
    for run in PageData(Path("bumps.html").read_text()).runs:  # of each controller on two grounds
        assert len(run["spread"]["runs"]) == 1
        assert run["spread"]["differ"] == "they differ in terrain heights"


def test_the_command_goes_on_with_a_store(compare: Run) -> None:
    options = ("plain.toml", "fast.toml", "--store", "rows.db", "--json", "numbers.json")
    first = compare(*options)
    assert first.status == 0, first.err
    again = compare(*options)
    assert again.status == 2 and "--resume" in again.err
    resumed = compare(*options, "--resume", "--threads", "1")
    assert (resumed.status, resumed.out) == (0, first.out)
    refused_too = compare(*options[:2], "--resume")
    assert refused_too.status == 2 and "store" in refused_too.err


@pytest.mark.parametrize(
    ("options", "culprit"),
    [
        (("none.toml",), "none.toml"),
        (("plain.toml", "plain.toml"), "two of 'plain'"),
        (("plain.toml", "--seeds", "3"), "--seeds"),
        (("plain.toml", "--bumps", "0.01", "--seeds", "0"), "--seeds"),
        (("plain.toml", "--bumps", "0.01", "--seeds", str(2**70)), "from 1 to 1000"),
        (("plain.toml", "--flat-radius", "0.1"), "--flat-radius"),
        (("plain.toml", "--bumps", "0.01", "--flat-radius", "-1"), "--flat-radius"),
        (("plain.toml", "--bumps", "0.01", "--length", "-1"), "--length"),
        (("plain.toml", "--bumps", "0.01", "--length", "1e308"), "--length = 1e+308"),
        (("plain.toml", "--bumps", "0.01", "--own-scenes"), "--bumps"),
        (("plain.toml", "--figure", "bars.svg"), "--figure"),
        (("plain.toml", "fast.toml", "--figure", "bars.gif"), ".png"),
        (("plain.toml", "--html", "none/a.html"), "none"),
        (("plain.toml", "--html", "same", "--json", "same"), ".html"),
        (("plain.toml", "--import", "none.py"), "--import"),
    ],
)
def test_refusals_are_one_message(compare: Run, options: tuple[str, ...], culprit: str) -> None:
    done = compare(*options)
    assert done.status == 2 and culprit in done.err and done.err.count("\n") == 1
