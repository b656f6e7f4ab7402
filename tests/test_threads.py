"""Threads and processes of the user's own around the core: same bits, nothing lost, no abort."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import hexapod_pin as hp

SCENE = hp.Scene(hp.load_robot("kharagpur"))


def walked(seed: int) -> np.ndarray:
    gait = hp.Gait.tripod(stroke=0.05 + 0.005 * seed, cycle_time=1.2)
    return hp.simulate(SCENE, hp.KinematicControl(gait), duration=0.1, estimate=False).q


def test_eight_python_threads_give_the_bits_of_one():
    alone = [walked(seed) for seed in range(4)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(walked, [0, 1, 2, 3] * 2))
    assert all(np.array_equal(a, b) for a, b in zip(alone * 2, together, strict=True))


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_processes_give_the_same_bits(start: str):
    """The parent has used the core and threads before: a child that is forked still works."""
    alone = [walked(seed) for seed in range(2)]
    context = multiprocessing.get_context(start)
    with ProcessPoolExecutor(1 if start == "spawn" else 2, mp_context=context) as pool:
        found = list(pool.map(walked, range(2)))
    assert all(np.array_equal(a, b) for a, b in zip(alone, found, strict=True))
