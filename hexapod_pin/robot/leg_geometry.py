"""The geometry of one leg gives its foot position, Jacobian and distance from singular postures.

Everything is read from the robot's model with walking joints at zero and held joints at the places
where they are held. Angles in rad, lengths in m, base axes.

A leg of three joints follows a foot path in space. A leg of two joints follows two components of
it: height, and travel along one horizontal direction; its foot then scrubs in the third.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ReachError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.rotations import cross
from hexapod_pin.robot.serial_chain import SerialChain

# Closed-form geometry of a yaw-pitch-pitch leg.
#
# ```text
#    z |   knee            hip frame: origin on axis 1 at the height of axis 2,
#      |   o---.           x outward (from axis 1 to axis 2), z up along axis 1, y = z x x.
#      | L2/    \ L3       Right-side legs are the left ones turned by pi about z: no sign is
#   o--o--o      \         set by hand. q2, q3 > 0 lower the foot.
#   yaw L1        o foot
# ```

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
        skew = np.linalg.norm(cross(axes[1], axes[2]))
        tilt = abs(axes[0] @ axes[1])
        aside = abs((foot - origins[0]) @ axes[1])
        if max(skew, tilt, aside) > GEOMETRY_TOLERANCE:
            return None
        z = axes[0] if axes[0][2] >= 0 else -axes[0]
        hip, knee = (o - ((o - origins[0]) @ axes[1]) * axes[1] for o in origins[1:])
        p_BH = origins[0] + ((hip - origins[0]) @ z) * z
        x = _outward(hip - p_BH, cross(axes[1], z), foot - p_BH)
        r_BH = np.stack([x, cross(z, x), z], axis=1)
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


# Geometry of one leg: foot position and Jacobian for any sign and zero convention.

POSITION_TOLERANCE = 1e-9
"""A foot is on the yaw axis, or a numerical solution found, within this distance [m]."""

ANGLE_TOLERANCE = 1e-9
"""A joint angle is outside its limits when it is beyond them by more than this [rad]."""


@dataclass(frozen=True)
class LegGeometry(Immutable):
    """One leg of a robot, base frame, joints proximal first.

    Attributes:
        name: the leg's name.
        joints: names of the J joints it walks with. Two or three.
        axes: unit joint axes at q = 0, base axes. Shape (J, 3), one row per joint.
        origins: joint origins at q = 0, base frame [m]. Shape (J, 3).
        foot: foot centre at q = 0, base frame [m]. Shape (3,).
        lower: lower joint limits [rad]. Shape (J,).
        upper: upper joint limits [rad]. Shape (J,).
        posture: joint angles of the robot's standing posture [rad]. Shape (J,).
        closed_form: the yaw-pitch-pitch geometry, or None for a leg of another shape.
        task: directions in base axes along which the foot follows its path, for a leg of two
            joints: travel and height. None: all three. Shape (2, 3).
    """

    name: str
    joints: tuple[str, ...]
    axes: Array
    origins: Array
    foot: Array
    lower: Array
    upper: Array
    posture: Array
    closed_form: YawPitchPitch | None
    task: Array | None = None

    @cached_property
    def chain(self) -> SerialChain:
        """The leg as a serial chain."""
        return SerialChain.of(self.axes, self.origins, self.foot)

    def forward(self, q: ArrayLike) -> Array:
        """Return the foot centre in the base frame [m].

        Args:
            q: joint angles [rad]. Shape (..., J).

        Returns:
            p_BF. Shape (..., 3).
        """
        return self.chain.forward(np.asarray(q, dtype=float))

    def jacobian(self, q: ArrayLike) -> Array:
        """Return d p_BF / d q [m/rad], base axes.

        Args:
            q: joint angles [rad]. Shape (..., J).

        Returns:
            One column per joint. Shape (..., 3, J).
        """
        return self.chain.jacobian(np.asarray(q, dtype=float))

    def followed(self, vectors: Array) -> Array:
        """Return the components of vectors (..., 3) that the foot can follow. Shape (..., J)."""
        return vectors if self.task is None else vectors @ self.task.T

    def check_limits(self, q: Array) -> None:
        """Refuse joint angles (N, J) beyond the joint limits.

        Raises:
            ReachError: naming the joint that crosses its limit most.
        """
        beyond = np.maximum(self.lower - q, q - self.upper)
        row, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        if beyond[row, joint] > ANGLE_TOLERANCE:
            raise ReachError(
                self.name,
                f"joint {self.joints[joint]} would need {q[row, joint]:.4f} rad; its limits are "
                f"{self.lower[joint]:.4f} to {self.upper[joint]:.4f} rad.",
                brief=f"{self.joints[joint]} is at its limit",
            )


def travel_and_height(direction: ArrayLike) -> Array:
    """Return the `task` of a leg of two joints that travels along a horizontal direction.

    Args:
        direction: in base axes, any length but zero; its vertical part counts for nothing. (3,).
    """
    x, y, _ = np.asarray(direction, dtype=float)
    length = np.hypot(x, y)
    return read_only([[x / length, y / length, 0.0], [0.0, 0.0, 1.0]])


def point_text(point: Array) -> str:
    """Return a point with a tenth of a millimetre."""
    return "(" + ", ".join(f"{c:.4f}" for c in point) + ")"


# Joint rates of a leg and its distance from a singular posture: by the Jacobian, or closed form.
#
# The closed form costs a small part of the Jacobian and serves where thousands of postures are only
# judged; it differs from the Jacobian by rounding.


def joint_rates(jacobian: Array, v_BF: Array, task: Array | None = None) -> Array:
    """Return the joint rates [rad/s] that move a foot at v_BF [m/s].

    Args:
        jacobian: d p_BF / d q [m/rad]. Shape (..., 3, J).
        v_BF: foot velocity in base axes. Shape (..., 3).
        task: directions that legs of two joints follow, as of `LegGeometry`; None: all three.
            Shape (..., 2, 3).

    Returns:
        Shape (..., J).
    """
    if task is not None:
        jacobian, v_BF = task @ jacobian, (task @ v_BF[..., None])[..., 0]
    return np.asarray(np.linalg.solve(jacobian, v_BF[..., None])[..., 0], dtype=np.float64)


def normalised_determinant(jacobian: Array, task: Array | None = None) -> Array:
    """Return |det J| over the product of the lengths of J's columns. (..., 3, J) -> (...).

    Of legs of two joints J's determinant is that of its components along the task, (..., 2, 3):
    it vanishes also where neither joint moves the foot along the direction of travel.
    """
    size = np.prod(np.linalg.norm(jacobian, axis=-2), axis=-1)
    jacobian = jacobian if task is None else task @ jacobian
    share: Array = np.abs(np.linalg.det(jacobian)) / np.maximum(size, np.finfo(float).tiny)
    return share


def closed_form_rates(
    geometry: YawPitchPitch, fold: Array, p_BF: Array, v_BF: Array, q: Array
) -> Array:
    """Return `joint_rates` of L stacked yaw-pitch-pitch legs away from singular postures.

    Args:
        geometry: of the legs.
        fold: -1 for a leg folded over its yaw axis, else 1. Shape (L, 1).
        p_BF: foot positions in the base frame [m]. Shape (L, N, 3).
        v_BF: foot velocities in base axes [m/s]. Shape (L, N, 3).
        q: joint angles that reach the positions on that branch [rad]. Shape (L, N, 3).

    Returns:
        Shape (L, N, 3).
    """
    p_HF = (p_BF - geometry.p_BH) @ geometry.r_BH
    v_HF = v_BF @ geometry.r_BH
    x, y, z = p_HF[..., 0], p_HF[..., 1], p_HF[..., 2]
    dx, dy, dz = v_HF[..., 0], v_HF[..., 1], v_HF[..., 2]
    l1, l2, l3 = geometry.links
    q3 = geometry.sign[..., 2] * q[..., 2] + geometry.offset[..., 2]
    radius = np.sqrt(x**2 + y**2)
    u, du = fold * radius - l1, fold * (x * dx + y * dy) / radius
    dq1 = (x * dy - y * dx) / radius**2
    dq3 = -(u * du + z * dz) / (l2 * l3 * np.sin(q3))
    dq2 = (z * du - u * dz - l3 * (l3 + l2 * np.cos(q3)) * dq3) / (u**2 + z**2)
    rates: Array = geometry.sign * np.stack([dq1, dq2, dq3], axis=-1)
    return rates


def closed_form_determinant(geometry: YawPitchPitch, q: Array) -> Array:
    """Return `normalised_determinant` of L stacked yaw-pitch-pitch legs: L2 |sin q3| / rho.

    rho is the distance from axis 2 to the foot. The columns have the lengths r (the foot's distance
    from the yaw axis), rho and L3, and |det J| = L2 L3 |sin q3| r.

    Args:
        geometry: of the legs.
        q: joint angles [rad]. Shape (L, N, 3).

    Returns:
        Shape (L, N).
    """
    _, l2, l3 = geometry.links
    q3 = geometry.sign[..., 2] * q[..., 2] + geometry.offset[..., 2]
    sin, cos = np.sin(q3), np.cos(q3)
    rho = np.sqrt((l2 + l3 * cos) ** 2 + (l3 * sin) ** 2)
    share: Array = l2 * np.abs(sin) / np.maximum(rho, np.finfo(float).tiny)
    return share


# How long a robot's legs are.
