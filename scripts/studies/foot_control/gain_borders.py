"""Gains of foot control up to which a robot stands still: predicted, and found by simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.foot_control.parameters import SlipPid, VirtualSuspension
from hexapod_pin.control.foot_control.stability import (
    PARAMETERS,
    parameter_value,
    spectral_radius,
    stable_range,
    with_parameter,
)
from hexapod_pin.text_table import Table
from hexapod_pin.view.figure_file import write_svg
from studies.foot_control.standing_growth import (
    STAND,
    Stand,
    UnrefusedFootControl,
    border,
)
from studies.study import RESULTS, StudyReport

ROBOTS = ("kharagpur", "athena")
QUANTITIES = ("suspension.stiffness", "suspension.frequency", "slip.ki")
FIGURE = RESULTS / "gain_borders.svg"
MARGIN = 0.1
"""Largest difference between the predicted border and that of the simulation, as a share."""

CALM_FREQUENCY, CALM_SHARE = 0.5, 0.05
"""With which a robot settles: frequency of the suspension [Hz], share of a gain's border."""


@dataclass(frozen=True)
class Border:
    """A border of stability.

    Attributes:
        robot: name of the robot.
        contact: name of the contact.
        delay: of the command [s].
        quantity: the parameter.
        predicted: its value at the border; nan: none.
        simulated: the same by simulation; nan: not within `MARGIN` of it.
        rates: growth [1/s] predicted and simulated at 0.9 and at 1.1 times the border.
        own: value of the parameter without the user's word.
    """

    robot: str
    contact: str
    delay: float
    quantity: str
    predicted: float
    simulated: float
    rates: tuple[tuple[float, float], tuple[float, float]]
    own: float

    @property
    def met(self) -> bool:
        """Whether the simulation grows on one side, decays on the other, and agrees."""
        return abs(self.simulated / self.predicted - 1.0) <= MARGIN

    def row(self) -> list[str]:
        """Return the cells of its row."""
        off = 100.0 * (self.simulated / self.predicted - 1.0)
        verdict = "pass" if self.met else "FAIL"
        return [
            self.robot, self.contact, f"{1e3 * self.delay:g}", self.quantity,
            f"{self.own:.3g}", f"{self.predicted:.4g}", f"{self.simulated:.4g}", f"{off:+.1f}",
            *(f"{pair[0]:+.1f} / {pair[1]:+.1f}" for pair in self.rates), verdict,
        ]  # fmt: skip


def controller(quantity: str, delay: float) -> UnrefusedFootControl:
    """Return the controller that has a parameter, with everything else as by default."""
    if quantity.startswith("slip"):
        return UnrefusedFootControl(STAND, slip=SlipPid(), delay=delay)
    return UnrefusedFootControl(STAND, suspension=VirtualSuspension(), delay=delay)


def predicted_border(control: FootControl, scene: hp.Scene, quantity: str) -> float:
    """Return the border of a parameter of feet put down gently; the upper one where there is."""
    low, high = stable_range(control, scene, quantity, touch_speed=0.0)
    return high if math.isfinite(high) else low or math.nan


def find_border(robot: str, contact: str, delay: float, quantity: str) -> Border:
    """Return a border as predicted and as simulated."""
    scene = hp.Scene(hp.load_robot(robot), contact=hp.Contact.preset(contact))
    control = controller(quantity, delay)
    predicted = predicted_border(control, scene, quantity)
    at = {share: with_parameter(control, quantity, share * predicted) for share in (0.9, 1.1)}
    stands: dict[float, Stand] = {}
    simulated: dict[float, float] = {}

    def growth(value: float) -> float:
        if value not in simulated:
            changed = with_parameter(control, quantity, value)
            key = value if quantity == "suspension.stiffness" else 0.0  # its rest depends on it
            if key not in stands:
                stands[key] = Stand.settled(scene, _calm(changed, quantity, predicted))
            simulated[value] = stands[key].growth(changed)
        return simulated[value]

    rates = tuple(
        (
            math.log(spectral_radius(changed, scene, touch_speed=0.0)) / control.period,
            growth(share * predicted),
        )
        for share, changed in at.items()
    )
    found = border(lambda value: growth(value) > 0.0, 0.9 * predicted, 1.1 * predicted)
    own = parameter_value(control, scene, quantity)
    return Border(robot, contact, delay, quantity, predicted, found, (rates[0], rates[1]), own)


def _calm(control: FootControl, quantity: str, predicted: float) -> FootControl:
    """Return the same controller with gains so low that it settles."""
    if quantity.startswith("slip"):
        return with_parameter(control, quantity, CALM_SHARE * predicted)
    return with_parameter(control, "suspension.frequency", CALM_FREQUENCY)


def gain_borders(
    *,
    robots: str = ",".join(ROBOTS),
    contacts: str = "accurate,s1",
    quantities: str = ",".join(QUANTITIES),
    delays: str = "0,5,10,20",
    figure: Path = FIGURE,
    points: int = 6,
) -> StudyReport:
    """Borders of gains, predicted and simulated; delays [ms], file of the figure, its points."""
    times = [1e-3 * float(delay) for delay in delays.split(",")]
    found = [
        find_border(robot, contact, delay, quantity)
        for contact in contacts.split(",")
        for robot in robots.split(",")
        for quantity in quantities.split(",")
        for delay in times
    ]
    draw(found, figure, points)
    head = [
        "robot", "contact", "delay [ms]", "parameter", "default", "border", "simulated", "off [%]",
        "growth at 0.9 [1/s]", "at 1.1", "verdict",
    ]  # fmt: skip
    worst = max(abs(one.simulated / one.predicted - 1.0) for one in found)
    units = ", ".join(f"{name} [{PARAMETERS[name]}]" for name in QUANTITIES)
    return StudyReport(
        "Gains up to which a robot stands still",
        [
            "Ticks of 5 ms, six feet down at the standing posture, servos as by default. Border: "
            "where the spectral radius of the linear loop is 1; simulated: where what small random "
            "pushes of the trunk and all feet leave begins to grow (bisected to 0.3 %). Growth: "
            f"predicted / simulated. {units}. A border of the stiffness is a lower one: softer "
            "legs shake. "
            "-inf: at rest before it could be watched. What decays without swinging (contacts of "
            "feet put down gently settle in about 1 s) can hide a faster decay of the oscillation. "
            f"Largest difference {100.0 * worst:.1f} %, at most {100.0 * MARGIN:g} % asked for.",
            Table("", head, [one.row() for one in found]),
            Table(
                "Default gains: growth [1/s] of feet put down at 0 and 0.1 m/s; below 0: stable",
                ["robot", "delay [ms]", "suspension", "slip (force)", "slip (slip)", "both"],
                _defaults(robots.split(","), times),
            ),
        ],
        met=all(one.met for one in found),
    )


def _defaults(robots: Sequence[str], delays: Sequence[float]) -> list[list[str]]:
    """Return growth rates with the default gains."""
    slip, suspension = SlipPid(), VirtualSuspension()
    parts = (
        {"suspension": suspension}, {"slip": slip}, {"slip": SlipPid(signal="slip")},
        {"slip": slip, "suspension": suspension},
    )  # fmt: skip
    rows = []
    for robot in robots:
        scene = hp.Scene(hp.load_robot(robot))
        for delay in delays:
            row = [robot, f"{1e3 * delay:g}"]
            for given in parts:
                control = FootControl(STAND, delay=delay, **given)
                radii = [spectral_radius(control, scene, touch_speed=v) for v in (0.0, 0.1)]
                row.append(", ".join(f"{math.log(r) / control.period:+.2f}" for r in radii))
            rows.append(row)
    return rows


def draw(found: Sequence[Border], path: Path, points: int) -> None:
    """Draw predicted borders over delays of whole ticks, and the simulated ones on them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.0), layout="constrained")
    quantities, robots, contacts = (
        list(dict.fromkeys(getattr(one, name) for one in found))
        for name in ("quantity", "robot", "contact")
    )
    panels = figure.subplots(1, len(quantities), squeeze=False)[0]
    delays = np.linspace(0.0, 0.025, points)
    for panel, quantity in zip(panels, quantities, strict=True):
        for colour, robot in enumerate(robots):
            for contact, line, marker in zip(contacts, ("-", "--", ":"), "os^", strict=False):
                scene = hp.Scene(hp.load_robot(robot), contact=hp.Contact.preset(contact))
                values = [
                    predicted_border(controller(quantity, delay), scene, quantity)
                    for delay in delays
                ]
                style = {"color": f"C{colour}", "linewidth": 1.2}
                panel.plot(1e3 * delays, values, line, label=f"{robot}, {contact}", **style)
                own = [
                    x
                    for x in found
                    if (x.robot, x.contact, x.quantity) == (robot, contact, quantity)
                ]
                panel.plot(
                    [1e3 * one.delay for one in own], [one.simulated for one in own], marker,
                    color=f"C{colour}", fillstyle="none",
                )  # fmt: skip
        side = "above" if quantity == "suspension.stiffness" else "below"
        panel.set(xlabel="delay [ms]", ylabel=f"{quantity} [{PARAMETERS[quantity]}]", yscale="log")
        panel.set_title(f"stable {side}", fontsize="medium")
        panel.grid(alpha=0.3, which="both")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize="small")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_svg(figure, path)
