"""Holding torque in the postures and on the feet that a walk visits, and with one leg lost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.trace import Trace
from hexapod_pin.robot.holding_torque import holding_torque


@dataclass(frozen=True, eq=False)
class HoldingDemand:
    """Static, quasi-static at every posture: no acceleration, feet push along gravity.

    Attributes:
        standing: |torque| in the first posture on all feet (n,) [N m].
        holding: largest |torque| in the stances that hold, (n,) [N m].
        holding_lost_leg: the same, any one leg lost; the lost leg's own joints left out (n,) [N m].
        unheld: share of the walk's stances that tip over at rest [-].
        unheld_lost_leg: the same with that leg (or foot) lost, by its name.
    """

    standing: Array
    holding: Array
    holding_lost_leg: Array
    unheld: float
    unheld_lost_leg: dict[str, float]

    @property
    def numbers(self) -> dict[str, Any]:
        """What `JointDemand` takes over."""
        return dict(vars(self))

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of it."""
        notes = [
            "holding torque is that of static equilibrium in the walk's postures on the feet that "
            "stand, and of the first posture on all feet; feet push along gravity, shares of least "
            "norm where they are open"
        ]
        if self.unheld > 0.0:
            notes.append(f"{100.0 * self.unheld:.0f} % of the stances of the walk cannot hold at "
                         "rest: the robot would tip over")  # fmt: skip
        fallen = {name: share for name, share in self.unheld_lost_leg.items() if share > 0.0}
        if fallen:
            shares = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in fallen.items())
            notes.append(f"stances of the walk that cannot hold without one leg: {shares}")
        return tuple(notes)


def holding_demand(robot: RecordedRobot, trace: Trace, samples: NDArray[np.intp]) -> HoldingDemand:
    """Return the holding torques of a trace at some of its samples.

    The trace's first posture, on all feet, is looked at besides them: a robot at rest.
    """
    feet = robot.robot.feet
    count = len(feet)
    stands = np.vstack([np.ones((1, count), bool), trace.contact[samples][:, :count]])
    q = np.vstack([trace.q[:1], trace.q[samples]])
    lost = ~np.eye(count, dtype=bool)
    supports = np.concatenate([stands[:, None], stands[:, None] & lost], axis=1)
    found = holding_torque(robot.model, foot_places(robot), q, supports)
    size = np.abs(found.torque)
    for foot in range(count):
        size[:, 1 + foot, list(robot.joints_above(foot))] = np.nan
    falls = 1.0 - found.holds[1:].mean(axis=0)
    names = _leg_names(robot)
    return HoldingDemand(
        size[0, 0],
        _largest(size[:, :1]),
        _largest(size[:, 1:]),
        float(falls[0]),
        {names[k]: float(falls[1 + k]) for k in range(count)},
    )


def foot_places(robot: RecordedRobot) -> list[tuple[int, Array]]:
    """Return the joint that moves each foot, and the foot in that joint's frame [m]."""
    feet = robot.robot.feet
    return [(robot.contact_joints[k], np.asarray(foot.offset)) for k, foot in enumerate(feet)]


def _leg_names(robot: RecordedRobot) -> list[str]:
    """Return the name of the leg that each foot belongs to, or the foot's own."""
    return [getattr(foot, "leg", None) or foot.name for foot in robot.robot.feet]


def _largest(size: Array) -> Array:
    """Return the largest of each joint over postures and supports; NaN where none holds."""
    flat = size.reshape(-1, size.shape[-1])
    known = np.isfinite(flat)
    return np.where(known.any(axis=0), np.where(known, flat, -np.inf).max(axis=0), np.nan)
