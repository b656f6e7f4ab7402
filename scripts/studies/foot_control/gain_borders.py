"""Gains of foot control up to which a robot stands still: predicted, and found by simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.foot_control.parameters import ForceTargets, SlipPid, VirtualSuspension
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
TARGETS, BOTH_WAYS = ", force targets", ", force targets, both ways"
"""Beside what a parameter stands: `ForceTargets`, with the default deviation or with "target"."""

QUANTITIES = (
    "suspension.stiffness", "suspension.frequency", "slip.ki",
    f"suspension.frequency{TARGETS}", f"slip.ki{TARGETS}", f"slip.ki{BOTH_WAYS}",
)  # fmt: skip
"""Parameters of `stable_range`, and what stands beside their part."""

FIGURE = RESULTS / "gain_borders.svg"
MARGIN = 0.1
"""Within which of the predicted border that of the simulation is searched, as a share."""

ASKED = 0.02
"""Largest difference between them, as a share."""

DRIFT_TIME = 10.0
"""What neither grows by e nor turns by 1 rad in this time is a drift, not shaking [s]."""

COLUMNS = 3
"""Of the figure's panels."""

CALM_FREQUENCY, CALM_SHARE = 0.5, 0.05
"""With which a robot settles: frequency of the suspension [Hz], share of a gain's border."""


REASONS = """\
What misses, and why (further runs). Both ways on S1's contact: feet creep up to their targets,
there is no rest. athena, S1's contact, 5 ms, slip.ki: beyond the border the motion grows to a limit
cycle in which no foot's force changes by 20 % of its load, and the growth is taken of that; at 1.2
and 1.3 times the border it grows by 5 and 16 1/s. Stiffness at 0 ms: kharagpur on S1's contact
grows by 11.6 1/s at 0.97 of the border (11.8 predicted) and decays from 1.01 on, but the growth is
taken of what is left of the settling, 1e-6 rad/s, where its sign is chance; athena's was not looked
into."""


@dataclass(frozen=True)
class Border:
    """A border of stability.

    Attributes:
        robot: name of the robot.
        contact: name of the contact.
        delay: of the command [s].
        quantity: of `QUANTITIES`.
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
        return abs(self.simulated / self.predicted - 1.0) <= ASKED

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
    parameter, _, beside = quantity.partition(",")
    own: dict[str, Any] = (
        {"slip": SlipPid()} if parameter.startswith("slip") else {"suspension": VirtualSuspension()}
    )
    if beside:
        both = quantity.endswith(BOTH_WAYS)
        own["force_targets"] = ForceTargets(deviation="target" if both else "segment")
    return UnrefusedFootControl(STAND, delay=delay, **own)


def parameter_of(quantity: str) -> str:
    """Return the name of a parameter without what stands beside it."""
    return quantity.partition(",")[0]


def predicted_border(control: FootControl, scene: hp.Scene, quantity: str) -> float:
    """Return the border of a parameter of feet put down gently; the upper one where there is."""
    name = parameter_of(quantity)
    low, high = stable_range(control, scene, name, touch_speed=0.0, drift_time=DRIFT_TIME)
    return high if math.isfinite(high) else low or math.nan


def find_border(robot: str, contact: str, delay: float, quantity: str) -> Border:
    """Return a border as predicted and as simulated."""
    scene = hp.Scene(hp.load_robot(robot), contact=hp.Contact.preset(contact))
    control, name = controller(quantity, delay), parameter_of(quantity)
    predicted = predicted_border(control, scene, quantity)
    at = {share: with_parameter(control, name, share * predicted) for share in (0.9, 1.1)}
    stands: dict[float, Stand] = {}
    simulated: dict[float, float] = {}

    def growth(value: float) -> float:
        if value not in simulated:
            changed = with_parameter(control, name, value)
            key = value if name == "suspension.stiffness" else 0.0  # its rest depends on it
            if key not in stands:
                stands[key] = Stand.settled(scene, _calm(changed, name, predicted))
            simulated[value] = stands[key].growth(changed)
        return simulated[value]

    rates = tuple(
        (
            math.log(spectral_radius(changed, scene, touch_speed=0.0)) / control.period,
            growth(share * predicted),
        )
        for share, changed in at.items()
    )
    found = border(lambda value: growth(value) > 1.0 / DRIFT_TIME, 0.9 * predicted, 1.1 * predicted)
    own = parameter_value(control, scene, name)
    return Border(robot, contact, delay, quantity, predicted, found, (rates[0], rates[1]), own)


def _calm(control: FootControl, name: str, predicted: float) -> FootControl:
    """Return the same controller with gains so low that it settles."""
    if name.startswith("slip"):
        return with_parameter(control, name, CALM_SHARE * predicted)
    return with_parameter(control, "suspension.frequency", CALM_FREQUENCY)


def gain_borders(
    *,
    robots: str = ",".join(ROBOTS),
    contacts: str = "accurate,s1",
    quantities: str = ";".join(QUANTITIES),
    delays: str = "0,5,10,20",
    figure: Path = FIGURE,
    points: int = 6,
) -> StudyReport:
    """Borders of gains, predicted and simulated.

    Delays [ms]; quantities, with semicolons between them; file of the figure, and its points.
    """
    times = [1e-3 * float(delay) for delay in delays.split(",")]
    found = [
        find_border(robot, contact, delay, quantity)
        for contact in contacts.split(",")
        for robot in robots.split(",")
        for quantity in quantities.split(";")
        for delay in times
    ]
    draw(found, figure, points)
    head = [
        "robot", "contact", "delay [ms]", "parameter", "default", "border", "simulated", "off [%]",
        "growth at 0.9 [1/s]", "at 1.1", "verdict",
    ]  # fmt: skip
    worst = np.nanmax([abs(one.simulated / one.predicted - 1.0) for one in found])
    names = dict.fromkeys(map(parameter_of, QUANTITIES))
    units = ", ".join(f"{name} [{PARAMETERS[name]}]" for name in names)
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
            "Force targets do not know the sole, which would put feet down anew; both ways: the "
            'slip correction takes deviations from the targets themselves (`deviation="target"`). '
            "What neither grows by e nor turns by 1 rad in "
            f"{DRIFT_TIME:g} s is a drift, not shaking. "
            f"Largest difference {100.0 * worst:.1f} %, at most {100.0 * ASKED:g} % asked for.",
            Table("", head, [one.row() for one in found]),
            REASONS,
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

    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    quantities, robots, contacts = (
        list(dict.fromkeys(getattr(one, name) for one in found))
        for name in ("quantity", "robot", "contact")
    )
    rows = math.ceil(len(quantities) / COLUMNS)
    panels = figure.subplots(rows, min(COLUMNS, len(quantities)), squeeze=False).ravel()
    delays = np.linspace(0.0, 0.025, points)
    for panel, quantity in zip(panels, quantities, strict=False):
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
        name, _, beside = quantity.partition(",")
        side = "above" if name == "suspension.stiffness" else "below"
        panel.set(xlabel="delay [ms]", ylabel=f"{name} [{PARAMETERS[name]}]", yscale="log")
        panel.set_title(f"stable {side}{beside and ';' + beside}", fontsize="medium")
        panel.grid(alpha=0.3, which="both")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize="small")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_svg(figure, path)
