"""Threads and processes of the user's own around the core: same bits, nothing lost, no abort."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import hexapod_pin as hp

DURATION = 0.1


def walked(seed: int) -> np.ndarray:
    """Return the samples of a walk of its own."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    gait = hp.Gait.tripod(stroke=0.05 + 0.005 * seed, cycle_time=1.2)
    return hp.simulate(scene, hp.KinematicControl(gait), duration=DURATION, estimate=False).q


def test_eight_python_threads_give_the_bits_of_one():
    alone = [walked(seed) for seed in range(4)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(walked, [0, 1, 2, 3] * 2))
    assert all(np.array_equal(a, b) for a, b in zip(alone * 2, together, strict=True))


def test_one_scene_serves_eight_threads():
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=1.2))

    def run(_: int) -> np.ndarray:
        return hp.simulate(scene, control, duration=DURATION).q

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(run, range(8)))
    assert all(np.array_equal(found[0], other) for other in found[1:])


def test_batches_run_inside_threads():
    scene = hp.Scene(hp.load_robot("kharagpur"))
    cases = [hp.Case(scene, hp.HoldPosture(), duration=0.02) for _ in range(4)]

    def run(_: int) -> list[np.ndarray]:
        return [trace.q for trace in hp.simulate_batch(cases, threads=2)]

    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(run, range(4)))
    assert all(np.array_equal(one, found[0][0]) for many in found for one in many)


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_processes_give_the_same_bits(start: str):
    """The parent has used the core and threads before: a child that is forked still works."""
    alone = [walked(seed) for seed in range(2)]
    context = multiprocessing.get_context(start)
    with ProcessPoolExecutor(1 if start == "spawn" else 2, mp_context=context) as pool:
        found = list(pool.map(walked, range(2)))
    assert all(np.array_equal(a, b) for a, b in zip(alone, found, strict=True))
