"""The trunk's axes in the root link's frame: forward, left, up."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.chains import Chain
from hexapod_pin.robot.recognition.layout_symmetry import ON_LINE, MiddleLine, middle_lines
from hexapod_pin.robot.recognition.name_codes import front_by_names, plain
from hexapod_pin.robot.recognition.tree_frames import TreeFrames
from hexapod_pin.robot.recognition.up import EXACT, SLACK, Up, direction_text, mean_tip

ROUND_LAYOUT = 1.02
"""Layouts whose longest line exceeds the others' by less than this are round (*assumed*)."""

AGREE = math.radians(35.0)
"""Names tell which line is the middle one when they point this near to it (*assumed*)."""

HEAD_WORDS = (("head", "camera", "cam", "eye"), ("front",), ("lidar", "laser", "antenna"))
"""Links off the middle of the hips that tell the front; earlier words win."""

AHEAD = 0.2
"""Least place of such a link ahead of the middle, in half lengths of the layout (*assumed*)."""


class Forward(NamedTuple):
    """The trunk's axes in the root link's frame.

    Attributes:
        turn: columns forward, left, up. Shape (3, 3).
        reason: how they were found; empty where they are given.
        miss: by which mirrored hips miss their partners, over the layout's size.
    """

    turn: Array
    reason: str
    miss: float


class Layout(NamedTuple):
    """What the forward direction is inferred from.

    Attributes:
        file: the URDF.
        frames: of all links and joints.
        chains: the legs.
        hips: where they start [m]. Shape (L, 3).
        names: for each leg the names that may tell its place.
        others: links that belong to no leg.
    """

    file: UrdfFile
    frames: TreeFrames
    chains: Sequence[Chain]
    hips: Array
    names: Sequence[Sequence[str]]
    others: Sequence[str]


def find_forward(layout: Layout, up: Up) -> Forward:
    """Return the trunk's axes from where the hips are; which end is the front from names.

    Raises:
        UrdfError: no direction has as many hips left as right.
    """
    plane, hips = across_up(up.unit), layout.hips
    middle = hips.mean(axis=0)
    flat = (hips - middle) @ plane.T
    lines = middle_lines(flat) or _uneven_lines(flat)
    if not lines:
        text = (
            f"no direction has as many of the {len(hips)} hips left as right: give forward=[...]"
            ' (such as "x", "-y" or an angle in degrees about the upward axis)'
        )
        raise UrdfError(layout.file.source, [text])
    named = front_by_names(layout.names, hips)
    line, sign, why = _chosen(layout, lines, plane, middle, None if named is None else named[:])
    angle = _snapped(line.angle, line.miss) + (math.pi if sign < 0 else 0.0)
    turn = _axes(plane, up.unit, angle)
    half = len(hips) // 2
    where = f"{direction_text(turn[:, 0])} of {layout.file.base!r}"
    return Forward(turn, f"forward is {where}: {half} hips on each side of it; {why}", line.miss)


def given_forward(forward: str | float, up: Up, source: str) -> Forward:
    """Return the trunk's axes for a direction that the user gives.

    Raises:
        UrdfError: no axis and no angle, or a direction along up.
    """
    plane = across_up(up.unit)
    words = str(forward).strip().lower()
    axis = words.lstrip("+-")
    if len(axis) == 1 and axis in "xyz" and words in (axis, f"-{axis}", f"+{axis}"):
        unit = np.eye(3)["xyz".index(axis)] * (-1 if words.startswith("-") else 1)
        flat = plane @ unit
        if np.linalg.norm(flat) < 0.1:
            text = f"forward {forward!r} is along up ({direction_text(up.unit)})"
            raise UrdfError(
                source, [f"{text}: give forward=[...] across it, or an angle in degrees"]
            )
        angle = math.atan2(flat[1], flat[0])
    else:
        try:
            angle = math.radians(float(forward))
        except ValueError:
            angle = math.nan
        if not math.isfinite(angle):
            text = f"forward {forward!r}: must be x, y, z with or without a sign, or degrees"
            raise UrdfError(source, [f"{text}; give forward=[...] so"])
    turn = _axes(plane, up.unit, _snapped(angle, 0.0))
    return Forward(turn, "", 0.0)


def hip_points(
    chains: Sequence[Chain], frames: TreeFrames, tips: Mapping[str, Array], up: Array
) -> Array:
    """Return where the legs start, root link's frame [m]. Shape (L, 3).

    Where all legs start in a row: where their tips are on average over their joints' ranges.
    """
    hips = np.array([frames.axes[chain.joints[0].name].origin for chain in chains])
    flat = (hips - hips.mean(axis=0)) @ across_up(up).T
    spread = np.linalg.svd(flat, compute_uv=False)
    if spread[1] > ON_LINE * spread[0]:
        return hips
    axes = [[frames.axes[joint.name] for joint in chain.joints] for chain in chains]
    return np.array([mean_tip(c, a, tips[c.label]) for c, a in zip(chains, axes, strict=True)])


def _chosen(
    layout: Layout,
    lines: list[MiddleLine],
    plane: Array,
    middle: Array,
    named: tuple[Array, str] | None,
) -> tuple[MiddleLine, float, str]:
    """Return the middle line, which of its ends is the front, and what tells that."""
    if named is not None:
        flat = plane @ named[0]
        flat = flat / max(float(np.linalg.norm(flat)), 1e-300)
        line = max(lines, key=lambda line: abs(_along(line, flat)))
        if abs(_along(line, flat)) >= math.cos(AGREE):
            return (
                line,
                math.copysign(1.0, _along(line, flat)),
                f"the front by the names {named[1]}",
            )
    longest = max(line.length for line in lines)
    alike = [line for line in lines if line.length * ROUND_LAYOUT >= longest]
    line = min(alike, key=_oddness)
    for words in HEAD_WORDS:
        if found := _ahead(layout, words, line, plane, middle):
            return line, found[0], f"the front where link {found[1]!r} is"
    along = _along(line, np.array([1.0, 0.0]))
    if abs(along) < 1e-3:
        along = _along(line, np.array([0.0, 1.0]))
    return line, math.copysign(1.0, along), "the front by the root link's axes (assumed)"


def _oddness(line: MiddleLine) -> tuple[bool, float, float]:
    """Order lines of a round layout: along a root axis, then near to its x, then to the left."""
    turn = (line.angle + 0.25 * math.pi) % (0.5 * math.pi) - 0.25 * math.pi
    from_x = min(line.angle, math.pi - line.angle)
    return abs(turn) > max(EXACT, min(2 * line.miss, SLACK)), round(from_x, 6), line.angle


def _ahead(
    layout: Layout, words: Sequence[str], line: MiddleLine, plane: Array, middle: Array
) -> tuple[float, str] | None:
    """Return the end of the line where links of these names are, and the first one's name."""
    found = []
    for link in layout.others:
        parts = re.split(r"[^a-z]+", plain(link))
        if any(part.startswith(word) for part in parts for word in words):
            flat = plane @ (layout.frames.links[link].position - middle)
            along = _along(line, flat) / max(0.5 * line.length, 1e-9)
            if abs(along) > AHEAD:
                found.append((math.copysign(1.0, along), link))
    return found[0] if found and len({sign for sign, _ in found}) == 1 else None


def _uneven_lines(flat: Array) -> list[MiddleLine]:
    """Return the long axis of hips that do not mirror, where it has as many on each side."""
    spread, vectors = np.linalg.eigh(flat.T @ flat)
    lines = []
    for index in (1, 0):
        unit = vectors[:, index]
        across = flat @ np.array([-unit[1], unit[0]])
        size = math.sqrt(float(spread.sum()) / len(flat))
        if (across > ON_LINE * size).sum() == (across < -ON_LINE * size).sum() == len(flat) // 2:
            along = float(np.ptp(flat @ unit))
            angle = math.atan2(unit[1], unit[0]) % math.pi
            lines.append(MiddleLine(angle, 1.0, along, float(np.ptp(across))))
    return lines


def across_up(up: Array) -> Array:
    """Return two unit vectors (2, 3) across up: the root's x (or the next axis) and left of it."""
    start = np.eye(3)[next(k for k in (0, 1, 2) if abs(up[k]) < 0.9)]
    first = start - (start @ up) * up
    first = first / np.linalg.norm(first)
    return np.array([first, np.cross(up, first)]) + 0.0


def _axes(plane: Array, up: Array, angle: float) -> Array:
    """Return forward, left, up as columns (3, 3)."""
    quarter = angle / (0.5 * math.pi)
    c, s = math.cos(angle), math.sin(angle)
    if abs(quarter - round(quarter)) < 1e-12:
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    forward = c * plane[0] + s * plane[1]
    return np.column_stack([forward, np.cross(up, forward), up]) + 0.0


def _snapped(angle: float, miss: float) -> float:
    """Return the multiple of 90 deg that an angle is near to, else the angle [rad]."""
    quarter = 0.5 * math.pi * round(angle / (0.5 * math.pi))
    return quarter if abs(angle - quarter) <= max(EXACT, min(2 * miss, SLACK)) else angle


def _along(line: MiddleLine, flat: Array) -> float:
    """Return the component of a plane vector (2,) along a line."""
    return float(flat[0] * math.cos(line.angle) + flat[1] * math.sin(line.angle))
