"""Gains of foot control tuned on some terrains, and what they are worth on others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import hexapod_pin as hp
from hexapod_pin.benchmark.studies.foot_control_ranking import ROBUST
from hexapod_pin.benchmark.studies.foot_control_scenes import Size, ground, uneven
from hexapod_pin.sweep.tuning_result import TuningResult
from hexapod_pin.validation.tables import Table

START = {"travel": 0.002, "frequency": 6.5, "damping": 1.6, "bandwidth": 10.0}
"""The defaults, the frequency 2 % below what 5 ms ticks give: travel [m], frequency [Hz],
damping [-], bandwidth of the slip correction [Hz]."""

BOUNDS = {
    "travel": (5e-4, 5e-3), "frequency": (2.0, 12.0), "damping": (0.5, 3.0),
    "bandwidth": (2.0, 15.0),
}  # fmt: skip

WEIGHTS = {"slip": 1.0, "vertical_acceleration_rms": 1.0, "force_peak": 1.0, "energy": 1.0}
SEED = 11


def _energy(summary: hp.Summary) -> float:
    return float((summary.positive_energy - summary.negative_energy).sum())


def _slip(summary: hp.Summary) -> float:
    return float(summary.slip_path.sum())


OBJECTIVE = hp.RelativeObjective(WEIGHTS, {"energy": _energy, "slip": _slip})


def both(robot: str, values: Mapping[str, float]) -> hp.FootControl:
    """Return slip correction and suspension with the tuned gains."""
    suspension = {name: values[name] for name in ("travel", "frequency", "damping")}
    return hp.FootControl(
        uneven(robot),
        slip=hp.SlipPid(bandwidth=values["bandwidth"]),
        suspension=hp.VirtualSuspension(**suspension),
    )


def tuned(robot: str, size: Size) -> TuningResult:
    """Return gains tuned on bumps, step and flat ground; held out: other bumps, slope, soil."""
    way = size.way if size.quick else size.way - 0.2

    def scenes(*places: tuple[str, int]) -> dict[str, hp.Scene]:
        return {
            name + (f" {seed}" if name == "bumps" else ""): ground(robot, name, way=way, seed=seed)
            for name, seed in size.some(places)
        }

    gait = uneven(robot)
    settings: dict[str, Any] = {**ROBUST, "duration": way / gait.speed}
    if size.quick:
        settings["population"] = 5
    return hp.tune(
        lambda values: both(robot, values), START, BOUNDS,
        scenes(("bumps", 0), ("bumps", 1), ("flat", 0), ("step", 0)), OBJECTIVE,
        held_out=scenes(("bumps", 5), ("bumps", 6), ("bumps", 7), ("slope", 0), ("soil", 0)),
        baseline=hp.KinematicControl(gait), seed=SEED,
        budget=size.candidates, **{"population": 12, **settings},
    )  # fmt: skip


def crossed(found: Mapping[str, TuningResult], size: Size) -> dict[tuple[str, str], float]:
    """Return the score on a robot's held-out scenes of gains tuned for another one."""
    scores = {}
    for robot in found:
        for other, result in found.items():
            if robot == other:
                continue
            again = tuned_scores(robot, result.best, size)
            scores[robot, other] = again
    return scores


def tuned_scores(robot: str, values: Mapping[str, float], size: Size) -> float:
    """Return the objective of given gains on the held-out scenes of a robot; inf: a run failed."""
    gait = uneven(robot)
    way = size.way if size.quick else size.way - 0.2
    places = size.some((("bumps", 5), ("bumps", 6), ("bumps", 7), ("slope", 0), ("soil", 0)))
    runs = []
    for control in (hp.KinematicControl(gait), both(robot, values)):
        cases = [
            hp.Case(
                ground(robot, name, way=way, seed=seed), control, duration=way / gait.speed,
                **ROBUST,
            )
            for name, seed in places
        ]  # fmt: skip
        runs.append(hp.simulate_batch(cases, threads=1, keep="summary"))
    if any(isinstance(result, Exception) for results in runs for result in results):
        return float("inf")
    return float(OBJECTIVE(runs[1], runs[0]))


def tuning_tables(
    found: Mapping[str, TuningResult], cross: Mapping[tuple[str, str], float]
) -> list[Table]:
    """Return gains and scores: all scenes, and scene by scene."""
    rows, scenes = [], []
    for robot, result in found.items():
        others = [f"{value:.3f}" for (own, _), value in cross.items() if own == robot]
        rows.append([
            robot,
            *(f"{START[name]:g} -> {result.best[name]:.3g}" for name in START),
            f"{result.tuned.start:.3f} -> {result.tuned.best:.3f}",
            f"{result.held_out.start:.3f} -> {result.held_out.best:.3f}",
            ", ".join(others) or "-",
        ])  # fmt: skip
        for kind, scores in (("tuned on", result.tuned), ("held out", result.held_out)):
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
