"""The feet are those of the file if they are at the tips, else the tips of the robot's shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.robot.description.urdf_file import LARGEST_RADIUS, POINT, Joint, UrdfFile
from hexapod_pin.robot.recognition.chains import Axis, Pose, TreeFrames
from hexapod_pin.robot.recognition.layout import FOOT_WORDS, foot_word, named_foot
from hexapod_pin.robot.recognition.legs import Legs
from hexapod_pin.robot.recognition.shape_points import Ball, BodySphere, LegBody, fitted_ball
from hexapod_pin.robot.rotations import perpendicular

AT_TIP = 0.15
"""A frame further from the tip than this share of the last link is not the foot (*assumed*)."""

SAME = 1e-3
"""Distance below which a frame and a tip are the same place [m]."""

TINY = 1e-6
"""Distance below which a frame is on a joint's axis [m]."""


FRAMES_AGREE = (
    "the frame called a foot (tips of the shapes differ from leg to leg, the frames agree)"
)


@dataclass(frozen=True, eq=False)
class FoundFoot:
    """A foot at q = 0.

    Attributes:
        link: that carries it.
        own: whether the foot is that link itself: its first collision sphere, or its frame.
        centre: of the sphere in the root link's frame [m]. Shape (3,).
        radius: [m].
        rule: from what it was found; empty where the file states it.
        settled: whether it stays, however the robot stands.
    """

    link: str
    own: bool
    centre: Array
    radius: float
    rule: str
    settled: bool = False


def shape_foot(body: LegBody, down: Array) -> FoundFoot:
    """Return the foot at the extreme of a body's shapes along the unit vector `down` (3,)."""
    tip = tip_towards(body, down)
    rule = "" if tip.stated and foot_word(tip.link) is not None else tip.rule
    return FoundFoot(tip.link, tip.stated, tip.centre, tip.radius, rule)


def frame_foot(file: UrdfFile, frames: TreeFrames, link: str, rule: str) -> FoundFoot:
    """Return the foot that a link is: its first collision sphere, else a point at its frame."""
    sphere = file.foot_sphere(link) or POINT
    centre = frames.links[link].act(np.array(sphere.centre))
    return FoundFoot(link, True, centre, sphere.radius, rule, settled=True)


GUESSED = "(assumed; no shape"
"""Part of the rule of a foot that is guessed from a centre of mass."""


def bare_foot(file: UrdfFile, frames: TreeFrames, body: LegBody, leg: str) -> FoundFoot:
    """Return a foot where no shape can be read: a frame at the end, or from the centre of mass.

    A uniform rod from the last joint has its end at twice the distance of its centre of mass.

    Raises:
        UrdfError: there is neither; it names the leg and the remedies.
    """
    masses = [(file.link_by_name[name], frames.links[name]) for name in body.chain.body]
    heavy = [(link.mass or 0.0, pose.act(np.array(link.com))) for link, pose in masses]
    total = sum(mass for mass, _ in heavy)
    com = sum((mass * place for mass, place in heavy), np.zeros(3)) / total if total > 0 else None
    arm = np.zeros(3) if com is None else body.axis.arm(com)
    ends = sorted(
        body.chain.body,
        key=lambda name: (
            foot_word(name) is not None, np.linalg.norm(body.axis.arm(frames.links[name].position))
        ),
    )  # fmt: skip
    end = body.axis.arm(frames.links[ends[-1]].position)
    why = f": {body.lost[0]}" if body.lost else ""
    if np.linalg.norm(end) > max(1.2 * float(np.linalg.norm(arm)), TINY):
        return frame_foot(file, frames, ends[-1], f"frame of the link (no shape{why})")
    if com is not None and np.linalg.norm(arm) > TINY and np.isfinite(com).all():
        rule = f"twice the centre of mass as of a uniform rod, a point {GUESSED}{why})"
        return FoundFoot(body.chain.body[0], False, com + arm, 0.0, rule, settled=True)
    text = f"leg {leg}: its last link {body.chain.body[0]!r} has no shape, no inertial and no frame"
    raise UrdfError(
        file.source,
        [
            f"{text} from which its foot follows{why}; give feet=[...], or package_path=[...] for"
            " its meshes"
        ],
    )


def trusted_frames(
    file: UrdfFile, frames: TreeFrames, bodies: Sequence[LegBody]
) -> tuple[dict[str, str], str] | None:
    """Return leg label -> frame of a foot that is trusted as a point, and why.

    Links named as feet without a shape that lie at the end of the shapes are the feet; and where
    the shapes' tips differ from leg to leg, frames that agree are used.
    """
    named = {body.chain.label: named_foot(file, body.chain.body[0]) for body in bodies}
    links = {label: link for label, link in named.items() if link is not None}
    if len(links) < len(bodies) or any(body.empty for body in bodies):
        return None
    tips = np.array([body.reach for body in bodies])
    ends = np.array(
        [
            np.linalg.norm(body.axis.arm(frames.links[links[body.chain.label]].position))
            for body in bodies
        ]
    )
    bare = all(file.link_by_name[link].element.find("collision") is None for link in links.values())
    if bare and (np.abs(ends - tips) <= SAME).all():
        return links, ""
    unlike = np.ptp(tips) > 0.05 * tips.mean() and np.ptp(ends) < 0.01 * ends.mean()
    return (links, FRAMES_AGREE) if unlike else None


def off_tip(file: UrdfFile, frames: TreeFrames, body: LegBody, foot: FoundFoot) -> tuple[str, str]:
    """Return a link that is named as a foot and is not at the tip, and where it is."""
    if foot.own and foot_word(foot.link) is not None:
        return "", ""
    for name in body.chain.body:
        word = foot_word(name)
        if word is None or (name == body.chain.body[0] and FOOT_WORDS[word] == "tarsus"):
            continue
        place = frames.links[name].position
        away = float(np.linalg.norm(place - foot.centre))
        if away > foot.radius + SAME:
            at_knee = np.linalg.norm(body.axis.arm(place)) < AT_TIP * max(body.reach, SAME)
            where = "at the knee" if at_knee else "off the tip"
            return name, f"{where}, {1e3 * away:.0f} mm from the centre of the foot"
    return "", ""


def local(pose: Pose, point: Array) -> Array:
    """Return a point of the root link's frame in a link's frame, rounding noise removed [m]."""
    inside = pose.into(point)
    return np.where(np.abs(inside) < 1e-15, 0.0, inside)


# Where a leg's last body touches the ground: the extreme of its shapes in a direction.

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
    first = first / size if size > 1e-6 else perpendicular(down)
    second = np.cross(down, first)
    middle, widths = (near[0] @ down) * down, []
    for unit in (first, second):
        along = near @ unit
        middle = middle + 0.5 * (along.max() + along.min()) * unit
        widths.append(float(along.max() - along.min()))
    return middle, 0.5 * sum(widths)


# The feet of all legs are chosen together.

Feet = tuple[FoundFoot, ...]


def provisional_feet(
    file: UrdfFile,
    legs: Legs,
    names: Sequence[str],
    given: Sequence[str] | None,
    radius: float | None,
) -> Feet:
    """Return the feet at the points furthest from the legs' last joints.

    Args:
        file: the URDF.
        legs: the legs.
        names: of the legs, in the same order.
        given: foot links, one per leg; None to find them.
        radius: of all feet [m]; None takes each foot's own.

    Raises:
        UrdfError: a leg without any sign of a foot; given feet that are not one on each leg.
        UnknownNameError: a given foot that is no link.
        ParameterError: a radius out of range.
    """
    if radius is not None and not 0.0 <= radius <= LARGEST_RADIUS:
        raise ParameterError("foot_radius", radius, f"from 0 to {LARGEST_RADIUS:g} m")
    downs = [np.zeros(3) if body.empty else body.furthest() for body in legs.bodies]
    if given is not None:
        return _sized(_given_feet(file, legs, names, given), radius)
    if (frames := trusted_frames(file, legs.frames, legs.bodies)) is not None:
        links, rule = frames
        return _sized(
            [frame_foot(file, legs.frames, links[c.label], rule) for c in legs.chains], radius
        )
    return _sized(_found(file, legs, names, downs), radius, downs)


def standing_feet(
    file: UrdfFile, legs: Legs, names: Sequence[str], before: Feet, angles: Sequence[Array],
    down: Array, radius: float | None,
) -> Feet:  # fmt: skip
    """Return the feet at the lowest points of the standing posture.

    Args:
        file: the URDF.
        legs: the legs.
        names: of the legs, in the same order.
        before: the provisional feet: settled ones stay.
        angles: of every leg's joints in that posture [rad].
        down: downward unit vector in the root link's frame. Shape (3,).
        radius: of all feet [m]; None takes each foot's own.
    """
    downs = [
        _unturned(body.chain.joints, legs, q, down)
        for body, q in zip(legs.bodies, angles, strict=True)
    ]
    found = _found(file, legs, names, downs)
    feet = [old if old.settled else new for old, new in zip(before, found, strict=True)]
    return _sized(feet, radius, downs)


def _found(
    file: UrdfFile, legs: Legs, names: Sequence[str], downs: Sequence[Array]
) -> list[FoundFoot]:
    """Return the feet of the legs' shapes along a direction each; `bare_foot` without shapes."""
    findings, feet = [], []
    for name, body, down in zip(names, legs.bodies, downs, strict=True):
        try:
            bare = body.empty
            foot = bare_foot(file, legs.frames, body, name) if bare else shape_foot(body, down)
            feet.append(foot)
        except UrdfError as error:
            findings += error.findings
    if findings:
        raise UrdfError(file.source, findings)
    return feet


def _given_feet(
    file: UrdfFile, legs: Legs, names: Sequence[str], given: Sequence[str]
) -> list[FoundFoot]:
    """Return the given feet in the order of the legs."""
    for link in given:
        if link not in file.link_by_name:
            raise UnknownNameError("foot link", link, list(file.link_by_name))
    twice = sorted({link for link in given if list(given).count(link) > 1})
    feet, findings = list[FoundFoot](), list[str]()
    if twice:
        findings.append(f"feet: {', '.join(twice)} given twice; give each link once")
    for name, body in zip(names, legs.bodies, strict=True):
        on_leg = [link for link in given if link in body.chain.body]
        if len(on_leg) == 1:
            feet.append(_given_foot(file, legs, name, body, on_leg[0]))
        else:
            links = ", ".join(body.chain.body)
            findings.append(
                f"leg {name}: {len(on_leg)} of the given feet on it; give one of {links}"
            )
    if not findings and len(given) != len(feet):
        findings.append(f"{len(given)} feet given for {len(feet)} legs; give each foot link once")
    if findings:
        raise UrdfError(file.source, findings)
    return feet


def _given_foot(file: UrdfFile, legs: Legs, leg: str, body: LegBody, link: str) -> FoundFoot:
    """Return a given link's sphere or frame; where that is at the knee the tip of the shapes."""
    foot = frame_foot(file, legs.frames, link, "")
    if np.linalg.norm(body.axis.arm(foot.centre)) > SAME * max(body.reach, SAME):
        return foot
    if body.empty:
        joint = body.chain.joints[-1].name
        text = f"leg {leg}: foot {link!r} is on the axis of the last joint {joint!r}"
        raise UrdfError(file.source, [f"{text}; give feet=[...] a link at the tip"])
    return shape_foot(body, body.furthest())


def _sized(
    feet: Sequence[FoundFoot], radius: float | None, downs: Sequence[Array] | None = None
) -> Feet:
    """Return the feet with the radius that the user gives, if any: tips of shapes stay in place."""
    if radius is None:
        return tuple(feet)
    directions = [np.zeros(3)] * len(feet) if downs is None else downs
    return tuple(
        replace(
            foot,
            radius=float(radius),
            centre=foot.centre if foot.own else foot.centre + (foot.radius - radius) * down,
        )
        for foot, down in zip(feet, directions, strict=True)
    )


def _unturned(joints: Sequence[Joint], legs: Legs, angles: Array, down: Array) -> Array:
    """Return the downward direction of a posture in the last body's place at q = 0. Shape (3,)."""
    for joint, angle in zip(joints, angles, strict=True):
        unit = legs.frames.axes[joint.name].unit
        moved = float(angle) - legs.places.get(joint.name, 0.0)
        down = Axis(np.zeros(3), unit).turned(down, -moved)
    return down
