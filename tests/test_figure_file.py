"""SVG files of figures: coordinates rounded, lines without needless points, the same picture."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hexapod_pin.view.figure_file import SVG_THINNING, compact_svg, figure_bytes, write_svg

ROUNDED = 0.5e-2 * np.sqrt(2.0)
"""Two decimals: the farthest that a rounded point is from its place [units of 1/72 in]."""


def lines_of(text: str) -> list[np.ndarray]:
    """Return the open lines of an SVG, each (N, 2)."""
    found = [re.findall(r"[ML] (\S+) (\S+)", path) for path in re.findall(r' d="([^"]*)"', text)]
    closed = [path.rstrip()[-1] in "zZ" for path in re.findall(r' d="([^"]*)"', text)]
    return [np.array(p, dtype=float) for p, z in zip(found, closed, strict=True)
            if len(p) > 1 and not z]  # fmt: skip


def distance(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Return the distance of points (N, 2) from a line through corners (M, 2)."""
    start, along = line[:-1], np.diff(line, axis=0)
    away = points[:, None] - start
    share = np.einsum("nmc,mc->nm", away, along) / np.maximum(np.sum(along**2, axis=1), 1e-12)
    nearest = np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.linalg.norm(away - nearest, axis=-1).min(axis=1))


def test_a_curve_of_many_samples_is_short_and_the_same_line(tmp_path: Path) -> None:
    """Both ways: no point of the one line is farther from the other than what was left out."""
    figure = Figure(figsize=(5.0, 3.0))
    axes = figure.add_subplot()
    t = np.linspace(0.0, 1.0, 6000)
    axes.plot(t, np.sin(20.0 * t) + 0.02 * np.sin(3000.0 * t), label="a quite noisy curve")
    axes.plot(t[::600], t[::600], "o")
    axes.legend()
    plain = figure_bytes(figure, "svg", metadata={"Date": None}).decode()
    text = write_svg(figure, tmp_path / "a.svg").read_text()
    assert len(text) < 0.8 * len(plain) and text.count("\n") < 0.5 * plain.count("\n")
    assert compact_svg(text) == text
    for before, after in zip(lines_of(plain), lines_of(text), strict=True):
        assert len(after) <= len(before)
        assert distance(before, after).max() <= SVG_THINNING + ROUNDED
        assert distance(after, before).max() <= ROUNDED
    for number in re.findall(r'(?: x| y)="([^"]+)"', text):
        assert len(number.partition(".")[2]) <= 2
    # what is no place stays: scales of letters, styles
    assert set(re.findall(r"scale\([^)]*\)", text)) == set(re.findall(r"scale\([^)]*\)", plain))
    assert re.findall(r'style="[^"]*"', text) == re.findall(r'style="[^"]*"', plain)


def test_straight_runs_lose_what_lies_on_them() -> None:
    """A line, a corner and a second line: three points remain; letters only lose digits."""
    given = '<path d="M 0 0 L 1 0.05 L 2 0 L 10 0.000001 L 10 4 L 10.09 6 L 10 9"/>'
    assert compact_svg(given) == '<path d="M 0 0 L 10 0 L 10 9"/>'
    closed = '<path d="M 0 0.123456 \nL 0.0200001 0 \nL 1 1 \nz\n"/>'
    assert compact_svg(closed) == '<path d="M 0 0.12 L 0.02 0 L 1 1 z"/>'
    curved = '<path d="M 0 0 C 1 1 2 2.5 3 3"/>'
    assert compact_svg(curved) == curved
