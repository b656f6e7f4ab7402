"""The trunk's forward, left and up axes follow from the symmetry of the hips and from names."""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.leg_names import joint_role
from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.chains import Chain, TreeFrames
from hexapod_pin.robot.recognition.up import EXACT, SLACK, Up, direction_text, mean_tip

ROUND_LAYOUT = 1.02
"""Layouts whose longest line exceeds the others' by less than this are round (*assumed*)."""

AGREE = math.radians(35.0)
"""Names determine the middle line when their direction is this near to it (*assumed*)."""

HEAD_WORDS = (("head", "camera", "cam", "eye"), ("front",), ("lidar", "laser", "antenna"))
"""Words in names of links at the front of a robot; earlier groups have priority."""

AHEAD = 0.2
"""Least place of such a link ahead of the middle, in half lengths of the layout (*assumed*)."""


class Forward(NamedTuple):
    """The trunk's axes in the root link's frame.

    Attributes:
        turn: columns forward, left, up. Shape (3, 3).
        reason: how they were found; empty where they are given.
        miss: by which mirrored hips miss their partners, over the layout's size.
        named: whether names determine which end is the front.
    """

    turn: Array
    reason: str
    miss: float
    named: bool = True


class Layout(NamedTuple):
    """What the forward direction is inferred from.

    Attributes:
        file: the URDF.
        frames: of all links and joints.
        chains: the legs.
        hips: where they start [m]. Shape (L, 3).
        names: for each leg the names that may contain its place.
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
    line, sign, why = _chosen(layout, lines, plane, middle, named)
    angle = _snapped(line.angle, line.miss) + (math.pi if sign < 0 else 0.0)
    turn = _axes(plane, up.unit, angle)
    half = len(hips) // 2
    where = f"{direction_text(turn[:, 0])} of {layout.file.base!r}"
    reason = f"forward is {where}: {half} hips on each side of it; {why}"
    return Forward(turn, reason, line.miss, ASSUMED_FRONT not in why)


ASSUMED_FRONT = "the front by the root link's axes (assumed)"
"""Why one end of a robot is its front, where no name says so."""


def forward_doubt(stated: str | float, given: Forward, layout: Layout, up: Up) -> str:
    """Return that a direction is not the one that the hips and names show; else nothing.

    A layout that is as long in the given direction shows no other; and which end is the front shows
    in names alone.

    Args:
        stated: the direction as the user gives it.
        given: the same as axes.
        layout: what else the direction would be inferred from.
        up: the upward direction.
    """
    try:
        found = find_forward(layout, up)
    except UrdfError:
        return ""
    angle = math.acos(min(1.0, max(-1.0, float(given.turn[:, 0] @ found.turn[:, 0]))))
    off = angle if found.named else min(angle, math.pi - angle)
    if off <= AGREE or (not found.named and _as_long(given, layout, up)):
        return ""
    own = direction_text(found.turn[:, 0])
    if off > math.pi - AGREE:
        return f"forward {stated} is to its rear: its front is {own}"
    return f"forward {stated} is {math.degrees(off):.0f} degrees off its body's, {own}"


def _as_long(given: Forward, layout: Layout, up: Up) -> bool:
    """Return whether a given direction is along one of the longest middle lines of the hips."""
    plane = across_up(up.unit)
    lines = middle_lines((layout.hips - layout.hips.mean(axis=0)) @ plane.T)
    longest = max((line.length for line in lines), default=math.inf)
    along = plane @ given.turn[:, 0]
    return any(
        line.length * ROUND_LAYOUT >= longest and abs(_along(line, along)) >= math.cos(AGREE)
        for line in lines
    )


def given_forward(forward: str | float, up: Up, source: str) -> Forward:
    """Return the trunk's axes for a direction that the user gives.

    Raises:
        UrdfError: no axis and no angle, or a direction along up.
    """
    plane = across_up(up.unit)
    text = str(forward).strip().lower()
    axis = text.lstrip("+-")
    if len(axis) == 1 and axis in "xyz" and text in (axis, f"-{axis}", f"+{axis}"):
        unit = np.eye(3)["xyz".index(axis)] * (-1 if text.startswith("-") else 1)
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
    named: FrontByNames | None,
) -> tuple[MiddleLine, float, str]:
    """Return the middle line, the sign of its front end, and the reason."""
    if named is not None:
        flat = plane @ named.direction
        flat = flat / max(float(np.linalg.norm(flat)), 1e-300)
        line = max(lines, key=lambda line: abs(_along(line, flat)))
        if abs(_along(line, flat)) >= math.cos(AGREE):
            sign = math.copysign(1.0, _along(line, flat))
            return line, sign, f"the front by the names {named.names}"
    longest = max(line.length for line in lines)
    alike = [line for line in lines if line.length * ROUND_LAYOUT >= longest]
    line = min(alike, key=_oddness)
    for words in HEAD_WORDS:
        if found := _ahead(layout, words, line, plane, middle):
            return line, found[0], f"the front where link {found[1]!r} is"
    along = _along(line, np.array([1.0, 0.0]))
    if abs(along) < 1e-3:
        along = _along(line, np.array([0.0, 1.0]))
    return line, math.copysign(1.0, along), ASSUMED_FRONT


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


# Which legs are in front and which behind, by their names, where these do not contradict.

FEWEST = 4
"""Legs that must agree."""

SIDE_FIRST = re.compile(r"(?<![a-z])([lr])_?([fmrbh])(?![a-z])")
ROW_FIRST = re.compile(r"(?<![a-z])([fmrbh])_?([lr])(?![a-z])")
SIDE_ROW = re.compile(r"(?<![a-z])(l|r|left|right)_?([1-4])(?!\d)")
_WORDS = (("f", ("front", "fore")), ("r", ("rear", "back", "hind")), ("m", ("mid",)))
_ROWS = {"f": 1.0, "m": 0.0, "r": -1.0, "b": -1.0, "h": -1.0}


class FrontByNames(NamedTuple):
    """A direction (3,) to the front, of any length, and the names that give it."""

    direction: Array
    names: str


def front_by_names(names: Sequence[Sequence[str]], hips: Array) -> FrontByNames | None:
    """Return the direction from rear to front by the names of limbs, else None.

    Args:
        names: of the joints and links of each limb.
        hips: where the limbs start [m]. Shape (L, 3).
    """
    for read in (_letters, _words, _numbers, _habit):
        if read is _numbers and len(names) % 2:
            continue  # the rows of an odd number of legs do not face each other
        codes = [_code_of(limb, read) for limb in names]
        rows = np.array([np.nan if code is None else code[0] for code in codes])
        if np.isfinite(rows).sum() < max(FEWEST, len(rows)):
            continue
        front, rear = rows > rows.mean(), rows < rows.mean()
        if not front.any() or not rear.any():
            continue
        direction = hips[front].mean(axis=0) - hips[rear].mean(axis=0)
        along = hips @ direction
        if along[front].min() > along[rear].max():
            found = [code[1] for code, x in zip(codes, front, strict=True) if code and x]
            return FrontByNames(direction, ", ".join(dict.fromkeys(found)))
    return None


def plain(name: str) -> str:
    """Return a name in lower case, parts of camelCase set apart."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


_Code = tuple[float, str]


def _code_of(limb: Sequence[str], read: Callable[[str], _Code | None]) -> _Code | None:
    """Return the row and name of a limb by its names; None without a row, or with several."""
    found = [code for name in limb if (code := read(plain(name)))]
    return found[0] if found and len({row for row, _ in found}) == 1 else None


def _letters(name: str) -> _Code | None:
    """Read lf, rm, br, lm1, ..."""
    if found := SIDE_FIRST.search(name):
        return _ROWS[found[2]], found[0]
    if found := ROW_FIRST.search(name):
        return _ROWS[found[1]], found[0]
    return None


def _words(name: str) -> _Code | None:
    """Read front, middle, rear, back, hind."""
    for row, words in _WORDS:
        if any(word in name for word in words):
            return _ROWS[row], name
    return None


def _numbers(name: str) -> _Code | None:
    """Read l1, r3, left_2: one is in front."""
    found = SIDE_ROW.search(name)
    return (-float(found[2]), found[0]) if found else None


def _habit(name: str) -> _Code | None:
    """Read the other conventions that `joint_role` knows."""
    role = joint_role(name)
    return (_ROWS[role.leg[1]], role.leg) if role else None


# The middle planes of a layout of hips: as many legs left as right, one in it of an odd number.

LIKE = 0.05
"""Mirrored hips may miss their partners by this share of the layout's size (*assumed*)."""

ON_LINE = 0.02
"""A hip within this share of the layout's size of the plane is on it (*assumed*)."""


class MiddleLine(NamedTuple):
    """A line through the middle of the hips, seen from above.

    Attributes:
        angle: of the line from the first axis, in [0, pi) [rad].
        miss: root mean square by which mirrored hips miss their partners, over the layout's size.
        length: extent of the hips along it [m].
        width: extent of the hips across it [m].
    """

    angle: float
    miss: float
    length: float
    width: float


def middle_lines(flat: Array) -> list[MiddleLine]:
    """Return the lines that mirror hips onto hips with as many on each side, best first.

    A mirror line at angle t maps the complex place z to exp(2 i t) conj(z). A first guess pairs
    the first hip with each other one; least squares over all pairs then gives
    2 t = arg(sum of z_i z_partner(i)): exact where the layout is symmetric.

    Args:
        flat: hips in the plane across up, about their middle [m]. Shape (L, 2).
    """
    places = [complex(x, y) for x, y in flat]
    size = math.sqrt(sum(abs(z) ** 2 for z in places) / len(places))
    lines: list[MiddleLine] = []
    for partner in places[1 - len(places) % 2 :] if size > 0 else []:
        turn = _unit(places[0] * partner)
        for _ in range(3):
            pairs = _partners(places, turn)
            if pairs is None:
                break
            turn = _unit(sum(z * places[k] for z, k in zip(places, pairs, strict=True)))
        if pairs is None or any(abs(turn - cmath.exp(2j * line.angle)) < 1e-6 for line in lines):
            continue
        line = _line(places, pairs, turn, size)
        if line is not None:
            lines.append(line)
    return sorted(lines, key=lambda line: line.miss)


def is_left(hips: Array) -> list[bool]:
    """Return which hips (L, 3) about their middle, in trunk axes, are left; the middle one is."""
    size = float(np.sqrt((hips[:, :2] ** 2).sum(axis=1).mean()))
    line = -ON_LINE * size if len(hips) % 2 else 0.0
    return [bool(across > line) for across in hips[:, 1]]


def _line(places: list[complex], pairs: list[int], turn: complex, size: float) -> MiddleLine | None:
    """Return one line, None where the hips do not mirror or do not lie on both sides alike."""
    off = [places[k] - turn * z.conjugate() for z, k in zip(places, pairs, strict=True)]
    miss = math.sqrt(sum(abs(z) ** 2 for z in off) / len(off)) / size
    angle = (0.5 * cmath.phase(turn)) % math.pi
    turned = np.array([z * cmath.exp(-1j * angle) for z in places])
    along, across = turned.real, turned.imag
    sides = (across > ON_LINE * size).sum(), (across < -ON_LINE * size).sum()
    if miss > LIKE or sides[0] != sides[1] or sum(sides) != len(places) // 2 * 2:
        return None
    return MiddleLine(angle, miss, float(np.ptp(along)), float(np.ptp(across)))


def _partners(places: list[complex], turn: complex) -> list[int] | None:
    """Return the nearest hip to each mirrored one; None where they are no pairs."""
    mirrored = [turn * z.conjugate() for z in places]
    pairs = [min(range(len(places)), key=lambda k: abs(places[k] - z)) for z in mirrored]
    on_line = sum(k == i for i, k in enumerate(pairs))
    if any(pairs[k] != i for i, k in enumerate(pairs)) or on_line != len(places) % 2:
        return None
    return pairs


def _unit(z: complex) -> complex:
    """Return the direction of a complex number; 1 of zero."""
    return z / abs(z) if abs(z) > 0 else 1.0 + 0.0j
