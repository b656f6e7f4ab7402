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

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array

TOLERANCE = 1e-9
"""A leg counts as yaw-pitch-pitch when its geometry is within this [m, -]."""


@dataclass(frozen=True)
class YawPitchPitch:
    """Closed-form geometry: the math angles are `sign * q + offset`.

    Attributes:
        r_BH: rotation, hip axes as columns in base axes. Shape (3, 3).
        p_BH: hip origin in the base frame [m]. Shape (3,).
        lengths: L1 (axis 1 to axis 2), L2 (axis 2 to axis 3), L3 (axis 3 to foot) [m]. Shape (3,).
        sign: +1 or -1 per joint. Shape (3,).
        offset: math angle at q = 0 [rad]. Shape (3,).
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
        skew = np.linalg.norm(np.cross(axes[1], axes[2]))
        tilt = abs(axes[0] @ axes[1])
        aside = abs((foot - origins[0]) @ axes[1])
        if max(skew, tilt, aside) > TOLERANCE:
            return None
        z = axes[0] if axes[0][2] >= 0 else -axes[0]
        hip, knee = (o - ((o - origins[0]) @ axes[1]) * axes[1] for o in origins[1:])
        p_BH = origins[0] + ((hip - origins[0]) @ z) * z
        x = _outward(hip - p_BH, np.cross(axes[1], z), foot - p_BH)
        r_BH = np.stack([x, np.cross(z, x), z], axis=1)
        sign = np.sign([axes[0] @ z, axes[1] @ r_BH[:, 1], axes[2] @ r_BH[:, 1]])
        femur, tibia = (knee - hip) @ r_BH, (foot - knee) @ r_BH
        lengths = np.array([(hip - p_BH) @ x, np.linalg.norm(femur), np.linalg.norm(tibia)])
        if min(lengths[1:]) <= TOLERANCE:
            return None
        pitch = [np.arctan2(-link[2], link[0]) for link in (femur, tibia)]
        offset = np.array([0.0, pitch[0], pitch[1] - pitch[0]])
        return YawPitchPitch(r_BH, p_BH, lengths, sign, offset)

    def reach(self) -> tuple[float, float]:
        """Return the smallest and largest distance from axis 2 to the foot [m]."""
        _, l2, l3 = self.lengths
        return float(abs(l2 - l3)), float(l2 + l3)

    def solve(self, p_BF: Array) -> tuple[Array, Array, Array]:
        """Return all four branches for each target, without any range check.

        The knee uses tan(q3/2) = sqrt(((L2+L3)^2 - rho^2) / (rho^2 - (L2-L3)^2)), which keeps its
        digits at full stretch and full fold, where the arc cosine loses half of them.

        Args:
            p_BF: targets in the base frame [m]. Shape (N, 3).

        Returns:
            q: joint angles, branches in the order knee up, knee down, and the same two with the
                leg folded over the yaw axis. Shape (N, 4, 3).
            outside: distance outside the reach, <= 0 inside [m]. Shape (N, 4).
            radius: distance from the yaw axis [m]. Shape (N,).
        """
        x, y, z = np.moveaxis((p_BF - self.p_BH) @ self.r_BH, -1, 0)
        l1, l2, l3 = self.lengths
        near, far = self.reach()
        radius = np.hypot(x, y)
        q, outside = np.empty((len(x), 4, 3)), np.empty((len(x), 4))
        for branch in range(4):
            fold, knee = (1, 1, -1, -1)[branch], (1, -1, 1, -1)[branch]
            u = fold * radius - l1
            rho = np.hypot(u, z)
            outside[:, branch] = np.maximum(rho - far, near - rho)
            stretch = np.maximum((far - rho) * (far + rho), 0.0)
            bend = np.maximum((rho - near) * (rho + near), 0.0)
            q3 = knee * 2.0 * np.arctan2(np.sqrt(stretch), np.sqrt(bend))
            q2 = np.arctan2(-z, u) - np.arctan2(l3 * np.sin(q3), l2 + l3 * np.cos(q3))
            q[:, branch] = np.stack([np.arctan2(fold * y, fold * x), q2, q3], axis=-1)
        return self.sign * (q - self.offset), outside, radius


def _outward(hip: Array, sideways: Array, foot: Array) -> Array:
    """Return the unit vector from axis 1 to axis 2; towards the foot where these intersect."""
    length = float(np.linalg.norm(hip))
    if length > TOLERANCE:
        return hip / length
    return sideways if sideways @ foot >= 0 else -sideways
