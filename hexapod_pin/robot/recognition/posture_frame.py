"""What the search of a standing posture takes and gives: legs in trunk axes, angles, a reason."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.serial_chain import JointAxis


@dataclass(frozen=True, eq=False)
class LegFrame:
    """One leg at q = 0 in trunk axes (x forward, y left, z up; origin of the root link).

    Attributes:
        name: of the leg.
        axes: unit joint axes, from the trunk outwards. Shape (k, 3).
        origins: a point on each axis [m]. Shape (k, 3).
        tip: centre of the foot sphere [m]. Shape (3,).
        radius: of that sphere [m].
        lower: lower joint limits [rad]; -inf where there is none. Shape (k,).
        upper: upper joint limits [rad]; inf where there is none. Shape (k,).
        walking: which joints walk, from the trunk outwards. Two or three; the others are held.
        joints: names of the joints, for what is said; empty: "joint 1" and so on. k or none.
        ankle: where the link that carries the foot begins, when its joint is held already [m];
            None: at the last joint. Shape (3,).
    """

    name: str
    axes: Array
    origins: Array
    tip: Array
    radius: float
    lower: Array
    upper: Array
    walking: tuple[int, ...]
    joints: tuple[str, ...] = ()
    ankle: Array | None = None

    def joint(self, index: int) -> str:
        """Return the name of one joint."""
        return self.joints[index] if self.joints else f"joint {index + 1}"


@dataclass(frozen=True, eq=False)
class StandingPosture:
    """How a robot stands.

    Attributes:
        angles: of every joint, walking or held, leg by leg [rad]. Shape (k,) each.
        height: of the origin of the root link above the ground [m].
        reason: one sentence: how the feet stand, and how near the limits are.
    """

    angles: tuple[Array, ...]
    height: float
    reason: str


def turned(axis: JointAxis, points: Array, angle: float | Array) -> Array:
    """Return points (..., 3) turned about an axis by angles (...) [rad]."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    moved: Array = axis.origin + axis.rotate(points - axis.origin, c, s)
    return moved


def with_joint_at(leg: LegFrame, index: int, angle: float) -> LegFrame:
    """Return the leg with one joint at an angle [rad] and no longer a joint.

    Its place in `walking` is lost; the places of the joints beyond it move down.
    """
    axis = JointAxis.of(leg.axes[index], leg.origins[index])
    c, s = np.cos([angle]), np.sin([angle])
    axes, origins = leg.axes.copy(), leg.origins.copy()
    axes[index + 1 :] = axis.rotate(axes[index + 1 :], c, s)
    origins[index + 1 :] = turned(axis, origins[index + 1 :], angle)
    if leg.ankle is not None:
        ankle: Array | None = turned(axis, leg.ankle, angle)
    else:
        ankle = axis_points(leg)[index] if index == len(axes) - 1 else None
    left = [k for k in range(len(axes)) if k != index]
    return replace(
        leg,
        axes=axes[left],
        origins=origins[left],
        tip=turned(axis, leg.tip, angle),
        ankle=ankle,
        lower=leg.lower[left],
        upper=leg.upper[left],
        walking=tuple(k - (k > index) for k in leg.walking if k != index),
        joints=tuple(leg.joints[k] for k in left) if leg.joints else (),
    )


def nearest_on_axis(unit: Array, origin: Array, point: Array) -> Array:
    """Return the point of an axis nearest to another point: the same in every convention."""
    foot: Array = origin + ((point - origin) @ unit) * unit
    return foot


def axis_points(leg: LegFrame) -> Array:
    """Return for each axis its point nearest to the next axis' point, outermost to the tip [m].

    These points move with their links, whatever the angles at which they are taken. Shape (k, 3).
    """
    points, beyond = np.zeros(leg.origins.shape), leg.tip
    for k in range(len(points) - 1, -1, -1):
        beyond = points[k] = nearest_on_axis(leg.axes[k], leg.origins[k], beyond)
    return points


def leg_length(leg: LegFrame) -> float:
    """Return the length of the leg beyond its first walking joint's link [m]."""
    points = np.vstack([axis_points(leg), leg.tip])
    return float(np.linalg.norm(np.diff(points[leg.walking[0] + 1 :], axis=0), axis=1).sum())


def middle_of(lower: Array, upper: Array) -> Array:
    """Return the middle of joint limits, 0 for a joint without [rad]."""
    bounded = np.isfinite(lower) & np.isfinite(upper)
    low, high = np.where(bounded, lower, 0.0), np.where(bounded, upper, 0.0)
    return np.asarray(0.5 * (low + high))
