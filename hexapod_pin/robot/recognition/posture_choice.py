"""How the robot stands: as the user or the file says, else as it is searched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError, UrdfError
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.loading.posture import joint_angles
from hexapod_pin.robot.recognition.feet import FoundFoot
from hexapod_pin.robot.recognition.leg_choice import Legs
from hexapod_pin.robot.recognition.posture_frame import LegFrame, with_joint_at
from hexapod_pin.robot.recognition.posture_search import standing_posture


@dataclass(frozen=True, eq=False)
class Standing:
    """A standing posture: angles of each leg's joints [rad], shape (k,) each, and a reason."""

    angles: tuple[Array, ...]
    reason: str


def stated_posture(
    file: UrdfFile, own: Mapping[str, float], given: Sequence[float] | Mapping[str, float] | None
) -> dict[str, float]:
    """Return the angles [rad] that the file or the user states by joint name, the user's first.

    Args:
        file: the URDF.
        own: what the file states.
        given: by name, or of all moved joints in the order of `joint_order`.

    Raises:
        UnknownNameError: a joint that does not exist.
        StateError: a sequence of another length, or values that are not finite.
    """
    if given is None:
        return dict(own)
    names = joint_order(file)
    if isinstance(given, Mapping):
        joint_angles(names, np.zeros(len(names)), given)
        return {**own, **{name: float(angle) for name, angle in given.items()}}
    angles = joint_angles(names, np.zeros(len(names)), given)
    return dict(zip(names, angles.tolist(), strict=True))


def joint_order(file: UrdfFile) -> list[str]:
    """Return the moved joints in the order of the loaded robot: depth first, siblings by name."""
    order, stack = [], [file.base]
    while stack:
        item = stack.pop()
        below = sorted(file.joints_below[item], key=lambda joint: joint.name, reverse=True)
        stack += [joint.child for joint in below]
        order.append(item)
    carriers = {joint.child: joint for joint in file.joints}
    return [carriers[n].name for n in order if n in carriers and carriers[n].moves]


def stand(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot],
    walking: Sequence[int], turn: Array, stated: Mapping[str, float], trunk_low: float | None,
    before: Standing | None = None,
) -> Standing:  # fmt: skip
    """Return the angles of all legs: the stated ones where they are complete, else searched ones.

    `before` is what was found with other feet: joints that do not walk stay as they are there.

    Raises:
        UrdfError: a walking joint without a range, or no posture on level feet.
    """
    chains = legs.chains
    walk = [chain.joints[k].name for chain in chains for k in walking]
    if set(walk) <= set(stated):
        return Standing(
            tuple(np.array([_place(legs, stated, j) for j in chain.joints]) for chain in chains), ""
        )
    if findings := [text for chain in chains for j in chain.joints if (text := _no_range(j))]:
        raise UrdfError(file.source, findings)
    frames = [
        _frame(legs, k, name, foot, walking, turn, before)
        for k, (name, foot) in enumerate(zip(names, feet, strict=True))
    ]
    try:
        found = standing_posture(frames, trunk_low=trunk_low)
    except ReachError as error:
        raise UrdfError(file.source, [f"no standing posture: {error}"]) from error
    angles = []
    for k, (chain, searched) in enumerate(zip(chains, found.angles, strict=True)):
        held = _held(legs, k, walking, before)
        left = [q for q in range(len(chain.joints)) if q not in held]
        by_place = held | dict(zip(left, searched.tolist(), strict=True))
        given = [stated.get(joint.name, by_place[q]) for q, joint in enumerate(chain.joints)]
        angles.append(np.array(given, dtype=float))
    return Standing(tuple(angles), found.reason)


def _frame(
    legs: Legs, index: int, name: str, foot: FoundFoot, walking: Sequence[int], turn: Array,
    before: Standing | None,
) -> LegFrame:  # fmt: skip
    """Return a leg in trunk axes as the search of a posture takes it."""
    joints = legs.chains[index].joints
    axes = [legs.frames.axes[joint.name] for joint in joints]
    limits = np.array([_limits(joint) for joint in joints])
    frame = LegFrame(
        name, np.array([axis.unit for axis in axes]) @ turn,
        np.array([axis.origin for axis in axes]) @ turn, foot.centre @ turn, foot.radius,
        limits[:, 0], limits[:, 1], tuple(walking), tuple(joint.name for joint in joints),
    )  # fmt: skip
    for k, place in sorted(_held(legs, index, walking, before).items(), reverse=True):
        frame = with_joint_at(frame, k, place - legs.places.get(joints[k].name, 0.0))
    return frame


def _held(
    legs: Legs, index: int, walking: Sequence[int], before: Standing | None
) -> dict[int, float]:
    """Return the joints of a leg whose places are settled before the search [rad]."""
    joints = legs.chains[index].joints
    held = {k: legs.places[j.name] for k, j in enumerate(joints) if j.name in legs.places}
    if before is not None:
        held |= {k: float(before.angles[index][k]) for k in range(len(joints)) if k not in walking}
    return held


def _limits(joint: Joint) -> tuple[float, float]:
    """Return the limits of a joint [rad]."""
    if joint.kind == "continuous":
        return -np.inf, np.inf
    return joint.limit("lower", 0.0), joint.limit("upper", 0.0)


def _no_range(joint: Joint) -> str:
    """Say that a joint's limits leave it no range, if so."""
    lower, upper = joint.limit("lower", 0.0), joint.limit("upper", 0.0)
    if joint.kind == "continuous" or lower < upper:
        return ""
    return (
        f"joint {joint.name!r}: limits {lower:g} to {upper:g} rad leave no range to walk;"
        " correct them, or state how the robot stands with posture=[...]"
    )


def _place(legs: Legs, stated: Mapping[str, float], joint: Joint) -> float:
    """Return a stated angle; of a joint that is not stated its place, else zero [rad]."""
    return float(stated.get(joint.name, legs.places.get(joint.name, 0.0)))
