"""S1's comparison: slip correction, virtual suspension and both beside conventional control."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hexapod_pin.control.foot_control.controller import CONVENTIONAL
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.study.tuning_result import TuningResult
from hexapod_pin.text_table import Table
from studies.foot_control.accuracy import ErrorRow, error_table, errors
from studies.foot_control.bounds import (
    Point,
    bounds_table,
    draw_bounds,
    points,
)
from studies.foot_control.comparison import (
    DRAWN,
    claims,
    comparison_table,
    draw_comparison,
)
from studies.foot_control.distance import (
    LongWalk,
    distance_table,
    long_walks,
)
from studies.foot_control.impacts import impact_table
from studies.foot_control.internal import (
    Squeeze,
    draw_squeezes,
    squeeze_table,
    squeezes,
)
from studies.foot_control.page import (
    BOUNDS_FIGURE,
    INTERNAL_FIGURE,
    comparison_figure,
    write_page,
)
from studies.foot_control.ranking import ranking_table, rankings
from studies.foot_control.scenes import (
    Size,
    ground_comparison,
    numbers,
)
from studies.foot_control.targets import (
    Target,
    arc_comparison,
    target_table,
    targets,
)
from studies.foot_control.tuning import crossed, tuned, tuning_tables
from studies.study import RESULTS, StudyReport


@dataclass(frozen=True)
class Found:
    """All that the study measures, by robot where it is a mapping."""

    comparisons: dict[str, Comparison]
    arcs: Comparison
    squeezed: list[Squeeze]
    impacts: Table
    varied: list[Point]
    ranked: dict[str, dict[str, Comparison]]
    walks: list[LongWalk]
    errors: list[ErrorRow]
    tuned: dict[str, TuningResult]
    crossed: Mapping[tuple[str, str], float]

    @classmethod
    def of(cls, size: Size) -> Found:
        """Run everything."""
        gains = {robot: tuned(robot, size) for robot in size.robots}
        return cls(
            comparisons={robot: ground_comparison(robot, size) for robot in size.robots},
            arcs=arc_comparison(size),
            squeezed=[one for robot in size.robots for one in squeezes(robot, size)],
            impacts=impact_table(size),
            varied=[one for robot in size.robots for one in points(robot, size)],
            ranked={robot: rankings(robot, size) for robot in size.robots},
            walks=[one for robot in size.robots for one in long_walks(robot, size)],
            errors=[one for robot in size.robots for one in errors(robot, size)],
            tuned=gains,
            crossed=crossed(gains, size),
        )

    @property
    def targets(self) -> list[Target]:
        """What was asked for, with what was found."""
        return targets(self.comparisons, self.arcs)

    @property
    def met(self) -> bool:
        """Whether every target was met."""
        walks = [one.met for one in self.walks if one.controller != CONVENTIONAL]
        kept = [error <= one.asked for one in self.errors for error in one.errors]
        return all([*(one.met for one in self.targets), *walks, *kept])

    @property
    def data(self) -> dict[str, Any]:
        """Numbers for a file."""
        return {
            "numbers": ["mean [SI]", "change [-]", "half of its 95 % interval [-]"],
            "comparisons": {name: numbers(one, DRAWN) for name, one in self.comparisons.items()},
            "arcs": numbers(self.arcs, DRAWN),
            "targets": [one.row() for one in self.targets],
            "tuned": {
                robot: {"best": dict(one.best), **one.data} for robot, one in self.tuned.items()
            },
        }


def foot_control(*, quick: bool = False, docs: Path = RESULTS) -> StudyReport:
    """S1's comparison on all grounds, targets, bounds, ranking with noise, 10 m, accuracy."""
    found = Found.of(Size.of(quick))
    docs.mkdir(parents=True, exist_ok=True)
    for robot, comparison in found.comparisons.items():
        draw_comparison(robot, comparison, docs / comparison_figure(robot))
    draw_squeezes(found.squeezed, docs / INTERNAL_FIGURE)
    draw_bounds(found.varied, docs / BOUNDS_FIGURE)
    claimed, asked = claims(found.comparisons), target_table(found.targets)
    walked, squeezed = distance_table(found.walks), squeeze_table(found.squeezed)
    write_page(docs, tuple(found.comparisons), claimed, asked, found.impacts, walked)
    return StudyReport(
        "Foot control beside conventional kinematic control",
        [
            INTRODUCTION,
            claimed,
            asked,
            *(comparison_table(robot, one) for robot, one in found.comparisons.items()),
            comparison_table("kharagpur on S2's arcs", found.arcs),
            squeezed,
            found.impacts,
            bounds_table(found.varied),
            ranking_table(found.ranked),
            CONDITIONS,
            walked,
            error_table(found.errors),
            *tuning_tables(found.tuned, found.crossed),
        ],
        data=found.data,
        met=found.met,
    )


INTRODUCTION = (
    "Tripods of athena (stroke 0.08 m in 1.6 s) and kharagpur (0.10 m in 1.2 s); on flat ground "
    "lift 20 mm, elsewhere 40 mm; grounds of `study_grounds`. Gains as by default, the same on "
    "all grounds. Numbers of `WalkMetrics`, over whole cycles; ± are 95 % intervals over grounds. "
    "What each part is: [docs](s1_comparison.md). S1 prints no numbers to hold these "
    "against."
)

CONDITIONS = (
    "But for the first row of a robot, rankings were run with `robust` at 2.5 ms. Noise: encoders "
    "of 4096 steps; all else *assumed*: rates 0.01 rad/s, torques 0.02 N m, attitude 0.002 rad and "
    "0.005 rad of offset, forces 0.2 N and 0.1 N of offset. Delay: 5 ms of the sensors, 5 ms of "
    "the commands. Drive: XM540-W270 (athena) and MX-64 (kharagpur) at 12 V by the maker's data; "
    "dry friction 0.2 and 0.1 N m and rotor inertia 2e-7 kg m^2 are *assumed*. Estimated forces "
    "are filtered at 20 Hz; currents do not know of friction. Each seed of noise is a controller "
    'of its own. "failed": a run whose trunk touched the ground, or that was refused.'
)
