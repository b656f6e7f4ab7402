"""The travelled path of a run is compared with its plan; falls and what pushes did are found in it.

The steady part of a walk may lie behind a push: what a push did is found from its start on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.control.commanded_body import planned_body
from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.rotations import trunk_yaw, yawed

if TYPE_CHECKING:
    from hexapod_pin.control.body_path import PlanarMotion
    from hexapod_pin.results.run_record import RunRecord
    from hexapod_pin.results.summary import Summary
    from hexapod_pin.scene.loads import Push

LEAST_STROKES = 0.25
"""Planned distance over the stroke below which no speed is judged (*assumed*)."""

LEAST_TURN = math.radians(2.0)
"""Planned yaw below which it is not judged as a share [rad] (*assumed*)."""


@dataclass(frozen=True)
class TravelledPath:
    """Way and yaw of a run, planned and made, between two times.

    Attributes:
        start: [s].
        end: [s].
        cycles: whole gait cycles between them; None where the whole run is judged.
        planned_distance: along the planned direction, which turns with the trunk [m].
        travelled_distance: made along it, by the centre of mass [m].
        planned_turn: yaw, left > 0 [rad].
        turn: made [rad].
        least_distance: planned distance below which none is judged [m].
    """

    start: float
    end: float
    cycles: int | None
    planned_distance: float
    travelled_distance: float
    planned_turn: float
    turn: float
    least_distance: float = 0.0

    @property
    def measured_speed(self) -> float:
        """Mean speed along the planned direction [m/s]."""
        return self.travelled_distance / (self.end - self.start) if self.end > self.start else 0.0

    @property
    def nominal_speed(self) -> float:
        """Mean of the plan [m/s]."""
        return self.planned_distance / (self.end - self.start) if self.end > self.start else 0.0

    @property
    def speed_share(self) -> float | None:
        """Distance over planned distance [-]; None where too little or nothing was planned."""
        judged = self.planned_distance > max(self.least_distance, 0.0)
        return self.travelled_distance / self.planned_distance if judged else None

    @property
    def turn_share(self) -> float | None:
        """Yaw over planned yaw [-]; None where too little or nothing was planned."""
        return self.turn / self.planned_turn if abs(self.planned_turn) >= LEAST_TURN else None

    @property
    def yaw_error(self) -> float:
        """Yaw beyond that of the plan [rad], left > 0."""
        return self.turn - self.planned_turn


def travelled_path(trace: Trace) -> TravelledPath:
    """Return the path of a run over its whole cycles of steady walking, else over all of it."""
    if trace.run.walk.cycle_time is not None:
        try:
            return _over_cycles(trace)
        except ParameterError:  # no whole cycle
            pass
    return _over_all(trace)


def _over_cycles(trace: Trace) -> TravelledPath:
    """Return the path over whole cycles: distance and speed are those of the torque budget."""
    budget = torque_budget(trace)
    window, cycles = budget.window, budget.window.parts
    time = window.end - window.start
    yaw = np.unwrap(trunk_yaw(trace.q[window.samples]))
    return TravelledPath(
        window.start, window.end, window.cycles,
        planned_distance=trace.run.walk.speed * time,
        travelled_distance=(budget.distance or 0.0) * cycles,
        planned_turn=trace.run.walk.turn_rate * time, turn=float(yaw[-1] - yaw[0]),
    )  # fmt: skip


def _over_all(trace: Trace) -> TravelledPath:
    """Return the path of a whole run against the planned motion of the body, ramps included."""
    time = trace.time
    body = _planned(trace.run)
    yaw = np.unwrap(trunk_yaw(trace.q))
    turn = float(yaw[-1] - yaw[0])
    if body is None or len(time) < 2:
        return TravelledPath(float(time[0]), float(time[-1]), None, 0.0, 0.0, 0.0, turn)
    pose, twist = body.pose_and_twist(time)
    size = np.linalg.norm(twist[:, :2], axis=1)
    pace = 0.5 * (twist[1:, :2] + twist[:-1, :2])
    length = np.linalg.norm(pace, axis=1)
    moving = length > 0.0
    along = np.divide(pace, length[:, None], where=moving[:, None], out=np.zeros_like(pace))
    middle = 0.5 * (yaw[1:] + yaw[:-1]) - yaw[0]
    place = trace.com if "com" in trace.recorded else trace.q
    steps = np.diff(place[:, :2], axis=0) * yawed(along, middle)
    planned = float(np.sum(0.5 * (size[1:] + size[:-1]) * np.diff(time)))
    return TravelledPath(
        float(time[0]), float(time[-1]), None, planned_distance=planned,
        travelled_distance=float(steps.sum()),
        planned_turn=float(pose[-1, 2] - pose[0, 2]), turn=turn,
        least_distance=LEAST_STROKES * float(size.max() * body.gait.duty * body.gait.cycle_time),
    )  # fmt: skip


# What pushes did to the path, from their start to the end of the run.

SETTLED_SHARE = 0.1
"""Of the distance that a push moved a robot, within which it has come to rest again (*assumed*)."""

SETTLED = 2e-3
"""The same distance at least [m] (*assumed*)."""

RETURNED_SHARE = 0.5
"""Of the largest distance from the track, below which a robot has come back to it (*assumed*)."""

THROWN_SHARE = 1.0
"""Distance off the track over that between the feet farthest apart, from which a robot is thrown.

So far away not one of its feet is on the ground that the plan has its feet on: what it walks there
is another walk, whatever its speed (*assumed*)."""


@dataclass(frozen=True)
class PushEffect:
    """What the pushes of a run did to the path of the trunk, its steady drift aside.

    Attributes:
        start: of the first push [s].
        offset: largest distance of the trunk from its track afterwards [m].
        left: what is left of it at the end of the run [m].
        after: from `start` until it walks on as before, elsewhere or on its track [s]; None where
            it has not by the end of the run.
        torque: largest torque of a joint until then, and until a cycle after the last push [N m];
            None where torques were not recorded.
        joint: that joint; empty where none is known.
        stance: distance of the feet farthest apart as the push begins, seen from above [m]; NaN
            where it is not known.
        force: of the strongest push [N].
    """

    start: float
    offset: float
    left: float
    after: float | None
    torque: float | None
    joint: str
    stance: float = math.nan
    force: float = math.nan

    @property
    def thrown(self) -> bool:
        """Whether it is so far off its track that it no longer walks what was planned."""
        return self.offset > THROWN_SHARE * self.stance

    @property
    def reason(self) -> str:
        """Why that is no walk; empty where it is not thrown."""
        return thrown_text(self.offset, self.stance)

    @property
    def line(self) -> str:
        """What the push did, in a few words."""
        size = f"{1e3 * self.offset:.3g} mm" if self.offset < 1.0 else f"{self.offset:.3g} m"
        if self.after == 0.0:
            return f"moved by {size} only when pushed"
        if self.after is None:
            return f"pushed off its track by {size}, still moved by it at the end"
        word = "back" if self.left < RETURNED_SHARE * self.offset else "walks on"
        return f"pushed off its track by {size}, {word} after {self.after:.2g} s"


def find_push_effect(trace: Trace) -> PushEffect | None:
    """Return what the pushes of a run did; None of a run without one before its end.

    The trunk's displacement since the first push is compared with that of the plan. The drift of
    the last cycle (without cycles of the last half) is taken for steady, and left out.
    """
    pushes = _pushes(trace.run)
    starts = [load.start for load in pushes]
    time = trace.time
    if not starts or min(starts) >= float(time[-1]):
        return None
    first = int(np.searchsorted(time, min(starts)))
    time = time[first:]
    if len(time) < 3:
        return None
    away = _off_plan(trace, first)
    since = time - time[0]
    cycle = trace.run.walk.cycle_time or np.inf
    last = since >= since[-1] - min(cycle, 0.5 * since[-1])
    away = away - np.outer(since, np.polyfit(since[last], away[last], 1)[0])
    distance = np.linalg.norm(away, axis=1)
    rest = np.linalg.norm(away - away[last].mean(axis=0), axis=1)
    moved = rest > max(SETTLED, SETTLED_SHARE * float(distance.max()))
    settled = int(np.flatnonzero(moved)[-1]) + 1 if moved.any() else 0
    after = None if moved[last].any() else float(since[settled])
    torque, joint = None, ""
    if "torque" in trace.recorded:
        quiet = max(load.start + load.duration for load in pushes) + min(cycle, since[-1])
        upto = max(settled + 1, int(np.searchsorted(time, quiet, side="right")))
        sizes = np.abs(trace.torque[first : first + upto])
        worst = int(np.argmax(sizes.max(axis=0)))
        torque, joint = float(sizes[:, worst].max()), trace.joint_names[worst]
    left = float(np.linalg.norm(away[last].mean(axis=0)))
    force = max(float(np.linalg.norm(load.force)) for load in pushes)
    return PushEffect(
        float(time[0]), float(distance.max()), left, after, torque, joint, _stance(trace, first),
        force,
    )  # fmt: skip


def push_offset(summary: Summary) -> float:
    """Return how far the pushes of a run moved it off its track at most, by its summary [m].

    By the centre of mass at half cycles, its drift of the last cycle aside; before its window it is
    where the run began. 0 of a run without a push, or of fewer than two half cycles.
    """
    starts = [load.start for load in _pushes(summary.run)]
    path, run = summary.path, summary.run
    body = _planned(run)
    if not starts or len(path) < 3 or body is None or not run.walk.cycle_time:
        return 0.0
    time, first = path[:, 0], min(starts)
    pose = body.pose_and_twist(time)[0]
    away = path[:, 1:3] - yawed(pose[:, :2], np.full(len(pose), summary.first_yaw - pose[0, 2]))
    drift = (away[-1] - away[-3]) / (time[-1] - time[-3])
    before = np.searchsorted(time, first)
    begin = away[before - 1] + drift * (first - time[before - 1]) if before else drift * first
    away = (away - begin - np.outer(time - first, drift))[before:]
    return float(np.linalg.norm(away, axis=1).max(initial=0.0))


def _pushes(run: RunRecord) -> list[Push]:
    from hexapod_pin.scene.loads import Push

    return [load for load in (() if run.scene is None else run.scene.loads)
            if isinstance(load, Push)]  # fmt: skip


def _planned(run: RunRecord) -> PlanarMotion | None:
    """Return the planned motion of the body; None where a run's controller plans none."""
    try:
        return planned_body(run.case.controller, run.walk.nominal_speed)
    except (ParameterError, GaitError, TypeError):
        return None


def thrown_text(offset: float, stance: float) -> str:
    """Return why a robot that a push moved off its track walks no more what was planned.

    Args:
        offset: largest distance off its track [m].
        stance: distance of the feet farthest apart, from above [m].

    Returns:
        Nothing of a robot that is not thrown.
    """
    if not offset > THROWN_SHARE * stance:
        return ""
    far = f"{offset:.3g} m off its track, more than the {stance:.2g} m between its feet"
    return f"a push threw it {far}"


def _stance(trace: Trace, sample: int) -> float:
    """Return the distance of the feet farthest apart, from above [m]; NaN where not recorded."""
    if "contacts" not in trace.recorded or not trace.foot_names:
        return math.nan
    places = trace.foot_position[sample, :, :2]
    return float(np.linalg.norm(places[:, None] - places, axis=-1).max())


def _off_plan(trace: Trace, first: int) -> Array:
    """Return how far the trunk is off its plan since a sample, both begun there. (T', 2) [m]."""
    yaw = trunk_yaw(trace.q[first : first + 1])[0]
    made = trace.q[first:, :2] - trace.q[first, :2]
    body = _planned(trace.run)
    if body is None:
        return np.asarray(made)
    pose = body.pose_and_twist(trace.time[first:])[0]
    planned = yawed(pose[:, :2] - pose[0, :2], np.full(len(pose), yaw - pose[0, 2]))
    return np.asarray(made - planned)


# Whether, when and how a robot fell, from the samples of a run.

TIPPED = math.radians(45.0)
"""Angle between the trunk's and the ground's upward direction that is a fall [rad] (*assumed*)."""

SUNK = 0.5
"""Height of the centre of mass over the lowest sole, of that at the start, that is a fall
(*assumed*)."""

OFF_GROUND = 0.1
"""Time without any loaded foot that is a fall [s] (*assumed*): a walk always stands on some."""

TIPPED_TEXT = f"tipped over by {math.degrees(TIPPED):.0f} degrees"
SUNK_TEXT = f"sank to {SUNK:.0%} of its standing height"


@dataclass(frozen=True)
class Fall:
    """A fall.

    Attributes:
        time: when it was first seen [s].
        how: "sank to half of its standing height", "tipped over by 45 degrees" or "all
            feet left the ground".
    """

    time: float
    how: str


def find_fall(trace: Trace) -> Fall | None:
    """Return the first fall of a run; None of a robot that stays on its feet.

    Up is the mean normal of the ground under the feet, so that slopes count as level. Where
    contacts were not recorded, it is against gravity, and only tipping over is seen.
    """
    if not trace.foot_names:
        return None
    if "contacts" not in trace.recorded:
        gravity = np.array(trace.run.gravity)
        up = np.broadcast_to(-gravity / np.linalg.norm(gravity), (len(trace.time), 3))
        return _first(trace.time, {TIPPED_TEXT: _tilt(trace.q, up) > TIPPED})
    up = trace.foot_normal.mean(axis=1)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    height = _height(trace, up)
    return _first(
        trace.time,
        {
            SUNK_TEXT: height < SUNK * height[0],
            TIPPED_TEXT: _tilt(trace.q, up) > TIPPED,
            "all feet left the ground": _long_enough(trace.contact, trace.time),
        },
    )


def _first(time: Array, found: Mapping[str, NDArray[np.bool_]]) -> Fall | None:
    """Return the first of falls, each by the samples that show it (T,)."""
    falls = [Fall(float(time[np.argmax(rows)]), how) for how, rows in found.items() if rows.any()]
    return min(falls, key=lambda fall: fall.time, default=None)


def _height(trace: Trace, up: Array) -> Array:
    """Return the height of the mass, or of the trunk, over the lowest foot centre (T,) [m]."""
    place = trace.com if "com" in trace.recorded else trace.q[:, :3]
    below = place[:, None, :] - trace.foot_position
    height: Array = np.einsum("tfi,ti->tf", below, up).max(axis=1)
    return height


def _tilt(q: Array, up: Array) -> Array:
    """Return the angle between the trunk's z axis and `up` (T,) [rad]."""
    x, y, z, w = q[:, 3:7].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    tilt: Array = np.arccos(np.clip(np.sum(axis * up, axis=1), -1.0, 1.0))
    return tilt


def _long_enough(contact: NDArray[np.bool_], time: Array) -> NDArray[np.bool_]:
    """Return where times begin in which no foot (T, F) is loaded for longer than OFF_GROUND."""
    rows = np.logical_not(contact.any(axis=1))
    edges = np.diff(np.concatenate([[False], rows, [False]]).astype(int))
    begin, end = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    found = np.zeros(len(rows), dtype=bool)
    found[begin[time[end] - time[begin] > OFF_GROUND]] = True
    return found
