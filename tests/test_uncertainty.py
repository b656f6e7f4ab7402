"""Percentiles, shares that pass and Sobol indices, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr
from refusals import refused
from scipy.special import ndtri

import hexapod_pin as hp
from hexapod_pin.study.sweep import SweepStudy
from hexapod_pin.study.uncertainty import clopper_pearson, sobol_indices, uncertainty

NAMES = ("heading", "turn_rate", "scene.gravity.0")


def study(kind: str = "sobol-indices", samples: int = 512, ends: float = math.pi) -> SweepStudy:
    keys = ('input = "heading"', 'input = "turn_rate"', 'path = "scene.gravity.0"')
    vary = "".join(
        f'[[vary]]\n{key}\ndistribution = "uniform"\nlow = {-ends}\nhigh = {ends}\n' for key in keys
    )
    design = f'[design]\nkind = "{kind}"\nsamples = {samples}\nseed = 3\n'
    return SweepStudy.from_toml(
        f'schema = 1\n[base]\nrobot = "kharagpur"\ngait = "tripod"\n{vary}{design}'
    )


def inputs_of(of: SweepStudy) -> np.ndarray:
    return np.array([[of.point(k)[name] for name in NAMES] for k in range(len(of))])


def ishigami(x: np.ndarray) -> np.ndarray:
    """Ishigami and Homma 1990 with a = 7, b = 0.1."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_ishigami() -> None:
    """Indices are the closed form's to 0.03, the largest error of any of twelve seeds.

    The same values give the same bits; a 16th of the samples about four times the width.
    """
    of = study(samples=4096)
    y = ishigami(inputs_of(of))
    found = uncertainty(of, {"y": y}, "y").indices
    assert found is not None
    np.testing.assert_allclose(found.first, [0.3139, 0.4424, 0.0], atol=0.03)
    np.testing.assert_allclose(found.total, [0.5576, 0.4424, 0.2437], atol=0.03)
    for ends, value in ((found.first_interval, (0.3139, 0.4424, 0.0)),
                        (found.total_interval, (0.5576, 0.4424, 0.2437))):  # fmt: skip
        assert (ends[:, 0] <= np.add(value, 0.01)).all()
        assert (ends[:, 1] >= np.subtract(value, 0.01)).all()
    assert found.order == (0, 1, 2)
    few = study(samples=256)
    result = uncertainty(few, {"y": ishigami(inputs_of(few))}, "y", 5.0)
    wide, text = result.indices.total_interval, result.table()
    assert np.array_equal(wide, sobol_indices(ishigami(inputs_of(few)), NAMES).total_interval)
    assert all(
        name in text for name in (*NAMES, "p95", "Sobol indices of passing", result.sentence)
    )
    assert result.to_dict()["indices"]["inputs"] == list(NAMES)
    assert 2.5 < np.ptp(wide, axis=1)[0] / np.ptp(found.total_interval, axis=1)[0] < 6.0


def test_a_linear_model() -> None:
    of = study(samples=256)
    y = inputs_of(of) @ [3.0, 1.0, 0.0]
    found = uncertainty(of, {"y": y}, "y").indices
    assert found is not None
    np.testing.assert_allclose([found.first, found.total], [[0.9, 0.1, 0.0]] * 2, atol=0.01)
    assert found.total_interval[2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert found.text.startswith("heading decides (total index 0.90, ")
    # where intervals overlap, no input is singled out
    of = study(samples=64)
    found = uncertainty(of, {"y": inputs_of(of) @ [1.0, 1.02, 0.1]}, "y").indices
    assert found is not None and set(found.deciding) == {"heading", "turn_rate"}
    assert " or " in found.text and "overlap" in found.text
    still = sobol_indices(np.ones(8 * 4), ("a", "b"), "y")
    assert not still.varies and still.text == "y does not vary: no input decides"


@pytest.mark.parametrize(
    ("passing", "walks", "low", "high"),
    [
        (0, 10, 0.0, 1.0 - 0.025**0.1),  # (1 - p)^n = 0.025
        (1, 2, 1.0 - math.sqrt(0.975), math.sqrt(0.975)),  # at least one; at most one
        (8, 10, 0.44390, 0.97479),  # tables of the exact interval
        (5, 100, 0.01643, 0.11283),
    ],
)
def test_clopper_pearson(passing: int, walks: int, low: float, high: float) -> None:
    """The exact interval, by hand where a binomial tail has one term, else from tables."""
    assert clopper_pearson(passing, walks) == pytest.approx((low, high), abs=6e-6)
    for bad in ((1, 0, 0.9), (3, 2, 0.9), (1, 2, 1.0)):
        with pytest.raises(hp.errors.ParameterError):
            clopper_pearson(*bad)


def test_percentiles_of_a_normal() -> None:
    of = study("sobol", 4096, ends=1.0)
    z = ndtri(0.5 * (1.0 + inputs_of(of)[:, 1]))
    found = uncertainty(of, {"torque_peak": 3.0 + 0.5 * z}, "torque_peak")
    assert found.unit == "N m"
    wanted = 3.0 + 0.5 * ndtri(np.array([0.05, 0.5, 0.95, 0.99]))
    np.testing.assert_allclose(list(found.percentiles.values()), wanted, atol=0.01)
    assert found.indices is None
    assert found.sentence.startswith("torque_peak 3 N m, 90 % of walks 2.17")


def test_the_share_that_passes() -> None:
    of = study("sobol", 512, ends=1.0)
    x = inputs_of(of)[:, 0]
    found = uncertainty(of, {"use": x}, "use", 0.9)
    assert found.share == pytest.approx(0.95, abs=2 / 512)
    assert found.interval == clopper_pearson(found.passing or 0, 512)
    other = uncertainty(of, {"use": x}, "use", 0.9, at_least=True)
    assert other.passing == 512 - (found.passing or 0)
    assert found.sentence == "passes with 95 % confidence (95 % interval 93 to 97 %, 512 walks)"
    data = xr.Dataset({"use": ("case", x, {"units": "kN"})})  # with its own unit
    own = uncertainty(of, data, "use", 0.5)
    assert own.unit == "kN" and own.percentiles == found.percentiles


def test_cases_that_failed_do_not_pass() -> None:
    """A case without a number fails either sense of a limit; then only passing has indices."""
    of = study(samples=64, ends=1.0)
    x = inputs_of(of)
    y = np.where(x[:, 0] > 0.5, np.nan, x[:, 1])
    for at_least, limit in ((False, 2.0), (True, -2.0)):
        found = uncertainty(of, {"y": y}, "y", limit, at_least=at_least)
        assert (found.walks, found.failed, found.passing) == (128, np.isnan(y[:128]).sum(), 96)
        assert found.indices is None and found.pass_indices is not None
        np.testing.assert_allclose(found.pass_indices.total, [1.0, 0.0, 0.0], atol=0.05)
        assert found.sentence == (
            "passes with 75 % confidence (95 % interval 67 to 82 %, 128 walks); "
            f"32 of them failed or fell, counted as not passing; {found.pass_indices.text}"
        )
    # the interval of all passing ends below 100 %; the input that moves the quantity is named
    found = uncertainty(of, {"y": inputs_of(of) @ [0.0, 2.0, 0.1]}, "y", 9.0)
    assert found.sentence.startswith(
        "passes with 100 % confidence (95 % interval 97 to 100 %, 128 walks); turn rate decides y"
    )
    none = uncertainty(of, {"y": np.full(len(of), np.nan)}, "y", 9.0)
    assert none.passing == 0 and np.isnan(list(none.percentiles.values())).all()
    assert "128 of them failed" in none.sentence
    random, y = study("random", 5000, ends=1.0), np.zeros(5000)
    y[7] = 2.0  # a share never rounds to certainty
    assert uncertainty(random, {"y": y}, "y", 1.0).sentence.startswith("passes with 99.98 %")


def test_wrong_values() -> None:
    of = study("sobol", 8)
    y = np.zeros(8)
    with refused(hp.errors.ParameterError, "quantity", "z"):
        uncertainty(of, {"y": y}, "z")
    with refused(hp.errors.ParameterError, "values['y']", allowed=(8,), about=("(8, 3)",)):
        uncertainty(of, {"y": np.zeros((8, 3))}, "y")
    with refused(hp.errors.ParameterError, "uncertainty.limit", math.nan):
        uncertainty(of, {"y": y}, "y", math.nan)
    with refused(hp.errors.ParameterError, "grid_point", 2, allowed=(0,)):
        uncertainty(of, {"y": y}, "y", grid_point=2)
    base = 'schema = 1\n[base]\nrobot = "kharagpur"\n'
    plain = SweepStudy.from_toml(f'{base}[[vary]]\ninput = "stroke"\nvalues = [0.1]\n')
    with refused(hp.errors.ParameterError, "study", f"{plain.name!r}, a grid"):
        uncertainty(plain, {"y": np.zeros(1)}, "y")
    for rows, about in ((np.zeros(30), "(30,)"), (np.full(32, math.nan), "32")):
        with refused(hp.errors.ParameterError, "values", about=(about,)):
            sobol_indices(rows, ("a", "b"))
