"""The file of a figure."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import MissingPackageError, ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
"""Of figures, as the ending of the file names them."""

DPI = 100
"""Of PNG files: a figure over a page's width has 900 to 1000 pixels."""


PLACES = 4
"""Decimals of the places of panels in a figure whose layout is settled [-]."""


def figure_format(path: str | Path) -> str:
    """Return the format that the ending of a figure's file names.

    Raises:
        ParameterError: it names none of png, svg and pdf.
        MissingPackageError: matplotlib, which draws it, is not installed.
    """
    found = Path(path).suffix.lower().lstrip(".")
    if found not in FORMATS:
        raise ParameterError("path", str(path), "a file ending in .png, .svg or .pdf")
    require_matplotlib(str(path))
    return found


def require_matplotlib(wanted: str) -> None:
    """Refuse a figure or a report, before it is computed, where nothing can draw it.

    Args:
        wanted: what is to be drawn, for the message.

    Raises:
        MissingPackageError: matplotlib is not installed.
        ParameterError: the variable MPLBACKEND names a backend that does not exist.
    """
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise MissingPackageError("matplotlib", "plot", wanted) from error
    except ValueError as error:
        given, hint = os.environ.get("MPLBACKEND", ""), "Unset it: figures need no backend here."
        raise ParameterError("MPLBACKEND", given, "a backend of matplotlib", hint) from error


def settle_layout(figure: Figure) -> None:
    """Lay a figure out now, once, with its parts and panels at rounded places.

    The last digits of a constrained layout differ from run to run; without this, the bytes of
    files would.
    """
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    for part in figure.subfigs:
        box = part.bbox_relative
        box.p0, box.p1 = box.p0.round(PLACES), box.p1.round(PLACES)
    for axes in figure.axes:
        left, low, width, height = axes.get_position(original=True).bounds
        axes.set_position(
            (round(left, PLACES), round(low, PLACES), round(width, PLACES), round(height, PLACES))
        )


def save_figure(figure: Figure, path: str | Path, ending: str) -> Path:
    """Write a figure, wholly or not at all, and return its path.

    Args:
        figure: to write.
        path: of the file.
        ending: its format: "png", "svg" or "pdf".

    Raises:
        TraceFileError: the file cannot be written.
    """
    stream = io.BytesIO()
    figure.savefig(stream, format=ending, dpi=DPI)
    return write_atomically(path, stream.getvalue())


def write_svg(figure: Figure, path: Path) -> Path:
    """Write a figure as SVG without a date, wholly or not at all, and return its path.

    Raises:
        TraceFileError: the file cannot be written.
    """
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    return write_atomically(path, stream.getvalue())
