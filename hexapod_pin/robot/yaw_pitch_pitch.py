r"""Closed-form geometry of a yaw-pitch-pitch leg.

```text
   z |   knee            hip frame: origin on axis 1 at the height of axis 2,
     |   o---.           x outward (from axis 1 to axis 2), z up along axis 1, y = z x x.
     | L2/    \ L3       Right-side legs are the left ones turned by pi about z: no sign is
  o--o--o      \         set by hand. q2, q3 > 0 lower the foot.
  yaw L1        o foot
```
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array

GEOMETRY_TOLERANCE = 1e-9
"""A leg counts as yaw-pitch-pitch when its geometry is within this [m, -]."""

BRANCHES = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""(fold, knee) of `YawPitchPitch.solve`: knee up, knee down, then both folded over the yaw axis."""


@dataclass(frozen=True)
class YawPitchPitch:
    """Closed-form geometry of one leg or of L stacked legs; math angles are `sign * q + offset`.

    Attributes:
        r_BH: rotation, hip axes as columns in base axes. Shape (3, 3) or (L, 3, 3).
        p_BH: hip origin in the base frame [m]. Shape (3,) or (L, 1, 3), as of all below.
        lengths: L1 (axis 1 to axis 2), L2 (axis 2 to axis 3), L3 (axis 3 to foot) [m].
        sign: +1 or -1 per joint.
        offset: math angle at q = 0 [rad].
    """

    r_BH: Array
    p_BH: Array
    lengths: Array
    sign: Array
    offset: Array

    @staticmethod
    def from_geometry(axes: Array, origins: Array, foot: Array) -> YawPitchPitch | None:
        """Return the geometry if the leg is of this class, else None.

        Axes 2 and 3 are parallel and perpendicular to axis 1, and the foot lies in the plane
        through axis 1 that they pierce at right angles. All arguments at q = 0 in base axes.

        Args:
            axes: unit joint axes. Shape (3, 3), one row per joint.
            origins: a point on each axis [m]. Shape (3, 3).
            foot: foot centre [m]. Shape (3,).
        """
        skew = np.linalg.norm(_cross(axes[1], axes[2]))
        tilt = abs(axes[0] @ axes[1])
        aside = abs((foot - origins[0]) @ axes[1])
        if max(skew, tilt, aside) > GEOMETRY_TOLERANCE:
            return None
        z = axes[0] if axes[0][2] >= 0 else -axes[0]
        hip, knee = (o - ((o - origins[0]) @ axes[1]) * axes[1] for o in origins[1:])
        p_BH = origins[0] + ((hip - origins[0]) @ z) * z
        x = _outward(hip - p_BH, _cross(axes[1], z), foot - p_BH)
        r_BH = np.stack([x, _cross(z, x), z], axis=1)
        sign = np.sign([axes[0] @ z, axes[1] @ r_BH[:, 1], axes[2] @ r_BH[:, 1]])
        femur, tibia = (knee - hip) @ r_BH, (foot - knee) @ r_BH
        lengths = np.array([(hip - p_BH) @ x, np.linalg.norm(femur), np.linalg.norm(tibia)])
        if min(lengths[1:]) <= GEOMETRY_TOLERANCE:
            return None
        pitch = [np.arctan2(-link[2], link[0]) for link in (femur, tibia)]
        offset = np.array([0.0, pitch[0], pitch[1] - pitch[0]])
        return YawPitchPitch(r_BH, p_BH, lengths, sign, offset)

    @staticmethod
    def stack(legs: Sequence[YawPitchPitch]) -> YawPitchPitch:
        """Stack the geometry of L legs, so that one call solves all."""
        rows = {
            name: np.stack([getattr(leg, name) for leg in legs])[:, None]
            for name in ("p_BH", "lengths", "sign", "offset")
        }
        return YawPitchPitch(r_BH=np.stack([leg.r_BH for leg in legs]), **rows)

    @property
    def links(self) -> tuple[Array, Array, Array]:
        """L1, L2 and L3 [m]: scalars for one leg, shape (L, 1) each for stacked legs."""
        return self.lengths[..., 0], self.lengths[..., 1], self.lengths[..., 2]

    def reach(self) -> tuple[Array, Array]:
        """Return the smallest and largest distance from axis 2 to the foot [m].

        Returns:
            Scalars for one leg, shape (L, 1) each for stacked legs.
        """
        _, l2, l3 = self.links
        return np.abs(l2 - l3), l2 + l3

    def to_hip(self, p_BF: Array) -> tuple[Array, Array]:
        """Return targets in the hip frame and their distance from the yaw axis [m].

        Args:
            p_BF: targets in the base frame [m]. Shape (N, 3), or (L, N, 3) for stacked legs.

        Returns:
            p_HF: shape of `p_BF`.
            radius: shape (N,) or (L, N).
        """
        p_HF = (p_BF - self.p_BH) @ self.r_BH
        return p_HF, np.hypot(p_HF[..., 0], p_HF[..., 1])

    def solve(
        self, p_HF: Array, radius: Array, fold: ArrayLike, knee: ArrayLike
    ) -> tuple[Array, Array]:
        """Return one branch for every target, without any range check.

        The knee uses tan(q3/2) = sqrt(((L2+L3)^2 - rho^2) / (rho^2 - (L2-L3)^2)), which keeps its
        digits at full stretch and full fold, where the arc cosine loses half of them.

        Args:
            p_HF: targets in the hip frame [m], from `to_hip`. Shape (N, 3) or (L, N, 3).
            radius: their distance from the yaw axis [m]. Shape (N,) or (L, N).
            fold: -1 where the leg is folded over the yaw axis, else 1. A number, or shape (L, 1).
            knee: 1 with the knee up, -1 with the knee down. A number, or shape (L, 1).

        Returns:
            q: joint angles [rad]. Shape of `p_HF`.
            outside: distance outside the reach, <= 0 inside [m]. Shape of `radius`.
        """
        x, y, z = p_HF[..., 0], p_HF[..., 1], p_HF[..., 2]
        l1, l2, l3 = self.links
        near, far = self.reach()
        fold, knee = np.asarray(fold, dtype=float), np.asarray(knee, dtype=float)
        u = fold * radius - l1
        rho = np.hypot(u, z)
        stretch = np.maximum((far - rho) * (far + rho), 0.0)
        bend = np.maximum((rho - near) * (rho + near), 0.0)
        q3 = knee * 2.0 * np.arctan2(np.sqrt(stretch), np.sqrt(bend))
        q2 = np.arctan2(-z, u) - np.arctan2(l3 * np.sin(q3), l2 + l3 * np.cos(q3))
        angles = np.stack([np.arctan2(fold * y, fold * x), q2, q3], axis=-1)
        return self.sign * (angles - self.offset), np.maximum(rho - far, near - rho)

    def solve_all(self, p_BF: Array) -> tuple[Array, Array, Array]:
        """Return all four branches of one leg, in the order of BRANCHES, without range checks.

        Args:
            p_BF: targets in the base frame [m]. Shape (N, 3).

        Returns:
            q: joint angles [rad]. Shape (N, 4, 3).
            outside: distance outside the reach, <= 0 inside [m]. Shape (N, 4).
            radius: distance from the yaw axis [m]. Shape (N,).
        """
        p_HF, radius = self.to_hip(p_BF)
        q, outside = zip(*(self.solve(p_HF, radius, *branch) for branch in BRANCHES), strict=True)
        return np.stack(q, axis=1), np.stack(outside, axis=1), radius


def _outward(hip: Array, sideways: Array, foot: Array) -> Array:
    """Return the unit vector from axis 1 to axis 2; towards the foot where these intersect."""
    length = float(np.linalg.norm(hip))
    if length > GEOMETRY_TOLERANCE:
        return hip / length
    return sideways if sideways @ foot >= 0 else -sideways


def _cross(a: Array, b: Array) -> Array:
    """Return a x b of two vectors, ten times as fast as `np.cross`."""
    (a1, a2, a3), (b1, b2, b3) = a, b
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
