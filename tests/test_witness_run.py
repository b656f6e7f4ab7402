"""A run between two that are far apart shows that errors fall as tolerances do."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from random_scenes import draw_scene

from hexapod_pin.simulation.accuracy_control import AccuracyControl
from hexapod_pin.simulation.resolution import FINER_SHARE, JUMP, Comparison, next_level
from hexapod_pin.simulation.run_settings import RunSettings
from hexapod_pin.validation.position_error import PositionError

ACCURACY = 1e-4


class ShiftedRun:
    """A run whose trunk is off by an error at its end, or that has diverged."""

    def __init__(self, error: float, level: int) -> None:
        """Take the error over the accuracy; inf: diverged. A level costs as much as it is fine."""
        self.good, self.wall_time, self.follows_error = np.isfinite(error), 0.0, False
        counters = {"evaluations": round(1000 * 10.0 ** (level / 12)), "events": 0}
        self.rollout = SimpleNamespace(counters=lambda: counters, ended_by="", summary=dict)
        self._q = np.zeros((2, 7)) + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        self._q[1, 0] = error * ACCURACY

    def samples(self) -> dict[str, Any]:
        """Return two samples."""
        return {"q": self._q}


def levels_run(errors: dict[int, float]) -> tuple[list[int], AccuracyControl]:
    """Return the levels asked for in a sensitive scene, with errors over the accuracy by level."""
    plain = RunSettings.of(1.0, None, ACCURACY, None, None, None)
    settings = replace(plain, method_settings=replace(plain.method_settings, sensitive=True))
    control, made = AccuracyControl(settings), []
    level: int | None = settings.method_settings.first_levels[0]
    while level is not None:
        made.append(level)
        control.take(level, ShiftedRun(errors[level], level))  # type: ignore[arg-type]
        level = control.next_level()
    return made, control


def test_errors_that_fall_as_tolerances_do_are_confirmed_by_one_run_more() -> None:
    """The finest of the three stays the finest, and its bound what it was."""
    made, control = levels_run({0: 4.0, 4: 0.4, 8: 0.04})
    assert made == [0, 8, 4]
    first, last = control.comparisons
    assert first.needs_witness and not first.kept and last.kept
    assert (last.coarser, last.finer) == (4, 8)
    assert first.error_ratio == pytest.approx(FINER_SHARE[8] * 3.96, rel=1e-12)
    assert control.error_ratio == pytest.approx(first.error_ratio, rel=1e-12)


def test_two_runs_that_are_wrong_by_as_much_are_found_out() -> None:
    """Both have lost the order in which corners hit: apart they are within a bound of the finer."""
    errors = {0: 5.0, 8: 1.9, 4: -3.5, 12: 0.2, 16: 0.02}
    made, control = levels_run(errors)
    assert Comparison(0, 8, errors[0] - errors[8]).error_ratio < 1.0 < errors[8]
    assert made == [0, 8, 4, 12, 16]  # the run between is no finer one without gain
    assert abs(errors[16]) <= control.error_ratio <= 1.0


@pytest.mark.parametrize("difference", [0.99, 1.01])
def test_a_difference_within_the_accuracy_needs_none(difference: float) -> None:
    """Nor do runs of neighbouring levels, whose difference is nearly the bound itself."""
    assert Comparison(0, 8, difference).needs_witness == (difference > 1.0)
    assert not Comparison(0, JUMP, difference).needs_witness
    assert Comparison(0, 8, difference).kept == (difference < 1.0)
    beyond = Comparison(0, 8, 1.01 / FINER_SHARE[8])
    assert not beyond.needs_witness and next_level([beyond]) == 8 + JUMP


def test_one_that_diverges_is_asked_for_once() -> None:
    """A finer run follows instead; beyond the finest level there is none, and nothing is kept."""
    made, control = levels_run({0: 4.0, 8: 0.04, 4: np.inf, 12: 0.004})
    assert made == [0, 8, 4, 12] and control.comparisons[-1].kept
    doubtful = Comparison(0, 8, 4.0)
    assert next_level([doubtful], finest=8, taken=(0, 8)) == 4
    assert next_level([doubtful], finest=8, taken=(0, 8, 4)) is None and not doubtful.kept


def test_a_box_that_settles_on_its_corners_is_within_its_bound() -> None:
    """Coarse and fine, 100 times apart in tolerance, were off by 5.0 and by 3.7 of the accuracy.

    From 0.333 s on the box hits the ground with one corner after the other. Small errors grow there
    27 times by 0.36 s, that of the fine run, 5e-5, even 97 times: another corner comes first.
    """
    drawn, accuracy = draw_scene(2511291010, 139), 1e-3
    reference = drawn.run(method="ndf", accuracy=1e-9)
    assert reference.error_estimate < 0.01 * accuracy
    run = drawn.run(method="extrapolated-euler", accuracy=accuracy)
    error = PositionError.between(run.q, reference.q).q
    assert error <= run.error_estimate <= accuracy
