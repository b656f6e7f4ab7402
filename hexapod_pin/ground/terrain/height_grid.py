"""Heights on a grid and the smooth surface through them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from hexapod_pin.arrays import Array


@dataclass(frozen=True)
class HeightGrid(Immutable):
    """A C1 surface through grid points: Catmull-Rom splines along x and y.

    It runs out to level within one spacing beyond the grid's edge, and stays level from there.

    Attributes:
        origin: x, y of the first point [m].
        spacing: between points along x and along y [m].
        z: (ny, nx) heights [m]; row j, column i stands at x = x0 + i dx, y = y0 + j dy.
    """

    origin: tuple[float, float]
    spacing: tuple[float, float]
    z: Array

    def height_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return z [m] above x, y [m]."""
        return self._sample(x, y)[0]

    def normal_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Return the unit normals (..., 3)."""
        _, slope_x, slope_y = self._sample(x, y)
        vector = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=-1)
        return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))

    def native(self) -> Any:
        """Return the native ground: the grid with its border repeated once."""
        from hexapod_pin import native as _native

        x0, y0 = (o - d for o, d in zip(self.origin, self.spacing, strict=True))
        bordered = np.ascontiguousarray(np.pad(self.z, 1, mode="edge"))
        return _native.height_field(x0, y0, *self.spacing, bordered)

    def _sample(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array, Array]:
        """Return height and its derivatives to x and y, all of one shape."""
        rows, columns = self.z.shape
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            raise ParameterError("x, y", "not finite", "finite [m]")
        i, wx, dwx = _weights((x - self.origin[0]) / self.spacing[0], columns)
        j, wy, dwy = _weights((y - self.origin[1]) / self.spacing[1], rows)
        around = np.pad(self.z, 3, mode="edge")
        four = np.arange(2, 6)  # the points i - 1 ... i + 2 of the padded grid
        patch = around[(j[..., None] + four)[..., :, None], (i[..., None] + four)[..., None, :]]

        def along(v: Array, u: Array) -> Array:
            return np.asarray(np.einsum("...jk,...j,...k->...", patch, v, u))

        return along(wy, wx), along(wy, dwx) / self.spacing[0], along(dwy, wx) / self.spacing[1]


def _weights(u: Array, count: int) -> tuple[NDArray[np.intp], Array, Array]:
    """Return cell, weights (..., 4) of the four points around `u`, and their derivatives.

    Cubic Hermite segments with slopes from central differences (Catmull & Rom 1974).
    """
    inside = (u > -1.0) & (u < count)
    u = np.clip(u, -1.0, float(count))
    cell = np.minimum(np.floor(u).astype(np.intp), count - 1)
    t = u - cell
    start, end = (1.0 + 2.0 * t) * (1.0 - t) ** 2, t**2 * (3.0 - 2.0 * t)
    leave, arrive = t * (1.0 - t) ** 2, t**2 * (t - 1.0)
    value = _four(start, end, leave, arrive)
    turn = 6.0 * t * (1.0 - t)
    slope = _four(-turn, turn, (1.0 - t) * (1.0 - 3.0 * t), t * (3.0 * t - 2.0))
    return cell, value, slope * inside[..., None]


def _four(start: Array, end: Array, leave: Array, arrive: Array) -> Array:
    """Return the weights of four points from those of two values and two slopes."""
    points = [-0.5 * leave, start - 0.5 * arrive, end + 0.5 * leave, 0.5 * arrive]
    return np.stack(points, axis=-1)
