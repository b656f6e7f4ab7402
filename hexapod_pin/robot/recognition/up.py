"""Which way is up: the common direction of the legs' first axes, away from where feet can be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.chains import Chain
from hexapod_pin.robot.recognition.tree_frames import Axis, TreeFrames

COMMON = 0.8
"""Least share of the first axes' squares along one direction (27 deg off it) (*assumed*)."""

EXACT = 1e-6
"""A direction this near to an axis of the root link is that axis [rad]."""

SLACK = 5e-3
"""The same where the file itself is less exact than that: at most twice its own scatter [rad]."""

CLEAR = 0.1
"""Share of the legs' length by which tips must be below the hips to tell up from down."""


class Up(NamedTuple):
    """The upward direction in the root link's frame: unit vector (3,), scatter [rad], a reason."""

    unit: Array
    scatter: float
    reason: str


def find_up(chains: Sequence[Chain], frames: TreeFrames, tips: dict[str, Array], root: str) -> Up:
    """Return up from the legs' first axes; else across the plane of the hips; else the root's z.

    Args:
        chains: the legs.
        frames: of the file at q = 0.
        tips: furthest point of each leg, by its label, root link's frame [m]. Shape (3,) each.
        root: name of the root link, for the reason.
    """
    axes = [frames.axes[chain.joints[0].name] for chain in chains]
    hips = np.array([axis.origin for axis in axes])
    line, scatter, how = _line(np.array([axis.unit for axis in axes]), hips)
    line, snapped = snap(line, scatter)
    reach = float(np.mean([_length(chain, frames, tips[chain.label]) for chain in chains]))
    sign, why = _sign(line, chains, frames, tips, reach)
    unit = sign * line + 0.0
    return Up(unit, scatter, f"up is {direction_text(unit)} of {root!r}: {how}, {why}")


def snap(unit: Array, scatter: float) -> tuple[Array, bool]:
    """Return the root link's axis that a unit vector (3,) is near to, else the vector itself."""
    axis = int(np.abs(unit).argmax())
    exact = np.zeros(3)
    exact[axis] = np.sign(unit[axis])
    off = float(np.linalg.norm(unit - exact))
    near = off <= max(EXACT, min(2 * scatter, SLACK))
    return (exact, True) if near else (unit, False)


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
        scatter = float(np.sqrt(max(spread[0], 0.0) / spread[1]))
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
    line: Array, chains: Sequence[Chain], frames: TreeFrames, tips: dict[str, Array], reach: float
) -> tuple[float, str]:
    """Return whether up is along the line or against it, and from what."""
    now, mean = [], []
    for chain in chains:
        axes = [frames.axes[joint.name] for joint in chain.joints]
        now.append(float((tips[chain.label] - axes[0].origin) @ line))
        average = mean_tip(chain, axes, tips[chain.label])
        mean.append(float((average - axes[0].origin) @ line))
    at_zero, on_average = np.mean(now) / reach, np.mean(mean) / reach
    upright = float(line[2])
    if abs(upright) > 0.7 and max(abs(at_zero), abs(on_average)) > 0:
        against = min(at_zero * np.sign(upright), on_average * np.sign(upright))
        agree = np.sign(at_zero) == np.sign(on_average)
        if not (agree and against > 0 and abs(at_zero) > CLEAR and abs(on_average) > CLEAR):
            return float(np.sign(upright)), "the side of the root link's z"
    for height, why in (
        (on_average, "feet below hips over the joints' ranges"),
        (at_zero, "feet below hips at zero angles"),
    ):
        if abs(height) > CLEAR:
            return float(-np.sign(height)), why
    return float(np.sign(line[np.abs(line).argmax()])), "the positive side (nothing tells)"


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


def _length(chain: Chain, frames: TreeFrames, tip: Array) -> float:
    """Return the length of a leg along its joints' origins [m]."""
    points = np.array([*(frames.axes[joint.name].origin for joint in chain.joints), tip])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
