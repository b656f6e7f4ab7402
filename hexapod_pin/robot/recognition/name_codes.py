"""Which legs names put in front and which behind: only this, and only with one voice."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.description.leg_names import joint_role

FEWEST = 4
"""Legs that must agree."""

_SIDE_FIRST = re.compile(r"(?<![a-z])([lr])_?([fmrbh])(?![a-z])")
_ROW_FIRST = re.compile(r"(?<![a-z])([fmrbh])_?([lr])(?![a-z])")
_SIDE_ROW = re.compile(r"(?<![a-z])(l|r|left|right)_?([1-4])(?!\d)")
_WORDS = (("f", ("front", "fore")), ("r", ("rear", "back", "hind")), ("m", ("mid",)))
_ROWS = {"f": 1.0, "m": 0.0, "r": -1.0, "b": -1.0, "h": -1.0}


class FrontByNames(NamedTuple):
    """The front as names tell it: a direction (3,) (no unit vector) and the names that do."""

    direction: Array
    said: str


def front_by_names(names: Sequence[Sequence[str]], hips: Array) -> FrontByNames | None:
    """Return the direction from rear to front that the names of limbs tell, else None.

    Args:
        names: of the joints and links of each limb.
        hips: where the limbs start [m]. Shape (L, 3).
    """
    for read in (_letters, _words, _numbers, _habit):
        if read is _numbers and len(names) % 2:
            continue  # the rows of an odd number of legs do not face each other
        codes = [_one_voice(limb, read) for limb in names]
        rows = np.array([np.nan if code is None else code[0] for code in codes])
        if np.isfinite(rows).sum() < max(FEWEST, len(rows)):
            continue
        front, rear = rows > rows.mean(), rows < rows.mean()
        if not front.any() or not rear.any():
            continue
        direction = hips[front].mean(axis=0) - hips[rear].mean(axis=0)
        if _in_order(hips @ direction, front, rear):
            said = [
                code[1] for code, is_front in zip(codes, front, strict=True) if code and is_front
            ]
            return FrontByNames(direction, ", ".join(dict.fromkeys(said)))
    return None


def plain(name: str) -> str:
    """Return a name in lower case, parts of camelCase set apart."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


_Code = tuple[float, str]


def _one_voice(limb: Sequence[str], read: Callable[[str], _Code | None]) -> _Code | None:
    """Return what the names of one limb say, None where they say nothing or several things."""
    found = [code for name in limb if (code := read(plain(name)))]
    return found[0] if found and len({row for row, _ in found}) == 1 else None


def _letters(name: str) -> _Code | None:
    """Read lf, rm, br, lm1, ..."""
    if found := _SIDE_FIRST.search(name):
        return _ROWS[found[2]], found[0]
    if found := _ROW_FIRST.search(name):
        return _ROWS[found[1]], found[0]
    return None


def _words(name: str) -> _Code | None:
    """Read front, middle, rear, back, hind."""
    for row, words in _WORDS:
        if any(word in name for word in words):
            return _ROWS[row], name
    return None


def _numbers(name: str) -> _Code | None:
    """Read l1, r3, left_2: one is in front."""
    found = _SIDE_ROW.search(name)
    return (-float(found[2]), found[0]) if found else None


def _habit(name: str) -> _Code | None:
    """Read the other habits that `joint_role` knows."""
    role = joint_role(name)
    return (_ROWS[role.leg[1]], role.leg) if role else None


def _in_order(along: Array, front: Array, rear: Array) -> bool:
    """Tell whether all front limbs start before all rear ones."""
    return bool(along[front].min() > along[rear].max())
