"""What was found in a URDF beyond its text: directions, legs, feet, joints that are held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hexapod_pin.arrays import Array


@dataclass(frozen=True, eq=False)
class LegLayout:
    """One leg as it is found.

    Attributes:
        name: of the leg: lf, lm, lr, rf, rm, rr where there are six.
        joints: the joints that walk, from the trunk outwards. Two or three.
        held: other moved joints between the trunk and the foot: they keep an angle.
        tip_link: the link that carries the foot.
        foot: name of the foot link; a new one where no link of the file is the foot.
        centre: centre of the foot sphere in the frame of `tip_link` [m]. Shape (3,).
        radius: of that sphere [m]; 0 is a point.
    """

    name: str
    joints: tuple[str, ...]
    held: tuple[str, ...]
    tip_link: str
    foot: str
    centre: Array
    radius: float


@dataclass(frozen=True, eq=False)
class RobotLayout:
    """The robot in a URDF.

    Attributes:
        turn: the trunk's axes in the frame of the root link: columns forward, left, up. (3, 3).
        legs: in the order of `leg_names`.
        held: every moved joint that does not walk (head, arm, surplus leg joint, foot spring) with
            the place where it is held [rad or m].
        posture: standing angle of every joint that walks [rad].
        inferred: what was inferred and from what, a sentence each; empty where the file says all.
    """

    turn: Array
    legs: tuple[LegLayout, ...]
    held: Mapping[str, float] = field(default_factory=dict)
    posture: Mapping[str, float] = field(default_factory=dict)
    inferred: tuple[str, ...] = ()
