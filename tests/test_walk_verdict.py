"""The verdict on a walk: each of its elements with a known answer, and real runs."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from conftest import Run
from refusals import refused
from synthetic import JOINTS, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.commands.terminal import DOES_NOT_WALK
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_answer import walk_answer
from hexapod_pin.results.walk_causes import dragging
from hexapod_pin.results.walk_verdict import WalkVerdict
from hexapod_pin.robot.holding_torque import standing_torque

TRIPOD = hp.Gait.tripod(stroke=0.06, cycle_time=1.0)


def turned(trace: Trace, about: int, angle: np.ndarray) -> Trace:
    q = np.array(trace.q)
    q[:, 3:7] = 0.0
    q[:, 3 + about], q[:, 6] = np.sin(0.5 * angle), np.cos(0.5 * angle)
    return replace(trace, q=q)


@cache
def walk(gait: hp.Gait = TRIPOD, duration=4.0, mu=0.7, **scene: object) -> WalkVerdict:
    contact = hp.Contact.accurate().with_mu(mu)
    setting = hp.Scene(hp.load_robot("kharagpur"), contact=contact, **scene)  # type: ignore[arg-type]
    return hp.walk_verdict(hp.simulate(setting, hp.KinematicControl(gait), duration=duration))


@cache
def real_walk() -> Trace:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.KinematicControl(TRIPOD), duration=3.0)


def test_a_glide_at_the_nominal_speed_walks() -> None:
    """0.1 m/s for three whole cycles of 1 s: 0.3 m, to rounding; 80 % of the speed is a walk."""
    verdict = hp.walk_verdict(synthetic_trace())
    assert verdict.walks and verdict.advice == ""
    assert (verdict.travel.start, verdict.travel.end, verdict.travel.cycles) == (1.0, 4.0, 3)
    assert verdict.travel.travelled_distance == pytest.approx(0.3, rel=1e-12)
    assert verdict.travel.turn_share is None and verdict.travel.yaw_error == 0.0
    assert "\n" not in verdict.line and verdict.line.startswith("synthetic walks: 0.3 m in 3 s")
    for speed in (0.081, 0.079):
        verdict = hp.walk_verdict(synthetic_trace(speed=speed, nominal_speed=0.1))
        assert verdict.walks is (speed > 0.08)
        assert verdict.travel.speed_share == pytest.approx(10.0 * speed, rel=1e-12)
        assert verdict.walks or "of the nominal speed" in verdict.reason
    scene = hp.Scene(hp.load_robot("kharagpur"))
    standing = hp.walk_verdict(hp.simulate(scene, hp.HoldPosture(), duration=0.3))
    assert standing.walks and standing.line.startswith("kharagpur stands: ")


def test_motion_against_the_plan_is_told_by_its_speed() -> None:
    """A robot on a steep slope made "-7704% of the nominal speed"."""
    verdict = hp.walk_verdict(synthetic_trace(speed=-0.3, nominal_speed=0.1))
    assert verdict.reason == "it slides back at 0.3 m/s"
    trace = synthetic_trace()  # yaw 0.1 rad/s to the right over the window of 3 s
    verdict = hp.walk_verdict(turned(trace, 2, -0.1 * trace.time))
    assert verdict.travel.yaw_error == pytest.approx(-0.3, abs=1e-12)
    trace = synthetic_trace(speed=0.0, nominal_speed=0.0, turn_rate=0.2)
    verdict = hp.walk_verdict(turned(trace, 2, -0.1 * trace.time))
    assert verdict.reason == "it turns the other way at 5.7 deg/s" and not verdict.walks


def test_a_record_of_another_robot_is_refused() -> None:
    """Its limits, and counts of limits met, ended in numpy's ValueError."""
    with refused(ParameterError, "run.robot.effort_limit", 17, allowed=(18,)):
        hp.walk_verdict(synthetic_trace(effort_limit=(5.0,) * 17))
    row = {"joint": "a", "limit_count": 1, "limit_time": 1.0, "stop_count": 0}
    with refused(ParameterError, "Trace.limits", 1, allowed=(18,)):
        hp.walk_verdict(synthetic_trace(limits=[row]))


def test_a_fall_is_reported_with_time_and_manner() -> None:
    """Tipping at 0.2 rad/s passes 45 degrees at 3.927 s: the next sample is 3.93 s."""
    trace = synthetic_trace(duration=8.0)
    for axis in (0, 1):
        fall = hp.walk_verdict(turned(trace, axis, 0.2 * trace.time)).fall
        assert fall is not None and "tipped over" in fall.how
        assert fall.time == pytest.approx(math.radians(45.0) / 0.2, abs=0.01)
    com = np.array(trace.com)
    com[trace.time >= 2.0, 2] = 0.05  # 0.09 m over the feet at the start, 0.04 m then
    fall = hp.walk_verdict(replace(trace, com=com)).fall
    assert fall is not None and fall.time == 2.0 and "sank" in fall.how
    force = np.array(trace.foot_force)
    force[(trace.time > 3.0) & (trace.time < 3.2)] = 0.0
    verdict = hp.walk_verdict(replace(trace, foot_force=force))
    assert verdict.fall is not None and verdict.fall.how == "all feet left the ground"
    assert verdict.fall.time == pytest.approx(3.01) and not verdict.walks
    force[trace.time < 3.11] = 5.0  # 0.09 s in the air: a hop, no fall
    assert hp.walk_verdict(replace(trace, foot_force=force)).fall is None


def test_trunk_contact_is_not_walking() -> None:
    event = {"time": 2.5, "kind": "trunk-contact", "what": "base_link -x", "place": [0, 0, 0]}
    verdict = hp.walk_verdict(synthetic_trace(events=[event, event]))
    assert not verdict.walks and verdict.trunk_contacts == 2
    assert "trunk on the ground at 2.5 s (2 contacts)" in verdict.line
    event["time"] = 0.0
    assert "higher posture" in hp.walk_verdict(synthetic_trace(events=[event])).advice


def test_the_worst_joint_at_its_limits_is_named() -> None:
    """Joint 4 at its effort for a quarter of the samples; joint 7 too fast for a tenth of them."""
    torque, rate = np.zeros((401, 18)), np.zeros((401, 18))
    torque[:100, 4], torque[:10, 5], rate[:40, 7] = -5.0, 5.0, 3.0
    trace = synthetic_trace(torque=torque, rate=rate, velocity_limit=[3.0] * 18)
    verdict = hp.walk_verdict(trace)
    assert verdict.at_torque_limit == (JOINTS[4], pytest.approx(100 / 401), 2)
    assert verdict.at_speed_limit == (JOINTS[7], pytest.approx(40 / 401), 1)
    assert f"2 joints at the torque limit, {JOINTS[4]} 24.94%" in verdict.line


def test_curves_stops_and_turns_on_the_spot_are_judged_by_their_plan() -> None:
    spot = walk(hp.Gait.tripod(stroke=0.0, turn_rate=-0.3, cycle_time=1.0))
    assert spot.walks and spot.travel.speed_share is None and spot.slip.per_metre is None
    assert (spot.travel.turn_share, spot.travel.turn) == pytest.approx((1.0, -0.6), rel=0.02)
    curve = walk(hp.Gait.tripod(stroke=0.04, turn_rate=0.2, cycle_time=1.0))
    assert curve.walks and curve.travel.turn_share == pytest.approx(1.0, abs=0.02)
    assert curve.travel.speed_share == pytest.approx(1.0, abs=0.02)
    command = hp.motion.VelocityCommand(time=(0.0, 2.0), forward=(0.05, 0.0), turn_rate=(0.0, 0.2))
    scene, control = (
        hp.Scene(hp.load_robot("kharagpur")),
        hp.KinematicControl(TRIPOD, velocity=command),
    )
    travel = hp.walk_verdict(hp.simulate(scene, control, duration=4.0)).travel
    assert (travel.speed_share, travel.turn_share) == pytest.approx((1.0, 1.0), abs=0.05)


def test_soft_servos_and_ice_are_distinguished() -> None:
    assert "prescribed motion: no limit acts" in walk(TRIPOD, 1.0, prescribed=True).line
    slip = {"lf_foot": 0.02, "rf_foot": 1.02, "rm_foot": 0.98}
    assert dragging(slip, 1) == "it drags rf_foot and rm_foot along" and dragging(slip, 2) == ""
    soft = walk(servo=hp.Servo(kp=3.0, kd=0.1))
    assert not soft.walks and "stiffer servos" in soft.advice
    ice = walk(mu=1e-4)
    assert not ice.walks and "friction coefficient than 0.0001 (--mu)" in ice.advice
    assert ice.cause == "friction of 0.0001 holds no foot"
    assert walk(mu=0.03).cause != "friction of 0.03 holds no foot"
    assert ice.slip is not None and (ice.slip.total is None or ice.slip.total > 1.0)


def test_a_robot_too_weak_ends_with_status_3_and_what_it_needs(run: Run, tmp_path: Path) -> None:
    need = max(standing_torque(hp.load_robot("kharagpur")))
    text = hp.urdf_path("kharagpur").read_text()
    assert text.count('effort="6"') == 18
    (tmp_path / "weak.urdf").write_text(text.replace('effort="6"', 'effort="0.3"'))
    options = "--cycle-time 0.5 --stroke 0.025 --duration 1.5 --accuracy 1e-2 --no-html --out w.nc"
    done = run("walk", "weak.urdf", *options.split())
    assert done.status == DOES_NOT_WALK == 3 and "w.nc" in done.left
    assert done.out.index("does not walk:") < done.out.index("femur")
    assert done.err.startswith("hexapod-pin: ") and done.err.count("\n") == 1
    assert f"takes {need:.3g} N m at" in done.err and "which has 0.3" in done.err


def test_walk_run_and_budget_give_the_verdict_of_the_library(run: Run) -> None:
    """`--verdict`: one walk, three commands, the same table; JSON holds all its numbers."""
    words = "walk kharagpur --gait tripod --cycle-time 0.3 --stroke 0.03 --no-html --accuracy 1e-2"
    words += " --sample 0.02 --duration 0.9 --verdict --save-case case.toml"
    walked = run(*words.split())
    assert (walked.status, walked.err) == (0, "")
    expected = hp.study.judge_peaks(hp.load_trace("walk.nc"))
    assert walked.out.endswith(expected.table() + "\n")
    again = run("run", "case.toml", "--no-html", "--verdict", "--threads", "2")
    assert again.out.endswith(expected.table() + "\n")
    data = json.loads(run("budget", "walk.nc", "--verdict", "--json").out)
    assert data.pop("verdict") == expected.to_dict()
    assert data == hp.torque_budget(hp.load_trace("walk.nc")).to_dict()
    assert "--verdict" in data["caveat"]


def test_limits_that_no_motor_has_are_said_to_be_such() -> None:
    """18 motors of 120 N m/kg that weigh 1.5 times 3.09 kg give 30.9 N m each."""
    trace = real_walk()
    robot = trace.run.robot
    assert robot.mass == pytest.approx(3.0875, abs=1e-3)
    for torque, speed, vain in (
        (30.0, 100.0, ""), (31.0, 6.0, "31 N m, 3.04 if kgf cm are meant"),
        (6.0, 101.0, "101 rad/s, 1.76 if degrees/s are meant"), (1e4, 6.0, "10000 N m"),
        (2e3, 6.0, "2000 N m, 2 if N mm are meant"),
    ):  # fmt: skip
        limits = {"effort_limit": (torque,) * 18, "velocity_limit": (speed,) * 18}
        run = trace.run.model_copy(update={"robot": robot.model_copy(update=limits)})
        answer = walk_answer(replace(trace, run=run))
        assert answer.verdict.vain_limits == vain
        ends = f"its limits are no motor's ({vain})" if vain else "nothing at a limit"
        assert answer.headline.endswith(f", {ends}")


@pytest.mark.parametrize(("force", "thrown_off"), [(105.0, False), (115.0, True)])
def test_a_push_before_the_steady_part_is_judged(force: float, thrown_off: bool) -> None:
    """Its steady cycle alone shows nothing of a push; beyond its own stance it is thrown."""
    push = hp.Push("base_link", force=(0.0, force, 0.0), start=0.5, duration=0.1)
    scene = hp.Scene(hp.load_robot("kharagpur"), loads=[push])
    trace = hp.simulate(scene, hp.KinematicControl(TRIPOD), duration=3.0, accuracy=1e-3)
    verdict = hp.walk_verdict(trace)
    assert verdict.travel.start == pytest.approx(2.0) and verdict.push is not None
    thrown = trace.q[-1, 1] - trace.q[np.searchsorted(trace.time, 0.5), 1]
    assert verdict.push.offset == pytest.approx(thrown, rel=0.05) and thrown > 0.5
    assert 0.1 < (verdict.push.after or 0.0) < 1.5
    assert (thrown > verdict.push.stance) == thrown_off
    assert verdict.walks != thrown_off and verdict.push.line in verdict.line
    headline = walk_answer(trace).headline
    assert (f"threw it {verdict.push.offset:.3g} m off its track" in headline) == thrown_off
    assert (verdict.push.line in headline) != thrown_off


def test_torques_of_a_run_of_large_error_are_not_to_be_trusted(monkeypatch) -> None:
    """Off by 239 %, they were those of a robot that walks, with status 0."""
    trace = real_walk()
    assert walk_answer(trace).good
    error = float(trace.error.torque[-1]) / float(np.abs(trace.torque).max())
    monkeypatch.setattr("hexapod_pin.results.walk_cautions.MUCH_ERROR", 0.999 * error)
    answer = walk_answer(trace)
    assert not answer.good and answer.verdict.walks
    said = f"NOT to be trusted: the run's own error is {error:.0%} of the largest torque"
    assert said in answer.headline
    assert "--repair" not in "\n".join([*answer.lines(), answer.verdict.line])


def test_a_push_by_a_torque_has_no_force_in_words() -> None:
    """Such a push tips the robot over; no number of newtons describes it."""
    push = hp.Push("base_link", torque=(40.0, 0.0, 0.0), start=0.5, duration=0.3)
    scene = hp.Scene(hp.load_robot("kharagpur"), loads=(push,))
    trace = hp.simulate(scene, hp.KinematicControl(hp.Gait.tripod()), duration=2.0, estimate=False)
    verdict = hp.walk_verdict(trace)
    assert not verdict.walks and verdict.fall is not None
    assert verdict.cause.startswith("a push by a torque, threw it ")
    assert " 0 N" not in verdict.line + verdict.advice
