"""Stances of all legs are cut into short pieces, with polynomials through Chebyshev points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import COINCIDENT, Footholds, PlanarMotion

SHORTEST_PIECE_CYCLES = 1e-7
"""Marks closer than this are one mark [cycles]."""

LONGEST_PIECE_CYCLES = 0.5
"""A stance is parted into pieces no longer than this [cycles]."""


@dataclass(frozen=True, eq=False)
class Stances:
    """Pieces of the stances of L legs, P for each leg, in the order of time.

    A foot that is placed where it stood has not left the ground: that is one stance. Legs with
    fewer pieces end with pieces of no duration.

    Attributes:
        marks: ascending times that part each leg's motion; the last of each leg may repeat [s].
        down: whether a leg stands between a mark and the next, else it swings. (L, M - 1).
        begin: of the pieces of stances [s]. Shape (L, P).
        length: [s]. Shape (L, P).
        foothold: where the foot stands in the world [m]. Shape (L, P, 3).
        anchor: the piece that begins when the foot is over its foothold. Shape (L, P).
    """

    marks: tuple[Array, ...]
    down: tuple[NDArray[np.bool_], ...]
    begin: Array
    length: Array
    foothold: Array
    anchor: NDArray[np.intp]


def stances(footholds: Footholds, body: PlanarMotion, until: float, longest: float) -> Stances:
    """Return the stances of a walk from its start to those at some time, and the next.

    Args:
        footholds: where the feet stand.
        body: the planned motion of the base.
        until: [s].
        longest: largest length of a piece [s].
    """
    gait = footholds.gait
    placement = np.arange(-1.0, int(until / gait.cycle_time) + 2.0)
    count = len(gait.phases)
    table = np.tile(placement[:, None], (1, count))
    place, middle = footholds.at(table), footholds.middle(table)
    moves = np.linalg.norm(np.diff(place, axis=0), axis=-1) > COINCIDENT
    placed = (table + np.array(gait.phases)) * gait.cycle_time
    legs = []
    for leg in range(count):
        first = np.flatnonzero(np.append(True, moves[:, leg]))
        last = np.append(first[1:], len(placement)) - 1
        begin = placed[first, leg]
        end = placed[last, leg] + gait.duty * gait.cycle_time
        legs.append(_leg_pieces(begin, end, middle[first, leg], place[first, leg], body, longest))
    return _stacked(legs)


_Leg = tuple[Array, NDArray[np.bool_], Array, NDArray[np.intp]]


def _leg_pieces(
    begin: Array, end: Array, middle: Array, place: Array, body: PlanarMotion, longest: float
) -> _Leg:
    """Return one leg's marks, which intervals are stances, their footholds and anchors.

    Args:
        begin: of each stance [s]. Shape (S,).
        end: [s]. Shape (S,).
        middle: when the foot is over its foothold [s]. Shape (S,).
        place: the footholds [m]. Shape (S, 3).
        body: the planned motion of the base.
        longest: largest length of a piece [s].
    """
    closest = SHORTEST_PIECE_CYCLES * body.gait.cycle_time
    main = np.sort(np.concatenate([begin, middle, end]))
    main = main[np.diff(main, prepend=-np.inf) > closest]
    kinks = body.kinks[(body.kinks > main[0]) & (body.kinks < main[-1])]
    kinks = kinks[np.abs(kinks[:, None] - main).min(axis=1, initial=np.inf) > closest]
    kinks = kinks[end[np.searchsorted(begin, kinks) - 1] > kinks]
    main = np.sort(np.concatenate([main, kinks]))
    stance = np.searchsorted(begin - closest, main[:-1], side="right") - 1
    down = main[:-1] < end[stance] - closest
    pieces = np.where(down, np.ceil(np.diff(main) / longest - 1e-9), 1.0).astype(int)
    part = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    marks = np.repeat(main[:-1], pieces) + part * np.repeat(np.diff(main) / pieces, pieces)
    stance, down = np.repeat(stance, pieces), np.repeat(down, pieces)
    over = np.searchsorted(marks + closest, middle[stance[down]])
    anchor = np.append(0, np.cumsum(down))[over]
    return np.append(marks, main[-1]), down, place[stance[down]], anchor


def _stacked(legs: list[_Leg]) -> Stances:
    """Stack what `_leg_pieces` returns of each leg, the shorter ones filled up at the end."""
    count = max(int(down.sum()) for _, down, _, _ in legs)
    rows = []
    for marks, down, place, anchor in legs:
        fill = np.minimum(np.arange(count), len(place) - 1)
        empty = np.arange(count) >= len(place)
        begin = np.where(empty, marks[-1], marks[:-1][down][fill])
        length = np.where(empty, 0.0, np.diff(marks)[down][fill])
        rows.append((begin, length, place[fill], anchor[fill]))
    begin, length, foothold, anchor = (np.stack(column) for column in zip(*rows, strict=True))
    return Stances(
        marks=tuple(leg[0] for leg in legs),
        down=tuple(leg[1] for leg in legs),
        begin=begin,
        length=length,
        foothold=foothold,
        anchor=anchor,
    )


# Polynomials on -1 <= s <= 1 through Chebyshev points: integrals, derivatives at a point.

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


@cache
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
