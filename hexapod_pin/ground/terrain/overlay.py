"""What is put on top of a ground: patches of another material, and shaking."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from hexapod_pin.ground.terrain.ground import FARTHEST_M, Ground, Place, Surface
from hexapod_pin.ground.terrain.height_field import HeightField
from hexapod_pin.ground.terrain.profile import Flat, Groove, Ledge, Ramp, Slope, Stairs
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array

Shape = Annotated[
    Flat | Slope | Stairs | Ramp | Ledge | Groove | HeightField, Field(discriminator="kind")
]


class Patch(Spec):
    """A rectangle of another material, edges included.

    Attributes:
        low: x, y of one corner [m], world axes.
        high: x, y of the opposite corner [m].
        friction: factor on the friction coefficients [-].
        stiffness: factor on the normal law's force [-]. A foot that is dragged across the edge of
            a patch with another stiffness gains or loses the difference in stored energy.
    """

    low: tuple[Place, Place]
    high: tuple[Place, Place]
    friction: NonNegativeFloat = 1.0
    stiffness: PositiveFloat = 1.0

    @model_validator(mode="after")
    def _ordered(self) -> Patch:
        if not (self.low[0] < self.high[0] and self.low[1] < self.high[1]):
            raise ValueError(f"a rectangle: low {self.low} below high {self.high} in x and y")
        return self


class PatchedGround(Ground):
    """A ground with patches; where they overlap, the first counts.

    Attributes:
        ground: what they lie on.
        patches: one or more.
    """

    kind: Literal["patched"] = "patched"
    ground: Shape
    patches: Annotated[tuple[Patch, ...], Field(min_length=1)]

    def surface(self) -> Surface:
        """Return the surface of the ground below."""
        return self.ground.surface()

    def native(self) -> Any:
        """Return the native ground."""
        from hexapod_pin import native as _native

        rows = [(*p.low, *p.high, p.friction, p.stiffness) for p in self.patches]
        return _native.with_patches(self.ground.native(), rows)

    def factors_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return friction and stiffness factors (..., 2) [-] at x, y [m]."""
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        factors = np.ones((*x.shape, 2))
        for p in reversed(self.patches):
            on = (x >= p.low[0]) & (x <= p.high[0]) & (y >= p.low[1]) & (y <= p.high[1])
            factors[on] = (p.friction, p.stiffness)
        return factors


class ShakingGround(Ground):
    """A ground that moves up and down as a whole: z + amplitude sin(2 pi frequency t).

    Heights, normals and clearances are those at t = 0.

    Attributes:
        ground: what is shaken.
        amplitude: [m].
        frequency: [Hz].
    """

    kind: Literal["shaken"] = "shaken"
    ground: Annotated[
        Flat | Slope | Stairs | Ramp | Ledge | Groove | HeightField | PatchedGround,
        Field(discriminator="kind"),
    ] = Flat()
    amplitude: Annotated[float, Field(ge=0.0, le=FARTHEST_M)]
    frequency: PositiveFloat

    def surface(self) -> Surface:
        """Return the surface of the ground below."""
        return self.ground.surface()

    def native(self) -> Any:
        """Return the native ground."""
        from hexapod_pin import native as _native

        return _native.with_shaking(self.ground.native(), self.amplitude, self.frequency)

    def lift_at(self, time: ArrayLike) -> Array:
        """Return how far up the ground is [m] at times [s]."""
        return np.asarray(self.amplitude * np.sin(2.0 * np.pi * self.frequency * np.asarray(time)))
