"""Heights from files: comma-separated text and grey images."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

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
        ParameterError: the file is not an image, or neither Pillow nor matplotlib is installed.
    """
    _bytes(path)
    try:
        return _with_pillow(path)
    except ImportError:
        pass
    try:
        return _with_matplotlib(path)
    except ImportError as error:
        raise ParameterError(
            "path", str(path), "read with Pillow or matplotlib", "`pip install pillow`."
        ) from error


def _with_pillow(path: str | Path) -> Array:
    from PIL import Image

    try:
        with Image.open(path) as image:
            if image.mode in ("I;16", "I;16B", "I;16L", "I;16N", "I"):
                return np.asarray(image, dtype=float) / 65535.0
            if image.mode == "F":
                raise ValueError("floating-point images have no white")
            return _grey(np.asarray(image.convert("RGB"), dtype=float) / 255.0)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise _unreadable(path, f"an image ({error})") from error


def _with_matplotlib(path: str | Path) -> Array:
    from matplotlib.image import imread

    try:
        found: Any = np.asarray(imread(path))
    except (OSError, ValueError, SyntaxError) as error:
        raise _unreadable(path, f"an image ({error})") from error
    scale = np.iinfo(found.dtype).max if np.issubdtype(found.dtype, np.integer) else 1.0
    return _grey(found.astype(float) / scale)


def _grey(image: Array) -> Array:
    """Return the luminance of an image (rows, columns) or (rows, columns, 3 or 4)."""
    return image if image.ndim == 2 else np.asarray(image[..., :3] @ LUMINANCE)


def _bytes(path: str | Path) -> bytes:
    """Return a file's content."""
    try:
        file = user_path(path)
        if file.stat().st_size > MAX_FILE_BYTES:
            raise _unreadable(path, f"a file of {MAX_FILE_BYTES} bytes at most")
        return file.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, ParameterError):
            raise
        raise _unreadable(path, f"a readable file ({error})") from error


def _unreadable(path: str | Path, allowed: str) -> ParameterError:
    return ParameterError("path", str(path), allowed)
