"""What foot control is asked for: slip, impacts and energy, each against conventional control."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import Estimate
from hexapod_pin.text_table import Table
from studies.foot_control.scenes import Size, percent

SLIP_CUT, BUMP_CUT, ENERGY_RISE = 0.4, 0.3, 0.1
"""Least cut of slip path, of acceleration and peak force on bumps; largest rise of energy."""

ARC_PARTS = {
    "slip: force, 10 Hz": hp.foot_control.SlipPid(),
    "slip: slip, 2 Hz": hp.foot_control.SlipPid(signal="slip", bandwidth=2.0),
}
"""Corrections of S2's arcs, which force feet to slide."""


@dataclass(frozen=True)
class Target:
    """A number that was asked for.

    Attributes:
        robot: name of the robot.
        scene: the walk and its ground.
        controller: name of the controller.
        metric: of `WalkMetrics`.
        change: against conventional control; None: not known.
        limit: largest change that meets it.
    """

    robot: str
    scene: str
    controller: str
    metric: str
    change: Estimate | None
    limit: float

    @property
    def met(self) -> bool:
        """Whether it is met by the estimate itself."""
        return self.change is not None and self.change.value <= self.limit

    def row(self) -> list[str]:
        """Return the cells of its row."""
        verdict = "pass" if self.met else "FAIL"
        if self.change is not None and self.change.half_width is not None:
            clear = abs(self.change.value - self.limit) > self.change.half_width
            verdict += "" if clear else " (within the interval)"
        asked = f"at most {100.0 * self.limit:+.0f}"
        return [
            self.robot, self.scene, self.controller, self.metric, percent(self.change), asked,
            verdict,
        ]  # fmt: skip


def arc_comparison(size: Size) -> Comparison:
    """Return S2's arc motion on kharagpur, conventional and corrected, with two contacts."""
    arc = hp.motion.ArcWalk()
    walks: dict[str, Any] = {CONVENTIONAL: arc}
    walks |= {name: hp.FootControl(arc, slip=part) for name, part in ARC_PARTS.items()}
    robot = hp.load_robot("kharagpur")
    scenes = {
        "arcs, s2 contact": hp.Scene(robot, contact=hp.Contact.s2()),
        "arcs": hp.Scene(robot, contact=hp.Contact.accurate()),
    }
    cycles = 3.5 if size.quick else 4.5
    return hp.compare(scenes, walks, duration=cycles * arc.gait.cycle_time, **size.settings)


def targets(comparisons: dict[str, Comparison], arcs: Comparison) -> list[Target]:
    """Return every number that was asked for."""
    return [*_slip(comparisons, arcs), *_bumps(comparisons)]


def _slip(comparisons: dict[str, Comparison], arcs: Comparison) -> Iterator[Target]:
    for scene in arcs.scenes:
        for name in ARC_PARTS:
            yield from _both("kharagpur", arcs, scene, name, {"slip_distance": SLIP_CUT})
    for robot, comparison in comparisons.items():
        for scene in (scene for scene in comparison.scenes if scene.startswith("flat")):
            yield from _both(robot, comparison, scene, "slip", {"slip_distance": SLIP_CUT})


def _bumps(comparisons: dict[str, Comparison]) -> Iterator[Target]:
    asked = {"vertical_acceleration_rms": BUMP_CUT, "force_peak": BUMP_CUT}
    for robot, comparison in comparisons.items():
        for name in ("suspension", "suspension, touch-down", "both", "all"):
            yield from _both(robot, comparison, "bumps", name, asked)


def _both(
    robot: str, found: Comparison, scene: str, name: str, cuts: dict[str, float]
) -> Iterator[Target]:
    """Return the targets of a controller on a scene, and that of its energy."""
    limits = {**{metric: -cut for metric, cut in cuts.items()}, "energy_per_metre": ENERGY_RISE}
    for metric, limit in limits.items():
        yield Target(robot, scene, name, metric, found.change(scene, name, metric), limit)


def target_table(found: list[Target]) -> Table:
    """Return all targets."""
    head = ["robot", "walk", "controller", "metric", "change [%]", "asked for", "verdict"]
    return Table("Targets", head, [one.row() for one in found])
