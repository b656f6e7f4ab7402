"""Polynomials on -1 <= s <= 1 through Chebyshev points: integrals, derivatives at a point."""

from __future__ import annotations

from functools import cache

import numpy as np

from hexapod_pin.arrays import Array

POINTS = 10
"""Chebyshev points of a piece."""


@cache
def points() -> Array:
    """Return the Chebyshev points of the second kind, ascending from -1 to 1. (POINTS,)."""
    return -np.cos(np.pi * np.arange(POINTS) / (POINTS - 1))


@cache
def integral_powers() -> Array:
    """Return what makes powers of s of the integral from -1. Shape (POINTS + 1, POINTS)."""
    powers = np.linalg.inv(np.vander(points(), increasing=True))
    table = np.zeros((POINTS + 1, POINTS))
    table[1:] = powers / np.arange(1, POINTS + 1)[:, None]
    table[0] = -((-1.0) ** np.arange(1, POINTS + 1)) @ table[1:]
    return table


@cache
def integral() -> Array:
    """Return what makes the integral from -1 to each point of point values. (POINTS, POINTS)."""
    return np.vander(points(), POINTS + 1, increasing=True) @ integral_powers()


def derivative_row(order: int, s: float) -> Array:
    """Return the derivatives at s of the powers of s. Shape (1, POINTS + 1)."""
    k = np.arange(POINTS + 1.0)
    factor = np.prod([k - j for j in range(order)], axis=0) if order else np.ones_like(k)
    row: Array = (factor * s ** np.maximum(k - order, 0.0))[None]
    return row


@cache
def quintic() -> Array:
    """Return what makes powers of s of value, slope and second derivative at -1, then at 1."""
    rows = [derivative_row(order, s)[0, :6] for s in (-1.0, 1.0) for order in range(3)]
    return np.linalg.inv(np.array(rows))
