"""How long a trajectory is a prediction: growth of a small error at t = 0, by gait and ground.

Two runs start at states a hair apart and are integrated far tighter than that. How far apart they
are later, over how far they were at the start, is the amplification of any error made so early.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from random_scenes import KINDS, PromiseScene, draw_scene
from random_scenes.named import walk
from random_scenes.robots import WALKERS

from hexapod_pin.control.gait import GAITS
from hexapod_pin.errors import HexapodError
from hexapod_pin.ground.terrain import AnyTerrain, Flat, HeightField, Slope, Stairs
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.amplification import (
    ROUND_OFF,
    START_ERROR,
    STEP_ACCURACY,
    Amplification,
    amplification,
)
from hexapod_pin.text_table import Table
from studies.study import StudyReport

USEFUL = 1e-4
"""Error beyond which a trajectory is taken to mean nothing [m, rad]."""

SEED = 2026
"""Of the drops and throws."""


@dataclass(frozen=True)
class Growth:
    """How an error at t = 0 grows in a scene.

    Attributes:
        name: of the scene.
        found: positions.
        torque: relative change of the largest and of the RMS torque of any joint [-].
    """

    name: str
    found: Amplification
    torque: tuple[float, float]


def growth_of(name: str, scene: PromiseScene) -> Growth:
    """Run a scene twice, from starts a hair apart."""
    found = amplification(
        scene.scene, scene.controller, duration=scene.duration, sample=scene.sample,
        initial=scene.initial,
    )  # fmt: skip
    return Growth(name, found, _torque_changes(*found.runs))


def _torque_changes(first: Trace, second: Trace) -> tuple[float, float]:
    """Return the relative changes of the largest and of the largest RMS torque of any joint."""
    half = len(first.time) // 2
    torques = [np.abs(trace.torque[half:]) for trace in (first, second)]
    peaks = [float(torque.max(initial=0.0)) for torque in torques]
    means = [float(np.sqrt(np.mean(torque**2, axis=0)).max(initial=0.0)) for torque in torques]
    if peaks[0] == 0.0:  # nothing drives
        return 0.0, 0.0
    return abs(peaks[1] / peaks[0] - 1.0), abs(means[1] / means[0] - 1.0)


GROUNDS: Mapping[str, AnyTerrain] = {
    "flat": Flat(),
    "slope": Slope(angle=0.1),
    "stairs": Stairs(rise=0.005, run=0.15, count=3, start=0.05),
    "rough": HeightField.random(3, amplitude=0.005, wavelength=0.3, size=4.0),
}
"""Where the walks are, by name."""

TIMES = (0.1, 1.0, 10.0, 60.0)
"""At which factors are told [s]."""

HEAD = (
    "scene", *(f"after {time:g} s" for time in TIMES), "growth [1/s]",
    "a prediction until [s]", "peak torque moves by", "RMS torque moves by",
)  # fmt: skip


def predictability(
    *, duration: float = 10.0, robots: str = ",".join(WALKERS), gaits: str = ",".join(GAITS),
    grounds: str = ",".join(GROUNDS), long: float = 60.0, drawn: int = 6,
) -> StudyReport:  # fmt: skip
    """How an error at t = 0 grows in walks, drops and throws, and what remains predictable."""
    walks = [
        _growth(f"{robot}, {gait}, {ground}", _on(walk(robot, gait, duration), ground))
        for robot in robots.split(",") for gait in gaits.split(",")
        for ground in grounds.split(",")
    ]  # fmt: skip
    longer = [
        _growth(f"{robot}, {gait}, flat", walk(robot, gait, long))
        for robot in robots.split(",") for gait in gaits.split(",")
    ]  # fmt: skip
    falls = [
        _growth(f"{kind} {index}", draw_scene(SEED, index, {kind: KINDS[kind]}))
        for kind in ("dropped", "thrown", "bouncing") for index in range(drawn)
    ]  # fmt: skip
    parts: list[str | Table] = [
        f"Two runs of NDF at {STEP_ACCURACY:g}; their starts differ by at most {START_ERROR:g} m "
        "and rad in each position. The factor is how far any position has come to be apart, over "
        "that; the largest so far. Growth is that of an exponential through the factors after "
        "the first second. A trajectory is taken for a prediction until round-off of "
        f"{ROUND_OFF:g} at t = 0, grown so, is {USEFUL:g} m or rad. Torques are those of the "
        "second half of the run.",
        Table(f"Walks of {duration:g} s", HEAD, tuple(map(_row, walks))),
        Table(f"Walks of {long:g} s", HEAD, tuple(map(_row, longer))),
        Table("Drops, throws and bounces", HEAD, tuple(map(_row, falls))),
        _conclusion(walks, longer, falls),
    ]
    return StudyReport("How long a trajectory is a prediction", parts)


def _growth(name: str, scene: PromiseScene) -> Growth | str:
    """Return the growth in a scene, or why there is none."""
    try:
        return growth_of(name, scene)
    except HexapodError as error:
        return f"{name}: {type(error).__name__}"


def _on(scene: PromiseScene, ground: str) -> PromiseScene:
    return replace(scene, scene=replace(scene.scene, terrain=GROUNDS[ground]))


def _row(found: Growth | str) -> tuple[str, ...]:
    if isinstance(found, str):
        return (found, *["not run"] * (len(HEAD) - 1))
    factors = (found.found.at(time) for time in TIMES)
    until = found.found.horizon(USEFUL)
    horizon = "the end" if math.isinf(until) else f"{until:.3g}"
    return (
        found.name, *("-" if math.isnan(factor) else f"{factor:.3g}" for factor in factors),
        f"{found.found.rate:.2g}", horizon, *(f"{change:.1e}" for change in found.torque),
    )  # fmt: skip


def _conclusion(*groups: Sequence[Growth | str]) -> str:
    """Return the largest factors and the largest changes of torques, in words."""
    lines = []
    for name, group in zip(("10 s walks", "long walks", "drops and throws"), groups, strict=True):
        found = [one for one in group if isinstance(one, Growth)]
        if not found:
            continue
        factors = [float(one.found.factor[-1]) for one in found]
        peaks, means = zip(*(one.torque for one in found), strict=True)
        lines.append(
            f"- {name}: factor {np.median(factors):.3g} in the median, {max(factors):.3g} at most; "
            f"peak torques move by {max(peaks):.1e} at most, RMS torques by {max(means):.1e}."
        )
    return "\n".join(lines)
