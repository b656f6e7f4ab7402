"""Steps per second of the walking environment, beside MuJoCo on the same robot, with errors."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.interchange.mjcf_text import MjcfOptions
from hexapod_pin.text_table import Table
from studies.cost.mujoco_twin import MujocoTwin
from studies.cost.timing import Quartiles, interleaved
from studies.study import StudyReport, verdict

WALK: dict[str, Any] = {
    "action": "gait", "gait": "tripod", "cycle_time": 0.8, "speed": 0.1, "friction": 0.7,
}  # fmt: skip
"""What is walked: the plan of a gait, offsets of zero."""

SETTINGS: dict[str, dict[str, Any]] = {
    "extrapolated-euler, 1e-3 (default)": {},
    "extrapolated-euler, 1e-4": {"accuracy": 1e-4},
    "implicit-euler, 2 ms": {"step": 2e-3},
}
TOGETHER = 16
"""Environments of a vector environment."""

MUJOCO = {"implicitfast, 2 ms": 2e-3, "implicitfast, 1 ms": 1e-3}
MOST_GROWTH = 2e6
"""Of the memory between the first tenth of the resets and the last [bytes]."""


def learning_cost(*, duration: float = 4.0, rounds: int = 5, resets: int = 10_000) -> StudyReport:
    """Time steps of environments and of MuJoCo; compare their paths; count memory over resets."""
    steps = round(duration / 0.02)
    ours = {name: _walk(steps, **how) for name, how in SETTINGS.items()}
    exact = _walk(steps, accuracy=1e-8)()[1]
    mujoco = {name: _mujoco(steps, MjcfOptions(step)) for name, step in MUJOCO.items()}
    truth = _mujoco(steps, MjcfOptions(1e-4, "RK4", exact=True))()[1]
    subjects = {**ours, **{f"{TOGETHER}, {n}": _many(steps, **h) for n, h in SETTINGS.items()}}
    timed = {**subjects, **{f"MuJoCo {name}": run for name, run in mujoco.items()}}
    rates = interleaved({name: _rate(run) for name, run in timed.items()}, rounds)
    rows = []
    for name, run in timed.items():
        path = run()[1]
        reference = truth if name.startswith("MuJoCo") else exact
        error = 1e3 * float(np.linalg.norm(path - reference, axis=1).max())
        rows.append([name, Quartiles.of(rates[name]).text(".0f"), f"{error:.3g}"])
    grown, first = _growth(resets)
    limit = f"{verdict(grown < MOST_GROWTH)} (at most {MOST_GROWTH / 1e6:g} MB)"
    head = ["environment", "steps per second of one core", "error of the path [mm]"]
    return StudyReport(
        "What steps of a walking environment cost",
        [
            f"The tripod of kharagpur at 0.1 m/s for {duration:g} s, a step of 20 ms, {rounds} "
            "interleaved rounds (median, quartiles), one thread. Ours: `hp.rl.WalkEnv.step` with "
            f"its 72 observations and all terms of the reward; {TOGETHER}: `hp.rl.WalkVectorEnv`, "
            "steps of all its environments. MuJoCo: the same bodies, gains, limits and coefficient "
            "of friction; a loop in Python that writes the set-points, calls `mj_step` and copies "
            "positions and velocities, as gymnasium's environments do, without reward. Its contact "
            "law is another, and its set-points are held during a step where ours move, so the "
            "motions differ and each error is against the same motion in the same engine, "
            "integrated more finely: extrapolated-euler at 1e-8; MuJoCo RK4 at 0.1 ms. It is the "
            "largest of the trunk's place in the horizontal plane at the ends of the steps.",
            Table("", head, rows, "<>>"),
            f"Memory over {resets} resets, each with a step, a slope, a friction and a speed of "
            f"its own: {first / 1e6:.1f} MB after a tenth of them, {grown / 1e6:+.2f} MB at the "
            f"end. {limit}",
        ],
        met=grown < MOST_GROWTH,
    )  # fmt: skip


Walk = Callable[[], tuple[float, Array]]
"""Returns steps per second of processor time, and the path of the trunk (steps, 2) [m]."""


def _rate(run: Walk) -> Callable[[], float]:
    return lambda: run()[0]


def _walk(steps: int, **how: Any) -> Walk:
    env = hp.rl.WalkEnv(**WALK, **how, duration=60.0)
    action = np.zeros(len(env.walker.driven))

    def run() -> tuple[float, Array]:
        env.reset(seed=0)
        path, begin = np.empty((steps, 2)), time.process_time()
        for k in range(steps):
            *_, info = env.step(action)
            path[k] = info["x"], info["y"]
        return steps / (time.process_time() - begin), path

    return run


def _many(steps: int, **how: Any) -> Walk:
    env = hp.rl.WalkVectorEnv(TOGETHER, **WALK, **how, duration=60.0)
    actions = np.zeros((TOGETHER, len(env.walkers[0].driven)))

    def run() -> tuple[float, Array]:
        env.reset(seed=0)
        path, begin = np.empty((steps, 2)), time.process_time()
        for k in range(steps):
            *_, infos = env.step(actions)
            path[k] = infos["x"][0], infos["y"][0]
        return TOGETHER * steps / (time.process_time() - begin), path

    return run


def _mujoco(steps: int, settings: MjcfOptions) -> Walk:
    mj_step = import_module("mujoco").mj_step
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, contact=hp.Contact.accurate().with_mu(0.7))
    twin = MujocoTwin(scene, settings)
    gait = hp.rl.WalkEnv(**WALK).walker.gait
    plan = hp.motion.WalkPlan(robot, gait).at(0.02 * np.arange(1, steps + 1))
    each = round(0.02 / settings.step)

    def run() -> tuple[float, Array]:
        twin.put(robot.stand())
        model, data = twin.model, twin.data
        path, begin = np.empty((steps, 2)), time.process_time()
        for k in range(steps):
            data.ctrl[:] = plan.q[k]
            mj_step(model, data, each)
            seen = np.concatenate([data.qpos, data.qvel])
            path[k] = seen[:2]
        return steps / (time.process_time() - begin), path

    return run


def _growth(resets: int) -> tuple[float, float]:
    """Return how memory grows after a tenth of many resets, and what it is then [bytes]."""
    env = hp.rl.WalkEnv(**{**WALK, "speed": (0.05, 0.1), "friction": (0.5, 0.9)}, slope=(0.0, 0.1))
    action, early = np.zeros(len(env.walker.driven)), 0.0
    for k in range(1, resets + 1):
        env.reset(seed=k)
        env.step(action)
        if k == max(1, resets // 10):
            early = _memory()
    return _memory() - early, early


def _memory() -> float:
    """Return the memory of the process that is resident [bytes]; Linux."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
