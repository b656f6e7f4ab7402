"""A controller gives a joint trajectory: knots planned before the run, with curves between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array, read_only
from hexapod_pin.errors import ParameterError
from hexapod_pin.immutable import Immutable

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


TrajectoryKind = Literal["cubic", "held", "linear", "quintic"]

MOST_CYCLES = 1e6
"""Cycles that are planned at once: longer walks are planned in parts [-]."""

CURVED = ("cubic", "quintic")
"""Kinds whose knots are joined by curves with a rate."""


@dataclass(frozen=True)
class JointTrajectory(Immutable):
    """An open-loop joint reference through knots.

    Attributes:
        time: knot times, strictly increasing from 0 [s]. Shape (K,).
        q: joint angles at the knots, `Robot.joint_names` order [rad]. Shape (K, n).
        v: joint rates at the knots [rad/s]. Shape (K, n).
        kind: what joins the knots. "cubic": C1 cubic Hermite curves. "held": each row of `q` holds
            until the next knot, the rate is 0. "linear": straight lines from row to row of `q`; the
            drives receive each knot's `v` as their rate until the next. The last row of `q` stays.
            "quintic": polynomials of degree 5 through angle, rate and acceleration at both ends of
            each interval.
        cycle_time: period of the gait [s]; None without one.
        steady_from: start of the window in which the reference is periodic [s].
        steady_until: end of that window [s]; not after `steady_from` where the run is too short.
        travel_direction: unit vector in the world, at the start. Shape (2,).
        speed: nominal speed along it [m/s].
        start_pose: where the trunk stands at t = 0 relative to a level trunk in the same place: x,
            y, z [m], quaternion x, y, z, w; a run finds its height over the ground by itself.
            None: no offset. Shape (7,).
        acceleration: joint accelerations at the begin and at the end of each interval between
            knots [rad/s^2]: at a knot it may jump. Shape (K - 1, 2, n). "quintic" needs it; with
            "cubic" it is for information, and the curves do not follow it; other kinds have none.
        is_part: whether it is a part of a longer trajectory, which may begin later than at 0.

    Raises:
        ParameterError: an unknown kind, arrays of unequal length, not finite, times not increasing
            from 0, or accelerations where there can be none or none where there must be.
    """

    time: Array
    q: Array
    v: Array
    cycle_time: float | None
    steady_from: float
    steady_until: float
    travel_direction: Array
    speed: float
    kind: TrajectoryKind = "cubic"
    start_pose: Array | None = None
    acceleration: Array | None = None
    is_part: bool = False

    @property
    def held(self) -> bool:
        """Whether each row of `q` holds until the next knot."""
        return self.kind == "held"

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        if self.kind not in get_args(TrajectoryKind):
            raise ParameterError("JointTrajectory.kind", self.kind, str(get_args(TrajectoryKind)))
        for name in ("time", "q", "v", "travel_direction", "start_pose", "acceleration"):
            if getattr(self, name) is None:
                continue
            array = read_only(getattr(self, name))
            if not np.isfinite(array).all():
                worst = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
                where = f"JointTrajectory.{name}{list(worst)}"
                raise ParameterError(where, float(array[worst]), "finite (knot, joint)")
            object.__setattr__(self, name, array)
        if self.q.shape != self.v.shape or self.q.shape[:1] != self.time.shape:
            shapes = (self.time.shape, self.q.shape, self.v.shape)
            raise ParameterError(
                "JointTrajectory.time, q, v", shapes, "of shapes (K,), (K, n) and (K, n)"
            )
        if (
            len(self.time) < (2 if self.kind in CURVED else 1)
            or (self.time[0] != 0.0 and not self.is_part)
            or not (np.diff(self.time) > 0.0).all()
        ):
            raise ParameterError(
                "JointTrajectory.time", "this series", "strictly increasing from 0"
            )
        self._check_acceleration()

    def _check_acceleration(self) -> None:
        """Refuse accelerations of the wrong shape or kind of trajectory."""
        where = "JointTrajectory.acceleration"
        if self.acceleration is None:
            if self.kind == "quintic":
                raise ParameterError(where, None, "given: kind 'quintic' goes through them")
            return
        if self.kind not in CURVED:
            shape = self.acceleration.shape
            raise ParameterError(where, shape, f"left out: kind {self.kind!r} has none")
        shape = (len(self.time) - 1, 2, self.q.shape[1])
        if self.acceleration.shape != shape:
            raise ParameterError(
                where, self.acceleration.shape, f"of shape (K - 1, 2, n) = {shape}"
            )


class Controller(Protocol):
    """Anything that can plan a run. Plans are made, and refused, before the run starts."""

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the reference for a run of `duration` [s]."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data with the key "kind"."""
        ...


def check_duration(duration: float) -> float:
    """Return a duration that is finite and positive [s].

    Raises:
        ParameterError: it is not.
    """
    if not (math.isfinite(duration) and duration > 0.0):
        raise ParameterError("duration", duration, "finite and above 0 s")
    return float(duration)


def cycles_between(since: float, until: float, period: float) -> NDArray[np.int_]:
    """Return the numbers of the cycles that reach into a span of time, one before and one after.

    Args:
        since: begin of the span [s].
        until: its end [s].
        period: of a cycle [s].

    Raises:
        ParameterError: there are more than `MOST_CYCLES`.
    """
    if not until - since <= MOST_CYCLES * period:
        allowed = f"at most {MOST_CYCLES * period:g} s, {MOST_CYCLES:g} cycles, planned at once"
        raise ParameterError("duration", until - since, allowed)
    return np.arange(int(since / period) - 1, int(until / period) + 2)


def whole_cycles(time: float, period: float) -> float:
    """Return the last whole cycle not after `time`, but not before 0 [s]."""
    return max(0.0, float(np.floor(time / period + 1e-9)) * period)


# The curves of a joint trajectory between its knots, and their extremes.


def trajectory_curve(plan: JointTrajectory) -> Any:
    """Return the joint angles of a cubic or quintic plan as SciPy's piecewise polynomial [rad].

    Raises:
        ParameterError: the plan is of another kind.
    """
    from scipy.interpolate import BPoly, CubicHermiteSpline

    if plan.kind == "cubic":
        return CubicHermiteSpline(plan.time, plan.q, plan.v)
    if plan.kind == "quintic":
        return BPoly(quintic_control_points(plan), plan.time)
    raise ParameterError("JointTrajectory.kind", plan.kind, "cubic or quintic: it has curves")


def planned_motion(plan: JointTrajectory, time: Array) -> tuple[Array, Array]:
    """Return the set-points that a plan gives the drives at some times.

    Args:
        plan: of any kind; its last knot stays.
        time: [s]. Shape (K,).

    Returns:
        Joint angles [rad] and rates [rad/s], `Robot.joint_names` order. Shapes (K, n).
    """
    now = np.minimum(time, plan.time[-1])
    if plan.kind in CURVED:
        curve = trajectory_curve(plan)
        return np.asarray(curve(now)), np.asarray(curve(now, 1))
    knot = np.searchsorted(plan.time, now, side="right") - 1
    if plan.kind == "held":
        return plan.q[knot], np.zeros((len(time), plan.q.shape[1]))
    moves = [np.interp(now, plan.time, joint) for joint in plan.q.T]
    return np.stack(moves, axis=-1), plan.v[knot]


def quintic_control_points(plan: JointTrajectory) -> Array:
    """Return the Bernstein coefficients of the quintics between the knots. Shape (6, K - 1, n).

    The quintic has position, rate and acceleration of both its ends; it stays between the least
    and the largest of its coefficients [rad].

    Args:
        plan: of kind "quintic".
    """
    assert plan.acceleration is not None  # JointTrajectory has checked it
    h = np.diff(plan.time)[:, None]
    fifth, twentieth = h / 5.0, h**2 / 20.0
    q, v = plan.q, plan.v
    first, last = plan.acceleration[:, 0], plan.acceleration[:, 1]
    return np.stack(
        [
            q[:-1],
            q[:-1] + fifth * v[:-1],
            q[:-1] + 2.0 * fifth * v[:-1] + twentieth * first,
            q[1:] - 2.0 * fifth * v[1:] + twentieth * last,
            q[1:] - fifth * v[1:],
            q[1:],
        ]
    )


def slopes(points: Array, length: Array) -> Array:
    """Return the Bernstein coefficients of derivatives.

    Args:
        points: coefficients of polynomials of degree D. Shape (D + 1, M, n).
        length: of the intervals [s]. Shape (M,).

    Returns:
        Shape (D, M, n).
    """
    return (len(points) - 1) * np.diff(points, axis=0) / length[:, None]


def extremes(points: Array) -> tuple[Array, Array]:
    """Return where in 0..1 a polynomial may have its extremes, ends included, and its values there.

    Args:
        points: its Bernstein coefficients. Shape (D + 1,).

    Returns:
        Shape (E,) each.
    """
    from scipy.interpolate import BPoly, PPoly

    curve = BPoly(points[:, None], [0.0, 1.0])
    roots = PPoly.from_bernstein_basis(curve.derivative()).roots(extrapolate=False)
    at = np.unique(np.concatenate([[0.0, 1.0], roots[np.isfinite(roots)]]))
    return at, np.asarray(curve(at))
