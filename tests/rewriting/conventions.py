"""Habits in which URDFs of the same robot differ."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

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
