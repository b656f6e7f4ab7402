"""Shared by tests of foot control: readings made by hand, the memory by name, recorded runs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control import leg_group
from hexapod_pin.control.feedback import Measurement

HEAD = {"pitch": 0, "roll": 1, "begun": 2, "lag": 3, "pace": 4, "upright": (5, 8)}
HEAD_SIZE = 8
LEG_FIELDS = {
    "mode": 1, "without_load": 1, "searched": 1, "rise": 1, "offset": 3, "left_with": 3, "lag": 3,
    "integral": 3, "error": 3, "slope": 3, "pid_begun": 1, "travel": 1, "travel_rate": 1,
    "force": 3, "foot": 3, "rates": 3, "slid": 3, "correction": 3, "displaced": 3, "share": 1,
    "target": 3, "servo_offset": 3, "wanted": 3,
}  # fmt: skip
EARLY, SEARCH = 2, 3


@cache
def robot(name: str) -> hp.Robot:
    return hp.load_robot(name)


def recall(memory: np.ndarray, name: str) -> np.ndarray:
    if name in HEAD:
        place = HEAD[name]
        return memory[:, slice(*place) if isinstance(place, tuple) else place]
    legs = memory[:, HEAD_SIZE:].reshape(len(memory), 6, -1)
    assert legs.shape[2] == sum(LEG_FIELDS.values())
    names = list(LEG_FIELDS)
    first = sum(LEG_FIELDS[before] for before in names[: names.index(name)])
    part = legs[..., first : first + LEG_FIELDS[name]]
    return part[..., 0] if LEG_FIELDS[name] == 1 else part


def reading(
    name: str = "kharagpur", feet: Any = None, batch: int = 1, **others: Any
) -> Measurement:
    six = leg_group(robot(name))
    q = six.joint_angles((six.neutral_feet if feet is None else np.asarray(feet))[None])
    n = q.shape[1]
    still = Measurement(
        time=0.0, q=np.tile(q, (batch, 1)), v=np.zeros((batch, n)), torque=np.zeros((batch, n)),
        rotation=np.tile(np.eye(3), (batch, 1, 1)), angular_velocity=np.zeros((batch, 3)),
        acceleration=np.tile([0.0, 0.0, 9.81], (batch, 1)), foot_force=np.zeros((batch, 6, 3)),
        loaded=np.zeros((batch, 6), dtype=bool),
    )  # fmt: skip
    return replace(still, **others)


def foot_order(name: str) -> np.ndarray:
    feet = [foot.name for foot in robot(name).feet]
    return np.array(
        [feet.index(robot(name).leg(leg.name).foot) for leg in leg_group(robot(name)).legs]
    )


def in_foot_order(name: str, forces: Any) -> np.ndarray:
    out = np.zeros((1, 6, 3))
    out[0, foot_order(name)] = forces
    return out


@dataclass
class Recorded:
    """A controller that records measurements, memories and commands of another one."""

    control: hp.FootControl
    measured: list[Measurement] = field(default_factory=list)
    memories: list[np.ndarray] = field(default_factory=list)
    answers: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Copy the attributes that a run needs."""
        self.period, self.delay = self.control.period, self.control.delay
        self.sensors, self.gait = self.control.sensors, self.control.gait
        self.posture, self.start = self.control.posture, self.control.start

    def update(self, time: float, m: Measurement, state: Any) -> tuple[hp.feedback.Command, Any]:
        command, state = self.control.update(time, m, state)
        self.measured.append(m)
        self.memories.append(state["memory"])
        self.answers.append(command.q)
        return command, state

    def recalled(self, name: str) -> np.ndarray:
        return np.array([recall(memory, name)[0] for memory in self.memories])


def standing(cycle_time: float = 20.0) -> hp.KinematicControl:
    command = hp.motion.VelocityCommand(time=[0.0, 1000.0], forward=[0.0, 0.0])
    return hp.KinematicControl(hp.Gait.tripod(cycle_time=cycle_time), velocity=command)
