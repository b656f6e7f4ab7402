"""Motion of the trunk that is commanded beside the walk: height, sway and tilt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.curves import MotionFunction
from hexapod_pin.control.time_function import TimeFunction, value_and_rate
from hexapod_pin.spec import Spec

SWAY = ("forward", "lateral", "height")
TILT = ("roll", "pitch", "yaw")


class BodyMotion(Spec):
    """Offsets of the trunk from the level body that a gait carries along, each a TimeFunction.

    The level body has the standing height, x forward, y left, z up. The trunk is turned by
    R_z(yaw) R_y(pitch) R_x(roll): positive pitch lowers the front, positive roll the right side.
    With a gait of stroke 0 the robot stands and sways: no foot lifts.

    Attributes:
        height: [m], up.
        roll: [rad].
        pitch: [rad].
        yaw: [rad].
        forward: [m].
        lateral: [m], to the left.
    """

    height: TimeFunction = 0.0
    roll: TimeFunction = 0.0
    pitch: TimeFunction = 0.0
    yaw: TimeFunction = 0.0
    forward: TimeFunction = 0.0
    lateral: TimeFunction = 0.0

    @property
    def constant(self) -> bool:
        """Whether nothing moves."""
        return not self._functions

    @property
    def offsets(self) -> dict[str, float]:
        """The constant offsets that are not 0, by name [m, rad]."""
        found = {name: getattr(self, name) for name in (*SWAY, *TILT)}
        return {name: float(x) for name, x in found.items() if isinstance(x, int | float) and x}

    def scaled(self, share: float) -> BodyMotion:
        """Return the motion with its constant offsets times `share`."""
        return self.model_copy(update={name: share * x for name, x in self.offsets.items()})

    def kinks_until(self, end: float) -> Array:
        """Return the times at which a derivative jumps, ascending; later than `end` not all [s]."""
        times = [time for one in self._functions for time in one.kinks_until(end)]
        return np.unique(times).astype(float)

    @property
    def shortest_time(self) -> float:
        """Time in which every offset is close to a polynomial [s]; infinite where all are."""
        return min((one.shortest_time for one in self._functions), default=np.inf)

    @property
    def _functions(self) -> list[MotionFunction]:
        found = (getattr(self, name) for name in SWAY + TILT)
        return [one for one in found if isinstance(one, MotionFunction)]

    def offset(self, time: Array) -> TrunkOffset:
        """Return where the trunk is at times [s]."""
        sway, tilt = (
            [value_and_rate(getattr(self, name), time) for name in names] for names in (SWAY, TILT)
        )
        (roll, d_roll), (pitch, d_pitch), (yaw, d_yaw) = tilt
        sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
        sy, cy = np.sin(yaw), np.cos(yaw)
        rows = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
        omega = [
            d_roll - sp * d_yaw,
            cr * d_pitch + sr * cp * d_yaw,
            cr * cp * d_yaw - sr * d_pitch,
        ]
        return TrunkOffset(
            position=np.stack([value for value, _ in sway], axis=-1),
            rotation=np.stack([np.stack(row, axis=-1) for row in rows], axis=-2),
            velocity=np.stack([rate for _, rate in sway], axis=-1),
            angular_velocity=np.stack(omega, axis=-1),
        )

    def start_pose(self) -> Array:
        """Return the pose at t = 0: x, y, z [m], quaternion x, y, z, w. Shape (7,)."""
        at_start = np.zeros(())
        half = [0.5 * float(value_and_rate(getattr(self, name), at_start)[0]) for name in TILT]
        (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
        quaternion = [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
        return np.concatenate([self.offset(at_start).position, quaternion])


@dataclass(frozen=True, eq=False)
class TrunkOffset:
    """Pose and motion of the trunk relative to the level body, at times of shape (...).

    Attributes:
        position: of the trunk in the level body's frame [m]. Shape (..., 3).
        rotation: trunk axes as columns, level axes. Shape (..., 3, 3).
        velocity: d/dt of `position` [m/s]. Shape (..., 3).
        angular_velocity: relative to the level body, trunk axes [rad/s]. Shape (..., 3).
    """

    position: Array
    rotation: Array
    velocity: Array
    angular_velocity: Array

    def into(self, p: Array) -> Array:
        """Return points of the level body's frame in the trunk's [m]. Shape (..., 3)."""
        return self._rows(p - self.position)

    def motion_into(self, p: Array, v: Array) -> tuple[Array, Array]:
        """Return points, and their velocity [m/s] as seen from the trunk, in trunk axes."""
        p_trunk = self.into(p)
        return p_trunk, self._rows(v - self.velocity) - np.cross(self.angular_velocity, p_trunk)

    def turned_out(self, relative: Array) -> Array:
        """Return the angular velocity of a link relative to the level body, level axes [rad/s].

        Args:
            relative: of the link relative to the trunk, trunk axes. Shape (..., 3).
        """
        total = relative + self.angular_velocity
        turned: Array = (self.rotation @ total[..., None])[..., 0]
        return turned

    def _rows(self, v: Array) -> Array:
        """Return vectors of level axes in trunk axes."""
        rows: Array = (v[..., None, :] @ self.rotation)[..., 0, :]
        return rows
