"""Which leg and which segment a joint's name means, in the naming habits of known hexapods."""

from __future__ import annotations

import re
from typing import NamedTuple

LEG_NAMES = ("lf", "lm", "lr", "rf", "rm", "rr")
"""Left and right; front, middle and rear: the order of a robot's legs everywhere."""

_ROWS = {"a": "f", "b": "m", "c": "r", "1": "f", "2": "m", "3": "r"}
_SIX = {str(number): leg for number, leg in enumerate(("lf", "rf", "lm", "rm", "lr", "rr"), 1)}
_SEGMENTS = {
    "coxa": 0, "c1": 0, "femur": 1, "thigh": 1, "tibia": 2,
    "1": 0, "2": 1, "3": 2,
}  # fmt: skip

# Ours and most ROS 2 hexapods: lf_coxa_joint. PhantomX: j_c1_lf, j_thigh_lf, j_tibia_lf.
# OpenSHC: AR_coxa_joint (A front, B middle, C rear). The hard cases: L1_1. S2: leg1_j1.
_OURS = re.compile(r"([lr][fmr])_(coxa|femur|tibia)(?:_joint)?")
_PHANTOMX = re.compile(r"j_(c1|thigh|tibia)_([lr][fmr])")
_OPENSHC = re.compile(r"([abc])([lr])_(coxa|femur|tibia)(?:_joint)?")
_SIDE_ROW = re.compile(r"([lr])([123])_(?:j(?:oint)?_?)?([123])")
_NUMBERED = re.compile(r"leg_?([1-6])_(?:j(?:oint)?_?)?([123])")


class JointRole(NamedTuple):
    """A leg's name and the segment: 0 coxa, 1 femur, 2 tibia."""

    leg: str
    segment: int


def joint_role(name: str) -> JointRole | None:
    """Return leg and segment by a joint's name, None where it follows no known convention.

    `leg1` to `leg6` are read as S2 numbers its legs: odd on the left, front to rear (*assumed*).
    """
    text = name.lower()
    if found := _OURS.fullmatch(text):
        return JointRole(found[1], _SEGMENTS[found[2]])
    if found := _PHANTOMX.fullmatch(text):
        return JointRole(found[2], _SEGMENTS[found[1]])
    if found := _OPENSHC.fullmatch(text):
        return JointRole(found[2] + _ROWS[found[1]], _SEGMENTS[found[3]])
    if found := _SIDE_ROW.fullmatch(text):
        return JointRole(found[1] + _ROWS[found[2]], _SEGMENTS[found[3]])
    if found := _NUMBERED.fullmatch(text):
        return JointRole(_SIX[found[1]], _SEGMENTS[found[2]])
    return None


def leg_of_chain(joints: tuple[str, str, str]) -> str | None:
    """Return the leg that the names of three joints, proximal first, agree on; else None."""
    roles = [joint_role(joint) for joint in joints]
    legs = {role.leg for role in roles if role is not None}
    in_order = [role.segment for role in roles if role is not None] == [0, 1, 2]
    return legs.pop() if in_order and len(legs) == 1 else None


def leg_names(left: int, right: int) -> tuple[str, ...]:
    """Return names of so many legs on the left and right, front to rear: left ones first.

    lf lm lr rf rm rr for three and three, lf lr rf rr for two and two, else l1 l2 ... r1 r2 ...
    """
    rows = {3: ("f", "m", "r"), 2: ("f", "r")}.get(left) if left == right else None
    sides = (("l", left), ("r", right))
    return tuple(
        side + (rows[k] if rows else str(k + 1)) for side, count in sides for k in range(count)
    )
