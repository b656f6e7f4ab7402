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

MUJOCO = {
    f"implicitfast, {1e3 * step:g} ms{', moving set-points' * moving}": (step, moving)
    for moving in (False, True)
    for step in (2e-3, 1e-3)
}
"""Step [s], and whether the set-points move with each of these steps instead of every 20 ms."""

MOST_GROWTH = 2e6
"""Of the memory between the first tenth of the resets and the last [bytes]."""


def learning_cost(*, duration: float = 4.0, rounds: int = 5, resets: int = 10_000) -> StudyReport:
    """Time steps of environments and of MuJoCo; compare their paths; count memory over resets."""
    steps = round(duration / 0.02)
    ours = {name: _walk(steps, **how) for name, how in SETTINGS.items()}
    exact = _walk(steps, accuracy=1e-8)()[1]
    mujoco = {name: _mujoco(steps, MjcfOptions(h), moving) for name, (h, moving) in MUJOCO.items()}
    fine = MjcfOptions(1e-4, "RK4", exact=True)
    truths = {moving: _mujoco(steps, fine, moving)() for moving in (False, True)}
    subjects = {**ours, **{f"{TOGETHER}, {n}": _many(steps, **h) for n, h in SETTINGS.items()}}
    timed = {**subjects, **{f"MuJoCo {name}": run for name, run in mujoco.items()}}
    rates = interleaved({name: _rate(run) for name, run in timed.items()}, rounds)
    rows = []
    for name, run in timed.items():
        _, path, limited = run()
        moving = MUJOCO.get(name.removeprefix("MuJoCo "), (0.0, None))[1]
        reference = exact if moving is None else truths[moving][1]
        error = 1e3 * float(np.linalg.norm(path - reference, axis=1).max())
        at_limit = "" if moving is None else f"{100.0 * limited:.1f}"
        rows.append([name, Quartiles.of(rates[name]).text(".0f"), f"{error:.3g}", at_limit])
    grown, first = _growth(resets)
    limit = f"{verdict(grown < MOST_GROWTH)} (at most {MOST_GROWTH / 1e6:g} MB)"
    head = [
        "environment", "steps per second of one core", "error of the path [mm]",
        "torques at their limits [%]",
    ]  # fmt: skip
    at_limit = " and ".join(f"{100.0 * found[2]:.2f} %" for found in truths.values())
    return StudyReport(
        "What steps of a walking environment cost",
        [
            f"The tripod of kharagpur at 0.1 m/s for {duration:g} s, a step of 20 ms, {rounds} "
            "interleaved rounds (median, quartiles), one thread. Ours: `hp.rl.WalkEnv.step` with "
            f"its 72 observations and all terms of the reward; {TOGETHER}: `hp.rl.WalkVectorEnv`, "
            "steps of all its environments. MuJoCo: the same bodies, gains, limits and coefficient "
            "of friction; a loop in Python that writes the set-points, calls `mj_step` and copies "
            "positions and velocities, as gymnasium's environments do, without reward. Its contact "
            "law is another and its set-points are held during a step, or move with each step of "
            "MuJoCo on straight lines, where ours move on cubics; so the motions differ, and each "
            "error is against the same motion in the same engine, integrated more finely: "
            "extrapolated-euler at 1e-8; MuJoCo RK4 at 0.1 ms. It is the largest of the trunk's "
            "place in the horizontal plane at the ends of the steps.",
            Table("", head, rows, "<>>>"),
            "Torques at their limits: mean over joints and steps of MuJoCo; in its references "
            f"{at_limit} with held and with moving set-points. Set-points that jump, "
            "together with the limits of the torques, cause most of the error at 2 ms; by which "
            "mechanism was not isolated. (A step holds the limit for 2 ms, where with the damping "
            "of a servo and the inertia of a tibia the torque is below it after 0.04 ms.) One "
            "change at a time, held set-points at 2 ms, MuJoCo 4.0.0, each against a reference of "
            "its own: without a limit of the torques the error was 5.4 mm in place of 49; an "
            "elliptic cone made it 25, `impratio` 10 37, a `solref` of 10 and 40 ms 37 and 46, a "
            "solver tolerance of 1e-12 49, semi-implicit Euler and RK4 128 and 189.",
            f"Memory over {resets} resets, each with a step, a slope, a friction and a speed of "
            f"its own: {first / 1e6:.1f} MB after a tenth of them, {grown / 1e6:+.2f} MB at the "
            f"end. {limit}",
        ],
        met=grown < MOST_GROWTH,
    )  # fmt: skip


Walk = Callable[[], tuple[float, Array, float]]
"""Returns steps per second of processor time, the path of the trunk (steps, 2) [m], and the share
of the torques at their limits (of MuJoCo's)."""


def _rate(run: Walk) -> Callable[[], float]:
    return lambda: run()[0]


def _walk(steps: int, **how: Any) -> Walk:
    env = hp.rl.WalkEnv(**WALK, **how, duration=60.0)
    action = np.zeros(len(env.walker.driven))

    def run() -> tuple[float, Array, float]:
        env.reset(seed=0)
        path, begin = np.empty((steps, 2)), time.process_time()
        for k in range(steps):
            *_, info = env.step(action)
            path[k] = info["x"], info["y"]
        return steps / (time.process_time() - begin), path, 0.0

    return run


def _many(steps: int, **how: Any) -> Walk:
    env = hp.rl.WalkVectorEnv(TOGETHER, **WALK, **how, duration=60.0)
    actions = np.zeros((TOGETHER, len(env.walkers[0].driven)))

    def run() -> tuple[float, Array, float]:
        env.reset(seed=0)
        path, begin = np.empty((steps, 2)), time.process_time()
        for k in range(steps):
            *_, infos = env.step(actions)
            path[k] = infos["x"][0], infos["y"][0]
        return TOGETHER * steps / (time.process_time() - begin), path, 0.0

    return run


def _mujoco(steps: int, settings: MjcfOptions, moving: bool) -> Walk:
    mj_step = import_module("mujoco").mj_step
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, contact=hp.Contact.accurate().with_mu(0.7))
    twin = MujocoTwin(scene, settings)
    gait = hp.rl.WalkEnv(**WALK).walker.gait
    plan = hp.motion.WalkPlan(robot, gait).at(0.02 * np.arange(steps + 1)).q
    each = round(0.02 / settings.step)

    def one_step(model: Any, data: Any, k: int) -> None:
        if not moving:
            data.ctrl[:] = plan[k + 1]
            mj_step(model, data, each)
            return
        change = (plan[k + 1] - plan[k]) / each
        for i in range(each):
            data.ctrl[:] = plan[k] + (i + 1) * change
            mj_step(model, data)

    def run() -> tuple[float, Array, float]:
        twin.put(robot.stand())
        model, data = twin.model, twin.data
        path, begin = np.empty((steps, 2)), time.process_time()
        for k in range(steps):
            one_step(model, data, k)
            seen = np.concatenate([data.qpos, data.qvel])
            path[k] = seen[:2]
        return steps / (time.process_time() - begin), path, _limited(twin, plan, moving)

    return run


def _limited(twin: MujocoTwin, plan: Array, moving: bool) -> float:
    """Return the share of joints and times at which MuJoCo has a torque at its limit."""
    mj_step = import_module("mujoco").mj_step
    model, data, each = twin.model, twin.data, round(0.02 / twin.settings.step)
    twin.put(twin.scene.robot.stand())
    limit, found = 0.999 * model.actuator_forcerange[:, 1], 0.0
    for k in range((len(plan) - 1) * each):
        part = (k % each + 1) / each if moving else 1.0
        data.ctrl[:] = plan[k // each] + part * (plan[k // each + 1] - plan[k // each])
        mj_step(model, data)
        found += float(np.mean(np.abs(data.actuator_force) >= limit))
    return found / ((len(plan) - 1) * each)


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
