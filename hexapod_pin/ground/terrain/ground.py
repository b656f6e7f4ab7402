"""What every ground can do, whatever its shape."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Protocol

import numpy as np
from pydantic import Field

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import Metres, Radians, Spec

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hexapod_pin.arrays import Array

MAX_FACE_ANGLE_RAD = float(np.radians(60.0)) + 1e-12
"""Largest slope of a face or field [rad]; steeper than that is a wall: use a riser."""

FARTHEST_M = 1e6
"""Largest coordinate of a ground [m]: there double precision resolves 0.1 nm."""

Place = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
"""A coordinate [m]."""

Size = Annotated[float, Field(gt=0.0, le=FARTHEST_M)]
"""A length [m]."""

Height = Annotated[Metres, Field(gt=0.0)]
"""What a leg is to step over, or off [m]."""

Heading = Radians
"""A direction in the horizontal plane, from x to y [rad]."""

CLEARANCE_TOLERANCE_M = 1e-12  # clearance that counts as none [m]


class Surface(Protocol):
    """The geometry of a ground: heights and normals in NumPy, and its native twin."""

    def height_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return z [m] above the places x, y [m], world axes, broadcast together."""

    def normal_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the unit normals (..., 3) out of the ground."""

    def native(self) -> Any:
        """Return the native ground."""


class Ground(Spec):
    """Base of all grounds: parameters in SI units that know their surface."""

    def surface(self) -> Surface:
        """Return the geometry these parameters describe."""
        raise TypeError(f"{type(self).__name__} is abstract")

    def native(self) -> Any:
        """Return the native ground."""
        return self.surface().native()

    def height_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return z [m] of the ground at x, y [m], world axes, broadcast together.

        At a vertical riser it is the height of the side farther along the heading.
        """
        return self.surface().height_at(x, y)

    def normal_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the unit normals (..., 3) of the ground at x, y [m], world axes."""
        return self.surface().normal_at(x, y)

    def clearance(self, points: ArrayLike, radii: ArrayLike = 0.0) -> float:
        """Return the smallest gap [m] between spheres and ground; negative where one penetrates.

        Args:
            points: (N, 3) centres of the spheres [m], world axes.
            radii: (N,) or one for all [m].

        Raises:
            ParameterError: a point or radius is no number up to `FARTHEST_M`, a radius is negative,
                or their shapes do not fit.
        """
        centers, sizes = _spheres(points, radii)
        return _clearance(self.native(), centers, sizes)

    def lift(self, points: ArrayLike, radii: ArrayLike = 0.0) -> float:
        """Return how far up [m] to move all spheres so that the lowest one just touches.

        Arguments and errors as for `clearance`. Negative means down.
        """
        centers, sizes = _spheres(points, radii)
        ground = self.native()

        def gap(up: float) -> float:
            return _clearance(ground, centers + (0.0, 0.0, up), sizes)

        first = -gap(0.0)
        if abs(gap(first)) <= CLEARANCE_TOLERANCE_M:
            return first
        return _bisect(gap, abs(first) + 1.0)


def _spheres(points: ArrayLike, radii: ArrayLike) -> tuple[Array, Array]:
    """Return centres (N, 3) and radii (N,), N at least 1."""
    centers, sizes = np.array(_numbers("points", points), ndmin=2), _numbers("radii", radii)
    if centers.ndim != 2 or centers.shape[1] != 3 or not len(centers):
        raise ParameterError("points", np.shape(points), "of shape (N, 3), N at least 1")
    if sizes.shape not in ((), (len(centers),)):
        raise ParameterError("radii", sizes.shape, f"one number or {len(centers)}")
    _require_within("points", centers, -FARTHEST_M)
    _require_within("radii", sizes, 0.0)
    return centers, np.broadcast_to(sizes, len(centers))


def _numbers(name: str, values: ArrayLike) -> Array:
    """Return values as an array of numbers."""
    try:
        return np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ParameterError(name, values, "an array of numbers [m]") from error


def _require_within(name: str, values: Array, least: float) -> None:
    """Refuse the first value that is not from `least` to `FARTHEST_M` [m]."""
    for place in np.argwhere(~((values >= least) & (values <= FARTHEST_M))):
        where = f"[{', '.join(map(str, place))}]" if len(place) else ""
        allowed = f"from {least:g} to {FARTHEST_M:g} m"
        raise ParameterError(name + where, float(values[tuple(place)]), allowed)


def _clearance(ground: Any, centers: Array, radii: Array) -> float:
    pairs = zip(centers, radii, strict=True)
    return float(min(gap for center, r in pairs for gap, _ in ground.contacts(center, float(r))))


def _bisect(gap: Any, reach: float) -> float:
    """Return the zero of `gap`, which does not fall: ground has nothing hanging over it."""
    low, high = -reach, reach
    while gap(low) > 0.0:
        low *= 2.0
    while gap(high) < 0.0:
        high *= 2.0
    while high - low > CLEARANCE_TOLERANCE_M:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if gap(middle) < 0.0 else (low, middle)
    return high
