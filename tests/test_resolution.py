"""How fine the next run is, and what two or more runs bound: levels, comparisons, their control."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.simulation.accuracy_control import AccuracyControl
from hexapod_pin.simulation.resolution import (
    CHANCE,
    FINER_SHARE,
    JUMP,
    Comparison,
    finer_share,
    next_level,
)
from hexapod_pin.simulation.run_settings import RunSettings


def test_a_finer_run_follows_until_its_bound_is_within() -> None:
    good, bad = (Comparison(0, 4, x / FINER_SHARE[4]) for x in (0.99, 1.01))
    assert good.kept and next_level([good]) is None
    assert good.error_ratio == pytest.approx(0.99, rel=1e-12)
    assert not bad.kept and next_level([bad]) == 4 + JUMP == 8
    assert next_level([Comparison(0, 4, 1e4)]) == 8
    assert next_level([bad], finest=7) is None
    assert [finer_share(k) for k in (1, 7, 40)] == [FINER_SHARE[4], FINER_SHARE[6], FINER_SHARE[8]]


@pytest.mark.parametrize("decay", [0.5, 0.68, 0.7, 0.85])
@pytest.mark.parametrize("levels", [4, 8])
def test_bounds_follow_how_fast_three_runs_show_errors_to_fall(decay: float, levels: int) -> None:
    """Errors 3 r^n: the bound holds; it is sharper where r is regular, and wider where slower."""
    errors = [3.0 * decay**n for n in (0, 4, 4 + levels)]
    first = Comparison(0, 4, errors[0] - errors[1])
    last = Comparison(4, 4 + levels, errors[1] - errors[2]).after(first)
    if levels == 4:
        assert last.decay == pytest.approx(decay, rel=1e-12)
    assert last.error_ratio >= errors[2]
    usual = Comparison(4, 4 + levels, last.difference).error_ratio
    if levels == 4:
        assert (last.error_ratio > usual) == (decay >= 0.7)
    assert last.error_fraction * last.difference == last.error_ratio


def test_runs_that_agree_far_better_than_tolerances_are_confirmed() -> None:
    """Two of three runs may have missed the same event: a fourth decides, once."""
    first = Comparison(0, 4, 50.0)
    usual, chance = (Comparison(4, 8, 50.0 * 0.1 * x).after(first) for x in (0.1, 0.99 * CHANCE))
    assert usual.kept and chance.by_chance and not chance.kept and next_level([first, chance]) == 12
    confirmed = Comparison(8, 12, 1e-6).after(chance)
    assert confirmed.kept and not confirmed.by_chance
    contradicted = Comparison(8, 12, 50.0).after(chance)
    assert not contradicted.kept and next_level([first, chance, contradicted]) == 16


def test_a_difference_that_grows_or_has_no_gain() -> None:
    """Bounds widen by a finite factor; a motion that amplifies errors is not run finer for ever."""
    hardly_finer = Comparison(0, 4, 1.0 - 1.2**-3, effort=1.2, order=3)
    assert hardly_finer.error_ratio == pytest.approx(1.2**-3, rel=1e-12)  # errors of order 3
    assert Comparison(0, 4, 0.0, effort=1.0, order=3).kept  # a robot at rest
    grown = Comparison(4, 8, 2.0).after(Comparison(0, 4, 1.0))
    assert 10.0 < grown.error_ratio / Comparison(4, 8, 2.0).error_ratio < 100.0
    assert Comparison(4, 8, 2.0).after(Comparison(0, 4, 0.0)) == Comparison(4, 8, 2.0)
    assert Comparison(0, 4, 0.0).after(None).kept
    flat = [Comparison(4 * k, 4 * k + 4, 50.0) for k in range(3)]
    assert next_level(flat[:1]) == 8 and next_level(flat[:2]) == 12
    assert next_level(flat) is None
    # less than half over four levels is no gain; once it is one, the count begins anew
    slow = [Comparison(4 * k, 4 * k + 4, x) for k, x in enumerate((5e4, 3e4, 1e4, 6e3))]
    assert next_level(slow[:2]) == 12 and next_level(slow) == 20


def test_a_motion_that_amplifies_errors_needs_two_comparisons_within_the_accuracy() -> None:
    first = Comparison(0, 4, 0.1, amplifies=True)
    assert not first.kept and next_level([first]) == 8
    assert Comparison(4, 8, 0.03, amplifies=True).after(first).kept
    assert Comparison(4, 8, 0.1).after(Comparison(0, 4, 2.0)).kept  # the finer one knows its error
    beyond = Comparison(4, 8, 0.5, amplifies=True).after(Comparison(0, 4, 2.0))
    assert not beyond.kept and Comparison(8, 12, 0.1, amplifies=True).after(beyond).kept


def test_a_finer_run_that_finds_far_more_events_is_not_accepted() -> None:
    """However near they are; the next run decides, be it as far apart."""
    found = Comparison(0, 8, 0.01, events=(5, 99))
    assert found.finds_more and not found.kept
    assert next_level([found]) == 12
    assert next_level([found], finest=8) is None
    resolved = Comparison(8, 12, 40.0, events=(99, 150)).after(found)
    assert resolved.decay == Comparison(0, 8, 0.01).decay  # the first does not show it
    assert next_level([found, resolved]) == 16  # no stall either
    for events in ((0, 10), (5, 20), (100, 210), (99, 5)):
        assert Comparison(0, 8, 0.01, events=events).kept, events


class StubRun:
    """A run whose trunk is off by an error at its end, and what it knows of that."""

    wall_time, omitted = 0.0, ()

    def __init__(self, error: float, level: int, known: float | None) -> None:
        """Take what the run is off by, its level, and what it has carried along."""
        self.good, self.follows_error = np.isfinite(error), known is not None
        self.known = known
        counters = {"evaluations": round(1000 * 10.0 ** (level / 12)), "events": 0}
        self.rollout = SimpleNamespace(
            counters=lambda: counters, ended_by="", summary=dict, half_summaries=lambda: ({}, {})
        )
        self.settings = RunSettings.of(1.0, "ndf", 1e-4, None, None, None)
        self._q = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]] * 2)
        self._q[1, 0] = error * 1e-4

    def samples(self) -> dict[str, Any]:
        return {"q": self._q}

    def carried_error(self) -> dict[str, Any]:
        return {name: np.array([0.0, self.known * 1e-4]) for name in ("place", "turn", "joint")}

    def require_good_so_far(self) -> None:
        raise hp.errors.DivergenceError("diverged", None)


def control_of(
    errors: dict[int, float], *, sensitive: bool = False, known: dict[int, float] | None = None
) -> AccuracyControl:
    settings = RunSettings.of(1.0, "ndf" if known else None, 1e-4, None, None, None)
    choice = replace(settings.method_settings, sensitive=sensitive)
    if known:
        choice = choice.for_scene(hp.Scene(hp.load_robot("kharagpur")))
    control = AccuracyControl(replace(settings, method_settings=choice))
    level: int | None = choice.first_levels[0]
    while level is not None:
        knows = None if known is None else known.get(level, 0.0)
        control.take(level, StubRun(errors.get(level, 0.0), level, knows))  # type: ignore[arg-type]
        level = control.next_level()
    return control


def test_a_run_that_knows_enough_is_the_last() -> None:
    """Four times what was carried along is within the accuracy at 0.24 of it, not at 0.26."""
    assert not control_of({0: 0.1}, known={0: 0.24}).comparisons
    assert control_of({0: 0.1}, known={0: 0.26}).comparisons[0].finer == 4


def test_runs_that_contradict_what_they_know_are_compared() -> None:
    """Two that differ by more than both know are not believed: their difference is the bound."""
    control = control_of({0: 10.0}, known={0: 0.4, 4: 0.01})
    assert control.comparisons[0].difference == pytest.approx(10.0)
    assert [one.finer for one in control.comparisons][:2] == [4, 8]
    assert control_of({0: 0.5}, known={0: 0.4, 4: 0.01}).comparisons[-1].finer == 4


def test_runs_that_diverge() -> None:
    with pytest.raises(hp.errors.DivergenceError):
        control_of({0: np.inf, 4: np.inf})
    control = control_of({0: 100.0, 4: 0.0, 8: np.inf})
    assert not control.comparisons[-1].kept


def test_two_runs_that_are_wrong_by_as_much_are_found_out() -> None:
    """Both have lost the order in which corners hit: apart they are within a bound of the finer."""
    errors = {0: 5.0, 8: 1.9, 4: -3.5, 12: 0.2, 16: 0.02}
    control = control_of(errors, sensitive=True)
    assert Comparison(0, 8, errors[0] - errors[8]).error_ratio < 1.0 < errors[8]
    found = [(one.coarser, one.finer) for one in control.comparisons]
    assert found == [(0, 8), (4, 8), (8, 12), (12, 16)]  # the run between is none without gain
    assert abs(errors[16]) <= control.error_ratio <= 1.0


def test_a_difference_within_the_accuracy_needs_none() -> None:
    """Nor do runs of neighbouring levels, whose difference is nearly the bound itself."""
    within, without = Comparison(0, 8, 0.99), Comparison(0, 8, 1.01)
    assert within.kept and not within.needs_witness and without.needs_witness and not without.kept
    assert not Comparison(0, JUMP, 1.01).needs_witness
    beyond = Comparison(0, 8, 1.01 / FINER_SHARE[8])
    assert not beyond.needs_witness and next_level([beyond]) == 8 + JUMP


def test_one_that_diverges_is_asked_for_once() -> None:
    """A finer run follows instead; beyond the finest level there is none, and nothing is kept."""
    control = control_of({0: 4.0, 8: 0.04, 4: np.inf, 12: 0.004}, sensitive=True)
    assert control.comparisons[-1].finer == 12 and control.comparisons[-1].kept
    doubtful = Comparison(0, 8, 4.0)
    assert next_level([doubtful], finest=8, taken=(0, 8)) == 4
    assert next_level([doubtful], finest=8, taken=(0, 8, 4)) is None and not doubtful.kept
