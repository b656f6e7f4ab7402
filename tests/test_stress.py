"""The stress set, shortened: random extreme scenes stay finite and gain no energy."""

from __future__ import annotations

import pytest

from hexapod_pin.validation.stress import ALLOWED_GAIN, STEPS, run_stress, stress_scenes

INJECTION = 1e-6
"""Energy the contact solve may make, of a run's energy scale."""


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("friction", ["usual", "falling"])
def test_stress_scenes_stay_finite_and_gain_nothing(step: float, friction: str) -> None:
    scenes = list(stress_scenes(20, seed=0, friction=friction))
    for outcome in run_stress(scenes, step):
        assert outcome.passed, outcome
        assert outcome.rise < ALLOWED_GAIN, outcome
        assert outcome.injection < INJECTION, outcome
