"""The error beside a speed: trunk position against the same engine and method at a fine step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from motions import Motion
from mujoco_scene import SAMPLE, Array, MujocoScene


@dataclass(frozen=True)
class Run:
    """Trunk positions every 10 ms, shape (n, 3) [m]; mean number of feet down; counters."""

    positions: Array
    feet_down: float
    counters: dict[str, float]


@dataclass(frozen=True)
class Accuracy:
    """How far a run at the timed step is from that engine's own reference.

    Attributes:
        first_second: largest distance over the 10 ms grid of the first second [m].
        whole: the same over the whole run [m].
        reference: how far the reference moves when its own step is doubled, whole run [m]: an
            error below it is not resolved.
        feet_down: mean number of feet on the ground.
        counters: steps, evaluations and others of the run at the timed step.
    """

    first_second: float
    whole: float
    reference: float
    feet_down: float
    counters: dict[str, float]

    @classmethod
    def of(cls, run: Callable[[float], Run], step: float, fine: float) -> Accuracy:
        """Run at `step`, `fine` and 2 `fine` [s], and compare."""
        coarse, reference, other = run(step), run(fine), run(2.0 * fine)
        error = np.linalg.norm(coarse.positions - reference.positions, axis=1)
        uncertainty = np.linalg.norm(other.positions - reference.positions, axis=1)
        return cls(
            first_second=float(error[: round(1.0 / SAMPLE) + 1].max()),
            whole=float(error.max()),
            reference=float(uncertainty.max()),
            feet_down=coarse.feet_down,
            counters=coarse.counters,
        )


def ours(motion: Motion, duration: float, step: float, fine: float) -> Accuracy:
    """Return the accuracy of linearly implicit Euler."""
    return Accuracy.of(lambda h: Run(*motion.positions(h, duration)), step, fine)


def dense_difference(motion: Motion, duration: float, step: float) -> float:
    """Return how far the dense solver's run is from the block-arrow solver's [m]."""
    arrow = motion.positions(step, duration)[0]
    return float(np.abs(motion.positions(step, duration, dense=True)[0] - arrow).max())


def mujoco(motion: Motion, cone: str, duration: float, step: float, fine: float) -> Accuracy:
    """Return the accuracy of MuJoCo's implicitfast; its references solve contacts to 1e-12."""

    def run(h: float) -> Run:
        twin = MujocoScene(motion.scene, cone=cone, step=h, exact=h != step)
        positions, contacts, iterations = twin.positions(motion.state, motion.setpoints, duration)
        steps = float(round(duration / h))
        counters = {"steps": steps, "evaluations": steps, "solver_iterations": iterations}
        return Run(positions, contacts, counters)

    return Accuracy.of(run, step, fine)
