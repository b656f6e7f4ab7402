"""What takes part in the cost of a step: our methods, Pinocchio's calls, MuJoCo; their errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.engines.mujoco_engine import CONES
from hexapod_pin.interchange.mjcf_text import MjcfOptions
from hexapod_pin.simulation.plant import native_plant
from studies.cost.mujoco_twin import SAMPLE, MujocoTwin, TrunkPath
from studies.cost.native_motion import NativeMotion
from studies.cost.timing import interleaved

STEP = 1e-3
"""Integration step of everything timed [s]."""

PINOCCHIO = "Pinocchio's crba + nonLinearEffects"
MUJOCO = tuple(f"MuJoCo, {cone} cone" for cone in CONES)


@dataclass(frozen=True)
class StepStudySize:
    """How long to measure.

    Attributes:
        rounds: counted rounds.
        duration: of the timed motions and their references [s].
        fine: step of the references [s].
        calls: repetitions of the Pinocchio calls in a round.
    """

    rounds: int = 21
    duration: float = 4.8
    fine: float = 1e-5
    calls: int = 5000


QUICK_SIZE = StepStudySize(rounds=1, duration=0.1, fine=1e-4, calls=200)


@dataclass(frozen=True)
class TrunkError:
    """How far a run at the timed step is from a reference.

    Attributes:
        first_second: largest distance over the 10 ms grid of the first second [m].
        whole: the same over the whole run [m].
        uncertainty: how far the reference moves when its own step is doubled [m]: an error below
            it is not resolved.
        feet_down: mean number of feet on the ground.
        counters: steps, evaluations and others of the run at the timed step.
    """

    first_second: float
    whole: float
    uncertainty: float
    feet_down: float
    counters: dict[str, float]

    @classmethod
    def of(
        cls,
        path: Callable[[float], TrunkPath],
        reference: Callable[[float], TrunkPath],
        fine: float,
    ) -> TrunkError:
        """Run at `STEP`, the reference at `fine` and 2 `fine` [s], and compare."""
        coarse, exact, other = path(STEP), reference(fine), reference(2.0 * fine)
        error = np.linalg.norm(coarse.positions - exact.positions, axis=1)
        doubled = np.linalg.norm(other.positions - exact.positions, axis=1)
        early = round(1.0 / SAMPLE) + 1
        return cls(
            float(error[:early].max()), float(error.max()), float(doubled.max()),
            coarse.feet_down, coarse.counters,
        )  # fmt: skip


@dataclass(frozen=True)
class StepEntry:
    """Something whose step is timed.

    Attributes:
        run: runs once and returns the time of a step [us].
        path: the trunk's path at a step [s]; None where it has none of its own.
        reference: the path that its error is against; None: its own.
    """

    run: Callable[[], float]
    path: Callable[[float], TrunkPath] | None = None
    reference: Callable[[float], TrunkPath] | None = None

    def error(self, fine: float) -> TrunkError | None:
        """Return the error with a reference at the step `fine` [s]."""
        if self.path is None:
            return None
        return TrunkError.of(self.path, self.reference or self.path, fine)


def standing_and_walking(duration: float) -> dict[str, NativeMotion]:
    """Return stand, tripod and tetrapod on both contact sets, by "motion/contact"."""
    robot = hp.load_robot("kharagpur")
    controllers: dict[str, hp.HoldPosture | hp.KinematicControl] = {
        "stand": hp.HoldPosture(),
        "tripod": hp.KinematicControl(hp.Gait.tripod()),
        "tetrapod": hp.KinematicControl(hp.Gait.tetrapod()),
    }
    return {
        f"{name}/{contact}": NativeMotion.of(
            hp.Scene(robot, contact=hp.Contact.preset(contact)), controller, duration
        )
        for contact in ("s1", "s2")
        for name, controller in controllers.items()
    }


def own_step(
    motion: NativeMotion, size: StepStudySize, method: str = "implicit-euler", *,
    stride: int | None = None, dense: bool = False, reference: str | None = None,
) -> StepEntry:  # fmt: skip
    """Return one of our methods; `reference` names that of its reference, None: its own."""
    steps = round(size.duration / STEP)
    run = motion.timed_run(STEP, steps, stride=stride, method=method, dense=dense)
    if stride or dense:  # neither changes the run
        return StepEntry(lambda: run() * 1e6 / steps)
    return StepEntry(
        lambda: run() * 1e6 / steps,
        lambda h: motion.path(h, size.duration, method=method),
        lambda h: motion.path(h, size.duration, method=reference or method),
    )


def pinocchio_calls(motion: NativeMotion, size: StepStudySize) -> StepEntry:
    """Return crba and nonLinearEffects in C++: the yardstick; our step needs neither."""
    plant, q = native_plant(motion.scene), motion.state.q
    v = np.full(len(motion.state.v), 0.1)

    def run() -> float:
        begin = time.perf_counter()
        native.repeat_dynamics(plant, q, v, size.calls)
        return (time.perf_counter() - begin) * 1e6 / size.calls

    return StepEntry(run)


def mujoco_step(motion: NativeMotion, size: StepStudySize, cone: str) -> StepEntry:
    """Return MuJoCo's implicitfast; its references solve contacts to 1e-12."""
    steps = round(size.duration / STEP)
    twin = MujocoTwin(motion.scene, MjcfOptions(STEP, cone=cone))
    run = twin.timed_run(motion.state, motion.set_points, steps)

    def path(h: float) -> TrunkPath:
        settings = MjcfOptions(h, cone=cone, exact=h != STEP)
        other = MujocoTwin(motion.scene, settings)
        return other.path(motion.state, motion.set_points, size.duration)

    return StepEntry(lambda: run() * 1e6 / steps, path)


def yardsticks(motion: NativeMotion, size: StepStudySize) -> dict[str, StepEntry]:
    """Return what our steps are compared with."""
    cones = zip(MUJOCO, CONES, strict=True)
    return {
        PINOCCHIO: pinocchio_calls(motion, size),
        **{name: mujoco_step(motion, size, cone) for name, cone in cones},
    }


@dataclass(frozen=True)
class StepRow:
    """One entry on one motion.

    Attributes:
        motion: "motion/contact".
        entry: its name.
        samples: time of a step in every round [us].
        of_pinocchio: ratios to Pinocchio's calls of the same round.
        of_mujoco: ratios to MuJoCo's cheaper step of the same round.
        error: against its reference; None where it has none.
    """

    motion: str
    entry: str
    samples: Array
    of_pinocchio: Array
    of_mujoco: Array
    error: TrunkError | None


def measure_steps(
    entries: Mapping[str, Mapping[str, StepEntry]], size: StepStudySize
) -> list[StepRow]:
    """Time all entries of all motions in interleaved rounds, then find their errors."""
    runs = {f"{m}|{name}": one.run for m, own in entries.items() for name, one in own.items()}
    samples = interleaved(runs, size.rounds)
    rows = []
    for motion, own in entries.items():
        calls = samples[f"{motion}|{PINOCCHIO}"]
        cheapest = np.minimum(*(samples[f"{motion}|{name}"] for name in MUJOCO))
        for name, entry in own.items():
            taken = samples[f"{motion}|{name}"]
            error = entry.error(size.fine)
            rows.append(StepRow(motion, name, taken, taken / calls, taken / cheapest, error))
    return rows


def rows_data(rows: Sequence[StepRow]) -> list[dict[str, object]]:
    """Return the rows as JSON-able data."""
    return [
        {
            "motion": row.motion, "entry": row.entry, "us_per_step": row.samples.tolist(),
            "error": None if row.error is None else vars(row.error),
        }
        for row in rows
    ]  # fmt: skip
