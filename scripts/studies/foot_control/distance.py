"""Ten metres over bumps, a slope and a step that the robot does not know of."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import fall_of
from hexapod_pin.results.summary import Summary
from hexapod_pin.text_table import Table
from studies.foot_control.scenes import (
    Size,
    controllers,
    ground,
    uneven,
)

PLANNED = 1.15
"""Way of the plan over the way asked for."""

GROUNDS = ("bumps", "slope", "step")
NAME = "all"


@dataclass(frozen=True)
class LongWalk:
    """A walk over unknown ground.

    Attributes:
        robot: name of the robot.
        scene: name of the ground.
        seed: of the bumps.
        controller: name of the controller.
        asked: how far it should go [m].
        reached: how far it went along the heading, from the first whole cycle on [m].
        arrived: when it had gone as far as asked; nan: never [s].
        planned: time that the plan needs [s].
        drift: lateral distance from the start at the end [m].
        slip: path of all feet per metre [m/m].
        fall: when and how it fell.
        wall: time that the runs of its group took, per run [s].
    """

    robot: str
    scene: str
    seed: int
    controller: str
    asked: float
    reached: float = np.nan
    arrived: float = np.nan
    planned: float = np.nan
    drift: float = np.nan
    slip: float = np.nan
    fall: str = ""
    wall: float = np.nan

    @property
    def met(self) -> bool:
        """Whether it went as far as asked without a fall."""
        return self.reached >= self.asked and not self.fall


def long_walks(robot: str, size: Size) -> list[LongWalk]:
    """Return walks with and without the controller."""
    gait = uneven(robot)
    far = PLANNED * size.far + (gait.stroke if size.quick else 0.0)
    far = max(far, 3.2 * gait.cycle_time * gait.speed)
    places = [(name, seed) for name in GROUNDS for seed in range(3 if name == "bumps" else 1)]
    found = []
    for name, control in controllers(gait, (NAME,)).items():
        cases = [
            hp.Case(ground(robot, scene, way=far, seed=seed), control, duration=far / gait.speed)
            for scene, seed in size.some(places)
        ]
        begin = time.perf_counter()
        results = hp.simulate_batch(cases, threads=1, keep="summary")
        wall = (time.perf_counter() - begin) / len(cases)
        for (scene, seed), result in zip(size.some(places), results, strict=True):
            found.append(_judged(robot, scene, seed, name, result, size.far, gait.speed, wall))
    return found


def _judged(
    robot: str, scene: str, seed: int, name: str, result: object, asked: float,
    speed: float, wall: float,
) -> LongWalk:  # fmt: skip
    place = (robot, scene, seed, name, asked)
    if not isinstance(result, Summary):
        return LongWalk(*place, fall=str(result).partition("\n")[0], wall=wall)
    way = result.path
    x = way[:, 1]
    beyond = np.flatnonzero(x >= asked)
    arrived = float(np.interp(asked, x, way[:, 0])) if len(beyond) else np.nan
    slip = float(result.slip_distance.sum()) * (result.cycles or 1) / max(1e-9, x[-1] - x[0])
    return LongWalk(
        *place, float(x.max()), arrived, asked / speed, float(way[-1, 2]), slip,
        fall_of(result), wall,
    )  # fmt: skip


def distance_table(found: list[LongWalk]) -> Table:
    """Return all walks."""
    rows = [
        [one.robot, one.scene + (f" {one.seed}" if one.scene == "bumps" else ""), one.controller,
         f"{one.reached:.2f}", f"{one.arrived:.1f} ({one.planned:.1f})", f"{one.drift:+.3f}",
         f"{one.slip:.3f}", one.fall or "-", f"{one.wall:.1f}",
         f"{'pass' if one.met else 'FAIL'}" if one.controller != CONVENTIONAL
         else "reached" if one.met else "not reached"]
        for one in found
    ]  # fmt: skip
    return Table(
        f"{found[0].asked:g} m over unknown ground",
        [
            "robot", "ground", "controller", "reached [m]", "arrived (plan) [s]",
            "lateral drift [m]", "slip [m/m]", "fall", "computing [s]", "verdict",
        ],
        rows,
    )  # fmt: skip
