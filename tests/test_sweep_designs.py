"""Designs fill the unit cube as they should; distributions have the quantiles of closed forms."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from scipy import stats

from hexapod_pin.study.sweep.design import KINDS, Design
from hexapod_pin.study.sweep.distributions import (
    Choice,
    Distribution,
    LogNormal,
    Normal,
    Triangular,
    Uniform,
)

SHARES = np.linspace(0.001, 0.999, 41)


@pytest.mark.parametrize(
    ("ours", "reference"),
    [
        (Uniform(low=0.4, high=0.9), stats.uniform(0.4, 0.5)),
        (Triangular(low=-1.0, mode=0.5, high=2.0), stats.triang(0.5, -1.0, 3.0)),
        (Triangular(low=0.0, mode=0.0, high=2.0), stats.triang(0.0, 0.0, 2.0)),
        (Normal(mean=3.0, deviation=0.5), stats.norm(3.0, 0.5)),
        (Normal(mean=3.0, deviation=0.5, low=2.8, high=4.0), stats.truncnorm(-0.4, 2.0, 3.0, 0.5)),
        (LogNormal(median=2.0, factor=1.5), stats.lognorm(np.log(1.5), scale=2.0)),
    ],
)
def test_quantiles_are_those_of_scipy(ours: Distribution, reference: Any) -> None:
    """Drawn numbers keep 12 digits of the quantiles of SciPy's distribution."""
    np.testing.assert_allclose(ours.draw(SHARES), reference.ppf(SHARES), rtol=1e-10)


def test_a_truncated_lognormal() -> None:
    """Between its ends it keeps the shape of the whole one, in the logarithm."""
    found = LogNormal(median=1.0, factor=2.0, low=0.5, high=4.0)
    z = stats.truncnorm(-1.0, 2.0).ppf(SHARES)
    np.testing.assert_allclose(found.draw(SHARES), 2.0**z, rtol=1e-10)
    assert found.text == "lognormal 1 */ 2, truncated below 0.5 and above 4"
    assert LogNormal(median=1.0, factor=2.0).text == "lognormal 1 */ 2"


def test_ends_of_the_interval_have_values() -> None:
    """Points at 0 and 1, which some designs have, give finite numbers within the ends."""
    ends = np.array([0.0, 1.0])
    assert np.isfinite(np.array(Normal(mean=0.0, deviation=1.0).draw(ends), dtype=float)).all()
    low, high = Uniform(low=1.0 / 3.0, high=2.0 / 3.0).draw(ends)
    assert 1.0 / 3.0 <= float(low) < float(high) <= 2.0 / 3.0


def test_a_choice_takes_each_as_often() -> None:
    found = Choice(values=("wave", "tripod", "ripple")).draw((np.arange(300) + 0.5) / 300)
    assert {name: found.count(name) for name in set(found)} == dict.fromkeys(
        ("wave", "tripod", "ripple"), 100
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_repeats_a_design(kind: str) -> None:
    """The same seed gives the same bits, another one other points; all lie in the cube."""
    cubes = [Design(kind=kind, samples=16, seed=seed).cube(3) for seed in (5, 5, 6)]
    assert np.array_equal(cubes[0], cubes[1])
    assert not np.array_equal(cubes[0], cubes[2])
    rows = 16 * (3 + 2) if kind == "sobol-indices" else 16
    assert cubes[0].shape == (rows, 3) == (Design(kind=kind, samples=16).rows(3), 3)
    assert (cubes[0] >= 0.0).all() and (cubes[0] <= 1.0).all()


@pytest.mark.parametrize("kind", ["sobol", "latin-hypercube"])
def test_each_sixteenth_holds_one_point(kind: str) -> None:
    """Both designs have one point in each of n equal parts of every axis."""
    cube = Design(kind=kind, samples=16, seed=2).cube(4)
    for column in cube.T:
        assert sorted(np.floor(16 * column).astype(int)) == list(range(16))


def test_quasi_random_means_are_closer() -> None:
    """The mean of a smooth function: Sobol's and Halton's points beat random ones by far."""

    def error(kind: str) -> float:
        cubes = [Design(kind=kind, samples=256, seed=k).cube(3) for k in range(8)]
        return float(np.sqrt(np.mean([(np.prod(c, axis=1).mean() - 0.125) ** 2 for c in cubes])))

    assert max(error("sobol"), error("halton")) < 0.2 * error("random")


WITHOUT_FILES = """
import resource, sys
import scipy.stats.qmc
from hexapod_pin.errors import ResourceError
from hexapod_pin.study.sweep.design import Design
Design(kind="random", samples=4).cube(2)  # loads what all kinds use
resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))
for kind in "sobol", "sobol-indices":
    try:
        Design(kind=kind, samples=4).cube(2)
    except ResourceError as error:
        print(error)
"""


def test_an_unreadable_table_of_directions_is_an_error() -> None:
    """SciPy continues without the table and draws the same point again and again."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_FILES], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    errors = done.stdout.splitlines()
    assert len(errors) == 2
    for text in errors:
        assert text.startswith("SciPy's table of Sobol's directions: it cannot be read")
        assert "Too many open files" in text and "ulimit -n" in text


def test_saltelli_matrices() -> None:
    """AB_i is A but for column i, which is that of B; A and B share no point."""
    n, d = 8, 3
    blocks = Design(kind="sobol-indices", samples=n, seed=1).cube(d).reshape(d + 2, n, d)
    a, b, mixed = blocks[0], blocks[1], blocks[2:]
    assert not (a == b).any()
    for i in range(d):
        others = [k for k in range(d) if k != i]
        assert np.array_equal(mixed[i][:, others], a[:, others])
        assert np.array_equal(mixed[i][:, i], b[:, i])
