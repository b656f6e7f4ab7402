"""Set-points between knots by SciPy's interpolants; written apart from the native core."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BPoly, CubicHermiteSpline, PPoly

from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import JointTrajectory

Curve = Callable[[float], tuple[Array, Array, Array]]
"""Time [s] -> angles [rad], rates [rad/s] and accelerations [rad/s^2], (n,) each."""


def knots_within(plan: JointTrajectory, end: float) -> list[float]:
    """Return the knots after 0 and before the end [s]: where a derivative jumps."""
    return [float(t) for t in plan.time if 0.0 < t < end]


def curve_between(plan: JointTrajectory, begin: float, end: float) -> Curve:
    """Return the set-points of an interval without a knot inside, valid beyond its ends too."""
    middle = 0.5 * (begin + end)
    k = max(int(np.searchsorted(plan.time, middle)) - 1, 0)
    if k + 1 == len(plan.time):
        rate = np.zeros_like(plan.v[k]) if plan.kind in ("cubic", "quintic") else plan.v[k]
        return _constant(plan.q[k], rate)
    if plan.kind == "held":
        return _constant(plan.q[k], plan.v[k])
    t0, t1 = float(plan.time[k]), float(plan.time[k + 1])
    if plan.kind == "linear":
        return _line(t0, t1, plan.q[k], plan.q[k + 1], plan.v[k])
    if plan.kind == "cubic":
        spline = CubicHermiteSpline([t0, t1], plan.q[k : k + 2], plan.v[k : k + 2])
    else:
        assert plan.acceleration is not None
        ends = np.stack([plan.q[k : k + 2], plan.v[k : k + 2], plan.acceleration[k]], axis=1)
        spline = PPoly.from_bernstein_basis(BPoly.from_derivatives([t0, t1], ends))
    return _polynomials(t0, [one.c[:, 0] for one in (spline, *map(spline.derivative, (1, 2)))])


def _polynomials(t0: float, each: list[Array]) -> Curve:
    """Return polynomials in t - t0, highest powers first; SciPy's own calls cost ten times that."""
    powers = [np.arange(len(one))[::-1] for one in each]

    def at(t: float) -> tuple[Array, Array, Array]:
        angle, rate, acceleration = (
            (t - t0) ** power @ one for power, one in zip(powers, each, strict=True)
        )
        return angle, rate, acceleration

    return at


def _constant(angle: Array, rate: Array) -> Curve:
    return lambda _: (angle, rate, np.zeros_like(angle))


def _line(t0: float, t1: float, start: Array, end: Array, rate: Array) -> Curve:
    way = (end - start) / (t1 - t0)
    return lambda t: (start + (t - t0) * way, rate, np.zeros_like(way))
