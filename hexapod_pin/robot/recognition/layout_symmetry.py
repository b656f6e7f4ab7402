"""The middle planes of a layout of hips: as many legs left as right, one in it of an odd number."""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array

LIKE = 0.05
"""Mirrored hips may miss their partners by this share of the layout's size (*assumed*)."""

ON_LINE = 0.02
"""A hip within this share of the layout's size of the plane is on it (*assumed*)."""


class MiddleLine(NamedTuple):
    """A line through the middle of the hips, seen from above.

    Attributes:
        angle: of the line from the first axis, in [0, pi) [rad].
        miss: root mean square by which mirrored hips miss their partners, over the layout's size.
        length: extent of the hips along it [m].
        width: extent of the hips across it [m].
    """

    angle: float
    miss: float
    length: float
    width: float


def middle_lines(flat: Array) -> list[MiddleLine]:
    """Return the lines that mirror hips onto hips with as many on each side, best first.

    A mirror line at angle t maps the complex place z to exp(2 i t) conj(z). A first guess pairs
    the first hip with each other one; least squares over all pairs then gives
    2 t = arg(sum of z_i z_partner(i)): exact where the layout is symmetric.

    Args:
        flat: hips in the plane across up, about their middle [m]. Shape (L, 2).
    """
    places = [complex(x, y) for x, y in flat]
    size = math.sqrt(sum(abs(z) ** 2 for z in places) / len(places))
    lines: list[MiddleLine] = []
    for partner in places[1 - len(places) % 2 :] if size > 0 else []:
        turn = _unit(places[0] * partner)
        for _ in range(3):
            pairs = _partners(places, turn)
            if pairs is None:
                break
            turn = _unit(sum(z * places[k] for z, k in zip(places, pairs, strict=True)))
        if pairs is None or any(abs(turn - _turn(line.angle)) < 1e-6 for line in lines):
            continue
        line = _line(places, pairs, turn, size)
        if line is not None:
            lines.append(line)
    return sorted(lines, key=lambda line: line.miss)


def is_left(hips: Array) -> list[bool]:
    """Return which hips (L, 3) about their middle, in trunk axes, are left; the middle one is."""
    size = float(np.sqrt((hips[:, :2] ** 2).sum(axis=1).mean()))
    line = -ON_LINE * size if len(hips) % 2 else 0.0
    return [bool(across > line) for across in hips[:, 1]]


def _line(places: list[complex], pairs: list[int], turn: complex, size: float) -> MiddleLine | None:
    """Return one line, None where the hips do not mirror or do not lie on both sides alike."""
    off = [places[k] - turn * z.conjugate() for z, k in zip(places, pairs, strict=True)]
    miss = math.sqrt(sum(abs(z) ** 2 for z in off) / len(off)) / size
    angle = (0.5 * cmath.phase(turn)) % math.pi
    along = np.array([(z * cmath.exp(-1j * angle)).real for z in places])
    across = np.array([(z * cmath.exp(-1j * angle)).imag for z in places])
    sides = (across > ON_LINE * size).sum(), (across < -ON_LINE * size).sum()
    if miss > LIKE or sides[0] != sides[1] or sum(sides) != len(places) // 2 * 2:
        return None
    return MiddleLine(angle, miss, float(np.ptp(along)), float(np.ptp(across)))


def _partners(places: list[complex], turn: complex) -> list[int] | None:
    """Return the nearest hip to each mirrored one; None where they are no pairs."""
    mirrored = [turn * z.conjugate() for z in places]
    pairs = [min(range(len(places)), key=lambda k: abs(places[k] - z)) for z in mirrored]
    on_line = sum(k == i for i, k in enumerate(pairs))
    if any(pairs[k] != i for i, k in enumerate(pairs)) or on_line != len(places) % 2:
        return None
    return pairs


def _unit(z: complex) -> complex:
    """Return the direction of a complex number; 1 of zero."""
    return z / abs(z) if abs(z) > 0 else 1.0 + 0.0j


def _turn(angle: float) -> complex:
    """Return the turn of a mirror line at an angle."""
    return cmath.exp(2j * angle)
