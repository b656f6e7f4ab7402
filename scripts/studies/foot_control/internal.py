"""Internal forces: what feet push against each other, with servos from soft to stiff."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.control.foot_control.stability import parameter_value
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Table
from studies.foot_control.page import save_figure
from studies.foot_control.scenes import (
    GAITS,
    Size,
    controllers,
    stable,
)

STIFFER = (1.0, 4.0, 16.0)
"""Factors on both servo gains."""

NAMES = ("slip", "suspension", "both")
SAMPLE = 0.002
"""[s]"""

WALKED, STEADY = 4.5, (1.5, 3.5)
"""Cycles before the robot stops, and those of them that count."""

STOOD, WATCHED = 1.5, 0.5
"""Time to stand after that, and the end of it that counts [s]."""


def internal_forces(trace: Trace) -> Array:
    """Return what of the tangential forces drives the trunk nowhere, on level ground.

    The part of the sum and of the moment about the vertical through the centre of the loads that
    goes with a foot's load is taken away: of all sets of forces with that sum and moment it is the
    one with the least sum of f^2 / load.

    Returns:
        [N]. Shape (T, F, 3); 0 where a foot bears nothing.
    """
    load = np.maximum(trace.normal_force, 0.0)[..., None]
    total = np.maximum(load.sum(1, keepdims=True), 1e-12)
    force = np.where(load > 0.0, trace.tangential_force, 0.0)
    place = trace.foot_position * [1.0, 1.0, 0.0]
    arm = place - (load * place).sum(1, keepdims=True) / total
    across = np.stack([-arm[..., 1], arm[..., 0], np.zeros_like(arm[..., 0])], axis=-1)
    moment = (across * force).sum((1, 2))[:, None, None]
    spread = np.maximum((load * across**2).sum((1, 2)), 1e-12)[:, None, None]
    shared = load * (force.sum(1, keepdims=True) / total + moment / spread * across)
    found: Array = np.where(load > 0.0, force - shared, 0.0)
    return found


@dataclass(frozen=True)
class Squeeze:
    """Internal forces of a walk that ends in standing.

    Attributes:
        robot: name of the robot.
        factor: on the servo gains.
        controller: name of the controller.
        walking: RMS over whole cycles of steady walking and over the standing feet [N].
        standing: the same after the stop [N].
        frequency: of the suspension [Hz]; nan: none.
        failure: why there are no numbers.
    """

    robot: str
    factor: float
    controller: str
    walking: float = np.nan
    standing: float = np.nan
    frequency: float = np.nan
    failure: str = ""


def squeezes(robot_name: str, size: Size) -> list[Squeeze]:
    """Return internal forces with every stiffness and controller, on flat ground."""
    robot, gait = hp.load_robot(robot_name), GAITS[robot_name]
    stop = WALKED * gait.cycle_time
    walk = hp.KinematicControl(gait, stop_at=stop)
    plain = hp.Servo.from_effort(robot)
    found = []
    for factor in size.some(STIFFER):
        servo = hp.Servo(kp=factor * float(plain.kp), kd=factor * float(plain.kd))  # type: ignore[arg-type]
        scene = hp.Scene(robot, servo=servo)
        for name, control in controllers(walk, NAMES).items():
            found.append(_squeeze(scene, stable(control, scene), robot_name, factor, name))
    return found


def _squeeze(scene: hp.Scene, control: Any, robot: str, factor: float, name: str) -> Squeeze:
    cycle = GAITS[robot].cycle_time
    try:
        trace = hp.simulate(scene, control, duration=WALKED * cycle + STOOD, sample=SAMPLE)
    except HexapodError as error:
        return Squeeze(robot, factor, name, failure=str(error).partition("\n")[0])
    time, frequency = trace.time, np.nan
    if name != CONVENTIONAL and control.suspension is not None:
        frequency = parameter_value(control, scene, "suspension.frequency")
    walking = (time >= STEADY[0] * cycle) & (time <= STEADY[1] * cycle)
    standing = time >= time[-1] - WATCHED
    force = internal_forces(trace)

    def rms(when: NDArray[np.bool_]) -> float:
        down = trace.normal_force[when] > 0.0
        return float(np.sqrt((force[when] ** 2).sum() / max(1, down.sum())))

    return Squeeze(robot, factor, name, rms(walking), rms(standing), frequency)


def squeeze_table(found: list[Squeeze]) -> Table:
    """Return forces, and how far each part relieves them."""
    base = {(one.robot, one.factor): one for one in found if one.controller == CONVENTIONAL}

    def relief(one: Squeeze, name: str) -> str:
        value, plain = getattr(one, name), getattr(base[one.robot, one.factor], name)
        change = "" if one.controller == CONVENTIONAL else f" ({100 * (value / plain - 1):+.0f} %)"
        return f"{value:.3g}{change}"

    def frequency(one: Squeeze) -> str:
        return "-" if np.isnan(one.frequency) else f"{one.frequency:.2g}"

    rows = [
        [one.robot, f"{one.factor:g}", one.controller, relief(one, "walking"),
         relief(one, "standing"), frequency(one), one.failure or "-"]
        for one in found
    ]  # fmt: skip
    return Table(
        "Internal tangential forces per standing foot, RMS, on flat ground",
        [
            "robot", "servo gains x", "controller", "walking [N]",
            "standing after the walk [N]", "frequency of the suspension [Hz]", "failure",
        ],
        rows,
    )  # fmt: skip


def draw_squeezes(found: list[Squeeze], path: Path) -> None:
    """Draw internal forces over the stiffness of the servos."""
    from matplotlib.figure import Figure

    robots = list(dict.fromkeys(one.robot for one in found))
    figure = Figure(figsize=(3.4 * len(robots) + 0.6, 4.4), layout="constrained")
    panels = figure.subplots(2, len(robots), squeeze=False, sharex=True)
    for column, robot in enumerate(robots):
        for row, name in enumerate(("walking", "standing")):
            axes = panels[row][column]
            for control in dict.fromkeys(one.controller for one in found):
                own = [one for one in found if (one.robot, one.controller) == (robot, control)]
                axes.plot(
                    [one.factor for one in own], [getattr(one, name) for one in own], "-o",
                    ms=3, lw=1, label=control,
                )  # fmt: skip
            axes.set(xscale="log", ylim=(0.0, None))
            axes.set_title(f"{robot}, {name}", fontsize="small")
            axes.tick_params(labelsize="x-small")
            axes.grid(lw=0.3)
        factors = sorted({one.factor for one in found})
        panels[1][column].minorticks_off()
        panels[1][column].set_xticks(factors, [f"{factor:g}" for factor in factors])
        panels[1][column].set_xlabel("servo gains, times the default", fontsize="small")
    for row in (0, 1):
        panels[row][0].set_ylabel("internal force, RMS [N]", fontsize="small")
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize="small")
    save_figure(figure, path)
