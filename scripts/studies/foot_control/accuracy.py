"""Errors of runs with foot control against the same loop at 1e-8."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.text_table import Table
from studies.foot_control.scenes import Size, controllers, ground, uneven

REFERENCE: dict[str, Any] = {"method": "ndf", "accuracy": 1e-8}
ASKED = (1e-4, 1e-6)
"""Accuracies asked for; the first is the default [m and rad]."""

DURATIONS = (0.6, 2.0)
"""[s]"""

NAMES = ("conventional", "both", "all")
SAMPLE = 0.005
"""[s]"""

NEAR = 0.25
"""Distance to the level ground's end from which runs on bumps start [m]."""


@dataclass(frozen=True)
class ErrorRow:
    """The error of a run.

    Attributes:
        robot: name of the robot.
        scene: name of the ground.
        controller: name of the controller.
        asked: accuracy asked for [m and rad].
        errors: largest in q up to each of DURATIONS [m and rad].
    """

    robot: str
    scene: str
    controller: str
    asked: float
    errors: tuple[float, ...]

    def row(self) -> list[str]:
        """Return the cells of its row."""
        verdicts = ["pass" if error <= self.asked else "FAIL" for error in self.errors]
        cells = [
            cell
            for error, verdict in zip(self.errors, verdicts, strict=True)
            for cell in (f"{error:.2e}", verdict)
        ]
        return [self.robot, self.scene, self.controller, f"{self.asked:g}", *cells]


def errors(robot: str, size: Size) -> list[ErrorRow]:
    """Return the errors of all controllers on flat ground and on bumps from the start."""
    durations = DURATIONS[:1] if size.quick else DURATIONS
    gait = uneven(robot)
    level = ground(robot, "flat", way=1.0)
    terrain = hp.HeightField.random(
        0, amplitude=0.5 * gait.lift, wavelength=0.3, size=4.0, flat_radius=NEAR
    )
    scenes = {"flat": level, "bumps": hp.Scene(level.robot, terrain=terrain, contact=level.contact)}
    found = []
    for scene_name, scene in scenes.items():
        for name, control in controllers(gait, NAMES[1:]).items():
            settings: dict[str, Any] = {"duration": durations[-1], "sample": SAMPLE}
            exact = hp.simulate(scene, control, **settings, **REFERENCE)
            for asked in ASKED:
                run = hp.simulate(scene, control, accuracy=asked, **settings)
                off = np.abs(run.q - exact.q).max(axis=1)
                worst = tuple(float(off[run.time <= end + 1e-9].max()) for end in durations)
                found.append(ErrorRow(robot, scene_name, name, asked, worst))
    return found


def error_table(found: list[ErrorRow]) -> Table:
    """Return all errors with verdicts."""
    heads = [
        cell for end in DURATIONS[: len(found[0].errors)] for cell in (f"error to {end:g} s", "")
    ]
    return Table(
        f"Largest error in q [m or rad] against {REFERENCE['method']} at "
        f"{REFERENCE['accuracy']:g}, the same loop",
        ["robot", "ground", "controller", "asked for", *heads],
        [one.row() for one in found],
    )
