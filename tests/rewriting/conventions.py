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
    """How a robot is written.

    Attributes:
        yaw: of the root link's frame about its z axis [rad].
        y_up: the root link's frame has its y axis up.
        names: one of `NAMES`.
        signs: joint axes turned round at random.
        zeros: zero postures moved at random inside the limits.
        frames: child frames turned, and moved along their joint's axis, at random.
        fixed: fixed joints put in, and links split in two, at random.
        feet: where the foot links' frames are; one of `FEET`.
        shapes: one of `SHAPES`.
        shuffled: links and joints in random order.
        units: one of `UNITS`; only SI can be walked without repairing.
    """

    yaw: float = 0.0
    y_up: bool = False
    names: str = NAMES[0]
    signs: bool = False
    zeros: bool = False
    frames: bool = False
    fixed: bool = False
    feet: str = FEET[0]
    shapes: str = SHAPES[0]
    shuffled: bool = False
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
