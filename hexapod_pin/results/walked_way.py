"""How far a run came of what its plan asked for: way, yaw, and over which time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.results.planned_turn import gait_turn_rate
from hexapod_pin.results.steady_window import steady_window, summary_window
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.way import heading_at, trunk_yaw
from hexapod_pin.spec import parsed_toml

LEAST_WAY = 0.25
"""Planned way over the stroke below which a run is too short to judge its speed (*assumed*)."""

LEAST_TURN = math.radians(2.0)
"""Planned yaw below which it is not judged as a share [rad] (*assumed*)."""


@dataclass(frozen=True)
class WalkedWay:
    """Way and yaw of a run, planned and made, between two times.

    Attributes:
        start: [s].
        end: [s].
        cycles: whole gait cycles between them; None where the whole run is judged.
        planned_way: along the planned direction, which turns with the trunk [m].
        way: made along it, by the centre of mass [m].
        planned_turn: yaw, left > 0 [rad].
        turn: made [rad].
        least_way: planned way below which none is judged [m].
    """

    start: float
    end: float
    cycles: int | None
    planned_way: float
    way: float
    planned_turn: float
    turn: float
    least_way: float = 0.0

    @property
    def speed(self) -> float:
        """Mean speed along the planned direction [m/s]."""
        return self.way / (self.end - self.start) if self.end > self.start else 0.0

    @property
    def nominal_speed(self) -> float:
        """Mean of the plan [m/s]."""
        return self.planned_way / (self.end - self.start) if self.end > self.start else 0.0

    @property
    def speed_share(self) -> float | None:
        """Way over planned way [-]; None where too little or nothing was planned."""
        judged = self.planned_way > max(self.least_way, 0.0)
        return self.way / self.planned_way if judged else None

    @property
    def turn_share(self) -> float | None:
        """Yaw over planned yaw [-]; None where too little or nothing was planned."""
        return self.turn / self.planned_turn if abs(self.planned_turn) >= LEAST_TURN else None

    @property
    def yaw_error(self) -> float:
        """Yaw beyond that of the plan [rad], left > 0."""
        return self.turn - self.planned_turn


def walked_way(trace: Trace) -> WalkedWay:
    """Return the way of a run over its whole cycles of steady walking, else over all of it."""
    controller = settings_of(trace.meta, "controller")
    if trace.meta.get("cycle_time") is not None:
        try:
            return _over_cycles(trace)
        except ParameterError:  # no whole cycle
            pass
    return _over_all(trace, controller)


def settings_of(meta: Mapping[str, Any], part: str) -> Mapping[str, Any]:
    """Return the settings of a run's "controller" or "scene"; none where it does not tell."""
    try:
        return parsed_toml(str(meta.get(part, "")))
    except ParameterError:
        return {}


def _over_cycles(trace: Trace) -> WalkedWay:
    """Return the way over whole cycles: distance and speed are those of the torque budget."""
    window = (
        summary_window(trace.summary, trace.time) if trace.has_summary else steady_window(trace)
    )
    budget, cycles = torque_budget(trace), window.cycles or 1
    time = window.end - window.start
    yaw = np.unwrap(trunk_yaw(trace.q[window.samples]))
    nominal = float(trace.meta.get("nominal_speed") or 0.0)
    return WalkedWay(
        window.start, window.end, window.cycles,
        planned_way=nominal * time, way=(budget.distance or 0.0) * cycles,
        planned_turn=gait_turn_rate(trace.meta) * time, turn=float(yaw[-1] - yaw[0]),
    )  # fmt: skip


def _over_all(trace: Trace, controller: Mapping[str, Any]) -> WalkedWay:
    """Return the way of a whole run against the planned motion of the body, ramps included."""
    time = trace.time
    speed = trace.meta.get("nominal_speed")
    try:
        # Late, by name: a trace is read without a planner; only a plan that changes needs one.
        planner = import_module("hexapod_pin.control.planned_body")
        body = planner.planned_body(controller, None if speed is None else float(speed))
    except (ParameterError, GaitError, TypeError):
        body = None
    yaw = np.unwrap(trunk_yaw(trace.q))
    turn = float(yaw[-1] - yaw[0])
    if body is None or len(time) < 2:
        return WalkedWay(float(time[0]), float(time[-1]), None, 0.0, 0.0, 0.0, turn)
    pose, twist = body.pose_and_twist(time)
    size = np.linalg.norm(twist[:, :2], axis=1)
    pace = 0.5 * (twist[1:, :2] + twist[:-1, :2])
    length = np.linalg.norm(pace, axis=1)
    moving = length > 0.0
    along = np.divide(pace, length[:, None], where=moving[:, None], out=np.zeros_like(pace))
    middle = 0.5 * (yaw[1:] + yaw[:-1]) - yaw[0]
    place = trace.com if "com" in trace.recorded else trace.q
    ways = np.diff(place[:, :2], axis=0) * heading_at(middle, along)
    planned = float(np.sum(0.5 * (size[1:] + size[:-1]) * np.diff(time)))
    return WalkedWay(
        float(time[0]), float(time[-1]), None, planned_way=planned, way=float(ways.sum()),
        planned_turn=float(pose[-1, 2] - pose[0, 2]), turn=turn,
        least_way=LEAST_WAY * _stroke(body.gait, float(size.max())),
    )  # fmt: skip


def _stroke(gait: Any, speed: float) -> float:
    """Return the stroke at a speed [m]."""
    return float(speed * gait.duty * gait.cycle_time)
