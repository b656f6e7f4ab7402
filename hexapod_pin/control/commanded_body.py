"""A body follows a velocity command in the plane.

The planned motion of a recorded walk is rebuilt from its settings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import FiniteFloat

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import (
    COINCIDENT,
    RAMP_CYCLES,
    BodyPath,
    Footholds,
    PlanarMotion,
    last_motion,
    smooth_step,
)
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.rotations import yawed
from hexapod_pin.spec import Spec

# Speed and turn rate that change while walking, as data.

COLUMNS = ("forward", "lateral", "turn_rate")


class VelocityCommand(Spec):
    """Steps of the commanded velocity of the body, each constant until the next; the last stays.

    The body follows smoothly: see `CommandedBody`. Before the first step it stands.

    Attributes:
        time: when each step begins, strictly increasing, from 0 or later [s]. S of them.
        forward: speed ahead [m/s]; S of them, or one for all.
        lateral: speed to the left [m/s]; S of them, or one for all.
        turn_rate: yaw rate, positive to the left [rad/s]; S of them, or one for all.

    Raises:
        ParameterError: no step, times not increasing from 0 on, or an unequal number of values.
    """

    kind: Literal["steps"] = "steps"
    time: tuple[FiniteFloat, ...]
    forward: FiniteFloat | tuple[FiniteFloat, ...] = 0.0
    lateral: FiniteFloat | tuple[FiniteFloat, ...] = 0.0
    turn_rate: FiniteFloat | tuple[FiniteFloat, ...] = 0.0

    def __init__(self, /, **fields: Any) -> None:
        """Check the steps."""
        super().__init__(**fields)
        if not self.time or self.time[0] < 0.0 or not (np.diff(self.time) > 0.0).all():
            raise ParameterError(
                "VelocityCommand.time", self.time, "one or more, strictly increasing from 0 s on"
            )
        for name in COLUMNS:
            values = getattr(self, name)
            if isinstance(values, tuple) and len(values) != len(self.time):
                raise ParameterError(
                    f"VelocityCommand.{name}", values, f"one number or {len(self.time)}, as of time"
                )

    @property
    def twists(self) -> Array:
        """Forward and lateral speed [m/s] and turn rate [rad/s] of each step. Shape (S, 3)."""
        columns = [np.broadcast_to(getattr(self, name), len(self.time)) for name in COLUMNS]
        return np.stack(columns, axis=-1).astype(float)

    def gaits(self, gait: Gait) -> Iterator[tuple[float, Gait]]:
        """Yield the begin of each step [s], and the gait that walks at its speed for ever.

        The stroke is speed * duty * cycle time.
        """
        for time, (forward, lateral, turn_rate) in zip(
            self.time, self.twists.tolist(), strict=True
        ):
            speed = float(np.hypot(forward, lateral))
            fields = {
                "stroke": speed * gait.duty * gait.cycle_time,
                "heading": float(np.arctan2(lateral, forward)) if speed else 0.0,
                "turn_rate": turn_rate,
            }
            yield time, gait.with_changes(**fields)


# Planar motion of a body that follows a velocity command, and the footholds it foresees.

MAX_ACCELERATION = 0.5
"""Largest acceleration of the body that a command causes [m/s^2], *assumed*."""

MAX_TURN_ACCELERATION = 1.0
"""Largest angular acceleration of the body that a command causes [rad/s^2], *assumed*."""

STEEPEST = 1.875
"""Largest slope of the smooth step."""

PIECES_PER_RAMP = 8
NODES = 10  # of Gauss and Legendre in a piece
PREDICTION_NODES = 32


@dataclass(frozen=True, eq=False)
class CommandedBody(PlanarMotion):
    """A body that follows a velocity command: each step's change is followed by a smooth step.

    The velocity is the sum of the changes so far, each times 10 s^3 - 15 s^4 + 6 s^5 of its age
    over `ramp`: twice continuously differentiable, and never beyond the commands. The ramp is that
    of a gait's start, RAMP_CYCLES cycles, or longer where the range R of the commands (rest
    included) needs it: the acceleration is at most STEEPEST R / ramp <= MAX_ACCELERATION, because
    the weights of the changes have that as their largest slope and integrate to one.

    Attributes:
        gait: the gait.
        command: what to follow.
    """

    gait: Gait
    command: VelocityCommand

    @cached_property
    def ramp(self) -> float:
        """Time in which a step is followed [s]."""
        twists = np.concatenate([np.zeros((1, 3)), self.command.twists])
        spread = np.ptp(twists, axis=0)
        slowest = max(
            float(np.hypot(spread[0], spread[1])) / MAX_ACCELERATION,
            float(spread[2]) / MAX_TURN_ACCELERATION,
        )
        return max(RAMP_CYCLES * self.gait.cycle_time, STEEPEST * slowest)

    @cached_property
    def kinks(self) -> Array:
        """Times at which a third derivative of the pose jumps [s]."""
        return np.unique(np.concatenate([self._begin, self._begin + self.ramp]))

    def known(self, time: Array) -> NDArray[np.intp]:
        """Return how many steps have begun at times [s]. Shape of `time`."""
        return np.searchsorted(self._begin, time, side="right")

    def twist(self, time: Array, known: NDArray[np.intp] | None = None) -> Array:
        """Return forward and lateral speed [m/s] and yaw rate [rad/s].

        Args:
            time: [s]. Any shape (...).
            known: how many steps count; None: all.

        Returns:
            Shape (..., 3).
        """
        done, active = self._steps(time, known)
        twist: Array = self._sums[done]
        for row, weight, share in active:
            twist = (
                twist + self._changes[row] * np.where(weight, smooth_step(share)[1], 0.0)[..., None]
            )
        return twist

    def yaw(self, time: Array, known: NDArray[np.intp] | None = None) -> Array:
        """Return the integral of the yaw rate from t = 0 [rad]. Arguments as of `twist`."""
        done, active = self._steps(time, known)
        yaw: Array = self._sums[done, 2] * time - self._delays[done]
        for row, weight, share in active:
            walked = self.ramp * smooth_step(share)[0]
            yaw = yaw + self._changes[row, 2] * np.where(weight, walked, 0.0)
        return yaw

    def pose_and_twist(self, time: Array) -> tuple[Array, Array]:
        """Return x, y [m] and yaw [rad] in the world, from 0 at t = 0, and `twist`. (K, 3) each."""
        t = np.asarray(time, dtype=float)
        marks, passed = self._grid(float(t.max(initial=0.0)))
        piece = np.clip(np.searchsorted(marks, t, side="right") - 1, 0, len(marks) - 2)
        since = np.minimum(marks[piece], t)
        place = passed[piece] + self._travel(since, t, None, NODES)
        return np.concatenate([place, self.yaw(t)[..., None]], axis=-1), self.twist(t)

    def foreseen(self, now: Array, then: Array) -> Array:
        """Return the poses expected at some times if the commands stay as they are. (M, 3).

        Args:
            now: times of the prediction [s]. Shape (M,).
            then: the times, later [s]. Shape (M,).
        """
        known = self.known(now + COINCIDENT * self.gait.cycle_time)
        pose = self.pose(then)
        changed = np.flatnonzero(self.known(then) > known)
        if len(changed):
            begin, end, count = now[changed], then[changed], known[changed]
            place = self.pose(begin)[:, :2]
            pose[changed, :2] = place + self._travel(begin, end, count, PREDICTION_NODES)
            pose[changed, 2] = self.yaw(end, count)
        return pose

    @cached_property
    def _begin(self) -> Array:
        return np.array(self.command.time)

    @cached_property
    def _changes(self) -> Array:
        """Change of the command at each step. Shape (S, 3)."""
        return np.diff(self.command.twists, axis=0, prepend=0.0)

    @cached_property
    def _sums(self) -> Array:
        """Sum of the first changes. Shape (S + 1, 3)."""
        return np.concatenate([np.zeros((1, 3)), np.cumsum(self._changes, axis=0)])

    @cached_property
    def _delays(self) -> Array:
        """Yaw that the first changes lack: they began late and slowly [rad]. Shape (S + 1,)."""
        late = self._changes[:, 2] * (self._begin + 0.5 * self.ramp)
        return np.append(0.0, np.cumsum(late))

    def _steps(
        self, time: Array, known: NDArray[np.intp] | None
    ) -> tuple[NDArray[np.intp], list[tuple[NDArray[np.intp], NDArray[np.bool_], Array]]]:
        """Return how many steps are over, and of the active ones row, mask and share so far."""
        begun = self.known(time) if known is None else np.minimum(self.known(time), known)
        done = np.minimum(np.searchsorted(self._begin, time - self.ramp, side="right"), begun)
        active = []
        for nth in range(int(np.max(begun - done, initial=0))):
            row = np.minimum(done + nth, len(self._begin) - 1)
            active.append((row, done + nth < begun, (time - self._begin[row]) / self.ramp))
        return done, active

    def _travel(
        self, begin: Array, end: Array, known: NDArray[np.intp] | None, nodes: int
    ) -> Array:
        """Return the travel in the world between times (M,) [s], by Gauss' rule [m]. (M, 2)."""
        s, weight = np.polynomial.legendre.leggauss(nodes)
        half = 0.5 * (end - begin)[:, None]
        time = begin[:, None] + half * (s + 1.0)
        count = None if known is None else np.repeat(known[:, None], nodes, axis=1)
        velocity = np.append(self.twist(time, count)[..., :2], np.zeros((*time.shape, 1)), axis=-1)
        along: Array = (yawed(velocity, self.yaw(time, count)) * weight[:, None]).sum(axis=1)
        return half * along[:, :2]

    def _grid(self, until: float) -> tuple[Array, Array]:
        """Return times that part the motion (M,) [s] and x, y there (M, 2) [m]."""
        step = self.ramp / PIECES_PER_RAMP
        known = self.__dict__.setdefault("_grids", {})
        count = 2 ** int(np.ceil(np.log2(max(until / step, 1.0) + 1.0)))
        if count not in known:
            even = np.arange(count + 1) * step
            marks = np.unique(np.concatenate([even, self.kinks[self.kinks < even[-1]]]))
            travel = self._travel(marks[:-1], marks[1:], None, NODES)
            known[count] = marks, np.concatenate([np.zeros((1, 2)), np.cumsum(travel, axis=0)])
        found: tuple[Array, Array] = known[count]
        return found


@dataclass(frozen=True, eq=False)
class ForeseenFootholds(Footholds):
    """Footholds chosen at lift-off, from the command up to that time.

    Attributes:
        body: the motion of the base, known to each foot up to its lift-off.
    """

    body: CommandedBody

    def at(self, placement: Array) -> Array:
        """Return footholds as `Footholds.at`, under the body foreseen at mid-stance."""
        middle = self.middle(placement)
        aloft = (1.0 - 0.5 * self.gait.duty) * self.gait.cycle_time
        lift_off = np.where(middle > COINCIDENT, middle - aloft, 0.0)
        pose = self.body.foreseen(lift_off.ravel(), middle.ravel())
        return self.under(pose.reshape(*middle.shape, 3))


# The planned motion of the body, from the settings of a controller as a trace keeps them.


def planned_body(settings: Mapping[str, Any], speed: float | None = None) -> PlanarMotion | None:
    """Return the planned planar motion of the body; None where the settings plan none.

    Args:
        settings: `to_dict` of a controller: a walk on straight paths or arcs, with or without foot
            control.
        speed: of a gait whose own stroke is not what is walked, as on arcs [m/s].

    Raises:
        ParameterError, GaitError: the settings are not those of a gait.
    """
    walk = settings.get("walk", settings)
    if not isinstance(walk, Mapping) or not isinstance(walk.get("gait"), Mapping):
        return None
    gait = Gait(**walk["gait"])
    if "velocity" in walk:
        return CommandedBody(gait, VelocityCommand(**walk["velocity"]))
    if walk.get("kind") == "arc" and speed is not None:
        gait = gait.with_changes(stroke=speed * gait.duty * gait.cycle_time)
    return BodyPath(gait, halt=last_motion(gait, walk.get("stop_at")))
