"""Values given for all joints, by kind of joint, by name or one by one, as one per joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.robot import Robot

JOINT_KINDS = ("coxa", "femur", "tibia")
"""Kinds of the joints of a leg, from the trunk outwards; a leg of two joints has the first two."""

HELD, SLIDE = "held", "slide"
"""Kinds of joints that no leg walks with: those that turn, and those that slide."""

Value = TypeVar("Value")


def joint_kinds(robot: Robot) -> dict[str, str]:
    """Return the kind of every joint of a leg, and of every held joint, by the joint's name."""
    pairs = (zip(leg.joints, JOINT_KINDS, strict=False) for leg in robot.legs)
    kinds = {joint: kind for leg in pairs for joint, kind in leg}
    turning = dict(zip(robot.joint_names, robot.turning.tolist(), strict=True))
    return kinds | {name: HELD if turning[name] else SLIDE for name in robot.held}


def values_by_joint(robot: Robot, what: str, given: Mapping[str, Value]) -> dict[str, Value]:
    """Return joint name -> value, a joint's own name before its kind; joints may be left out.

    Raises:
        ParameterError: a key that is neither a joint nor a kind of joint of this robot.
    """
    kinds = joint_kinds(robot)
    known = {*robot.joint_names, *kinds.values(), *((HELD, SLIDE) if robot.legs else ())}
    for key in given:
        if key not in known:
            allowed = f"a joint of {robot.name} or one of {', '.join(_kinds_text(kinds))}"
            raise ParameterError(f"key of {what}", key, allowed)
    keys = {name: (name if name in given else kinds.get(name, "")) for name in robot.joint_names}
    return {name: given[key] for name, key in keys.items() if key in given}


def _kinds_text(kinds: Mapping[str, str]) -> tuple[str, ...]:
    """Return the kinds of a robot's joints; those of three-joint legs where it has no legs."""
    return tuple(dict.fromkeys(kinds.values())) or JOINT_KINDS


def numbers_by_joint(
    robot: Robot, what: str, given: float | Mapping[str, float] | Sequence[float]
) -> Array:
    """Return one number per joint (n,) in the robot's order.

    Raises:
        ParameterError: a wrong count, an unknown key, or a joint that is given no number.
    """
    names = robot.joint_names
    if isinstance(given, Mapping):
        found = values_by_joint(robot, what, given)
        for name in names:
            if name not in found:
                kinds = ", ".join(_kinds_text(joint_kinds(robot)))
                hint = f"Add its name or its kind ({kinds})."
                raise ParameterError(f"{what} of joint {name}", None, "given", hint)
        return np.array([found[name] for name in names], dtype=float)
    if isinstance(given, Sequence):
        if len(given) != len(names):
            last = names[min(len(given), len(names) - 1)] if names else "none"
            allowed = f"{len(names)} numbers, one per joint of {robot.name} (up to joint {last})"
            raise ParameterError(what, tuple(given), allowed)
        return np.array(given, dtype=float)
    return np.full(len(names), float(given))
