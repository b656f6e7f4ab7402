"""A gait becomes joint set-points through foot paths and inverse kinematics ([S1]).

Planning a long walk reports its progress.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.body_motion import BodyMotion
from hexapod_pin.control.body_path import EVENT_SEPARATION_CYCLES, TRANSIENT_CYCLES
from hexapod_pin.control.commanded_body import VelocityCommand
from hexapod_pin.control.feasibility import refuse_impossible_knots, walk_refusal
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.gait_refusal import refuse_impossible, refuse_impossible_command
from hexapod_pin.control.joint_trajectory import JointTrajectory, check_duration, whole_cycles
from hexapod_pin.control.knot_table import (
    MAX_KNOT_ERROR,
    MAX_KNOT_SPACING,
    Knots,
    fine_knots,
    knot_table,
    knot_times,
    sample_knots,
)
from hexapod_pin.control.leg_group import LegGroup, leg_group
from hexapod_pin.errors import GaitError, ParameterError, ReachError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


@checked
@dataclass(frozen=True)
class KinematicControl:
    """Walk a gait open loop: the feet follow `FootPath`, the joints its inverse kinematics.

    Attributes:
        gait: the gait.
        stop_at: time at which the robot stands still again [s]; None: no stop.
        body: height, sway and tilt of the trunk beside the walk; None: level, at its height. The
            robot starts in the posture that this gives at t = 0, at rest.
        velocity: speed and turn rate that change while walking, in the place of the gait's stroke,
            heading and turn rate; None: those of the gait.

    Raises:
        ParameterError: both a stop and a velocity command (let the command end with zero).
    """

    gait: Gait
    stop_at: float | None = field(default=None, kw_only=True)
    body: BodyMotion | None = field(default=None, kw_only=True)
    velocity: VelocityCommand | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse two ways to stop."""
        if self.stop_at is not None and self.velocity is not None:
            raise ParameterError(
                "stop_at", self.stop_at, "None with a velocity command",
                "End the command with zero speed: the robot then stands still.",
            )  # fmt: skip

    def path(self, robot: Robot) -> FootPath:
        """Return the planned motion of the feet and of the body.

        Raises:
            GaitError: the robot has no legs for this gait.
            ParameterError: a stop too early for starting and stopping.
        """
        return FootPath.of(
            leg_group(robot),
            self.gait,
            stop_at=self.stop_at,
            motion=self.body,
            command=self.velocity,
        )

    def repeats(self, robot: Robot) -> bool:
        """Whether the cycles of the walk repeat, so that `plan_part` can plan it in parts."""
        return self.path(robot).periodic

    def plan(self, robot: Robot, duration: float) -> JointTrajectory:
        """Return the joint reference, after checking that the robot can walk it at all.

        The knots do not depend on the duration: those of a shorter walk begin those of a longer
        one, to the bit where the cycles repeat, and to rounding (1e-12 rad) where the trunk's
        motion or the velocity is a function of time.

        The steady window starts after two whole cycles (`FootPath.steady_from`) and ends with the
        last whole cycle before the end, or before the first leg prepares to stop. A walk whose
        cycles do not repeat has no cycle time and its window is the whole walk.

        Raises:
            GaitError: the robot's legs do not fit the gait, or reach, singularity, joint position
                or joint velocity limits forbid it; `quantity` and `limit` are what to change and
                how far.
            ParameterError: the duration, or a stop too early for starting and stopping.
        """
        end, path = check_duration(duration), self.path(robot)
        if path.periodic:
            return self.plan_part(robot, end, 0.0, end)
        return self._trajectory(path, end, self._unrepeated_knots(robot, path, end))

    def plan_part(
        self, robot: Robot, duration: float, since: float, until: float
    ) -> JointTrajectory:
        """Return a part of what `plan` gives for a walk whose cycles repeat, bit for bit.

        Args:
            robot: the robot.
            duration: of the whole walk [s].
            since: the knots begin at an event of the foot paths not after this time [s].
            until: the knots end at an event that is not before this [s].

        Raises:
            GaitError, ParameterError: as `plan`.
        """
        if not 0.0 <= since <= until:
            raise ParameterError("since, until", (since, until), "in their order, from 0 s on")
        path = self.path(robot)
        refuse_impossible(robot, self.gait, self.body)
        six = leg_group(robot).along(self.gait, self.velocity)
        return self._trajectory(path, duration, walk_knots(six, path, until, since))

    def _trajectory(
        self, path: FootPath, end: float, knots: tuple[Array, Array, Array]
    ) -> JointTrajectory:
        """Return what the drives follow through knots of a walk of so long [s]."""
        time, q, v = knots
        later = bool(time[0] > 0.0)
        until = whole_cycles(min(end, path.steady_until), self.gait.cycle_time)
        return JointTrajectory(
            time=time,
            q=q,
            v=v,
            is_part=later,
            cycle_time=self.gait.cycle_time if path.periodic else None,
            steady_from=path.steady_from if path.periodic else 0.0,
            steady_until=until if path.periodic else end,
            travel_direction=path.direction,
            speed=path.speed,
            start_pose=None if self.body is None else self.body.start_pose(),
        )

    def _unrepeated_knots(
        self, robot: Robot, path: FootPath, end: float
    ) -> tuple[Array, Array, Array]:
        """Return the knots of a walk whose cycles do not repeat, each of them checked.

        Raises:
            GaitError: naming what fails, and when.
        """
        six = leg_group(robot).along(self.gait, self.velocity)
        try:
            knots = walk_knots(six, path, end)
            refuse_impossible_knots(six, path, *knots)
        except (ReachError, GaitError) as error:
            if self.velocity is not None:
                refuse_impossible_command(robot, self.gait, self.velocity, end)
            if isinstance(error, ReachError):
                raise walk_refusal(six, path, end, error) from None
            raise
        return knots

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as TOML-able data."""
        settings: dict[str, Any] = {"kind": "kinematic"}
        if self.stop_at is not None:
            settings["stop_at"] = self.stop_at
        for name in ("body", "velocity"):
            if getattr(self, name) is not None:
                settings[name] = getattr(self, name).model_dump(mode="json")
        return {**settings, "gait": self.gait.to_dict()}


# Knots of a walk of any length: joint angles and rates, dense enough for cubics between them.

KEPT_STOPS = 16
"""How many ends of walks that stop are cached."""

LEAST_EVENTS = 4
"""Of the foot paths in a cycle: two groups of legs that lift and touch down."""

MOST_KNOTS = 5e7
"""Largest number of knots planned at once: 15 GB for 18 joints."""

BLOCK_KNOTS = 20_000
"""Knots of a walk that does not repeat are made in blocks of about this number."""


def walk_knots(
    six: LegGroup, path: FootPath, end: float, since: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return knot times (K,) [s], joint angles (K, n) [rad] and rates (K, n) [rad/s].

    They end at the first event of the foot paths that is not before the end, or at the stop: the
    knots of a shorter walk are the first ones of a longer walk.

    Args:
        six: the legs.
        path: what their feet follow.
        end: duration of the walk [s].
        since: of a walk whose cycles repeat: the knots begin at the last event of the foot paths
            not after this time, or where it prepares to stop [s].

    Raises:
        ReachError: a leg cannot follow.
        ParameterError: more knots than `MOST_KNOTS`.
    """
    _require_few(end - since, path.gait.cycle_time)
    knots = _repeated(six, path, end, since) if path.periodic else _unrepeated(six, path, end)
    for array in knots:
        array.setflags(write=False)  # so that a trajectory need not copy them
    return knots


def _require_few(length: float, period: float) -> None:
    """Refuse a plan too long to be made at once; a cycle has a knot at each event at least."""
    longest = MOST_KNOTS * min(MAX_KNOT_SPACING, period / LEAST_EVENTS)
    if length > longest:
        raise ParameterError(
            "duration", length, f"at most {longest:.3g} s planned at once",
            "A longer walk is simulated from checkpoint to checkpoint (initial=trace.checkpoint); "
            "`simulate` plans one whose cycles repeat in parts.",
        )  # fmt: skip


def _repeated(
    six: LegGroup, path: FootPath, end: float, since: float
) -> tuple[Array, Array, Array]:
    """Return the knots of a walk whose cycles repeat: from the table, and those of its stop."""
    table = knot_table(six, path.gait, path.motion)
    period = path.gait.cycle_time
    spans = table.spans_before(end - EVENT_SEPARATION_CYCLES * period)[0] + 1
    begun = table.spans_before(since)[0]
    if path.stop_at is None:
        row, time = table.rows(spans, begun)
        return time, table.knots.q[row], table.knots.v[row]
    steady, begin = table.spans_before(path.steady_until)
    row, time = table.rows(min(spans, steady), min(begun, steady))
    if spans <= steady:
        return time, table.knots.q[row], table.knots.v[row]
    shift = max(0, int(path.steady_until / period) - TRANSIENT_CYCLES - 1) * period
    rest = _stop_knots(
        six, path.gait, path.motion, path.stop_at - shift, begin - shift, int(row[-1])
    )
    both = [(table.knots.q, rest.q), (table.knots.v, rest.v)]
    q, v = (np.concatenate([first[row], last[1:]]) for first, last in both)
    return np.append(time, rest.time[1:] + shift), q, v


@lru_cache(maxsize=KEPT_STOPS)
def _stop_knots(
    six: LegGroup, gait: Gait, motion: BodyMotion | None, stop_at: float, begin: float, row: int
) -> Knots:
    """Return the knots from an event before a walk prepares to stop until it stands.

    Args:
        six: the legs.
        gait: the gait.
        motion: constant offsets of the trunk; None: none.
        stop_at: [s].
        begin: the first knot [s].
        row: of the table, with the joint angles near those of the first knot.

    Raises:
        ReachError: a leg cannot follow.
    """
    table = knot_table(six, gait, motion)
    path = FootPath.of(six, gait, stop_at=stop_at, motion=motion)
    events = np.array([begin, *path.events(stop_at, begin), stop_at])
    return fine_knots(six, path, events, table.spacing, table.knots.q[row])[2]


def _unrepeated(six: LegGroup, path: FootPath, end: float) -> tuple[Array, Array, Array]:
    """Return the knots of a walk that does not repeat, each span as dense as it needs."""
    period = path.gait.cycle_time
    events = np.append(0.0, path.events(end + 2.0 * period))
    last = max(1, int(np.searchsorted(events, end - EVENT_SEPARATION_CYCLES * period)))
    events = events[: last + 1]
    path = path.solved_until(float(events[-1]))
    share = max(1, int(BLOCK_KNOTS * MAX_KNOT_SPACING * last / events[-1]))
    blocks: list[Knots] = []
    for first in range(0, last, share):
        if (listener := _listener.get()) is not None:
            listener(first / last)
        near = blocks[-1].q[-1] if blocks else None
        blocks.append(_span_knots(six, path, events[first : first + share + 1], near))
    columns = []
    for name in ("time", "q", "v"):
        parts = [getattr(block, name)[:-1] for block in blocks]
        columns.append(np.concatenate([*parts, getattr(blocks[-1], name)[-1:]]))
    return columns[0], columns[1], columns[2]


def _span_knots(six: LegGroup, path: FootPath, events: Array, near: Array | None) -> Knots:
    """Return the knots between some events, spacing halved in the spans that need it."""
    spacing = np.full(len(events) - 1, MAX_KNOT_SPACING)
    while True:
        time, first = knot_times(events, spacing)
        knots = sample_knots(six, path, time, near)
        wide = np.maximum.reduceat(knots.error, first[:-1]) > 0.5 * MAX_KNOT_ERROR
        if not wide.any():
            return knots
        spacing[wide] *= 0.5


# Progress of planning: a walk without repetition takes long to plan.

_listener: ContextVar[Callable[[float], None] | None] = ContextVar("listener", default=None)


@contextmanager
def planning_progress(listener: Callable[[float], None] | None) -> Iterator[None]:
    """Call `listener` with the finished fraction, 0 to 1, of what is planned in this block."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
