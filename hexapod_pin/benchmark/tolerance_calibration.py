"""Does an accuracy mean what it says? True errors over random drops and walks.

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
from numpy.typing import NDArray

from hexapod_pin.benchmark.entry import Truth
from hexapod_pin.benchmark.error import Distance
from hexapod_pin.benchmark.reference_solution import reference
from hexapod_pin.benchmark.scenes import hc40, walk
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.benchmark.tables import Table
from hexapod_pin.benchmark.task import Task
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.simulation.run import simulate
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.bodies import FREE

ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6)
SEED = 20
DROP_TIME, WALK_TIME, SAMPLE = 0.3, 1.0, 0.01
"""[s]"""

LOOSE_FACTOR, TIGHT_FACTOR, COST_FACTOR = 5.0, 1.0, 1.2
"""What is promised: error over accuracy at 1e-4 and looser, at 1e-5 and tighter; cost of a looser
run over that of a tighter one."""


@dataclass(frozen=True)
class Honesty:
    """One run.

    Attributes:
        kind: "drop" or "walk".
        scene: which of them.
        accuracy: asked for [m, rad].
        error: largest difference of any position at any sample from the reference [m, rad].
        estimate: what the run says of its own error [m, rad]; nan where it says nothing.
        evaluations: what it cost.
        doubt: distance of the reference from its check [m, rad].
    """

    kind: str
    scene: str
    accuracy: float
    error: float
    estimate: float
    evaluations: int
    doubt: float

    @property
    def factor(self) -> float:
        """Error over the accuracy asked for."""
        return self.error / self.accuracy

    @property
    def promised(self) -> float:
        """Largest factor promised."""
        return LOOSE_FACTOR if self.accuracy >= 0.9e-4 else TIGHT_FACTOR

    @property
    def kept(self) -> bool:
        """Whether the promise was kept."""
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

    base = hc40("soft")
    robot = base.scene.robot
    contact = _contact(generator, (1e5, 1e8), (1e2, 1e4), (0.2, 1.0))
    scene = Scene(robot, contact=contact, servo=base.scene.servo, stops=FREE)
    roll, pitch = generator.uniform(-0.3, 0.3, 2)
    attitude = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, generator.uniform(-3.0, 3.0)))
    q = np.concatenate([np.zeros(3), attitude.coeffs(), base.initial.q[7:]])
    q[2] = generator.uniform(0.005, 0.04) - _lowest_foot(scene, q)
    v = np.zeros(robot.model.nv)
    v[:3], v[3:6] = generator.uniform(-0.3, 0.3, 3), generator.uniform(-1.0, 1.0, 3)
    start = robot.check_state(q, v)
    return Task(name, scene, base.controller, start, DROP_TIME, SAMPLE)


def _lowest_foot(scene: Scene, q: NDArray[np.float64]) -> float:
    import pinocchio as pin

    model = scene.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    feet = scene.robot.feet
    return min(
        float(data.oMi[model.getJointId(foot.joint)].act(foot.offset)[2]) - foot.radius
        for foot in feet
    )


def _walk(generator: np.random.Generator, name: str) -> Task:
    base = walk(WALK_TIME)
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


def study(
    tasks: Sequence[Task],
    *,
    method: str = "extrapolated-euler",
    accuracies: Sequence[float] = ACCURACIES,
    truth: Callable[[Task], Truth] = reference,
    progress: Callable[[float], None] | None = None,
) -> list[Honesty]:
    """Run every task at every accuracy and compare with its reference.

    Args:
        tasks: the scenes, named "drop ..." or "walk ...".
        method: an adaptive method.
        accuracies: [m, rad].
        truth: finds the reference of a task.
        progress: called with the finished fraction.

    Raises:
        NoReferenceError: a task without a reference.
        DivergenceError: a run that did not end.
    """
    rows: list[Honesty] = []
    for done, task in enumerate(tasks, start=1):
        known = truth(task)
        rows.extend(_run(task, known, Setting(method, accuracy)) for accuracy in accuracies)
        if progress is not None:
            progress(done / len(tasks))
    return rows


def _run(task: Task, truth: Truth, setting: Setting) -> Honesty:
    trace = simulate(
        task.scene, task.controller, duration=task.duration, sample=task.sample,
        initial=task.initial, **setting.arguments,
    )  # fmt: skip
    assert truth.outcome.q is not None
    return Honesty(
        kind=task.name.split()[0], scene=task.name, accuracy=setting.value,
        error=Distance.between(trace.q, truth.outcome.q).q, estimate=trace.error_estimate,
        evaluations=int(trace.counters["evaluations"]), doubt=truth.doubt.q,
    )  # fmt: skip


def dearer(rows: Sequence[Honesty]) -> float:
    """Return the largest cost of a run over that of any tighter run of its scene."""
    ratios = [
        loose.evaluations / tight.evaluations
        for loose in rows
        for tight in rows
        if loose.scene == tight.scene and tight.accuracy < loose.accuracy
    ]
    return max(ratios, default=0.0)


def honesty_table(rows: Sequence[Honesty]) -> Table:
    """Return medians and extremes by kind of scene and accuracy."""
    head = (
        "scenes", "accuracy", "error, median", "error, most", "over accuracy, median",
        "over accuracy, most", "promised", "estimate over error, least .. most",
        "evaluations, median", "doubt, most",
    )  # fmt: skip
    return Table("Accuracy asked for and kept", head, tuple(_table_rows(rows)))


def _table_rows(rows: Sequence[Honesty]) -> Iterator[tuple[str, ...]]:
    for kind in dict.fromkeys(row.kind for row in rows):
        for accuracy in dict.fromkeys(row.accuracy for row in rows):
            own = [row for row in rows if (row.kind, row.accuracy) == (kind, accuracy)]
            errors, factors = [row.error for row in own], [row.factor for row in own]
            ratios = [row.estimate / row.error for row in own]
            yield (
                f"{len(own)} {kind}s", f"{accuracy:.0e}",
                f"{statistics.median(errors):.1e}", f"{max(errors):.1e}",
                f"{statistics.median(factors):.2f}", f"{max(factors):.2f}",
                f"{own[0].promised:g}", f"{min(ratios):.2g} .. {max(ratios):.2g}",
                f"{statistics.median(row.evaluations for row in own):.0f}",
                f"{max(row.doubt for row in own):.0e}",
            )  # fmt: skip
