"""Which way is up: the common direction of the legs' first axes, away from where feet can be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.chains import Chain
from hexapod_pin.robot.recognition.tree_frames import Axis, TreeFrames, turned_about

COMMON = 0.8
"""Least share of the first axes' squares along one direction (27 deg off it) (*assumed*)."""

EXACT = 1e-6
"""A direction this near to an axis of the root link is that axis [rad]."""

SLACK = 5e-3
"""The same where the file itself is less exact than that: at most twice its own scatter [rad]."""

CLEAR = 0.1
"""Share of the legs' length by which tips must be below the hips to tell up from down."""

NEAR_Z = 0.7
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
    line, scatter, how = _line(np.array([axis.unit for axis in axes]), hips)
    line = snap(line, scatter)
    sign, why = _sign(line, chains, frames, tips, stated)
    unit = sign * line + 0.0
    return Up(unit, scatter, f"up is {direction_text(unit)} of {root!r}: {how}, {why}")


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
    return np.array([0.0, 0.0, 1.0]), 0.0, "the root link's z (assumed: nothing tells)"


def _flat(hips: Array, line: Array) -> bool:
    """Tell whether the hips lie flatter along a line than in any direction across it."""
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

    Told by where feet are below hips, as a share of the legs' length: as the robot is known to
    stand; on average over the joints' ranges (the same for any zero posture); at zero angles. The
    root link's z goes before the last two, unless they tell the opposite with one voice.
    """
    standing, average, zero = [], [], []
    known = all(joint.name in stated for chain in chains for joint in chain.joints)
    for chain in chains:
        axes, tip = [frames.axes[joint.name] for joint in chain.joints], tips[chain.label]
        hip, length = axes[0].origin, max(_length(axes, tip), 1e-12)
        if known:
            place = _placed(axes, tip, [stated[joint.name] for joint in chain.joints])
            standing.append(float((place - hip) @ line) / length)
        average.append(float((mean_tip(chain, axes, tip) - hip) @ line) / length)
        zero.append(float((tip - hip) @ line) / length)
    stand, mean, now = (float(np.mean(heights or [0.0])) for heights in (standing, average, zero))
    if abs(stand) > CLEAR:
        return float(-np.sign(stand)), "feet below hips as it stands"
    upright = float(np.sign(line[2]))
    if abs(line[2]) > NEAR_Z and not (mean * upright > CLEAR and now * upright > -CLEAR):
        return upright, "the side of the root link's z"
    if abs(mean) > CLEAR:
        return float(-np.sign(mean)), "feet below hips over the joints' ranges"
    if abs(now) > CLEAR:
        return float(-np.sign(now)), "feet below hips at zero angles"
    side = float(np.sign(line[np.abs(line).argmax()]))
    return side, "its positive side (assumed: nothing tells)"


def _placed(axes: Sequence[Axis], tip: Array, angles: Sequence[float]) -> Array:
    """Return a tip with its joints at angles [m]."""
    for axis, angle in zip(reversed(axes), reversed(angles), strict=True):
        tip = turned_about(axis, tip, angle)
    return tip


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
        point = point - arm + cos * arm + sin * np.cross(axis.unit, arm)
    return point


def _length(axes: Sequence[Axis], tip: Array) -> float:
    """Return the length of a leg along its joints' origins [m]."""
    points = np.array([*(axis.origin for axis in axes), tip])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
