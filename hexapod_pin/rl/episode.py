"""Episodes of a walking task: what each draws, what is observed of it, what it earns, its end.

Environments hold one episode at a time each; those that are at the same step advance in lock-step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feasible_gait import default_gait, fit_gait
from hexapod_pin.control.feedback import Command, Measurement
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.walk_plan import WalkPlan
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Flat, HeightField, Plane, Slope
from hexapod_pin.rl.task import OFFSET_SCALE, SET_POINT_SCALE, Range, WalkTask, ends
from hexapod_pin.robot.holding_torque import STANDARD_GRAVITY
from hexapod_pin.robot.robot import Robot, leg_length, load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.control_loop import LockStep, without_time
from hexapod_pin.simulation.native_run import NativeRun
from hexapod_pin.simulation.plant import starting_point
from hexapod_pin.simulation.session import live_run

if TYPE_CHECKING:
    from hexapod_pin.control.sensors import SensorReader
    from hexapod_pin.results.trace import Trace

LARGEST = 10.0
"""Observations are limited to this size, in their scales [-]."""

FIELDS, WAVELENGTH, MARGIN, LEVEL_RADIUS = 32, 0.3, 2.0, 0.1
"""Of random hills: how many fields, distance between hills, width of a field beyond the path to
either side, and the radius of the level place at the start [m]."""

RATE, TORQUE = 6.0, 10.0
"""Scales of joints without limits of their own [rad/s, N m]."""


Info = dict[str, float | bool]
"""What a step or a reset gives besides [SI units]."""


class Outcome(NamedTuple):
    """What a step gives: as `gymnasium.Env.step`."""

    observation: Array
    reward: float
    terminated: bool
    truncated: bool
    info: Info


class Walker:
    """A robot, a task, and the episode that is under way.

    Attributes:
        task: what is to be done.
        scene: robot, ground, contact and drives, before an episode changes them.
        scales: of the parts of an observation, name -> (size,), in their order.
        driven: the joints that an action moves, as places in `Robot.joint_names`. Shape (m,).
    """

    def __init__(
        self, robot: str | Path | Robot | Scene, task: WalkTask, *, record: bool = False
    ) -> None:
        """Plan what all episodes share.

        Raises:
            GaitError: the robot has no legs for a gait, or cannot walk so fast.
            ParameterError: hills or a slope on a ground that is not level; or a feedback run that
                the scene does not allow.
        """
        if isinstance(robot, Scene):
            self.scene = robot
        else:
            self.scene = Scene(robot if isinstance(robot, Robot) else load_robot(robot))
        self.task, self.record, self.robot = task, record, self.scene.robot
        uneven = ends(task.slope)[1] > 0.0 or ends(task.bumps)[1] > 0.0
        if uneven and self.scene.terrain != Flat():
            value, allowed = self.scene.terrain.kind, "Flat() where a task has a slope or bumps"
            raise ParameterError("Scene.terrain", value, allowed)
        self.gait = self._gait()
        self.speed = (0.5 * self.gait.speed, self.gait.speed)
        if task.speed is not None:
            self.speed = ends(task.speed)
        held = [name not in self.robot.held for name in self.robot.joint_names]
        self.driven = np.flatnonzero(held)
        usual = SET_POINT_SCALE if task.action == "set-points" else OFFSET_SCALE
        scale = task.action_scale or usual
        self.reach = np.where(self.robot.turning, scale, scale * leg_length(self.robot))
        self.power_scale = self.scene.total_mass * STANDARD_GRAVITY * self.speed[1]
        self.scales = {name: self._scale(name) for name in task.observe}
        self.plan = WalkPlan(self.robot, self.gait) if task.action == "gait" else None
        self.run: NativeRun | None = None
        self.tick, self.over, self.action = 0, False, np.zeros(len(self.driven))

    def another(self) -> Walker:
        """Return a walker of the same robot and task, with an episode of its own."""
        other = copy(self)
        other.run = None
        return other

    def _gait(self) -> Gait:
        """Return the gait at the largest commanded speed."""
        task = self.task
        top = None if task.speed is None else ends(task.speed)[1]
        if isinstance(task.gait, Gait):
            given = task.gait
            if task.cycle_time is not None:
                given = given.with_changes(cycle_time=task.cycle_time)
            if top is not None and given.stroke > 0.0:
                given = given.with_changes(cycle_time=given.stroke / (given.duty * top))
            return given
        fields: dict[str, float] = {}
        if task.action == "gait":
            fields = {"heading": ends(task.heading)[0], "turn_rate": ends(task.turn_rate)[0]}
        name = task.gait or default_gait(self.robot)
        return fit_gait(self.robot, name, cycle_time=task.cycle_time, speed=top, **fields).gait

    def _scale(self, name: str) -> Array:
        """Return the scales of a part of an observation; its size is theirs."""
        robot, feet = self.robot, len(self.robot.feet)
        speed, weight = self.speed[1], self.scene.total_mass * STANDARD_GRAVITY
        rate = np.where(robot.velocity_limit > 0.0, robot.velocity_limit, RATE)
        effort = np.where(robot.effort_limit > 0.0, robot.effort_limit, TORQUE)
        finite = np.isfinite(effort)
        scales = {
            "command": np.array([speed, speed, 1.0]), "gravity": np.ones(3),
            "angular_velocity": np.ones(3), "heading": np.ones(1), "phase": np.ones(2),
            "q": np.ones(len(rate)), "v": np.where(np.isfinite(rate), rate, RATE),
            "loaded": np.ones(feet), "action": np.ones(len(self.driven)),
            "torque": np.where(finite, effort, TORQUE), "acceleration": np.full(3, 9.81),
            "foot_force": np.full(3 * feet, weight),
        }  # fmt: skip
        return scales[name]

    @property
    def size(self) -> int:
        """Numbers in an observation [-]."""
        return sum(map(len, self.scales.values()))

    # An episode begins.

    def start(self, rng: np.random.Generator) -> tuple[Array, Info]:
        """Begin an episode; return its first observation and what it has drawn.

        The numbers are drawn in one order, each also where its range is a single one.
        """
        task = self.task
        speed, heading, turn = (draw(rng, x) for x in (self.speed, task.heading, task.turn_rate))
        friction = draw(rng, 0.0 if task.friction is None else task.friction)
        slope, bumps = draw(rng, task.slope), draw(rng, task.bumps)
        rise, field = float(rng.uniform(-math.pi, math.pi)), int(rng.integers(FIELDS))
        case = int(rng.integers(2**63))
        contact = self.scene.contact
        scene = replace(
            self.scene,
            terrain=self._terrain(slope, rise, bumps, field),
            contact=contact if task.friction is None else contact.with_mu(friction),
        )
        if task.action == "gait":  # its path has one radius
            turn *= speed / self.gait.speed if self.gait.speed > 0.0 else 1.0
        self.command = np.array([speed * math.cos(heading), speed * math.sin(heading), turn])
        self.pace = speed / self.gait.speed if self.gait.speed > 0.0 else 1.0
        self._begin(scene)
        self.reader: SensorReader = task.sensors.start([case])
        self.reading = self._read(LockStep([self._running]).measure(), 0)
        drawn = {
            "speed": speed, "direction": heading, "turn_rate": turn, "slope": slope, "bumps": bumps,
            "friction": scene.contact.friction.limit,
        }  # fmt: skip
        return self._observation(), {**drawn, **self._place()}

    def _terrain(self, slope: float, rise: float, bumps: float, field: int) -> Any:
        """Return the ground of an episode."""
        if bumps > 0.0:
            size = 2.0 * (self.speed[1] * self.task.duration + MARGIN)
            return HeightField.random(
                field, amplitude=bumps, wavelength=WAVELENGTH, size=size, flat_radius=LEVEL_RADIUS
            )
        return Slope(angle=slope, heading=rise) if slope > 0.0 else self.scene.terrain

    def _begin(self, scene: Scene) -> None:
        """Put the robot onto its feet."""
        start = starting_point(scene, self.robot.posture, None)
        self.run = live_run(scene, self.task.settings, start, record=self.record)
        self.surface = scene.terrain.surface()
        is_plane = isinstance(self.surface, Plane)
        self.up = self.surface.normal_at(0.0, 0.0) if is_plane else np.array([0.0, 0.0, 1.0])
        self.tick, self.pose = 0, start.q[:7]
        self.height = max(1e-6, self._height(start.q))
        self.action = np.zeros(len(self.driven))
        self.over = False

    def _height(self, pose: Array) -> float:
        return float(pose[2]) - float(self.surface.height_at(pose[0], pose[1]))

    @property
    def _running(self) -> NativeRun:
        """The run under way.

        Raises:
            ParameterError: none has begun.
        """
        if self.run is None:
            raise ParameterError("step", "before the first reset", "called after reset()")
        return self.run

    # A step.

    def limited(self, action: Array) -> Array:
        """Return an action, limited to -1 to 1. Shape (m,).

        Raises:
            ParameterError: it has another shape or is not finite, or no episode has begun.
        """
        _ = self._running
        if action.shape != self.action.shape:
            raise ParameterError("action", action.shape, f"of shape {self.action.shape}")
        if not np.isfinite(action).all():
            raise ParameterError("action", action, "finite")
        return np.clip(action, -1.0, 1.0)

    def set_points(self, action: Array) -> Array:
        """Return the joint angles that an action requests at the end of its step. Shape (n,)."""
        q = self.robot.posture.copy()
        if self.plan is not None:
            q = _planned(self.plan, self.task.period * self.pace, self.task.steps)[
                self.tick + 1
            ].copy()
        q[self.driven] += self.reach[self.driven] * action
        return np.clip(q, self.robot.lower, self.robot.upper)

    def finish(self, action: Array, measured: Measurement, truth: Measurement) -> Outcome:
        """Return what a step has led to.

        Args:
            action: of the step, as limited.
            measured: at the time at which the sensors read, without noise.
            truth: at the end of the step.
        """
        self.tick += 1
        last, self.action = self.action, action
        run, before = self._running, self.pose
        if run.good:
            self.pose = np.array(run.rollout.checkpoint().q[:7])
            self.reading = self._read(measured, self.tick)
        rotation = rotation_of(self.pose)
        tilt = math.acos(max(-1.0, min(1.0, float(rotation[:, 2] @ self.up))))
        low = self._height(self.pose) < self.task.least_height * self.height
        fell = bool(tilt > self.task.largest_tilt or low)
        terminated = fell or not run.good
        truncated = not terminated and self.tick >= self.task.steps
        change = math.fsum((x - y) ** 2 for x, y in zip(action, last, strict=True))
        terms = self._rewards(before, rotation, tilt, truth, change)
        terms["fall"] = -self.task.reward.fall if terminated else 0.0
        self.over = terminated or truncated
        info: Info = {f"reward_{name}": value for name, value in terms.items()}
        info |= {**self._place(), "tilt": tilt, "fell": fell, "invalid": not run.good}
        reward = math.fsum(terms.values())
        return Outcome(self._observation(), reward, terminated, truncated, info)

    def _rewards(
        self, before: Array, rotation: Array, tilt: float, truth: Measurement, change: float
    ) -> dict[str, float]:
        """Return the terms of the reward of a step but for a fall; see `RewardWeights`."""
        weights, period = self.task.reward, self.task.period
        yaw = yaw_of(rotation_of(before))
        forward, left = (float(x) / period for x in self.pose[:2] - before[:2])
        cos, sin = math.cos(yaw), math.sin(yaw)
        off = math.hypot(
            cos * forward + sin * left - self.command[0],
            cos * left - sin * forward - self.command[1],
        )
        turned = wrapped(yaw_of(rotation) - self.command[2] * self.tick * period)
        power = math.fsum(abs(x * y) for x, y in zip(truth.torque, truth.v, strict=True))
        width = weights.velocity_width * self.speed[1]
        return {
            "velocity": weights.velocity * period * math.exp(-((off / width) ** 2)),
            "heading": weights.heading
            * period
            * math.exp(-((turned / weights.heading_width) ** 2)),
            "tilt": -weights.tilt * period * math.sin(tilt) ** 2,
            "power": -weights.power * period * power / self.power_scale,
            "smoothness": -weights.smoothness * period * change / max(1, len(self.action)),
        }

    def _place(self) -> dict[str, float]:
        return {"x": float(self.pose[0]), "y": float(self.pose[1]), "time": self._running.time}

    def _read(self, measured: Measurement, tick: int) -> Measurement:
        """Return what the sensors read of a measurement with a leading axis of one."""
        return without_time(self.reader.read(tick, measured), 0)

    def _observation(self) -> Array:
        """Return the parts of an observation in their scales. Shape (size,)."""
        m, time = self.reading, self.tick * self.task.period
        turned = wrapped(yaw_of(m.rotation) - self.command[2] * time)
        phase = 2.0 * math.pi * math.fmod(time * self.pace / self.gait.cycle_time, 1.0)
        parts = {
            "command": self.command, "gravity": -m.rotation[2],
            "angular_velocity": m.angular_velocity, "heading": (turned,),
            "phase": (math.sin(phase), math.cos(phase)), "q": m.q - self.robot.posture, "v": m.v,
            "loaded": m.loaded, "action": self.action, "torque": m.torque,
            "acceleration": m.acceleration, "foot_force": m.foot_force.ravel(),
        }  # fmt: skip
        row = np.concatenate([np.divide(parts[name], scale) for name, scale in self.scales.items()])
        limited: Array = np.clip(row, -LARGEST, LARGEST)
        return limited

    def trace(self) -> Trace:
        """Return the samples of the episode so far.

        Raises:
            ParameterError: it is not recorded, or none has begun.
        """
        if not self.record:
            raise ParameterError("record", False, "True, so that there are samples")
        return self._running.trace()


def advance(walkers: Sequence[Walker], actions: Sequence[Array], threads: int = 1) -> list[Outcome]:
    """Advance episodes by a step, in lock-step where they are at the same one.

    The bits of an episode do not depend on the others, nor on the number of threads.

    Raises:
        ParameterError: an action of a wrong shape, or not finite; nothing has advanced then.
    """
    chosen = [one.limited(action) for one, action in zip(walkers, actions, strict=True)]
    groups: dict[int, list[int]] = {}
    for k, walker in enumerate(walkers):
        groups.setdefault(walker.tick, []).append(k)
    share = max(1, threads // len(groups))

    def advanced(group: list[int]) -> list[Outcome]:
        return _advanced([walkers[k] for k in group], [chosen[k] for k in group], share)

    if threads > 1 and len(groups) > 1:
        with ThreadPoolExecutor(min(threads, len(groups))) as pool:
            done = list(pool.map(advanced, groups.values()))
    else:
        done = [advanced(group) for group in groups.values()]
    found: dict[int, Outcome] = {}
    for group, outcomes in zip(groups.values(), done, strict=True):
        found |= dict(zip(group, outcomes, strict=True))
    return [found[k] for k in range(len(walkers))]


def _advanced(walkers: list[Walker], actions: list[Array], threads: int) -> list[Outcome]:
    """Advance episodes that are at the same step."""
    task, together = walkers[0].task, LockStep([one._running for one in walkers], threads)
    end, late = (walkers[0].tick + 1) * task.period, task.sensors.delay
    rows = np.stack([one.set_points(x) for one, x in zip(walkers, actions, strict=True)])
    together.command(Command(rows, ramp=True), task.period, "action")
    if late > 0.0:
        together.advance(max(together.time, end - late))
        measured = together.measure()
        together.advance(end)
        truth = together.measure()
    else:
        together.advance(end)
        measured = truth = together.measure()
    return [
        one.finish(action, _row(measured, k), without_time(truth, k))
        for k, (one, action) in enumerate(zip(walkers, actions, strict=True))
    ]


def _row(measurement: Measurement, row: int) -> Measurement:
    """Return one run's part of a measurement, with a leading axis of one."""
    fields = {
        name: value[row : row + 1] for name, value in vars(measurement).items() if name != "time"
    }
    return replace(measurement, **fields)


@lru_cache(maxsize=8)
def _planned(plan: WalkPlan, period: float, steps: int) -> Array:
    """Return the set-points of a plan at the ends of all steps, row 0 at the start [rad]."""
    return plan.at(period * np.arange(steps + 1)).q


def draw(rng: np.random.Generator, value: Range) -> float:
    """Return a number from a range."""
    return float(rng.uniform(*ends(value)))


def wrapped(angle: float) -> float:
    """Return an angle within half a turn [rad]."""
    return math.remainder(angle, 2.0 * math.pi)


def yaw_of(rotation: Array) -> float:
    """Return the heading of a trunk, the angle of its x axis in the horizontal plane [rad]."""
    return math.atan2(float(rotation[1, 0]), float(rotation[0, 0]))


def rotation_of(pose: Array) -> Array:
    """Return the rotation (3, 3) of a pose: place [m], quaternion x, y, z, w. Shape (7,)."""
    x, y, z, w = (float(part) for part in pose[3:7])
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ])  # fmt: skip
