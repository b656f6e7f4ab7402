"""Environments of gymnasium for a walking task: one robot, or many in lock-step."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import MissingPackageError, NotPicklableError, ParameterError
from hexapod_pin.rl.episode import LARGEST, Walker, advance
from hexapod_pin.rl.task import WalkTask
from hexapod_pin.robot.robot import Robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.batch import check_threads

try:
    import gymnasium
    from gymnasium.utils import seeding
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise MissingPackageError("gymnasium", "rl", "hexapod_pin.rl") from error

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace

Steps = tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]
"""What a step of a vector environment returns, a row for each environment."""


def spaces_of(walker: Walker) -> tuple[Any, Any]:
    """Return the spaces of observations (size,) and of actions (m,), a `Box` each."""
    observed = gymnasium.spaces.Box(-LARGEST, LARGEST, (walker.size,), np.float64)
    return observed, gymnasium.spaces.Box(-1.0, 1.0, (len(walker.driven),), np.float32)


@checked
class WalkEnv(gymnasium.Env[Array, Array]):
    """A robot that is to walk as it is commanded; `WalkTask` describes the task.

    Equal seeds and actions give equal bits on one machine. Observations, actions and rewards have
    no unit: they are divided by the scales of docs/learning.md.

    Attributes:
        walker: robot, task and the episode under way.

    Example:
        >>> env = gymnasium.make("hexapod_pin/Walk-v0", robot="kharagpur", action="gait")
        >>> observation, info = env.reset(seed=1)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        robot: str | Path | Robot | Scene = "kharagpur",
        *,
        record: bool = False,
        render_mode: str | None = None,
        **task: Any,
    ) -> None:
        """Plan what all episodes share.

        Args:
            robot: its name or file; or a scene with it, whose contact, servos and loads are taken.
            record: whether `trace` has the samples of the episode under way.
            render_mode: None; a recorded episode is looked at with `hp.view`.
            task: the fields of `WalkTask`.

        Raises:
            ParameterError: a field out of range, or settings that do not fit together.
            GaitError: the robot has no legs for a gait, or cannot walk so fast.
            UrdfError, UnknownNameError: of the robot's file.
        """
        if render_mode is not None:
            hint = "WalkEnv(record=True).trace() is what hp.view shows."
            raise ParameterError("WalkEnv.render_mode", render_mode, "None", hint)
        self.render_mode = None
        self.walker = Walker(robot, WalkTask(**task), record=record)
        self.observation_space, self.action_space = spaces_of(self.walker)

    def __reduce__(self) -> tuple[Any, ...]:
        """Refuse a pickle or a copy: the run is the native core's.

        Raises:
            NotPicklableError: names what to send instead.
        """
        raise NotPicklableError("WalkEnv", "its arguments", "Make the environment there.")

    @property
    def integration(self) -> str:
        """Method, and accuracy or step, of the integration, as text."""
        return self.walker.task.integration

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; its command, ground and friction are drawn.

        Args:
            seed: of the random numbers of this and later episodes; None: they go on.
            options: none are known.

        Returns:
            The observation, and what was drawn: "speed" [m/s], "direction" [rad], "turn_rate"
            [rad/s], "friction" [-], "slope" [rad], "bumps" [m]; with "x", "y" [m], "time" [s].
        """
        super().reset(seed=seed)
        return self.walker.start(self.np_random)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Advance by a period.

        Args:
            action: limited to -1 to 1. Shape (m,).

        Returns:
            Observation, reward, whether the robot has fallen or its state is no longer valid,
            whether the time is over, and the terms of the reward as "reward_velocity" and so on,
            with "x", "y" [m], "time" [s], "tilt" [rad], "fell", "invalid".

        Raises:
            ParameterError: a wrong shape, not finite, or no episode is under way.
        """
        if self.walker.over:
            raise ParameterError("WalkEnv.step", "after the end of an episode", "after reset()")
        (found,) = advance([self.walker], [np.asarray(action, dtype=float)])
        return found

    def trace(self) -> Trace:
        """Return the samples of the episode so far, as `hp.simulate` returns them.

        Raises:
            ParameterError: the environment does not record, or no episode has begun.
        """
        return self.walker.trace()


@checked
class WalkVectorEnv(VectorEnv[Array, Array, Any]):
    """Many robots that walk in lock-step, each with the bits of a `WalkEnv` of its own.

    Environment k of `reset(seed=s)` is `WalkEnv` with the seed s + k.

    Attributes:
        walkers: robot, task and episode of each.
    """

    def __init__(
        self,
        num_envs: int = 1,
        robot: str | Path | Robot | Scene = "kharagpur",
        *,
        threads: int = 1,
        autoreset_mode: str | AutoresetMode = "NextStep",
        render_mode: str | None = None,
        **task: Any,
    ) -> None:
        """Plan what all episodes share; other arguments as of `WalkEnv`.

        Args:
            num_envs: how many.
            robot: as of `WalkEnv`.
            threads: how many advance at a time; the bits do not depend on it.
            autoreset_mode: one of gymnasium's: "NextStep", "SameStep" or "Disabled".
            render_mode: None.
            task: the fields of `WalkTask`.

        Raises:
            ParameterError: a number or mode out of range, or as of `WalkEnv`.
            GaitError, UrdfError, UnknownNameError: as of `WalkEnv`.
        """
        if not 1 <= num_envs <= MOST:
            raise ParameterError("WalkVectorEnv.num_envs", num_envs, f"from 1 to {MOST}")
        if render_mode is not None:
            raise ParameterError("WalkVectorEnv.render_mode", render_mode, "None")
        check_threads(threads)
        modes = [mode.value for mode in AutoresetMode]
        if not isinstance(autoreset_mode, AutoresetMode) and autoreset_mode not in modes:
            allowed = f"one of {', '.join(modes)}"
            raise ParameterError("WalkVectorEnv.autoreset_mode", autoreset_mode, allowed)
        self.num_envs, self.threads = num_envs, threads
        self.mode = AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.mode}
        self.render_mode = None
        first = Walker(robot, WalkTask(**task))
        self.walkers = [first, *(first.another() for _ in range(num_envs - 1))]
        self.single_observation_space, self.single_action_space = spaces_of(first)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._observations = np.zeros((num_envs, first.size))

    def __reduce__(self) -> tuple[Any, ...]:
        """Refuse a pickle or a copy: the run is the native core's.

        Raises:
            NotPicklableError: names what to send instead.
        """
        raise NotPicklableError("WalkVectorEnv", "its arguments", "Make the environment there.")

    @property
    def integration(self) -> str:
        """Method, and accuracy or step, of the integration, as text."""
        return self.walkers[0].task.integration

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode in each environment.

        Args:
            seed: s + k of environment k, or one for each; None: their random numbers go on.
            options: "reset_mask", which of the environments are reset. Shape (num_envs,).

        Returns:
            Observations (num_envs, size), and the infos of `WalkEnv.reset` as arrays.

        Raises:
            ParameterError: another number of seeds than of environments, or a bad mask.
        """
        seeds: list[int | None] = seed if isinstance(seed, list) else [None] * self.num_envs
        if isinstance(seed, int):
            seeds = [seed + k for k in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ParameterError("WalkVectorEnv.reset.seed", seed, f"{self.num_envs} of them")
        mask = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
            allowed = f"a mask of shape ({self.num_envs},), one of them True"
            raise ParameterError("WalkVectorEnv.reset.options.reset_mask", mask, allowed)
        infos: dict[str, Any] = {}
        for k in map(int, np.flatnonzero(mask)):
            if seeds[k] is not None or self._generators[k] is None:
                self._generators[k], _ = seeding.np_random(seeds[k])
            infos = self._add_info(infos, self._start(k), k)
        return self._observations.copy(), infos

    def _start(self, k: int) -> dict[str, Any]:
        """Begin an episode in one environment; return its info."""
        rng = self._generators[k]
        if rng is None:
            raise ParameterError("WalkVectorEnv.step", "before the first reset", "after reset()")
        self._observations[k], info = self.walkers[k].start(rng)
        return info

    def step(self, actions: Array) -> Steps:
        """Advance all environments by a period, or reset those whose episode has ended.

        Args:
            actions: shape (num_envs, m); the row of an environment that is reset is not used.

        Returns:
            As `WalkEnv.step`, a row each.

        Raises:
            ParameterError: a wrong shape, not finite, or a step before the first reset or, with
                "Disabled", after the end of an episode.
        """
        rows = np.asarray(actions, dtype=float)
        if rows.shape != self.action_space.shape:
            allowed = f"of shape {self.action_space.shape}"
            raise ParameterError("WalkVectorEnv.step.actions", rows.shape, allowed)
        over = [walker.over for walker in self.walkers]
        if any(over) and self.mode is AutoresetMode.DISABLED:
            allowed = "reset with options={'reset_mask': ...} after the end of an episode"
            raise ParameterError("WalkVectorEnv.step", np.flatnonzero(over).tolist(), allowed)
        going = [k for k in range(self.num_envs) if not over[k]]
        acting, chosen = [self.walkers[k] for k in going], list(rows[going])
        outcomes = advance(acting, chosen, self.threads)
        found, infos = dict(zip(going, outcomes, strict=True)), dict[str, Any]()
        rewards = np.zeros(self.num_envs)
        ended = np.zeros((2, self.num_envs), dtype=bool)
        for k in range(self.num_envs):
            if k not in found:
                infos = self._add_info(infos, self._start(k), k)
                continue
            self._observations[k], rewards[k], *ended[:, k], info = found[k]
            if self.walkers[k].over and self.mode is AutoresetMode.SAME_STEP:
                final = {"final_obs": found[k].observation, "final_info": info}
                infos, info = self._add_info(infos, final, k), self._start(k)
            infos = self._add_info(infos, info, k)
        return self._observations.copy(), rewards, ended[0], ended[1], infos


MOST = 4096
"""Environments of one vector environment [-]."""
