"""A height field is uneven ground from an array, a file or a seed, with a smooth surface."""

from __future__ import annotations

import base64
import binascii
import csv
import io
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain.ground import FARTHEST_M, MAX_FACE_ANGLE_RAD, Ground, Place, Size
from hexapod_pin.immutable import Immutable
from hexapod_pin.user_file import read_bytes, reason_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from hexapod_pin.arrays import Array


MAX_GRID_POINTS = 4_000_000
RANDOM_FIELD_WAVES = 32  # of a random field
MIN_POINTS_PER_WAVELENGTH = 10
KEPT_WAVES = 32  # random fields that are remembered, which sweeps scale
MAX_KEPT_POINTS = 50_000  # of each

Lengths = tuple[float, float]


class HeightField(Ground):
    """A C1 surface through heights on a grid; level beyond it.

    Build it with `from_array`, `from_csv`, `from_image` or `random`.

    Attributes:
        origin: x, y of the first point [m].
        spacing: between points along x and along y [m].
        shape: rows (along y) and columns (along x) [-].
        heights: the rows one after the other, little-endian float64 in base64 [m]: exact in TOML.
    """

    kind: Literal["height-field"] = "height-field"
    origin: tuple[Place, Place]
    spacing: tuple[Size, Size]
    shape: tuple[Annotated[int, Field(ge=2)], Annotated[int, Field(ge=2)]]
    heights: str = Field(repr=False)

    @model_validator(mode="after")
    def _usable(self) -> HeightField:
        _require_grid(self.z, self.spacing)
        return self

    @property
    def z(self) -> Array:
        """(ny, nx) heights [m], read-only; [j, i] stands at x0 + i dx, y0 + j dy.

        Raises:
            ParameterError: `heights` is not base64 of as many numbers as `shape` has.
        """
        allowed = f"base64 of {self.shape[0]} x {self.shape[1]} float64"
        try:
            values = np.frombuffer(base64.b64decode(self.heights, validate=True), dtype="<f8")
            return values.reshape(self.shape)
        except (binascii.Error, ValueError) as error:
            raise ParameterError("HeightField.heights", self.heights[:20], allowed) from error

    def surface(self) -> HeightGrid:
        """Return the surface."""
        return HeightGrid(self.origin, self.spacing, self.z)

    @classmethod
    @checked(but="z")
    def from_array(
        cls, z: ArrayLike, spacing: float | Lengths, origin: Lengths | None = None
    ) -> HeightField:
        """Build from heights.

        Args:
            z: (ny, nx) [m]; row j, column i stands at x0 + i dx, y0 + j dy.
            spacing: between points [m]; one number, or along x and along y.
            origin: x, y [m] of z[0, 0]; None puts the middle of the field at the world's origin.

        Raises:
            ParameterError: not a rectangle of at least 2 x 2 finite numbers, or steeper than 60
                degrees between neighbours.
        """
        grid, steps = _rectangle(z), _pair("HeightField.spacing", spacing)
        if origin is None:
            _require_grid(grid, steps)
            rows, columns = grid.shape
            origin = (-0.5 * (columns - 1) * steps[0], -0.5 * (rows - 1) * steps[1])
        text = base64.b64encode(np.ascontiguousarray(grid, dtype="<f8").tobytes()).decode()
        return cls(origin=origin, spacing=steps, shape=grid.shape, heights=text)

    @classmethod
    def from_csv(
        cls, path: str | Path, spacing: float | Lengths, origin: Lengths | None = None
    ) -> HeightField:
        """Build from a text file of comma-separated heights [m], a row of the array a line.

        The first line is at the smallest y. Other arguments as for `from_array`.

        Raises:
            ParameterError: the file cannot be read, or has a cell that is not a finite number (the
                message names its row and column), or its rows differ in length.
        """
        return cls.from_array(read_csv(path), spacing, origin)

    @classmethod
    def from_image(
        cls,
        path: str | Path,
        spacing: float | Lengths,
        height: float,
        origin: Lengths | None = None,
    ) -> HeightField:
        """Build from a grey image: black is z = 0, white is z = `height` [m].

        Up in the image is +y, right is +x, a pixel is a point. Colours count by their luminance.
        Needs Pillow or matplotlib. Other arguments as for `from_array`.

        Raises:
            ParameterError: the file cannot be read, or neither library is installed.
        """
        if not math.isfinite(height):
            raise ParameterError("height", height, "finite [m]")
        return cls.from_array(height * read_image(path)[::-1], spacing, origin)

    @classmethod
    def random(
        cls,
        seed: int,
        amplitude: float = 0.02,
        wavelength: float = 0.4,
        size: float | Lengths = 4.0,
        *,
        centre: Lengths = (0.0, 0.0),
        flat_radius: float = 0.0,
    ) -> HeightField:
        """Build smooth hills: a sum of plane waves of random direction, phase and length.

        Args:
            seed: the same seed gives the same hills.
            amplitude: largest |z| [m].
            wavelength: typical distance between hills [m]; waves are 0.7 to 1.4 of it.
            size: of the field along x and y [m].
            centre: x, y of the middle of the field [m].
            flat_radius: the ground is level at z = 0 up to this distance from the world's origin
                [m]; the hills rise to their height over a wavelength from there. 0: hills all over.

        Raises:
            ParameterError: a length is not positive, the hills are steeper than 60 degrees, or
                nothing of them is left beside the level place.
        """
        if seed < 0:
            raise ParameterError("seed", seed, "0 or more")
        extent = _pair("size", size)
        for name, value in (("wavelength", wavelength), ("size", extent[0]), ("size", extent[1])):
            if not (math.isfinite(value) and value > 0.0):
                raise ParameterError(name, value, "positive and finite [m]")
        if not (math.isfinite(amplitude) and amplitude >= 0.0):
            raise ParameterError("amplitude", amplitude, "finite, not negative [m]")
        if not (math.isfinite(flat_radius) and flat_radius >= 0.0):
            raise ParameterError("flat_radius", flat_radius, "finite, not negative [m]")
        if not np.isfinite(centre).all():
            raise ParameterError("centre", centre, "finite [m]")
        spacing = wavelength / MIN_POINTS_PER_WAVELENGTH
        columns, rows = (max(2, int(np.ceil(length / spacing)) + 1) for length in extent)
        _require_size(rows * columns)
        few = rows * columns <= MAX_KEPT_POINTS and type(seed) is int
        waves = (_kept_waves if few else _waves)(seed, spacing / wavelength, (rows, columns))
        first = (centre[0] - 0.5 * (columns - 1) * spacing, centre[1] - 0.5 * (rows - 1) * spacing)
        flat = flat_radius != 0.0
        fade = _faded_in(first, spacing, waves.shape, flat_radius, wavelength) if flat else 1.0
        z = waves * fade
        largest = np.abs(z).max()
        if largest == 0.0:
            raise ParameterError("flat_radius", flat_radius, "smaller: no hill is left [m]")
        return cls.from_array(amplitude / largest * z, spacing, first)


def _waves(seed: int, step: float, shape: tuple[int, int]) -> Array:
    """Return a sum of waves of lengths near 1 on a grid of the given step."""
    rng = np.random.default_rng(seed)
    turn, phase = rng.uniform(0.0, 2.0 * np.pi, (2, RANDOM_FIELD_WAVES))
    number = 2.0 * np.pi / rng.uniform(0.7, 1.4, RANDOM_FIELD_WAVES)
    y, x = (step * np.arange(n) for n in shape)
    z = np.zeros(shape)
    for k, a, p in zip(number, turn, phase, strict=True):
        z += np.cos(k * (np.cos(a) * x[None, :] + np.sin(a) * y[:, None]) + p)
    return z


_kept_waves = lru_cache(maxsize=KEPT_WAVES)(_waves)


def _faded_in(
    first: Lengths, spacing: float, shape: tuple[int, int], radius: float, width: float
) -> Array:
    """Return factors of a grid: 0 up to a radius and two cells more, then smoothly to 1.

    Catmull-Rom splines reach two points to either side, so the surface is level inside the radius.
    """
    y, x = (o + spacing * np.arange(n) for o, n in zip(first[::-1], shape, strict=True))
    beyond = np.hypot(x[None, :], y[:, None]) - (radius + 2.0 * np.sqrt(2.0) * spacing)
    s = np.clip(beyond / width, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def _pair(name: str, value: float | Lengths) -> Lengths:
    """Return two lengths from one or two."""
    found = np.asarray(value, dtype=float)
    if found.shape not in ((), (2,)):
        raise ParameterError(name, value, "one length or two [m]")
    first, second = np.broadcast_to(found, 2).tolist()
    return first, second


def _rectangle(z: ArrayLike) -> Array:
    """Return heights as an array (ny, nx)."""
    allowed = "a rectangle of numbers [m], 2 x 2 at least"
    try:
        grid = np.array(z, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ParameterError("HeightField.z", "rows that differ", allowed) from error
    if grid.ndim != 2 or min(grid.shape) < 2:
        raise ParameterError("HeightField.z", f"an array of shape {grid.shape}", allowed)
    return grid


def _require_size(points: int) -> None:
    if points > MAX_GRID_POINTS:
        raise ParameterError(
            "HeightField.z", f"{points} points", f"{MAX_GRID_POINTS} points at most"
        )


def _require_grid(z: Array, spacing: Any) -> None:
    """Refuse too many heights, ones that are not finite, and walls."""
    _require_size(z.size)
    wrong = ~(np.abs(z) <= FARTHEST_M)
    if wrong.any():
        j, i = (int(k) for k in np.argwhere(wrong)[0])
        allowed = f"finite, at most {FARTHEST_M:g} m up or down"
        raise ParameterError(f"HeightField.z[{j}, {i}]", float(z[j, i]), allowed)
    for axis, step in ((1, spacing[0]), (0, spacing[1])):
        grade = np.abs(np.diff(z, axis=axis)) / step
        steepest = float(np.arctan(grade.max()))
        if steepest > MAX_FACE_ANGLE_RAD:
            j, i = (int(k) for k in np.unravel_index(grade.argmax(), grade.shape))
            raise ParameterError(
                f"HeightField.z[{j}, {i}]",
                f"{np.degrees(steepest):.3g} deg",
                "followed by a slope of 60 deg at most",
                "Use a wider spacing or lower heights.",
            )


# Heights from files: comma-separated text and grey images.

LUMINANCE = (0.299, 0.587, 0.114)  # of red, green, blue (ITU-R BT.601)
MAX_FILE_BYTES = 100_000_000


def read_csv(path: str | Path) -> Array:
    """Return the numbers (rows, columns) of a comma-separated file; empty lines are skipped.

    Raises:
        ParameterError: the file cannot be read, a cell is not a finite number, or rows differ in
            length; rows and columns are counted from 1, as editors do.
    """
    text = _bytes(path)
    try:
        lines = text.decode("utf-8-sig").splitlines()
        rows = [(n, row) for n, row in enumerate(csv.reader(lines), 1) if any(row)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise _unreadable(path, f"comma-separated text ({error})") from error
    if not rows:
        raise _unreadable(path, "comma-separated numbers (it is empty)")
    width = len(rows[0][1])
    for n, row in rows:
        if len(row) != width:
            raise ParameterError(f"{path}, row {n}", f"{len(row)} columns", f"{width} columns")
    return np.array(
        [[_number(path, n, k, cell) for k, cell in enumerate(row, 1)] for n, row in rows]
    )


def _number(path: str | Path, row: int, column: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ParameterError(f"{path}, row {row}, column {column}", cell, "a finite number [m]")
    return value


def read_image(path: str | Path) -> Array:
    """Return the brightness (rows, columns) of an image, 0 black to 1 white, top row first.

    Raises:
        ParameterError: the file cannot be read, or is not an image.
    """
    data = _bytes(path)
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data)) as image:
            if image.mode in ("I;16", "I;16B", "I;16L", "I;16N", "I"):
                return np.asarray(image, dtype=float) / 65535.0
            if image.mode == "F":
                raise ValueError("floating-point images have no white")
            return np.asarray(image.convert("RGB"), dtype=float) / 255.0 @ LUMINANCE
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise _unreadable(path, f"an image ({error})") from error


def _bytes(path: str | Path) -> bytes:
    """Return a file's content."""
    try:
        return read_bytes(path, MAX_FILE_BYTES)
    except (OSError, ValueError) as error:
        raise _unreadable(path, f"a readable file ({reason_of(error)})") from error


def _unreadable(path: str | Path, allowed: str) -> ParameterError:
    return ParameterError("path", str(path), allowed)


# Heights on a grid and the smooth surface through them.


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
