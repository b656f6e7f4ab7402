"""A walk that is run until a cycle repeats: its cycle is that of the walk for ever."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import hexapod_pin as hp
from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.results.error_estimate import ErrorEstimate
from hexapod_pin.results.summary_verdict import summary_fall
from hexapod_pin.simulation import steady_walk
from hexapod_pin.simulation.transients import Change, Transients

ROBOT = hp.load_robot("kharagpur")
TRIPOD = hp.Gait.tripod(stroke=0.07, cycle_time=1.0)
WALK = hp.KinematicControl(TRIPOD)
TURNING = hp.KinematicControl(TRIPOD.with_changes(turn_rate=0.2))
PUSH = hp.Push("base_link", force=(0, 5, 0), start=1.0, duration=2.0)
NUMBERS = ("torque_rms", "torque_peak", "positive_energy", "speed_rms", "height_mean")


def steady(scene: hp.Scene, control: object = WALK, **settings: object) -> hp.Trace:
    return hp.simulate(scene, control, **{"duration": 4.0, "until": "steady", **settings})


@pytest.fixture(scope="module")
def cycle() -> hp.Trace:
    return steady(hp.Scene(ROBOT))


@pytest.mark.parametrize(
    ("contact", "control"), [(hp.Contact.accurate(), WALK), (hp.Contact.s2(), ArcWalk())]
)
def test_the_cycle_is_that_of_the_walk_for_ever(contact: hp.Contact, control: hp.KinematicControl):
    """The truth walks on for four cycles at 1e-8: the errors stated contain what is off."""
    scene, period = hp.Scene(ROBOT, contact=contact), control.gait.cycle_time
    found = steady(scene, control)
    assert found.accuracy_kept and found.run.numerics.cycles_run <= 4
    sample = period / (len(found.time) - 1)
    tight = {"accuracy": 1e-8, "method": "ndf", "estimate": False, "sample": sample}
    on = hp.simulate(scene, control, duration=3 * period, initial=found.checkpoint, **tight)
    truth = hp.simulate(scene, control, duration=period, initial=on.checkpoint, **tight)
    assert np.abs(found.q[:, 7:] - truth.q[:, 7:]).max() <= found.error.joint[-1] <= 1e-4
    largest = np.abs(found.torque).max()
    assert np.abs(found.torque - truth.torque).max() <= found.error.torque[-1] <= 0.01 * largest
    own, other = found.summary, truth.summary
    for name in NUMBERS:
        off = np.abs(np.abs(getattr(own, name)) - np.abs(getattr(other, name))).max()
        assert off <= np.max(own.error_of(name)), name


def test_the_cycle_ends_as_it_begins(cycle: hp.Trace):
    numerics = cycle.run.numerics
    first, last = cycle.q[0], cycle.q[-1]
    up = [pin.Quaternion(*q[[6, 3, 4, 5]]).matrix()[2] for q in (first, last)]
    missed = max(
        np.abs(last[7:] - first[7:]).max(), abs(last[2] - first[2]), np.linalg.norm(up[1] - up[0])
    )
    assert missed <= numerics.transients <= 10.0 * missed
    assert np.abs(cycle.torque[-1] - cycle.torque[0]).max() <= numerics.torque_transients
    assert math.isclose(cycle.time[-1] - cycle.time[0], 1.0, rel_tol=1e-12)
    assert cycle.summary.cycles == 1
    assert cycle.q[-1, 0] - cycle.q[0, 0] == pytest.approx(TRIPOD.stroke / TRIPOD.duty, rel=0.01)
    # the error contains the transients, and the energies close over the cycle alone
    assert cycle.error.joint[-1] >= numerics.transients
    assert np.abs(cycle.energy_residual).max() <= 1e-4 * np.abs(cycle.energy["servo_work"]).max()


def test_batch_file_and_summary_give_the_same(cycle: hp.Trace, tmp_path):
    case = hp.Case(hp.Scene(ROBOT), WALK, duration=4.0, until="steady")
    assert hp.load_case(case.save(tmp_path / "case.toml")) == case == hp.load_case(cycle)
    assert case.digest != hp.Case(hp.Scene(ROBOT), WALK, duration=4.0).digest
    [trace] = hp.simulate_batch([case])
    assert np.array_equal(trace.q, cycle.q) and np.array_equal(trace.torque, cycle.torque)
    [summary] = hp.simulate_batch([case], keep="summary")
    assert np.allclose(summary.torque_rms, cycle.summary.torque_rms, rtol=0.0, atol=1e-4)
    assert summary.run.numerics.cycles_run == cycle.run.numerics.cycles_run


def test_fixed_steps_slopes_turns_and_motions_repeat():
    tilted = hp.Scene(ROBOT, terrain=hp.Slope(angle=0.1))
    for scene, control, settings in (
        (tilted, WALK, {}),
        (hp.Scene(ROBOT, loads=[hp.Payload("base_link", 0.5)]), TURNING, {}),
        (hp.Scene(ROBOT, contact=hp.Contact.s2(), prescribed=True), WALK, {}),
        (hp.Scene(ROBOT), WALK, {"method": "robust", "step": 1e-3}),
    ):
        found = steady(scene, control, **settings)
        assert found.run.numerics.cycles_run and found.run.numerics.transients <= 1e-4, settings
        assert found.accuracy_kept == (not settings)
        assert hp.walk_verdict(found).walks


def test_a_walk_that_does_not_repeat_is_run_as_usual(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(steady_walk, "MOST_CYCLES", 2)
    found, usual = steady(hp.Scene(ROBOT)), hp.simulate(hp.Scene(ROBOT), WALK, duration=4.0)
    assert found.run.numerics.cycles_run is None and np.array_equal(found.q, usual.q)
    monkeypatch.undo()
    limp = hp.Scene(ROBOT, servo=hp.Servo.for_robot(ROBOT, kp=0.5, kd=0.05))
    fallen = steady(limp, duration=1.0)
    assert fallen.run.numerics.cycles_run is None and fallen.time[0] == 0.0
    assert not hp.walk_verdict(fallen).walks


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"control": hp.HoldPosture()}, "neither KinematicControl nor ArcWalk"),
        ({"control": hp.KinematicControl(TRIPOD, stop_at=6.0)}, "the walk stops"),
        ({"initial": ROBOT.stand()}, "a given state"),
        ({"terrain": hp.Stairs(rise=0.02, run=0.3, count=3, start=1.0)}, "no plane"),
        ({"loads": [PUSH]}, "does not always act"),
        ({"terrain": hp.Slope(angle=0.1), "control": TURNING}, "turns on inclined ground"),
    ],
)
def test_what_cannot_repeat_is_refused(change: dict, reason: str):
    parts = {name: change[name] for name in ("terrain", "loads") if name in change}
    control, initial = change.get("control", WALK), change.get("initial")
    with pytest.raises(hp.errors.ParameterError, match=f"until.*{reason}"):
        steady(hp.Scene(ROBOT, **parts), control, initial=initial)


def test_times_that_do_not_fit_are_refused():
    with pytest.raises(hp.errors.ParameterError, match="until.*'steady' or None"):
        hp.Case(hp.Scene(ROBOT), WALK, duration=4.0, until="ever")
    for settings, name in (({"sample": 0.03}, "sample"), ({"step": 0.003}, "step")):
        with pytest.raises(hp.errors.ParameterError, match=f"{name}.*cycle of 1 s"):
            steady(hp.Scene(ROBOT), duration=0.3, **settings)


def test_what_is_left_is_a_geometric_series():
    """A walk that contracts to a quarter: of changes 4d, d follow d/4, d/16 ..., in all 4/3 d."""
    before, now = (Change(*(scale * np.arange(1.0, 6.0))) for scale in (4e-6, 1e-6))
    left = Transients.of(
        3, (before, now), ({"torque_rms": np.ones(2)}, {"torque_rms": np.array([1.0, 1.03])})
    )
    assert left.left.joint == pytest.approx(3e-6 * 4.0 / 3.0)
    assert left.numbers["torque_rms"] == pytest.approx(np.full(2, 0.01))
    assert now.contraction(before) == pytest.approx(0.25)
    assert before.contraction(now) == 0.9 and Change(*5 * [0.0]).contraction(now) == 0.1
    error = ErrorEstimate(*(np.ones(2) for _ in range(4)))
    assert left.left.added_to(error).torque == pytest.approx(1.0 + 4e-6 * 4.0 / 3.0)


def test_a_trunk_whose_origin_is_below_the_ground_has_not_sunk(cycle: hp.Trace):
    """As of robots whose files begin at the lowest point: their height tells nothing."""
    summary = cycle.summary
    start = summary.run.level_start.model_copy(update={"trunk": -0.1})
    record = summary.run.model_copy(update={"level_start": start})
    assert summary_fall(replace(summary, height_min=-0.101, run=record)) is None
    low = replace(summary, height_min=0.4 * (summary.run.level_start.trunk - start.ground))
    assert summary_fall(low).how.startswith("sank")
