"""Cells of S1's comparison: a robot in a posture on a ground, with gaits and grounds drawn anew."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.control.gait_refusal import refuse_impossible
from hexapod_pin.errors import GaitError
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.study.compare import PlannedRun, compared, plan_runs
from hexapod_pin.study.runs.runner import run_study
from studies.foot_control.variants import (
    BOTH_WAYS,
    DISTURBED,
    NO_PARTS,
    S1,
    SOLE_UNKNOWN,
    TARGETS,
    TARGETS_SUSPENSION,
    VARIANTS,
    controls,
)

OWN, LEAST_TORQUE = "own", "least torque"
"""Postures: that of the robot's file, and that of `least_torque_posture`."""

REFERENCE = {
    "athena": hp.Gait.tripod(stroke=0.06, cycle_time=1.6, lift=0.04),
    "kharagpur": hp.Gait.tripod(stroke=0.06, cycle_time=1.2, lift=0.04),
}
"""Gaits for which the posture of least torque is searched."""

KINDS = ("tripod", "tetrapod", "ripple", "wave")
STROKE = (0.04, 0.08)
"""[m]"""

LIFT = (0.025, 0.04)
"""[m]"""

SWING = {"athena": (0.7, 0.9), "kharagpur": (0.55, 0.7)}
"""Time of a swing [s]; the cycle follows from the duty of the gait."""

MOST_DRAWS = 100
"""Gaits drawn for one that the robot can walk in both postures."""

CYCLES = 4.1
"""Length of a run: two cycles to start, two that count [cycles]."""

WHOLE = 0.01
"""Runs last a multiple of this, and so of every tick and fixed step [s]."""

CROSS_SLOPE = math.radians(7.0)
BUMP_HEIGHT = 0.4
"""Largest height of bumps over the lift [-]."""

BUMP_WAVELENGTH, FLAT_RADIUS, FIELD = 0.4, 0.15, 6.0
"""Of bumps; level ground about the start; side of the field [m]."""

PATCH, PATCHED = 0.2, (-0.8, 1.8, 0.8)
"""Side of a patch of soft or hard ground; from x, to x, and largest |y| of all patches [m]."""

SOFTEST = 0.02
"""Stiffness of the softest patch over that of the ground [-]; logarithms are drawn evenly."""

DRY_FRICTION = {"athena": 0.1, "kharagpur": 0.03}
"""Of the joints on the ground DRY: about 3 % of the largest torques on flat ground [N m]."""

FREE = 1e6
"""Stall torque [N m] and no-load speed [rad/s] of a motor that limits nothing."""

DRY = "dry joints"
TERRAINS = ("flat", "cross", "bumps", "soil", "patches", DRY)

ABLATED = ("flat", "bumps")
"""Grounds on which each part walks alone."""

ACCURATE = 1e-5
"""Accuracy of runs without parts [m and rad]: at 1e-4 they slip up to 3 % less, by the error of the
integration alone; runs in open loop have the steps of 1e-5 at 1e-4, too."""


@dataclass(frozen=True)
class Size:
    """How much the study does.

    Attributes:
        robots: names of the robots.
        postures: of `OWN` and `LEAST_TORQUE`.
        terrains: of `TERRAINS`.
        contacts: presets of `Contact`; soil has one of its own.
        ticks: of the controllers [s].
        draws: gaits and grounds per cell, by the name of the terrain.
        seed: of all that is drawn.
        settings: of the runs: their method or accuracy, where it is not the default.
        variants: controllers that walk in every cell; empty: those of `variants_in`.
        gait: numbers of all gaits in place of the drawn ones.
        bumps: largest height of bumps over the drawn lift [-].
        dissipation: of the sand in place of its own [s/m]; None: its own.
    """

    robots: tuple[str, ...]
    postures: tuple[str, ...]
    terrains: tuple[str, ...]
    contacts: tuple[str, ...]
    ticks: tuple[float, ...]
    draws: Mapping[str, int]
    seed: int
    settings: Mapping[str, Any]
    variants: tuple[str, ...] = ()
    gait: Mapping[str, float] = field(default_factory=dict)
    bumps: float = BUMP_HEIGHT
    dissipation: float | None = None


@dataclass(frozen=True)
class Cell:
    """A robot in a posture on a kind of ground with a contact.

    Attributes:
        robot: its name.
        posture: `OWN` or `LEAST_TORQUE`.
        terrain: of `TERRAINS`.
        contact: preset of `Contact`.
    """

    robot: str
    posture: str
    terrain: str
    contact: str

    @property
    def name(self) -> str:
        """Its name in the comparison."""
        return f"{self.robot}, {self.posture} posture, {self.terrain}, {self.contact}"

    @property
    def row(self) -> list[str]:
        """The first cells of its rows."""
        return [self.robot, self.posture, self.terrain, self.contact]


def variants_in(cell: Cell, size: Size) -> tuple[str, ...]:
    """Return the variants that walk in a cell.

    Where the size names none: parts do alone, and disturbed variants in the posture of least
    torque, on the grounds of `ABLATED`; with dry joints only what has no parts or the most.
    """
    if size.variants:
        return size.variants
    if cell.terrain == DRY:
        return (NO_PARTS, TARGETS_SUSPENSION)
    if cell.terrain not in ABLATED:
        return (NO_PARTS, S1, TARGETS, TARGETS_SUSPENSION, SOLE_UNKNOWN, BOTH_WAYS)
    if cell.posture == LEAST_TORQUE:
        return VARIANTS
    return tuple(one for one in VARIANTS if one not in DISTURBED)


HEAD = ["robot", "posture", "ground", "contact"]
"""Of the columns of `Cell.row`."""


def cells(size: Size) -> Iterator[Cell]:
    """Yield all cells; soil has one contact, its own."""
    for robot in size.robots:
        for posture in size.postures:
            for terrain in size.terrains:
                contacts = ("soil",) if terrain == "soil" else size.contacts
                for contact in contacts:
                    yield Cell(robot, posture, terrain, contact)


# What is drawn.


@dataclass(frozen=True)
class Draw:
    """A gait and a ground.

    Attributes:
        gait: that both postures can walk.
        terrain: the ground.
        seed: of the ground.
    """

    gait: hp.Gait
    terrain: Any
    seed: int


def draws(robots: Mapping[str, hp.Robot], name: str, terrain: str, size: Size) -> list[Draw]:
    """Return the gaits and grounds of a robot on a kind of ground: the same in all its cells.

    Args:
        robots: the robot by posture.
        name: of the robot.
        terrain: of `TERRAINS`.
        size: of the study.

    Raises:
        GaitError: the robot walks none of `MOST_DRAWS` gaits.
    """
    place = (size.seed, sorted(REFERENCE).index(name), TERRAINS.index(terrain))
    found = []
    for number in range(size.draws[terrain]):
        rng = np.random.default_rng([*place, number])
        gait = _gait(rng, robots, name)
        seed = int(rng.integers(2**31))
        ground = _terrain(rng, terrain, gait.lift, seed, size.bumps)
        found.append(Draw(gait.model_copy(update=dict(size.gait)), ground, seed))
    return found


def _gait(rng: np.random.Generator, robots: Mapping[str, hp.Robot], name: str) -> hp.Gait:
    """Return a gait that a robot can walk in all its postures."""
    for _ in range(MOST_DRAWS):
        kind = str(rng.choice(KINDS))
        stroke, lift, swing = (rng.uniform(*ends) for ends in (STROKE, LIFT, SWING[name]))
        duty = hp.Gait.by_name(kind, legs=6).duty
        gait = hp.Gait.by_name(
            kind, legs=6, stroke=round(stroke, 4), lift=round(lift, 4),
            cycle_time=round(swing / (1.0 - duty), 3),
        )  # fmt: skip
        try:
            for robot in robots.values():
                refuse_impossible(robot, gait)
        except GaitError as error:
            refusal = error
            continue
        return gait
    raise refusal


def _terrain(rng: np.random.Generator, name: str, lift: float, seed: int, bumps: float) -> Any:
    """Return a ground on which feet are lifted by `lift` [m], with bumps of that share of it."""
    if name == "cross":
        side = math.copysign(0.5 * math.pi, rng.uniform(-1.0, 1.0))
        return hp.Slope(angle=CROSS_SLOPE, heading=side)
    if name == "bumps":
        return hp.HeightField.random(
            seed, amplitude=bumps * lift, wavelength=BUMP_WAVELENGTH, size=FIELD,
            flat_radius=FLAT_RADIUS,
        )  # fmt: skip
    if name == "patches":
        return hp.terrain.PatchedGround(ground=hp.Flat(), patches=tuple(_patches(rng)))
    return hp.Flat()


def _patches(rng: np.random.Generator) -> Iterator[hp.terrain.Patch]:
    """Yield squares of soft and hard ground, side by side."""
    begin, end, half = PATCHED
    for x in np.arange(begin, end - 0.5 * PATCH, PATCH):
        for y in np.arange(-half, half - 0.5 * PATCH, PATCH):
            stiffness = math.exp(rng.uniform(math.log(SOFTEST), 0.0))
            low, high = (x, y), (x + PATCH, y + PATCH)
            yield hp.terrain.Patch(low=low, high=high, stiffness=stiffness)


# The runs.


@cache
def standing_robots(name: str, postures: tuple[str, ...]) -> dict[str, hp.Robot]:
    """Return a packaged robot by posture."""
    own = hp.load_robot(name)
    found = {OWN: own}
    if LEAST_TORQUE in postures:
        search = hp.motion.least_torque_posture(own, REFERENCE[name])
        found[LEAST_TORQUE] = hp.load_robot(name, posture=search.posture)
    return found


@dataclass(frozen=True)
class Found:
    """All runs of the study.

    Attributes:
        size: what was run.
        comparison: of all cells, by their names; conventional control is the baseline.
        drawn: gaits and grounds by robot and terrain.
    """

    size: Size
    comparison: Comparison
    drawn: Mapping[tuple[str, str], list[Draw]]

    @classmethod
    def of(cls, size: Size, **how: Any) -> Found:
        """Run everything; `how` are the options of `run_study`."""
        planned: list[PlannedRun] = []
        drawn = {}
        robots = {name: standing_robots(name, size.postures) for name in size.robots}
        for name in size.robots:
            for terrain in size.terrains:
                drawn[name, terrain] = draws(robots[name], name, terrain, size)
        for cell in cells(size):
            for number, draw in enumerate(drawn[cell.robot, cell.terrain]):
                planned += _runs(robots[cell.robot][cell.posture], cell, number, draw, size)
        return cls(size, run_study(compared, planned, **how), drawn)

    @property
    def data(self) -> dict[str, Any]:
        """What was drawn."""
        return {
            f"{robot}, {terrain}": [
                {"gait": draw.gait.to_dict(), "ground seed": draw.seed} for draw in drawn
            ]
            for (robot, terrain), drawn in self.drawn.items()
        }


def _runs(robot: hp.Robot, cell: Cell, number: int, draw: Draw, size: Size) -> Iterator[PlannedRun]:
    """Yield the runs of all controllers on one ground."""
    servo = hp.Servo.for_robot(robot)
    if cell.terrain == DRY:
        friction = DRY_FRICTION[cell.robot]
        motor = hp.Motor(stall_torque=FREE, no_load_speed=FREE, dry_friction=friction)
        servo = servo.model_copy(update={"motor": motor})
    contact = hp.Contact.preset(cell.contact)
    if size.dissipation is not None:
        normal = contact.normal.model_copy(update={"dissipation": size.dissipation})
        contact = contact.model_copy(update={"normal": normal})
    scene = hp.Scene(robot, terrain=draw.terrain, contact=contact, servo=servo)
    given = variants_in(cell, size)
    still, others = (
        [one for one in given if (one == NO_PARTS) is alone] for alone in (True, False)
    )
    walks: dict[str, Any] = {CONVENTIONAL: hp.KinematicControl(draw.gait)}
    walks |= controls(draw.gait, servo, size.ticks, others)
    accurate = controls(draw.gait, servo, size.ticks, still)
    how = dict(size.settings)
    how["duration"] = WHOLE * math.ceil(CYCLES * draw.gait.cycle_time / WHOLE)
    runs = plan_runs({cell.name: scene}, walks, **how)
    if accurate:
        runs += plan_runs({cell.name: scene}, accurate, **{"accuracy": ACCURATE, **how})
    for run in runs:
        yield PlannedRun(run.scene, number, run.controller, run.case)
