"""The feet of a robot: the file's own where they are at the tips, else the tips of its shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import UrdfError
from hexapod_pin.robot.description.urdf_file import LARGEST_LENGTH, Sphere, UrdfFile
from hexapod_pin.robot.loading.limbs import FOOT_WORDS
from hexapod_pin.robot.recognition.leg_body import LegBody
from hexapod_pin.robot.recognition.tips import foot_word, tip_towards
from hexapod_pin.robot.recognition.tree_frames import Pose, TreeFrames

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
        rule: from what it was found; empty where the file says it.
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
    sphere = file.link_by_name[link].collision_sphere or Sphere(0.0, (0.0, 0.0, 0.0))
    if not np.isfinite([sphere.radius, *sphere.centre]).all() or sphere.radius < 0:
        text = f"link {link!r}: collision sphere of radius {sphere.radius:g} m at {sphere.centre}"
        raise UrdfError(
            file.source,
            [f"{text}; must be numbers up to {LARGEST_LENGTH:g} m, the radius not negative"],
        )
    centre = frames.links[link].act(np.array(sphere.centre))
    return FoundFoot(link, True, centre, sphere.radius, rule, settled=True)


def named_foot(file: UrdfFile, body: LegBody) -> str | None:
    """Return the link fixed to a leg's last one that is called a foot; an earlier word wins."""
    fixed = file.rigid_group(body.chain.body[0])[1:]
    ranked = [(foot_word(name), -k, name) for k, name in enumerate(fixed)]
    return min(((r, k, n) for r, k, n in ranked if r is not None), default=(0, 0, None))[2]


def bare_foot(file: UrdfFile, frames: TreeFrames, body: LegBody, leg: str) -> FoundFoot:
    """Return a foot where no shape can be read: a frame at the end, or from the centre of mass.

    A uniform rod from the last joint has its end at twice the distance of its centre of mass.

    Raises:
        UrdfError: there is neither; it names the leg and the ways out.
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
        rule = f"twice the centre of mass as of a uniform rod, a point (assumed; no shape{why})"
        return FoundFoot(body.chain.body[0], False, com + arm, 0.0, rule, settled=True)
    text = f"leg {leg}: its last link {body.chain.body[0]!r} has no shape, no inertial and no frame"
    raise UrdfError(
        file.source,
        [
            f"{text} that tells where its foot is{why}; give feet=[...], or package_path=[...] for"
            " its meshes"
        ],
    )


def trusted_frames(
    file: UrdfFile, frames: TreeFrames, bodies: Sequence[LegBody]
) -> tuple[dict[str, str], str] | None:
    """Return leg label -> frame of a foot that is trusted as a point, and why.

    Links called feet that have no shape and end where the shapes do say it themselves; and where
    shapes' tips differ from leg to leg, frames that agree are better.
    """
    named = {body.chain.label: named_foot(file, body) for body in bodies}
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
    """Return a link that is called a foot and is not at the tip, and what is to be said of it."""
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
