"""Habits in which URDFs of the same robot differ, names among them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from rewriting.parts import RobotParts

NAMES = ("as they are", "nonsense", "numbers", "phantomx", "upside down")
FEET = ("at the sphere", "at the knee", "beyond the sphere", "none")
SHAPES = ("primitives", "stl", "stl in mm", "obj", "obj in mm")
UNITS = ("si", "kg mm2", "gram", "millimetre")


@dataclass(frozen=True)
class ConventionSet:
    """How a robot is written; only in SI it can be walked without repairing."""

    yaw: float = 0.0  # of the root link about its z axis [rad]
    y_up: bool = False  # of the root link
    names: str = NAMES[0]
    signs: bool = False  # joint axes turned round at random
    zeros: bool = False  # moved at random inside the limits
    frames: bool = False  # turned, and slid along their joint's axis
    fixed: bool = False  # joints put in, and links split in two
    feet: str = FEET[0]
    shapes: str = SHAPES[0]
    shuffled: bool = False  # links and joints
    units: str = UNITS[0]

    @staticmethod
    def draw(rng: np.random.Generator, *, repair: bool = False) -> ConventionSet:
        """Return a random combination; with `repair` also in units that want repairing."""
        quarter = float(rng.integers(4)) * np.pi / 2.0
        coin = [bool(flip) for flip in rng.random(6) < 0.5]
        return ConventionSet(
            yaw=quarter if coin[0] else float(rng.uniform(-np.pi, np.pi)),
            y_up=bool(rng.random() < 0.25),
            names=str(rng.choice(NAMES)),
            signs=coin[1],
            zeros=coin[2],
            frames=coin[3],
            fixed=coin[4],
            feet=str(rng.choice(FEET)),
            shapes=str(rng.choice(SHAPES)),
            shuffled=coin[5],
            units=str(rng.choice(UNITS)) if repair else UNITS[0],
        )

    @property
    def text(self) -> str:
        """What differs from the plain file, for a report."""
        plain = asdict(ConventionSet())
        return ", ".join(
            f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}"
            for key, value in asdict(self).items()
            if value != plain[key]
        )


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
