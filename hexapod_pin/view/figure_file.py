"""The file of a figure."""

from __future__ import annotations

import io
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import MissingPackageError, ParameterError
from hexapod_pin.foreign_text import visible

if TYPE_CHECKING:
    from matplotlib.axis import Axis
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


def require_matplotlib(figure: str) -> None:
    """Refuse a figure or a report, before it is computed, where nothing can draw it.

    Args:
        figure: what is to be drawn, for the message.

    Raises:
        MissingPackageError: matplotlib is not installed.
        ParameterError: the variable MPLBACKEND names a backend that does not exist.
    """
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise MissingPackageError("matplotlib", "plot", figure) from error
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
    with plain_texts(figure):
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
    return write_atomically(path, figure_bytes(figure, ending, dpi=DPI))


def write_svg(figure: Figure, path: Path) -> Path:
    """Write a figure as SVG without a date, wholly or not at all, and return its path.

    Its coordinates are rounded and its lines thinned: see `compact_svg`.

    Raises:
        TraceFileError: the file cannot be written.
    """
    plain = figure_bytes(figure, "svg", metadata={"Date": None}).decode("utf-8")
    return write_atomically(path, compact_svg(plain).encode("utf-8"))


SVG_DIGITS = 2
"""Decimals of coordinates in an SVG [units of 1/72 in]."""

SVG_THINNING = 0.1
"""Distance from the drawn line within which a point of it is left out [units of 1/72 in]."""

_PLACES = re.compile(r' (?:x|y|d)="[^"]*"|translate\([^)]*\)')
_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")


def compact_svg(text: str) -> str:
    """Return an SVG of matplotlib with rounded coordinates, each path in one line, lines thinned.

    Open lines of straight pieces lose the points that lie within `SVG_THINNING` of what remains
    (Douglas & Peucker 1973). Scales, sizes, styles and texts stay as they are.
    """

    def rounded(number: re.Match[str]) -> str:
        return f"{round(float(number[0]), SVG_DIGITS) + 0.0:g}"

    def place(found: re.Match[str]) -> str:
        whole = found[0]
        if whole.startswith(' d="'):
            pieces = re.findall(r"M[^M]*", " ".join(whole[4:-1].split()))
            whole = f' d="{" ".join(_thinned(piece.strip()) for piece in pieces)}"'
        return _NUMBER.sub(rounded, whole)

    return _PLACES.sub(place, text)


def _thinned(piece: str) -> str:
    """Return a piece of a path, `M x y L x y ...`, without needless points; others as they are."""
    commands = re.findall(r"[A-Za-z]", piece)
    if len(commands) < 3 or set(commands[1:]) != {"L"}:
        return piece
    words = re.sub(r"[ML]", " ", piece).split()
    points = np.array([float(word) for word in words]).reshape(-1, 2).round(SVG_DIGITS)
    return "M " + " L ".join(f"{x:g} {y:g}" for x, y in points[_needed(points)] + 0.0)


def _needed(points: Array) -> npt.NDArray[np.bool_]:
    """Return which points (N,) keep a line within `SVG_THINNING` of all points (N, 2)."""
    needed = np.zeros(len(points), dtype=bool)
    needed[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        start, along = points[first], points[last] - points[first]
        away = points[first + 1 : last] - start
        share = np.clip(away @ along / (along @ along or 1.0), 0.0, 1.0)
        distance = np.linalg.norm(away - share[:, None] * along, axis=1)
        worst = int(np.argmax(distance))
        if distance[worst] > SVG_THINNING:
            middle = first + 1 + worst
            needed[middle] = True
            spans += [(first, middle), (middle, last)]
    return needed


def figure_bytes(figure: Figure, ending: str, **options: Any) -> bytes:
    """Return the file of a figure; options as of matplotlib's `savefig`."""
    stream = io.BytesIO()
    with plain_texts(figure):
        figure.savefig(stream, format=ending, **options)
    return stream.getvalue()


@contextmanager
def plain_texts(figure: Figure) -> Iterator[None]:
    """Change a figure so that its texts are drawn as they are; within this context draw it.

    Names from files are among them: none is a formula, whatever dollars it has, and a control
    character is drawn as its escape. What a font lacks is drawn as a box; the warning of that is
    left out within this context.
    """
    from matplotlib.text import Text

    numbers = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            numbers |= _settle_ticks(axis)
    for text in figure.findobj(Text):
        if text not in numbers:
            text.set_text(visible(text.get_text()))
            text.set_parse_math(False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


def _settle_ticks(axis: Axis) -> set[Any]:
    """Make names along an axis visible; return the labels of an axis of numbers.

    Those of a logarithmic axis are formulas of matplotlib's own.
    """
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    named = axis.get_major_formatter()
    labels = {*axis.get_majorticklabels(), *axis.get_minorticklabels(), axis.get_offset_text()}
    if not isinstance(named, FixedFormatter | FuncFormatter):
        return labels
    axis.set_major_formatter(FuncFormatter(lambda x, place=None: visible(named(x, place))))
    return set()
