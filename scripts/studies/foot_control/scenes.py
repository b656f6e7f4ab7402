"""Robots, controllers and grounds of the study of foot control."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import hexapod_pin as hp
from hexapod_pin.control.foot_control.controller import CONVENTIONAL, S1_PARTS
from hexapod_pin.control.foot_control.stability import parameter_value, stable_range, with_parameter
from hexapod_pin.ground.terrain import study_grounds
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.walk_metrics import Estimate
from hexapod_pin.study.compare import PlannedRun, compared, plan_runs
from hexapod_pin.study.runs.runner import run_study

GAITS = {
    "athena": hp.Gait.tripod(stroke=0.08, cycle_time=1.6),
    "kharagpur": hp.Gait.tripod(stroke=0.10, cycle_time=1.2),
}
"""On level ground; elsewhere feet are lifted by LIFT."""

LIFT = 0.04
"""[m]"""

STABLE_SHARE = 0.6
"""Frequency of the suspension over its border, where the default would make the robot shake."""

PARTS: dict[str, dict[str, Any]] = {
    **{name: {part: kind() for part, kind in parts.items()} for name, parts in S1_PARTS.items()},
    "slip, not anticipating": {"slip": hp.foot_control.SlipPid(anticipates=False)},
    "suspension, touch-down": {
        "suspension": hp.foot_control.VirtualSuspension(),
        "touch_down": hp.foot_control.TouchDown(),
    },
}
"""What foot control consists of, by name; everything else as by default."""

ORDER = (
    "slip", "slip, not anticipating", "suspension", "both", "suspension, touch-down", "all",
)  # fmt: skip
"""Names of PARTS as tables have them."""


@dataclass(frozen=True)
class Size:
    """How much the study does.

    Attributes:
        robots: names of the robots.
        seeds: grounds of bumps.
        way: length of the plan in comparisons [m].
        far: what is asked for in long walks [m].
        candidates: budget of tuning, per robot.
        quick: whether values of parameters and conditions are thinned out.
    """

    robots: tuple[str, ...] = tuple(GAITS)
    seeds: int = 5
    way: float = 1.2
    far: float = 10.0
    candidates: int = 24
    quick: bool = False

    @classmethod
    def of(cls, quick: bool) -> Size:
        """Return the size of the study, or the smallest that runs all of it."""
        if not quick:
            return cls()
        return cls(("kharagpur",), seeds=2, way=0.62, far=0.15, candidates=10, quick=True)

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of `Case`: the error of every run kept, or in a quick study fixed steps."""
        return {"method": "robust", "step": 5e-3} if self.quick else {}

    def some(self, values: Iterable[Any]) -> list[Any]:
        """Return all values, or the one in the middle in a quick study."""
        found = list(values)
        return found[len(found) // 2 :][:1] if self.quick else found


def uneven(robot: str) -> hp.Gait:
    """Return the gait of a robot on uneven ground."""
    return GAITS[robot].with_changes(lift=LIFT)


def controllers(walk: Any, names: Iterable[str] = ORDER, **settings: Any) -> dict[str, Any]:
    """Return conventional control and foot control by name; `settings` are those of all parts."""
    open_loop = hp.KinematicControl(walk) if isinstance(walk, hp.Gait) else walk
    found = {name: hp.FootControl(open_loop, **PARTS[name], **settings) for name in names}
    return {CONVENTIONAL: open_loop, **found}


def stable(control: Any, scene: hp.Scene) -> Any:
    """Return a controller, its suspension slower where the default would make the robot shake."""
    if not isinstance(control, hp.FootControl) or control.suspension is None:
        return control
    own = parameter_value(control, scene, "suspension.frequency")
    border = stable_range(control, scene, "suspension.frequency")[1]
    if own < border:
        return control
    return with_parameter(control, "suspension.frequency", STABLE_SHARE * border)


def ground(
    robot: str, name: str, *, way: float, seed: int = 0, contact: hp.Contact | None = None
) -> hp.Scene:
    """Return a robot on one of `study_grounds`, as large as a walk of `way` [m] needs."""
    terrain, own = study_grounds(LIFT, seed=seed, length=way + 1.5)[name]
    return hp.Scene(
        hp.load_robot(robot), terrain=terrain, contact=own or contact or hp.Contact.accurate()
    )


def bumps(robot: str, seeds: int, way: float, first: int = 0) -> list[hp.Scene]:
    """Return a robot on random bumps of half the lift, one scene per seed."""
    return [ground(robot, "bumps", way=way, seed=first + k) for k in range(seeds)]


def ground_comparison(robot: str, size: Size) -> Comparison:
    """Return all controllers on S1's flat ground, with two contacts, and on all other grounds."""
    gait = GAITS[robot]
    duration = size.way / gait.speed
    flat = {
        "flat, s1 contact": ground(robot, "flat", way=size.way, contact=hp.Contact.s1()),
        "flat": ground(robot, "flat", way=size.way),
    }
    others: dict[str, Any] = {"bumps": bumps(robot, size.seeds, size.way)}
    if not size.quick:
        for name in ("slope", "step", "slippery", "soft", "soil"):
            others[name] = ground(robot, name, way=size.way)
    planned: list[PlannedRun] = plan_runs(
        flat, controllers(gait), duration=duration, **size.settings
    )
    planned += plan_runs(others, controllers(uneven(robot)), duration=duration, **size.settings)
    return run_study(compared, planned)


def percent(change: Estimate | None) -> str:
    """Return a change in percent, with its interval where there is one."""
    if change is None:
        return "-"
    width = "" if change.half_width is None else f" ± {100.0 * change.half_width:.0f}"
    return f"{100.0 * change.value:+.0f}{width}"


def walked(comparison: Comparison, scene: str, name: str) -> str:
    """Return how many runs of a controller walked, and what became of the others."""
    outcomes = [run.outcome.value for run in comparison.of(scene, name)]
    others = ", ".join(sorted({word for word in outcomes if word != "walked"}))
    return f"{outcomes.count('walked')}/{len(outcomes)}" + (f" ({others})" if others else "")


def numbers(comparison: Comparison, metrics: Iterable[str]) -> dict[str, Any]:
    """Return mean, change, and half of the change's interval of some metrics, to four digits."""

    def digits(value: float | None) -> float | None:
        return None if value is None else float(f"{value:.4g}")

    def plain(scene: str, name: str, metric: str) -> list[float | None]:
        mean = comparison.mean(scene, name, metric)
        change = comparison.change(scene, name, metric)
        return [
            digits(None if mean is None else mean.value),
            digits(None if change is None else change.value),
            digits(None if change is None else change.half_width),
        ]

    return {
        scene: {
            name: {metric: plain(scene, name, metric) for metric in metrics}
            for name in comparison.controllers
        }
        for scene in comparison.scenes
    }
