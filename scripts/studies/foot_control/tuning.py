"""Gains of foot control tuned on some terrains, and what they are worth on others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import hexapod_pin as hp
from hexapod_pin.study.tuning_result import TuningResult
from hexapod_pin.text_table import Table
from studies.foot_control.ranking import ROBUST
from studies.foot_control.scenes import Size, ground, uneven

START = {"travel": 0.002, "frequency": 6.5, "damping": 1.6, "bandwidth": 10.0}
"""The defaults, the frequency 2 % below what 5 ms ticks give: travel [m], frequency [Hz],
damping [-], bandwidth of the slip correction [Hz]."""

BOUNDS = {
    "travel": (5e-4, 5e-3), "frequency": (2.0, 12.0), "damping": (0.5, 3.0),
    "bandwidth": (2.0, 15.0),
}  # fmt: skip

WEIGHTS = {"slip": 1.0, "vertical_acceleration_rms": 1.0, "force_peak": 1.0, "energy": 1.0}
SEED = 11
POPULATION = 8

TUNED = (("bumps", 0), ("bumps", 1), ("flat", 0), ("step", 0))
HELD_OUT = (("bumps", 5), ("bumps", 6), ("bumps", 7), ("slope", 0), ("soil", 0))
"""Grounds, and seeds of bumps."""


def _energy(summary: hp.Summary) -> float:
    return float((summary.positive_energy - summary.negative_energy).sum())


def _slip(summary: hp.Summary) -> float:
    return float(summary.slip_distance.sum())


OBJECTIVE = hp.study.RelativeObjective(WEIGHTS, {"energy": _energy, "slip": _slip})


def both(robot: str, values: Mapping[str, float]) -> hp.FootControl:
    """Return slip correction and suspension with the tuned gains."""
    return hp.FootControl(
        uneven(robot),
        slip=hp.foot_control.SlipPid(bandwidth=values["bandwidth"]),
        suspension=hp.foot_control.VirtualSuspension(
            travel=values["travel"], frequency=values["frequency"], damping=values["damping"]
        ),
    )


def _scenes(robot: str, places: Sequence[tuple[str, int]], size: Size) -> dict[str, hp.Scene]:
    return {
        name + (f" {seed}" if name == "bumps" else ""): ground(
            robot, name, way=_way(size), seed=seed
        )
        for name, seed in size.some(places)
    }


def _way(size: Size) -> float:
    return size.way if size.quick else size.way - 0.2


def tuned(robot: str, size: Size) -> TuningResult:
    """Return gains tuned on the grounds TUNED, with their scores on HELD_OUT."""
    gait = uneven(robot)
    return hp.tune(
        lambda values: both(robot, values), START, BOUNDS, _scenes(robot, TUNED, size), OBJECTIVE,
        held_out=_scenes(robot, HELD_OUT, size), baseline=hp.KinematicControl(gait), seed=SEED,
        budget=size.candidates, population=5 if size.quick else POPULATION,
        duration=_way(size) / gait.speed, **ROBUST | size.settings,
    )  # fmt: skip


def crossed(found: Mapping[str, TuningResult], size: Size) -> dict[tuple[str, str], float]:
    """Return the score on a robot's held-out scenes of gains tuned for another one."""
    return {
        (robot, other): _score(robot, result.best, size)
        for robot in found
        for other, result in found.items()
        if robot != other
    }


def _score(robot: str, values: Mapping[str, float], size: Size) -> float:
    """Return the objective of given gains on the held-out scenes of a robot; inf: a run failed."""
    gait = uneven(robot)
    duration = _way(size) / gait.speed
    runs = []
    for control in (hp.KinematicControl(gait), both(robot, values)):
        cases = [
            hp.Case(scene, control, duration=duration, **ROBUST)
            for scene in _scenes(robot, HELD_OUT, size).values()
        ]
        results = hp.simulate_batch(cases, threads=1, keep="summary")
        summaries = [result for result in results if isinstance(result, hp.Summary)]
        if len(summaries) < len(cases):
            return math.inf
        runs.append(summaries)
    return OBJECTIVE(runs[1], runs[0])


def tuning_tables(
    found: Mapping[str, TuningResult], cross: Mapping[tuple[str, str], float]
) -> list[Table]:
    """Return gains and scores: all scenes, and scene by scene."""
    rows, scenes = [], []
    for robot, result in found.items():
        held_out = result.held_out
        assert held_out is not None  # nobody interrupted it
        others = [f"{value:.3f}" for (own, _), value in cross.items() if own == robot]
        rows.append([
            robot,
            *(f"{START[name]:g} -> {result.best[name]:.3g}" for name in START),
            f"{result.tuned.start:.3f} -> {result.tuned.best:.3f}",
            f"{held_out.start:.3f} -> {held_out.best:.3f}",
            ", ".join(others) or "-",
        ])  # fmt: skip
        for kind, scores in (("tuned on", result.tuned), ("held out", held_out)):
            for scene, (_, start, best) in scores.by_scene.items():
                scenes.append([robot, kind, scene, f"{start:.3f}", f"{best:.3f}",
                               f"{100.0 * (best / start - 1.0):+.1f}"])  # fmt: skip
    head = [
        "robot", "travel [m]", "frequency [Hz]", "damping [-]", "slip bandwidth [Hz]",
        "tuned on: default -> best", "held out: default -> best",
        "held out, with the other robot's gains",
    ]  # fmt: skip
    return [
        Table("Tuned gains of both parts; score 1: conventional control", head, rows),
        Table("", ["robot", "", "ground", "default", "best", "change [%]"], scenes),
    ]
