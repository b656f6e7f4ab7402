"""Ten metres over bumps, a slope and a step that the robot does not know of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL, named_controls
from hexapod_pin.ground.terrain import study_grounds
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.walk_metrics import fall_of
from hexapod_pin.text_table import Table
from studies.study import StudyReport

GAITS = {
    "athena": hp.Gait.tripod(stroke=0.08, cycle_time=1.6, lift=0.04),
    "kharagpur": hp.Gait.tripod(stroke=0.10, cycle_time=1.2, lift=0.04),
}

PLANNED = 1.15
"""Distance of the plan over the distance asked for [-]."""

BEYOND = 1.5
"""Ground beyond the end of the plan [m]."""

GROUNDS = ("bumps", "slope", "step")
SEEDS = 3
"""Grounds of bumps."""

ALL = "all"
"""Slip correction, suspension, touch-down detection and levelling."""


@dataclass(frozen=True)
class LongWalk:
    """A walk over unknown ground.

    Attributes:
        robot: name of the robot.
        ground: name of the ground, with the seed of bumps.
        controller: name of the controller.
        asked: how far it should go [m].
        reached: how far it went along the heading, from the first whole cycle on [m].
        arrived: when it had gone as far as asked; nan: never [s].
        planned: time that the plan needs [s].
        drift: lateral distance from the start at the end [m].
        slip: slip path of all feet per metre [m/m].
        fall: when and how it fell.
    """

    robot: str
    ground: str
    controller: str
    asked: float
    reached: float = np.nan
    arrived: float = np.nan
    planned: float = np.nan
    drift: float = np.nan
    slip: float = np.nan
    fall: str = ""

    @property
    def met(self) -> bool:
        """Whether it went as far as asked without a fall."""
        return self.reached >= self.asked and not self.fall

    @property
    def verdict(self) -> str:
        """The last cell of its row; only foot control is asked to arrive."""
        if self.controller == CONVENTIONAL:
            return "reached" if self.met else "not reached"
        return "pass" if self.met else "FAIL"

    def row(self) -> list[str]:
        """Return the cells of its row."""
        return [
            self.robot, self.ground, self.controller, f"{self.reached:.2f}",
            f"{self.arrived:.1f} ({self.planned:.1f})", f"{self.drift:+.3f}", f"{self.slip:.3f}",
            self.fall or "-", self.verdict,
        ]  # fmt: skip


def unknown_ground(*, distance: float = 10.0, quick: bool = False) -> StudyReport:
    """Walks over unknown ground with conventional control and with all parts of foot control."""
    robots = ("kharagpur",) if quick else tuple(GAITS)
    found = [one for robot in robots for one in _walks(robot, 0.15 if quick else distance, quick)]
    head = [
        "robot", "ground", "controller", "reached [m]", "arrived (plan) [s]", "lateral drift [m]",
        "slip [m/m]", "fall", "verdict",
    ]  # fmt: skip
    title = f"{found[0].asked:g} m over unknown ground"
    return StudyReport(
        "Walks over unknown ground",
        [INTRODUCTION, Table(title, head, [one.row() for one in found])],
    )


def _walks(robot: str, asked: float, quick: bool) -> Iterator[LongWalk]:
    """Yield walks with and without the controller."""
    gait = GAITS[robot]
    # at least a whole steady cycle
    far = max(PLANNED * asked, 3.2 * gait.cycle_time * gait.speed)
    scenes = dict(_scenes(robot, far + BEYOND))
    if quick:
        scenes = {"step": scenes["step"]}
    controls: dict[str, Any] = named_controls(gait, (CONVENTIONAL, ALL))
    for name, control in controls.items():
        cases = [hp.Case(scene, control, duration=far / gait.speed) for scene in scenes.values()]
        results = hp.simulate_batch(cases, threads=1, keep="summary")
        for ground, result in zip(scenes, results, strict=True):
            yield _judged((robot, ground, name, asked), result, gait.speed)


def _scenes(robot: str, length: float) -> Iterator[tuple[str, hp.Scene]]:
    """Yield the grounds by name: bumps of several seeds, the others once."""
    for name in GROUNDS:
        for seed in range(SEEDS if name == "bumps" else 1):
            terrain, contact = study_grounds(GAITS[robot].lift, seed=seed, length=length)[name]
            scene = hp.Scene(
                hp.load_robot(robot), terrain=terrain, contact=contact or hp.Contact.accurate()
            )
            yield (f"{name} {seed}" if name == "bumps" else name), scene


def _judged(place: tuple[str, str, str, float], result: object, speed: float) -> LongWalk:
    """Return what a walk came to."""
    if not isinstance(result, Summary):
        return LongWalk(*place, fall=str(result).partition("\n")[0])
    asked, path = place[-1], result.path
    x = path[:, 1]
    beyond = np.flatnonzero(x >= asked)
    arrived = float(np.interp(asked, x, path[:, 0])) if len(beyond) else np.nan
    slip = float(result.slip_distance.sum()) * (result.cycles or 1) / max(1e-9, x[-1] - x[0])
    return LongWalk(
        *place, float(x.max()), arrived, asked / speed, float(path[-1, 2]), slip,
        fall_of(result),
    )  # fmt: skip


INTRODUCTION = """\
The robot does not know the terrain (`study_grounds`, lift 40 mm). "All" is slip correction,
suspension, touch-down detection and levelling; the same walks are shown without the controller.
A corner of the trunk below the ground also counts as a fall, because the trunk has no contact in
these runs (`Scene.body_contact` is off)."""
