"""The upward direction: that of the legs' first axes, away from where feet can be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.chains import Axis, Chain, TreeFrames
from hexapod_pin.robot.rotations import cross
from hexapod_pin.robot.serial_chain import axis_points

COMMON = 0.8
"""Least share of the first axes' squares along one direction (27 deg off it) (*assumed*)."""

EXACT = 1e-6
"""A direction this near to an axis of the root link is that axis [rad]."""

SLACK = 5e-3
"""The same where the file itself is less exact than that: at most twice its own scatter [rad]."""

CLEAR = 0.1
"""Share of the legs' length by which tips must be below the hips to distinguish up from down."""

BENT = 0.3
"""Mean sine of a knee's angle over its range from which the side to which it folds is taken."""

NEAR_Z = 0.95
"""Least component along the root link's z of a line whose upper end is taken to be +z."""


class Up(NamedTuple):
    """The upward direction in the root link's frame: unit vector (3,), scatter [rad], a reason."""

    unit: Array
    scatter: float
    reason: str


def find_up(
    chains: Sequence[Chain],
    frames: TreeFrames,
    tips: dict[str, Array],
    stated: Mapping[str, float],
    root: str,
) -> Up:
    """Return up from the legs' first axes; else across the plane of the hips; else the root's z.

    Args:
        chains: the legs.
        frames: of the file at q = 0.
        tips: furthest point of each leg, by its label, root link's frame [m]. Shape (3,) each.
        stated: standing angles by joint name that are known [rad].
        root: name of the root link, for the reason.
    """
    axes = [frames.axes[chain.joints[0].name] for chain in chains]
    hips = np.array([axis.origin for axis in axes])
    line, scatter, source = _line(np.array([axis.unit for axis in axes]), hips)
    line = snap(line, scatter)
    sign, why = _sign(line, chains, frames, tips, stated)
    unit = sign * line + 0.0
    return Up(unit, scatter, f"up is {direction_text(unit)} of {root!r}: {source}, {why}")


def snap(unit: Array, scatter: float) -> Array:
    """Return the root link's axis that a unit vector (3,) is near to, else the vector itself."""
    axis = int(np.abs(unit).argmax())
    exact = np.zeros(3)
    exact[axis] = np.sign(unit[axis])
    off = float(np.linalg.norm(unit - exact))
    near = off <= max(EXACT, min(2 * scatter, SLACK))
    return exact if near else unit


def direction_text(unit: Array) -> str:
    """Return a unit vector (3,) as "+x", or by its numbers."""
    axis = int(np.abs(unit).argmax())
    if abs(abs(unit[axis]) - 1) < 1e-9:
        return ("+" if unit[axis] > 0 else "-") + "xyz"[axis]
    return "(" + ", ".join(f"{value:.4f}" for value in unit) + ")"


def _line(units: Array, hips: Array) -> tuple[Array, float, str]:
    """Return the upward line as a unit vector (3,), its scatter [rad], and from what."""
    values, vectors = np.linalg.eigh(units.T @ units / len(units))
    if values[-1] >= COMMON and _flat(hips, vectors[:, -1]):
        aligned = units * np.sign(units @ vectors[:, -1])[:, None]
        mean = aligned.mean(axis=0)
        mean = mean / np.linalg.norm(mean)
        scatter = float(np.sqrt(((aligned - mean) ** 2).sum(axis=1).mean()))
        return mean, scatter, "the common direction of the legs' first axes"
    spread, across = np.linalg.eigh(np.cov(hips.T))
    if _flat(hips, across[:, 0]):
        scatter = float(np.sqrt(max(spread[0], 0.0) / max(float(spread[1]), 1e-300)))
        return across[:, 0], scatter, "across the plane of the hips"
    return np.array([0.0, 0.0, 1.0]), 0.0, "the root link's z (assumed)"


def _flat(hips: Array, line: Array) -> bool:
    """Return whether the hips lie flatter along a line than in any direction across it."""
    offset = hips - hips.mean(axis=0)
    height = offset @ line
    across = offset - height[:, None] * line
    spread = np.linalg.svd(across, compute_uv=False)
    return bool(np.linalg.norm(height) < 0.5 * spread[1])


def _sign(
    line: Array,
    chains: Sequence[Chain],
    frames: TreeFrames,
    tips: dict[str, Array],
    stated: Mapping[str, float],
) -> tuple[float, str]:
    """Return whether up is along the line or against it, and from what.

    The feet are below the hips, by a share of the legs' length: in a known standing posture; on
    average over the joints' ranges (the same for any zero posture); at zero angles. The root
    link's z has priority over the last two, unless both contradict it and knees do not bend
    towards that side: legs fold their feet downwards.
    """
    standing, average, zero, bends = [], [], [], []
    hips = np.mean([frames.axes[chain.joints[0].name].origin for chain in chains], axis=0)
    known = all(joint.name in stated for chain in chains for joint in chain.joints)
    for chain in chains:
        axes, tip = [frames.axes[joint.name] for joint in chain.joints], tips[chain.label]
        units, origins = np.array([x.unit for x in axes]), np.array([x.origin for x in axes])
        points = np.vstack([axis_points(units, origins, tip), tip])
        length = max(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()), 1e-12)
        hip = points[0]
        if known:
            place = tip
            for axis, joint in zip(reversed(axes), reversed(chain.joints), strict=True):
                place = axis.turned(place, stated[joint.name])
            standing.append(float((place - hip) @ line) / length)
        average.append(float((mean_tip(chain, axes, tip) - hip) @ line) / length)
        zero.append(float((tip - hip) @ line) / length)
        bends.append(_bend(chain, axes, points, hips - hip, line))
    stand, mean, now = (float(np.mean(heights or [0.0])) for heights in (standing, average, zero))
    bend = float(np.mean(bends))
    if abs(stand) > CLEAR:
        return float(-np.sign(stand)), "feet below hips as it stands"
    upright = float(np.sign(line[2]))
    against = mean * upright > CLEAR and now * upright > -CLEAR and bend * upright > -BENT
    if abs(line[2]) > NEAR_Z and not against:
        return upright, "the side of the root link's z"
    if abs(bend) > BENT and bend * mean < 0.0:
        return float(-np.sign(bend)), "knees fold downwards over the joints' ranges"
    if abs(mean) > CLEAR:
        return float(-np.sign(mean)), "feet below hips over the joints' ranges"
    if abs(now) > CLEAR:
        return float(-np.sign(now)), "feet below hips at zero angles"
    side = float(np.sign(line[np.abs(line).argmax()]))
    return side, "its positive side (assumed)"


def mean_tip(chain: Chain, axes: Sequence[Axis], tip: Array) -> Array:
    """Return the mean place of a tip over its joints' ranges [m]: the same for any zero posture.

    Joints without a limited range below a full turn are averaged over all of it.
    """
    point = tip
    for joint, axis in zip(reversed(chain.joints), reversed(axes), strict=True):
        lower, upper = joint.limit("lower"), joint.limit("upper")
        limited = joint.kind != "continuous" and 0 < upper - lower < 2 * np.pi
        cos = sin = 0.0
        if limited:
            cos = float(np.sin(upper) - np.sin(lower)) / (upper - lower)
            sin = float(np.cos(lower) - np.cos(upper)) / (upper - lower)
        arm = axis.arm(point)
        point = point - arm + cos * arm + sin * cross(axis.unit, arm)
    return point


def _bend(chain: Chain, axes: Sequence[Axis], points: Array, inwards: Array, line: Array) -> float:
    """Return to which end of the line the last joint folds a leg that points outwards: -1 to 1.

    It is the sine of its angle from the stretched leg, mean over its range; 0 where its axis is no
    knee's. The same for any zero posture, place on the axis and sign of it.
    """
    axis, before = axes[-1], points[-2] - points[-3]
    across = cross(axis.unit, line)
    thigh = before - (before @ axis.unit) * axis.unit
    shank = points[-1] - points[-2]
    size = float(np.linalg.norm(thigh) * np.linalg.norm(shank))
    if np.linalg.norm(across) < NEAR_Z or size < 1e-12:
        return 0.0
    outwards = -np.sign(float(inwards @ across))
    mean = mean_tip(replace(chain, joints=chain.joints[-1:]), [axis], points[-1]) - points[-2]
    turned = float(cross(thigh, mean) @ axis.unit) / size
    lifts = float(cross(axis.unit, outwards * across) @ line)
    return turned * float(np.sign(lifts))
