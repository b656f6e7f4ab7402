"""Foot control as a controller: no parts, purity, cuts, lock-step, cases as text."""

from __future__ import annotations

import numpy as np
import pytest
from foot_control_runs import recall, robot
from test_foot_control_parts import PUSHED, loads_on

import hexapod_pin as hp
from hexapod_pin.control import ArcWalk
from hexapod_pin.simulation.case import Case

NOISY = hp.sensors.Sensors(
    q=hp.sensors.Sensor(noise=1e-4), foot_force=hp.sensors.Sensor(noise=0.1),
    rotation=hp.sensors.Sensor(noise=1e-3), delay=0.0042, seed=3,
)  # fmt: skip
BUMPS = hp.HeightField.random(2, amplitude=0.006, wavelength=0.15, size=3.0, flat_radius=0.1)


def full(walk=None, **settings) -> hp.FootControl:
    parts = {
        "slip": hp.foot_control.SlipPid(bandwidth=4.0),
        "force_targets": hp.foot_control.ForceTargets(sole="contact"),
        "suspension": hp.foot_control.VirtualSuspension(),
        "touch_down": hp.foot_control.TouchDown(), "levelling": hp.foot_control.Levelling(),
        "sensors": NOISY, "delay": 0.002,
    }  # fmt: skip
    return hp.FootControl(hp.Gait.tripod(lift=0.03) if walk is None else walk, **parts | settings)


def test_a_cut_changes_no_bit():
    scene = hp.Scene(robot("athena"), terrain=BUMPS)
    whole = hp.simulate(scene, full(), duration=0.9, sample=0.0025)
    for cut in (0.3, 0.605, 0.6025):
        first = hp.simulate(scene, full(), duration=cut, sample=0.0025)
        kept = hp.results.Checkpoint.from_dict(first.checkpoint.to_dict())
        second = hp.simulate(scene, full(), duration=0.9 - cut, initial=kept, sample=0.0025)
        memories = [t.checkpoint.loop["state"]["memory"] for t in (whole, second)]
        assert recall(np.asarray(memories[0]), "mode").any()
        assert np.array_equal(*memories), cut
        assert np.array_equal(np.concatenate([first.q, second.q[1:]]), whole.q), cut


def test_an_update_is_pure():
    """The same in, the same out; what goes in is left as it was."""
    control, measured = full(), loads_on("athena", PUSHED)
    state = control.start(hp.Scene(robot("athena"), terrain=BUMPS), 1)
    memory, q = state["memory"].copy(), measured.q.copy()
    first, second = (control.update(0.005, measured, state) for _ in range(2))
    assert np.array_equal(first[0].q, second[0].q)
    assert np.array_equal(first[1]["memory"], second[1]["memory"])
    assert np.array_equal(state["memory"], memory) and np.array_equal(measured.q, q)


def test_batches_of_unlike_servos_are_the_single_runs():
    control = full(sensors=None)
    cases = [
        Case(hp.Scene(robot("athena"), servo=hp.Servo(kp=kp, kd=kp / 60.0)), control, duration=0.25)
        for kp in (300.0, 200.0, 300.0)
    ]
    assert len({case.controller.start_key(case.scene) for case in cases}) == 2
    first, second, third = hp.simulate_batch(cases, threads=2, keep="trace")
    for case, trace in zip(cases[:2], (first, second), strict=True):
        alone = hp.simulate(case.scene, full(sensors=None), duration=0.25)
        assert np.array_equal(trace.q, alone.q)
    assert np.array_equal(first.q, third.q) and not np.array_equal(first.q, second.q)


PARTS = hp.foot_control
OTHER = hp.FootControl(
    hp.KinematicControl(hp.Gait.tripod(), stop_at=8.0),
    slip=PARTS.SlipPid(signal="slip", kp=0.1, ki=2.0, anticipates=False),
    suspension=PARTS.VirtualSuspension(stiffness=3000.0, frequency=4.0, load=6.0),
    force=PARTS.FootForceSensing(source="current", cutoff=20.0, threshold=2.0),
)
AIMED = full(
    ArcWalk(hp.Gait.tetrapod(cycle_time=2.0)),
    force_targets=PARTS.ForceTargets(sole=PARTS.Sole(stiffness=1e6)),
    servo=hp.Servo(kp=50.0, kd={"coxa": 1.0, "femur": 1.5, "tibia": 1.0}),
)


@pytest.mark.parametrize("control", [AIMED, OTHER], ids=["targets", "few parts"])
def test_a_case_is_read_back_equal_and_runs_to_the_same_bits(control, tmp_path):
    case = hp.Case(hp.Scene(robot("kharagpur")), control, duration=0.3, accuracy=1e-4)
    case.save(tmp_path / "case.toml")
    again = hp.load_case(tmp_path / "case.toml")
    assert again.controller.to_dict() == control.to_dict()
    assert again.digest == case.digest
    if control is OTHER:
        assert np.array_equal(case.run().q, again.run().q)
