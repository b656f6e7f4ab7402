"""Where a leg's last body touches the ground: the extreme of its shapes in a direction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.loading.limbs import FOOT_WORDS
from hexapod_pin.robot.recognition.leg_body import BodySphere, LegBody
from hexapod_pin.robot.recognition.sphere_fit import Ball, fitted_ball

NEAR = 0.02
"""Points within this share of the last link of the extreme belong to the tip (*assumed*)."""

NAMED_NEAR = 0.15
"""The same for a foot link's own collision sphere: coarse shapes may pass it (*assumed*)."""

FLAT_ANGLE = math.radians(30.0)
"""An end face whose normal is this near to the direction stands on its centre (*assumed*)."""

LARGEST = 0.08
"""A foot's radius that no shape states is at most this share of the last link (*assumed*)."""


@dataclass(frozen=True, eq=False)
class Tip:
    """A foot sphere on a leg's last body at q = 0, root link's frame.

    Attributes:
        link: that carries it.
        centre: of the sphere [m]. Shape (3,).
        radius: [m].
        surface: the extreme point [m]. Shape (3,).
        stated: whether it is the first collision sphere of its link.
        rule: from what it was found, for a sentence.
    """

    link: str
    centre: Array
    radius: float
    surface: Array
    stated: bool
    rule: str


def foot_word(name: str) -> int | None:
    """Return the rank of the word for a foot in a link's name; None where it has none."""
    return next((k for k, word in enumerate(FOOT_WORDS) if word in name.lower()), None)


def tip_towards(body: LegBody, down: Array) -> Tip:
    """Return the foot of a body with shapes whose tip points along the unit vector `down` (3,)."""
    reach = body.reach
    heights = body.points @ down
    low = max(heights.max(initial=-np.inf), *(_bottom(s, down) for s in body.spheres), -np.inf)
    if sphere := _foot_sphere(body, down, low, reach):
        rule = "collision sphere" if sphere.stated else "sphere"
        surface = sphere.centre + sphere.radius * down
        return Tip(sphere.link, sphere.centre, sphere.radius, surface, sphere.stated, rule)
    owner = body.chain.body[int(body.owners[int(heights.argmax())])]
    if end := _standing_end(body, down, low, reach):
        return end
    near = body.points[heights >= low - NEAR * reach]
    if ball := _round_tip(body.points, heights, low, reach):
        surface = ball.centre + ball.radius * down
        return Tip(owner, ball.centre, ball.radius, surface, False, "sphere through its vertices")
    middle, width = _middle(near, down, body.axis.unit)
    surface = middle + (low - middle @ down) * down
    radius = min(0.5 * width, LARGEST * reach)
    rule = "end of its shape, radius from its width there, at most 8 % of the last link (assumed)"
    return Tip(owner, surface - radius * down, radius, surface, False, rule)


def _bottom(sphere: BodySphere, down: Array) -> float:
    """Return how far a sphere reaches along a direction [m]."""
    return float(sphere.centre @ down) + sphere.radius


def _foot_sphere(body: LegBody, down: Array, low: float, reach: float) -> BodySphere | None:
    """Return the sphere at the extreme: of a link named as a foot first, then the lowest."""
    found = []
    for order, sphere in enumerate(body.spheres):
        word = foot_word(sphere.link) if sphere.stated else None
        share = NEAR if word is None else NAMED_NEAR
        behind = low - _bottom(sphere, down)
        if behind <= share * reach:
            rank = 99 if word is None else word
            found.append((rank, round(behind / (1e-6 * reach)), not sphere.stated, order, sphere))
    return min(found, key=lambda entry: entry[:4])[4] if found else None


def _standing_end(body: LegBody, down: Array, low: float, reach: float) -> Tip | None:
    """Return the foot at the centre of the lowest end face that stands on the ground."""
    found = []
    for end in body.ends:
        face = end.face
        behind = low - float(face.centre @ down)
        facing = float(face.normal @ down)
        if facing >= math.cos(FLAT_ANGLE) and behind <= (
            face.radius * math.sin(FLAT_ANGLE) + NEAR * reach
        ):
            found.append((behind, end))
    if not found:
        return None
    link, face = min(found, key=lambda entry: entry[0])[1]
    centre = face.centre - face.depth * face.normal
    rule = "centre of a cylinder's end face, radius the largest sphere inside it there (assumed)"
    return Tip(link, centre, face.depth, face.centre, False, rule)


def _round_tip(points: Array, heights: Array, low: float, reach: float) -> Ball | None:
    """Return the sphere that the vertices at the extreme lie on: the largest such region."""
    best = None
    for share in (0.01, 0.015, 0.02, 0.03, 0.045, 0.07, 0.1):
        chosen = heights >= low - share * reach
        near = np.unique(points[chosen], axis=0)
        levels = np.unique(np.round((low - heights[chosen]) / (0.002 * reach)))
        if len(near) < 12 or len(levels) < 3:
            continue
        ball = fitted_ball(near)
        if ball is not None and ball.radius <= 2 * LARGEST * reach:
            best = ball
    return best


def _middle(near: Array, down: Array, side: Array) -> tuple[Array, float]:
    """Return the middle of points across a direction [m] and their mean width there [m]."""
    first = side - (side @ down) * down
    size = float(np.linalg.norm(first))
    first = first / size if size > 1e-6 else _any_across(down)
    second = np.cross(down, first)
    middle, widths = (near[0] @ down) * down, []
    for unit in (first, second):
        along = near @ unit
        middle = middle + 0.5 * (along.max() + along.min()) * unit
        widths.append(float(along.max() - along.min()))
    return middle, 0.5 * sum(widths)


def _any_across(direction: Array) -> Array:
    """Return a unit vector across a direction."""
    across = np.cross(direction, np.eye(3)[int(np.abs(direction).argmin())])
    unit: Array = across / np.linalg.norm(across)
    return unit
