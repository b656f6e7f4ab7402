"""The stress set, shortened: random extreme scenes stay finite and gain no energy."""

from __future__ import annotations

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.validation.stress import ALLOWED_GAIN, EVENTS, STEPS, run_stress, stress_scenes

INJECTION = 1e-6
"""Energy the contact solve may make, of a run's energy scale."""


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("friction", ["usual", "falling"])
def test_stress_scenes_stay_finite_and_gain_nothing(step: float, friction: str) -> None:
    """60 scenes; every fifth is the same event. Also no rise above an earlier energy."""
    scenes = list(stress_scenes(60 if friction == "usual" else 20, seed=0, friction=friction))
    for outcome in run_stress(scenes, step):
        assert outcome.passed, outcome
        assert outcome.rise < ALLOWED_GAIN, outcome
        assert outcome.injection < INJECTION, outcome


def test_the_reference_form_passes_too() -> None:
    for outcome in run_stress(list(stress_scenes(20, seed=1)), 1e-3, method="robust-reference"):
        assert outcome.passed and outcome.rise < ALLOWED_GAIN and outcome.injection < INJECTION


def test_the_set_is_fixed_by_its_seed() -> None:
    few, many = list(stress_scenes(3, seed=5)), list(stress_scenes(6, seed=5))
    for one, other in zip(few, many, strict=False):
        assert one.scene.contact == other.scene.contact
        assert np.array_equal(one.initial.q, other.initial.q)
    assert {scene.name.split(" ", 1)[1] for scene in many} == set(EVENTS)
    assert few[0].scene.contact != next(iter(stress_scenes(1, seed=6))).scene.contact


STROKES = {"kharagpur": 0.14, "athena": 0.10}


@pytest.mark.parametrize(
    ("name", "preset"),
    [("kharagpur", "accurate"), ("athena", "s1"), ("kharagpur", "s1-printed"), ("athena", "s2"),
     ("kharagpur", "soil")],
)  # fmt: skip
def test_walks_at_one_millisecond(name: str, preset: str) -> None:
    """3 s of a tetrapod gait: forward, straight, and no energy but the servos'."""
    scene = hp.Scene(hp.load_robot(name), contact=hp.Contact.preset(preset))
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=STROKES[name]))
    trace = hp.simulate(scene, control, duration=3.0, method="robust", step=1e-3, sample=0.01)
    stored = sum(trace.energy[part] for part in ("kinetic", "potential", "elastic"))
    gained = stored - stored[0] - trace.energy["servo_work"]
    passed_on = np.abs(trace.torque * trace.v[:, 6:]).sum(axis=1)
    assert gained.max() < 0.01 * np.trapezoid(passed_on, trace.time)
    forward, side = trace.q[-1, :2] - trace.q[0, :2]
    assert forward > 0.25 * trace.run.walk.nominal_speed * 3.0
    assert abs(side) < 0.1 * forward
    assert trace.counters["convex_finishes"] == 0
