"""Other names for links and joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rewriting.parts import RobotParts

SEGMENTS = {"coxa": "c1", "femur": "thigh", "tibia": "tibia"}
LETTERS = "bcdfghjklmnpqrstvwxz"
VOWELS = "aeiou"


def rename(robot: RobotParts, habit: str, rng: np.random.Generator) -> dict[str, str]:
    """Rename links and joints in a habit of `NAMES`; return old -> new joint names."""
    links = {link.name: f"l{k}" for k, link in enumerate(robot.links)}
    joints = {joint.name: f"j{k}" for k, joint in enumerate(robot.joints)}
    if habit == "nonsense":
        names = _names(rng, len(links) + len(joints))
        links = {name: next(names) for name in links}
        joints = {name: next(names) for name in joints}
    elif habit == "numbers":
        links = {name: f"Link_{k + 1}" for name, k in _shuffled(links, rng)}
        joints = {name: f"Joint_{k + 1}" for name, k in _shuffled(joints, rng)}
    elif habit == "phantomx":
        links = {name: _phantomx(name, "") for name in links}
        joints = {name: _phantomx(name, "j_") for name in joints}
    elif habit == "upside down":
        links = {name: f"{name[::-1]}_{k}" for k, name in enumerate(links)}
        joints = {name: f"{name[::-1]}_{k}" for k, name in enumerate(joints)}
    else:
        links, joints = {name: name for name in links}, {name: name for name in joints}
    for link in robot.links:
        link.name = links[link.name]
    for joint in robot.joints:
        joint.name = joints[joint.name]
        joint.parent, joint.child = links[joint.parent], links[joint.child]
    return joints


def _phantomx(name: str, prefix: str) -> str:
    leg, _, rest = name.partition("_")
    if len(leg) != 2 or not rest:
        return name
    segment = rest.removesuffix("_joint")
    return f"{prefix}{SEGMENTS.get(segment, segment)}_{leg}"


def _shuffled(names: dict[str, str], rng: np.random.Generator) -> zip[tuple[str, int]]:
    return zip(names, rng.permutation(len(names)).tolist(), strict=True)


def _names(rng: np.random.Generator, count: int) -> Iterator[str]:
    found: dict[str, None] = {}
    while len(found) < count:
        pairs = [rng.choice(list(LETTERS)) + rng.choice(list(VOWELS)) for _ in range(4)]
        found.setdefault("".join(pairs))
    return iter(found)
