"""The same scene elsewhere, turned, mirrored, re-ordered: the same motion."""

from __future__ import annotations

from functools import cache

import numpy as np

from hexapod_pin.validation.cases.mirror import (
    SampledMotion,
    base_run,
    shifted,
    transformed,
    yawed,
)
from hexapod_pin.validation.solver_setting import SolverSetting

IMPLICIT, RK4, EXTRAPOLATED_EULER = (
    SolverSetting("implicit-euler", 1e-3),
    SolverSetting("rk4", 1e-5),
    SolverSetting("extrapolated-euler", 1e-6),
)
ROBUST = SolverSetting("robust", 1e-3)


@cache
def known(way: SolverSetting) -> SampledMotion:
    return SampledMotion.of(base_run().by(way))


def test_what_does_not_contain_the_place_has_the_same_bits() -> None:
    """Shifted, level ground is the same: heights, attitudes, joints, velocities; x, y to rounding.

    That of x and y is 7e-15 m at 64 m.
    """
    found, here = shifted(base_run(), EXTRAPOLATED_EULER), known(EXTRAPOLATED_EULER)
    assert np.array_equal(found.v, here.v) and np.array_equal(found.q[:, 2:], here.q[:, 2:])
    steps = 100  # at most; each rounds once
    assert np.abs(found.q[:, :2] - here.q[:, :2]).max() < steps * 7.2e-15


def test_transformed_by_methods_that_a_quick_suite_leaves_out() -> None:
    """`implicit-euler` and `extrapolated-euler` are those of HC37, which is run with the others."""
    for value in transformed(ROBUST):
        assert value.error <= value.tolerance, value.what
    assert known(RK4).apart(yawed(base_run(), 2.0, RK4)) < 1e-9
