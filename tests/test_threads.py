"""Threads and processes of the user's own around the core: same bits, nothing lost, no abort."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
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


def test_ctrl_c_in_a_batch_ends_the_process_with_its_results():
    code = """
import signal, sys, hexapod_pin as hp
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = hp.Scene(hp.load_robot("kharagpur"))
short = hp.Case(scene, hp.HoldPosture(), duration=0.01)
long = hp.Case(scene, hp.HoldPosture(), duration=4000.0, step=1e-4, sample=1.0)
def report(fraction):
    print("done", flush=True)
try:
    hp.simulate_batch([short, long, long, long], threads=4, progress=report)
except hp.errors.SimulationInterrupted as error:
    print([type(result).__name__ for result in error.results], flush=True)
    sys.exit(130)
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "done\n"
        os.kill(child.pid, signal.SIGINT)
        printed = child.communicate(timeout=30)[0]
        assert child.returncode == 130
    assert printed == "['Trace', 'NoneType', 'NoneType', 'NoneType']\n"
