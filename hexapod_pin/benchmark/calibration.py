"""True errors over random drops and walks are compared with the requested accuracy.

Scenes are drawn from a seed: drops of the reference hexapod (K 1e5..1e8 N/m^1.5, kt 1e2..1e4 s/m,
a 0.1..0.6 s/m, mu 0.2..1, attitude, twist, height) and walks of the `walk` scene (K 1e5..1e7,
kt 2e2..3e3). Each is compared with `reference`: another method, far tighter, itself checked.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hexapod_pin.benchmark.work_precision.measure import ReferenceSolution
from hexapod_pin.benchmark.work_precision.own_entry import find_reference
from hexapod_pin.benchmark.work_precision.scenes import walk
from hexapod_pin.benchmark.work_precision.task import Task
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.simulation.case import simulate
from hexapod_pin.text_table import Table
from hexapod_pin.validation.cases.drop import drop
from hexapod_pin.validation.cases.robots import lowest_foot
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting
from hexapod_pin.validation.tables import part_verdict

ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
SEED = 20
DROP_DURATION, WALK_DURATION, SAMPLE = 0.3, 1.0, 0.01
"""[s]"""

LOOSE_ERROR_RATIO, TIGHT_ERROR_RATIO, COST_RATIO = 5.0, 1.0, 1.2
"""What is promised: error over accuracy at 1e-4 and looser, at 1e-5 and tighter; cost of a looser
run over that of a tighter one."""


@dataclass(frozen=True)
class Calibration:
    """One run.

    Attributes:
        kind: "drop" or "walk".
        scene: which of them.
        accuracy: requested [m, rad].
        error: largest difference of any position at any sample from the reference [m, rad].
        evaluations: what it cost.
        uncertainty: distance of the reference from its check [m, rad].
    """

    kind: str
    scene: str
    accuracy: float
    error: float
    evaluations: int
    uncertainty: float

    @property
    def factor(self) -> float:
        """Error over the requested accuracy."""
        return self.error / self.accuracy

    @property
    def promised(self) -> float:
        """Largest factor promised."""
        return LOOSE_ERROR_RATIO if self.accuracy >= 0.9e-4 else TIGHT_ERROR_RATIO

    @property
    def kept(self) -> bool:
        """Whether the error is within the promise."""
        return self.factor <= self.promised


def random_tasks(seed: int = SEED, drops: int = 18, walks: int = 18) -> list[Task]:
    """Return the scenes, the same for the same seed; a drop does not depend on the walks."""
    falls, steps = (np.random.default_rng([seed, k]) for k in (0, 1))
    return [
        *(_drop(falls, f"drop {k + 1}") for k in range(drops)),
        *(_walk(steps, f"walk {k + 1}") for k in range(walks)),
    ]


def _drop(generator: np.random.Generator, name: str) -> Task:
    """Return the reference hexapod thrown down somehow from 5 to 40 mm."""
    import pinocchio as pin

    base = drop("soft")
    robot = base.scene.robot
    contact = _contact(generator, (1e5, 1e8), (1e2, 1e4), (0.2, 1.0))
    scene = replace(base.scene, contact=contact)
    roll, pitch = generator.uniform(-0.3, 0.3, 2)
    attitude = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, generator.uniform(-3.0, 3.0)))
    q = np.concatenate([np.zeros(3), attitude.coeffs(), base.initial.q[7:]])
    q[2] = generator.uniform(0.005, 0.04) - lowest_foot(robot, q)
    v = np.zeros(robot.model.nv)
    v[:3], v[3:6] = generator.uniform(-0.3, 0.3, 3), generator.uniform(-1.0, 1.0, 3)
    start = robot.check_state(q, v)
    return Task(name, scene, base.controller, start, DROP_DURATION, SAMPLE)


def _walk(generator: np.random.Generator, name: str) -> Task:
    base = walk(WALK_DURATION)
    contact = _contact(generator, (1e5, 1e7), (2e2, 3e3), (0.3, 1.0))
    return replace(base, name=name, scene=replace(base.scene, contact=contact))


def _contact(
    generator: np.random.Generator, stiffness: tuple[float, float], slope: tuple[float, float],
    mu: tuple[float, float],
) -> Contact:  # fmt: skip
    def between(low: float, high: float) -> float:
        return float(math.exp(generator.uniform(math.log(low), math.log(high))))

    normal = HuntCrossley(
        stiffness=between(*stiffness), dissipation=float(generator.uniform(0.1, 0.6))
    )
    friction = TanhCoulomb(mu=float(generator.uniform(*mu)), slope=between(*slope))
    return Contact(normal=normal, friction=friction)


def calibrate(
    tasks: Sequence[Task],
    *,
    method: str = "extrapolated-euler",
    accuracies: Sequence[float] = ACCURACIES,
    reference: Callable[[Task], ReferenceSolution] = find_reference,
    progress: Callable[[float], None] | None = None,
) -> list[Calibration]:
    """Run every task at every accuracy and compare with its reference.

    Args:
        tasks: the scenes, named "drop ..." or "walk ...".
        method: an adaptive method.
        accuracies: [m, rad].
        reference: finds the reference of a task.
        progress: called with the finished fraction.

    Raises:
        NoReferenceError: a task without a reference.
        DivergenceError: a run that did not end.
    """
    rows: list[Calibration] = []
    for done, task in enumerate(tasks, start=1):
        known = reference(task)
        rows.extend(_run(task, known, SolverSetting(method, accuracy)) for accuracy in accuracies)
        if progress is not None:
            progress(done / len(tasks))
    return rows


def _run(task: Task, reference: ReferenceSolution, setting: SolverSetting) -> Calibration:
    trace = simulate(
        task.scene, task.controller, duration=task.duration, sample=task.sample,
        initial=task.initial, **setting.arguments,
    )  # fmt: skip
    assert reference.outcome.q is not None
    return Calibration(
        kind=task.name.split()[0], scene=task.name, accuracy=setting.value,
        error=PositionError.between(trace.q, reference.outcome.q).q,
        evaluations=int(trace.counters["evaluations"]), uncertainty=reference.uncertainty.q,
    )  # fmt: skip


def largest_cost_ratio(rows: Sequence[Calibration]) -> float:
    """Return the largest cost of a run over that of any tighter run of its scene."""
    ratios = [
        loose.evaluations / tight.evaluations
        for loose in rows
        for tight in rows
        if loose.scene == tight.scene and tight.accuracy < loose.accuracy
    ]
    return max(ratios, default=0.0)


def calibration_table(rows: Sequence[Calibration]) -> Table:
    """Return medians and extremes by kind of scene and accuracy."""
    head = (
        "scenes", "accuracy", "error, median", "error, most", "over accuracy, median",
        "over accuracy, most", "promised", "evaluations, median", "uncertainty, most", "result",
    )  # fmt: skip
    return Table("Accuracy asked for and kept", head, tuple(_table_rows(rows)))


def _table_rows(rows: Sequence[Calibration]) -> Iterator[tuple[str, ...]]:
    for kind in dict.fromkeys(row.kind for row in rows):
        for accuracy in dict.fromkeys(row.accuracy for row in rows):
            own = [row for row in rows if (row.kind, row.accuracy) == (kind, accuracy)]
            errors, factors = [row.error for row in own], [row.factor for row in own]
            yield (
                f"{len(own)} {kind}s", f"{accuracy:.0e}",
                f"{statistics.median(errors):.1e}", f"{max(errors):.1e}",
                f"{statistics.median(factors):.2f}", f"{max(factors):.2f}",
                f"{own[0].promised:g}",
                f"{statistics.median(row.evaluations for row in own):.0f}",
                f"{max(row.uncertainty for row in own):.0e}",
                part_verdict(sum(not row.kept for row in own), len(own)),
            )  # fmt: skip
