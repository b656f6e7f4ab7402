"""The joint set-points of a gait or a run at a fixed rate, checked against a robot's limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.joint_trajectory import trajectory_curve
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.walk_plan import WalkPlan
from hexapod_pin.errors import JointRangeError, ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.leg_geometry import ANGLE_TOLERANCE

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

USUAL_CYCLES = 10.0
"""Length of the walk that a plan gives where no duration is named, in cycles of its gait [-]."""

MOST_RATE = 1000.0
"""Largest number of samples in a second: that of fast controllers of joints [1/s]."""

MOST_SAMPLES = 1_000_000
"""Samples of a motion: 17 minutes at the largest rate; a file of 500 MB."""

LONGEST = 3600.0
"""Of a motion [s]."""

RATE_TOLERANCE = 1e-3
"""Fraction by which a rate may exceed its limit: that of the cubics through rounded samples."""


@dataclass(frozen=True, eq=False)
class JointSamples(Immutable):
    """Set-points of K instants for n joints.

    Attributes:
        robot: whose joints they are.
        time: from 0 on [s]. Shape (K,).
        q: set-points, `Robot.joint_names` order [rad; m of sliding joints]. Shape (K, n).
        v: their rates [rad/s or m/s]. Shape (K, n).
        midway: the set-points half-way between two instants. Shape (K - 1, n).
        what: one line on the motion.
    """

    robot: Robot = field(repr=False)
    time: Array
    q: Array
    v: Array
    midway: Array = field(repr=False)
    what: str

    @property
    def interpolation_error(self) -> Array:
        """How far cubics through `q` and `v` are from `midway` [rad or m]. Shape (K - 1, n)."""
        h = np.diff(self.time)[:, None]
        middle = 0.5 * (self.q[1:] + self.q[:-1]) + h * (self.v[:-1] - self.v[1:]) / 8.0
        return np.abs(middle - self.midway)

    def require_limits(self) -> None:
        """Refuse a motion whose cubics between the samples leave the ranges of the robot's URDF.

        Raises:
            JointRangeError: of the first such instant; it names joint, time, value and range.
        """
        robot = self.robot
        time, place, rate = self._extremes()
        slack = ANGLE_TOLERANCE
        by = "by the joint limits of the URDF; change the gait's stroke, lift or height."
        low, high = robot.lower - slack, robot.upper + slack
        self.refuse_first(time, place, (low, high), "angle", by)
        most = robot.velocity_limit * (1.0 + RATE_TOLERANCE)
        by = "by the speed limits of the URDF; walk with a longer cycle time or a shorter stroke."
        self.refuse_first(time, rate, (-most, most), "rate", by)

    def refuse_first(
        self, time: Array, values: Array, span: tuple[Array, Array], quantity: str, by: str
    ) -> None:
        """Refuse the first instant at which a joint is outside a range.

        Args:
            time: of the values [s]. Shape (M, n).
            values: what the joints come to. Shape (M, n).
            span: the least and the largest allowed value of each joint. Shapes (n,).
            quantity: "angle" or "rate".
            by: what sets the range, and the way out.

        Raises:
            JointRangeError: there is one.
        """
        outside = (values < span[0]) | (values > span[1])
        if not outside.any():
            return
        rows, joints = np.nonzero(outside)
        first = int(np.argmin(time[rows, joints]))
        k, j = int(rows[first]), int(joints[first])
        raise JointRangeError(
            self.robot.joint_names[j],
            float(time[k, j]),
            quantity,
            float(values[k, j]),
            float(span[0][j]),
            float(span[1][j]),
            by=by,
            turning=bool(self.robot.turning[j]),
        )

    def _extremes(self) -> tuple[Array, Array, Array]:
        """Return times, angles and rates where the cubics may have their extremes. Shapes (M, n).

        Over an interval of length h, in s from 0 to 1: q = q0 + a s + b s^2 + c s^3.
        """
        h = np.diff(self.time)[:, None]
        step, first, last = np.diff(self.q, axis=0), h * self.v[:-1], h * self.v[1:]
        a, b, c = first, 3.0 * step - 2.0 * first - last, first + last - 2.0 * step
        with np.errstate(all="ignore"):  # no extreme where the polynomial is of a lower degree
            root = np.sqrt(b * b - 3.0 * a * c)
            inner = [(-b - root) / (3.0 * c), (-b + root) / (3.0 * c), -b / (3.0 * c), -a / (2 * b)]
        ends = np.zeros_like(a), np.ones_like(a)
        s = np.stack([*ends, *(np.where((x > 0.0) & (x < 1.0), x, 0.0) for x in inner)])
        start, q0 = self.time[:-1, None], self.q[:-1]
        time, place = start + h * s, q0 + s * (a + s * (b + s * c))
        rate = (a + s * (2.0 * b + 3.0 * c * s)) / h
        columns = self.q.shape[1]
        one, two, three = (x.reshape(-1, columns) for x in (time, place, rate))
        return one, two, three


def joint_samples(
    source: WalkPlan | Trace, rate: float, duration: float | None, where: str
) -> JointSamples:
    """Return the set-points of a gait or of a run at a fixed rate.

    A plan gives a walk that starts and ends standing still. A run gives what its drives received,
    from its first sample; between samples it follows cubics through set-points and their rates.

    Args:
        source: plan or run.
        rate: samples in a second [1/s].
        duration: of the motion [s]; None: ten cycles of a plan, the whole of a run.
        where: the call, for messages.

    Raises:
        ParameterError: rate or duration out of range, or a run without set-points or URDF.
        GaitError: the robot cannot walk the gait.
        NotRecordedError: the run recorded no set-points.
    """
    if not 1.0 <= rate <= MOST_RATE:
        raise ParameterError(f"{where}.rate", rate, f"1 to {MOST_RATE:g} samples in a second")
    length = _length(source, duration)
    most = min(LONGEST, (MOST_SAMPLES - 1) / rate)
    if isinstance(source, Trace):
        most = min(most, float(source.time[-1] - source.time[0]))
    if not 1.0 / rate <= length <= most:
        allowed = f"{1.0 / rate:g} to {most:g} s, of this motion at this rate"
        raise ParameterError(f"{where}.duration", length, allowed)
    try:
        robot, curve, rates, what = _motion(source, length)
    except ParameterError as error:
        if error.name != "stop_at":  # as the walk of a plan names its end
            raise
        hint = "The walk starts and ends at rest."
        raise ParameterError(f"{where}.duration", length, error.allowed, hint) from None
    count = int(np.floor(length * rate * (1.0 + 1e-12))) + 1
    time = np.arange(count) / rate
    middle = 0.5 * (time[1:] + time[:-1])
    return JointSamples(
        robot=robot, time=time, q=curve(time), v=rates(time), midway=curve(middle), what=what
    )


def _length(source: WalkPlan | Trace, duration: float | None) -> float:
    """Return the duration of a motion [s]."""
    if duration is not None:
        return float(duration)
    if isinstance(source, WalkPlan):
        return USUAL_CYCLES * source.gait.cycle_time
    return float(source.time[-1] - source.time[0])


def _motion(source: WalkPlan | Trace, length: float) -> tuple[Robot, Any, Any, str]:
    """Return robot, set-points and their rates as functions of time, and a description."""
    from scipy.interpolate import CubicHermiteSpline

    if isinstance(source, WalkPlan):
        robot, gait = source.robot, source.gait
        plan = KinematicControl(gait, stop_at=length).plan(robot, length)
        curve = trajectory_curve(plan)
        return robot, curve, curve.derivative(), f"{robot.name}, {gait}, from rest to rest"
    robot = RecordedRobot.of(source).robot
    curve = CubicHermiteSpline(source.time - source.time[0], source.q_ref, source.v_ref)
    return robot, curve, curve.derivative(), f"{robot.name}, set-points of a run"
