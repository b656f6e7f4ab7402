"""Learning: the environments of gymnasium, their checker, their bits, and what an episode earns."""

from __future__ import annotations

import copy
import math
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import GaitError, NotPicklableError, ParameterError
from hexapod_pin.rl.task import ALL_OBSERVED

ID = "hexapod_pin/Walk-v0"

WALK: dict[str, Any] = {"action": "gait", "gait": "tripod", "cycle_time": 0.8}

NOISY = hp.sensors.Sensors(
    q=hp.sensors.Sensor(noise=0.01, bias=0.01),
    foot_force=hp.sensors.Sensor(quantisation=0.5),
    delay=0.004,
)


def make(**task: Any) -> hp.rl.WalkEnv:
    hp.rl  # noqa: B018  # registers it
    return gymnasium.make(ID, **task).unwrapped


@pytest.mark.parametrize(
    "task",
    [
        {},
        {"robot": "athena", "bumps": 0.01, "sensors": NOISY, "observe": ALL_OBSERVED},
        WALK | {"step": 2e-3, "turn_rate": 0.1, "slope": (0.0, 0.1)},
    ],
)
def test_the_checker_of_gymnasium_finds_nothing(task: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(**task))


RANDOM: dict[str, Any] = {
    "bumps": (0.0, 0.02), "sensors": NOISY, "speed": (0.05, 0.12), "turn_rate": (-0.3, 0.3),
    "action_scale": 1.2, "duration": 0.6, "accuracy": 1e-2, "largest_tilt": 0.06,
}  # fmt: skip
"""Violent actions: some episodes end in a fall, others by their time: clocks drift apart."""


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_vector_environment_has_the_bits_of_single_ones(mode: str) -> None:
    count = 3
    many = gymnasium.make_vec(ID, count, autoreset_mode=mode, threads=2, **RANDOM)
    one_by_one = SyncVectorEnv([lambda: gymnasium.make(ID, **RANDOM)] * count, autoreset_mode=mode)
    same(many.reset(seed=5), one_by_one.reset(seed=5))
    rng, fell, timed = np.random.default_rng(0), 0, 0
    for _ in range(50 if mode == "NextStep" else 34):
        actions = rng.uniform(-1.0, 1.0, many.action_space.shape).astype(np.float32)
        found = many.step(actions)
        same(found, one_by_one.step(actions))
        fell, timed = fell + found[2].sum(), timed + found[3].sum()
        over = found[2] | found[3]
        if mode == "Disabled" and over.any():
            mask = [env.reset(options={"reset_mask": over.copy()}) for env in (many, one_by_one)]
            same(*mask)
    assert fell > 0 and timed > 0, (fell, timed)
    assert len({walker.tick for walker in many.walkers}) > 1


def same(first: Any, second: Any) -> None:
    if isinstance(first, dict):
        assert first.keys() == second.keys()
        for name in first:
            same(first[name], second[name])
    elif isinstance(first, tuple):
        for pair in zip(first, second, strict=True):
            same(*pair)
    elif isinstance(first, np.ndarray) and first.dtype == object:
        same(tuple(first), tuple(second))
    elif first is None:
        assert second is None
    else:
        assert np.array_equal(first, second) and np.asarray(first).dtype == np.asarray(second).dtype


def test_a_planned_gait_walks_at_the_commanded_speed_and_earns_what_is_documented() -> None:
    env = make(**WALK, speed=(0.06, 0.12), duration=4.0)
    _, drawn = env.reset(seed=1)
    returned, over, steps = 0.0, False, 0
    while not over:
        _, reward, terminated, over, info = env.step(np.zeros(18, dtype=np.float32))
        terms = [value for name, value in info.items() if name.startswith("reward_")]
        assert reward == pytest.approx(sum(terms), abs=1e-15)
        returned, steps = returned + reward, steps + 1
        assert not terminated
    assert steps == 200 and info["time"] == pytest.approx(4.0, abs=1e-12)
    walked = drawn["speed"] * 4.0  # less the start from rest: a cycle at 0.5 to 1 of its speed
    assert 0.8 * walked < info["x"] < walked
    assert 0.8 * 1.5 * 4.0 < returned < 1.5 * 4.0


def test_a_fall_ends_an_episode_and_costs() -> None:
    env = make(action_scale=1.2, reward={"fall": 7.0}, observe=["gravity", "heading"])
    env.reset(seed=0)
    over, action = False, np.zeros(18)
    for leg in ("lf", "lm", "lr"):  # they fold upwards
        action[env.walker.robot.joint_index(f"{leg}_femur_joint")] = -1.0
    while not over:
        seen, reward, over, truncated, info = env.step(action)
        assert not truncated
    assert info["fell"] and not info["invalid"] and info["reward_fall"] == -7.0 and reward < -6.0
    assert seen.shape == (4,) and np.linalg.norm(seen[:3]) == pytest.approx(1.0, abs=1e-12)
    with refused(ParameterError, "WalkEnv.step"):
        env.step(action)


def test_an_invalid_state_ends_an_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    env = make(duration=2.0)
    env.reset(seed=0)
    monkeypatch.setattr(type(env.walker.task.settings), "evaluations", 300.0)
    env.reset(seed=0)
    for _ in range(100):
        seen, reward, terminated, _, info = env.step(np.full(18, 0.5))
        if terminated:
            break
    assert info["invalid"] and not info["fell"] and np.isfinite(seen).all()
    assert math.isfinite(reward) and info["reward_fall"] == -1.0


def test_a_recorded_episode_is_a_trace() -> None:
    env = make(record=True, duration=0.2)
    env.reset(seed=0)
    for _ in range(10):
        *_, info = env.step(np.zeros(18))
    trace = env.trace()
    assert trace.time[-1] == pytest.approx(0.2) and trace.q[-1, 0] == info["x"]
    with refused(ParameterError, "record"):
        make().trace()
    for one in (env, hp.rl.WalkVectorEnv()):
        with refused(NotPicklableError, about=("its arguments",)):
            copy.deepcopy(one)


def test_what_is_no_setting_cannot_walk_or_is_no_action_is_refused() -> None:
    for wrong, name in (
        ({"speed": (0.2, 0.1)}, "WalkTask.speed"),
        ({"duration": 0.05}, "WalkTask.duration"),
        ({"observe": ["q", "q"]}, "WalkTask.observe"),
        ({"sensors": hp.sensors.Sensors(delay=0.5)}, "WalkTask.sensors.delay"),
        ({"action": "gait", "turn_rate": (0.0, 0.1)}, "WalkTask.heading, turn_rate"),
        ({"render_mode": "human"}, "WalkEnv.render_mode"),
    ):
        with refused(ParameterError, name):
            hp.rl.WalkEnv(**wrong)
    with refused(GaitError, quantity="speed"):
        hp.rl.WalkEnv(speed=5.0)
    ramp = hp.Scene(hp.load_robot("kharagpur"), terrain=hp.terrain.Ramp(angle=0.1, run=1.0))
    with refused(ParameterError, "Scene.terrain", "ramp"):
        hp.rl.WalkEnv(ramp, slope=0.1)
    many = hp.rl.WalkVectorEnv(2, ramp, duration=0.04)
    with refused(ParameterError, "step"):
        many.step(np.zeros((2, 18)))
    many.reset(seed=0)
    with refused(ParameterError, "WalkVectorEnv.step.actions", (18,)):
        many.step(np.zeros(18))
    with refused(ParameterError, "action"):
        many.step(np.full((2, 18), np.nan))
    for name, value in (("num_envs", 0), ("autoreset_mode", "Never")):
        with refused(ParameterError, f"WalkVectorEnv.{name}", value):
            hp.rl.WalkVectorEnv(**{name: value})
