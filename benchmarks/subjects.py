"""What is timed: microseconds per step by "engine/motion/contact", seconds of whole runs."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from motions import Motion
from mujoco_scene import CONES, MujocoScene
from timing import Subject

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.simulation.plant import native_plant

STEP = 1e-3
"""Integration step of everything timed [s]."""

ROBOT = "kharagpur"
CONTACTS = ("s1", "s2")
SHORTEST, LONGEST = 0.08, 0.14
"""Strokes in a batch [m]: cases differ, as in a sweep."""


@dataclass(frozen=True)
class Size:
    """How long to measure.

    Attributes:
        rounds: counted rounds.
        duration: of the timed motions and their references [s].
        fine: step of the references [s].
        walk: of the walk through the front door [s].
        batch: of each walk of a batch [s].
        cases: walks in a batch.
        calls: repetitions of the Pinocchio calls in a round.
    """

    rounds: int = 21
    duration: float = 4.8
    fine: float = 1e-5
    walk: float = 10.0
    batch: float = 4.0
    cases: int = 32
    calls: int = 5000


QUICK = Size(rounds=3, duration=0.4, fine=1e-4, walk=0.5, batch=0.2, cases=4, calls=2000)


def standing_and_walking(duration: float) -> dict[str, Motion]:
    """Return stand, tripod and tetrapod on both contact sets, by "motion/contact"."""
    robot = hp.load_robot(ROBOT)
    controllers: dict[str, hp.Hold | hp.KinematicControl] = {
        "stand": hp.HoldPosture(),
        "tripod": hp.KinematicControl(hp.Gait.tripod()),
        "tetrapod": hp.KinematicControl(hp.Gait.tetrapod()),
    }
    return {
        f"{name}/{contact}": Motion.of(
            hp.Scene(robot, contact=hp.Contact.preset(contact)), controller, duration
        )
        for contact in CONTACTS
        for name, controller in controllers.items()
    }


def all_subjects(motions: Mapping[str, Motion], size: Size) -> list[Subject]:
    """Return everything to time; what is compared stands next to each other."""
    steps = round(size.duration / STEP)
    found = [x for name, motion in motions.items() for x in _steps(name, motion, steps, size.calls)]
    return [*found, front_door(size.walk), batch(size)]


def _steps(name: str, motion: Motion, steps: int, calls: int) -> list[Subject]:
    """Our step, Pinocchio's share of one as plain calls, and MuJoCo's step, for one motion."""
    ours = motion.timed_run(STEP, steps)
    sampled = motion.timed_run(STEP, steps, stride=1)
    per_step = 1e6 / steps
    found: list[Subject] = [
        lambda: {f"step/{name}": ours() * per_step},
        pinocchio_calls(name, motion, calls),
    ]
    for cone in CONES:
        twin = MujocoScene(motion.scene, cone=cone, step=STEP)
        found.append(_mujoco(name, cone, twin, motion, steps))
    found.append(lambda: {f"sampled/{name}": sampled() * per_step})
    if name == "tetrapod/s1":
        dense = motion.timed_run(STEP, steps, dense=True)
        found.append(lambda: {f"dense/{name}": dense() * per_step})
    return found


def _mujoco(name: str, cone: str, twin: MujocoScene, motion: Motion, steps: int) -> Subject:
    run = twin.timed_run(motion.state, motion.setpoints, steps)
    return lambda: {f"{cone}/{name}": run() * 1e6 / steps}


def pinocchio_calls(name: str, motion: Motion, calls: int) -> Subject:
    """Time crba and nonLinearEffects in C++; the yardstick; our step needs neither."""
    plant, state = native_plant(motion.scene), motion.state
    v = np.full(len(state.v), 0.1)

    def run() -> dict[str, float]:
        begin = time.perf_counter()
        native.repeat_dynamics(plant, state.q, v, calls)
        return {f"pinocchio/{name}": (time.perf_counter() - begin) * 1e6 / calls}

    return run


def front_door(duration: float) -> Subject:
    """Time an open-loop walk through `hp.simulate`, whole call and rollout alone [s]."""
    scene = hp.Scene(hp.load_robot(ROBOT))
    controller = hp.KinematicControl(hp.Gait.tetrapod())

    def run() -> dict[str, float]:
        begin = time.perf_counter()
        trace = hp.simulate(scene, controller, duration=duration, step=STEP)
        whole = time.perf_counter() - begin
        return {"walk/call": whole, "walk/rollout": float(trace.meta["wall_time"])}

    return run


def batch_motions(size: Size) -> list[Motion]:
    """Return the walks of a batch: tetrapods of different strokes."""
    scene = hp.Scene(hp.load_robot(ROBOT))
    return [
        Motion.of(scene, hp.KinematicControl(hp.Gait.tetrapod(stroke=float(stroke))), size.batch)
        for stroke in np.linspace(LONGEST, SHORTEST, size.cases)
    ]


def advance(
    motions: list[Motion], duration: float, threads: int
) -> tuple[float, list[native.Rollout]]:
    """Run a batch as `hp.simulate_batch` does; return the wall time [s] and the runs."""
    runs = [motion.rollout(STEP, 1) for motion in motions]
    begin = time.perf_counter()
    batch = native.Batch(threads)
    for run in runs:
        batch.add(run, round(duration / STEP))
    good = batch.finish()
    taken = time.perf_counter() - begin
    if not all(good):
        raise RuntimeError("a walk of the batch diverged")
    return taken, runs


def batch(size: Size) -> Subject:
    """Time the native part of a batch with one and two threads [s]."""
    motions = batch_motions(size)
    return lambda: {
        f"batch/{threads}": advance(motions, size.batch, threads)[0] for threads in (1, 2)
    }


def same_bits(size: Size) -> bool:
    """Say whether one and two threads give the same bits in every sampled quantity."""
    motions = batch_motions(size)
    one, two = (
        [run.record() for run in advance(motions, size.batch, threads)[1]] for threads in (1, 2)
    )
    return all(
        np.array_equal(a[name], b[name]) for a, b in zip(one, two, strict=True) for name in a
    )
