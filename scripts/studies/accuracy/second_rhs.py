"""Do the native core's laws and events give the trajectories of a second right-hand side?

Every law in short scenes where it acts, integrated by SciPy's DOP853 over Pinocchio in Python with
formulas of its own (`tests/oracles/second_rhs/`), restarted at every switch; and by the core.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from oracles.second_rhs import LawScene, difference
from oracles.second_rhs.contact_scenes import (
    friction_scenes,
    ground_scenes,
    normal_scenes,
    pair_scenes,
)
from oracles.second_rhs.drive_scenes import drive_scenes
from oracles.second_rhs.long_scenes import long_scenes
from oracles.second_rhs.robot_scenes import robot_scenes

from hexapod_pin.errors import DivergenceError
from hexapod_pin.text_table import Table
from hexapod_pin.validation.position_error import PositionError
from studies.study import StudyReport

GROUPS: dict[str, Callable[[], Mapping[str, LawScene]]] = {
    "normal": normal_scenes, "friction": friction_scenes, "ground": ground_scenes,
    "ground-stick-slip": lambda: ground_scenes("stick-slip"),
    "drive": drive_scenes, "long": long_scenes, "pairs": pair_scenes, "robot": robot_scenes,
}  # fmt: skip

ASKED: tuple[tuple[str, float], ...] = (
    ("dop853", 1e-9), ("ndf", 1e-7), ("ndf", 1e-9), ("extrapolated-euler", 1e-4),
    ("extrapolated-euler", 1e-6),
)  # fmt: skip
"""Methods of the core and the accuracies asked for [m, rad]."""

ALLOWED = 3.0
"""Error over the accuracy asked for beyond which a run has failed [-]."""


@dataclass(frozen=True)
class Distance:
    """How far a run of the core is from SciPy's, and its own bound [m, rad]."""

    method: str
    accuracy: float
    error: float

    @property
    def failed(self) -> bool:
        """Whether it misses what was asked for by more than `ALLOWED`."""
        return not self.error <= ALLOWED * self.accuracy

    def text(self) -> str:
        """Return the error, and how many times what was asked it is where it fails."""
        ratio = f" FAIL x{self.error / self.accuracy:.0f}" if self.failed else ""
        return f"{self.error:.1e}{ratio}"


@dataclass(frozen=True)
class LawRow:
    """A scene: what switches in it, SciPy's own uncertainty [m, rad], the core's distances."""

    name: str
    switches: str
    uncertainty: float
    distances: tuple[Distance, ...]

    def cells(self) -> tuple[str, ...]:
        """Return the row as text."""
        own = (distance.text() for distance in self.distances)
        return self.name, self.switches, f"{self.uncertainty:.0e}", *own


def measure(scene: LawScene, tolerance: float) -> LawRow:
    """Return the row of a scene; SciPy's uncertainty is what ten times the tolerance changes."""
    run, check = scene.by_scipy(tolerance), scene.by_scipy(10.0 * tolerance)
    counts = Counter(one.what for one in run.switches if one.what not in ("touch_speed", "left"))
    distances = tuple(
        Distance(method, accuracy, _error(scene, run.q, method=method, accuracy=accuracy))
        for method, accuracy in ASKED
    )
    return LawRow(
        scene.name, ", ".join(f"{what} {count}" for what, count in counts.items()) or "none",
        PositionError.between(check.q, run.q).q, distances,
    )  # fmt: skip


def _error(scene: LawScene, wanted: Any, **settings: Any) -> float:
    try:
        return difference(scene, wanted, **settings).q
    except DivergenceError:
        return math.inf


def second_rhs(
    *, groups: str = ",".join(GROUPS), most: int = 0, tolerance: float = 1e-11
) -> StudyReport:
    """The native core beside a second right-hand side under SciPy; `most` scenes of each group."""
    rows = []
    for group in groups.split(","):
        scenes = list(GROUPS[group]().values())
        for scene in scenes[: most or len(scenes)]:
            rows.append(measure(scene, 100.0 * tolerance if group == "robot" else tolerance))
            print(*rows[-1].cells(), sep=" | ", file=sys.stderr, flush=True)
    head = (
        "scene", "switches", "SciPy's own",
        *(f"{method} {accuracy:.0e}" for method, accuracy in ASKED),
    )  # fmt: skip
    table = Table("Largest distance [m, rad]", head, [row.cells() for row in rows])
    runs = [distance for row in rows for distance in row.distances]
    failed = sum(one.failed for one in runs)
    return StudyReport(
        "The native core beside a second right-hand side",
        [
            "Every law's formula is written a second time in Python and integrated by SciPy's "
            f"DOP853 at rtol {tolerance:g} (whole robots: {100.0 * tolerance:g}) with a restart at "
            'every switch. "SciPy\'s own": what ten times the tolerance changes there. A run of '
            f"the core beyond {ALLOWED:g} times the accuracy asked for is a FAIL.",
            f"{failed} of {len(runs)} runs fail.",
            table,
        ],
        met=failed == 0,
    )
