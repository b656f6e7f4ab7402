"""Kinematics of one leg: foot position, Jacobian, and joint angles for a foot position.

Everything is derived from the robot's model at q = 0, for any sign and zero convention. A leg of
the yaw-pitch-pitch class is solved in closed form, any other leg of three joints numerically.
Angles in rad, lengths in m, base axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.yaw_pitch_pitch import YawPitchPitch

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

TOLERANCE = 1e-9
"""A foot is on the yaw axis, or a numerical solution found, within this distance [m]."""


JUMP = 0.2
"""Neighbouring targets whose Newton solutions differ by more are searched again [rad]."""


@dataclass(frozen=True)
class LegKinematics:
    """One leg of a robot, base frame, joints proximal first.

    Attributes:
        name: the leg's name.
        joints: joint names. Three.
        axes: unit joint axes at q = 0, base axes. Shape (3, 3), one row per joint.
        origins: joint origins at q = 0, base frame [m]. Shape (3, 3).
        foot: foot centre at q = 0, base frame [m]. Shape (3,).
        lower: lower joint limits [rad]. Shape (3,).
        upper: upper joint limits [rad]. Shape (3,).
        posture: joint angles of the robot's standing posture [rad]. Shape (3,).
        closed_form: the yaw-pitch-pitch geometry, or None for a leg of another shape.
    """

    name: str
    joints: tuple[str, str, str]
    axes: Array
    origins: Array
    foot: Array
    lower: Array
    upper: Array
    posture: Array
    closed_form: YawPitchPitch | None

    @staticmethod
    def of(robot: Robot, leg_name: str) -> LegKinematics:
        """Read the geometry of one leg from the robot's model.

        Raises:
            UnknownNameError: if the robot has no leg of that name.
        """
        import pinocchio as pin

        leg = robot.leg(leg_name)
        foot = robot.foot(leg.foot)
        model = robot.model
        data = model.createData()
        pin.computeJointJacobians(model, data, pin.neutral(model))
        ids = [model.getJointId(joint) for joint in leg.joints]
        axes = np.array([data.J[3:, model.idx_vs[i]] for i in ids])
        origins = np.array([data.oMi[i].translation for i in ids])
        p_BF = data.oMi[model.getJointId(foot.joint)].act(np.asarray(foot.offset))
        rows = [robot.joint_index(joint) for joint in leg.joints]
        return LegKinematics(
            name=leg.name,
            joints=leg.joints,
            axes=_read_only(axes),
            origins=_read_only(origins),
            foot=_read_only(p_BF),
            lower=_read_only(robot.lower[rows]),
            upper=_read_only(robot.upper[rows]),
            posture=_read_only(robot.posture[rows]),
            closed_form=YawPitchPitch.from_geometry(axes, origins, p_BF),
        )

    def forward(self, q: ArrayLike) -> Array:
        """Return the foot centre in the base frame [m].

        Args:
            q: joint angles [rad]. Shape (..., 3).

        Returns:
            p_BF. Shape (..., 3).
        """
        return self._chain(np.asarray(q, dtype=float))[0]

    def jacobian(self, q: ArrayLike) -> Array:
        """Return d p_BF / d q [m/rad], base axes.

        Args:
            q: joint angles [rad]. Shape (..., 3).

        Returns:
            One column per joint. Shape (..., 3, 3).
        """
        return np.stack(self._chain(np.asarray(q, dtype=float))[1], axis=-1)

    def _chain(self, q: Array) -> tuple[Array, list[Array]]:
        """Return the foot centre and the Jacobian's columns, by rotating from the foot inwards."""
        p = np.broadcast_to(self.foot, q.shape)
        columns: list[Array] = []
        for k in (2, 1, 0):
            p = self.origins[k] + _rotate(p - self.origins[k], self.axes[k], q[..., k])
            columns = [_rotate(column, self.axes[k], q[..., k]) for column in columns]
            columns.insert(0, (p - self.origins[k]) @ _cross(self.axes[k]))
        return p, columns

    def excess(self, p_BF: ArrayLike) -> Array:
        """Return how far targets lie outside the leg's reach, joint limits aside [m].

        Args:
            p_BF: targets in the base frame [m]. Shape (..., 3).

        Returns:
            0 for a target that some posture reaches. Shape (...).
        """
        p = np.asarray(p_BF, dtype=float)
        flat = p.reshape(-1, 3)
        if self.closed_form is not None:
            outside = self.closed_form.solve(flat)[1].min(axis=1)
            outside = np.where(outside <= self._rounding(), 0.0, outside)
        else:
            misses = [self._search(target, self.posture, limits=False)[1] for target in flat]
            outside = np.where(np.array(misses) <= TOLERANCE, 0.0, misses)
        return outside.reshape(p.shape[:-1])

    def branches(self, p_BF: ArrayLike) -> Array:
        """Return every closed-form solution for one target, joint limits aside.

        Args:
            p_BF: target in the base frame [m]. Shape (3,).

        Returns:
            Joint angles in (-pi, pi] [rad]: knee up, knee down, then the same two folded over the
            yaw axis; solutions that do not exist are left out. Shape (2 or 4, 3).

        Raises:
            ReachError: if the leg is not of the closed-form class, none reaches, or the target is
                on the yaw axis.
        """
        if self.closed_form is None:
            raise ReachError(self.name, "has no closed form: use inverse().")
        target = np.asarray(p_BF, dtype=float).reshape(1, 3)
        q, outside = self._solve(target)
        exists = outside[0] <= self._rounding()
        if not exists.any():
            raise self._out_of_reach(target[0], float(outside.min()))
        return _wrap(q[0][exists])

    def inverse(
        self, p_BF: ArrayLike, *, near: ArrayLike | None = None, limits: bool = True
    ) -> Array:
        """Return joint angles that put the foot on a target, or along a path of targets.

        The first target takes the solution nearest to `near` (one inside the joint limits before
        one outside); the following ones stay on that branch and continuous, so no angle jumps.
        Nothing is clamped.

        Args:
            p_BF: targets in the base frame [m]. Shape (3,) or (N, 3).
            near: reference joint angles [rad], the standing posture if None. Shape (3,).
            limits: refuse angles outside the joint limits.

        Returns:
            Joint angles [rad]. Shape of `p_BF`.

        Raises:
            ReachError: if a target is outside the reach or on the yaw axis, or needs a joint
                outside its limits; it says by how much.
        """
        p = np.asarray(p_BF, dtype=float)
        targets = p.reshape(-1, 3)
        if not np.isfinite(targets).all():
            raise ReachError(self.name, "a foot target is not finite.")
        reference = self.posture if near is None else np.asarray(near, dtype=float)
        if self.closed_form is not None:
            q = self._follow_branch(targets, reference, limits=limits)
        else:
            q = self._follow_search(targets, reference, limits=limits)
        if limits:
            self._refuse_beyond_limits(q)
        return q.reshape(p.shape)

    def _follow_branch(self, targets: Array, near: Array, *, limits: bool) -> Array:
        """Solve all targets on the branch that starts nearest to `near`."""
        q, outside = self._solve(targets)
        start = near + _wrap(q[0] - near)
        cost = np.abs(start - near).max(axis=1)
        if limits:
            inside = ((start >= self.lower) & (start <= self.upper)).all(axis=1)
            cost = np.where(inside, cost, cost + 2 * np.pi)
        cost = np.where(outside[0] <= self._rounding(), cost, cost + 8 * np.pi)
        branch = int(np.argmin(cost))
        worst = int(np.argmax(outside[:, branch]))
        if outside[worst, branch] > self._rounding():
            raise self._out_of_reach(targets[worst], float(outside[worst, branch]))
        path: Array = np.unwrap(np.vstack([start[branch], q[:, branch]]), axis=0)[1:]
        return path

    def _solve(self, targets: Array) -> tuple[Array, Array]:
        """Return closed-form branches and distances outside, refusing targets on the yaw axis."""
        assert self.closed_form is not None
        q, outside, radius = self.closed_form.solve(targets)
        worst = int(np.argmin(radius))
        if radius[worst] < TOLERANCE:
            raise ReachError(
                self.name,
                f"foot target {_text(targets[worst])} m lies on the axis of {self.joints[0]}, "
                "where its angle is undefined.",
            )
        return q, outside

    def _out_of_reach(self, target: Array, excess: float) -> ReachError:
        """Compose the error with the reach interval."""
        assert self.closed_form is not None
        near, far = self.closed_form.reach()
        return ReachError(
            self.name,
            f"foot target {_text(target)} m lies {excess:.4g} m outside the reach, which is "
            f"{near:.4f} to {far:.4f} m from the axis of {self.joints[1]}.",
            excess,
        )

    def _rounding(self) -> float:
        """Return what counts as on the reach's edge: rounding of a leg's length [m]."""
        assert self.closed_form is not None
        return float(16 * np.finfo(float).eps * self.closed_form.lengths.sum())

    def _refuse_beyond_limits(self, q: Array) -> None:
        """Raise for the angle that crosses its limit most."""
        beyond = np.maximum(self.lower - q, q - self.upper)
        row, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
        if beyond[row, joint] > TOLERANCE:
            raise ReachError(
                self.name,
                f"joint {self.joints[joint]} would need {q[row, joint]:.4f} rad; its limits are "
                f"{self.lower[joint]:.4f} to {self.upper[joint]:.4f} rad.",
            )

    def _follow_search(self, targets: Array, near: Array, *, limits: bool) -> Array:
        """Solve the path by Newton steps for all targets at once; search where they fail."""
        first, miss = self._search(targets[0], near, limits=limits)
        if miss > TOLERANCE:
            raise self._not_found(targets[0], miss)
        q = self._newton(targets, np.tile(first, (len(targets), 1)))
        found = np.linalg.norm(self.forward(q) - targets, axis=1) <= TOLERANCE
        if found.all() and (np.abs(np.diff(q, axis=0)) < JUMP).all():
            return q
        for k in range(1, len(targets)):
            if found[k] and np.abs(q[k] - q[k - 1]).max() < JUMP:
                continue
            q[k], miss = self._search(targets[k], q[k - 1], limits=limits)
            if miss > TOLERANCE:
                raise self._not_found(targets[k], miss)
        return q

    def _newton(self, targets: Array, q: Array) -> Array:
        """Take twelve damped Newton steps of at most 0.3 rad towards all targets (N, 3)."""
        for _ in range(12):
            p, columns = self._chain(q)
            j = np.stack(columns, axis=-1)
            jt = np.swapaxes(j, -1, -2)
            normal = jt @ j + 1e-14 * np.eye(3)
            step = np.linalg.solve(normal, jt @ (targets - p)[..., None])[..., 0]
            q = q + np.clip(step, -0.3, 0.3)
        return q

    def _search(self, target: Array, near: Array, *, limits: bool) -> tuple[Array, float]:
        """Return the least-squares solution from `near` and the distance it misses by [m]."""
        from scipy.optimize import least_squares

        bounds: Any = (self.lower, self.upper) if limits else (-np.inf, np.inf)
        start = np.clip(near, *bounds)
        found = least_squares(
            lambda q: self.forward(q) - target,
            start,
            jac=self.jacobian,
            bounds=bounds,
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        return found.x, float(np.linalg.norm(found.fun))

    def _not_found(self, target: Array, miss: float) -> ReachError:
        """Compose the error of a search that ended away from its target."""
        return ReachError(
            self.name,
            f"foot target {_text(target)} m lies {miss:.4g} m outside the reach or the joint "
            "limits (numerical search from the nearest known posture).",
            miss,
        )


def _rotate(v: Array, axis: Array, angle: Array) -> Array:
    """Rotate vectors (..., 3) about one unit axis by angles (...) (Rodrigues)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    turned: Array = c * v + s * (v @ _cross(axis)) + (1.0 - c) * (v @ axis)[..., None] * axis
    return turned


def _cross(axis: Array) -> Array:
    """Return the matrix with v @ matrix = axis x v for rows v: far quicker than `np.cross`."""
    x, y, z = axis
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def _wrap(angle: Array) -> Array:
    """Return angles in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


def _text(point: Array) -> str:
    """Print a point with a tenth of a millimetre."""
    return "(" + ", ".join(f"{c:.4f}" for c in point) + ")"


def _read_only(values: ArrayLike) -> Array:
    """Return an own, write-protected copy."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
