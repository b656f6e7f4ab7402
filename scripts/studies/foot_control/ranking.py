"""The ranking again: with noise, delay, the drive's limits and friction, and estimated forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.text_table import Table
from studies.foot_control.scenes import (
    Size,
    bumps,
    controllers,
    ground,
    stable,
    uneven,
)

NAMES = ("slip", "suspension", "both", "all")

SCORED = ("slip_distance", "vertical_acceleration_rms", "force_peak", "energy_per_metre")
"""The score is the mean of these over conventional control's; less is better."""

SEEDS = (1, 2)
"""Of the sensors' noise: a controller of its own each."""

NOISE: dict[str, Any] = {
    "q": hp.sensors.Sensor(quantisation=2.0 * np.pi / 4096),
    "v": hp.sensors.Sensor(noise=0.01),
    "torque": hp.sensors.Sensor(noise=0.02, quantisation=0.01),
    "rotation": hp.sensors.Sensor(noise=0.002, bias=0.005),
    "angular_velocity": hp.sensors.Sensor(noise=0.005, bias=0.002),
    "acceleration": hp.sensors.Sensor(noise=0.05, bias=0.05),
    "foot_force": hp.sensors.Sensor(noise=0.2, bias=0.1, quantisation=0.05),
}
"""Encoders of 4096 steps a turn (ROBOTIS e-Manual, X series), all else *assumed*."""

DELAY = 0.005
"""Of the sensors, and again of the commands [s]."""

MOTORS = {
    "athena": hp.Motor(
        stall_torque=10.6, no_load_speed=3.1416, gear_ratio=272.5, rotor_inertia=2e-7,
        dry_friction=0.2,
    ),
    "kharagpur": hp.Motor(
        stall_torque=6.0, no_load_speed=6.597, gear_ratio=200.0, rotor_inertia=2e-7,
        dry_friction=0.1,
    ),
}  # fmt: skip
"""XM540-W270 and MX-64 at 12 V, stall torque, no-load speed and ratio by ROBOTIS' e-Manual: those
with the efforts of the robots' files. Rotor inertia and dry friction are *assumed*."""

ROBUST: dict[str, Any] = {"method": "robust", "step": 2.5e-3}
"""How rankings are run, but for the first."""

CUTOFF = 20.0
"""Of estimated forces [Hz]."""


@dataclass(frozen=True)
class Condition:
    """What is not ideal.

    Attributes:
        settings: of foot control, one set per seed of noise.
        drive: whether servos have a motor.
        method: of the runs.
    """

    settings: tuple[Mapping[str, Any], ...] = ({},)
    drive: bool = False
    method: Mapping[str, Any] = field(default_factory=lambda: ROBUST)


def conditions() -> dict[str, Condition]:
    """Return all conditions by name, the ideal one first."""
    noise = tuple({"sensors": hp.sensors.Sensors(seed=seed, **NOISE)} for seed in SEEDS)
    late = {"sensors": hp.sensors.Sensors(delay=DELAY), "delay": DELAY}
    torque = hp.foot_control.FootForceSensing(source="torque", cutoff=CUTOFF)
    current = hp.foot_control.FootForceSensing(source="current", cutoff=CUTOFF)
    worst = tuple(
        {
            "sensors": hp.sensors.Sensors(seed=seed, delay=DELAY, **NOISE),
            "delay": DELAY,
            "force": torque,
        }
        for seed in SEEDS
    )
    return {
        "ideal, default method": Condition(method={}),
        "ideal": Condition(),
        "noise": Condition(noise),
        "10 ms delay": Condition((late,)),
        "drive": Condition(drive=True),
        "forces from torques": Condition(({"force": torque},)),
        "forces from currents, drive": Condition(({"force": current},), drive=True),
        "all of these, torques": Condition(worst, drive=True),
    }


def rankings(robot: str, size: Size) -> dict[str, Comparison]:
    """Return all controllers on bumps and on flat ground, in every condition."""
    return {
        name: _under(robot, condition, size) for name, condition in size.some(conditions().items())
    }


def _under(robot: str, condition: Condition, size: Size) -> Comparison:
    gait = uneven(robot)
    way = size.way
    grounds = [ground(robot, "flat", way=way), *bumps(robot, min(2, size.seeds), way)]
    if condition.drive:
        grounds = [_driven(scene, robot) for scene in grounds]
    scenes = {"flat": grounds[:1], "bumps": grounds[1:]}
    walks: dict[str, Any] = {}
    for k, given in enumerate(condition.settings):
        for name, control in controllers(gait, NAMES, **given).items():
            if name == CONVENTIONAL:
                walks[name] = control
            else:
                walks[f"{name} #{k}"] = stable(control, grounds[0])
    return hp.compare(scenes, walks, duration=way / gait.speed, **condition.method)


def _driven(scene: hp.Scene, robot: str) -> hp.Scene:
    servo = scene.servos.model_copy(update={"motor": MOTORS[robot]})
    return hp.Scene(scene.robot, terrain=scene.terrain, contact=scene.contact, servo=servo)


def score(found: Comparison, scene: str, name: str) -> float:
    """Return the mean of scored metrics over conventional control's, over all seeds of noise.

    inf where a run did not walk.
    """
    if name == CONVENTIONAL:
        return 1.0
    ratios = []
    for own in found.controllers:
        if own.partition(" #")[0] != name:
            continue
        if any(run.metrics is None for run in found.of(scene, own)):
            return np.inf
        changes = [found.change(scene, own, metric) for metric in SCORED]
        ratios += [np.inf if change is None else 1.0 + change.value for change in changes]
    return float(np.mean(ratios))


def ranking_table(found: dict[str, dict[str, Comparison]]) -> Table:
    """Return scores and ranks in every condition, and whether the order is that of the ideal."""
    rows = []
    for robot, by_condition in found.items():
        for scene in ("flat", "bumps"):
            first: list[str] | None = None
            for condition, comparison in by_condition.items():
                scores = {name: score(comparison, scene, name) for name in (CONVENTIONAL, *NAMES)}
                order = sorted(scores, key=lambda name: scores[name])
                first = first or order
                moved = [name for name in order if order.index(name) != first.index(name)]
                cells = [
                    f"{value:.2f} ({order.index(name) + 1})" if np.isfinite(value) else "failed"
                    for name, value in scores.items()
                ]
                rows.append([robot, scene, condition, *cells, ", ".join(moved) or "as ideal"])
    return Table(
        f"Score (rank): mean of {', '.join(SCORED)} over conventional control's in the same "
        "condition",
        ["robot", "ground", "condition", CONVENTIONAL, *NAMES, "moved in rank"],
        rows,
    )
