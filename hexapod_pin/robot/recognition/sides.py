"""Legs that are named for one side and stand on the other, and an odd number of them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.directions import (
    FEWEST,
    ROW_FIRST,
    SIDE_FIRST,
    SIDE_ROW,
    plain,
)

WORD = re.compile(r"(?<![a-z])(left|right)(?![a-z])")

EXCHANGED = (
    "left and right legs are exchanged: it lies on its back (turn its root link over), or the "
    "legs' names are wrong"
)
"""Every leg stands on the other side than its name says."""

MIRRORED = 0.05
"""Distance of a hip from the mirror image of that on the other side over the size of the layout,
within which they are alike (*assumed*): 18 public robots have 0 to 0.009."""


def unlike_sides(hips: Array, left: Sequence[bool]) -> str:
    """Return that hips of the left are no mirror images of those of the right; mostly nothing.

    One hip alone is found in the file (`repair.leg_layout`).

    Args:
        hips: about their middle, in trunk axes [m]. Shape (n, 3).
        left: whether a leg stands on the left.
    """
    sides = hips[np.array(left)], hips[~np.array(left)]
    one, other = (side[np.argsort(-side[:, 0])] for side in sides)
    if len(one) != len(other):
        return ""
    off = one - other * (1.0, -1.0, 1.0)
    off[:, 1] -= off[:, 1].mean()
    far = np.linalg.norm(off, axis=1)
    size = float(np.sqrt((hips**2).sum(axis=1).mean()))
    if np.sum(far > MIRRORED * size) < FEWEST_OFF:
        return ""
    return (
        f"left and right legs differ: hips of the left are up to {1e3 * far.max():.3g} mm from the "
        "mirror images of those of the right"
    )


FEWEST_OFF = 2
"""Pairs of hips that are no mirror images from which sides differ."""


def side_doubt(names: Sequence[Sequence[str]], left: Sequence[bool], front_known: bool) -> str:
    """Return that legs stand on the other side than their names say, or are odd; mostly nothing.

    Args:
        names: of the joints and links of each leg.
        left: whether a leg stands on the left.
        front_known: whether names tell the front: else all sides may be the other way round.
    """
    sides = [_side(limb) for limb in names]
    known = [k for k, side in enumerate(sides) if side is not None]
    wrong = [k for k in known if (sides[k] or ("", ""))[0] != ("l" if left[k] else "r")]
    if len(left) % 2:  # one of them stands on either side, or is missing
        return f"it has {len(left)} legs"
    if len(known) < FEWEST or not wrong:
        return ""
    if len(wrong) == len(known):
        return EXCHANGED if front_known else ""
    if 2 * len(wrong) >= len(known):
        return ""
    called = ", ".join((sides[k] or ("", ""))[1] for k in wrong)
    one = len(wrong) == 1
    return f"leg{'' if one else 's'} {called} stand{'s' if one else ''} on the other side"


def _side(limb: Sequence[str]) -> tuple[str, str] | None:
    """Return the side, l or r, that a limb's names say, and the name; None where they disagree."""
    found = [side for name in limb if (side := _read(plain(name)))]
    return found[0] if found and len({side for side, _ in found}) == 1 else None


def _read(name: str) -> tuple[str, str] | None:
    """Read lf, l_2, fl, left."""
    for pattern, group in ((SIDE_FIRST, 1), (ROW_FIRST, 2), (SIDE_ROW, 1), (WORD, 1)):
        if found := pattern.search(name):
            return found[group][0], found[0]
    return None
