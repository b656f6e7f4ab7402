"""Tuning: the optimum against another path, the same bits, held-out scenes, failures, Ctrl-C."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, ParameterError, StudyInterrupted

ROBOT = hp.load_robot("kharagpur")
FEMUR = [k for k, name in enumerate(ROBOT.joint_names) if "femur" in name]
FLAT, HIGH = hp.Scene(ROBOT), hp.Scene(ROBOT, terrain=hp.Flat(height=0.1))
HEAVY = hp.Scene(ROBOT, gravity=(0.0, 0.0, -12.0))
HOW = {"duration": 0.05, "method": "robust", "step": 2e-3}


def crouch(values: dict[str, float]) -> hp.HoldPosture:
    """All femora turned by one angle: the trunk goes down."""
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


@dataclass(frozen=True)
class Level:
    """Turns the femora against the measured pitch, with a gain and a rate gain."""

    gain: float
    damping: float = 0.0
    period: float = 0.01

    def start(self, scene, batch):
        return np.zeros((batch, 1))

    def update(self, time, m, state):
        pitch = -m.rotation[:, 2, 0:1]
        state = state + self.gain * pitch + self.damping * m.angular_velocity[:, 1:2]
        if abs(state).max() > 0.5:
            raise ParameterError("Level.state", float(abs(state).max()), "at most 0.5 rad")
        x = np.array([1.0 if name.startswith(("lf", "rf")) else -1.0 for name in ROBOT.joint_names])
        q = np.tile(ROBOT.posture, (len(pitch), 1))
        middle = [name.startswith(("lm", "rm")) for name in ROBOT.joint_names]
        x[middle] = 0.0
        q[:, FEMUR] += 0.3 * state * x[FEMUR]
        return hp.feedback.Command(q, ramp=True), state


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
    assert result.tuned.start == result.tuned.baseline == pytest.approx(25.0, rel=1e-12)


def test_same_seed_same_bits_for_any_number_of_threads() -> None:
    again = crouched(threads=2)
    assert json.dumps(again.data) == json.dumps(plain().data)
    other = crouched(seed=4)
    assert other.history[1].values != plain().history[1].values


def test_history_and_budget() -> None:
    result = plain()
    assert result.history[0].values == {"angle": 0.0}
    assert 16 <= len(result.history) <= 40
    assert [one.generation for one in result.history[:9]] == [0] * 8 + [1]
    best = min(result.history, key=lambda one: one.score)
    assert best.values == result.best and best.score == result.tuned.best
    assert all(-0.2 <= one.values["angle"] <= 0.2 for one in result.history)


def test_gain_on_scenes_that_were_not_tuned_on_stands_beside() -> None:
    """Values recomputed by hand from runs of the best."""
    result = plain()
    runs = hp.simulate_batch(
        [hp.Case(HEAVY, crouch(values)) for values in (result.start, result.best)],
        keep="summary", **HOW,
    )  # fmt: skip
    assert result.held_out.best == height_error(runs[1:], runs[:1])
    assert result.held_out.gain == 1.0 - result.held_out.best / result.held_out.baseline
    text, gain = result.table(), f"{100 * result.held_out.gain:+.1f} %"
    for part in ("tuned on", "held out", "heavy", "angle", "seed 3", gain):
        assert part in text
    assert result.data["held_out"]["gain"] == result.held_out.gain


def test_feedback_gains_on_slopes_on_a_logarithmic_scale() -> None:
    """A gain levels the trunk; where the state runs away the candidate fails and says so."""
    slopes = {f"{k}": hp.Scene(ROBOT, terrain=hp.Slope(angle=math.radians(k))) for k in (4, 6)}
    result = hp.tune(
        lambda values: Level(**values), {"gain": 1e-3, "damping": 0.0},
        {"gain": (1e-3, 10.0), "damping": (0.0, 0.1)}, slopes,
        hp.study.RelativeObjective({"pitch_rms": 1.0}),
        held_out={"5": hp.Scene(ROBOT, terrain=hp.Slope(angle=math.radians(5)))},
        baseline=hp.HoldPosture(), seed=1, budget=20, population=10, duration=0.4,
        method="robust", step=2e-3,
    )  # fmt: skip
    assert result.logarithmic == ("gain",)
    assert result.tuned.baseline == result.held_out.baseline == 1.0
    assert result.tuned.gain > 0.1 and result.held_out.gain > 0.1
    assert result.tuned.by_scene["4"][2] == pytest.approx(result.tuned.by_scene["6"][2], abs=0.2)
    assert result.failed > 0
    failed = [one for one in result.history if one.failure]
    assert {one.score for one in failed} == {1e3} and "Level.state" in failed[0].failure


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
    wide = hp.tune(
        crouch, {"angle": 0.0}, {"angle": (0.0, 30.0)}, {"flat": FLAT}, lambda found, base: -1.0,
        held_out={"high": HIGH}, seed=1, budget=16, penalty=-2.0, **HOW,
    )  # fmt: skip
    assert wide.failed and wide.best == {"angle": 0.0}  # never one that failed
    assert math.isnan(wide.tuned.gain) and "| - |" in wide.table()


def test_errors_of_a_program_are_raised_and_not_scored() -> None:
    with refused(KeyError, about=("knee",)):
        crouched(objective=lambda found, baseline: {}["knee"])
    with refused(TypeError, about=("nonsense",)):

        def broken(found, baseline):
            if found[0] is not baseline[0]:
                raise TypeError("nonsense")
            return 1.0

        crouched(objective=broken)
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
    with pytest.raises(StudyInterrupted) as caught:
        crouched(objective=lambda found, baseline: (_ for _ in ()).throw(KeyboardInterrupt))
    assert caught.value.result is None


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
    assert objective([base, other], [base, base]) == pytest.approx(0.5 + 0.5 * expected, rel=1e-12)
    with refused(ParameterError, "RelativeObjective.none", 0.0):
        hp.study.RelativeObjective({"none": 1.0}, {"none": lambda run: 0.0})([other], [base])
    for weights in ({}, {"pitch_rms": -1.0}, {"pitch_rms": 0.0}):
        with refused(ParameterError, "RelativeObjective.weights", weights):
            hp.study.RelativeObjective(weights)
    with refused(ParameterError, "RelativeObjective.weights", "beauty"):
        hp.study.RelativeObjective({"beauty": 1.0})


@pytest.mark.parametrize(
    ("changes", "name", "value"),
    [
        ({"bounds": {}}, "bounds", []),
        ({"bounds": {"angle": (0.2, -0.2)}}, "bounds[angle]", (0.2, -0.2)),
        ({"start": {"angle": 0.3}}, "start[angle]", 0.3),
        ({"scenes": {}}, "scenes", {}),
        ({"held_out": {}}, "held_out", {}),
        ({"held_out": {"other": FLAT}}, "held_out", ["other"]),
        ({"held_out": {"flat": HIGH}}, "held_out", ["flat"]),
        ({"budget": 15}, "budget", 15),
        ({"population": 4}, "population", 4),
        ({"penalty": math.inf}, "tune.penalty", math.inf),
        ({"objective": lambda found, baseline: math.nan}, "objective", math.nan),
        ({"duration": -1.0}, "duration", -1.0),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict, name: str, value: object) -> None:
    with refused(ParameterError, name, value):
        crouched(**changes)
