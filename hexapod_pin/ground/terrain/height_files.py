"""Heights from files: comma-separated text and grey images."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError
from hexapod_pin.user_file import read_bytes, reason_of

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
